"""The drive that closes the plant's loop: P on position, PI on speed, feed-forward, torque limit; one sample at a time."""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass
class Drive:
    """A cascaded drive: P on position, PI on speed, feed-forward; its encoder is the motor's. SI units.

    Torque = kv*e + integral of ki*e + inertia*a_ref, e = kp*(reference - reading) + speed_forward*w_ref - filtered speed.
    """
    kp: float  # 1/s
    kv: float  # N.m.s/rad
    ki: float  # N.m/rad
    inertia: float = 0.0  # feed-forward of the acceleration, kg.m2
    speed_forward: float = 0.0  # share of the reference's speed
    limit: float = math.inf  # N.m
    preload: float = 0.0  # integral at the start, N.m: a drive that already holds the axis
    off: float = math.inf  # sample from which the drive is off and a brake holds
    smooth: float = 1.0  # share of the new speed difference that the filter takes, 1 = none
    step: float = 0.0  # the encoder's step, rad

    def packed(self) -> np.ndarray:
        return np.array([self.kp, self.kv, self.ki, self.inertia, self.speed_forward, self.limit, self.preload, self.off,
                         self.smooth, self.step])


@njit(cache=True)
def sample(c, memory, command, aim, reading, k, dt):
    """One sample of the drive: P on position, PI on the filtered difference of the encoder, feed-forward, limit (c is `Drive.packed`)."""
    if c[9] > 0.0:
        reading = round(reading / c[9]) * c[9]
    if k == 0:
        memory[0] = reading
    speed = (reading - memory[0]) / dt
    memory[0] = reading
    memory[1] += c[8] * (speed - memory[1])
    error = c[0] * (aim[k, 0] - reading) + c[4] * aim[k, 1] - memory[1]
    integral = memory[2] + c[2] * dt * error
    wanted = c[1] * error + integral + c[3] * aim[k, 2]
    command[k] = min(max(wanted, -c[5]), c[5])
    if command[k] == wanted:  # the integral stands still at the limit
        memory[2] = integral
