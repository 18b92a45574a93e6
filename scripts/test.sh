#!/usr/bin/env bash
# Every test, with one command: the Python tests, then the Rust ones, whose summary ends the log. A failure in any of them is
# the exit status. What a machine lacks is named and left out: only cargo is needed for most of the tests.
set -euo pipefail
cd "$(dirname "$0")/.."

# Tests look in EIXO_DATA for measured traces and in EIXO_FMUS for Reference FMUs, which are not part of the project. What a test
# leaves out is listed at the end; with EIXO_SKIPS (names separated by blanks, empty for none) it may leave out nothing else.
failed=0
EIXO_SKIPPED=$(mktemp)
export EIXO_SKIPPED
trap 'rm -f "$EIXO_SKIPPED"' EXIT
allowed() { [ -z "${EIXO_SKIPS+set}" ] || [[ " $EIXO_SKIPS " = *" $1 "* ]]; }
if scripts/venv.sh; then
    # --color=no: a log is read by programs too.
    .venv/bin/python -m pytest --quiet --color=no -p no:cacheprovider scripts python || failed=1
else
    echo "SKIPPED: no Python environment (scripts/venv.sh), so neither the Python tests nor the other importers run" >&2
    allowed python || failed=1
fi

export CARGO_TERM_COLOR=${CARGO_TERM_COLOR:-never}
if cargo nextest --version >/dev/null 2>&1; then
    cargo nextest run --workspace --all-features --no-fail-fast --show-progress none --status-level fail --final-status-level fail || failed=1
else
    cargo test --workspace --all-features --no-fail-fast --lib --bins --tests || failed=1
fi
sort -u "$EIXO_SKIPPED" >&2
[ "$failed" = 0 ] || echo "FAILED: see above" >&2
exit "$failed"
