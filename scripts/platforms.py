"""Builds eixo with the FMU's library for linux64 and win64, packs both into one FMU, and tests both.

    python3 scripts/platforms.py [--release]

linux64 is linked against glibc 2.17 where zig is there (`pip install ziglang==0.13.0`, or a `zig` on the path), so that the FMU
loads on old distributions; objdump tells the glibc that the library asks for. win64 is built with rustup's target
x86_64-pc-windows-gnu and Debian's gcc-mingw-w64-x86-64-posix, and runs under wine. Both libraries are driven by one C program
(tests/importers/platform.c): instantiate, step, keep a state as bytes, go back to it; their traces must agree to 1e-12 of the largest
value of each output, with and without effects. Writes target/platforms/axis.fmu. What is missing is named and skipped; exit code 1
when something that is there fails. The standard library of Python is enough.
"""

import math
import os
import re
import shutil
import stat
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "target" / "platforms"
OLD_GLIBC = "2.17"
STEP = 5.626e-4
STEPS = 2048
TOLERANCE = 1e-12
OUTPUTS = ["theta1", "omega1", "alpha1", "theta2", "omega2", "alpha2", "x2"]
CASES = [
    {},
    {"coulomb_motor.level": 0.008, "backlash.half_gap": 0.01, "delay.time": 1.2e-3},
    {"presliding_table.level": 0.003, "torque_ripple.amplitude": 0.004, "cubic_stiffness.k3": 2.0, "lead_error.amplitude": 0.01},
]
MINGW, WINDOWS = "x86_64-w64-mingw32-gcc", "x86_64-pc-windows-gnu"


def run(*command, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise SystemExit(f"FAILED: {' '.join(str(c) for c in command)}: exit code {done.returncode}\n{done.stderr.strip()}")
    return done.stdout


def skip(what):
    print(f"SKIPPED: {what}", flush=True)


def zig(*pythons):
    """The command of zig, of one of these interpreters or the usual ones; or none."""
    for python in (*pythons, ROOT / ".venv" / "bin" / "python", Path(sys.executable)):
        if python.is_file() and subprocess.run([python, "-c", "import ziglang"], capture_output=True, check=False).returncode == 0:
            return f'"{python}" -m ziglang'
    return shutil.which("zig")


def old_linker(command, folder):
    """Writes a linker against the old glibc, by zig, into a folder; its path."""
    linker = folder / "zig-cc"
    linker.write_text(f'#!/bin/sh\nexec {command} cc -target x86_64-linux-gnu.{OLD_GLIBC} "$@"\n')
    linker.chmod(linker.stat().st_mode | stat.S_IXUSR)
    return str(linker)


def windows_lacks():
    """What is missing to build for Windows, and how to get it; nothing where it can be built."""
    standard = subprocess.run(
        ["rustc", "--print", "target-libdir", "--target", WINDOWS], capture_output=True, text=True, check=False
    )
    if standard.returncode != 0 or not Path(standard.stdout.strip()).is_dir():
        return f"no target {WINDOWS} (rustup target add {WINDOWS})"
    return "" if shutil.which(MINGW) else f"no {MINGW} (apt-get install gcc-mingw-w64-x86-64-posix)"


def build(release):
    """Builds eixo; the platforms in it and its path."""
    platforms, environment = ["linux64"], dict(os.environ)
    if command := zig():
        environment["EIXO_LINKER_LINUX64"] = old_linker(command, OUT)
    else:
        skip("linux64 against an old glibc: no zig (.venv/bin/python -m pip install ziglang==0.13.0)")
    if lacks := windows_lacks():
        skip(f"win64: {lacks}")
    else:
        environment["EIXO_PLATFORMS"] = "win64"
        platforms.append("win64")
    variables = " ".join(f"{k}={environment[k]}" for k in ("EIXO_PLATFORMS", "EIXO_LINKER_LINUX64") if k in environment)
    command = ["cargo", "build", "--quiet", "--locked", "--bin", "eixo"] + (["--release"] if release else [])
    print(f"$ {variables} {' '.join(command)}".replace(f"{ROOT}/", ""), flush=True)
    run(*command, cwd=ROOT, env=environment)
    built = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return platforms, built / ("release" if release else "debug") / "eixo"


def driver(compiler, name, *arguments):
    if not shutil.which(compiler):
        return None
    target = OUT / name
    run(compiler, "-O1", "-Wall", "-o", target, ROOT / "tests/importers/platform.c", *arguments)
    return target


def trace(command, library, guid, settings, **options):
    torque = (0.03 * math.sin(0.011 * k) + 0.02 * math.cos(0.17 * k) for k in range(STEPS))
    text = run(*command, library, guid, repr(STEP), *settings, input="\n".join(map(repr, torque)), **options)
    rows = [[float(cell) for cell in line.split()] for line in text.splitlines()]
    assert len(rows) == STEPS and all(len(row) == len(OUTPUTS) for row in rows), "the driver printed another table"
    return rows


def largest_difference(one, other):
    """Largest difference of any output, relative to that output's largest value."""
    return max(
        max(abs(a[k] - b[k]) for a, b in zip(one, other)) / max(abs(a[k]) for a in one) for k in range(len(OUTPUTS))
    )


def glibc(library):
    """The newest version of glibc that a program or library asks for, as (2, 17)."""
    return max(tuple(map(int, v.split("."))) for v in re.findall(r"GLIBC_([0-9.]+)", run("objdump", "-T", library)))


def main():
    if sys.platform != "linux" or os.uname().machine != "x86_64" or not shutil.which("cargo"):
        skip("this script builds on Linux on x86-64 with cargo")
        return 0
    OUT.mkdir(parents=True, exist_ok=True)
    platforms, eixo = build("--release" in sys.argv[1:])
    fmu = OUT / "axis.fmu"
    print(run(eixo, "export", fmu).strip().replace(f"{ROOT}/", ""))
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(OUT / "axis")
    description = ElementTree.parse(OUT / "axis" / "modelDescription.xml").getroot()
    guid = description.attrib["guid"]
    references = {v.attrib["name"]: v.attrib["valueReference"] for v in description.iter("ScalarVariable")}
    cases = [[f"{references[name]}={value!r}" for name, value in case.items()] for case in CASES]
    linux = OUT / "axis/binaries/linux64/eixo.so"
    if shutil.which("objdump"):
        print(f"linux64: runs with glibc {'.'.join(map(str, glibc(linux)))} and later")
    else:
        skip("the glibc that linux64 asks for: no objdump (apt-get install binutils)")
    native = driver("cc", "platform", "-ldl", "-lm")
    if native is None:
        skip("running the libraries: no C compiler (apt-get install gcc libc6-dev)")
        return 0
    traces = [trace([native], linux, guid, case) for case in cases]
    assert all(largest_difference(traces[0], t) > 1e-6 for t in traces[1:]), "an effect does nothing"
    print(f"linux64: {len(traces)} runs of {STEPS} steps, each rolled back from bytes to the bit")
    if "win64" not in platforms:
        return 0
    wine = shutil.which("wine64") or shutil.which("wine")
    if wine is None:
        skip("running win64: no wine (apt-get install wine64 wine)")
        return 0
    # No windows, no questions, and a prefix that goes with target/.
    environment = dict(os.environ, WINEPREFIX=str(OUT / "wine"), WINEDEBUG="-all", WINEDLLOVERRIDES="mscoree,mshtml=")
    environment.pop("DISPLAY", None)
    foreign = driver(MINGW, "platform.exe")
    worst = 0.0
    for case, expected in zip(cases, traces):
        got = trace([wine, foreign], OUT / "axis/binaries/win64/eixo.dll", guid, case, env=environment, cwd=OUT)
        worst = max(worst, largest_difference(expected, got))
    print(f"win64:   {len(traces)} runs of {STEPS} steps under wine, each rolled back from bytes to the bit")
    agrees = worst <= TOLERANCE
    print(f"largest difference of win64 to linux64: {worst:.1e} of the output's largest value, {TOLERANCE:g} allowed")
    return 0 if agrees else 1


if __name__ == "__main__":
    sys.exit(main())
