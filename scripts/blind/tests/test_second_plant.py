"""The second edition's effects in the plant against closed formulas and scipy, and its drive."""
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import plant

DT = 1e-3
RIGID = dict(I1=0.02, rigid=1.0)
TWO = dict(I1=2.37e-4, I2=6.07e-6, B=5.4e-4, K=1.76e-2)


def frequency(x, dt):
    """Of a swing about its mean, from its first and last upward crossings, straight between samples."""
    x = x - np.mean(x)
    k = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    at = k - x[k] / (x[k + 1] - x[k])
    return (k.size - 1) / ((at[-1] - at[0]) * dt)


def test_a_rigid_axis_is_a_double_integrator():
    rng = np.random.default_rng(0)
    torque = rng.standard_normal(500)
    y = plant.simulate(RIGID, torque, DT)
    w = np.concatenate([[0.0], np.cumsum(torque[:-1])]) * DT / RIGID["I1"]
    th = np.concatenate([[0.0], np.cumsum(w[:-1] * DT + 0.5 * torque[:-1] * DT**2 / RIGID["I1"])])
    assert np.allclose(y[:, 1], w, rtol=1e-12, atol=1e-12) and np.allclose(y[:, 0], th, rtol=1e-12, atol=1e-12)
    assert np.array_equal(y[:, 0], y[:, 2])


@pytest.mark.parametrize("base", [RIGID, RIGID | {"I1": 1.0}])
def test_gravity_swings_as_a_pendulum_and_keeps_its_energy(base):
    sine, ratio = 0.7, 1.5
    p = base | {"grav_s": sine, "grav_r": ratio}
    y = plant.simulate(p, np.zeros(20000), DT, x0=(1e-3, 0, 1e-3, 0))
    assert frequency(y[:, 0], DT) == pytest.approx(math.sqrt(sine * ratio / base["I1"]) / (2 * math.pi), rel=1e-5)
    y = plant.simulate(p, np.zeros(5000), DT, x0=(1.5, 0, 1.5, 0))
    energy = 0.5 * base["I1"] * y[:, 1] ** 2 - sine / ratio * np.cos(ratio * y[:, 0])
    assert np.ptp(energy) < 1e-7 * sine


def test_gravity_stands_where_sine_and_cosine_cancel():
    p = RIGID | {"grav_s": 0.3, "grav_c": 0.4, "grav_r": 1.0}
    at = -math.atan2(0.4, 0.3)
    y = plant.simulate(p, np.zeros(500), DT, x0=(at, 0, at, 0))
    assert np.abs(y[:, 0] - at).max() < 1e-12


def test_an_external_spring_swings_the_whole_axis_about_its_rest():
    k, rest = 3.0, 0.4
    y = plant.simulate(RIGID | {"spring": k, "spring_rest": rest}, np.zeros(8000), DT, x0=(0.5, 0, 0.5, 0))
    assert frequency(y[:, 0], DT) == pytest.approx(math.sqrt(k / RIGID["I1"]) / (2 * math.pi), rel=1e-5)
    assert np.allclose(y[:, 0] - rest, 0.1 * np.cos(math.sqrt(k / RIGID["I1"]) * np.arange(8000) * DT), atol=1e-4)


@pytest.mark.parametrize("effect", [
    {"spring": 5e-3, "spring_rest": 0.2}, {"grav_s": 0.01, "grav_c": -0.02, "grav_r": 1.0},
    {"I0": 3e-5, "K0": 0.05, "B0": 1e-4}, {"I0": 3e-5, "K0": 0.05, "B0": 1e-4, "spring": 1e-3},
])
def test_on_two_inertias_scipy_agrees(effect):
    p = {k: 0.0 for k in plant.NAMES} | TWO | effect
    torque = lambda t: 0.02 * math.sin(30.0 * t)

    def rhs(t, x):
        th1, w1, th2, w2, th0, w0 = x
        c = p["K"] * (th1 - th2) + p["B"] * (w1 - w2)
        back = p["K0"] * (th1 - th0) + p["B0"] * (w1 - w0)
        held = p["grav_s"] * math.sin(p["grav_r"] * th2) + p["grav_c"] * math.cos(p["grav_r"] * th2) + p["spring"] * (th2 - p["spring_rest"])
        return [w1, (torque(t) - c - back) / p["I1"], w2, (c - held) / p["I2"], w0, back / p["I0"] if p["I0"] else 0.0]

    dt, n = 2e-4, 2000
    t = np.arange(n) * dt
    exact = solve_ivp(rhs, (0, t[-1]), np.zeros(6), t_eval=t, rtol=1e-10, atol=1e-13, max_step=dt).y.T
    got = plant.simulate(TWO | effect, [torque(x) for x in t], dt, hold="linear")
    assert np.abs(got[:, :4] - exact[:, :4]).max() < 2e-5 * np.abs(exact[:, :4]).max()  # the straight lines between the torque's samples


def test_a_mode_behind_the_motor_swings_against_it_and_keeps_the_momentum():
    i0, k0 = 0.01, 40.0
    y = plant.simulate(RIGID | {"I0": i0, "K0": k0}, np.zeros(4000), DT, x0=(0.1, 2.0, 0.1, 2.0))
    assert np.allclose(y[:, 1], 2.0)  # together they drift on without a swing
    p = RIGID | {"I0": i0, "K0": k0}
    torque = np.zeros(4000)
    torque[0] = 5.0
    y = plant.simulate(p, torque, DT)
    total, mean = RIGID["I1"] + i0, 5.0 * DT / (RIGID["I1"] + i0)
    assert np.mean(y[1:, 1]) == pytest.approx(mean, rel=0.02) and total > 0
    assert frequency(y[1:, 1], DT) == pytest.approx(math.sqrt(k0 * (1 / i0 + 1 / RIGID["I1"])) / (2 * math.pi), rel=1e-3)


def test_nothing_passes_the_dead_zone_and_beyond_it_the_rest_does():
    p = RIGID | {"dead": 0.1}
    assert not np.any(plant.simulate(p, np.full(200, 0.0999), DT))
    y = plant.simulate(p, np.full(200, -0.3), DT)
    assert y[-1, 1] == pytest.approx(-0.2 / RIGID["I1"] * 199 * DT, rel=1e-12)


def test_a_tight_spot_costs_its_area_once_a_passage():
    level, width, w0 = 0.5, 0.05, 3.0
    b = plant.stiff_bristle(RIGID, "motor", level, DT)
    p = RIGID | {"fp_c": level, "fp_centre": 0.7, "fp_width": width} | {k.replace("fm_", "fp_"): v for k, v in b.items()}
    y = plant.simulate(p, np.zeros(700), DT, x0=(0.0, w0, 0.0, w0))
    assert y[-1, 0] > 1.2
    lost = 0.5 * RIGID["I1"] * (w0**2 - y[-1, 1] ** 2)
    assert lost == pytest.approx(level * width * math.sqrt(math.pi), rel=2e-3)


@pytest.mark.parametrize("load", [0.0, 0.3])
def test_friction_grows_with_the_torque_carried(load):
    level, factor = 0.05, 0.4
    b = plant.stiff_bristle(RIGID, "motor", level + factor * load, DT)
    y = plant.simulate(RIGID | {"fm_c": level, "fm_load": factor, "load_t": load} | b, np.full(400, 1.0), DT)
    rate = (y[-1, 1] - y[200, 1]) / (199 * DT)
    assert rate == pytest.approx((1.0 + load - level - factor * load) / RIGID["I1"], rel=1e-6)
    # Two inertias in steady acceleration a carry I2*a: (I1 + I2)*a = T - level - factor*I2*a.
    total, p = TWO["I1"] + TWO["I2"], TWO | {"fm_c": 0.004, "fm_load": 4.0} | plant.stiff_bristle(TWO, "motor", 0.004, 5e-4)
    y = plant.simulate(p, np.full(3000, 0.03), 5e-4)
    rate = (y[-1, 1] - y[2000, 1]) / (999 * 5e-4)
    assert rate == pytest.approx((0.03 - 0.004) / (total + 4.0 * TWO["I2"]), rel=1e-5)


def test_friction_that_only_the_load_makes_is_friction():
    b = plant.stiff_bristle(RIGID, "motor", 0.1, DT)
    y = plant.simulate(RIGID | {"fm_load": 0.5, "load_m": 0.2} | b, np.zeros(400), DT)
    rate = (y[-1, 1] - y[200, 1]) / (199 * DT)
    assert rate == pytest.approx((0.2 - 0.5 * 0.2) / RIGID["I1"], rel=1e-6)


def test_warming_and_a_jam_act_when_they_say():
    p = RIGID | {"vm": 0.1, "warm": 0.5, "warm_tau": 0.3}
    y, _, parts = plant.run(p, np.zeros(1000), DT, x0=(0, 2.0, 0, 2.0), tell=True)
    factor = -parts[:-1, plant.PARTS.index("vm")] / (0.1 * 0.5 * (y[1:, 1] + y[:-1, 1]))
    t = (np.arange(999) + 0.5) * DT
    assert np.allclose(factor, 1 + 0.5 * np.exp(-t / 0.3), rtol=1e-3)  # told at the start of each sub-step
    p = RIGID | {"jam": 0.2, "jam_from": 0.2, "jam_to": 0.4, "jam_speed": 0.01}
    y = plant.simulate(p, np.zeros(600), DT, x0=(0, 5.0, 0, 5.0))
    assert np.all(y[:200, 1] == 5.0) and y[-1, 1] == pytest.approx(5.0 - 0.2 * 0.2 / RIGID["I1"], rel=1e-3)
    assert np.ptp(y[402:, 1]) == 0.0


@pytest.mark.parametrize("base", [RIGID, dict(I1=1e-3, I2=5e-4, B=0.01, K=30.0)])
def test_the_parts_told_are_the_torque_that_the_inertias_feel(base):
    """Newton, independent of how the kernel sums: I*(change of speed) = command + parts - spring and damper, sample by sample."""
    rng = np.random.default_rng(1)
    torque = 0.5 * np.sin(np.arange(1500) * 0.02) + 0.1 * rng.standard_normal(1500)
    p = base | {"fm_c": 0.1, "vm": 0.02, "grav_s": 0.1, "grav_c": 0.05, "grav_r": 1.0, "ripple": 0.05, "ripple_order": 7.0, "spring": 0.2,
                "load_t": 0.03, "delay": 1.3e-3, "unb": 0.02, "drag": 1e-3} | plant.stiff_bristle(base, "motor", 0.1, 5e-4)
    extra = 0.02 * np.cumsum(rng.standard_normal((1500, 2)), axis=0) / 30
    dt = 5e-4
    y, command, parts = plant.run(p, torque, dt, tell=True, extra=extra)
    th1, w1, th2, w2 = y.T
    table = {"load_t", "drag", "ft", "vt", "dist", "unb", "stop", "mode3", "gravity", "spring", "extra_t"}
    of = lambda side: sum(parts[:-1, i] for i, n in enumerate(plant.PARTS) if (n in table) == side and n != "coupling")
    twist = th1 - th2
    mean = 0.5 * (twist[1:] + twist[:-1]) + dt / 12 * ((w1 - w2)[:-1] - (w1 - w2)[1:])
    c = 0.0 if "rigid" in base else base["K"] * mean + base["B"] * np.diff(twist) / dt
    if "rigid" in base:
        left, right = base["I1"] * np.diff(w1) / dt, command[:-1] + of(False) + of(True)
        assert np.abs(left - right).max() < 5e-3 * np.abs(left).max()
        return
    for left, right in ((base["I1"] * np.diff(w1) / dt, command[:-1] + of(False) - c), (base["I2"] * np.diff(w2) / dt, c + of(True))):
        assert np.abs(left - right).max() < 5e-3 * np.abs(left).max()


def test_a_drive_goes_where_it_is_told_and_holds_a_load():
    n = 3000
    aim = np.zeros((n, 3))
    aim[500:, 0] = 0.2
    drive = plant.Drive(kp=20, kv=2.0, ki=60.0)
    y, command, _ = plant.run(RIGID | {"load_t": 0.7}, np.zeros(n), DT, drive=drive, aim=aim)
    assert y[-1, 0] == pytest.approx(0.2, abs=1e-6) and command[-1] == pytest.approx(-0.7, rel=1e-6)
    limited, command, _ = plant.run(RIGID, np.zeros(n), DT, drive=plant.Drive(kp=20, kv=2.0, ki=60.0, limit=0.3), aim=aim)
    assert np.abs(command).max() == 0.3 and limited[-1, 0] == pytest.approx(0.2, abs=1e-4)
    # The command that it set moves the same axis in an open loop.
    again = plant.simulate(RIGID, command, DT)
    assert np.allclose(again, limited, atol=1e-9)


def test_a_drive_that_is_off_leaves_the_brake_to_hold():
    drive = plant.Drive(kp=20, kv=2.0, ki=60.0, off=100)
    y, command, _ = plant.run(RIGID | {"load_t": 0.7}, np.zeros(300), DT, drive=drive, aim=np.zeros((300, 3)))
    assert not np.any(command[100:]) and np.ptp(y[100:, 0]) == 0.0 and not np.any(y[100:, 1])
