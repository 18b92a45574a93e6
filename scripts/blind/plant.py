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
- end stop: Kelvin-Voigt contact, clipped at zero;
- gravity: resists with gs*sin(r*th2) + gc*cos(r*th2), the weight on a hinge; external spring: resists with k*(th2 - rest);
- dead zone of the amplifier: what passes is the command less its part within +-d;
- load-dependent friction: the bristles' level grows by f times the torque carried, |K*(th1-th2) + B*(w1-w2)|, on a rigid axis by f times
  |the table's position-dependent and constant torques|, as it is now (no step's delay);
- friction that depends on position: a further bristle on the motor, of level f, its torque times exp(-((th1-c)/width)^2);
- a mode behind the motor: I0*w0' = K0*(th1-th0) + B0*(w1-w0), integrated as the rest;
- a rigid axis: one inertia I1, every torque of motor and table on it, th2 = th1;
- what no library holds: warming, motor friction times 1 + a*exp(-t/tau); a jam, f*tanh(w1/ws) between two instants; any sampled torque.

A drive may close the loop (`Drive`): it sets the command at every sample from its encoder's reading, before that sample's step.
"""
from __future__ import annotations

import math

import numpy as np
from numba import njit

from drive import Drive, sample

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
    "rigid", "fm_load", "ft_load",
    "grav_s", "grav_c", "grav_r", "spring", "spring_rest",
    "dead", "fp_c", "fp_centre", "fp_width", "fp_s0", "fp_s1", "fp_wd",
    "I0", "K0", "B0", "warm", "warm_tau", "jam", "jam_from", "jam_to", "jam_speed",
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
    RIGID, FM_LOAD, FT_LOAD,
    GRAV_S, GRAV_C, GRAV_R, SPRING, SPRING_REST,
    DEAD, FP_C, FP_CENTRE, FP_WIDTH, FP_S0, FP_S1, FP_WD,
    I0, K0, B0, WARM, WARM_TAU, JAM, JAM_FROM, JAM_TO, JAM_SPEED,
) = range(len(NAMES))
FIRST_FRICTION = {"motor": FM_C, "table": FT_C}

# What the kernel can tell of one run beside the states: torque of every effect, mean over each sample, signed as it acts on its body.
# `input` is what the motor gets beyond the command, `coupling` what passes beyond K*twist + B*rate (on the table; minus it on the motor).
PARTS = ("input", "coupling", "load_m", "fm", "vm", "ripple", "fp", "mode0", "jam", "extra_m",
         "load_t", "drag", "ft", "vt", "dist", "unb", "stop", "mode3", "gravity", "spring", "extra_t")
(
    Q_INPUT, Q_COUPLING, Q_LOAD_M, Q_FM, Q_VM, Q_RIPPLE, Q_FP, Q_MODE0, Q_JAM, Q_EXTRA_M,
    Q_LOAD_T, Q_DRAG, Q_FT, Q_VT, Q_DIST, Q_UNB, Q_STOP, Q_MODE3, Q_GRAVITY, Q_SPRING, Q_EXTRA_T,
) = range(len(PARTS))


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
def _carried(p, c, y):
    """Torque that the friction at index c feels as load, times its factor [N.m]; 0 without one."""
    factor = p[FM_LOAD] if c == FM_C else p[FT_LOAD]
    if factor == 0.0:
        return 0.0
    if p[RIGID] == 0.0:
        return factor * abs(p[K] * (y[0] - y[2]) + p[B] * (y[1] - y[3]))
    m = p[LOAD_T] + p[LOAD_M]
    if p[GRAV_S] != 0.0 or p[GRAV_C] != 0.0:
        m -= p[GRAV_S] * math.sin(p[GRAV_R] * y[2]) + p[GRAV_C] * math.cos(p[GRAV_R] * y[2])
    if p[UNB] != 0.0:
        m += p[UNB] * math.sin(y[2] + p[UNB_PHASE])
    m -= p[SPRING] * (y[2] - p[SPRING_REST])
    return factor * abs(m)


@njit(cache=True, inline="always")
def _level(p, c, w, t, load):
    """Sliding friction level g(w) >= 0 of the friction whose parameters start at index c: Coulomb, Stribeck, side, drift, load."""
    base = p[c] + p[c + 7] * max(t, 0.0) + load
    if p[WARM] != 0.0 and c == FM_C:
        base *= 1.0 + p[WARM] * math.exp(-max(t, 0.0) / p[WARM_TAU])
    g = base
    if p[c + 2] > 0.0:
        g += (p[c + 1] - p[c]) * math.exp(-((w / p[c + 2]) ** 2))
    if w > 0.0:
        g *= 1.0 + p[c + 3]
    elif w < 0.0:
        g *= 1.0 - p[c + 3]
    return max(g, 0.0)


@njit(cache=True, inline="always")
def _bristle(p, c, z, w, t, h, load):
    """Bristle deflection after time h at constant speed w: exact solution of the LuGre state equation."""
    if w == 0.0:
        return z
    g = _level(p, c, w, t, load)
    if g == 0.0:
        return 0.0
    z_end = g / p[c + 4] * (1.0 if w > 0.0 else -1.0)
    return z_end + (z - z_end) * math.exp(-abs(w) * h * p[c + 4] / g)


@njit(cache=True, inline="always")
def _friction(p, c, z, w, t, load):
    """Torque of the bristles on the body that moves with speed w."""
    g = _level(p, c, w, t, load)
    zdot = w - p[c + 4] * abs(w) * z / g if g > 0.0 else 0.0
    s1 = p[c + 5]
    if p[c + 6] > 0.0:
        s1 *= math.exp(-((w / p[c + 6]) ** 2))
    return p[c + 4] * z + s1 * zdot


@njit(cache=True, inline="always")
def _tight_bristle(p, z, w, h):
    """The bristle of the friction that depends on position, at its full level: where it acts is a factor on its torque."""
    if w == 0.0:
        return z
    z_end = p[FP_C] / p[FP_S0] * (1.0 if w > 0.0 else -1.0)
    return z_end + (z - z_end) * math.exp(-abs(w) * h * p[FP_S0] / p[FP_C])


@njit(cache=True, inline="always")
def _tight_friction(p, z, th, w):
    zdot = w - p[FP_S0] * abs(w) * z / p[FP_C]
    f = p[FP_S0] * z + p[FP_S1] * math.exp(-((w / p[FP_WD]) ** 2)) * zdot
    return f * math.exp(-(((th - p[FP_CENTRE]) / p[FP_WIDTH]) ** 2))


@njit(cache=True, inline="always")
def _rhs(p, y, t, r, zm, zt, zp, em, et, out, q):
    """Time derivative of y = [th1 w1 th2 w2 zh th3 w3 u th0 w0] under the delayed, limited torque r and the sampled torques em, et;
    zm, zt, zp bristles; q gets the torque of every effect (`PARTS`)."""
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

    q[Q_INPUT] = u
    q[Q_COUPLING] = c - (p[K] * d + p[B] * dd)

    m1 = u - c + p[LOAD_M]
    if p[FM_S0] > 0.0:
        f = _friction(p, FM_C, zm, w1, t, _carried(p, FM_C, y))
        q[Q_FM] = -f
        m1 -= f
    vm = p[VM] + p[VM_RATE] * max(t, 0.0)
    if p[WARM] != 0.0:
        vm *= 1.0 + p[WARM] * math.exp(-max(t, 0.0) / p[WARM_TAU])
    f = vm * w1 * (1.0 + (p[VM_ASYM] if w1 > 0.0 else -p[VM_ASYM]))
    q[Q_VM] = -f
    m1 -= f
    if p[RIPPLE] != 0.0:
        f = p[RIPPLE] * math.sin(p[RIPPLE_ORDER] * th1 + p[RIPPLE_PHASE])
        q[Q_RIPPLE] = f
        m1 += f
    if p[FP_C] > 0.0:
        f = _tight_friction(p, zp, th1, w1)
        q[Q_FP] = -f
        m1 -= f
    out[8] = 0.0
    out[9] = 0.0
    if p[I0] > 0.0:
        m0 = p[K0] * (th1 - y[8]) + p[B0] * (w1 - y[9])
        q[Q_MODE0] = -m0
        m1 -= m0
        out[8] = y[9]
        out[9] = m0 / p[I0]
    if p[JAM] != 0.0 and p[JAM_FROM] <= t < p[JAM_TO]:
        f = p[JAM] * math.tanh(w1 / p[JAM_SPEED])
        q[Q_JAM] = -f
        m1 -= f
    elif p[JAM] != 0.0:
        q[Q_JAM] = 0.0
    m1 += em

    drag = p[DRAG] * w2 * abs(w2)
    q[Q_DRAG] = -drag
    m2 = c + p[LOAD_T] - drag
    if p[FT_S0] > 0.0:
        f = _friction(p, FT_C, zt, w2, t, _carried(p, FT_C, y))
        q[Q_FT] = -f
        m2 -= f
    f = p[VT] * w2 * (1.0 + (p[VT_ASYM] if w2 > 0.0 else -p[VT_ASYM]))
    q[Q_VT] = -f
    m2 -= f
    if p[DIST] != 0.0:
        f = p[DIST] * math.sin(2.0 * math.pi * p[DIST_F] * t + p[DIST_PHASE])
        q[Q_DIST] = f
        m2 += f
    if p[UNB] != 0.0:
        f = p[UNB] * math.sin(th2 + p[UNB_PHASE])
        q[Q_UNB] = f
        m2 += f
    q[Q_STOP] = 0.0
    if th2 > p[STOP_HI]:
        f = max(0.0, p[STOP_K] * (th2 - p[STOP_HI]) + p[STOP_B] * w2)
        q[Q_STOP] = -f
        m2 -= f
    elif th2 < p[STOP_LO]:
        f = min(0.0, p[STOP_K] * (th2 - p[STOP_LO]) + p[STOP_B] * w2)
        q[Q_STOP] = -f
        m2 -= f
    if p[GRAV_S] != 0.0 or p[GRAV_C] != 0.0:
        f = p[GRAV_S] * math.sin(p[GRAV_R] * th2) + p[GRAV_C] * math.cos(p[GRAV_R] * th2)
        q[Q_GRAVITY] = -f
        m2 -= f
    if p[SPRING] != 0.0:
        f = p[SPRING] * (th2 - p[SPRING_REST])
        q[Q_SPRING] = -f
        m2 -= f
    m2 += et
    out[5] = 0.0
    out[6] = 0.0
    if p[I3] > 0.0:
        m3 = p[K3] * (th2 - y[5]) + p[B3] * (w2 - y[6])
        q[Q_MODE3] = -m3
        m2 -= m3
        out[5] = y[6]
        out[6] = m3 / p[I3]
    out[0] = w1
    out[2] = w2
    if p[RIGID] != 0.0:
        out[1] = (m1 + m2) / p[I1]
        out[3] = out[1]
    else:
        out[1] = m1 / p[I1]
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
    if p[DEAD] > 0.0:
        v -= min(max(v, -p[DEAD]), p[DEAD])
    return p[GAIN] * min(max(v, -p[SAT]), p[SAT])


@njit(cache=True)
def _between(values, column, k, n, s):
    """values[k, column] to values[k + 1, column], straight, at the share s of the sample."""
    last = values[min(k + 1, n - 1), column]
    return values[k, column] + (last - values[k, column]) * s


@njit(cache=True)
def _run(p, torque, dt, t0, linear, x0, ns, out, extra, parts, drive, aim, reading):
    """Fill out (n x 4: th1 w1 th2 w2 at the samples) from the state x0 at time t0; torque[k] belongs to t0 + k*dt.

    extra: n x 2 sampled torques on motor and table, or 0 rows; parts: n x len(PARTS) to fill, or 0 rows; drive: the drive's constants,
    or empty for an open loop, else it fills torque from aim (n x 3: position, speed, acceleration) and the encoder's noise `reading`."""
    n = torque.shape[0]
    y = np.zeros(10)
    y[0], y[1], y[2], y[3] = x0[0], x0[1], x0[2], x0[3]
    y[5], y[6] = x0[2], x0[3]
    y[8], y[9] = x0[0], x0[1]
    closed = drive.shape[0] > 0
    memory = np.zeros(3)
    if closed:
        memory[2] = drive[6]
        sample(drive, memory, torque, aim, y[0] + reading[0], 0, dt)
        memory[2] = drive[6]
    y[7] = _limit(p, torque[0])
    zm = 0.0
    zt = 0.0
    zp = 0.0
    em = 0.0
    et = 0.0
    k1 = np.zeros(10)
    k2 = np.zeros(10)
    k3 = np.zeros(10)
    k4 = np.zeros(10)
    yt = np.zeros(10)
    q = np.zeros(parts.shape[1])
    spare = np.zeros(parts.shape[1])
    told = parts.shape[0] > 0
    q[Q_LOAD_M], q[Q_LOAD_T] = p[LOAD_M], p[LOAD_T]
    pushed = extra.shape[0] > 0
    whole = int(math.floor(p[DELAY] / dt))
    part = p[DELAY] - whole * dt
    if part < 1e-9 * dt:
        part = 0.0
    for k in range(n):
        if closed and k >= drive[7]:  # the drive is off and its brake holds
            y[1] = 0.0
            y[3] = 0.0
            torque[k] = 0.0
            for i in range(4):
                out[k, i] = y[i]
            continue
        for i in range(4):
            out[k, i] = y[i]
        if closed and k > 0:
            sample(drive, memory, torque, aim, y[0] + reading[k], k, dt)
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
                at = s + shift
                r0 = _limit(p, _torque(p, torque, n, source, at, dt, linear))
                rm = _limit(p, _torque(p, torque, n, source, at + 0.5 * h, dt, linear))
                r1 = _limit(p, _torque(p, torque, n, source, at + h, dt, linear))
                if pushed:
                    em = _between(extra, 0, k, n, (s + 0.5 * h) / dt)
                    et = _between(extra, 1, k, n, (s + 0.5 * h) / dt)
                if p[FM_S0] > 0.0:
                    zm = _bristle(p, FM_C, zm, y[1], t, 0.5 * h, _carried(p, FM_C, y))
                if p[FT_S0] > 0.0:
                    zt = _bristle(p, FT_C, zt, y[3], t, 0.5 * h, _carried(p, FT_C, y))
                if p[FP_C] > 0.0:
                    zp = _tight_bristle(p, zp, y[1], 0.5 * h)
                _rhs(p, y, t, r0, zm, zt, zp, em, et, k1, q)
                if told:
                    q[Q_INPUT] -= _torque(p, torque, n, k, s, dt, linear)
                    q[Q_EXTRA_M] = em
                    q[Q_EXTRA_T] = et
                    for i in range(q.shape[0]):
                        parts[k, i] += q[i] * h / dt
                for i in range(10):
                    yt[i] = y[i] + 0.5 * h * k1[i]
                _rhs(p, yt, t + 0.5 * h, rm, zm, zt, zp, em, et, k2, spare)
                for i in range(10):
                    yt[i] = y[i] + 0.5 * h * k2[i]
                _rhs(p, yt, t + 0.5 * h, rm, zm, zt, zp, em, et, k3, spare)
                for i in range(10):
                    yt[i] = y[i] + h * k3[i]
                _rhs(p, yt, t + h, r1, zm, zt, zp, em, et, k4, spare)
                for i in range(10):
                    y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
                if p[FM_S0] > 0.0:
                    zm = _bristle(p, FM_C, zm, y[1], t + h, 0.5 * h, _carried(p, FM_C, y))
                if p[FT_S0] > 0.0:
                    zt = _bristle(p, FT_C, zt, y[3], t + h, 0.5 * h, _carried(p, FT_C, y))
                if p[FP_C] > 0.0:
                    zp = _tight_bristle(p, zp, y[1], 0.5 * h)


def stiff_bristle(params: dict, place: str, level: float, dt: float, substeps: int = SUBSTEPS_STIFF) -> dict:
    """Bristle stiffness and damping that make LuGre a Coulomb law of about `level` for this step: the bristle's own frequency is
    0.5 rad a sub-step (so the split stays accurate), damping ratio 0.7 while stuck; it breaks away within 1e-6 rad."""
    key, inertia = ("fm", params["I1"]) if place == "motor" else ("ft", params["I2"])
    frequency = 0.5 * substeps / dt
    s0 = inertia * frequency**2
    # Damping ends well before the speed at which a bristle of this size slides steadily.
    return {f"{key}_s0": s0, f"{key}_s1": 2.0 * 0.7 * math.sqrt(s0 * inertia), f"{key}_wd": level / s0 * frequency}


NOTHING = np.zeros((0, len(PARTS)))


def simulate(params: dict, torque, dt: float, *, x0=(0.0, 0.0, 0.0, 0.0), t0: float = 0.0, hold: str = "zoh",
             substeps: int | None = None) -> np.ndarray:
    """States at the samples, n x 4 (th1 [rad], w1 [rad/s], th2, w2), under the sampled torque [N.m]."""
    return run(params, torque, dt, x0=x0, t0=t0, hold=hold, substeps=substeps)[0]


def run(params: dict, torque, dt: float, *, x0=(0.0, 0.0, 0.0, 0.0), t0: float = 0.0, hold: str = "zoh", substeps: int | None = None,
        extra=None, tell: bool = False, drive: Drive | None = None, aim=None, reading=None):
    """As `simulate`, with all that a drive and an observer add: (states n x 4, command n, parts n x len(PARTS) or None).

    extra: n x 2 torques on motor and table, straight between samples [N.m]; drive with aim (n x 3: position, speed, acceleration) and
    reading (n, noise of its encoder) closes the loop and sets the command, of which `torque` then only gives the length.
    """
    if substeps is None:
        substeps = SUBSTEPS_STIFF if {"fm_wd", "ft_wd", "fp_wd"} & params.keys() else SUBSTEPS
    torque = np.array(torque, dtype=float)
    out = np.empty((torque.size, 4))
    parts = np.zeros((torque.size, len(PARTS))) if tell else NOTHING
    extra = np.zeros((0, 2)) if extra is None else np.ascontiguousarray(extra, dtype=float)
    law = np.zeros(0) if drive is None else drive.packed()
    aim = np.zeros((0, 3)) if aim is None else np.ascontiguousarray(aim, dtype=float)
    reading = np.zeros(torque.size) if reading is None else np.ascontiguousarray(reading, dtype=float)
    _run(pack(params), torque, dt, t0, hold == "linear", np.asarray(x0, dtype=float), substeps, out, extra, parts, law, aim, reading)
    return out, torque, parts if tell else None


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
