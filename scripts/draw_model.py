"""Draws modelDescription/model.png, the picture of the axis that every exported FMU carries.

Run by hand after a change, with a Python that has matplotlib 3.11.2: python scripts/draw_model.py
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import Circle, FancyArrowPatch, FancyBboxPatch, Rectangle

INK, MOTOR, TABLE, COUPLING = "#1a1a1a", "#4c78a8", "#72a66b", "#b5651d"

figure, axes = plt.subplots(figsize=(8, 3.2), dpi=125)
axes.set(xlim=(0, 16), ylim=(0, 6.4), aspect="equal")
axes.axis("off")


def body(x, label, colour, below):
    axes.add_patch(FancyBboxPatch((x, 2.2), 2.8, 2.2, boxstyle="round,pad=0.1", fc=colour, ec=INK, lw=1.5))
    axes.text(x + 1.4, 3.3, label, ha="center", va="center", color="white", fontsize=22, weight="bold")
    axes.text(x + 1.4, 1.55, below, ha="center", va="center", color=INK, fontsize=11)


def arrow(x0, x1, y, text):
    axes.add_patch(FancyArrowPatch((x0, y), (x1, y), arrowstyle="-|>", mutation_scale=16, lw=1.6, color=INK))
    axes.text((x0 + x1) / 2, y + 0.35, text, ha="center", fontsize=13, color=INK)


arrow(0.3, 2.5, 3.3, "$T$")
body(2.7, "$I_1$", MOTOR, "motor and screw")
body(10.3, "$I_2$", TABLE, "table")

# Spring above, damper below, between the two.
left, right = 5.6, 10.2
xs = [left, left + 0.7] + [left + 0.7 + 0.32 * (k + 0.5) for k in range(10)] + [right - 0.7, right]
ys = [3.9, 3.9] + [3.9 + (0.4 if k % 2 == 0 else -0.4) for k in range(10)] + [3.9, 3.9]
axes.plot(xs, ys, color=COUPLING, lw=2)
axes.text((left + right) / 2, 4.65, "$K$", ha="center", fontsize=15, color=COUPLING)
middle = (left + right) / 2
axes.plot([left, middle - 0.1], [2.7, 2.7], color=COUPLING, lw=2)
axes.plot([middle - 0.1, middle - 0.1], [2.42, 2.98], color=COUPLING, lw=2)
axes.plot([middle - 0.6, middle + 0.6, middle + 0.6, middle - 0.6], [3.12, 3.12, 2.28, 2.28], color=COUPLING, lw=2)
axes.plot([middle + 0.6, right], [2.7, 2.7], color=COUPLING, lw=2)
axes.text(middle, 1.7, "$B$", ha="center", fontsize=15, color=COUPLING)

arrow(2.9, 5.1, 5.1, r"$\theta_1,\ \omega_1,\ \alpha_1$")
arrow(10.5, 12.7, 5.1, r"$\theta_2,\ \omega_2,\ \alpha_2$")
axes.text(14.7, 3.3, r"$x_2 = \rho\,\theta_2$", ha="center", va="center", fontsize=14, color=INK)

# Guideway with rollers.
axes.plot([2.5, 13.3], [0.55, 0.55], color=INK, lw=1.5)
for x in range(25, 133, 4):
    axes.plot([x / 10, x / 10 - 0.25], [0.55, 0.3], color=INK, lw=0.7)
for x in (11.0, 12.4):
    axes.add_patch(Circle((x, 0.78), 0.22, fc="white", ec=INK, lw=1.2))
axes.add_patch(Rectangle((10.6, 1.0), 2.2, 0.12, fc=INK))

target = Path(__file__).parent.parent / "modelDescription" / "model.png"
# No date, no version of the library: the same picture gives the same bytes.
figure.savefig(target, metadata={"Software": None})
