"""The second edition's score: outcomes, probabilities, the runner on a stand-in for the diagnosis."""
import json
import stat
import sys
import xml.etree.ElementTree as ET

import pytest

import conditions
import effects
import outcome
import reliability
import run


def effect(eid, required=True, accepted=(), place=None):
    family, at = effects.KNOWN[eid]
    names = sorted({family, eid, *accepted})
    return {"id": eid, "family": family, "place": place or at, "accepted": names, "required": required, "gap_over_noise": 20.0}


def seal(group="single", true=("coulomb_motor",), **changes):
    verdict = {"healthy": "no_gap", "parameters": "parameters", "foreign": "unexplained"}.get(group, "effect")
    return {"case": "d1", "group": group, "half": "tuning", "axis": "seed", "sensors": "both", "conditions": ["loop open", "noise white"],
            "verdict": verdict, "effects": [e if isinstance(e, dict) else effect(e) for e in true], "tolerated": [], "bias": None,
            "parameters_over_noise": 0.0} | changes


def cause(eid, probability=0.95, place=None):
    family, at = effects.KNOWN[eid]
    return {"id": eid, "family": family, "place": place or at, "probability": probability}


def answer(*causes, verdict="effect", **more):
    return {"verdict": verdict, "causes": list(causes)} | more


def told(s, a):
    return outcome.outcome(s, a)[0]


def test_every_outcome_of_a_sick_axis():
    two = seal("two", ("coulomb_motor", "gravity"))
    both = (cause("coulomb_motor"), cause("gravity"))
    assert told(two, answer(*both)) == "right"
    assert told(two, answer(*both, remainder={"noise_multiple": 5.0})) == "right with remainder"
    assert told(two, answer(*both, remainder={"noise_multiple": 1.2})) == "right"
    assert told(two, answer(both[0])) == "incomplete"
    assert told(two, answer(*both, cause("delay"))) == "extra"
    assert told(two, answer(both[0], cause("delay"))) == "wrong"
    assert told(two, answer(*both, verdict="unexplained")) == "unexplained"
    assert told(two, answer(verdict="no_gap")) == told(two, answer(verdict="parameters")) == "missed"
    assert told(two, None) == told(two, {}) == "failed"


def test_a_family_is_enough_and_a_sealed_twin_is_right():
    assert told(seal(), answer(cause("presliding_table"))) == "right"
    assert told(seal(true=("delay",)), answer(cause("latch"))) == "wrong"
    assert told(seal(true=(effect("delay", accepted=["latch"]),)), answer(cause("latch"))) == "right"


def test_a_small_true_cause_need_not_be_named_and_may_be():
    s = seal("machine", ("coulomb_motor", effect("torque_ripple", required=False)))
    assert told(s, answer(cause("coulomb_motor"))) == told(s, answer(cause("coulomb_motor"), cause("torque_ripple"))) == "right"


def test_what_a_condition_brings_is_not_wrong_but_alone_not_right():
    s = seal(tolerated=["delay", "latch", "sensor"])
    assert told(s, answer(cause("coulomb_motor"), cause("delay"))) == "right"
    assert told(s, answer(cause("delay"))) == "incomplete"
    healthy = seal("healthy", (), tolerated=["latch"])
    assert told(healthy, answer(cause("latch"))) == "right" and told(healthy, answer(cause("latch"), cause("backlash"))) == "false alarm"


def test_a_healthy_axis():
    s = seal("healthy", ())
    assert told(s, answer(verdict="no_gap")) == told(s, answer(verdict="parameters")) == told(s, answer(cause("torque_gain"))) == "right"
    assert told(s, answer(cause("backlash"))) == "false alarm" and told(s, answer(verdict="unexplained")) == "unexplained"
    off = seal("parameters", (), parameters_over_noise=40.0)
    assert told(off, answer(verdict="no_gap")) == "missed" and told(off, answer(verdict="parameters")) == "right"
    assert told(seal("parameters", (), parameters_over_noise=1.0), answer(verdict="no_gap")) == "right"
    assert told(seal("healthy", (), bias={"id": "load_motor"}, tolerated=["load_torque"]), answer(verdict="no_gap")) == "missed"


def test_a_remainder_alone_is_unexplained():
    s = seal("foreign", ())
    assert told(s, answer(verdict="unexplained")) == "right" and told(s, answer(cause("backlash"))) == "wrong"
    assert told(s, answer(verdict="no_gap")) == "missed"


def test_confidently_wrong_counts_false_causes_told_at_nine_in_ten_under_the_verdict_effect():
    judge = lambda *a, **k: outcome.judge(seal(), answer(*a, **k), 1.0)
    assert judge(cause("coulomb_motor"), cause("delay", 0.91))["confidently_wrong"]
    assert not judge(cause("coulomb_motor"), cause("delay", 0.89))["confidently_wrong"]
    assert not judge(cause("delay", 0.99), verdict="unexplained")["confidently_wrong"]
    assert not judge(cause("coulomb_table", 1.0))["confidently_wrong"]


def test_on_a_rigid_axis_the_place_is_the_axis():
    s = seal(true=(effect("coulomb_motor", place="axis"),))
    assert outcome.judge(s, answer(cause("coulomb_motor")), 1.0)["places"] == [False]
    assert outcome.judge(s, answer(cause("coulomb_motor", place="axis")), 1.0)["places"] == [True]


def test_the_summary_counts_and_the_tables_show_it():
    rows = [outcome.judge(seal(), answer(cause("coulomb_motor")), 2.0, 50.0), outcome.judge(seal(), answer(cause("delay")), 4.0, 70.0),
            outcome.judge(seal("healthy", ()), answer(cause("delay", 0.5)), 1.0, 30.0),
            outcome.judge(seal("healthy", ()), answer(verdict="no_gap"), 1.0, 30.0)]
    s = outcome.summary(rows)
    assert s["right"]["hits"] == 2 and s["confidently_wrong"]["hits"] == 1 and s["false_alarms"]["hits"] == 1 and s["false_alarms"]["n"] == 2
    assert s["healthy"]["share"] == 0.5 and s["verdict_exact"]["hits"] == 1 and s["by"]["condition"]["loop open"]["n"] == 4
    assert s["seconds"] == {"median": 1.5, "max": 4.0} and s["memory_mb"]["max"] == 70.0
    text = outcome.markdown(s, rows, "t", "r.svg")
    assert "| all conditions together right | 50.0 % (2/4" in text and "wrong (sure)" in text and "r.svg" in text
    assert outcome.check("right=0.4", s) is None and "at least 0.6" in outcome.check("right=0.6", s)
    assert outcome.check("false_alarms=0.5", s) is None and "at most" in outcome.check("ece=0.01", s)
    with pytest.raises(ValueError, match="there are"):
        outcome.check("nothing=1", s)


def test_with_a_family_withheld_what_is_named_in_its_place_is_false_and_the_others_are_right():
    two = seal("two", ("coulomb_motor", "gravity"))
    assert [outcome.to_withhold(two, turn)["id"] for turn in range(3)] == ["coulomb_motor", "gravity", "coulomb_motor"]
    answers = (answer(cause("gravity", 0.9)), answer(cause("gravity", 0.8), cause("viscous_motor", 0.95)), answer(verdict="unexplained"), None)
    w = outcome.withheld([outcome.judge(two, a, None) for a in answers])
    assert [w[key]["hits"] for key in ("nothing_false", "confidently_wrong", "unexplained")] == [2, 1, 1]
    assert w["nothing_false"]["n"] == 3 and w["calibration"]["n"] == 3


def test_the_calibration_error_is_the_weighted_distance_from_the_diagonal():
    pairs = [(0.92, True)] * 9 + [(0.92, False)] + [(0.55, True)] * 2 + [(0.55, False)] * 8 + [(1.0, True)] * 5
    t = reliability.table(pairs)
    assert t["n"] == 25 and [b["n"] for b in t["bins"]] == [10, 10, 5]
    assert t["ece"] == pytest.approx((10 * 0.02 + 10 * 0.35 + 0.0) / 25)
    assert reliability.table([])["ece"] is None
    for table in (t, reliability.table([])):
        assert ET.fromstring(reliability.svg(table)).tag.endswith("svg")
    assert reliability.svg(t).count("<circle") == 3


FAKE = """#!{python}
import json, sys, pathlib
a = sys.argv[1:]
told = json.loads(pathlib.Path({table!r}).read_text())[pathlib.Path.cwd().name]
if told is None:
    import time; time.sleep(60)
pathlib.Path(a[a.index("--json") + 1]).write_text(json.dumps(told))
sys.exit(1)
"""


def test_draw_run_and_score_with_a_stand_in(tmp_path, capsys):
    assert conditions.main(["--out", str(tmp_path), "--cases", "6", "--seed", "3"]) == 0
    index = json.loads((tmp_path / "seals/index.json").read_text())
    table = {}
    for name in index:
        s = json.loads((tmp_path / "seals" / f"{name}.json").read_text())
        table[name] = answer(*({"id": e["id"], "family": e["family"], "place": e["place"], "probability": 0.97} for e in s["effects"]),
                             verdict={"healthy": "no_gap"}.get(s["group"], s["verdict"]))
    slow = next(n for n in index if index[n]["class"] == "healthy")
    table[slow] = None
    (tmp_path / "told.json").write_text(json.dumps(table))
    fake = tmp_path / "eixo"
    fake.write_text(FAKE.format(python=sys.executable, table=str(tmp_path / "told.json")))
    fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
    argv = ["--cases", str(tmp_path), "--eixo", str(fake), "--jobs", "2", "--timeout", "5"]
    assert run.main(argv + ["--need", "right=0.8"]) == 0
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["figures"]["all"]["right"] == 5 and result["figures"]["failed"] == [slow]
    cut = next(r for r in result["cases"] if r["case"] == slow)
    assert cut["seconds"] is None and "cut off" in (tmp_path / "answers" / f"{slow}.err").read_text()
    assert all(r["memory_mb"] > 1 for r in result["cases"]) and (tmp_path / "reliability.svg").exists()
    # The stand-in names the cause however much of the library is taken away: then it has an answer of its own for each case with causes.
    assert run.main(argv + ["--withheld", "--rescore"]) == 0
    of = [n for n in index if json.loads((tmp_path / "seals" / f"{n}.json").read_text())["effects"]]
    assert sorted(p.name.split(".")[0] for p in (tmp_path / "answers").glob("*.without.json")) == sorted(of)
    assert json.loads((tmp_path / "result.json").read_text())["figures"]["withheld"]["unexplained"]["n"] == len(of)
    assert "a family withheld: nothing false named" in (tmp_path / "result.md").read_text()
    some = index[slow]["conditions"][0]
    assert run.main(argv[:-2] + ["--rescore", "--timeout", "1", "--axes", index[slow]["axis"], "--conditions", some, "--need", "right=1"]) == 1
    assert run.main(argv + ["--only", "nothing"]) == 2
    capsys.readouterr()
