"""What `grafted.py` adds to a record, by closed forms."""

import grafted
import numpy as np

T = np.arange(0, 10, 1e-3)
X = np.sin(2.0 * T)


def test_speed_and_acceleration_are_those_of_the_sine():
    v, a = grafted.derivatives(T, X)
    inner = slice(100, -100)
    assert np.abs(v - 2.0 * np.cos(2.0 * T))[inner].max() < 1e-3
    assert np.abs(a + 4.0 * np.sin(2.0 * T))[inner].max() < 1e-2


def test_an_axis_at_rest_has_the_direction_of_its_last_motion():
    v = np.array([0.0, 1.0, 0.0, 0.0, -1.0, 0.0])
    assert grafted.direction(v).tolist() == [0.0, 1.0, 1.0, 1.0, -1.0, -1.0]


def test_what_the_axis_itself_may_take_is_not_visible():
    v, a = grafted.derivatives(T, X)
    torque = 3.0 * a + 0.1 * np.sin(40.0 * T)

    def seen(family, added):
        return grafted.visibility(family, added, T, X, v, a, torque)

    assert seen("torque_ripple", a) < 0.01
    # Of a sine a spring is an inertia; friction is none, where it is not asked beside itself.
    assert seen("external_spring", X) < 0.01
    assert seen("dry_friction", grafted.direction(v)) > 3.0


def test_a_delay_is_the_torque_some_samples_later():
    torque = np.sin(5.0 * T)
    late = grafted.effects(T, X, np.cos(T), torque)["delay"] + torque
    assert np.allclose(late[: -grafted.LATE], torque[grafted.LATE :], rtol=0, atol=1e-12)
