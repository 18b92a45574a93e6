"""Trajectories of the Reference FMUs of FMI 3.0 by FMPy, which tests/fmi3.rs compares with those of `eixo simulate --step-end`.

Usage: .venv/bin/python scripts/fmi3_reference.py FMU OUT.csv [--step H] [--input IN.csv] [--event-mode] [--early-return]

A row holds a communication point and the outputs as the step to it, and the events there, left them; arrays are
taken apart as NAME(i), bytes and texts left out.
"""
import argparse
import csv

import numpy as np
from fmpy import read_model_description, simulate_fmu


def inputs(path, description):
    """The columns of a CSV as the structured array that FMPy takes; an array's elements are joined."""
    with open(path) as file:
        rows = list(csv.reader(file))
    header, values = rows[0], np.array(rows[1:], dtype=float)
    kinds = {v.name: v.type for v in description.modelVariables}
    numpy_of = {"Float32": np.float32, "Boolean": np.bool_, "Enumeration": np.int64}
    fields, columns = [], []
    for name in dict.fromkeys(column.split("(")[0] for column in header):
        at = [i for i, column in enumerate(header) if column.split("(")[0] == name]
        kind = kinds.get(name, "Float64")
        kind = numpy_of.get(kind) or getattr(np, kind.lower())
        fields.append((name, kind) if len(at) == 1 else (name, kind, (len(at),)))
        columns.append(values[:, at[0]] if len(at) == 1 else values[:, at])
    table = np.zeros(len(values), dtype=fields)
    for (name, *_), column in zip(fields, columns):
        table[name] = column
    return table


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fmu")
    parser.add_argument("out")
    parser.add_argument("--step", type=float)
    parser.add_argument("--input")
    parser.add_argument("--event-mode", action="store_true")
    parser.add_argument("--early-return", action="store_true")
    parser.add_argument("--first", action="store_true", help="of two rows of one time the first: before inputs change at it")
    args = parser.parse_args()
    description = read_model_description(args.fmu)
    numeric, seen = [], set()
    for v in description.modelVariables:
        # FMPy takes an alias for a variable of its own.
        if v.causality == "output" and v.type not in ("String", "Binary", "Clock") and v.valueReference not in seen:
            seen.add(v.valueReference)
            numeric.append(v)
    result = simulate_fmu(
        args.fmu,
        fmi_type="CoSimulation",
        output_interval=args.step,
        input=inputs(args.input, description) if args.input else None,
        output=[v.name for v in numeric],
        use_event_mode=args.event_mode,
        early_return_allowed=args.early_return,
        apply_default_start_values=False,
    )
    # Where an event is handled there are two rows of one time: the second is after it.
    rows = {}
    for row in result:
        cells = [float(row["time"])]
        for v in numeric:
            cells += [float(x) for x in np.ravel(row[v.name])]
        if not (args.first and round(cells[0], 9) in rows):
            rows[round(cells[0], 9)] = cells
    first = result[0]
    header = ["time"]
    for v in numeric:
        size = np.size(first[v.name])
        header += [v.name] if np.ndim(first[v.name]) == 0 else [f"{v.name}({i + 1})" for i in range(size)]
    with open(args.out, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(header)
        out.writerows([repr(x) for x in row] for row in rows.values())


if __name__ == "__main__":
    main()
