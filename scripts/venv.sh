#!/usr/bin/env bash
# Makes .venv in the project root from the pinned scripts/requirements.txt; does nothing when it is already up to date.
set -euo pipefail
cd "$(dirname "$0")/.."
stamp=.venv/requirements.stamp
if [ -x .venv/bin/python ] && cmp -s scripts/requirements.txt "$stamp"; then exit 0; fi
[ -x .venv/bin/python ] || "${PYTHON:-python3}" -m venv .venv
.venv/bin/python -m pip install --quiet --disable-pip-version-check -r scripts/requirements.txt
cp scripts/requirements.txt "$stamp"
