"""Least squares, recursive least squares and CSV reading beside numpy, padasip and polars: one run, same data.

    .venv/bin/python scripts/bench_peers.py

Writes a million rows of regressors and of a trace to a temporary folder, times the peers here (median), runs
`cargo bench --bench identify` on the same files, and prints the ratios.
"""

import os
import re
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import padasip
import polars

ROWS, SAMPLES = 1_000_000, 20_000
UNITS = {"ns": 1e-9, "µs": 1e-6, "us": 1e-6, "ms": 1e-3, "s": 1.0}


def median(run, times):
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        taken.append(time.perf_counter() - start)
    return float(np.median(taken))


def main():
    rng = np.random.default_rng(1)
    data = rng.standard_normal((ROWS, 6))
    x, y = np.ascontiguousarray(data[:, :5]), data[:, 5].copy()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        data.tofile(folder / "regressors.f64")
        table = {"time [s]": np.arange(ROWS) * 1e-3}
        names = ["T [N.m]", "theta1 [rad]", "omega1 [rad/s]", "theta2 [rad]", "omega2 [rad/s]"]
        table.update({name: data[:, k] for k, name in enumerate(names)})
        polars.DataFrame(table).write_csv(folder / "trace.csv")

        def rls():
            padasip.filters.FilterRLS(n=5, mu=0.999, w="zeros").run(y[:SAMPLES], x[:SAMPLES])

        peers = {
            "ls_million_rows": ("numpy.linalg.lstsq", median(lambda: np.linalg.lstsq(x, y, rcond=None), 7), 3),
            "rls_twenty_thousand_samples": ("padasip FilterRLS", median(rls, 3), 50),
            "read_million_rows": ("polars.read_csv", median(lambda: polars.read_csv(folder / "trace.csv"), 7), 1 / 1.5),
        }
        root = Path(__file__).resolve().parent.parent
        run = subprocess.run(
            ["cargo", "bench", "--bench", "identify"],
            cwd=root,
            env={**os.environ, "EIXO_PEERS": str(folder)},
            capture_output=True,
            text=True,
            check=True,
        )
    print(f"{os.cpu_count()} processors")
    for name, (peer, theirs, asked) in peers.items():
        # divan: name, fastest | slowest | median | mean
        line = next(line for line in run.stdout.splitlines() if name in line)
        times = re.findall(r"([\d.]+) (ns|µs|us|ms|s)\b", line)
        value, unit = times[2]
        ours = float(value) * UNITS[unit]
        ratio = theirs / ours
        verdict = "reached" if ratio >= asked else "MISSED"
        print(f"{name}: {ours * 1e3:.2f} ms, {peer} {theirs * 1e3:.2f} ms: {ratio:.2f} x (asked {asked:.2f}: {verdict})")


if __name__ == "__main__":
    main()
