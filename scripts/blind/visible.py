"""How visible an effect is: rms of what it adds to the trace, before and after a linear re-fit of the base model.

The re-fit is done in windows, as a judge of open-loop models must (the axis has a free rigid-body mode): in every window the
four initial states are free, over all windows the four base parameters are; all enter linearly about the true trajectory, and
are projected out of the forced response to the effect.
"""
from __future__ import annotations

import numpy as np
from numba import njit
from scipy.linalg import expm

WINDOW = 512


def matrices(base: dict):
    """A (4 x 4) and the inputs (torque on motor, torque on table; 4 x 2) of the linear axis, state th1 w1 th2 w2."""
    i1, i2, b, k = (base[x] for x in ("I1", "I2", "B", "K"))
    a = np.array([[0, 1, 0, 0], [-k / i1, -b / i1, k / i1, b / i1], [0, 0, 0, 1], [k / i2, b / i2, -k / i2, -b / i2]])
    return a, np.array([[0, 0], [1 / i1, 0], [0, 0], [0, 1 / i2]])


def discrete(base: dict, dt: float):
    """Exact discretisation for inputs linear between samples: x+ = F x + G0 u + G1 (u+ - u)."""
    a, b = matrices(base)
    m = np.zeros((8, 8))
    m[:4, :4], m[:4, 4:6], m[4:6, 6:8] = a * dt, b * dt, np.eye(2)
    e = expm(m)
    return tuple(np.ascontiguousarray(x) for x in (e[:4, :4], e[:4, 4:6], e[:4, 6:8]))


@njit(cache=True)
def _march(f, g0, g1, u, x0):
    n = u.shape[0]
    out = np.empty((n, 4))
    x = x0.copy()
    for k in range(n):
        out[k] = x
        if k < n - 1:
            x = f @ x + g0 @ u[k] + g1 @ (u[k + 1] - u[k])
    return out


def linear_response(base, dt, u, x0):
    """Response (n x 4) of the linear axis to torques u (n x 2: motor, table), linear between samples, from x0."""
    f, g0, g1 = discrete(base, dt)
    return _march(f, g0, g1, np.ascontiguousarray(u), np.ascontiguousarray(x0, dtype=float))


def refit_residual(base: dict, dt: float, states: np.ndarray, error: np.ndarray, outputs) -> np.ndarray:
    """What stays of `error` (n x 4, effect minus no effect) in the columns `outputs` after the windowed linear re-fit.

    `states` (n x 4) is the trajectory about which the base parameters vary. Rows beyond the last whole window are dropped.
    """
    th1, w1, th2, w2 = states.T
    a1, a2, twist, rate = np.gradient(w1, dt), np.gradient(w2, dt), th1 - th2, w1 - w2
    zero = np.zeros_like(a1)
    forces = [np.stack(x, axis=1) for x in ((-a1, zero), (zero, -a2), (-rate, rate), (-twist, twist))]
    columns = [error] + [linear_response(base, dt, f * s, np.zeros(4)) for f, s in
                         zip(forces, (base["I1"], base["I2"], base["B"], base["K"]))]
    free = np.stack([linear_response(base, dt, np.zeros((WINDOW, 2)), e)[:, outputs].ravel() for e in np.eye(4)], axis=1)
    q, _ = np.linalg.qr(free / np.linalg.norm(free, axis=0))
    windows = states.shape[0] // WINDOW
    flat = np.stack([c[: windows * WINDOW, outputs].reshape(windows, -1) for c in columns], axis=2)
    flat = flat - np.einsum("ij,wjc->wic", q, np.einsum("ij,wic->wjc", q, flat))
    flat = flat.reshape(-1, len(columns))
    scale = np.linalg.norm(flat[:, 1:], axis=0)
    sens = flat[:, 1:] / np.where(scale > 0, scale, 1.0)
    fit, *_ = np.linalg.lstsq(sens, flat[:, 0], rcond=1e-12)
    return flat[:, 0] - sens @ fit
