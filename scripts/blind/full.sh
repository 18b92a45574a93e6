#!/usr/bin/env bash
# The whole withheld-effect check: environment, release build, cases, diagnoses, table. Usage: full.sh [DIR] [PER_CLASS] [SEED]
set -euo pipefail
cd "$(dirname "$0")/../.."
dir=${1:-target/blind}
scripts/venv.sh
cargo build --release --quiet
.venv/bin/python scripts/blind/generate.py --out "$dir" --per-class "${2:-20}" --seed "${3:-1}"
.venv/bin/python scripts/blind/run.py --cases "$dir" --report "$dir/result.md"
