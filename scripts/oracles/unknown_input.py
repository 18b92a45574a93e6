"""Oracle of crates/estimation/src/diagnose/location/kalman.rs: the same Gaussian written out as one dense normal distribution.

The axis of the paper with unknown torques on motor and table that walk at random; theta1, omega1 and theta2 are read with
white noise. No filter here: the joint covariance of all states and all readings is built from the model's definition
(scipy's zero-order hold), the log-likelihood is scipy's multivariate normal, the smoothed state is the conditional mean.

Writes scripts/oracles/unknown_input.txt: the log-likelihood, then for samples 0, 20 and 39 the six states
[theta1, omega1, twist, twist rate, tau1, tau2] and their six standard deviations.
"""

import pathlib

import numpy as np
from scipy.signal import cont2discrete
from scipy.stats import Covariance, multivariate_normal

I1, I2, B, K = 2.37e-4, 6.07e-6, 5.4e-4, 1.76e-2
M = 1 / I1 + 1 / I2
DT, N = 5e-3, 40
A = np.array([[0, 1, 0, 0], [0, 0, -K / I1, -B / I1], [0, 0, 0, 1], [0, 0, -K * M, -B * M]])
C = np.array([[0, 0], [1 / I1, 0], [0, 0], [1 / I1, -1 / I2]])
f4, g, *_ = cont2discrete((A, C, np.eye(4), np.zeros((4, 2))), DT, method="zoh")
F = np.eye(6)
F[:4, :4] = f4
F[:4, 4:] = g
H = np.array([[1.0, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [1, 0, -1, 0, 0, 0]])
noise = np.array([1e-3, 2e-2, 2e-3])
walk = np.array([0, 0, 0, 0, 3e-4, 1e-4])
mean0 = np.array([0.05, 0, 0, 0, 0, 0])
std0 = np.array([0.2, 3.0, 0.5, 10.0, 0.02, 0.02])
k = np.arange(N)
torque = 0.01 * np.cos(0.3 * k)
readings = np.stack([0.05 + 0.02 * k**0.5, 0.3 * np.sin(0.2 * k), 0.05 + 0.019 * k**0.5], axis=1)

# Mean and covariance of all states.
mean = np.zeros((N, 6))
mean[0] = mean0
for j in range(N - 1):
    mean[j + 1] = F @ mean[j]
    mean[j + 1, :4] += g[:, 0] * torque[j]
P = [np.diag(std0**2)]
for _ in range(N - 1):
    P.append(F @ P[-1] @ F.T + np.diag(walk**2))
S = np.zeros((6 * N, 6 * N))
for i in range(N):
    block = P[i]
    for j in range(i, N):
        S[6 * i : 6 * i + 6, 6 * j : 6 * j + 6] = block.T if j > i else block
        S[6 * j : 6 * j + 6, 6 * i : 6 * i + 6] = block
        block = F @ block
HH = np.kron(np.eye(N), H)
cov = HH @ S @ HH.T + np.kron(np.eye(N), np.diag(noise**2))
residual = (readings - mean @ H.T).ravel()
log_likelihood = multivariate_normal(np.zeros(3 * N), Covariance.from_cholesky(np.linalg.cholesky(cov))).logpdf(residual)
gain = np.linalg.solve(cov, HH @ S).T
smoothed = mean.ravel() + gain @ residual
variance = np.diag(S - gain @ HH @ S)
lines = [f"{log_likelihood:.15g}\n"]
for j in (0, 20, 39):
    for v in np.concatenate([smoothed[6 * j : 6 * j + 6], np.sqrt(variance[6 * j : 6 * j + 6])]):
        lines.append(f"{v:.15g}\n")
pathlib.Path(__file__).with_suffix(".txt").write_text("".join(lines))
