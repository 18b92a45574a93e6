"""Writes tests/plant/oracle.txt: what the independent plant gives for every effect, for the crate's own test to meet.

    .venv/bin/python scripts/blind/oracle.py            # from the project root

Two axes, from a closed formula of the torque that the test repeats:
T(t) = A*(sin(a*t) + 0.7*sin(b*t) + 0.5*sin(c*t)), zero at the start, so that no history before the record matters.
"""
from __future__ import annotations

import math
import pathlib

import numpy as np

import effects
import plant

SAMPLES = 1024
EVERY = 32
FINEST = 16 * plant.SUBSTEPS_STIFF  # a bristle's breakaway costs an order: of friction under load and at a spot 1e-3 is left at an eighth of this
# name, base, dt, hold, torque amplitude [N.m], angular frequencies [rad/s]
AXES = (
    ("seed", dict(I1=2.37e-4, I2=6.07e-6, B=5.4e-4, K=1.76e-2), 5.626e-4, "zoh", 0.03, (11.0, 37.0, 90.0)),
    ("ballscrew", dict(I1=1.5e-3, I2=9e-4, B=0.03, K=250.0), 4e-4, "linear", 0.8, (40.0, 160.0, 480.0)),
)


def crate(draw: effects.Draw) -> dict:
    """The crate's parameters of an effect, by the equations of its documentation."""
    p, s, effect = draw.plant, draw.sensor, draw.id
    place = effect.rsplit("_", 1)[-1]
    key = "fm" if place == "motor" else "ft"
    if effect.startswith("coulomb_"):
        out = {"level": p[f"{key}_c"], "asymmetry": p.get(f"{key}_asym", 0.0)}
        if f"{key}_s" in p:
            out |= {"peak": p[f"{key}_s"] / p[f"{key}_c"] - 1.0, "speed": p[f"{key}_ws"]}
        return out
    if effect.startswith("presliding_"):
        return {"level": p[f"{key}_c"], "reach": p[f"{key}_c"] / p[f"{key}_s0"], "damping": p[f"{key}_s1"]}
    if effect.startswith("viscous_"):
        return {"coefficient": p[f"v{place[0]}"], "asymmetry": p.get(f"v{place[0]}_asym", 0.0)}
    if effect.startswith("load_"):
        return {"torque": -p[f"load_{place[0]}"]}  # the crate's resists
    if effect == "lead_error":
        return {"scale": s["scale2"] - 1.0} if "scale2" in s else {"amplitude": s["lead"], "order": s["lead_order"], "phase": s["lead_phase"]}
    if effect == "end_stop":
        return {"stiffness": p["stop_k"]} | ({"upper": p["stop_hi"]} if "stop_hi" in p else {"lower": p["stop_lo"]})
    names = {
        "torque_ripple": {"amplitude": "ripple", "order": "ripple_order", "phase": "ripple_phase"},
        "backlash": {"half_gap": "backlash"}, "cubic_stiffness": {"k3": "k3"},
        "coupling_hysteresis": {"level": "hyst", "reach": "hyst_x"}, "stiffness_drift": {"rate": "kdrift"},
        "friction_drift": {"level_rate": "fm_rate", "viscous_rate": "vm_rate"},
        "flexible_mode": {"inertia": "I3", "stiffness": "K3", "damping": "B3"},
        "disturbance": {"amplitude": "dist", "frequency": "dist_f", "phase": "dist_phase"},
        "unbalance": {"amplitude": "unb", "phase": "unb_phase"}, "quadratic_drag": {"coefficient": "drag"},
        "saturation": {"limit": "sat"}, "actuator_lag": {"time_constant": "lag"}, "delay": {"time": "delay"},
        "torque_gain": {"gain": "gain"}, "encoder_quantisation": {"step": "step2"}, "sensor_delay": {"time": "delay2"},
    }[effect]
    both = p | s
    return {ours: both[theirs] for ours, theirs in names.items() if theirs in both}


def simplify(draw: effects.Draw) -> None:
    """Leave out what the crate's formula does not have: the stop's damping, the saturating drift; the loop at sharpness 1."""
    draw.plant.pop("stop_b", None)
    draw.plant.pop("kdrift_tau", None)
    if draw.id == "coupling_hysteresis":
        draw.plant |= {"hyst_n": 1.0, "hyst_even": 0.0}


def further(base: dict, ref: effects.Reference, dt: float, rng, size: float):
    """(id, the plant's parameters, the crate's) of the second edition's effects; its `latch` is a log's and has no place in the plant."""
    level, travel = size * ref.torque_rms, float(np.ptp(ref.states[:, 0]))
    sine, cosine, ratio = level * rng.uniform(0.5, 1.5), level * rng.uniform(-1.0, 1.0), rng.uniform(0.5, 2.0)
    yield "gravity", {"grav_s": sine, "grav_c": cosine, "grav_r": ratio}, {"sine": sine, "cosine": cosine, "ratio": ratio}
    stiffness, rest = level / effects.rms(ref.states[:, 2]), rng.uniform(-0.3, 0.3) * travel
    yield "external_spring", {"spring": stiffness, "spring_rest": rest}, {"stiffness": stiffness, "rest": rest}
    yield "dead_zone", {"dead": level}, {"width": level}
    centre, width = float(np.median(ref.states[:, 0])), rng.uniform(0.1, 0.25) * travel
    spot = {k.replace("fm_", "fp_"): v for k, v in plant.stiff_bristle(base, "motor", level, dt, FINEST // 2).items()}
    yield "position_friction", {"fp_c": level, "fp_centre": centre, "fp_width": width} | spot, {"level": level, "centre": centre, "width": width}
    inertia = 2 * size * base["I1"]
    k = inertia * (2 * math.pi * ref.resonance * rng.uniform(0.5, 1.2)) ** 2
    b = 2 * rng.uniform(0.02, 0.1) * math.sqrt(k * inertia)
    yield "motor_mode", {"I0": inertia, "K0": k, "B0": b}, {"inertia": inertia, "stiffness": k, "damping": b}
    for place, key in (("motor", "fm"), ("table", "ft")):
        load = level / effects.rms(base["K"] * ref.twist)
        law = {f"{key}_c": 0.3 * level, f"{key}_load": load} | plant.stiff_bristle(base, place, 1.5 * level, dt, FINEST // 2)
        yield f"coulomb_{place}", law, {"level": 0.3 * level, "load": load}


def main() -> None:
    root = pathlib.Path(__file__).resolve().parents[2]
    out = []
    for name, base, dt, hold, amplitude, (a, b, c) in AXES:
        t = np.arange(SAMPLES) * dt
        torque = amplitude * (np.sin(a * t) + 0.7 * np.sin(b * t) + 0.5 * np.sin(c * t))
        # So that the speed swings about zero: minus the mean of its integral.
        w0 = -amplitude / (base["I1"] + base["I2"]) * (1 / a + 0.7 / b + 0.5 / c)
        x0 = (0.0, w0, 0.0, w0)
        plain = plant.simulate(base, torque, dt, x0=x0, hold=hold)
        ref = effects.Reference(base, dt, SAMPLES * dt, torque, plain, 1.0, c / math.pi,
                                math.sqrt(base["K"] * (1 / base["I1"] + 1 / base["I2"])) / (2 * math.pi), hold == "linear")
        cases = []
        for i, effect in enumerate(effects.FAMILY):
            for variant in range(2):
                draw = effects.draw(effect, ref, np.random.default_rng([17, i, variant]), (0.25, 0.1)[variant])
                simplify(draw)
                fine = 2 * plant.SUBSTEPS_STIFF if "fm_wd" in draw.plant or "ft_wd" in draw.plant else 2 * plant.SUBSTEPS
                cases.append((effect, draw.plant, draw.sensor, crate(draw), fine))
        for variant in range(2):
            rng = np.random.default_rng([18, variant])
            for effect, mine, theirs in further(base, ref, dt, rng, (0.25, 0.1)[variant]):
                cases.append((effect, mine, {}, theirs, FINEST if {"fm_wd", "ft_wd", "fp_wd"} & mine.keys() else 2 * plant.SUBSTEPS))
        for effect, mine, sensor, theirs, fine in cases:
            states = plant.simulate(base | mine, torque, dt, x0=x0, hold=hold, substeps=fine)
            seen = effects.measure(states, dt, sensor)
            head = [effect, name, hold, *(f"{v:.17g}" for v in (dt, base["I1"], base["I2"], base["B"], base["K"], amplitude, a, b, c, w0))]
            out.append(" ".join(head + [f"{k}={float(v):.17g}" for k, v in theirs.items()]))
            for k in range(0, SAMPLES, EVERY):
                out.append(" ".join(f"{v:.10g}" for v in (seen["theta1"][k], seen["theta2"][k], plain[k, 0], plain[k, 2])))
    path = root / "tests" / "plant" / "oracle.txt"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"# Written by scripts/blind/oracle.py; {SAMPLES} samples, every {EVERY}th. Per effect: id axis hold dt I1 I2 B K A a b c w0 parameters;\n"
                    "# then rows theta1 theta2 with the effect, theta1 theta2 without, rad.\n" + "\n".join(out) + "\n")
    print(f"{path}: {len(out)} lines")


if __name__ == "__main__":
    main()
