"""What other validators find of the FMUs that `eixo validate` is tested on, in one run.

Usage:
    EIXO_MUTANTS=target/mutants cargo test --test validate writes_the_mutants -- --ignored
    .venv/bin/python scripts/validators.py target/mutants ../shared/fmus [--eixo target/release/eixo]

The first folder holds FMUs that are broken, in a folder a group; the second sound ones (the Reference FMUs). Beside eixo:
fmpy.validation of FMPy, and the checkers of FMU Manipulation Toolbox, if it can be imported (`pip install
fmu-manipulation-toolbox==2.0`; another interpreter that has it may be named with --toolbox). Both look at the archive and
the XML. VDMCheck and the FMU Compliance Checker are in no package registry.

For eixo an FMU is found when a finding of any severity is of the rule that the file is named after, `rule--name.fmu`;
for the others when they complain of anything.
"""
import argparse
import json
import pathlib
import subprocess
import sys

TOOLBOX = """
import logging, sys
from fmu_manipulation_toolbox import checker
from fmu_manipulation_toolbox.operations import FMU
class Listen(logging.Handler):
    def emit(self, record):
        if record.levelno >= logging.ERROR: said.append(record.getMessage())
logging.getLogger().addHandler(Listen())
for path in sys.stdin.read().split("\\n"):
    said = []
    try:
        fmu = FMU(path)
        for check in checker.get_checkers():
            fmu.apply_operation(check() if isinstance(check, type) else check)
    except BaseException as error:
        said.append(repr(error))
    print(len(said), flush=True)
"""
FMPY = """
import sys
from fmpy.validation import validate_fmu
for path in sys.stdin.read().split("\\n"):
    try: said = validate_fmu(path)
    except BaseException as error: said = [repr(error)]
    print(len(said), flush=True)
"""


def listen(python, code, files):
    """How many complaints each file gets; None where the tool is not there."""
    done = subprocess.run([python, "-c", code], input="\n".join(map(str, files)), capture_output=True, text=True)
    # What the tool itself prints stands between.
    counts = [int(line) for line in done.stdout.splitlines() if line.strip().isdigit()]
    if len(counts) != len(files):
        print(f"SKIPPED: {python}: {done.stderr.strip().splitlines()[-1:]}", file=sys.stderr)
        return None
    return counts


def eixo(program, file, group):
    # What is broken in the archive or the XML is found without running anything.
    static = ["--static"] if "XML" in group else []
    done = subprocess.run([program, "validate", "--format", "json", *static, file], capture_output=True, text=True)
    if done.returncode == 2:
        return {"*"}, 0
    report = json.loads(done.stdout)
    grave = sum(f["severity"] != "note" for f in report["findings"])
    return {f["rule"] for f in report["findings"]}, grave


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("broken", type=pathlib.Path)
    parser.add_argument("sound", type=pathlib.Path)
    parser.add_argument("--eixo", default="target/release/eixo")
    parser.add_argument("--toolbox", default=sys.executable, help="a Python with fmu-manipulation-toolbox")
    args = parser.parse_args()
    print(f"{'':<28}{'FMUs':>6}{'eixo':>8}{'FMPy':>8}{'toolbox':>9}")
    groups = [(g.name, sorted(g.glob("*.fmu")), True) for g in sorted(args.broken.iterdir()) if g.is_dir()]
    groups += [(f"sound: {g.name}", sorted(g.glob("*.fmu")), False) for g in sorted(args.sound.iterdir()) if g.is_dir()]
    for name, files, broken in groups:
        found = 0
        for file in files:
            rules, grave = eixo(args.eixo, file, name)
            found += file.name.split("--")[0] in rules or "*" in rules if broken else grave > 0
        others = [listen(sys.executable, FMPY, files), listen(args.toolbox, TOOLBOX, files)]
        cells = ["-" if counts is None else str(sum(n > 0 for n in counts)) for counts in others]
        print(f"{name:<28}{len(files):>6}{found:>8}{cells[0]:>8}{cells[1]:>9}", flush=True)


if __name__ == "__main__":
    main()
