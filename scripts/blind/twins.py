"""Which other causes could explain a case as well as the true one: a bound on what any method can tell apart.

    .venv/bin/python scripts/blind/twins.py --cases DIR [--half all] [--report FILE]

The torque every other effect would exert along the true trajectory is put through the linear axis and, with base parameters and the initial
states of every window free, fitted by least squares to what the true effect adds; shapes (a gap, an order, a reach) are tried on grids,
sizes are free. A model that reproduces the trajectory exerts this torque, so a large remainder rules the alternative out, and one with
chi2 near the number of free parameters cannot be told from the truth on this record. The plant's own trajectory without noise is used;
chi2 is the remainder over the encoder noise, squared and summed: the expected gain in -2 log likelihood of the truth over the twin.
A disturbance (any frequency) and quantisation are not tried as twins.
"""
from __future__ import annotations

import argparse
import json
import math
import pathlib
import sys

import numpy as np
from numba import njit
from scipy.optimize import nnls

import effects
import generate
import visible


@njit(cache=True)
def _dahl(move, level_side, reach, n):
    """Bristle z in -1..1 driven by a motion (increments `move`), shape exponent n; exact per step for n = 1 by small steps."""
    out = np.zeros(move.size)
    z = 0.0
    for k in range(1, move.size):
        parts = max(1, int(math.ceil(abs(move[k]) / (0.05 * reach))))
        if parts > 400:
            z = 1.0 if move[k] > 0 else -1.0
        else:
            d = move[k] / reach / parts
            for _ in range(parts):
                turn = abs(z) ** n if d * z > 0 else (0.0 if level_side else -abs(z) ** n)
                z += d * (1.0 - turn)
        out[k] = z
    return out


@njit(cache=True)
def _mode(th2, w2, dt, wn, zeta):
    """Torque on the table of a unit inertia on a spring behind it, 40 sub-steps of semi-implicit Euler a sample."""
    out = np.zeros(th2.size)
    x, v = th2[0], w2[0]
    h = dt / 40
    for k in range(th2.size - 1):
        out[k] = wn * wn * (x - th2[k]) + 2 * zeta * wn * (v - w2[k])
        for j in range(40):
            s = (j + 0.5) / 40
            p = th2[k] + (th2[k + 1] - th2[k]) * s
            q = w2[k] + (w2[k + 1] - w2[k]) * s
            v += h * (wn * wn * (p - x) + 2 * zeta * wn * (q - v))
            x += h * v
    out[-1] = out[-2]
    return out


def candidates(windows: visible.Windows, states, torque, linear: bool, dt: float, resonance: float):
    """Yields (effect id, list of flat columns, whether sizes must be positive) for every effect and point of its shape grid."""
    th1, w1, th2, w2 = states.T
    d, dd = th1 - th2, w1 - w2
    zero, one = np.zeros_like(th1), np.ones_like(th1)
    t = np.arange(th1.size) * dt / (th1.size * dt)
    k, b = windows.base["K"], windows.base["B"]
    bodies = (("motor", th1, w1, lambda f: windows.forced(f, zero)), ("table", th2, w2, lambda f: windows.forced(zero, f)))
    couple = lambda f: windows.forced(-f, f)
    for place, th, w, force in bodies:
        up, down = (w > 0).astype(float), (w < 0).astype(float)
        # Friction opposes the motion on either side, so a constant torque is friction only where the axis never reverses.
        sides = [force(-up), force(down)]
        yield f"coulomb_{place}", sides, True
        for share in (0.05, 0.1, 0.2, 0.3):
            yield f"coulomb_{place}", sides + [force(-np.sign(w) * np.exp(-((w / (share * effects.rms(w))) ** 2)))], True
        for share in (0.02, 0.05, 0.1, 0.2, 0.4):
            z = _dahl(np.diff(th, prepend=th[0]), False, share * float(np.std(th)), 1.0)
            yield f"presliding_{place}", [force(z), force(np.gradient(z, dt))], False
        yield f"viscous_{place}", [force(-w * up), force(-w * down)], True
        yield f"load_{place}", [force(one)], False
    force, table = bodies[0][3], bodies[1][3]
    reach = max(float(np.ptp(th1)), 1e-9)
    for order in np.unique(np.concatenate([np.arange(1, 25), np.arange(0.5, 24, max(0.1, 1.5 / reach))])):
        yield "torque_ripple", [force(np.sin(order * th1)), force(np.cos(order * th1))], False
    yield "unbalance", [table(np.sin(th2)), table(np.cos(th2))], False
    yield "quadratic_drag", [table(w2 * np.abs(w2))], False
    scale = effects.rms(d)
    for share in (0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0):
        gap = share * scale
        contact = np.where(d > gap, np.maximum(0, k * (d - gap) + b * dd), np.where(d < -gap, np.minimum(0, k * (d + gap) + b * dd), 0.0))
        yield "backlash", [couple(contact - k * d - b * dd)], False
    yield "cubic_stiffness", [couple(d**3)], False
    for share in (0.05, 0.1, 0.2, 0.3, 0.5, 0.8):
        for n in (1.0, 2.0):
            yield "coupling_hysteresis", [couple(_dahl(np.diff(d, prepend=d[0]), True, share * scale, n))], False
    yield "stiffness_drift", [couple(t * d)], False
    yield "friction_drift", [force(t * np.sign(w1)), force(t * w1)], False
    for f in resonance * np.geomspace(0.35, 1.6, 25):
        for zeta in (0.02, 0.05, 0.1):
            yield "flexible_mode", [table(_mode(th2, w2, dt, 2 * math.pi * f, zeta))], False
    for end in (0.005, 0.02, 0.05, 0.1, 0.2):
        hi, lo = np.quantile(th2, 1 - end), np.quantile(th2, end)
        yield "end_stop", [table(np.maximum(th2 - hi, 0.0))], False
        yield "end_stop", [table(np.maximum(lo - th2, 0.0))], False
    # The command as the linear axis feels it; a shift of half a sample turns the held torque into its linear-hold equal.
    drive = visible.linear_response(windows.base, dt, np.stack([torque, zero], axis=1), np.zeros(4))
    shift = lambda tau: np.stack([np.interp(np.arange(th1.size) - tau / dt, np.arange(th1.size), c) for c in drive.T], axis=1) - drive
    for samples in (0.3, 1.0, 2.0, 4.0, 8.0):
        yield "delay", [windows.flat(shift(samples * dt))], False
    for samples in (0.5, 1.0, 2.0, 4.0, 8.0, 16.0):
        late = np.stack([effects.lagged(c, dt, samples * dt) for c in drive.T], axis=1)
        yield "actuator_lag", [windows.flat(late - drive)], False
    top = float(np.max(np.abs(torque)))
    for share in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9):
        yield "saturation", [force(np.clip(torque, -share * top, share * top) - torque)], False
    yield "torque_gain", [force(torque)], False
    if windows.outputs == [0, 2]:
        on_table = lambda x: windows.flat(np.stack([zero, zero, x, zero], axis=1))
        yield "sensor_delay", [on_table(w2), on_table(np.gradient(w2, dt))], False
        yield "lead_error", [on_table(th2)], False
        for order in range(1, 13):
            yield "lead_error", [on_table(np.sin(order * th2)), on_table(np.cos(order * th2))], False


def study(seal: dict) -> dict:
    """Smallest remainder of every effect as a twin of the sealed one: {id: (rms over noise, chi2)}."""
    case = generate.draw_case(seal["class"], seal["axis"], seal["seed"])
    axis, exp, sensors = case["axis"], case["train"], case["sensors"]
    params, sensor, bias = generate.combine(case["draws"])
    states = exp.run(axis.base | params, bias)
    seen = generate.clean(exp, axis.base, case["draws"])
    plain = exp.run(axis.base, bias)
    outputs = generate.outputs_of(sensors)
    windows = visible.Windows(axis.base, axis.dt, states.shape[0], outputs)
    target = windows.flat(seen - plain)
    basis, _ = np.linalg.qr(visible.unit(windows.parameters(states)))
    target = target - basis @ (basis.T @ target)
    best = {}
    for effect, cols, positive in candidates(windows, states, exp.torque + bias, exp.hold == "linear", axis.dt, axis.resonance):
        m = visible.unit([c - basis @ (basis.T @ c) for c in cols])
        fit = nnls(m, target)[0] if positive else np.linalg.lstsq(m, target, rcond=1e-10)[0]
        left = float(np.sum((target - m @ fit) ** 2)) / case["noise"] ** 2
        best[effect] = min(best.get(effect, math.inf), left)
    n = target.size
    return {e: (math.sqrt(v / n), v) for e, v in sorted(best.items(), key=lambda x: x[1])}


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=pathlib.Path, required=True)
    parser.add_argument("--half", choices=["tuning", "scoring", "all"], default="all")
    parser.add_argument("--below", type=float, default=100.0, help="list twins whose chi2 is below this")
    parser.add_argument("--report", type=pathlib.Path)
    args = parser.parse_args(argv)
    lines = ["| case | truth | axis | sensors | total | itself | nearest of another family | nearest at another place |", "|---|---|---|---|---|---|---|---|"]
    near = {"family": 0, "place": 0}
    total = 0
    for path in sorted((args.cases / "seals").glob("c*.json")):
        seal = json.loads(path.read_text())
        if len(seal["effects"]) != 1 or args.half not in ("all", seal["half"]):
            continue
        truth = seal["effects"][0]
        if truth["id"] in effects.ABSORBED | {"encoder_quantisation"}:
            continue
        total += 1
        twins = study(seal)
        pick = {}
        for i, what in enumerate(("family", "place")):
            for e, (_, chi2) in twins.items():
                if effects.FAMILY[e][i] != truth[what] and e != "torque_gain":
                    pick[what] = (e, chi2)
                    break
            near[what] += pick[what][1] < args.below
        if min(p[1] for p in pick.values()) < args.below:
            own = twins.get(truth["id"], (math.nan, math.nan))[1]
            whole = truth["gap_refit_over_noise"]["train"] ** 2 * seal["samples"]["train"] * (1 if seal["sensors"] == "motor" else 2)
            lines.append(f"| {seal['case']} | {truth['id']} ({truth['variant']}, {truth['size']:.2f}) | {seal['axis']} | {seal['sensors']} | {whole:.0f} | {own:.0f} | "
                         + " | ".join(f"{pick[w][0]} {pick[w][1]:.0f}" for w in ("family", "place")) + " |")
    text = "\n".join(lines) + f"\n\nof {total} cases, chi2 below {args.below:g}: another family {near['family']}, another place {near['place']}\n"
    if args.report:
        args.report.write_text(text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
