"""Draws the second edition: axes, loops, logs and their troubles as dimensions; a third of the axes healthy. README.md has the tables.

    .venv/bin/python scripts/blind/conditions.py --out DIR [--cases 600] [--seed 1] [--half both|tuning|scoring]
        [--machines] [--group GROUP]

The same folders as generate.py's: run.py diagnoses and scores them.
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

import numpy as np

import axes
import effects
import generate
import hidden
import logging_chain
import motion
import plant
import separable
import unmodelled
from axes import log_uniform

# Of thirty cases. The first two are the healthy third.
GROUPS = {"healthy": 5, "parameters": 5, "single": 8, "beside": 3, "two": 3, "three": 2, "machine": 3, "foreign": 1}
ORDER = ["healthy", "single", "parameters", "two", "single", "healthy", "machine", "single", "parameters", "beside",
         "three", "healthy", "single", "parameters", "two", "single", "healthy", "beside", "single", "parameters",
         "machine", "three", "single", "healthy", "two", "parameters", "beside", "single", "machine", "foreign"]
TRIES = 60
KEEP = 6  # attempts with one choice of effects and conditions, before others are drawn
LEAST_NOISE = 3.0  # every cause stands this far above the noise, the others projected out
LEAST_RIVAL = 2.0  # and the best simple rival of another family leaves this much of it, in noise and remainder together
LEAST_ASYMMETRY = 10.0  # of a constant torque beside dry friction, whose two directions may differ: only standstill tells the two apart
REQUIRED = 0.25  # of the largest cause's torque: those must be named
WILD = 8.0  # times the moving torque: a command above it is a loop that is not stable, or a drive against a stop
LOG_KINDS = ("none", "latched", "antialias")
HEALTHY = ("healthy", "parameters")
# Axes like real ones: with friction on both sides and a bias. The whole ones are of any kind, also of two inertias, and keep as much of
# their torque unexplained as the right model leaves of a real record.
MACHINES = ("machine", "whole_machine")
WHOLE_REST = (0.02, 0.11)  # of the moving torque
# Times what is not explained that a cause must be large for it to have to be named, and how many such there are at least.
FACTOR = {"whole_machine": (1.5, 4.0)}
LEAST_REQUIRED = {"machine": 2, "whole_machine": 1}


def pick_conditions(rng, group: str, kind: str) -> dict:
    """The dimensions of a case; every one is in the seal."""
    machine = group in MACHINES
    loops = list(motion.LOOPS)
    loop = str(rng.choice(loops, p=[0.4, 0.2, 0.1, 0.1, 0.1, 0.1]))
    if machine:
        loop = str(rng.choice(["moves", "moves_ff", "stops", "triangles"], p=[0.45, 0.25, 0.15, 0.15]))
    length = str(rng.choice(["usual", "short", "long"], p=[0.89, 0.08, 0.03]))
    screw = kind in ("ballscrew", "belt")
    out = {
        "loop": loop, "noise": str(rng.choice(logging_chain.NOISES, p=[0.4, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1])),
        "torque_noise": rng.random() < 0.25, "log": str(rng.choice(LOG_KINDS, p=[0.8, 0.12, 0.08])),
        "bias": rng.random() < 0.08, "drive_off": rng.random() < 0.07, "length": length,
        "fast": screw and rng.random() < 0.15, "unlike": screw and rng.random() < 0.15,
        "rest": "none",
    }
    if group in ("beside", "machine") or (group in ("single", "two") and rng.random() < 0.1):
        out["rest"] = str(rng.choice(unmodelled.KINDS))
    if group == "foreign":
        out["rest"], out["bias"] = str(rng.choice(["wander", "jam"])), False
    if group == "whole_machine":
        out["rest"] = unmodelled.SEVERAL
    if machine:
        out["bias"] = False  # it has a bias of its own size
    return out


def labels(case: dict) -> list:
    """Names of a case's conditions, for the tables."""
    c = case["conditions"]
    out = [f"loop {c['loop']}", f"noise {c['noise']}"]
    out += [f"log {case['log_kind']}"] if case["log_kind"] != "none" else []
    out += [x.replace("_", " ") for x in ("torque_noise", "bias", "drive_off") if c[x]]
    out += [{"short": "512 samples", "long": "long record"}[c["length"]]] if c["length"] != "usual" else []
    out += ["resonance at 0.4 Nyquist"] if c["fast"] else []
    out += ["inertia ratio 20"] if c["unlike"] else []
    out += [f"rest {case['rest'].kind}"] if case["rest"] else []
    out += ["known effect in the model"] if case["known"] else []
    return out


def pick_effects(rng, group: str, machine, sensors: str, which: int) -> list:
    """Effect ids of a case; the first of a single walks through the list, so that each comes up."""
    ids = hidden.possible(machine, sensors)
    if group in (*HEALTHY, "foreign"):
        return []
    if group in ("single", "beside"):
        return [ids[which % len(ids)]]
    if group in MACHINES:
        out = ["presliding_motor" if rng.random() < 0.4 else "coulomb_motor", "viscous_motor", "load_motor"]
        out += ["torque_ripple"] if rng.random() < 0.5 else []
        if not machine.rigid:
            out += [str(rng.choice(["coulomb_table", "viscous_table", "backlash", "cubic_stiffness"]))] if rng.random() < 0.5 else []
        return out + (["gravity"] if machine.kind == "joint" and rng.random() < 0.5 else [])
    if group == "three":
        sets = [["actuator_lag", "delay", "coulomb_motor"]]
        sets += [["coulomb_motor", "torque_ripple", "viscous_motor"]] if machine.rigid else [
            ["coulomb_motor", "coulomb_table", str(rng.choice(["viscous_motor", "viscous_table"]))]]
        sets += [["coulomb_motor", "gravity", "torque_ripple"]] if "gravity" in ids else []
        if rng.random() < 0.8:
            return sets[int(rng.integers(len(sets)))]
    count = 3 if group == "three" else 2
    while True:
        picked = [str(x) for x in rng.choice([e for e in ids if e not in ("end_stop",)], count, replace=False)]
        families = {(effects.KNOWN.get(e) or ("dry_friction",))[0] for e in picked}
        if len(families) == count and not hidden.clash(picked):
            return picked


def sizes(rng, group: str, ids, again: int) -> list:
    """Shares of the moving torque, 3 to 50 %; of several the smaller near the larger, of a real machine as they come.

    again: attempts that the same effects have failed; in the second half of them the smallest sizes are left out."""
    if group in MACHINES:
        own = {"load_motor": (0.02, 0.3), "torque_ripple": (0.01, 0.05), "gravity": (0.1, 1.0)}
        return [log_uniform(rng, *own.get(e, (0.05, 0.4))) for e in ids]
    first = log_uniform(rng, (0.03 if group != "beside" else 0.08) if again < KEEP // 2 else 0.15, 0.5)
    return [first] + [min(0.5, max(0.03, first * rng.uniform(0.5, 1.5))) for _ in ids[1:]]


def draw_log(rng, machine, c: dict, m) -> logging_chain.Log:
    sigma = log_uniform(rng, *machine.noise)
    step = 0.0
    if c["noise"] == "coarse":
        step = log_uniform(rng, *machine.step)
    if m.drive is not None:
        # What a drive makes of its encoder's noise stays below a tenth (of coarse steps: a third) of the moving torque.
        gain = m.drive.kv * m.drive.smooth / machine.dt
        sigma = min(sigma, 0.1 * machine.level / gain)
        step = min(step, machine.level / gain)
    log = logging_chain.Log(c["noise"], 0.2 * step if step else sigma, step)
    if c["noise"].startswith("jitter"):
        log.jitter = rng.uniform(0.01, 0.05)
    if c["torque_noise"]:
        log.torque_noise = rng.uniform(0.01, 0.05)
    return log


def settle(c: dict, group: str, ids) -> str:
    """Leave out conditions that would hide or double the causes; returns the log's kind. c is changed."""
    timed = {"delay", "latch", "sensor_delay", "actuator_lag"}.intersection(ids)
    if timed and c["noise"].startswith("jitter"):
        c["noise"] = "white"
    if any(e.startswith("load_") for e in ids) or c["loop"] == "one_way" and group in HEALTHY:
        c["bias"] = False
    pulled = {"gravity", "external_spring", "end_stop", "load_motor", "load_table"}.intersection(ids)
    if c["loop"] == "open" and (c["bias"] or pulled):
        c["drive_off"] = False  # nothing would hold the axis
    return "none" if timed else c["log"]


def draw_motions(rng, choice, machine, c: dict, ids):
    """The training and the held-out experiment; the second another realisation, 0.5 to 1 times as long, by the same drive."""
    n = {"short": 512, "long": int(choice.choice([20000, 60000])), "usual": int(log_uniform(rng, 1500, 9000))}[c["length"]]
    if c["length"] == "usual" and c["loop"] == "open":
        n = max(2048, n)
    moves = max(3.0, n / rng.uniform(500, 1500)) if c["loop"] != "open" else None
    turning = bool((effects.TURNING | {"gravity", "external_spring", "position_friction"}).intersection(ids))
    train = motion.draw(machine, rng, c["loop"], n, 1.0, turning, c["drive_off"], moves)
    held = motion.draw(machine, rng, c["loop"], max(512, int(n * rng.uniform(0.5, 1.0))), rng.uniform(0.8, 1.25), turning, False, moves)
    held.drive, held.hold = (plant.Drive(**{**train.drive.__dict__, "off": math.inf}) if train.drive else None), train.hold
    return train, held


def draw_lateness(rng, machine, log_kind: str, log) -> None:
    """Encoders late or early against the torque, or filtered: at most a quarter of the resonance's period."""
    period = 1 / (machine.band * machine.dt)
    if log_kind == "latched":
        top = min(3.0, max(0.75, 0.25 * period))
        log.shift = float(rng.choice([-1, 1])) * rng.uniform(0.55, top)
    elif log_kind == "antialias":
        log.filter = rng.uniform(0.5, min(4.0, max(0.75, 0.25 * period)))


def reference(machine, m, run) -> effects.Reference:
    """What effects are sized on: the axis without them in the same experiment, and the torque that moves it."""
    n = m.samples
    ref = effects.Reference(axes.sizing(machine), machine.dt, n * machine.dt, run.command[m.kept], run.states[m.kept],
                            1 / (n * machine.dt), 1.5 * machine.band, machine.band, m.hold == "linear")
    ref.torque_rms = machine.level
    return ref


def draw_rests(rng, case: dict, ref, base: dict, key):
    """A remainder for each of the two records (None without one): the same law, of a wandering torque another realisation."""
    c, machine = case["conditions"], case["machine"]
    if c["rest"] == "none":
        return [None, None]
    smallest = min((d.size for d in case["draws"]), default=0.3)
    own_share = {"foreign": (0.08, 0.3), "whole_machine": WHOLE_REST}.get(case["group"])
    share = log_uniform(rng, *own_share) if own_share else min(0.03, smallest / case["factor"] * rng.uniform(0.3, 1.0))
    out = []
    for i, m in enumerate(case["motions"]):
        own = np.random.default_rng([*key, i] if c["rest"] == "wander" else key)
        out.append(unmodelled.draw(c["rest"], ref, own, share, m.length, base, machine.linear, machine.rigid))
    return [out[0], out[0]] if out[0].plant else out


def draw_case(group: str, kind: str, seed: int, r: int, attempt: int) -> dict | None:
    """One attempt; None when the record could not tell the causes drawn."""
    choice = np.random.default_rng([seed, 2, r, attempt // KEEP])
    rng = np.random.default_rng([seed, 3, r, attempt])
    c = pick_conditions(choice, group, kind)
    machine = axes.draw(kind, rng, c["fast"], c["unlike"])
    sensors = "motor" if machine.rigid else str(choice.choice(["both", "motor", "velocities"], p=[0.65, 0.3, 0.05]))
    which = nth_of_group(r // 2) if attempt < 4 * KEEP else int(choice.integers(1000))
    ids = pick_effects(choice, group, machine, sensors, which)
    log_kind = settle(c, group, ids)
    train, held = draw_motions(rng, choice, machine, c, ids)
    closed = train.drive is not None
    log = draw_log(rng, machine, c, train)
    draw_lateness(rng, machine, log_kind, log)
    reading = [log.sigma * (logging_chain.pink(rng, x.length) if log.noise == "pink" else rng.standard_normal(x.length)) if closed
               else np.zeros(x.length) for x in (train, held)]
    for x in (train, held):
        if closed:
            x.drive.step = log.step

    plain = train.run(machine.base, 0.0, None, reading[0])
    if not np.all(np.isfinite(plain.states)) or effects.rms(plain.command) > WILD * machine.level:
        return None  # the loop is not stable with these gains
    ref = reference(machine, train, plain)
    reach = hidden.REACH_OF_MACHINES if group in MACHINES else hidden.REACH
    draws = [hidden.draw(e, machine, ref, rng, s, closed, reach) for e, s in zip(ids, sizes(rng, group, ids, attempt % KEEP))]
    params, sensor, bias = generate.combine(draws)
    base = machine.base | params
    known, kept_bias = {}, None
    if kind == "joint" and group in HEALTHY and rng.random() < 0.35:
        g = hidden.draw("gravity", machine, ref, rng, log_uniform(rng, 0.2, 1.0), closed)
        base, bias = base | g.plant, bias + g.bias
        known["gravity"] = {"sine": g.plant["grav_s"], "cosine": g.plant["grav_c"], "ratio": 1.0}
    if c["bias"]:
        load = float(rng.choice([-1, 1])) * 2.0 * machine.level
        place = "motor" if machine.rigid or rng.random() < 0.5 else "table"
        base, bias = base | {f"load_{place[0]}": load}, bias - load
        kept_bias = {"id": f"load_{place}", "torque": load}
    case = dict(group=group, machine=machine, conditions=c, log_kind=log_kind, log=log, sensors=sensors, motions=(train, held),
                draws=draws, sensor=sensor, known=known, bias=kept_bias, reading=reading,
                factor=log_uniform(rng, *FACTOR.get(group, (3.0, 10.0))))
    rests = draw_rests(rng, case, ref, base, [seed, 4, r, attempt])
    base = base | (rests[0].plant if rests[0] else {})
    span = np.ptp(plain.states[train.kept, 0]) + 1e-12

    def run(i):
        """Record i, or None where the axis runs away or the drive fights it."""
        x, rest = (train, held)[i], rests[i]
        out = x.run(base, bias, rest.extra if rest else None, reading[i])
        fights = effects.rms(out.command - np.mean(out.command)) > WILD * machine.level
        return None if not np.all(np.isfinite(out.states)) or fights or np.ptp(out.states[x.kept, 0]) > 30 * span else out

    first = run(0)
    if first is None:
        return None
    if group == "parameters":
        nominal = axes.nominal_of(machine, rng, 0.3, True)
    elif group == "healthy" or rng.random() < 0.5:
        nominal = dict(machine.nominal)
    else:
        nominal = axes.nominal_of(machine, rng, 0.03 if rng.random() < 0.75 else 0.15, False)
    case = judge(case | dict(nominal=nominal, rest=rests[0], runs=[first]), [seed, 5, r, attempt])
    if case is not None:
        case["runs"].append(run(1))
    return case if case and case["runs"][1] is not None else None


def columns(sensors: str):
    return generate.columns(sensors)


def judge(case: dict, key) -> dict | None:
    """Make the logs and decide whether they can tell the causes; the noise of an open loop is lowered where that helps."""
    machine, log, draws = case["machine"], case["log"], case["draws"]
    m, run = case["motions"][0], case["runs"][0]
    view = separable.View(machine, run, m, [0] if case["sensors"] == "motor" else [0, 2])
    torques = [separable.torque_of(d, run, m) for d in draws]
    instants = np.arange(m.kept.start, m.kept.stop, dtype=float)
    clean = logging_chain.seen(run, machine.dt, {}, logging_chain.Log("white", 0.0), instants)
    stack = lambda x, y: np.stack([x["theta1"] - y["theta1"], 0 * x["theta1"], x["theta2"] - y["theta2"], 0 * x["theta1"]], axis=1)
    errors = [stack(logging_chain.seen(run, machine.dt, d.sensor, logging_chain.Log("white", 0.0), instants), clean)
              if d.sensor else None for d in draws]
    lateness = [view.flat(np.stack([run.states[m.kept, 1], 0 * instants, run.states[m.kept, 3], 0 * instants], axis=1))] \
        if case["log_kind"] != "none" else []
    rest = case["rest"]
    remainder = np.zeros((m.samples - 1, 2))
    if rest:
        part = lambda name: run.parts[m.kept.start:m.kept.stop - 1, plant.PARTS.index(name)]
        warmed = 0.0
        if "warm" in rest.plant:
            t = np.arange(m.samples - 1) * machine.dt
            w = rest.plant["warm"] * np.exp(-t / rest.plant["warm_tau"])
            warmed = (part("fm") + part("vm")) * w / (1 + w)
        remainder[:, 0] = part("extra_m") + part("jam") + part("mode0") * ("I0" in rest.plant) + warmed
        remainder[:, 1] = part("extra_t")
    for _ in range(3):
        rng = np.random.default_rng(key)
        table, quiet, good = logging_chain.record(run, machine.dt, case["sensor"], log, m, columns(case["sensors"]), rng)
        position = {c: np.where(good, table[c], quiet[c]) for c in ("theta1", "theta2") if c in table}
        noise = np.zeros((m.samples, 4))
        for c, i in (("theta1", 0), ("theta2", 2)):
            if c in position:
                noise[:, i] = position[c] - quiet[c]
        scatter = table["T"] - run.command[m.kept]
        unseen = view.flat(noise)
        for col in lateness:  # the log's own lateness is told apart by whoever looks for it
            unseen = unseen - col * float(col @ unseen) / max(float(col @ col), 1e-300)
        shaken = view.forced(scatter[:-1], 0 * scatter[:-1])
        told = separable.study(view, draws, torques, errors, lateness, unseen + shaken, view.forced(*remainder.T))
        if not draws:
            break
        need = min(e["alone"] for e in told["effects"]) / LEAST_NOISE if case["group"] not in MACHINES else \
            max(e["alone"] for e in told["effects"]) / LEAST_NOISE
        if told["floor"] <= need:
            break
        if m.drive is not None or log.step or log.sigma <= machine.noise[0]:
            return None
        log.sigma = max(machine.noise[0], 0.7 * log.sigma * need / told["floor"])
    size = [effects.rms(t) for t in torques]
    largest = max(size, default=0.0)
    both = math.hypot(told["floor"], told["remainder"])
    dry = any(d.family == "dry_friction" for d in draws)
    for d, e, s in zip(draws, told["effects"], size):
        least = LEAST_ASYMMETRY if dry and d.id.startswith("load_") else LEAST_RIVAL
        own = e["alone"] > LEAST_NOISE * told["floor"]
        if case["group"] == "whole_machine":  # what a torque that wanders does to positions says little of torques
            own = own and not d.id.startswith("load_") and s > case["factor"] * effects.rms(remainder)
        else:
            own = own and e["rival"] > least * both and e["alone"] > case["factor"] * told["remainder"]
        e["torque_rms"] = s
        e["required"] = bool(own and (d.place == "sensor" or s >= REQUIRED * largest))
        if not own and case["group"] not in MACHINES:
            return None
        if case["group"] in ("two", "three") and not e["required"]:
            return None
    if case["group"] in MACHINES and sum(e["required"] for e in told["effects"]) < LEAST_REQUIRED[case["group"]]:
        return None
    if case["group"] in ("beside", *MACHINES) and told["remainder"] < told["floor"]:
        return None
    if case["group"] == "foreign" and told["remainder"] < 5 * told["floor"]:
        return None
    told["parameters"] = wrong_parameters(view, case)
    return case | dict(told=told, key=key, table=table, quiet=quiet, good=good)


def wrong_parameters(view, case) -> float:
    """What the nominal parameters' errors add to the positions, in the unit of the floor."""
    machine, nominal = case["machine"], case["nominal"]
    diff = {k: nominal[k] - machine.base[k] for k in nominal}
    motor, table = -diff["I1"] * view.a1, 0.0 * view.a1
    if not machine.rigid:
        pull = diff["B"] * (view.w1 - view.w2) + diff["K"] * (view.th1 - view.th2)
        motor, table = motor - pull, table - diff["I2"] * view.a2 + pull
    return effects.rms(view.forced(motor, table))


UNITS = generate.UNITS
LINEAR_UNITS = {"time": "s", "T": "N", "theta1": "m", "theta2": "m", "omega1": "m/s", "omega2": "m/s"}


def write_csv(path: pathlib.Path, table: dict, units: dict):
    rows = np.stack(list(table.values()), axis=1)
    row = ",".join(["%.12g"] * rows.shape[1])
    text = "\n".join(row % tuple(v) for v in rows.tolist())
    path.write_text(",".join(f"{c} [{units[c]}]" for c in table) + "\n" + text + "\n")


def truth(case: dict) -> list:
    """The causes of a case as the seal tells them."""
    rigid, out = case["machine"].rigid, []
    for d, e in zip(case["draws"], case["told"]["effects"]):
        place = "axis" if rigid and d.place not in ("input", "sensor") else d.place
        out.append({"id": d.id, "family": d.family, "place": place, "size": d.size, "variant": d.variant, "plant": d.plant, "sensor": d.sensor,
                    "accepted": sorted(hidden.accepted(d, rigid)), "required": e["required"], "torque_rms": e["torque_rms"],
                    "gap_over_noise": e["gap"] / case["told"]["floor"], "alone_over_noise": e["alone"] / case["told"]["floor"],
                    "rival": e["rival_family"], "rival_over_noise": min(e["rival"], 1e300) / case["told"]["floor"]})
    return out


def tolerated(case: dict) -> list:
    """Families and ids that are not wrong beside the causes, by the conditions of the case."""
    out = set()
    if case["log"].step:
        out |= {"encoder_quantisation"}
    if case["log_kind"] != "none":
        out |= hidden.LATE | ({"actuator_lag"} if case["log_kind"] == "antialias" else set())
    if case["bias"]:
        out |= {"load_torque"}
    if any(d.variant == "asymmetric" and d.family == "dry_friction" for d in case["draws"]):
        out |= {"load_torque"}  # unlike levels of the two directions are one level and a constant torque
    if case["rest"]:
        out |= unmodelled.KIN[case["rest"].kind]
    return sorted(out)


def seal_of(case: dict, name: str, half: str, r: int) -> dict:
    machine, log, c, told = case["machine"], case["log"], case["conditions"], case["told"]
    verdict = {"healthy": "no_gap", "parameters": "parameters", "foreign": "unexplained"}.get(case["group"], "effect")
    rest = case["rest"]
    return {
        "case": name, "edition": 2, "class": case["group"], "group": case["group"], "half": half, "replicate": r, "key": case["key"],
        "verdict": verdict, "effects": truth(case), "tolerated": tolerated(case), "conditions": labels(case), "drawn": c,
        "axis": machine.kind, "rigid": machine.rigid, "base": machine.base, "nominal": case["nominal"], "known": case["known"],
        "bias": case["bias"], "sensors": case["sensors"], "hold": case["motions"][0].hold, "dt_s": machine.dt, "level": machine.level,
        "noise_rad": log.sigma, "log": log.__dict__, "floor": told["floor"],
        "rest": rest and {"kind": rest.kind, "share": rest.share, "plant": rest.plant, "over_noise": told["remainder"] / told["floor"]},
        "visible_factor": {"noise": LEAST_NOISE, "rival": LEAST_RIVAL, "remainder": case["factor"]},
        "parameters_over_noise": told["parameters"] / told["floor"],
        "samples": {k: m.samples for k, m in zip(("train", "holdout"), case["motions"])}, "motion": case["motions"][0].facts,
    }


def nth_of_group(pair: int) -> int:
    """How many pairs of the same group came before this one."""
    rounds, at = divmod(pair, len(ORDER))
    return rounds * GROUPS[ORDER[at]] + ORDER[:at].count(ORDER[at])


def make(out: pathlib.Path, r: int, seed: int, half: str, whole: bool) -> tuple[str, dict, int]:
    """Draw replicate r until its record can tell its causes, and write it; returns name, index entry (nothing of the causes) and attempts.

    whole: whole machines alone."""
    pair = r // 2
    group = "whole_machine" if whole else ORDER[pair % len(ORDER)]
    kind = axes.KINDS[(pair + pair // len(ORDER)) % len(axes.KINDS)]
    if group == "machine":
        kind = ("rigid_stage", "joint")[(pair // 10) % 2]
    half = ("tuning" if r % 2 == 0 else "scoring") if half == "both" else half
    name = "d" + hashlib.sha256(f"{seed}/second/{r}".encode()).hexdigest()[:10]
    for attempt in range(TRIES):
        case = draw_case(group, kind, seed, r, attempt)
        if case is not None:
            break
    else:
        raise RuntimeError(f"{group} on {kind}, replicate {r}: no record that tells its causes in {TRIES} draws")
    machine = case["machine"]
    folder = out / "cases" / name
    folder.mkdir(parents=True, exist_ok=True)
    units = LINEAR_UNITS if machine.linear else UNITS
    write_csv(folder / "train.csv", case["table"], units)
    held, _, _ = logging_chain.record(case["runs"][1], machine.dt, case["sensor"], case["log"], case["motions"][1],
                                      columns(case["sensors"]), np.random.default_rng([seed, 6, r]))
    write_csv(folder / "holdout.csv", held, units)
    (folder / "axis.toml").write_text(axes.toml(machine, case["nominal"], columns(case["sensors"]), case["motions"][0].hold, case["known"]))
    (out / "seals").mkdir(parents=True, exist_ok=True)
    (out / "seals" / f"{name}.json").write_text(json.dumps(generate.plain(seal_of(case, name, half, r)), indent=1) + "\n")
    return name, {"class": group, "half": half, "edition": 2, "axis": kind, "conditions": labels(case)}, attempt + 1


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder to write; cases/ and seals/ in it are replaced")
    parser.add_argument("--cases", type=int, default=600)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--half", choices=["both", "tuning", "scoring"], default="both", help="mark every case as of this half")
    parser.add_argument("--machines", action="store_true", help="axes like real machines alone, of every kind")
    parser.add_argument("--group", choices=sorted(GROUPS), help="cases of this group alone, on every kind of axis")
    args = parser.parse_args(argv)
    if args.group:
        ORDER[:], GROUPS[args.group] = [args.group] * len(ORDER), len(ORDER)
    for sub in ("cases", "seals"):
        if (args.out / sub).exists():
            shutil.rmtree(args.out / sub)
    begun, tries, index = time.time(), 0, {}
    for r in range(args.cases):
        name, entry, attempts = make(args.out, r, args.seed, args.half, args.machines)
        index[name] = entry
        tries += attempts
        if sys.stderr.isatty():
            print(f"\r{r + 1}/{args.cases}", end="", file=sys.stderr)
    (args.out / "seals" / "index.json").write_text(json.dumps(index, indent=1) + "\n")
    spent = time.time() - begun
    print(f"{len(index)} cases in {args.out} ({tries} draws, {spent:.1f} s, {spent / max(len(index), 1):.2f} s a case)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
