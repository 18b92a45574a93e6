"""What the two-inertia bench's multisine says of lags, by numpy and scipy: the figures of tests/real_machines.rs.

    python scripts/oracles/bench_lines.py [../shared/data/two_inertia_bench/schroeder.csv]
"""

import sys

import numpy as np
from scipy.optimize import least_squares

data = np.genfromtxt(sys.argv[1] if sys.argv[1:] else "../shared/data/two_inertia_bench/schroeder.csv", delimiter=",", names=True)
PERIOD, COUNT, DT = 2500, 20, 4e-4
lines = np.arange(11, 251)
w = 2 * np.pi * lines / (PERIOD * DT)
s = 1j * w
zoh = (1 - np.exp(-s * DT)) / (s * DT)


def spectra(name):
    """Lines of each period but the first, less the straight drift over the period."""
    x = data[name].reshape(COUNT, PERIOD)
    following = np.r_[x[1:, 0], 2 * x[-1, 0] - x[-2, 0]]
    slope = (following - x[:, 0]) / PERIOD
    return np.fft.rfft(x - slope[:, None] * np.arange(PERIOD), axis=1)[1:, lines]


def response(output, by):
    y, u = spectra(output), spectra(by)
    return (y * u.conj()).sum(0) / (abs(u) ** 2).sum(0)


def axis(p, lag, delay):
    i1, i2, b, k = p
    motor, table, link = i1 * s**2, i2 * s**2, b * s + k
    both = motor * table + link * (motor + table)
    return zoh * np.exp(-s * delay) / (1 + s * lag) * np.array([(table + link) / both, link / both])


current = response("iq_meas_A", "iq_ref_A")
for name, model in (("lag", lambda x: x[1] / (1 + s * x[0])), ("delay", lambda x: x[1] * np.exp(-s * x[0]))):
    fit = least_squares(lambda x: np.r_[(model(x) - current).real, (model(x) - current).imag], [5e-4, 1.0])
    print(f"command to measured current: {name} {fit.x[0] * 1e3:.3f} ms")
for by in ("iq_ref_A", "iq_meas_A"):
    g = np.array([response(o, by) for o in ("theta_motor_rad", "theta_load_rad")])
    for name, use in (("none", (0, 0)), ("lag", (1, 0)), ("delay", (0, 1))):

        def errors(x, use=use, g=g):
            e = np.log(axis(np.exp(x[:4]), x[4] ** 2 * use[0], x[4] ** 2 * use[1]) / g)
            return np.r_[e.real.ravel(), e.imag.ravel()]

        fit = least_squares(errors, np.r_[np.log([4.8e-3, 4.8e-3, 0.05, 560]), 0.02], loss="soft_l1", f_scale=0.05)
        print(f"{by} to both angles: {name} {fit.x[4] ** 2 * 1e3 * any(use):.3f} ms, cost {fit.cost:.3f}")
for side in ("motor", "load"):
    ratio = spectra(f"omega_{side}_rad_s").mean(0) / (s * spectra(f"theta_{side}_rad").mean(0))
    print(f"omega_{side}: low pass of {np.median(-ratio.imag / ratio.real / w) * 1e3:.3f} ms")
