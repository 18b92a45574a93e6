"""Whether the standard errors of a diagnosis hold: how many of them lie between what it tells and what was sealed. Pure functions.

Counted are the axis' own parameters and the sizes of the causes that were named under their own name, of answers that are right. Not counted are
cases with something beside the sealed effects that moves (a jam, a mode, a wander, a warming): there the axis that fits best is another
one than the one it was drawn from.
"""
from __future__ import annotations

COVERED = 1.959964  # standard errors of a 95 % interval

# Parameter of a cause: its name and sign in the plant.
TRUTH = {
    ("viscous_motor", "coefficient"): ("vm", 1), ("viscous_table", "coefficient"): ("vt", 1),
    ("coulomb_motor", "level"): ("fm_c", 1), ("coulomb_table", "level"): ("ft_c", 1),
    ("presliding_motor", "level"): ("fm_c", 1), ("presliding_table", "level"): ("ft_c", 1),
    ("position_friction", "level"): ("fp_c", 1), ("quadratic_drag", "coefficient"): ("drag", 1),
    ("load_motor", "torque"): ("load_m", -1), ("load_table", "torque"): ("load_t", -1),
    ("backlash", "half_gap"): ("backlash", 1), ("cubic_stiffness", "k3"): ("k3", 1), ("stiffness_drift", "rate"): ("kdrift", 1),
    ("disturbance", "amplitude"): ("dist", 1), ("torque_ripple", "amplitude"): ("ripple", 1),
    ("gravity", "sine"): ("grav_s", 1), ("gravity", "cosine"): ("grav_c", 1), ("external_spring", "stiffness"): ("spring", 1),
    ("delay", "time"): ("delay", 1), ("actuator_lag", "time_constant"): ("lag", 1), ("saturation", "limit"): ("sat", 1),
    ("friction_drift", "viscous_rate"): ("vm_rate", 1),
}

# Asymmetry of a friction whose size differs with the direction.
ASYMMETRY = {"vm": "vm_asym", "vt": "vt_asym", "fm_c": "fm_asym", "ft_c": "ft_asym"}


def errors(seal: dict, answer: dict | None, right: bool) -> list[tuple[str, float]]:
    """(parameter, standard errors from the truth) of each value that is told with a standard error."""
    if not right or answer is None or (seal.get("drawn") or {}).get("rest") != "none":
        return []
    plant = {k: v for e in seal["effects"] for k, v in e["plant"].items()}
    told = [(name, p.get("fitted"), p.get("std"), seal["base"].get(name)) for name, p in (answer.get("parameters") or {}).items()]
    for cause in answer.get("causes") or []:
        for name, p in (cause.get("parameters") or {}).items():
            of, sign = TRUTH.get((cause.get("id"), name), (None, 1))
            truth = plant.get(of)
            if truth is not None and seal["drawn"].get("loop") == "one_way" and "asymmetry" not in cause["parameters"]:
                truth *= 1 + plant.get(ASYMMETRY.get(of), 0.0)  # of one direction a record tells that direction's alone
            told.append((f"{cause.get('id')}.{name}", p.get("value"), p.get("std"), None if truth is None else sign * truth))
    return [(name, abs(value - truth) / std) for name, value, std, truth in told if truth is not None and value is not None and std]
