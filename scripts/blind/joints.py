"""Joints of a real robot, diagnosed one by one: what is named of machines that nobody had looked at while the diagnosis was written.

The log of a TIAGo's torso lift and arm, moved all at once, from the tests of figaroh (Apache-2.0, source archive on PyPI): eighty seconds at
100 Hz, positions, and the drives' currents as efforts. They are slow: friction and weight take nearly all of the torque, inertia next to
none, and every joint feels the others. Beside what eixo names stands what a regression of the low-passed torque makes of the textbook's
effects: the share of its scatter that each set of them leaves. Needs the package registry; nothing of it is kept.

    .venv/bin/python scripts/blind/joints.py --eixo target/release/eixo --out DIR
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tarfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

ARCHIVE = "figaroh-1.0.2.tar.gz"
SHA256 = "c6b29d7b0a1a5618093c286559fdb9d4f94c325938d6c674aaea318dc4fc811a"
FOLDER = "figaroh-1.0.2/tests/fixtures/tiago/data/identification"
# Sign that the effort counts with: against that of arm 3 and 4 the joint moves, and its friction would drive it. The hand's are not logged.
JOINTS = {"torso_lift": 1, "arm_1": 1, "arm_2": 1, "arm_3": -1, "arm_4": -1}
# Seconds of the record: all of it that moves, its halves, its thirds.
WINDOWS = [(8, 68), (8, 38), (38, 68), (8, 28), (28, 48), (48, 68)]
# What every such joint has, or may have of the others' weight. The lift stands on its end stop before it starts.
KNOWN = {"dry_friction", "viscous_friction", "load_torque", "gravity", "external_spring"}
LIFT = {"end_stop"}
# Upper end of the regression's band, Hz, and speed below which the sign of the motion is not told, over the largest.
BAND, STANDS = 4.0, 0.01
NAMED, SURE = 0.5, 0.9


def fetched(out):
    """The archive's log: time, efforts and positions of each joint."""
    archive = out / ARCHIVE
    if not archive.exists():
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", ":all:", "--dest", str(out)]
        subprocess.run([*pip, "figaroh==1.0.2"], check=True)
    if hashlib.sha256(archive.read_bytes()).hexdigest() != SHA256:
        sys.exit(f"{archive}: another archive than the one this was written for")
    with tarfile.open(archive) as tar:

        def table(kind):
            return np.genfromtxt(tar.extractfile(f"{FOLDER}/tiago_{kind}.csv"), delimiter=",", names=True)

        position, effort = table("position"), table("effort")
        of = {n: i for i, n in enumerate(position.dtype.names)}
        column = {j: next(n for n in of if f"{j}_joint" in n) for j in JOINTS}
        return position["t"], {
            j: (sign * effort[effort.dtype.names[of[column[j]]]], position[column[j]]) for j, sign in JOINTS.items()
        }


def regressed(t, torque, x):
    """Share of the low-passed torque's scatter that inertia and a constant leave, with friction, and with weight beside it."""
    steps = np.arange(t[0], t[-1], np.median(np.diff(t)))
    low = butter(4, BAND * 2 * (steps[1] - steps[0]))
    x, torque = (filtfilt(*low, np.interp(steps, t, y)) for y in (x, torque))
    v = np.gradient(x, steps)
    moves = np.abs(v) > STANDS * np.abs(v).max()
    columns = [np.gradient(v, steps), np.ones(len(v)), np.sign(v), v, np.sin(x), np.cos(x)]

    def left(n):
        basis, y = np.column_stack(columns[:n])[moves], torque[moves]
        return (y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]).std() / y.std()

    return [left(n) for n in (2, 3, 4, 6)]


def diagnosed(eixo, folder, joint, window):
    """What is named of a joint in a window: (verdict, causes, share of the torque that is left)."""
    log, axis, told = folder / f"{joint}.csv", folder / f"{joint}.toml", folder / f"{joint}_{window[0]}_{window[1]}.json"
    span = ["--from", str(window[0]), "--to", str(window[1])]
    told.unlink(missing_ok=True)
    run = subprocess.run(
        [eixo, "diagnose", log, "--axis", axis, *span, "--json", told, "--quiet"], capture_output=True, text=True
    )
    if not told.exists():
        return "refused", [], run.stderr.strip().splitlines()[-1]
    found = json.loads(told.read_text())
    return found["verdict"], found["causes"], found["remainder"]["share"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--eixo", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    t, joints = fetched(args.out)
    for joint, (effort, position) in joints.items():
        table = np.column_stack([t, effort, position])
        header = "t_s,effort_Nm,position_rad"
        np.savetxt(args.out / f"{joint}.csv", table, fmt="%.9g", delimiter=",", header=header, comments="")
        log, axis = args.out / f"{joint}.csv", args.out / f"{joint}.toml"
        if not axis.exists():
            subprocess.run([args.eixo, "init", log, "--yes", "-o", axis], check=True, capture_output=True)
    cases = [(j, w) for j in joints for w in WINDOWS]
    with ThreadPoolExecutor(2) as pool:
        told = list(pool.map(lambda c: diagnosed(args.eixo, args.out, *c), cases))
    print("| joint | s | left by a constant, friction, viscosity, weight | verdict | named | left |")
    print("|---|---|---|---|---|---|")
    named, foreign, sure = 0, 0, 0
    for (joint, window), (verdict, causes, left) in zip(cases, told):
        inside = (t >= window[0]) & (t <= window[1])
        shares = ", ".join(f"{s:.2f}" for s in regressed(t[inside], *(y[inside] for y in joints[joint])))
        causes = [c for c in causes if verdict == "effect" and c["probability"] >= NAMED]
        known = KNOWN | (LIFT if joint == "torso_lift" and window[0] == WINDOWS[0][0] else set())
        others = [c for c in causes if c["family"] not in known]
        named += bool(causes) and not others
        foreign += bool(others)
        sure += any(c["probability"] >= SURE for c in others)
        listed = ", ".join(f"{c['id']} {c['probability']:.2f}" for c in causes)
        print(f"| {joint} | {window[0]} to {window[1]} | {shares} | {verdict} | {listed} | {left if isinstance(left, str) else f'{left:.3f}'} |")
    print(f"\n{named} of {len(cases)} with what such a joint has and nothing else, {foreign} with something else, {sure} of them at {SURE} or more")


if __name__ == "__main__":
    main()
