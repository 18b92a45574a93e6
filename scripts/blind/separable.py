"""What a record can tell of a cause: how far it stands above noise, remainder and every simple rival of another family.

All in positions, in windows with free initial states, linearly about the true motion (visible.py): each effect's torque, as the plant tells it,
goes through the linear axis; base parameters, a constant torque, the log's lateness and the other causes are projected out. A rival is
tried as the columns of its family along the same motion, sizes free. A case is drawn again until every cause passes.
"""
from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter

import effects
import hidden
import plant
import visible
from axes import Machine
from motion import Motion, Run

FINE = 8


def sample_mean(column, speed, dt: float):
    """Mean of a position over every sample, from its values and speeds there (cubic Hermite): n - 1 values."""
    return 0.5 * (column[1:] + column[:-1]) + dt / 12.0 * (speed[:-1] - speed[1:])


class View:
    """A record's windows: what is seen of torques on motor and table (n - 1 sample means each)."""

    def __init__(self, machine: Machine, run: Run, m: Motion, outputs):
        self.machine, self.dt, self.outputs = machine, machine.dt, outputs
        self.states, self.command = run.states[m.kept], run.command[m.kept]
        n = self.states.shape[0]
        self.window = min(visible.WINDOW, n)
        self.count = n // self.window
        self.f, self.g, _ = self._discrete()
        free = [self._march(np.zeros((self.window, 2)), e)[:, outputs].ravel() for e in np.eye(4)]
        q, r = np.linalg.qr(np.stack([x / max(np.linalg.norm(x), 1e-300) for x in free], axis=1))
        self.q = q[:, np.abs(np.diag(r)) > 1e-9]
        th1, w1, th2, w2 = self.states.T
        self.th1, self.th2 = sample_mean(th1, w1, self.dt), sample_mean(th2, w2, self.dt)
        self.w1, self.w2 = np.diff(th1) / self.dt, np.diff(th2) / self.dt
        self.a1, self.a2 = np.diff(w1) / self.dt, np.diff(w2) / self.dt

    def _discrete(self):
        if not self.machine.rigid:
            return visible.discrete(self.machine.base, self.dt)
        dt, i = self.dt, self.machine.base["I1"]
        f = np.array([[1, dt, 0, 0], [0, 1, 0, 0], [0, 0, 1, dt], [0, 0, 0, 1.0]])
        g = np.array([[0.5 * dt * dt] * 2, [dt] * 2, [0.5 * dt * dt] * 2, [dt] * 2]) / i
        return f, g, np.zeros((4, 2))

    def _march(self, u, x0):
        return visible._march(self.f, self.g, np.zeros((4, 2)), np.ascontiguousarray(u), np.ascontiguousarray(x0, dtype=float))

    def flat(self, trace) -> np.ndarray:
        """A trace (n x 4) as one vector less what initial states explain; rows beyond the last whole window are dropped."""
        w = trace[: self.count * self.window][:, self.outputs].reshape(self.count, -1)
        return (w - (w @ self.q) @ self.q.T).ravel()

    def forced(self, motor, table) -> np.ndarray:
        """Flat response to torques on motor and table (n - 1 sample means each)."""
        u = np.zeros((self.states.shape[0], 2))
        u[:-1, 0], u[:-1, 1] = motor, table
        # Window by window from rest: the state at a window's start is free anyway, and nothing drifts away over a long record.
        out = np.empty((self.count * self.window, 4))
        for k in range(self.count):
            s = slice(k * self.window, (k + 1) * self.window)
            out[s] = self._march(u[s], np.zeros(4))
        return self.flat(out)

    def parameters(self) -> list:
        """Flat sensitivities to the base parameters."""
        zero = np.zeros_like(self.a1)
        if self.machine.rigid:
            return [self.forced(-self.a1, zero)]
        twist, rate = self.th1 - self.th2, self.w1 - self.w2
        return [self.forced(*f) for f in ((-self.a1, zero), (zero, -self.a2), (-rate, rate), (-twist, twist))]


def input_torque(draw: effects.Draw, command, dt: float, before) -> np.ndarray:
    """Torque that an input effect adds to the held command alone, mean over every sample (n); `before` the command ahead of the record."""
    p = draw.plant
    whole = np.concatenate([before, command])
    fine = np.repeat(whole, FINE)
    if "delay" in p:
        x = np.arange(fine.size)
        late = np.interp(x - FINE * p["delay"] / dt, x, fine)
    elif "lag" in p:
        a = math.exp(-dt / FINE / p["lag"])
        late, _ = lfilter([0.0, 1.0 - a], [1.0, -a], fine, zi=[fine[0]])
    elif "sat" in p:
        late = np.clip(fine, -p["sat"], p["sat"])
    else:
        late = fine - np.clip(fine, -p["dead"], p["dead"])
    return (late - fine).reshape(-1, FINE).mean(axis=1)[len(before):]


def torque_of(draw: effects.Draw, run: Run, m: Motion) -> np.ndarray:
    """Sample means (n - 1) of the torque of one effect; zero for a sensor's."""
    kept = slice(m.kept.start, m.kept.stop - 1)
    if draw.place == "sensor":
        return np.zeros(m.samples - 1)
    if draw.place == "input":
        return input_torque(draw, run.command[m.kept], m.machine.dt, run.command[: m.kept.start])[:-1]
    return sum(run.parts[kept, plant.PARTS.index(p)] for p in hidden.PARTS[draw.id].split())


def response(view: View, draw: effects.Draw, torque, sensor_error) -> np.ndarray:
    """What one effect adds to the positions, flat."""
    if draw.place == "sensor":
        return view.flat(sensor_error)
    zero = np.zeros_like(torque)
    if draw.place == "coupling":
        return view.forced(-torque, torque)
    return view.forced(zero, torque) if hidden.PARTS.get(draw.id, "").split()[:1][0] in hidden.ON_TABLE else view.forced(torque, zero)


def rivals(view: View):
    """(family or id, columns) of the simple effects that could be taken for another, along the true motion."""
    m = view.machine
    zero, one = np.zeros_like(view.a1), np.ones_like(view.a1)
    t = np.arange(zero.size) / zero.size
    sides = [("motor", view.th1, view.w1, lambda f: view.forced(f, zero))]
    if not m.rigid:
        sides.append(("table", view.th2, view.w2, lambda f: view.forced(zero, f)))
    for place, th, w, force in sides:
        moving = 1e-3 * effects.rms(w)
        up, down = (w > moving).astype(float), (w < -moving).astype(float)
        reach = 0.05 * max(float(np.ptp(th)), 1e-300)
        yield "load_torque", [force(one)]
        yield "dry_friction", [force(up), force(down)]
        yield "dry_friction", [force(np.tanh(w / (0.3 * effects.rms(w))))]
        yield "viscous_friction", [force(w * up), force(w * down)]
        yield "viscous_friction", [force(w * np.abs(w))]
        yield "drift", [force(t * np.sign(w)), force(t * w)]
        yield "external_spring", [force(th)]
        yield "position_friction", [force(np.sign(w) * np.exp(-(((th - np.median(th)) / (4 * reach)) ** 2)))]
        if not m.linear:
            yield "gravity", [force(np.sin(th)), force(np.cos(th))]
    states = view.states
    yield "delay", [view.flat(np.stack([states[:, 1], 0 * states[:, 1], states[:, 3], 0 * states[:, 3]], axis=1))]
    command = view.command[:-1]
    yield "actuator_lag", [view.forced(np.diff(view.command), zero)]
    top = float(np.max(np.abs(command)))
    for share in (0.3, 0.5, 0.7, 0.9):
        yield "saturation", [view.forced(np.clip(command, -share * top, share * top) - command, zero)]
    for share in (0.03, 0.1, 0.3):
        yield "dead_zone", [view.forced(np.clip(command, -share * top, share * top), zero)]
    if not m.rigid:
        twist = view.th1 - view.th2
        yield "nonlinear_stiffness", [view.forced(-(twist**3), twist**3)]
        yield "backlash", [view.forced(-np.tanh(twist / (0.2 * effects.rms(twist))), np.tanh(twist / (0.2 * effects.rms(twist))))]


class Columns:
    """Flat columns with their products, so that many projections cost one pass over the record."""

    def __init__(self, groups: dict):
        """groups: {name: list of flat columns}."""
        self.at, flat = {}, []
        for name, columns in groups.items():
            self.at[name] = list(range(len(flat), len(flat) + len(columns)))
            flat += columns
        a = np.stack(flat, axis=1)
        self.rows, self.size = a.shape[0], np.maximum(np.linalg.norm(a, axis=0), 1e-300)
        a /= self.size
        self.gram = a.T @ a

    def left(self, target: int, groups) -> float:
        """Rms of column `target` beyond its projection on the named groups; to about 1e-7 of itself."""
        use = [i for g in groups for i in self.at[g] if i != target]
        b = self.gram[use, target]
        fit = np.linalg.pinv(self.gram[np.ix_(use, use)], rcond=1e-12, hermitian=True) @ b if use else b
        part = 1.0 - 2.0 * float(b @ fit) + float(fit @ self.gram[np.ix_(use, use)] @ fit) if use else 1.0
        return float(self.size[target] * math.sqrt(max(part, 0.0) / self.rows)) if self.size[target] > 1e-290 else 0.0


def study(view: View, draws, torques, errors, conditions, noise, remainder) -> dict:
    """What the record tells of every cause.

    torques: sample means of each effect; errors: what each adds to the sensors (n x 4); conditions: flat columns of the log's own lateness;
    noise: flat, what log and torque noise add; remainder: flat, what nothing in a library explains.
    Returns floor [rad; m] and for every effect gap, alone (others out), rival (smallest over families) in the same unit, and its name."""
    zero = np.zeros_like(view.a1)
    seen = [response(view, d, t, e) for d, t, e in zip(draws, torques, errors)]
    groups = {"noise": [noise], "remainder": [remainder], "base": view.parameters(), "constant": [view.forced(zero + 1.0, zero)],
              "log": conditions}
    groups |= {f"effect {i}": [s] for i, s in enumerate(seen)}
    families = {}
    for i, (family, columns) in enumerate(rivals(view) if draws else []):
        groups[f"rival {i}"] = columns
        families[f"rival {i}"] = family
    table = Columns(groups)
    out = {"floor": table.left(table.at["noise"][0], ["base"]), "remainder": table.left(table.at["remainder"][0], ["base"]), "effects": []}
    for i, d in enumerate(draws):
        me, loaded = table.at[f"effect {i}"][0], d.id.startswith("load_")
        others = [f"effect {j}" for j in range(len(draws)) if j != i]
        beside = ["base", "log", *others] + ([] if loaded else ["constant"])
        names = hidden.accepted(d, view.machine.rigid) | ({"actuator_lag", "delay"} if d.place == "input" or d.id == "latch" else set())
        # Beside friction a constant torque is also the friction's own asymmetry, so friction stays its rival.
        taken = {x for j, o in enumerate(draws) if j != i for x in hidden.accepted(o, view.machine.rigid)}
        taken -= {"dry_friction"} if loaded else set()
        tried = [(table.left(me, [*beside, g]), family) for g, family in families.items() if family not in names | taken]
        best, who = min(tried, key=lambda x: x[0])
        out["effects"].append({"gap": table.left(me, ["base"]), "alone": table.left(me, beside), "rival": best, "rival_family": who})
    return out
