"""The count of standard errors between what is told and what was sealed."""
import pytest

import intervals

SEAL = {"base": {"I1": 2.0}, "drawn": {"rest": "none"}, "effects": [{"plant": {"load_m": -3.0, "vm": 0.5}}]}
ANSWER = {"parameters": {"I1": {"fitted": 2.2, "std": 0.1}, "K": {"fitted": 1.0, "std": 0.1}},
          "causes": [{"id": "load_motor", "parameters": {"torque": {"value": 3.5, "std": 0.25}}},
                     {"id": "viscous_motor", "parameters": {"coefficient": {"value": 0.5, "std": None}}}]}


def test_errors_are_counted_in_standard_errors_with_the_sign_of_the_plant():
    told = dict(intervals.errors(SEAL, ANSWER, True))
    assert told.keys() == {"I1", "load_motor.torque"}  # no K was drawn, no error told of the drag
    assert abs(told["I1"] - 2.0) < 1e-9 and abs(told["load_motor.torque"] - 2.0) < 1e-9


def test_what_is_wrong_or_beside_a_moving_remainder_is_not_counted():
    assert intervals.errors(SEAL, ANSWER, False) == []
    assert intervals.errors(SEAL | {"drawn": {"rest": "jam"}}, ANSWER, True) == []
    assert intervals.errors(SEAL, None, True) == []


def test_of_one_direction_its_own_friction_is_the_truth():
    seal = {"base": {}, "drawn": {"rest": "none", "loop": "one_way"}, "effects": [{"plant": {"vm": 0.5, "vm_asym": 0.4}}]}
    cause = lambda value, **more: {"causes": [{"id": "viscous_motor", "parameters": {"coefficient": {"value": value, "std": 0.1}, **more}}]}
    assert dict(intervals.errors(seal, cause(0.8), True))["viscous_motor.coefficient"] == pytest.approx(1.0)
    both = {"asymmetry": {"value": 0.4, "std": 0.1}}
    assert dict(intervals.errors(seal, cause(0.6, **both), True))["viscous_motor.coefficient"] == pytest.approx(1.0)
    seal["drawn"]["loop"] = "moves"
    assert dict(intervals.errors(seal, cause(0.6), True))["viscous_motor.coefficient"] == pytest.approx(1.0)
