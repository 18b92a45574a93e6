"""Oracle of crates/model/src/axis/tests.rs: the paper's axis under an exact zero-order hold, by scipy.

Writes scripts/oracles/axis_zoh.txt: theta1, omega1, theta2, omega2 after 40 steps of 5 ms, T(k) = 0.03*cos(k),
from theta1 = 0.1.
"""

import math
import pathlib

import numpy as np
from scipy.signal import cont2discrete

i1, i2, b, k = 2.37e-4, 6.07e-6, 5.4e-4, 1.76e-2
a = np.array([[0, 1, 0, 0], [-k / i1, -b / i1, k / i1, b / i1], [0, 0, 0, 1], [k / i2, b / i2, -k / i2, -b / i2]])
c = np.array([[0], [1 / i1], [0], [0]])
f, g, *_ = cont2discrete((a, c, np.eye(4), np.zeros((4, 1))), 5e-3, method="zoh")
x = np.array([0.1, 0.0, 0.0, 0.0])
for n in range(40):
    x = f @ x + g[:, 0] * 0.03 * math.cos(n)
path = pathlib.Path(__file__).with_suffix(".txt")
path.write_text("".join(f"{v:.17g}\n" for v in x))
