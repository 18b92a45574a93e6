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
    for i in range(4):
        out[0, i] = x0[i]
    for k in range(n - 1):
        for i in range(4):
            v = 0.0
            for j in range(4):
                v += f[i, j] * out[k, j]
            for j in range(2):
                v += g0[i, j] * u[k, j] + g1[i, j] * (u[k + 1, j] - u[k, j])
            out[k + 1, i] = v
    return out


def linear_response(base, dt, u, x0):
    """Response (n x 4) of the linear axis to torques u (n x 2: motor, table), linear between samples, from x0."""
    f, g0, g1 = discrete(base, dt)
    return _march(f, g0, g1, np.ascontiguousarray(u), np.ascontiguousarray(x0, dtype=float))


class Windows:
    """Windows of a record with their initial states projected out, seen through the columns `outputs` of the state."""

    def __init__(self, base: dict, dt: float, samples: int, outputs):
        self.base, self.dt, self.outputs, self.count = base, dt, outputs, samples // WINDOW
        free = [linear_response(base, dt, np.zeros((WINDOW, 2)), e)[:, outputs].ravel() for e in np.eye(4)]
        free = np.stack(free, axis=1)
        self.q, _ = np.linalg.qr(free / np.linalg.norm(free, axis=0))

    def flat(self, trace: np.ndarray) -> np.ndarray:
        """A trace (n x 4) as one vector, less what initial states explain; rows beyond the last whole window are dropped."""
        w = trace[: self.count * WINDOW, self.outputs].reshape(self.count, -1)
        return (w - (w @ self.q) @ self.q.T).ravel()

    def forced(self, motor, table) -> np.ndarray:
        """Flat response to torques on motor and table (n each)."""
        return self.flat(linear_response(self.base, self.dt, np.stack([motor, table], axis=1), np.zeros(4)))

    def parameters(self, states: np.ndarray) -> list:
        """Flat sensitivities to I1, I2, B, K about the trajectory `states`."""
        th1, w1, th2, w2 = states.T
        a1, a2, twist, rate = np.gradient(w1, self.dt), np.gradient(w2, self.dt), th1 - th2, w1 - w2
        zero = np.zeros_like(a1)
        return [self.forced(*f) for f in ((-a1, zero), (zero, -a2), (-rate, rate), (-twist, twist))]


def unit(columns) -> np.ndarray:
    """Columns (list of vectors) as a matrix, each scaled to unit length."""
    m = np.stack(columns, axis=1)
    return m / np.maximum(np.linalg.norm(m, axis=0), 1e-300)


def refit_residual(base: dict, dt: float, states: np.ndarray, error: np.ndarray, outputs) -> np.ndarray:
    """What stays of `error` (n x 4, effect minus no effect) after the windowed linear re-fit about the trajectory `states`."""
    windows = Windows(base, dt, states.shape[0], outputs)
    target, sens = windows.flat(error), unit(windows.parameters(states))
    fit, *_ = np.linalg.lstsq(sens, target, rcond=1e-12)
    return target - sens @ fit
