"""The plant against closed formulas and scipy; every effect changes the trace and nothing else does."""
import math

import numpy as np
import pytest
from scipy.signal import cont2discrete

import effects
import generate
import plant
import visible

BASE = dict(I1=2.37e-4, I2=6.07e-6, B=5.4e-4, K=1.76e-2)
DT = 5.626e-4


def multisine(n=2048, rms=0.03, lines=60, seed=0):
    rng = np.random.default_rng(seed)
    t = np.arange(n) * DT
    h = np.arange(1, lines + 1)
    ph = rng.uniform(0, 2 * np.pi, lines)
    return rms * math.sqrt(2 / lines) * np.cos(np.outer(t, 2 * np.pi * h / (2048 * DT)) + ph).sum(axis=1)


@pytest.mark.parametrize("hold,method", [("zoh", "zoh"), ("linear", "foh")])
def test_the_linear_plant_equals_scipys_exact_discretisation(hold, method):
    torque = multisine()
    a, b = visible.matrices(BASE)
    if method == "zoh":
        f, g, *_ = cont2discrete((a, b[:, :1], np.eye(4), np.zeros((4, 1))), DT, "zoh")
        x, rows = np.zeros(4), []
        for u in torque:
            rows.append(x)
            x = f @ x + g[:, 0] * u
        expected = np.array(rows)
    else:
        from scipy.signal import lsim
        t = np.arange(torque.size) * DT
        _, _, expected = lsim((a, b[:, :1], np.eye(4), np.zeros((4, 1))), torque, t)
    got = plant.simulate(BASE, torque, DT, hold=hold)
    assert np.all(np.abs(got - expected).max(axis=0) < 1e-9 * np.abs(expected).max(axis=0) + 1e-11)


def test_an_undamped_free_axis_keeps_its_energy_and_momentum():
    p = BASE | {"B": 0.0}
    y = plant.simulate(p, np.zeros(4096), DT, x0=(0.1, 0.0, 0.0, 3.0))
    energy = 0.5 * p["I1"] * y[:, 1] ** 2 + 0.5 * p["I2"] * y[:, 3] ** 2 + 0.5 * p["K"] * (y[:, 0] - y[:, 2]) ** 2
    momentum = p["I1"] * y[:, 1] + p["I2"] * y[:, 3]
    assert np.ptp(energy) < 1e-9 * energy[0]
    assert np.ptp(momentum) < 1e-11 * abs(momentum[0])


def test_the_periodic_state_returns_after_one_period():
    lines, amps, phases = np.array([1, 3, 7]), np.array([0.01, 0.02, 0.01]), np.array([0.3, 1.0, 2.0])
    period = 2048 * DT
    t = np.arange(2049) * DT
    torque = (amps * np.cos(np.outer(t, 2 * np.pi * lines / period) + phases)).sum(axis=1)
    x0 = plant.periodic_state(BASE, lines, amps, phases, period, 0.0)
    y = plant.simulate(BASE, torque, DT, x0=x0, hold="linear")
    assert np.allclose(y[-1], y[0], atol=2e-5 * np.abs(y).max())


def test_a_stiff_bristle_sticks_below_its_level_and_slides_at_it_above():
    level = 0.01
    p = BASE | {"fm_c": level} | plant.stiff_bristle(BASE, "motor", level, DT)
    stuck = plant.simulate(p, np.full(2000, 0.99 * level), DT)
    assert np.abs(stuck[:, 0]).max() < 1e-5  # the finest encoder noise of the check
    torque = 3.0 * level
    y = plant.simulate(p, np.full(4000, torque), DT)
    rate = (y[-1, 1] - y[2000, 1]) / (1999 * DT)
    assert rate == pytest.approx((torque - level) / (BASE["I1"] + BASE["I2"]), rel=1e-6)


def test_friction_brings_a_coasting_axis_to_rest_where_the_formula_says():
    level, w0, total = 0.002, 20.0, BASE["I1"] + BASE["I2"]
    p = BASE | {"fm_c": level} | plant.stiff_bristle(BASE, "motor", level, DT)
    y = plant.simulate(p, np.zeros(8000), DT, x0=(0.0, w0, 0.0, w0))
    # Both inertias decelerate together; the twist's start-up transient costs B*twist' work of second order only.
    assert y[-1, 0] == pytest.approx(total * w0**2 / (2 * level), rel=2e-3)
    assert abs(y[-1, 1]) < 1e-9


def test_nothing_is_felt_through_the_gap_and_no_flank_pulls():
    gap = 0.05
    p = BASE | {"backlash": gap}
    y = plant.simulate(p, np.zeros(2000), DT, x0=(0.0, 1.0, 0.0, 0.0))
    twist = y[:, 0] - y[:, 2]
    inside = twist < gap * 0.98
    first = np.argmax(~inside)
    assert np.all(y[:first, 3] == 0.0) and np.all(y[:first, 1] == 1.0)
    # The positive flank only ever pushes the table forward, the negative one only back; in between nothing happens.
    push, middle = np.diff(y[:, 3]), 0.5 * (twist[1:] + twist[:-1])
    assert np.any(push > 0) and np.any(push < 0)
    assert np.all(push[middle > 0] >= 0) and np.all(push[middle < 0] <= 0)
    assert np.all(push[np.abs(middle) < 0.9 * gap] == 0)


def test_a_delayed_command_is_the_command_shifted_also_by_a_part_of_a_sample():
    shift = 2.37 * DT
    t = np.arange(1024) * DT
    torque = lambda time: 0.02 * time / t[-1]
    got = plant.simulate(BASE | {"delay": shift}, torque(t), DT, hold="linear")
    # Under a ramp that starts at zero, the delayed response is the plain one read `shift` earlier.
    plain = plant.simulate(BASE, torque(t), DT, hold="linear")
    late = plant.delayed(plain[:, 0], plain[:, 1], DT, shift)
    assert np.allclose(got[8:, 0], late[8:], atol=1e-9 * np.abs(late).max() + 1e-12)


def test_the_lag_follows_its_exponential():
    tau, step = 4 * DT, 0.03
    torque = np.concatenate([np.zeros(4), np.full(60, step)])
    p = dict(I1=1.0, I2=1e-3, B=0.0, K=1e-9, lag=tau)
    y = plant.simulate(p, torque, DT)
    t = np.arange(60) * DT
    expected = step * (t - tau * (1 - np.exp(-t / tau)))  # integral of step*(1 - exp(-t/tau)) over unit inertia
    assert np.allclose(y[4:, 1], expected, rtol=1e-7, atol=1e-15)


def test_the_coupling_loop_costs_its_area_each_cycle():
    # A heavy motor moves to and fro against a table held by inertia: Bouc-Wen at full saturation encloses 4*F*amplitude.
    force, reach = 0.01, 1e-3
    p = dict(I1=1.0, I2=1e9, B=0.0, K=1.0, hyst=force, hyst_x=reach, hyst_n=1.0)
    y = plant.simulate(p, np.zeros(4096), 2 * np.pi / 2048, x0=(1.0, 0.0, 0.0, 0.0))
    amplitude = [1.0, abs(y[1000:1100, 0].min()), y[2000:2100, 0].max()]
    lost = 0.5 * (amplitude[0] ** 2 - amplitude[2] ** 2)
    assert lost == pytest.approx(2 * force * (amplitude[0] + 2 * amplitude[1] + amplitude[2]) / 2, rel=0.02)


def reference(kind="seed", seed=3):
    rng = np.random.default_rng(seed)
    axis = generate.draw_axis(kind, rng)
    ex = generate.draw_excitation(axis, rng, "random", 4 * axis.resonance if kind == "seed" else 1.5 * axis.resonance, 0.8, axis.torque_rms)
    exp = generate.experiment(axis, ex, rng, 1.0, "running", "zoh")
    ref = effects.Reference(axis.base, axis.dt, exp.torque.size * axis.dt, exp.torque, exp.run(axis.base), 1 / ex.period,
                            axis.resonance * 2, axis.resonance, False)
    return axis, exp, ref


@pytest.mark.parametrize("kind", ["seed", "ballscrew"])
@pytest.mark.parametrize("effect", list(effects.FAMILY))
def test_every_effect_changes_the_trace(effect, kind):
    axis, exp, ref = reference(kind)
    draw = effects.draw(effect, ref, np.random.default_rng(5), 0.2)
    params, sensor, bias = generate.combine([draw])
    with_it = effects.measure(exp.run(axis.base | params, bias), axis.dt, sensor)
    plain = effects.measure(exp.run(axis.base, bias), axis.dt, {})
    change = max(effects.rms(with_it[c] - plain[c]) for c in ("theta1", "theta2"))
    assert np.isfinite(change) and change > 1e-5


@pytest.mark.parametrize("kind", ["seed", "ballscrew"])
@pytest.mark.parametrize("effect", ["coulomb_table", "backlash", "end_stop", "torque_ripple", "presliding_motor"])
def test_half_the_sub_step_changes_less_than_the_finest_encoder_noise_over_a_window(effect, kind):
    axis, exp, ref = reference(kind)
    draw = effects.draw(effect, ref, np.random.default_rng(5), 0.2)
    command = exp.torque[: visible.WINDOW] + draw.bias
    runs = [plant.simulate(axis.base | draw.plant, command, axis.dt, x0=exp.x0, substeps=n) for n in (80, 160)]
    assert np.abs(runs[0] - runs[1])[:, [0, 2]].max() < 1e-5


def test_a_wrong_base_parameter_vanishes_in_the_refit_and_friction_does_not():
    axis, exp, ref = reference()
    states = exp.run(axis.base)
    off = exp.run(axis.base | {"K": axis.base["K"] * 1.001, "I1": axis.base["I1"] * 0.999})
    left = visible.refit_residual(axis.base, axis.dt, states, off - states, [0, 2])
    assert effects.rms(left) < 0.02 * effects.rms((off - states)[:, [0, 2]])
    level = 0.1 * ref.torque_rms
    rub = exp.run(axis.base | {"fm_c": level} | plant.stiff_bristle(axis.base, "motor", level, axis.dt))
    left = visible.refit_residual(axis.base, axis.dt, rub, rub - states, [0, 2])
    assert effects.rms(left) > 1e-3


def test_the_size_of_lag_delay_and_saturation_is_their_share_of_the_rms_torque():
    _, _, ref = reference()
    rng = np.random.default_rng(1)
    for size in (0.05, 0.2, 0.5):
        lag = effects.draw("actuator_lag", ref, rng, size).plant["lag"]
        fine = np.repeat(ref.torque, 16)
        assert effects.rms(fine - effects.lagged(fine, ref.dt / 16, lag)) / ref.torque_rms == pytest.approx(size, rel=0.02)
        level = effects.draw("saturation", ref, rng, size).plant["sat"]
        assert effects.rms(ref.torque - np.clip(ref.torque, -level, level)) / ref.torque_rms == pytest.approx(size, rel=1e-6)
