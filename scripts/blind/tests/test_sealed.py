"""A small sealed set, drawn anew by the independent plant, diagnosed by the program as built for the other tests."""
import json
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
BLIND = ROOT / "scripts" / "blind"
CLASSES = "coulomb_motor,presliding_table,backlash,torque_ripple,actuator_lag,flexible_mode,none,parameters,pairs,triples"


@pytest.fixture(scope="module")
def program() -> pathlib.Path:
    built = subprocess.run(["cargo", "build", "--locked", "--quiet", "--bin", "eixo", "--message-format", "json"],
                           cwd=ROOT, check=True, capture_output=True, text=True).stdout
    made = [json.loads(line).get("executable") for line in built.splitlines()]
    return pathlib.Path(next(path for path in made if path))


def test_every_withheld_cause_of_a_small_set_is_named(program, tmp_path):
    subprocess.run([sys.executable, BLIND / "generate.py", "--out", tmp_path, "--classes", CLASSES, "--per-class", "1",
                    "--seed", "4242"], check=True)
    ran = subprocess.run([sys.executable, BLIND / "run.py", "--cases", tmp_path, "--eixo", program, "--no-without",
                          "--need", "family=0.99", "--need", "place=0.99", "--need", "false_alarms=0", "--need", "closure_share=0.99",
                          "--need", "pairs=1", "--need", "triples=1"],
                         capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
