"""Loads an exported XY table (SSP) in FMPy and ecos, moves it along a circle, and compares the path with eixo's own.

    .venv/bin/python scripts/table.py table.ssp bare.ssp path.csv RADIUS FEED DT

table.ssp is from `eixo export`, bare.ssp from `eixo export --bare`, for ecos, which knows no connectors of the system itself;
path.csv comes from `eixo circle -o path.csv` with the same axes and drives; RADIUS in m, FEED in m/min, DT in s. Prints one line an
importer; exit code 1 when one disagrees by more than a nanometre. An importer that is not installed is named as skipped.
"""

import csv
import ctypes
import glob
import math
import sys
import warnings

import numpy as np

TOLERANCE = 1e-9


def circle(radius, feed, dt):
    """Samples before the recorded turn and in it, and the reference at sample k: the feed is reached over half a turn."""
    rate = feed / 60.0 / radius
    samples, ramp = 2.0 * math.pi / rate / dt, 2.0 * math.pi / rate

    def reference(k):
        t = k * dt
        angle = 0.5 * rate * t * t / ramp if t < ramp else rate * (t - 0.5 * ramp)
        # From the origin, where the FMUs start.
        return radius * (math.cos(angle) - 1.0), radius * math.sin(angle)

    return math.ceil(2.0 * samples), math.ceil(samples), reference


def fmpy(ssp, dt, count, reference):
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import read_ssd

    read_ssd(ssp, validate=True)
    # simulate_ssp hands an input on at the end of a step, so that its row k holds the position that belongs to sample k.
    inputs = {
        "x_reference": lambda t: reference(round(t / dt))[0],
        "y_reference": lambda t: reference(round(t / dt))[1],
    }
    rows = simulate_ssp(ssp, stop_time=(count - 0.5) * dt, step_size=dt, input=inputs)
    return np.array([rows["x"], rows["y"]])


def ecos(ssp, dt, count, reference):
    # ecospy's library needs libtbb, which the package tbb carries.
    for library in glob.glob(sys.prefix + "/lib/libtbb.so.12"):
        ctypes.CDLL(library, mode=ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation

    with EcosSimulation(ssp_path=str(ssp), step_size=dt) as simulation:
        assert simulation.init(), "init failed"
        path = [[0.0, 0.0]]
        for k in range(count - 1):
            for name, value in zip("xy", reference(k)):
                simulation.set_real(f"{name}_drive::reference", value)
            simulation.step()
            path.append([simulation.get_real(f"{name}_axis::x2") for name in "xy"])
        simulation.terminate()
    return np.array(path).T


# Importer, what runs it, which of the two files.
IMPORTERS = [("FMPy simulate_ssp", fmpy, 1), ("ecospy", ecos, 2)]


def main():
    radius, feed, dt = map(float, sys.argv[4:7])
    with open(sys.argv[3], newline="") as file:
        expected = np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]]).T
    before, turn, reference = circle(radius, feed, dt)
    expected[0] -= radius
    warnings.simplefilter("ignore")
    failed = False
    print(f"{'importer':<20} {'difference':>12}  verdict")
    for name, run, file in IMPORTERS:
        try:
            path = run(sys.argv[file], dt, before + turn + 1, reference)[:, before:]
            assert path.shape == expected.shape, f"{path.shape[1]} positions, not {expected.shape[1]}"
            difference = np.max(np.abs(path - expected))
            fine = difference <= TOLERANCE
            verdict = "draws the same circle" if fine else f"DISAGREES: at most {TOLERANCE:g} m is allowed"
            print(f"{name:<20} {difference:>10.1e} m  {verdict}", flush=True)
            failed |= not fine
        except (ImportError, OSError) as missing:
            print(f"{name:<20} {'-':>12}  SKIPPED: {missing}", flush=True)
        except Exception as error:  # An importer's own error is a finding about the SSP until proven otherwise.
            print(f"{name:<20} {'-':>12}  FAILED: {error!r}", flush=True)
            failed = True
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
