"""The hidden effects: what is drawn for each class, and how a size (a share between 0.05 and 0.5) becomes parameters.

A size is the effect's rms torque over the rms torque of the excitation, or, for effects that are not torques, the equivalent
share of twist, stiffness, period or limit; README.md lists the formula of each class. `Reference` holds the rms values of the
axis without the effect, under the same excitation, on which the equivalences rest.
"""
from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

import plant


@dataclass
class Reference:
    """Rms values of the axis without the effect, and what the draw may use of the experiment."""
    base: dict
    dt: float
    duration: float
    torque: np.ndarray
    states: np.ndarray  # n x 4, one column each: th1 w1 th2 w2
    line_spacing: float  # Hz
    top: float  # highest excited frequency, Hz
    resonance: float  # natural frequency of the two-inertia mode, Hz
    linear: bool  # torque runs linearly between samples instead of being held

    def __post_init__(self):
        th1, w1, th2, w2 = self.states.T
        self.torque_rms = rms(self.torque)
        self.w1_rms, self.w2_rms = rms(w1), rms(w2)
        self.twist = th1 - th2
        self.twist_rms = rms(self.twist)
        self.turn_rms = float(np.std(th1))


@dataclass
class Draw:
    """One effect with its true parameters: plant parameters, what the sensors do, what the experiment must add."""
    id: str
    family: str
    place: str
    size: float
    variant: str
    plant: dict = field(default_factory=dict)
    sensor: dict = field(default_factory=dict)
    bias: float = 0.0  # constant torque the operator adds to the command, N.m


FAMILY = {
    "coulomb_motor": ("dry_friction", "motor"), "coulomb_table": ("dry_friction", "table"),
    "presliding_motor": ("dry_friction", "motor"), "presliding_table": ("dry_friction", "table"),
    "viscous_motor": ("viscous_friction", "motor"), "viscous_table": ("viscous_friction", "table"),
    "load_motor": ("load_torque", "motor"), "load_table": ("load_torque", "table"),
    "torque_ripple": ("torque_ripple", "motor"),
    "backlash": ("backlash", "coupling"),
    "cubic_stiffness": ("nonlinear_stiffness", "coupling"),
    "coupling_hysteresis": ("hysteresis", "coupling"),
    "stiffness_drift": ("drift", "coupling"), "friction_drift": ("drift", "motor"),
    "flexible_mode": ("flexible_mode", "table"),
    "disturbance": ("disturbance", "table"),
    "unbalance": ("load_torque", "table"),
    "quadratic_drag": ("viscous_friction", "table"),
    "end_stop": ("end_stop", "table"),
    "saturation": ("saturation", "input"),
    "actuator_lag": ("actuator_lag", "input"),
    "delay": ("delay", "input"),
    "torque_gain": ("parameters", "input"),
    "encoder_quantisation": ("sensor", "sensor"), "sensor_delay": ("sensor", "sensor"), "lead_error": ("sensor", "sensor"),
}
# The second edition's (conditions.py). Apart from FAMILY, whose order is part of the first edition's random streams.
SECOND = {
    "gravity": ("gravity", "table"), "external_spring": ("external_spring", "table"), "dead_zone": ("dead_zone", "input"),
    "position_friction": ("position_friction", "motor"), "motor_mode": ("flexible_mode", "motor"), "latch": ("latch", "sensor"),
}
KNOWN = FAMILY | SECOND
# Effects that show only when the axis turns far enough; their excitation is always tilted to low frequency.
TURNING = {"torque_ripple", "unbalance", "lead_error", "end_stop"}
# Effects a base-parameter fit absorbs by construction: no gap is left after it.
ABSORBED = {"torque_gain"}


def rms(x) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


def _sign(rng):
    return 1.0 if rng.random() < 0.5 else -1.0


def _share_root(shares, target, low, high):
    """The x in [low, high] at which the monotone function `shares` reaches target, by bisection in log x."""
    rising = shares(high) > shares(low)
    for _ in range(60):
        mid = math.sqrt(low * high)
        if (shares(mid) < target) == rising:
            low = mid
        else:
            high = mid
    return math.sqrt(low * high)


def _dry(ref, rng, size, place):
    key, w = ("fm", ref.w1_rms) if place == "motor" else ("ft", ref.w2_rms)
    p = {f"{key}_c": size * ref.torque_rms} | plant.stiff_bristle(ref.base, place, size * ref.torque_rms, ref.dt)
    variant = rng.choice(["plain", "stribeck", "asymmetric"], p=[0.5, 0.25, 0.25])
    if variant == "stribeck":
        p[f"{key}_s"] = p[f"{key}_c"] * rng.uniform(1.3, 2.0)
        p[f"{key}_ws"] = w * rng.uniform(0.05, 0.3)
    elif variant == "asymmetric":
        p[f"{key}_asym"] = _sign(rng) * rng.uniform(0.15, 0.5)
    return variant, p


def _presliding(ref, rng, size, place):
    key, inertia = ("fm", ref.base["I1"]) if place == "motor" else ("ft", ref.base["I2"])
    level = size * ref.torque_rms
    s0 = level / (rng.uniform(0.05, 0.4) * ref.turn_rms)
    s1 = 2.0 * rng.uniform(0.1, 0.7) * math.sqrt(s0 * inertia)
    return "lugre", {f"{key}_c": level, f"{key}_s0": s0, f"{key}_s1": s1}


def _viscous(ref, rng, size, key, w):
    p = {key: size * ref.torque_rms / w}
    if rng.random() < 1 / 3:
        p[f"{key}_asym"] = _sign(rng) * rng.uniform(0.2, 0.6)
        return "asymmetric", p
    return "plain", p


def _cubic(ref, rng, size):
    k3 = size * ref.twist_rms / rms(ref.twist**3)
    if rng.random() < 0.6:
        return "hardening", {"k3": k3}
    # A softening spring keeps 0.3 of its slope at the largest twist of the linear axis.
    return "softening", {"k3": -min(k3, 0.7 / (3.0 * np.max(np.abs(ref.twist)) ** 2))}


def _stiffness_drift(ref, rng, size):
    size *= _sign(rng)
    if rng.random() < 2 / 3:
        return "linear", {"kdrift": size / ref.duration}
    tau = rng.uniform(0.5, 1.0) * ref.duration
    return "saturating", {"kdrift": size / (tau * (1.0 - math.exp(-ref.duration / tau))), "kdrift_tau": tau}


def _friction_drift(ref, rng, size):
    end = math.sqrt(3.0) * size * ref.torque_rms  # the rms of a ramp is its end over sqrt(3)
    if rng.random() < 0.5:
        return "viscous", {"vm_rate": end / ref.w1_rms / ref.duration}
    return "coulomb", {"fm_rate": end / ref.duration} | plant.stiff_bristle(ref.base, "motor", 0.5 * end, ref.dt)


def _flexible(ref, rng, size):
    # size 0.05..0.5 stands for a third inertia of 0.1 to 1 of the table's
    i3 = 2.0 * size * ref.base["I2"]
    f3 = ref.resonance * math.exp(rng.uniform(math.log(0.4), math.log(1.4)))
    k3 = i3 * (2 * math.pi * f3) ** 2
    return "mode", {"I3": i3, "K3": k3, "B3": 2 * rng.uniform(0.02, 0.1) * math.sqrt(k3 * i3)}


def _disturbance(ref, rng, size):
    f = ref.line_spacing * (rng.integers(3, max(4, int(0.6 * ref.top / ref.line_spacing))) + rng.uniform(0.3, 0.7))
    return "sine", {"dist": math.sqrt(2) * size * ref.torque_rms, "dist_f": f, "dist_phase": rng.uniform(-math.pi, math.pi)}


def _end_stop(ref, rng, size):
    th2 = ref.states[:, 2]
    stiff = rng.uniform(3.0, 30.0) if ref.base["B"] > math.sqrt(ref.base["K"] * ref.base["I2"]) else rng.uniform(2.0, 6.0)
    k = stiff * ref.base["K"]
    p = {"stop_k": k, "stop_b": 2 * rng.uniform(0.05, 0.3) * math.sqrt(k * ref.base["I2"])}
    if rng.random() < 0.5:
        return "upper", p | {"stop_hi": float(np.quantile(th2, 1.0 - 0.5 * size))}
    return "lower", p | {"stop_lo": float(np.quantile(th2, 0.5 * size))}


def lagged(torque, dt, tau):
    """Exact response of a first-order lag to the held torque, at the sample instants."""
    a = math.exp(-dt / tau)
    out = np.empty_like(torque)
    y = torque[0]
    for k, v in enumerate(torque):
        out[k] = y
        y = v + (y - v) * a
    return out


def _fine(ref):
    """Torque on a grid of 16 points a sample, as it runs between samples."""
    k = np.arange(ref.torque.size * 16) // 16
    if not ref.linear:
        return ref.torque[k]
    return np.interp(np.arange(ref.torque.size * 16) / 16, np.arange(ref.torque.size), ref.torque)


def _saturation(ref, rng, size):
    top = float(np.max(np.abs(ref.torque)))
    share = lambda level: rms(ref.torque - np.clip(ref.torque, -level, level)) / ref.torque_rms
    return "symmetric", {"sat": _share_root(share, size, 0.01 * top, top)}


def _lag(ref, rng, size):
    fine = _fine(ref)
    share = lambda tau: rms(fine - lagged(fine, ref.dt / 16, tau)) / ref.torque_rms
    return "first_order", {"lag": _share_root(share, size, 1e-2 * ref.dt, 0.1 * ref.duration)}


def _delay(ref, rng, size):
    fine = _fine(ref)
    x = np.arange(fine.size)
    share = lambda d: rms(fine - np.interp(x - 16 * d, x, fine)) / ref.torque_rms
    return "fractional", {"delay": ref.dt * _share_root(share, size, 1e-2, 40.0)}


def draw(effect: str, ref: Reference, rng: np.random.Generator, size: float) -> Draw:
    """Parameters of `effect` at `size` for the axis and excitation of `ref`."""
    family, place = FAMILY[effect]
    p, sensor, variant, bias = {}, {}, "plain", 0.0
    level = size * ref.torque_rms
    if effect.startswith("coulomb_"):
        variant, p = _dry(ref, rng, size, place)
    elif effect.startswith("presliding_"):
        variant, p = _presliding(ref, rng, size, place)
    elif effect == "viscous_motor":
        variant, p = _viscous(ref, rng, size, "vm", ref.w1_rms)
    elif effect == "viscous_table":
        variant, p = _viscous(ref, rng, size, "vt", ref.w2_rms)
    elif effect.startswith("load_"):
        load = _sign(rng) * level
        p = {"load_m" if place == "motor" else "load_t": load}
        # Half of the operators hold the axis against the load, not quite exactly; the other half let it run.
        if rng.random() < 0.5:
            variant, bias = "held", -load * rng.uniform(0.9, 1.1)
        else:
            variant = "running"
    elif effect == "torque_ripple":
        reach = float(np.ptp(ref.states[:, 0]))
        low = max(1.0, 2 * math.pi / reach)
        order = math.exp(rng.uniform(math.log(low), math.log(max(24.0, 2 * low))))
        if rng.random() < 0.7:
            variant, order = "whole", float(round(order))
        else:
            variant = "any order"
        p = {"ripple": math.sqrt(2) * level, "ripple_order": order, "ripple_phase": rng.uniform(-math.pi, math.pi)}
    elif effect == "backlash":
        p = {"backlash": size * ref.twist_rms}
    elif effect == "cubic_stiffness":
        variant, p = _cubic(ref, rng, size)
    elif effect == "coupling_hysteresis":
        p = {"hyst": size * ref.base["K"] * ref.twist_rms, "hyst_x": rng.uniform(0.1, 0.5) * ref.twist_rms}
        if rng.random() < 0.5:
            variant, p["hyst_n"], p["hyst_even"] = "dahl", 1.0, 1.0
        else:
            variant, p["hyst_n"] = "bouc_wen", rng.uniform(1.0, 2.0)
    elif effect == "stiffness_drift":
        variant, p = _stiffness_drift(ref, rng, size)
    elif effect == "friction_drift":
        variant, p = _friction_drift(ref, rng, size)
    elif effect == "flexible_mode":
        variant, p = _flexible(ref, rng, size)
    elif effect == "disturbance":
        variant, p = _disturbance(ref, rng, size)
    elif effect == "unbalance":
        p = {"unb": math.sqrt(2) * level, "unb_phase": rng.uniform(-math.pi, math.pi)}
    elif effect == "quadratic_drag":
        p = {"drag": level / rms(ref.states[:, 3] ** 2)}
    elif effect == "end_stop":
        variant, p = _end_stop(ref, rng, size)
        # A light pull keeps the axis coming back to the stop.
        bias = (1.0 if variant == "upper" else -1.0) * rng.uniform(0.03, 0.1) * ref.torque_rms
    elif effect == "saturation":
        variant, p = _saturation(ref, rng, size)
    elif effect == "actuator_lag":
        variant, p = _lag(ref, rng, size)
    elif effect == "delay":
        variant, p = _delay(ref, rng, size)
    elif effect == "torque_gain":
        p = {"gain": 1.0 + _sign(rng) * size}
    elif effect == "encoder_quantisation":
        sensor = {"step1": size * ref.twist_rms, "step2": size * ref.twist_rms}
    elif effect == "sensor_delay":
        sensor = {"delay2": size * ref.twist_rms / ref.w2_rms}
    elif effect == "lead_error":
        if rng.random() < 0.65:
            variant = "periodic"
            sensor = {"lead": math.sqrt(2) * size * ref.twist_rms, "lead_order": float(rng.integers(1, 9)),
                      "lead_phase": rng.uniform(-math.pi, math.pi)}
        else:
            variant = "scale"
            sensor = {"scale2": 1.0 + _sign(rng) * size * ref.twist_rms / rms(ref.states[:, 2])}
    else:
        raise ValueError(f"no such effect: {effect}")
    return Draw(effect, family, place, size, str(variant), p, sensor, bias)


def measure(states: np.ndarray, dt: float, sensor: dict, noise=None) -> dict:
    """What the encoders read (th1, th2 [rad], w1, w2 [rad/s]); `noise` is n x 4 and comes before the quantisation."""
    th1, w1, th2, w2 = (c.copy() for c in states.T)
    if "delay2" in sensor:
        th2 = plant.delayed(states[:, 2], states[:, 3], dt, sensor["delay2"])
    if "lead" in sensor:
        th2 = th2 + sensor["lead"] * np.sin(sensor["lead_order"] * th2 + sensor["lead_phase"])
    th2 = th2 * sensor.get("scale2", 1.0)
    if noise is not None:
        th1, w1, th2, w2 = th1 + noise[:, 0], w1 + noise[:, 1], th2 + noise[:, 2], w2 + noise[:, 3]
    if "step1" in sensor:
        th1 = np.round(th1 / sensor["step1"]) * sensor["step1"]
    if "step2" in sensor:
        th2 = np.round(th2 / sensor["step2"]) * sensor["step2"]
    return {"theta1": th1, "omega1": w1, "theta2": th2, "omega2": w2}
