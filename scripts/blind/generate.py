"""Draws withheld-effect cases: a folder a case (train.csv, holdout.csv, axis.toml) and the answer sealed apart from it.

    .venv/bin/python scripts/blind/generate.py --out DIR [--classes all] [--per-class 20] [--seed 1]

DIR/cases/<name>/ is what a diagnosis may read; DIR/seals/<name>.json is what only run.py opens, after all diagnoses are done.
"""
from __future__ import annotations

import argparse
import hashlib
import json
import math
import pathlib
import shutil
import sys
import time
from dataclasses import dataclass

import numpy as np

import effects
import plant
import visible

SEVERAL = {"pairs": 2, "triples": 3}  # effects at once
CLASSES = (*effects.FAMILY, "none", "parameters", *SEVERAL)
ALL = [c for c in CLASSES if c != "triples"]  # the check as it is defined; three at once are drawn when asked for
PREROLL = 64  # samples of the periodic excitation before the record begins
MIN_GAP = 2.0  # least rms of the effect after a linear re-fit of the base model, in multiples of the encoder noise
# A quantum of some 30 times the noise and more: below that the true model with the true quantum predicts no better than without.
MIN_GAP_QUANTISATION = 10.0
LEAST_SHARE = 0.1  # of several effects, the rms that the smallest leaves after the re-fit over that of the largest, at least
TRIES = 40
# Two effects that would move the same plant parameter, or that need opposite experiments, are not drawn together.
FRICTION_MOTOR = {"coulomb_motor", "presliding_motor", "friction_drift"}
ALONE = {"torque_gain", "encoder_quantisation", "end_stop"}


@dataclass
class Axis:
    kind: str
    base: dict
    rho: float
    dt: float
    samples: int  # per period
    torque_rms: float
    resonance: float  # Hz


@dataclass
class Excitation:
    kind: str
    lines: np.ndarray
    amplitudes: np.ndarray  # N.m
    phases: np.ndarray
    period: float

    def torque(self, t):
        w = 2 * np.pi * self.lines / self.period
        return np.cos(np.outer(t, w) + self.phases) @ self.amplitudes


def draw_axis(kind: str, rng) -> Axis:
    """The seed paper's axis (PAPER table 3), or a stiff ball-screw axis: 50 to 150 Hz, damping ratio 0.02 to 0.1."""
    if kind == "seed":
        base = dict(I1=2.37e-4, I2=6.07e-6, B=5.4e-4, K=1.76e-2)
        coarse = int(rng.choice([1, 2]))
        wn = math.sqrt(base["K"] * (1 / base["I1"] + 1 / base["I2"]))
        return Axis(kind, base, 3.18e-4, coarse * 2 * math.pi * 10 / (2048 * wn), 2048 // coarse,
                    rng.uniform(0.02, 0.05), wn / (2 * math.pi))
    i1 = math.exp(rng.uniform(math.log(5e-4), math.log(3e-3)))
    i2 = i1 * math.exp(rng.uniform(math.log(0.2), math.log(2.0)))
    f, zeta = rng.uniform(50, 150), math.exp(rng.uniform(math.log(0.02), math.log(0.1)))
    reduced, wn = 1 / (1 / i1 + 1 / i2), 2 * math.pi * f
    base = dict(I1=i1, I2=i2, B=2 * zeta * wn * reduced, K=wn**2 * reduced)
    pitch = rng.choice([0.005, 0.01, 0.02])
    dt = round(1 / (rng.uniform(20, 30) * f), 6)
    return Axis(kind, base, pitch / (2 * math.pi), dt, 2048, (i1 + i2) * rng.uniform(200, 600), f)


def draw_excitation(axis: Axis, rng, kind: str, top: float, tilt: float, rms: float) -> Excitation:
    """A multisine of given rms up to `top` Hz; amplitudes fall as frequency^-tilt; kind schroeder, random or odd."""
    period = axis.samples * axis.dt
    lines = np.arange(1, max(8, int(top * period)) + 1)
    if kind == "odd":
        lines = lines[::2]
    a = lines.astype(float) ** -tilt
    a *= rms / math.sqrt(np.sum(a**2) / 2)
    if kind == "schroeder":
        power = a**2 / np.sum(a**2)
        phases = -2 * np.pi * np.concatenate([[0.0], np.cumsum(np.cumsum(power))[:-1]])
        phases = phases + rng.uniform(0, 2 * np.pi)
    else:
        phases = rng.uniform(0, 2 * np.pi, lines.size)
    return Excitation(kind, lines, a, phases, period)


@dataclass
class Experiment:
    """One record: command at the samples (with what was commanded before), start state, and how it is held."""
    torque: np.ndarray
    before: np.ndarray
    x0: np.ndarray
    dt: float
    hold: str

    def run(self, params: dict, bias: float = 0.0) -> np.ndarray:
        command = np.concatenate([self.before, self.torque]) + bias
        n = self.before.size
        return plant.simulate(params, command, self.dt, x0=self.x0, t0=-n * self.dt, hold=self.hold)[n:]


def experiment(axis: Axis, ex: Excitation, rng, periods: float, start: str, hold: str) -> Experiment:
    n = int(round(axis.samples * periods))
    t = np.arange(n) * axis.dt
    before = -np.arange(PREROLL, 0, -1) * axis.dt
    offset = np.array([1.0, 0.0, 1.0, 0.0]) * rng.uniform(-np.pi, np.pi)
    if start == "rest":
        return Experiment(ex.torque(t), np.zeros(PREROLL), offset, axis.dt, hold)
    x0 = offset + plant.periodic_state(axis.base, ex.lines, ex.amplitudes, ex.phases, ex.period, before[0])
    return Experiment(ex.torque(t), ex.torque(before), x0, axis.dt, hold)


def outputs_of(sensors: str):
    return [0] if sensors == "motor" else [0, 2]


def combine(draws):
    params, sensor, bias = {}, {}, 0.0
    for d in draws:
        params |= d.plant
        sensor |= d.sensor
        bias += d.bias
    return params, sensor, bias


def clean(exp: Experiment, base: dict, draws) -> np.ndarray:
    """What noise-free encoders would read (n x 4) with the given effects."""
    params, sensor, bias = combine(draws)
    states = exp.run(base | params, bias)
    m = effects.measure(states, exp.dt, sensor)
    return np.stack([m[c] for c in ("theta1", "omega1", "theta2", "omega2")], axis=1)


def residual_rms(base, exp, draws, others, sensors) -> float:
    """Rms [rad] of what `draws` add to the trace of `others` alone, after the windowed linear re-fit of the base model."""
    _, _, bias = combine(draws + others)
    with_all = clean(exp, base, draws + others)
    params, sensor, _ = combine(others)
    without = np.stack(list(effects.measure(exp.run(base | params, bias), exp.dt, sensor).values()), axis=1)
    error = with_all - without
    if not np.all(np.isfinite(error)):
        return math.nan
    return effects.rms(visible.refit_residual(base, exp.dt, with_all, error, outputs_of(sensors)))


def pick_several(rng, count: int):
    ids = [e for e in effects.FAMILY if e not in ALONE]
    while True:
        picked = [str(x) for x in rng.choice(ids, count, replace=False)]
        if len({effects.FAMILY[e][0] for e in picked}) == count and len(FRICTION_MOTOR.intersection(picked)) < 2:
            return picked


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def draw_case(cls: str, kind: str, seed) -> dict | None:
    """One attempt at a case; None when the drawn effect would not be visible with any noise of the allowed range."""
    rng = np.random.default_rng(seed)
    axis = draw_axis(kind, rng)
    ids = pick_several(rng, SEVERAL[cls]) if cls in SEVERAL else [] if cls in ("none", "parameters") else [cls]
    turning = any(e in effects.TURNING for e in ids)
    tilt = rng.uniform(0.5, 1.0) if turning or rng.random() < 0.5 else 0.0
    top = axis.resonance * (rng.uniform(3, 10) if kind == "seed" else rng.uniform(1.3, 2.0))
    ex_kind = str(rng.choice(["schroeder", "random", "odd"]))
    hold = "linear" if rng.random() < 0.2 else "zoh"
    start = "rest" if rng.random() < 0.3 else "running"
    with_sensor = any(effects.FAMILY[e][1] == "sensor" for e in ids)
    sensors = "both" if with_sensor else str(rng.choice(["both", "velocities", "motor"], p=[0.75, 0.15, 0.10]))
    ex = draw_excitation(axis, rng, ex_kind, top, tilt, axis.torque_rms)
    periods = 4 if axis.samples == 2048 else 6
    train = experiment(axis, ex, rng, periods, start, hold)
    louder = 1.0 if any(e in ("saturation", "end_stop") for e in ids) else 0.8
    ex_hold = draw_excitation(axis, rng, "random" if ex_kind == "schroeder" else ex_kind, top, tilt,
                              axis.torque_rms * rng.uniform(louder, 1.25))
    holdout = experiment(axis, ex_hold, rng, periods * rng.choice([0.5, 0.75, 1.0]), start, hold)

    ref = effects.Reference(axis.base, axis.dt, train.torque.size * axis.dt, train.torque, train.run(axis.base),
                            1 / ex.period, top, axis.resonance, hold == "linear")
    draws = [effects.draw(e, ref, rng, log_uniform(rng, 0.05, 0.5)) for e in ids]
    noise = log_uniform(rng, 1e-5, 1e-3)

    nominal = dict(axis.base)
    if cls == "parameters":
        off = {p: rng.uniform(0.05, 0.3) * rng.choice([-1, 1]) * (rng.random() < 0.6) for p in nominal}
        if not any(off.values()):
            off["I1"] = 0.15
        nominal = {p: v * (1 + off[p]) for p, v in nominal.items()}
    elif cls != "none" and rng.random() < 0.4:
        nominal = {p: v * (1 + rng.uniform(-0.03, 0.03)) for p, v in nominal.items()}

    gaps = {}
    for d in draws:
        others = [x for x in draws if x is not d]
        for name, exp in (("train", train), ("holdout", holdout)):
            gap = residual_rms(axis.base, exp, [d], others, sensors)
            if not math.isfinite(gap):
                return None
            gaps.setdefault(d.id, {})[name] = gap
    need = [min(g.values()) / (MIN_GAP_QUANTISATION if e == "encoder_quantisation" else MIN_GAP)
            for e, g in gaps.items() if e not in effects.ABSORBED]
    for part in ("train", "holdout") if cls in SEVERAL else ():
        each = [g[part] for g in gaps.values()]
        if min(each) < LEAST_SHARE * max(each):
            return None
    if need:
        largest = min(need)
        if largest < 1e-5:
            return None
        if noise > largest:
            noise = log_uniform(rng, max(1e-5, largest / 3), largest)
    return dict(cls=cls, axis=axis, ex=ex, ex_hold=ex_hold, train=train, holdout=holdout, draws=draws, noise=noise,
                nominal=nominal, sensors=sensors, hold=hold, start=start, tilt=tilt, top=top, gaps=gaps, rng=rng, ref=ref)


def columns(sensors: str):
    return {"motor": ["theta1"], "both": ["theta1", "theta2"],
            "velocities": ["theta1", "omega1", "theta2", "omega2"]}[sensors]


def record(case, exp: Experiment, rng, light_step):
    """Measured trace (dict of columns) and the figures that belong to it."""
    base = case["axis"].base
    params, sensor, bias = combine(case["draws"])
    states = exp.run(base | params, bias)
    true = effects.measure(states, exp.dt, sensor)
    speed_noise = 3e-3 * effects.rms(states[:, 1])
    noise = rng.standard_normal(states.shape) * np.array([case["noise"], speed_noise, case["noise"], speed_noise])
    got = effects.measure(states, exp.dt, sensor, noise)
    if light_step:
        for c in ("theta1", "theta2"):
            got[c] = np.round(got[c] / light_step) * light_step
    start = exp.run(base | params, bias)[0]
    nominal = plant.simulate(case["nominal"], exp.torque + bias, exp.dt, x0=start, hold=exp.hold)
    model = effects.measure(nominal, exp.dt, {})
    figures = {}
    for c in columns(case["sensors"]):
        figures[c] = {"signal": float(np.std(got[c])), "before": effects.rms(got[c] - model[c]),
                      "oracle": effects.rms(got[c] - true[c]), "noise": speed_noise if c[0] == "o" else case["noise"]}
    table = {"time": np.arange(exp.torque.size) * exp.dt, "T": exp.torque + bias} | {c: got[c] for c in columns(case["sensors"])}
    return table, figures


UNITS = {"time": "s", "T": "N.m", "theta1": "rad", "theta2": "rad", "omega1": "rad/s", "omega2": "rad/s"}


def write_csv(path: pathlib.Path, table: dict):
    header = ",".join(f"{c} [{UNITS[c]}]" for c in table)
    np.savetxt(path, np.stack(list(table.values()), axis=1), delimiter=",", fmt="%.12g", header=header, comments="")


def write_axis(path: pathlib.Path, case):
    lines = ['name = "axis under test"', "", "[parameters]"]
    lines += [f"{k} = {v!r}" for k, v in {**{k: float(v) for k, v in case["nominal"].items()}, "rho": float(case["axis"].rho)}.items()]
    lines += ["", "[signals]", 'time = "time"', f'T = {{ column = "T", hold = "{case["hold"]}" }}']
    lines += [f'{c} = "{c}"' for c in columns(case["sensors"])]
    path.write_text("\n".join(lines) + "\n")


def plain(value):
    """JSON-ready copy without numpy types or infinities."""
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, (np.floating, np.integer, np.bool_)):
        return value.item()
    return value


def write_case(out: pathlib.Path, case, name: str, half: str, seed) -> None:
    rng = case["rng"]
    quantised = any("step2" in d.sensor for d in case["draws"])
    # A nuisance of the effect cases only: on a trace without any other cause even a step below the noise would be a true answer.
    light = case["noise"] * rng.uniform(0.3, 1.0) if case["draws"] and not quantised and rng.random() < 0.1 else 0.0
    folder = out / "cases" / name
    folder.mkdir(parents=True, exist_ok=True)
    figures = {}
    for part in ("train", "holdout"):
        table, figures[part] = record(case, case[part], rng, light)
        write_csv(folder / f"{part}.csv", table)
    write_axis(folder / "axis.toml", case)
    ref, axis = case["ref"], case["axis"]
    draws = case["draws"]
    if draws:
        kind = "effect"
        truth = [{"id": d.id, "family": d.family, "place": d.place, "size": d.size, "variant": d.variant,
                  "plant": d.plant, "sensor": d.sensor,
                  "gap_refit_over_noise": {k: v / case["noise"] for k, v in case["gaps"][d.id].items()}} for d in draws]
    else:
        kind, truth = ("parameters" if case["cls"] == "parameters" else "no_gap"), []
    seal = {
        "case": name, "class": case["cls"], "half": half, "seed": seed, "verdict": kind, "effects": truth,
        "axis": axis.kind, "base": axis.base, "nominal": case["nominal"], "sensors": case["sensors"], "hold": case["hold"],
        "start": case["start"], "noise_rad": case["noise"], "light_step_rad": light, "dt_s": axis.dt,
        "samples": {"train": case["train"].torque.size, "holdout": case["holdout"].torque.size},
        "excitation": {"kind": case["ex"].kind, "lines": case["ex"].lines.size, "top_hz": case["top"], "tilt": case["tilt"],
                       "rms_N_m": ref.torque_rms, "range_theta1_rad": float(np.ptp(ref.states[:, 0]))},
        "twist_rms_rad": ref.twist_rms, "w1_rms": ref.w1_rms, "figures": figures,
    }
    (out / "seals").mkdir(parents=True, exist_ok=True)
    (out / "seals" / f"{name}.json").write_text(json.dumps(plain(seal), indent=1) + "\n")


def make(out: pathlib.Path, cls: str, r: int, seed: int) -> tuple[str, str, int]:
    """Draw until visible and write replicate r of a class; returns its name, its half and the attempts it took."""
    half = "tuning" if r % 2 == 0 else "scoring"
    kind = "seed" if (r // 2) % 2 == 0 else "ballscrew"
    name = "c" + hashlib.sha256(f"{seed}/{cls}/{r}".encode()).hexdigest()[:10]
    for attempt in range(TRIES):
        key = [seed, CLASSES.index(cls), r, attempt]
        case = draw_case(cls, kind, key)
        if case is not None:
            write_case(out, case, name, half, key)
            return name, half, attempt + 1
    raise RuntimeError(f"class {cls}, replicate {r}, axis {kind}: not visible in {TRIES} draws")


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder to write; cases/ and seals/ in it are replaced")
    parser.add_argument("--classes", default="all", help="all (without triples), singles, or a comma-separated list of: " + ", ".join(CLASSES))
    parser.add_argument("--per-class", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args(argv)
    wanted = {"all": ALL, "singles": list(effects.FAMILY)}.get(args.classes) or args.classes.split(",")
    unknown = [c for c in wanted if c not in CLASSES]
    if unknown:
        parser.error(f"unknown class {', '.join(unknown)}; there are: {', '.join(CLASSES)}")
    for sub in ("cases", "seals"):
        if (args.out / sub).exists():
            shutil.rmtree(args.out / sub)
    begun, tries, index = time.time(), 0, {}
    for cls in wanted:
        for r in range(args.per_class):
            name, half, attempts = make(args.out, cls, r, args.seed)
            index[name] = {"class": cls, "half": half}
            tries += attempts
        print(f"{cls}: {args.per_class} cases", file=sys.stderr)
    (args.out / "seals" / "index.json").write_text(json.dumps(index, indent=1) + "\n")
    spent, count = time.time() - begun, len(index)
    print(f"{count} cases in {args.out} ({tries} draws, {spent:.1f} s, {spent / max(count, 1):.2f} s a case)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
