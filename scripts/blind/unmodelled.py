"""What no library holds, at a low level beside a case's causes: a wandering torque, warming, a mode behind the motor, a jam."""
from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import butter, sosfilt

import effects

KINDS = ("wander", "warming", "mode", "jam")
SEVERAL = "several"  # as a machine has them: two to four of them at once
# An answer that names one of these for it names what is there, if under another law.
KIN = {"wander": set(), "warming": {"drift"}, "mode": {"flexible_mode"}, "jam": {"position_friction"},
       SEVERAL: {"drift", "flexible_mode", "position_friction"}}


@dataclass
class Rest:
    """A remainder: plant parameters and a sampled torque (length x 2, or None); `share` of the level that was drawn."""
    kind: str
    share: float
    plant: dict = field(default_factory=dict)
    extra: np.ndarray | None = None


def draw(kind: str, ref: effects.Reference, rng, share: float, length: int, params: dict, linear: bool, rigid: bool) -> Rest:
    """A remainder of rms about share * the level of `ref`; params are the plant's with all causes (warming needs friction there).

    A mode's size is an inertia, of 3 to 12 % of the motor's."""
    if kind == SEVERAL:
        return _several(ref, rng, share, length, params, linear, rigid)
    size = share * ref.torque_rms
    if kind == "warming" and ("vm" in params or "fm_c" in params):
        return Rest(kind, share, {"warm": rng.uniform(0.03, 0.12), "warm_tau": rng.uniform(0.2, 0.8) * ref.duration})
    if kind == "mode":
        i0 = rng.uniform(0.03, 0.12) * ref.base["I1"]
        f = rng.uniform(0.8, 2.0) * ref.resonance
        k = i0 * (2 * math.pi * f) ** 2
        return Rest(kind, share, {"I0": i0, "K0": k, "B0": 2 * rng.uniform(0.02, 0.1) * math.sqrt(k * i0)})
    if kind == "jam":
        at = rng.uniform(0.1, 0.8) * ref.duration
        return Rest(kind, share, {"jam": 4 * size, "jam_from": at, "jam_to": at + rng.uniform(0.02, 0.08) * ref.duration,
                                  "jam_speed": 0.05 * ref.w1_rms})
    # A torque that wanders: white noise through a low-pass between a hundredth and a tenth of the band.
    corner = min(0.4, 2 * ref.dt * ref.resonance * math.exp(rng.uniform(math.log(0.01), math.log(0.1))))
    x = sosfilt(butter(2, corner, output="sos"), rng.standard_normal(length + 2000))[2000:]
    x *= size / max(float(np.std(x)), 1e-300)
    on_table = (not rigid) and rng.random() < 0.5
    return Rest("wander", share, {}, np.stack([0 * x, x] if on_table else [x, 0 * x], axis=1))


def _several(ref: effects.Reference, rng, share: float, length: int, params: dict, linear: bool, rigid: bool) -> Rest:
    """A torque that wanders, and one to three of the others beside it."""
    others = [str(k) for k in rng.choice(KINDS[1:], int(rng.integers(1, 4)), replace=False)]
    parts = [draw(k, ref, rng, share, length, params, linear, rigid) for k in ("wander", *others)]
    plant = {k: v for p in parts for k, v in p.plant.items()}
    extra = sum(p.extra for p in parts if p.extra is not None)
    return Rest(SEVERAL, share, plant, extra)
