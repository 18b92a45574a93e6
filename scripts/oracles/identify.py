"""Oracle for crates/estimation/src/identify: scipy and numpy on a small two-inertia record. Prints the numbers the tests expect.

    .venv/bin/python scripts/oracles/identify.py

The record is made here and, by the same formulas, in crates/estimation/src/identify/tests.rs: the paper's axis (Table 3) under two
periods of a flat Schroeder torque (512 samples, lines 1 to 25, rms 0.03 N.m, held over the sample), sampled every
2e-3 s by the exact zero-order-hold discretisation, with uniform noise from a 64-bit linear congruential generator.
"""

import numpy as np
from scipy import optimize, signal, stats

I1, I2, B, K = 2.37e-4, 6.07e-6, 5.4e-4, 1.76e-2
N, PERIODS, LINES, DT, RMS = 512, 2, 25, 2e-3, 0.03
SIGMA_THETA, SIGMA_OMEGA = 1e-3, 2e-2


def lcg(n, seed):
    """Uniform in (-sqrt(3), sqrt(3)): unit variance. Knuth's MMIX constants, upper 53 bits."""
    out, x = np.empty(n), seed
    for k in range(n):
        x = (x * 6364136223846793005 + 1442695040888963407) % 2**64
        out[k] = ((x >> 11) / 2**53 - 0.5) * np.sqrt(12.0)
    return out


def model(p):
    i1, i2, b, k = p
    a = np.array(
        [[0, 1, 0, 0], [-k / i1, -b / i1, k / i1, b / i1], [0, 0, 0, 1], [k / i2, b / i2, -k / i2, -b / i2]]
    )
    return signal.cont2discrete((a, np.array([[0], [1 / i1], [0], [0]]), np.eye(4), np.zeros((4, 1))), DT)[:2]


def simulate(p, torque, x0):
    f, g = model(p)
    x = np.empty((len(torque), 4))
    x[0] = x0
    for k in range(len(torque) - 1):
        x[k + 1] = f @ x[k] + g[:, 0] * torque[k]
    return x


def record():
    k = np.arange(N * PERIODS)
    h = np.arange(1, LINES + 1)
    phase = -np.pi * h * (h - 1) / LINES
    torque = RMS * np.sqrt(2 / LINES) * np.cos(2 * np.pi * np.outer(k, h) / N + phase).sum(axis=1)
    x = simulate((I1, I2, B, K), torque, [0.2, -1.0, 0.2, -1.0])
    noise = [SIGMA_THETA, SIGMA_OMEGA, SIGMA_THETA, SIGMA_OMEGA]
    y = x + np.stack([s * lcg(len(k), seed + 1) for seed, s in enumerate(noise)], axis=1)
    return torque, y


def f5(torque, y):
    """The trapezoidal regression in two rows, torque held: estimates and standard errors of both rows."""
    d, dv = y[:, 0] - y[:, 2], y[:, 1] - y[:, 3]
    mean = lambda q: 0.5 * (q[:-1] + q[1:])
    diff = lambda q: np.diff(q) / DT
    for name, x, b in [
        ("F5 row 1  [K/I1 B/I1 1/I1]", np.stack([-mean(d), -mean(dv), torque[:-1]], 1), diff(y[:, 1])),
        ("F5 row 2  [K/I2 B/I2]", np.stack([mean(d), mean(dv)], 1), diff(y[:, 3])),
    ]:
        phi, ss, _, _ = np.linalg.lstsq(x, b, rcond=None)
        cov = ss[0] / (len(b) - x.shape[1]) * np.linalg.inv(x.T @ x)
        print(name, phi.tolist(), "std", np.sqrt(np.diag(cov)).tolist())


def output_error(torque, y, columns, label):
    """Output error over log parameters and initial state, weighted by the noise used."""
    sigma = np.array([SIGMA_THETA, SIGMA_OMEGA, SIGMA_THETA, SIGMA_OMEGA])[columns]

    def residual(z):
        return ((y - simulate(np.exp(z[:4]), torque, z[4:]))[:, columns] / sigma).ravel()

    start = np.concatenate([np.log([2.2e-4, 6.5e-6, 5e-4, 1.8e-2]), [0.2, -1.0, 0.2, -1.0]])
    fit = optimize.least_squares(residual, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac", method="lm")
    cov = np.linalg.inv(fit.jac.T @ fit.jac)
    p = np.exp(fit.x[:4])
    print(label, p.tolist(), "std", (p * np.sqrt(np.diag(cov)[:4])).tolist(), "cost", fit.cost)


if __name__ == "__main__":
    for x, dof in [(18.307038053275143, 10), (44.31410489621915, 25), (5.0, 25), (200.0, 25)]:
        print("chi2.sf", x, dof, stats.chi2.sf(x, dof))
    torque, y = record()
    print("torque[7]", torque[7], "y[1000]", y[1000].tolist())
    f5(torque, y)
    output_error(torque, y, [0, 1, 2, 3], "OE all outputs")
    output_error(torque, y, [0, 2], "OE positions")
