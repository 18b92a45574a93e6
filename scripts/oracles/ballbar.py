#!/usr/bin/env python3
"""Writes the measured circular test of tests/data/ballbar_*.txt: a ballbar's export of a machine whose errors are known.

Each error is a displacement of the table, written from its definition and not from the shapes that eixo fits:
    x = R*cos(a at t - late)*(1 + scale) + lean*y - play_x/2*sign(vx) + ripple_x(x) + bow_y*(y/R)^2 + lateral_y/2*sign(vy)
    y likewise; spikes are radial, behind each reversal. Units: mm, um, s. Seeded.

    scripts/oracles/ballbar.py tests/data
"""

import sys
from pathlib import Path

import numpy as np

R = 100.0  # mm
FEED = 1000.0 / 60.0  # mm/s
N = 1800
UM = 1e-3

PLAY = {"x": 6.0, "y": 2.5}
SPIKES = [9.0, 5.0, 7.0, 4.0]  # um at +X, +Y, -X, -Y
SQUARENESS = 35.0  # um/m, X and Y enclose more than 90 degrees
SCALE = 24.0  # um/m that X is longer than Y
LATE = 0.3e-3  # s that X is behind Y
RIPPLE_X = (1.5, 10.0)  # um amplitude, mm pitch
BOW_X = 3.0  # um
LATERAL_Y = 2.0  # um
CENTRE = (0.062, -0.038)  # mm
NOISE = 0.15  # um


def turn(sense: float, rng: np.random.Generator) -> np.ndarray:
    rate = FEED / R
    t = 2.0 * np.pi / rate * np.arange(N) / N
    a = sense * rate * t
    x0, y0 = R * np.cos(rate * (t - LATE)), R * np.sin(a)
    vx, vy = -sense * np.sign(np.sin(a) + 1e-12), sense * np.sign(np.cos(a) + 1e-12)
    x = x0 * (1.0 + 0.5e-6 * SCALE) - 1e-6 * SQUARENESS * y0 - 0.5 * UM * PLAY["x"] * vx
    x += UM * RIPPLE_X[0] * np.sin(2.0 * np.pi * x0 / RIPPLE_X[1] + 0.4) + 0.5 * UM * LATERAL_Y * vy
    y = y0 * (1.0 - 0.5e-6 * SCALE) - 0.5 * UM * PLAY["y"] * vy + UM * BOW_X * (x0 / R) ** 2
    out = NOISE * UM * rng.standard_normal(N)
    for quarter, height in enumerate(SPIKES):
        behind = np.degrees(sense * ((a - quarter * np.pi / 2 + np.pi) % (2 * np.pi) - np.pi))
        u = np.clip(behind, 0.0, None) / 1.5
        out += UM * height * u * np.exp(1.0 - u)
    x, y = x + out * np.cos(a) + CENTRE[0], y + out * np.sin(a) + CENTRE[1]
    angle = np.degrees(np.arctan2(y, x)) % 360.0
    return np.column_stack([angle, np.hypot(x, y)])


def main() -> None:
    folder = Path(sys.argv[1])
    rng = np.random.default_rng(230)
    for sense, name in ((1.0, "ccw"), (-1.0, "cw")):
        rows = turn(sense, rng)
        lines = ["Ballbar export", f"Radius: {R:.1f} mm", f"Feedrate: {60 * FEED:.0f} mm/min", f"Run 1 {name.upper()}", ""]
        lines.append("Angle (deg)    Radius (mm)")
        lines += [f"{angle:11.4f}    {radius:11.5f}" for angle, radius in rows]
        (folder / f"ballbar_{name}.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
