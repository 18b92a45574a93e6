"""The second edition's effects: which an axis can have, how a size becomes parameters, and which other names are the same law.

The old effects keep their formulas (effects.py); times late are drawn in samples, since a drive's delay is some of them.
"""
from __future__ import annotations

import math

import numpy as np

import effects
import plant
from axes import Machine, log_uniform
from effects import Draw, rms
from motion import SUBSTEPS, SUBSTEPS_STIFF

RIGID = ("coulomb_motor", "presliding_motor", "viscous_motor", "load_motor", "torque_ripple", "friction_drift", "flexible_mode",
         "disturbance", "quadratic_drag", "end_stop", "saturation", "actuator_lag", "delay", "gravity", "external_spring", "dead_zone",
         "position_friction", "latch")
TWO = ("coulomb_motor", "coulomb_table", "presliding_motor", "presliding_table", "viscous_motor", "viscous_table", "load_motor",
       "load_table", "torque_ripple", "backlash", "cubic_stiffness", "coupling_hysteresis", "stiffness_drift", "friction_drift",
       "flexible_mode", "disturbance", "unbalance", "quadratic_drag", "end_stop", "saturation", "actuator_lag", "delay", "sensor_delay",
       "lead_error", "gravity", "external_spring", "dead_zone", "position_friction", "motor_mode", "latch", "coulomb_load")
# Which parts of `plant.PARTS` are an effect's torque.
PARTS = {
    "coulomb_motor": "fm", "presliding_motor": "fm", "friction_drift": "fm vm", "coulomb_table": "ft", "presliding_table": "ft",
    "viscous_motor": "vm", "viscous_table": "vt", "load_motor": "load_m", "load_table": "load_t", "torque_ripple": "ripple",
    "backlash": "coupling", "cubic_stiffness": "coupling", "coupling_hysteresis": "coupling", "stiffness_drift": "coupling",
    "flexible_mode": "mode3", "disturbance": "dist", "unbalance": "unb", "quadratic_drag": "drag", "end_stop": "stop",
    "saturation": "input", "actuator_lag": "input", "delay": "input", "dead_zone": "input", "gravity": "gravity",
    "external_spring": "spring", "position_friction": "fp", "motor_mode": "mode0",
}
ON_TABLE = {"ft", "vt", "load_t", "mode3", "dist", "unb", "drag", "stop", "gravity", "spring", "extra_t"}
# Effects that move the same plant parameters or the same parts: one of each group a case.
GROUPS = ({"coulomb_motor", "presliding_motor", "friction_drift", "coulomb_load"}, {"coulomb_table", "presliding_table"},
          {"viscous_motor", "friction_drift"}, {"backlash", "cubic_stiffness", "coupling_hysteresis", "stiffness_drift"},
          {"saturation", "dead_zone"}, {"delay", "latch", "sensor_delay"}, {"actuator_lag", "latch"}, {"gravity", "unbalance"},
          {"load_motor", "load_table"})
# Of presliding over the travel: drawn to be seen, and as guides have it.
REACH, REACH_OF_MACHINES = (0.005, 0.1), (5e-4, 0.01)
# The same law, or the same equation on a time-invariant axis: no record can tell them apart, so either name is right.
LATE = {"latch", "delay", "sensor"}
TWINS = {"delay": {"latch"}, "actuator_lag": {"latch"}, "gravity": {"unbalance"}, "unbalance": {"gravity"}}


def accepted(draw: Draw, rigid: bool) -> set:
    """Families and ids that name this effect."""
    out = {draw.family, draw.id} | TWINS.get(draw.id, set())
    if draw.id == "latch":
        out |= LATE | {"actuator_lag"} if draw.variant == "filtered" else LATE
    if rigid and draw.id in ("gravity", "unbalance"):
        out |= {"torque_ripple"}  # one position: a sine of it is a sine of it
    if rigid and draw.id == "torque_ripple" and abs(draw.plant["ripple_order"] - 1.0) < 0.3:
        out |= {"gravity", "unbalance"}
    return out


def possible(machine: Machine, sensors: str) -> list:
    """Effects that this axis can have and this log can show."""
    ids = list(RIGID if machine.rigid else TWO)
    if sensors == "motor":
        ids = [e for e in ids if e not in ("sensor_delay", "lead_error")]
    if machine.linear:
        ids = [e for e in ids if e != "gravity"]
    if machine.kind == "ballscrew":
        ids = [e for e in ids if e != "gravity"]  # of a screw that turns many times a hinge's sine is an unbalance
    return ids


def clash(ids) -> bool:
    return any(len(g.intersection(ids)) > 1 for g in GROUPS)


def _times(rng, machine, low, high):
    """A time of some samples; on an axis sampled coarsely at most a quarter of the resonance's period."""
    return machine.dt * rng.uniform(low, min(high, max(low * 1.5, 0.25 / (machine.band * machine.dt))))


def _presliding(machine: Machine, ref, rng, level: float, place: str, reach: tuple) -> dict:
    """A soft bristle that breaks away within `reach` of the travel (range, log-uniform), damped below critical."""
    key, inertia, th = ("fm", ref.base["I1"], ref.states[:, 0]) if place == "motor" else ("ft", ref.base["I2"], ref.states[:, 2])
    s0 = level / (log_uniform(rng, *reach) * float(np.ptp(th)))
    s0 = min(s0, inertia * (0.5 * SUBSTEPS / machine.dt) ** 2)  # what the sub-step resolves
    return {f"{key}_c": level, f"{key}_s0": s0, f"{key}_s1": 2.0 * rng.uniform(0.1, 0.7) * math.sqrt(s0 * inertia)}


def draw(effect: str, machine: Machine, ref: effects.Reference, rng, size: float, closed: bool, reach: tuple = REACH) -> Draw:
    """Parameters of `effect` at `size` of the level of `ref`; reach: of presliding, over the travel."""
    level = size * ref.torque_rms
    th1, th2 = ref.states[:, 0], ref.states[:, 2]
    sign = 1.0 if rng.random() < 0.5 else -1.0
    made = None
    if effect == "gravity":
        family, variant = effects.SECOND[effect][0], "hinge"
        upright = rng.uniform(-math.pi, math.pi)
        a = level / max(rms(np.sin(th2 - upright)), 0.1)
        made = {"grav_s": a * math.cos(upright), "grav_c": -a * math.sin(upright), "grav_r": 1.0}
        bias = float(np.mean(a * np.sin(th2 - upright)))
    elif effect == "external_spring":
        rest = float(np.mean(th2) + rng.uniform(-0.3, 0.3) * np.ptp(th2))
        made, variant = {"spring": level / rms(th2 - rest), "spring_rest": rest}, "linear"
        bias = 0.0
    elif effect == "dead_zone":
        top, bias, variant = float(np.max(np.abs(ref.torque))), 0.0, "symmetric"
        share = lambda w: rms(np.clip(ref.torque, -w, w)) / ref.torque_rms
        made = {"dead": effects._share_root(share, min(size, 0.3), 1e-4 * top, top)}
    elif effect == "position_friction":
        width = rng.uniform(0.06, 0.25) * np.ptp(th1)
        centre = float(np.quantile(th1, rng.uniform(0.25, 0.75)))
        peak, bias, variant = 2 * level, 0.0, "tight spot"
        b = plant.stiff_bristle(machine.base, "motor", peak, machine.dt, SUBSTEPS_STIFF)
        made = {"fp_c": peak, "fp_centre": centre, "fp_width": width} | {k.replace("fm_", "fp_"): v for k, v in b.items()}
    elif effect == "motor_mode":
        i0 = 2 * size * ref.base["I1"]
        k0 = i0 * (2 * math.pi * ref.resonance * log_uniform(rng, 0.4, 1.4)) ** 2
        made, bias, variant = {"I0": i0, "K0": k0, "B0": 2 * rng.uniform(0.02, 0.1) * math.sqrt(k0 * i0)}, 0.0, "mode"
    elif effect == "latch":
        if rng.random() < 0.35:
            return Draw("latch", "latch", "sensor", size, "filtered", {}, {"filter": _times(rng, machine, 1.0, 5.0)})
        late = sign * _times(rng, machine, 0.5, 3.0)
        return Draw("latch", "latch", "sensor", size, "late" if late > 0 else "early", {}, {"latch": late})
    elif effect == "coulomb_load":
        place = "motor" if rng.random() < 0.5 else "table"
        key = "fm" if place == "motor" else "ft"
        carried = rms(ref.base["K"] * ref.twist)
        load = level / carried
        b = plant.stiff_bristle(machine.base, place, 1.5 * level, machine.dt, SUBSTEPS_STIFF)
        return Draw(f"coulomb_{place}", "dry_friction", place, size, "load", {f"{key}_c": 0.3 * level, f"{key}_load": load} | b)
    if made is not None:
        family, place = effects.SECOND[effect]
        return Draw(effect, family, place, size, variant, made, {}, bias)
    family, place = effects.FAMILY[effect]
    if effect.startswith("presliding_"):
        return Draw(effect, family, place, size, "lugre", _presliding(machine, ref, rng, level, place, reach))
    if effect == "delay":
        return Draw(effect, family, place, size, "fractional", {"delay": _times(rng, machine, 0.5, 4.0)})
    if effect == "actuator_lag":
        return Draw(effect, family, place, size, "first_order", {"lag": _times(rng, machine, 0.7, 6.0)})
    if effect == "sensor_delay":
        return Draw(effect, family, place, size, "late", {}, {"delay2": _times(rng, machine, 0.5, 4.0)})
    if effect == "torque_ripple" and machine.linear:
        pitch = log_uniform(rng, 2.5e-3, max(5e-3, min(0.04, 0.5 * np.ptp(th1))))
        return Draw(effect, family, place, size, "pitch", {"ripple": math.sqrt(2) * level, "ripple_order": 2 * math.pi / pitch,
                                                           "ripple_phase": rng.uniform(-math.pi, math.pi)})
    if effect == "saturation" and closed:
        size = min(size, 0.2)
    d = effects.draw(effect, ref, rng, size)
    for key, body in (("fm", "motor"), ("ft", "table")):
        if f"{key}_wd" in d.plant:  # the same law at this edition's sub-step
            g = d.plant.get(f"{key}_c", 0.0) or 0.5 * d.plant.get(f"{key}_rate", 0.0) * ref.duration
            d.plant |= plant.stiff_bristle(ref.base, body, g, machine.dt, SUBSTEPS_STIFF)
    if closed and effect == "end_stop":
        d.bias = 0.0
    if closed and effect.startswith("load_"):
        d.variant, d.bias = "held", -(d.plant.get("load_m", 0.0) + d.plant.get("load_t", 0.0))  # the drive held it before the record
    return d
