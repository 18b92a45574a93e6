"""How an axis is moved: multisine torque in an open loop, or a drive along moves, stops, slow triangles, one direction only."""
from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

import plant
from axes import Machine, log_uniform

LOOPS = ("open", "moves", "moves_ff", "stops", "triangles", "one_way")
BEFORE, AFTER = 64, 8  # samples simulated before and after the record: what is late or early by some samples is true data
SUBSTEPS, SUBSTEPS_STIFF = 16, 64  # of smooth laws; of dry friction and contacts
EVENTS = {"fm_wd", "ft_wd", "fp_wd", "stop_hi", "stop_lo", "backlash"}
OFF_FROM = 2 / 3  # of the record: where a drive is switched off


@dataclass
class Run:
    """One record's motion: states (n x 4), command (n), torque of every effect (n x PARTS), reading noise that the drive saw (n)."""
    states: np.ndarray
    command: np.ndarray
    parts: np.ndarray
    reading: np.ndarray


@dataclass
class Motion:
    """An experiment that can be run with any plant parameters."""
    machine: Machine
    loop: str
    samples: int  # of the record
    command: np.ndarray  # whole length; zeros in a closed loop
    x0: np.ndarray
    hold: str = "zoh"
    aim: np.ndarray | None = None
    drive: plant.Drive | None = None
    facts: dict = field(default_factory=dict)

    @property
    def length(self) -> int:
        return BEFORE + self.samples + AFTER

    def run(self, params: dict, bias: float = 0.0, extra=None, reading=None) -> Run:
        """params: the plant's, machine included; bias: what the command holds against a load; extra as `plant.run`."""
        stiff = EVENTS & params.keys()
        drive, command = self.drive, self.command + bias * (self.command_on() if self.drive is None else 0.0)
        if drive is not None and bias:
            drive = plant.Drive(**{**drive.__dict__, "preload": bias})
        reading = np.zeros(self.length) if reading is None else reading
        states, command, parts = plant.run(params, command, self.machine.dt, x0=self.x0, t0=-BEFORE * self.machine.dt, hold=self.hold,
                                           substeps=SUBSTEPS_STIFF if stiff else SUBSTEPS, extra=extra, tell=True, drive=drive,
                                           aim=self.aim, reading=reading)
        return Run(states, command, parts, reading)

    def command_on(self) -> np.ndarray:
        on = np.ones(self.length)
        if self.facts.get("drive_off"):
            on[BEFORE + int(OFF_FROM * self.samples):] = 0.0
        return on

    @property
    def kept(self) -> slice:
        return slice(BEFORE, BEFORE + self.samples)


def _multisine(lines, amplitudes, phases, period, t):
    return np.cos(np.outer(t, 2 * np.pi * lines / period) + phases) @ amplitudes


def open_loop(machine: Machine, rng, samples: int, loudness: float, turning: bool, drive_off: bool) -> Motion:
    """A multisine (Schroeder, random or odd phases) up to some times the resonance, running before the record or from rest."""
    dt, n = machine.dt, samples
    period = min(n, 2048) * dt
    top = machine.band * {"seed": rng.uniform(3, 10), "rigid_stage": 1.0, "joint": 1.0}.get(machine.kind, rng.uniform(1.3, 2.0))
    top = min(top, 0.4 / dt)
    lines = np.arange(1, max(8, int(top * period)) + 1)
    kind = str(rng.choice(["schroeder", "random", "odd"]))
    if kind == "odd":
        lines = lines[::2]
    tilt = rng.uniform(0.5, 1.0) if turning or rng.random() < 0.5 else 0.0
    a = lines.astype(float) ** -tilt
    a *= loudness * machine.level / math.sqrt(np.sum(a**2) / 2)
    if kind == "schroeder":
        power = a**2 / np.sum(a**2)
        phases = -2 * np.pi * np.concatenate([[0.0], np.cumsum(np.cumsum(power))[:-1]]) + rng.uniform(0, 2 * np.pi)
    else:
        phases = rng.uniform(0, 2 * np.pi, lines.size)
    t = (np.arange(BEFORE + n + AFTER) - BEFORE) * dt
    cycle = int(round(period / dt))
    one = _multisine(lines, a, phases, period, np.arange(cycle) * dt)
    command = one[(np.arange(t.size) - BEFORE) % cycle]
    start = "rest" if rng.random() < 0.4 else "running"
    offset = np.array([1.0, 0.0, 1.0, 0.0]) * rng.uniform(-np.pi, np.pi) * (0.01 if machine.linear else 1.0)
    if start == "rest":
        command[:BEFORE] = 0.0
        x0 = offset
    elif machine.rigid:
        w = 2 * np.pi * lines / period
        q = a * np.exp(1j * (phases + w * t[0])) / (machine.base["I1"] * (1j * w) ** 2)
        x0 = offset + np.tile([np.sum(q.real), np.sum((1j * w * q).real)], 2)
    else:
        x0 = offset + plant.periodic_state(machine.base, lines, a, phases, period, t[0])
    facts = {"kind": kind, "lines": int(lines.size), "top_hz": top, "tilt": tilt, "start": start, "drive_off": drive_off}
    out = Motion(machine, "open", n, command, x0, "linear" if rng.random() < 0.2 else "zoh", facts=facts)
    out.command = command * out.command_on()
    return out


def acceleration(rng, length: int, dt: float, accel: float, loop: str, moves: float) -> np.ndarray:
    """Sampled acceleration of a sequence of moves (length): up, coast, down, dwell; `moves` is their rough number."""
    out = np.zeros(length)
    at, side = int(rng.uniform(0, 0.03) * length), 1.0
    if loop == "triangles":
        # Slow: one speed, reversed at once; the reversals are short beside the strokes.
        ramp = max(4, int(length / moves * 0.03))
        out[at:at + ramp] = 0.25 * accel
        at += ramp
        while at < length:
            stroke = int(length / moves * rng.uniform(0.8, 1.2))
            side = -side
            begin = at + stroke
            out[begin:begin + 2 * ramp] = side * 0.25 * accel
            at = begin + 2 * ramp
        return out
    place = 0.0
    while at < length:
        whole = length / moves * rng.uniform(0.6, 1.4)
        dwell = int(whole * (rng.uniform(0.5, 1.0) if loop == "stops" else rng.uniform(0.0, 0.15)))
        ramp = max(6, int(whole * rng.uniform(0.2, 0.4)))
        coast = int(whole * rng.uniform(0.0, 0.3))
        size = accel * rng.uniform(0.5, 1.0) * (1.0 if loop == "one_way" else side)
        if loop != "one_way":
            side = -1.0 if place + size > 0 else 1.0
        place += size
        out[at:at + ramp] += size
        out[at + ramp + coast:at + 2 * ramp + coast] -= size
        at += 2 * ramp + coast + dwell
    return out


def closed_loop(machine: Machine, rng, samples: int, loudness: float, loop: str, drive_off: bool, moves: float) -> Motion:
    """The drive along jerk-limited moves. Gains from the axis' own frequencies, as a service engineer sets them."""
    dt, n = machine.dt, samples
    length = BEFORE + n + AFTER
    accel = 1.5 * loudness * machine.level / machine.inertia
    until = BEFORE + int(0.6 * n) if drive_off else length
    a = acceleration(rng, until, dt, accel, loop, moves * (0.6 if drive_off else 1.0))
    jerk = max(3, int(rng.uniform(0.02, 0.06) * length / moves))
    a = np.convolve(a, np.ones(jerk) / jerk)[:until]
    speed = np.concatenate([np.cumsum(a) * dt, np.zeros(length - until)])
    if drive_off:  # come to rest before the switch, whatever move was cut short
        stop = min(n // 30 + 4, until)
        speed[until - stop:until] *= np.linspace(1, 0, stop)
    position = np.cumsum(speed) * dt
    aim = np.stack([position, speed, np.gradient(speed, dt)], axis=1)
    if machine.rigid:
        wv = log_uniform(rng, 30, 150)
    else:
        wv = math.sqrt(machine.base["K"] / machine.base["I2"]) * rng.uniform(0.4, 1.2)
    wv = min(wv, 0.12 / dt)
    kv = machine.inertia * wv
    forward = loop == "moves_ff"
    drive = plant.Drive(kp=wv * rng.uniform(0.15, 0.3), kv=kv, ki=kv * wv * rng.uniform(0.05, 0.2) if rng.random() < 0.8 else 0.0,
                        inertia=machine.inertia * rng.uniform(0.9, 1.1) if forward else 0.0,
                        speed_forward=rng.uniform(0.9, 1.0) if forward else 0.0,
                        limit=30 * machine.level, off=BEFORE + int(OFF_FROM * n) if drive_off else math.inf,
                        smooth=min(1.0, rng.uniform(4, 8) * wv * dt))
    facts = {"kp": drive.kp, "kv": drive.kv, "ki": drive.ki, "feed_forward": forward, "drive_off": drive_off}
    x0 = np.array([position[0], 0.0, position[0], 0.0])
    return Motion(machine, loop, n, np.zeros(length), x0, "zoh", aim, drive, facts)


def draw(machine: Machine, rng, loop: str, samples: int, loudness: float = 1.0, turning: bool = False, drive_off: bool = False,
         moves: float | None = None) -> Motion:
    """An experiment of one of LOOPS with `samples` samples; loudness scales the torque; moves: their rough number in a closed loop."""
    if loop == "open":
        return open_loop(machine, rng, samples, loudness, turning, drive_off)
    return closed_loop(machine, rng, samples, loudness, loop, drive_off, moves or rng.uniform(4, 10))
