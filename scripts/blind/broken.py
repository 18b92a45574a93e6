#!/usr/bin/env python3
"""Sound records broken in known ways: is each refused, and is any cause named where one is not?

Every record of a set of cases (`conditions.py`) is broken in each way that its columns allow, given to `eixo inspect`, and where that does
not refuse it to `eixo diagnose`. A break that is neither refused nor left without a cause at 50 % is told by its case.

    scripts/blind/broken.py --eixo target/release/eixo --cases DIR [--first 0 --count 40] [--jobs 2]
"""

import argparse
import collections
import concurrent.futures
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

LATE = 12
"""Samples that a logger might hold the torque back."""
TIMEOUT = 120.0
LIKELY = 0.5

Rows = list[list[float]]


def read(path: pathlib.Path) -> tuple[list[str], Rows]:
    with path.open(newline="") as f:
        head, *rows = csv.reader(f)
    return head, [[float(v) if v else float("nan") for v in row] for row in rows]


def write(path: pathlib.Path, head: list[str], rows: Rows) -> None:
    lines = [",".join(head), *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")


def column(head: list[str], *names: str) -> int | None:
    return next((i for i, h in enumerate(head) if h.split(" ")[0] in names), None)


def scaled(rows: Rows, columns: list[int | None], by: float) -> Rows:
    return [[v * by if i in columns else v for i, v in enumerate(row)] for row in rows]


def replaced(rows: Rows, at: int, value) -> Rows:
    return [row[:at] + [value(k)] + row[at + 1:] for k, row in enumerate(rows)]


def breaks(head: list[str], rows: Rows, foreign: Rows):
    """Each way to break a record: its name, and the broken rows. `foreign` has the torque of another machine's record."""
    time, torque = column(head, "time", "t"), column(head, "T")
    motor, table = column(head, "theta1"), column(head, "theta2")
    yield "torque turned", scaled(rows, [torque], -1.0)
    yield "torque in mN.m", scaled(rows, [torque], 1e3)
    yield "torque in kN.m", scaled(rows, [torque], 1e-3)
    yield "positions in degrees", scaled(rows, [motor, table], 57.29578)
    yield "time in ms", scaled(rows, [time], 1e3)
    yield "torque late", replaced(rows, torque, lambda k: rows[max(0, k - LATE)][torque])
    yield "torque of another machine", replaced(rows, torque, lambda k: foreign[k % len(foreign)][torque])
    if motor is not None:
        stuck = rows[len(rows) // 3][motor]
        yield "motor encoder stuck", replaced(rows, motor, lambda k: rows[k][motor] if 3 * k < len(rows) else stuck)
        yield "motor encoder dead", replaced(rows, motor, lambda k: 0.0)
    yield "torque dead", replaced(rows, torque, lambda k: 0.0)
    if motor is not None and table is not None:
        order = {motor: table, table: motor}
        yield "encoders exchanged", [[row[order.get(i, i)] for i in range(len(row))] for row in rows]
        yield "table turned", scaled(rows, [table], -1.0)
        yield "table in degrees", scaled(rows, [table], 57.29578)


def examined(eixo: pathlib.Path, folder: pathlib.Path) -> list[str]:
    """What `eixo inspect` refuses the record for."""
    done = subprocess.run([eixo, "inspect", "train.csv", "--axis", "axis.toml", "--json", "inspect.json", "--quiet"],
                          cwd=folder, capture_output=True, text=True, timeout=TIMEOUT)
    path = folder / "inspect.json"
    if not path.exists():
        return [f"exit {done.returncode}"]
    return [f["id"] for f in json.loads(path.read_text())["examination"]["findings"] if f["severity"] == "refuse"]


def named(eixo: pathlib.Path, folder: pathlib.Path) -> list[str]:
    """Causes that `eixo diagnose` tells at 50 % or more."""
    try:
        subprocess.run([eixo, "diagnose", "train.csv", "--axis", "axis.toml", "--json", "diagnosis.json"],
                       cwd=folder, capture_output=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        return []
    path = folder / "diagnosis.json"
    causes = json.loads(path.read_text())["causes"] if path.exists() else []
    return [f"{c['id']} {c['probability']:.2f}" for c in causes if c["probability"] >= LIKELY]


def tried(task: tuple[pathlib.Path, pathlib.Path, pathlib.Path]) -> list[tuple[str, str, list[str]]]:
    """A case in every broken form: its break, `refused`, `unnamed` or `named`, and the causes."""
    eixo, case, other = task
    head, rows = read(case / "train.csv")
    out = []
    for name, broken in breaks(head, rows, read(other / "train.csv")[1]):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            write(folder / "train.csv", head, broken)
            shutil.copy(case / "axis.toml", folder)
            refused = examined(eixo, folder)
            causes = [] if refused else named(eixo, folder)
        out.append((name, "refused" if refused else "named" if causes else "unnamed", causes))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--eixo", type=pathlib.Path, required=True, help="the program")
    parser.add_argument("--cases", type=pathlib.Path, required=True, help="folder that conditions.py has written")
    parser.add_argument("--first", type=int, default=0, help="first case by name")
    parser.add_argument("--count", type=int, default=1_000_000, help="cases at most")
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    names = sorted((args.cases / "cases").iterdir())
    chosen = range(args.first, min(args.first + args.count, len(names)))
    if not chosen:
        sys.exit(f"{args.cases}: no cases from {args.first} on")
    tasks = [(args.eixo.resolve(), names[i], names[(i + 7) % len(names)]) for i in chosen]
    table: dict[str, collections.Counter] = collections.defaultdict(collections.Counter)
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        for (_, case, _), results in zip(tasks, pool.map(tried, tasks)):
            for name, outcome, causes in results:
                table[name][outcome] += 1
                if causes:
                    print(f"{case.name}, {name}: {', '.join(causes)}", flush=True)
    print("\n| break | records | refused | diagnosed without a cause | a cause at 50 % or more |\n|---|---|---|---|---|")
    for name, of in table.items():
        print(f"| {name} | {of.total()} | {of['refused']} | {of['unnamed']} | {of['named']} |")


if __name__ == "__main__":
    main()
