"""From true states to what a log holds: late or filtered encoders, noise of several kinds, coarse steps, spikes, held samples, jitter.

Everything that a log does to a record beside its machine is here; none of it is a cause (README.md, "Conditions").
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

import effects
import motion

NOISES = ("white", "pink", "coarse", "spikes", "held", "jitter_stamped", "jitter_unstamped")
FINE = 8  # points a sample of the anti-alias filter


@dataclass
class Log:
    """The conditions of a log, drawn once a case; lengths in samples of the record."""
    noise: str
    sigma: float  # rad or m
    step: float = 0.0
    jitter: float = 0.0  # rms of the sampling instants over dt
    torque_noise: float = 0.0  # over the rms of the logged torque
    shift: float = 0.0  # samples by which the encoders are late (positive) or early against the torque
    filter: float = 0.0  # time constant of both encoders' anti-alias filter, samples


def pink(rng, n: int) -> np.ndarray:
    """Noise of unit rms whose power falls as 1/f down to one period a record, a fifth of its power white."""
    shape = np.fft.rfftfreq(n)
    shape[0] = np.inf
    x = np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) / np.sqrt(shape), n)
    return math.sqrt(0.8) * x / np.std(x) + math.sqrt(0.2) * rng.standard_normal(n)


def at(position, speed, dt: float, index) -> np.ndarray:
    """The position at fractional samples, by cubic Hermite interpolation."""
    k = np.clip(np.floor(index).astype(int), 0, position.size - 2)
    s = index - k
    p0, p1, m0, m1 = position[k], position[k + 1], speed[k] * dt, speed[k + 1] * dt
    return (2 * s**3 - 3 * s**2 + 1) * p0 + (s**3 - 2 * s**2 + s) * m0 + (3 * s**2 - 2 * s**3) * p1 + (s**3 - s**2) * m1


def filtered(position, speed, dt: float, tau: float) -> np.ndarray:
    """First-order low-pass (time constant tau, in samples) of the position at the samples; exact for straight lines between FINE points."""
    fine = at(position, speed, dt, np.arange((position.size - 1) * FINE + 1) / FINE)
    a = math.exp(-1.0 / (FINE * tau))
    g = FINE * tau * (1.0 - a)  # share of the old point: x+ = a*x + (1-g)*u+ + (g-a)*u
    start = fine[0] - speed[0] * dt * tau  # as if it had run at this speed before
    y, _ = lfilter([1.0 - g, g - a], [1.0, -a], fine, zi=[start - (1.0 - g) * fine[0]])
    return y[::FINE]


def seen(run: motion.Run, dt: float, sensor: dict, log: Log, instants) -> dict:
    """Noise-free readings (th1, w1, th2, w2 over the record) at `instants` (fractional samples of the whole run), with the sensors' effects and the log's."""
    out = {}
    late = log.shift + sensor.get("latch", 0.0) / dt
    tau = math.hypot(log.filter, sensor.get("filter", 0.0) / dt)
    for name, p, s in (("theta1", 0, 1), ("theta2", 2, 3)):
        position, speed = run.states[:, p], run.states[:, s]
        delay = late + (sensor.get("delay2", 0.0) / dt if p == 2 else 0.0)
        if tau > 0.0:
            position = filtered(position, speed, dt, tau)
        x = at(position, speed, dt, instants - delay)
        if p == 2:
            if "lead" in sensor:
                x = x + sensor["lead"] * np.sin(sensor["lead_order"] * x + sensor["lead_phase"])
            x = x * sensor.get("scale2", 1.0)
        out[name] = x
        out["omega" + name[-1]] = np.interp(instants - delay, np.arange(speed.size), speed)
    return out


def record(run: motion.Run, dt: float, sensor: dict, log: Log, m: motion.Motion, columns, rng) -> tuple[dict, dict, np.ndarray]:
    """The log: (columns by name, noise-free positions of the same effects without the log's conditions, good samples).

    A sample is good unless it is a spike or held. What the log adds to a position is the first less the second."""
    kept, n = m.kept, m.samples
    whole = np.arange(kept.start, kept.stop, dtype=float)
    moved = np.clip(log.jitter * rng.standard_normal(n), -3 * log.jitter, 3 * log.jitter)
    table = {"time": np.arange(n) * dt}
    if log.noise == "jitter_stamped":
        table["time"] = (np.arange(n) + moved - moved[0]) * dt
    torque = run.command[kept]
    scatter = rng.standard_normal(n)
    table["T"] = torque + log.torque_noise * effects.rms(torque) * scatter
    quiet = seen(run, dt, sensor, Log(log.noise, log.sigma), whole)
    loud = seen(run, dt, sensor, log, whole + moved)
    good = np.ones(n, dtype=bool)
    if log.noise == "spikes":
        good[rng.choice(np.arange(2, n), max(2, int(0.001 * n)), replace=False)] = False
    held = np.zeros(n, dtype=bool)
    if log.noise == "held":
        held[rng.choice(np.arange(2, n), max(2, int(0.003 * n)), replace=False)] = True
        good &= ~held
    for c in columns:
        if c.startswith("omega"):
            table[c] = loud[c] + 3e-3 * effects.rms(run.states[kept, 1]) * rng.standard_normal(n)
            continue
        x = loud[c]
        if m.drive is not None and c == "theta1":
            x = x + run.reading[kept]  # the drive's own reading is what is logged
        else:
            x = x + log.sigma * (pink(rng, n) if log.noise == "pink" else rng.standard_normal(n))
        if log.step:
            x = np.round(x / log.step) * log.step
        if log.noise == "spikes":
            bad = np.flatnonzero(~good)
            height = np.exp(rng.uniform(math.log(20), math.log(1000), bad.size))
            x[bad] += log.sigma * height * rng.choice([-1, 1], bad.size)
        for k in np.flatnonzero(held):
            x[k] = x[k - 1]
        table[c] = x
    return table, quiet, good
