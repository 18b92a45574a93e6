"""Real records with an effect added: does `eixo diagnose` name what was put into a machine's own torque?

A rigid axis moves as it does under T = I*a + what the machine takes. With an effect more it would need that effect's torque, too, to move
the same way: T + f(t, x, v). Such a record keeps what no simulation has, the machine's own noise, time stamps, rounding and unmodelled
rest, and what was added is known. Needs $EIXO_DATA (default ../shared/data); the axis files are those that `eixo init` writes.

    .venv/bin/python scripts/blind/grafted.py --eixo target/release/eixo --out DIR
"""

import argparse
import csv
import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

ROOT = Path(__file__).resolve().parents[2]
# Rms of what the axis with textbook friction cannot take of an effect, over that of what it cannot take of the record itself: less is
# hidden in the machine's own rest.
VISIBLE = 1.5
# Periods over the record below which a sine is the motion's own, and the highest share of the motion's band that one is added at.
PERIODS = 7
# Samples that a delay is late.
LATE = 6
NAMED, SURE = 0.5, 0.9


@dataclass
class Record:
    """Columns of a log: time s, position rad or m, torque in the log's unit; the files that they come from."""

    name: str
    log: Path
    axis: str | None
    torque: str
    position: str
    rows: tuple = (None, None)
    wraps: bool = False


RECORDS = [
    Record("emps, first half", Path("emps/train.csv"), "tests/data/emps.toml", "force_cmd_N", "q_meas_m", (0, 12400)),
    Record("emps, second half", Path("emps/train.csv"), "tests/data/emps.toml", "force_cmd_N", "q_meas_m", (12400, 24800)),
    Record("qube 1", Path("qube/prbs_1.csv"), None, "plant_input_V", "theta_rad"),
    Record("qube 2", Path("qube/prbs_2.csv"), None, "plant_input_V", "theta_rad"),
    *(
        Record(f"bam {f}", Path(f"bam_xl330/{f}.csv"), None, "load_raw", "pos_rad", wraps=True)
        for f in ("lift_and_drop", "sin_sin", "sin_time_square", "up_and_down")
    ),
]


def derivatives(t, x):
    """Speed and acceleration of a position, smoothed over 11 or 21 samples."""
    window, dt = (11 if len(t) < 2000 else 21), np.median(np.diff(t))
    v = savgol_filter(x, window, 3, deriv=1) / dt
    return v, savgol_filter(v, window, 3, deriv=1) / dt


def direction(v):
    """Sign of the motion; where it stands still, of the last one."""
    moving = np.where(np.abs(v) > 0.03 * np.abs(v).max(), np.sign(v), 0.0)
    last = np.maximum.accumulate(np.where(moving != 0, np.arange(len(v)), 0))
    return moving[last]


def effects(t, x, v, torque):
    """Family, and torque that is added, of each effect; none smaller than two thirds of the torque's scatter."""
    size, fast, way = torque.std(), np.sqrt((v * v).mean()), np.ptp(x)
    sign = direction(v)
    spectrum = np.abs(np.fft.rfft(v - v.mean())) ** 2
    middle = (spectrum * np.fft.rfftfreq(len(v), np.median(np.diff(t)))).sum() / spectrum.sum()
    frequency = max(PERIODS / np.ptp(t), 0.3 * middle)
    late = np.concatenate([torque[LATE:], np.repeat(torque[-1], LATE)])
    out = {
        "dry_friction": 0.7 * size * sign,
        "viscous_friction": 0.7 * size * v / fast,
        "load_torque": np.full(len(t), 0.8 * size),
        "external_spring": 0.8 * size * (x - x.mean() - 0.3 * way) / x.std(),
        "torque_ripple": size * np.sin(6.3 * 2 * np.pi * x / way + 1.0),
        "disturbance": size * np.sin(2 * np.pi * frequency * t + 0.7),
        "delay": late - torque,
        "dead_zone": 0.7 * size * np.sign(torque),
    }
    if way > 0.4:
        out["gravity"] = 0.8 * size * np.sin(x) / np.sin(x).std()
    return out


def visibility(family, added, t, x, v, a, torque):
    """What the axis with the rest of the textbook cannot take of an effect, over what it cannot take of the record."""
    columns = {"": a, "viscous_friction": v, "dry_friction": direction(v), "load_torque": np.ones(len(t))}
    window = 11 if len(t) < 2000 else 21

    def left(y, but=None):
        basis = np.column_stack([c for f, c in columns.items() if f != but])
        y = savgol_filter(y, window, 3)
        rest = y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]
        return np.sqrt((rest * rest).mean())

    return left(added, but=family) / left(torque)


def graft(record, data, eixo, out):
    """Writes the record as it is and with each visible effect: (record, family or none, visibility, folder)."""
    with open(data / record.log, newline="") as file:
        header, *rows = csv.reader(file)
    rows = rows[slice(*record.rows)]

    def column(name):
        return np.array([float(r[header.index(name)]) for r in rows])

    t, x, torque = column(header[0]), column(record.position), column(record.torque)
    if record.wraps:
        torque = np.where(torque > 32767, torque - 65536, torque)
    v, a = derivatives(t, x)
    cases = [(record.name, None, 0.0, np.zeros(len(t)))]
    for family, added in effects(t, x, v, torque).items():
        seen = visibility(family, added, t, x, v, a, torque)
        if seen >= VISIBLE:
            cases.append((record.name, family, seen, added))
    written = []
    for name, family, seen, added in cases:
        folder = out / "cases" / f"{name} {family or ''}".strip().replace(" ", "_").replace(",", "")
        folder.mkdir(parents=True, exist_ok=True)
        at = header.index(record.torque)
        with open(folder / "log.csv", "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header)
            writer.writerows([*r[:at], f"{y:.9g}", *r[at + 1 :]] for r, y in zip(rows, torque + added))
        axis = folder / "axis.toml"
        if record.axis:
            axis.write_bytes((ROOT / record.axis).read_bytes())
        elif family is None:
            command = [eixo, "init", "log.csv", "--yes", "-o", "axis.toml"]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
        else:
            axis.write_bytes((written[0][3] / "axis.toml").read_bytes())
        written.append((name, family, seen, folder))
    return written


def diagnosed(eixo, folder, timeout):
    """Verdict, and family and probability of each cause named; a verdict of its own where there is no diagnosis."""
    command = [eixo, "diagnose", "log.csv", "--axis", "axis.toml", "--json", "diagnosis.json"]
    (folder / "diagnosis.json").unlink(missing_ok=True)
    try:
        subprocess.run(command, cwd=folder, capture_output=True, timeout=timeout, check=False)
        answer = json.loads((folder / "diagnosis.json").read_text())
    except subprocess.TimeoutExpired:
        return "cut off", {}
    except FileNotFoundError:
        return "refused", {}
    return answer["verdict"], {c["family"]: c["probability"] for c in answer["causes"]}


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--eixo", required=True, type=Path)
    arguments.add_argument("--out", required=True, type=Path)
    arguments.add_argument("--jobs", type=int, default=2)
    arguments.add_argument("--timeout", type=float, default=120.0, help="seconds a diagnosis")
    options = arguments.parse_args()
    data = Path(os.environ.get("EIXO_DATA", ROOT / "../shared/data"))
    if not data.is_dir():
        sys.exit(f"{data}: no real records here; EIXO_DATA names their folder")
    eixo = options.eixo.resolve()
    shutil.rmtree(options.out / "cases", ignore_errors=True)
    cases = [c for r in RECORDS for c in graft(r, data, eixo, options.out.resolve())]
    with ThreadPoolExecutor(options.jobs) as pool:
        answers = list(pool.map(lambda c: diagnosed(eixo, c[3], options.timeout), cases))
    own = {c[0]: {f for f, p in a[1].items() if p >= NAMED} for c, a in zip(cases, answers) if c[1] is None}
    lines = ["| record | added | visible | verdict | named | |", "|---|---|---|---|---|---|"]
    found = other = sure = added = 0
    for (name, family, seen, _), (verdict, causes) in zip(cases, answers):
        told = {f for f, p in causes.items() if p >= NAMED}
        false = told - own[name] - {family}
        word = ""
        if family:
            added += 1
            found += family in told
            other += bool(false)
            sure += any(causes[f] >= SURE for f in false)
            word = ("found" if family in told else "not found") + (", another named" if false else "")
        named = ", ".join(f"{f} {p:.2f}" for f, p in causes.items())
        lines.append(f"| {name} | {family or ''} | {f'{seen:.1f}' if family else ''} | {verdict} | {named} | {word} |")
    lines.append(f"\n{added} effects added: {found} found, {other} with another named that is not there, {sure} of them at {SURE} or more.")
    text = "\n".join(lines) + "\n"
    (options.out / "result.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
