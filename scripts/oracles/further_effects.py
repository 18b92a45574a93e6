"""Oracle of tests/plant.rs beside the blind set's plant: scipy's DOP853 with events, for effects from their equations.

    python scripts/oracles/further_effects.py            # from the project root, with numpy and scipy; some minutes

Writes scripts/oracles/further_effects.txt in the form of tests/plant/oracle.txt. Dry friction slips one way or sticks; a slip
ends at a speed of zero, a stick where the push passes the level. Steps of the torque, and the edges of the dead zone under a
torque that runs linearly, begin a new stretch, so that no stretch has a kink but that of a load's absolute value.
"""

import math
import pathlib

import numpy as np
from scipy.integrate import solve_ivp

SAMPLES, EVERY = 1024, 32
AXES = (
    ("seed", dict(I1=2.37e-4, I2=6.07e-6, B=5.4e-4, K=1.76e-2), 5.626e-4, "zoh", 0.03, (11.0, 37.0, 90.0)),
    ("ballscrew", dict(I1=1.5e-3, I2=9e-4, B=0.03, K=250.0), 4e-4, "linear", 0.8, (40.0, 160.0, 480.0)),
)
CASES = {
    "seed": (
        ("gravity", dict(sine=4e-3, cosine=2e-3, ratio=1.3)),
        ("gravity", dict(sine=-3e-3, cosine=1e-3, ratio=6.0)),
        ("external_spring", dict(stiffness=6e-3, rest=0.3)),
        ("external_spring", dict(stiffness=2e-3, rest=-1.0)),
        ("dead_zone", dict(width=5e-3)),
        ("dead_zone", dict(width=0.012)),
        ("coulomb_motor", dict(level=2e-4, load=0.8)),
        ("coulomb_motor", dict(level=1e-3, peak=0.5, speed=2.0, asymmetry=0.2, load=0.5)),
        ("coulomb_table", dict(level=1e-4, load=0.6)),
        ("position_friction", dict(level=0.01, centre=0.1, width=0.3)),
        ("position_friction", dict(level=6e-3, centre=-0.4, width=0.15)),
        ("motor_mode", dict(inertia=4e-5, stiffness=0.144, damping=2.4e-4)),
        ("motor_mode", dict(inertia=2e-5, stiffness=0.45, damping=3e-4)),
        ("latch", dict(delay=1.3e-3)),
        ("latch", dict(delay=-8e-4)),
        ("latch", dict(filter=2e-3)),
        ("latch", dict(delay=7e-4, filter=4e-4)),
    ),
    "ballscrew": (
        ("gravity", dict(sine=0.15, cosine=0.05, ratio=1.0)),
        ("gravity", dict(sine=0.1, cosine=-0.04, ratio=8.0)),
        ("external_spring", dict(stiffness=2.0, rest=0.05)),
        ("external_spring", dict(stiffness=0.5, rest=0.0)),
        ("dead_zone", dict(width=0.1)),
        ("dead_zone", dict(width=0.3)),
        ("coulomb_motor", dict(level=0.02, load=0.3)),
        ("coulomb_table", dict(level=0.01, load=0.2)),
        ("position_friction", dict(level=0.25, centre=0.0, width=0.05)),
        ("position_friction", dict(level=0.15, centre=0.05, width=0.03)),
        ("motor_mode", dict(inertia=2e-4, stiffness=32.0, damping=8e-3)),
        ("motor_mode", dict(inertia=1e-4, stiffness=6.25, damping=3e-3)),
        ("latch", dict(delay=1.1e-3)),
        ("latch", dict(delay=-6e-4)),
        ("latch", dict(filter=1.5e-3)),
    ),
}
TOLERANCE = dict(method="DOP853", rtol=1e-10, atol=1e-12)


class Plant:
    """The axis with one effect; state theta1, omega1, theta2, omega2, third angle and speed, filtered angles."""

    def __init__(self, base, effect, p):
        self.base, self.effect, self.p = base, effect, p
        self.dry = {"coulomb_motor": 0, "position_friction": 0, "coulomb_table": 1}.get(effect)

    def level(self, y, way):
        p = self.p
        if self.effect == "position_friction":
            return p["level"] * math.exp(-(((y[0] - p["centre"]) / p["width"]) ** 2))
        level = p["level"] + p["load"] * abs(self.transmitted(y))
        if "peak" in p:
            level *= (1 + p["asymmetry"] * way) * (1 + p["peak"] * math.exp(-((y[2 * self.dry + 1] / p["speed"]) ** 2)))
        return level

    def transmitted(self, y):
        return self.base["K"] * (y[0] - y[2]) + self.base["B"] * (y[1] - y[3])

    def pushes(self, y, torque):
        """Torques on motor and table without dry friction, and the acceleration of the third inertia."""
        p, t, a3 = self.p, self.transmitted(y), 0.0
        push = [torque - t, t]
        if self.effect == "gravity":
            angle = p["ratio"] * y[2]
            push[1] -= p["sine"] * math.sin(angle) + p["cosine"] * math.cos(angle)
        elif self.effect == "external_spring":
            push[1] -= p["stiffness"] * (y[2] - p["rest"])
        elif self.effect == "motor_mode":
            f = p["damping"] * (y[1] - y[5]) + p["stiffness"] * (y[0] - y[4])
            push[0] -= f
            a3 = f / p["inertia"]
        return push, a3

    def rate(self, y, torque, way):
        """`way`: +1 or -1 slips, 0 sticks, None without dry friction."""
        push, a3 = self.pushes(y, torque)
        a = [push[0] / self.base["I1"], push[1] / self.base["I2"]]
        if way is not None:
            i = self.dry
            a[i] = (push[i] - way * self.level(y, way)) / (self.base["I1"], self.base["I2"])[i] if way else 0.0
        tau = self.p.get("filter", 0.0) if self.effect == "latch" else 0.0
        behind = [(y[0] - y[6]) / tau, (y[2] - y[7]) / tau] if tau else [0.0, 0.0]
        return [y[1], a[0], y[3], a[1], y[5], a3, *behind]

    def excess(self, y, torque):
        """What the push is beyond the level at rest, with its way."""
        push = self.pushes(y, torque)[0][self.dry]
        way = 1 if push > 0 else -1
        return abs(push) - self.level(y, way), way

    def stretch(self, y, t0, t1, torque, way, dense):
        """From t0 to t1 under the function `torque`, through every stick and slip."""
        while t1 - t0 > 1e-15:
            events = []
            if way is not None:
                v = 2 * self.dry + 1
                if way == 0:
                    over, towards = self.excess(y, torque(t0))
                    if over > 0:
                        way = towards
                if way == 0:
                    event = lambda t, y: self.excess(y, torque(t))[0]
                    event.direction = 1
                else:
                    event = lambda t, y, way=way: y[v] * way if abs(y[v]) > 1e-14 or t - t0 > 1e-9 else 1e-14
                    event.direction = -1
                event.terminal = True
                events = [event]
            s = solve_ivp(lambda t, y: self.rate(y, torque(t), way), (t0, t1), y, events=events or None, dense_output=dense is not None, **TOLERANCE)
            assert s.success, s.message
            if dense is not None:
                dense.append((t0, s.t[-1], s.sol))
            y, t0 = s.y[:, -1].copy(), s.t[-1]
            if s.status == 1:
                if way == 0:
                    way = self.excess(y, torque(t0))[1]
                else:
                    y[v], way = 0.0, 0
        return y, way


def dead(torque, width):
    return torque - min(max(torque, -width), width)


def simulate(base, effect, p, samples, dt, hold, w0, dense=None):
    plant = Plant(base, effect, p)
    tau = p.get("filter", 0.0) if effect == "latch" else 0.0
    y = np.array([0.0, w0, 0.0, w0, 0.0, w0, -tau * w0, -tau * w0])
    way = None if plant.dry is None else (1 if w0 > 0 else -1)
    rows = [y]
    for k in range(SAMPLES - 1):
        t0, t1 = k * dt, (k + 1) * dt
        a, b = samples[k], samples[k] if hold == "zoh" else samples[k + 1]
        width = p["width"] if effect == "dead_zone" else 0.0
        torque = lambda t: dead(a + (b - a) * (t - t0) / dt, width) if width else a + (b - a) * (t - t0) / dt
        cuts = [t0] + sorted(t0 + dt * (e - a) / (b - a) for e in (-width, width) if width and (a - e) * (b - e) < 0) + [t1]
        for begin, end in zip(cuts, cuts[1:]):
            y, way = plant.stretch(y, begin, end, torque, way, dense)
        rows.append(y)
    return np.array(rows)


def look_up(dense, t, w0):
    if t <= 0:
        return w0 * t, w0 * t
    k = np.searchsorted([s[1] for s in dense], t)
    y = dense[min(k, len(dense) - 1)][2](t)
    return y[0], y[2]


def readings(base, effect, p, samples, dt, hold, w0):
    if effect != "latch":
        rows = simulate(base, effect, p, samples, dt, hold, w0)
        return rows[:, 0], rows[:, 2]
    dense = []
    delay, filtered = p.get("delay", 0.0), "filter" in p
    rows = simulate(base, effect, p, samples, dt, hold, w0, dense)
    if delay < 0:
        return rows[:, 0] - delay * rows[:, 1], rows[:, 2] - delay * rows[:, 3]
    if filtered and delay:
        ends = [s[1] for s in dense]
        tau = p["filter"]
        at = lambda t: dense[min(np.searchsorted(ends, t), len(dense) - 1)][2](t)[6:8] if t > 0 else [w0 * (t - tau)] * 2
        return np.array([at(k * dt - delay) for k in range(SAMPLES)]).T
    if filtered:
        return rows[:, 6], rows[:, 7]
    return np.array([look_up(dense, k * dt - delay, w0) for k in range(SAMPLES)]).T


def main():
    out = []
    for name, base, dt, hold, amplitude, (a, b, c) in AXES:
        t = np.arange(SAMPLES) * dt
        samples = amplitude * (np.sin(a * t) + 0.7 * np.sin(b * t) + 0.5 * np.sin(c * t))
        # So that the speed swings about zero: minus the mean of its integral.
        w0 = -amplitude / (base["I1"] + base["I2"]) * (1 / a + 0.7 / b + 0.5 / c)
        plain = readings(base, "none", {}, samples, dt, hold, w0)
        for effect, p in CASES[name]:
            seen = readings(base, effect, p, samples, dt, hold, w0)
            head = [effect, name, hold, *(f"{v:.17g}" for v in (dt, base["I1"], base["I2"], base["B"], base["K"], amplitude, a, b, c, w0))]
            out.append(" ".join(head + [f"{k}={v:.17g}" for k, v in p.items()]))
            out += [" ".join(f"{v:.10g}" for v in (seen[0][k], seen[1][k], plain[0][k], plain[1][k])) for k in range(0, SAMPLES, EVERY)]
            print(out[-SAMPLES // EVERY - 1], flush=True)
    path = pathlib.Path(__file__).with_suffix(".txt")
    path.write_text("# Written by scripts/oracles/further_effects.py, in the form of tests/plant/oracle.txt.\n" + "\n".join(out) + "\n")


if __name__ == "__main__":
    main()
