"""An independent simulator of the drive axis, for the withheld-effect check.

It shares no line, no formula table and no integrator with the Rust crate: classical Runge-Kutta of order 4 on fine fixed
sub-steps (40 a sample and more), where the crate steps Newmark implicitly once a sample.

    I1*w1' = u - friction_motor + load + ripple(th1) - c            motor and screw
    I2*w2' = c - friction_table - ... - m                           table
    I3*w3' = m,  m = K3*(th2 - th3) + B3*(w2 - w3)                  third inertia, when there is one

`c` is the coupling torque, `u` the torque that reaches the motor after saturation, gain, delay and lag. SI units.

Formulations (each differs from the crate on purpose):

- dry friction: LuGre bristles (Canudas de Wit et al. 1995), z' = w - s0*|w|*z/g(w), F = s0*z + s1(w)*z', stiff for Coulomb and
  soft for presliding; z is advanced by its exact exponential for the frozen speed (Strang split, half a sub-step on either side).
  Stiff bristles damp only while stuck, s1(w) = s1*exp(-(w/wd)^2) (Olsson 1996, section 3.4), and get twice the sub-steps;
- backlash: contact on either flank with spring and damper, the sum clipped so that a flank never pulls; no torque in the gap;
- delay: the held torque shifted in continuous time, sub-steps broken at the shifted jumps;
- lag: tau*u' = r - u integrated beside the mechanics;
- coupling hysteresis: Bouc-Wen, torque F*z in parallel with the spring, x_y*z' = d'*(1 - |z|^n) while z grows and
  d'*(1 + e*|z|^n) while it shrinks: e = 0 is beta = gamma (it unloads elastically), e = 1 with n = 1 is Dahl's curve;
- end stop: Kelvin-Voigt contact, clipped at zero.
"""
from __future__ import annotations

import math

import numpy as np
from numba import njit

SUBSTEPS = 40
SUBSTEPS_STIFF = 80  # with stiff bristles

# Every scalar the kernel reads, in order; all default to 0 = absent.
NAMES = (
    "I1", "I2", "B", "K",
    "fm_c", "fm_s", "fm_ws", "fm_asym", "fm_s0", "fm_s1", "fm_wd", "fm_rate",
    "ft_c", "ft_s", "ft_ws", "ft_asym", "ft_s0", "ft_s1", "ft_wd", "ft_rate",
    "vm", "vm_asym", "vm_rate", "vt", "vt_asym",
    "load_m", "load_t",
    "ripple", "ripple_order", "ripple_phase",
    "backlash", "k3", "hyst", "hyst_x", "hyst_n", "hyst_even",
    "kdrift", "kdrift_tau",
    "I3", "K3", "B3",
    "dist", "dist_f", "dist_phase",
    "unb", "unb_phase", "drag",
    "stop_hi", "stop_lo", "stop_k", "stop_b",
    "sat", "gain", "delay", "lag",
)
INDEX = {name: i for i, name in enumerate(NAMES)}
(
    I1, I2, B, K,
    FM_C, FM_S, FM_WS, FM_ASYM, FM_S0, FM_S1, FM_WD, FM_RATE,
    FT_C, FT_S, FT_WS, FT_ASYM, FT_S0, FT_S1, FT_WD, FT_RATE,
    VM, VM_ASYM, VM_RATE, VT, VT_ASYM,
    LOAD_M, LOAD_T,
    RIPPLE, RIPPLE_ORDER, RIPPLE_PHASE,
    BACKLASH, K3C, HYST, HYST_X, HYST_N, HYST_EVEN,
    KDRIFT, KDRIFT_TAU,
    I3, K3, B3,
    DIST, DIST_F, DIST_PHASE,
    UNB, UNB_PHASE, DRAG,
    STOP_HI, STOP_LO, STOP_K, STOP_B,
    SAT, GAIN, DELAY, LAG,
) = range(len(NAMES))
FIRST_FRICTION = {"motor": FM_C, "table": FT_C}


def pack(params: dict) -> np.ndarray:
    """Parameter vector of the kernel from a dict of `NAMES`; an unknown name is an error, a missing one is off."""
    p = np.zeros(len(NAMES))
    p[SAT] = np.inf
    p[GAIN] = 1.0
    p[STOP_HI] = np.inf
    p[STOP_LO] = -np.inf
    for name, value in params.items():
        p[INDEX[name]] = value
    return p


@njit(cache=True, inline="always")
def _level(p, c, w, t):
    """Sliding friction level g(w) >= 0 of the friction whose parameters start at index c: Coulomb, Stribeck, side, drift."""
    base = p[c] + p[c + 7] * max(t, 0.0)
    g = base
    if p[c + 2] > 0.0:
        g += (p[c + 1] - p[c]) * math.exp(-((w / p[c + 2]) ** 2))
    if w > 0.0:
        g *= 1.0 + p[c + 3]
    elif w < 0.0:
        g *= 1.0 - p[c + 3]
    return max(g, 0.0)


@njit(cache=True, inline="always")
def _bristle(p, c, z, w, t, h):
    """Bristle deflection after time h at constant speed w: exact solution of the LuGre state equation."""
    if w == 0.0:
        return z
    g = _level(p, c, w, t)
    z_end = g / p[c + 4] * (1.0 if w > 0.0 else -1.0)
    if z_end == 0.0:
        return 0.0
    return z_end + (z - z_end) * math.exp(-abs(w) * h * p[c + 4] / g)


@njit(cache=True, inline="always")
def _friction(p, c, z, w, t):
    """Torque of the bristles on the body that moves with speed w."""
    g = _level(p, c, w, t)
    zdot = w - p[c + 4] * abs(w) * z / g if g > 0.0 else 0.0
    s1 = p[c + 5]
    if p[c + 6] > 0.0:
        s1 *= math.exp(-((w / p[c + 6]) ** 2))
    return p[c + 4] * z + s1 * zdot


@njit(cache=True, inline="always")
def _rhs(p, y, t, r, zm, zt, out):
    """Time derivative of y = [th1 w1 th2 w2 zh th3 w3 u] under the delayed, limited torque r; zm, zt bristles."""
    th1, w1, th2, w2, zh = y[0], y[1], y[2], y[3], y[4]
    u = r
    out[7] = 0.0
    if p[LAG] > 0.0:
        u = y[7]
        out[7] = (r - u) / p[LAG]

    d = th1 - th2
    dd = w1 - w2
    k = p[K]
    if p[KDRIFT] != 0.0:
        ts = max(t, 0.0)
        if p[KDRIFT_TAU] > 0.0:
            k *= 1.0 + p[KDRIFT] * p[KDRIFT_TAU] * (1.0 - math.exp(-ts / p[KDRIFT_TAU]))
        else:
            k *= 1.0 + p[KDRIFT] * ts
    gap = p[BACKLASH]
    if gap > 0.0:
        if d > gap:
            c = max(0.0, k * (d - gap) + p[B] * dd)
        elif d < -gap:
            c = min(0.0, k * (d + gap) + p[B] * dd)
        else:
            c = 0.0
    else:
        c = k * (d + p[K3C] * d * d * d) + p[B] * dd
    out[4] = 0.0
    if p[HYST] != 0.0:
        c += p[HYST] * zh
        turn = abs(zh) ** p[HYST_N]
        if dd * zh <= 0.0:
            turn *= -p[HYST_EVEN]
        out[4] = dd / p[HYST_X] * (1.0 - turn)

    m1 = u - c + p[LOAD_M]
    if p[FM_S0] > 0.0:
        m1 -= _friction(p, FM_C, zm, w1, t)
    vm = p[VM] + p[VM_RATE] * max(t, 0.0)
    m1 -= vm * w1 * (1.0 + (p[VM_ASYM] if w1 > 0.0 else -p[VM_ASYM]))
    if p[RIPPLE] != 0.0:
        m1 += p[RIPPLE] * math.sin(p[RIPPLE_ORDER] * th1 + p[RIPPLE_PHASE])

    m2 = c + p[LOAD_T] - p[DRAG] * w2 * abs(w2)
    if p[FT_S0] > 0.0:
        m2 -= _friction(p, FT_C, zt, w2, t)
    m2 -= p[VT] * w2 * (1.0 + (p[VT_ASYM] if w2 > 0.0 else -p[VT_ASYM]))
    if p[DIST] != 0.0:
        m2 += p[DIST] * math.sin(2.0 * math.pi * p[DIST_F] * t + p[DIST_PHASE])
    if p[UNB] != 0.0:
        m2 += p[UNB] * math.sin(th2 + p[UNB_PHASE])
    if th2 > p[STOP_HI]:
        m2 -= max(0.0, p[STOP_K] * (th2 - p[STOP_HI]) + p[STOP_B] * w2)
    elif th2 < p[STOP_LO]:
        m2 -= min(0.0, p[STOP_K] * (th2 - p[STOP_LO]) + p[STOP_B] * w2)
    out[5] = 0.0
    out[6] = 0.0
    if p[I3] > 0.0:
        m3 = p[K3] * (th2 - y[5]) + p[B3] * (w2 - y[6])
        m2 -= m3
        out[5] = y[6]
        out[6] = m3 / p[I3]
    out[0] = w1
    out[1] = m1 / p[I1]
    out[2] = w2
    out[3] = m2 / p[I2]


@njit(cache=True)
def _torque(p, torque, n, k, s, dt, linear):
    """Command at offset s into sample k, before the delay; k below zero repeats the first sample's value."""
    if k < 0:
        return torque[0]
    if k >= n - 1:
        return torque[n - 1]
    if linear:
        return torque[k] + (torque[k + 1] - torque[k]) * s / dt
    return torque[k]


@njit(cache=True)
def _limit(p, v):
    return p[GAIN] * min(max(v, -p[SAT]), p[SAT])


@njit(cache=True)
def _run(p, torque, dt, t0, linear, x0, ns, out):
    """Fill out (n x 4: th1 w1 th2 w2 at the samples) from the state x0 at time t0; torque[k] belongs to t0 + k*dt."""
    n = torque.shape[0]
    y = np.zeros(8)
    y[0], y[1], y[2], y[3] = x0[0], x0[1], x0[2], x0[3]
    y[5], y[6] = x0[2], x0[3]
    y[7] = _limit(p, torque[0])
    zm = 0.0
    zt = 0.0
    k1 = np.zeros(8)
    k2 = np.zeros(8)
    k3 = np.zeros(8)
    k4 = np.zeros(8)
    yt = np.zeros(8)
    whole = int(math.floor(p[DELAY] / dt))
    part = p[DELAY] - whole * dt
    if part < 1e-9 * dt:
        part = 0.0
    for k in range(n):
        for i in range(4):
            out[k, i] = y[i]
        if k == n - 1:
            break
        tk = t0 + k * dt
        for piece in range(2):
            if piece == 0:
                if part == 0.0:
                    continue
                begin, length, source, shift = 0.0, part, k - whole - 1, dt - part
            else:
                begin, length, source, shift = part, dt - part, k - whole, -part
            steps = max(1, int(math.ceil(ns * length / dt - 1e-9)))
            h = length / steps
            for j in range(steps):
                s = begin + j * h
                t = tk + s
                q = s + shift
                r0 = _limit(p, _torque(p, torque, n, source, q, dt, linear))
                rm = _limit(p, _torque(p, torque, n, source, q + 0.5 * h, dt, linear))
                r1 = _limit(p, _torque(p, torque, n, source, q + h, dt, linear))
                if p[FM_S0] > 0.0:
                    zm = _bristle(p, FM_C, zm, y[1], t, 0.5 * h)
                if p[FT_S0] > 0.0:
                    zt = _bristle(p, FT_C, zt, y[3], t, 0.5 * h)
                _rhs(p, y, t, r0, zm, zt, k1)
                for i in range(8):
                    yt[i] = y[i] + 0.5 * h * k1[i]
                _rhs(p, yt, t + 0.5 * h, rm, zm, zt, k2)
                for i in range(8):
                    yt[i] = y[i] + 0.5 * h * k2[i]
                _rhs(p, yt, t + 0.5 * h, rm, zm, zt, k3)
                for i in range(8):
                    yt[i] = y[i] + h * k3[i]
                _rhs(p, yt, t + h, r1, zm, zt, k4)
                for i in range(8):
                    y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
                if p[FM_S0] > 0.0:
                    zm = _bristle(p, FM_C, zm, y[1], t + h, 0.5 * h)
                if p[FT_S0] > 0.0:
                    zt = _bristle(p, FT_C, zt, y[3], t + h, 0.5 * h)


def stiff_bristle(params: dict, place: str, level: float, dt: float) -> dict:
    """Bristle stiffness and damping that make LuGre a Coulomb law of about `level` for this step: the bristle's own frequency is
    0.5 rad a sub-step (so the split stays accurate), damping ratio 0.7 while stuck; it breaks away within 1e-6 rad."""
    key, inertia = ("fm", params["I1"]) if place == "motor" else ("ft", params["I2"])
    frequency = 0.5 * SUBSTEPS_STIFF / dt
    s0 = inertia * frequency**2
    # Damping ends well before the speed at which a bristle of this size slides steadily.
    return {f"{key}_s0": s0, f"{key}_s1": 2.0 * 0.7 * math.sqrt(s0 * inertia), f"{key}_wd": level / s0 * frequency}


def simulate(params: dict, torque, dt: float, *, x0=(0.0, 0.0, 0.0, 0.0), t0: float = 0.0, hold: str = "zoh",
             substeps: int | None = None) -> np.ndarray:
    """States at the samples, n x 4 (th1 [rad], w1 [rad/s], th2, w2), under the sampled torque [N.m]."""
    if substeps is None:
        substeps = SUBSTEPS_STIFF if "fm_wd" in params or "ft_wd" in params else SUBSTEPS
    torque = np.ascontiguousarray(torque, dtype=float)
    out = np.empty((torque.size, 4))
    _run(pack(params), torque, dt, t0, hold == "linear", np.asarray(x0, dtype=float), substeps, out)
    return out


def periodic_state(params: dict, lines, amplitudes, phases, period: float, t: float):
    """State of the linear two-inertia axis in its periodic response to sum A*cos(2*pi*h*t/period + phi), without drift."""
    i1, i2, b, k = (params[x] for x in ("I1", "I2", "B", "K"))
    state = np.zeros(4)
    for h, a, phi in zip(lines, amplitudes, phases):
        s = 2j * math.pi * h / period
        m = np.array([[i1 * s * s + b * s + k, -b * s - k], [-b * s - k, i2 * s * s + b * s + k]])
        q = np.linalg.solve(m, np.array([a * np.exp(1j * (phi + s.imag * t)), 0.0]))
        state += np.real([q[0], s * q[0], q[1], s * q[1]])
    return state


def delayed(position, speed, dt: float, delay: float) -> np.ndarray:
    """position(t - delay) at the samples by cubic Hermite interpolation; before the first sample it runs back at constant speed."""
    n = position.size
    x = np.arange(n) - delay / dt
    k = np.clip(np.floor(x).astype(int), 0, n - 2)
    s = x - k
    p0, p1, m0, m1 = position[k], position[k + 1], speed[k] * dt, speed[k + 1] * dt
    value = (2 * s**3 - 3 * s**2 + 1) * p0 + (s**3 - 2 * s**2 + s) * m0 + (3 * s**2 - 2 * s**3) * p1 + (s**3 - s**2) * m1
    return np.where(x < 0, position[0] + speed[0] * dt * x, value)
