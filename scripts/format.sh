#!/usr/bin/env bash
# Formats every source file, or with --check says which are not. `cargo fmt` alone goes from module to module and misses
# those that a macro declares (the effects, the rules of the validator) and the crate in tests/importers.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo fmt --all -- "$@"
find build.rs src crates tests benches -name '*.rs' -print0 | xargs -0 rustfmt --edition 2024 "$@"
