"""Draws cases as generate.py does, on axes and under excitations that it does not draw: pseudo-random binary, chirp, point-to-point
moves and band-limited noise, from rest; resonance 8 to 250 Hz, damping ratio 0.008 to 0.25, inertias a hundredfold apart.

    .venv/bin/python scripts/blind/foreign.py --out DIR [--classes all] [--per-class 2] [--seed 21]

The program was never tuned on these: they tell how far what it has learnt reaches. run.py scores them as it does the others.
"""
from __future__ import annotations

import math
import sys

import numpy as np
from scipy.signal import butter, filtfilt

import generate
from generate import log_uniform

KINDS = {"prbs": 0.2, "chirp": 0.2, "steps": 0.2, "noise": 0.25, "multi": 0.15}
PERIODS = 7  # of the axis' `samples`, more than any record has
LINES = np.arange(1, 9)  # the seal counts them; these excitations have none


def draw_axis(kind: str, rng) -> generate.Axis:
    i1 = log_uniform(rng, 2e-5, 1e-2)
    i2 = i1 * log_uniform(rng, 0.1, 4.0)
    f, zeta = log_uniform(rng, 8, 250), log_uniform(rng, 0.008, 0.25)
    reduced, wn = 1 / (1 / i1 + 1 / i2), 2 * math.pi * f
    base = dict(I1=i1, I2=i2, B=2 * zeta * wn * reduced, K=wn**2 * reduced)
    dt = float(f"{1 / (log_uniform(rng, 15, 60) * f):.4g}")
    rho = float(rng.choice([1.0, 0.01 / (2 * math.pi)]))
    samples = int(rng.integers(1200, 2600))
    return generate.Axis(kind, base, rho, dt, samples, (i1 + i2) * log_uniform(rng, 100, 800) * (f / 80), f)


class Sampled:
    """A torque given by its values on a grid twice as fine as the samples, straight lines between."""

    lines, amplitudes, phases = LINES, np.ones(LINES.size), np.zeros(LINES.size)

    def __init__(self, kind: str, axis, rng, top: float, rms: float):
        self.kind, self.period = kind, axis.samples * axis.dt
        length, step = PERIODS * self.period, axis.dt / 2
        self.t = np.arange(int(length / step) + 200) * step
        u = SHAPES[kind](rng, self.t, step, length, top)
        u = u - np.mean(u)
        self.u = u * (rms / math.sqrt(np.mean(u**2)))

    def torque(self, t):
        return np.interp(t, self.t, self.u)


def prbs(rng, t, step, length, top):
    clock = max(1, round(1 / (1.5 * top) / step))
    return np.repeat(rng.choice([-1.0, 1.0], t.size // clock + 2), clock)[: t.size]


def chirp(rng, t, step, length, top):
    first = 2 / length
    rate = math.log(top / first)
    phase = 2 * np.pi * first * length / rate * (np.exp(np.clip(t / length, 0, 1) * rate) - 1)
    return np.sin(phase + rng.uniform(0, 6.28))


def moves(rng, t, step, length, top):
    """Accelerate, brake, wait; either way, rounded to the band."""
    u, at = np.zeros(t.size), 0
    while at < t.size:
        half = int(rng.uniform(0.02, 0.08) * t.size) // 2
        torque = rng.uniform(0.4, 1)
        u[at : at + half], u[at + half : at + 2 * half] = torque, -torque
        at += 2 * half + int(rng.uniform(0, 0.01) * t.size)
        rng.random()  # decides nothing; without it the set in RESULT.md would be another
        u[at - 2 * half : at] *= rng.choice([-1, 1])
    width = max(1, int(1 / (2 * top) / step))
    return np.convolve(u, np.ones(width) / width, "same")


def noise(rng, t, step, length, top):
    b, a = butter(2, min(0.9, 2 * top * step))
    return filtfilt(b, a, rng.standard_normal(t.size))


SHAPES = {"prbs": prbs, "chirp": chirp, "steps": moves, "noise": noise}
multisine, experiment_of = generate.draw_excitation, generate.experiment


def draw_excitation(axis, rng, kind, top, tilt, rms):
    other = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    if other == "multi":
        return multisine(axis, rng, kind, top, tilt, rms)
    return Sampled(other, axis, rng, top, rms)


def experiment(axis, ex, rng, periods, start, hold):
    start = "rest" if isinstance(ex, Sampled) else start
    return experiment_of(axis, ex, rng, periods * float(rng.choice([0.6, 0.83, 1.0])), start, hold)


generate.draw_axis, generate.draw_excitation, generate.experiment = draw_axis, draw_excitation, experiment

if __name__ == "__main__":
    sys.exit(generate.main())
