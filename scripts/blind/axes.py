"""The axes of the second edition: the seed paper's, a ball screw, a belt, a rigid linear stage, a robot joint.

A rigid axis is one inertia for the plant and for its user; its plant parameters carry `rigid` and no I2, B, K.
"""
from __future__ import annotations

import math
from dataclasses import dataclass


KINDS = ("seed", "ballscrew", "rigid_stage", "belt", "joint")
RIGID = {"rigid_stage", "joint"}


@dataclass
class Machine:
    kind: str
    base: dict  # I1, I2, B, K, or I1 and rigid
    dt: float  # s
    level: float  # torque that moves the axis, rms [N.m; N on a linear axis]
    band: float  # Hz: the resonance, on a rigid axis the top of what is excited
    rho: float | None
    noise: tuple  # of the encoders, range [rad; m]
    step: tuple  # of coarse encoders, range

    @property
    def rigid(self) -> bool:
        return self.kind in RIGID

    @property
    def linear(self) -> bool:
        return self.kind == "rigid_stage"

    @property
    def inertia(self) -> float:
        return self.base["I1"] + self.base.get("I2", 0.0)

    @property
    def nominal(self) -> dict:
        return {k: v for k, v in self.base.items() if k != "rigid"}


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _two(i1, i2, f, zeta):
    reduced, wn = 1 / (1 / i1 + 1 / i2), 2 * math.pi * f
    return dict(I1=i1, I2=i2, B=2 * zeta * wn * reduced, K=wn**2 * reduced)


def draw(kind: str, rng, fast: bool = False, unlike: bool = False) -> Machine:
    """A machine of a kind. fast: resonance at 0.4 of the Nyquist frequency; unlike: inertias twentyfold apart (ball screw and belt)."""
    rotary = dict(noise=(1e-5, 1e-3), step=(2e-5, 1e-3))
    if kind == "seed":
        base = dict(I1=2.37e-4, I2=6.07e-6, B=5.4e-4, K=1.76e-2)
        wn = math.sqrt(base["K"] * (1 / base["I1"] + 1 / base["I2"]))
        dt = float(rng.choice([1, 2])) * 2 * math.pi * 10 / (2048 * wn)
        return Machine(kind, base, dt, rng.uniform(0.02, 0.05), wn / (2 * math.pi), 3.18e-4, **rotary)
    if kind in ("ballscrew", "belt"):
        screw = kind == "ballscrew"
        i1 = log_uniform(rng, 5e-4, 3e-3)
        i2 = i1 * (log_uniform(rng, 0.2, 2.0) if screw else log_uniform(rng, 0.5, 5.0))
        if unlike:
            i1, i2 = (i1, 20 * i1) if rng.random() < 0.5 else (20 * i1, i1)
        f = rng.uniform(50, 150) if screw else rng.uniform(6.5, 9.5)
        zeta = log_uniform(rng, 0.02, 0.1) if screw else log_uniform(rng, 0.005, 0.02)
        dt = float(f"{1 / ((5.0 if fast else rng.uniform(20, 30) if screw else rng.uniform(25, 60)) * f):.4g}")
        rate = rng.uniform(200, 600) if screw else rng.uniform(30, 150)
        rho = float(rng.choice([0.005, 0.01, 0.02])) / (2 * math.pi) if screw else float(rng.uniform(0.01, 0.03))
        return Machine(kind, _two(i1, i2, f, zeta), dt, (i1 + i2) * rate, f, rho, **rotary)
    dt = float(rng.choice([5e-4, 1e-3, 2e-3]))
    band = rng.uniform(8.0, 25.0)
    if kind == "rigid_stage":
        mass = log_uniform(rng, 5, 300)
        return Machine(kind, dict(I1=mass, rigid=1.0), dt, mass * rng.uniform(1, 6), band, None, (1e-7, 1e-5), (5e-7, 2e-5))
    if kind == "joint":
        inertia = log_uniform(rng, 1e-2, 5)
        return Machine(kind, dict(I1=inertia, rigid=1.0), dt, inertia * rng.uniform(8, 40), band, None, **rotary)
    raise ValueError(f"no such axis: {kind}; there are {', '.join(KINDS)}")


def sizing(machine: Machine) -> dict:
    """The base that effects are sized on: a rigid axis gets a second inertia and a spring to compare contacts and modes with."""
    if not machine.rigid:
        return machine.base
    i = machine.base["I1"]
    k = i * (2 * math.pi * 1.5 * machine.band) ** 2
    return dict(I1=i, I2=i, B=0.1 * math.sqrt(k * i), K=k)


def nominal_of(machine: Machine, rng, spread: float, some: bool) -> dict:
    """The user's model: parameters off by up to `spread`, of `some` each only with a chance of 60 %, and then by at least 5 %."""
    out = dict(machine.nominal)
    if some:
        off = {p: rng.uniform(0.05, spread) * rng.choice([-1, 1]) * (rng.random() < 0.6) for p in out}
        if not any(off.values()):
            off["I1"] = rng.uniform(0.05, spread)
    else:
        off = {p: rng.uniform(-spread, spread) for p in out}
    return {p: float(v * (1 + off[p])) for p, v in out.items()}


def toml(machine: Machine, nominal: dict, columns, hold: str, known: dict) -> str:
    """axis.toml as the user has it."""
    lines = ['name = "axis under test"']
    lines += ['structure = "rigid"'] if machine.rigid else []
    lines += ["", "[parameters]"] + [f"{k} = {float(v)!r}" for k, v in nominal.items()]
    lines += [f"rho = {machine.rho!r}"] if machine.rho else []
    lines += ["", "[units]", 'motion = "linear"'] if machine.linear else []
    lines += ["", "[signals]", 'time = "time"', f'T = {{ column = "T", hold = "{hold}" }}'] + [f'{c} = "{c}"' for c in columns]
    for effect, values in known.items():
        lines += ["", f"[effects.{effect}]"] + [f"{k} = {float(v)!r}" for k, v in values.items()]
    return "\n".join(lines) + "\n"
