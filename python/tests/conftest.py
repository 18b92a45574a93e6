"""The module as installed, with its own program; else that of the sources, with the program that cargo builds or EIXO_PROGRAM names."""
import importlib.util
import json
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
INSTALLED = importlib.util.find_spec("eixo") is not None
sys.path[:0] = [str(ROOT / "scripts")] if INSTALLED else [str(ROOT / "scripts"), str(ROOT / "python")]


@pytest.fixture(scope="session", autouse=True)
def program():
    if not INSTALLED and "EIXO_PROGRAM" not in os.environ:
        command = ["cargo", "build", "--locked", "--quiet", "--bin", "eixo", "--message-format", "json"]
        built = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
        made = [json.loads(line).get("executable") for line in built.splitlines()]
        os.environ["EIXO_PROGRAM"] = next(path for path in made if path)
