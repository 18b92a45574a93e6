"""The runner and the score, on a stand-in for the diagnosis that answers from a list."""
import json
import pathlib
import stat
import sys

import pytest
from scipy.stats import binomtest

import effects
import generate
import run
import score


def seal(**changes):
    fig = {"theta1": {"signal": 1.0, "before": 0.1, "oracle": 1e-4, "noise": 1e-4}}
    e = {"id": "coulomb_motor", "family": "dry_friction", "place": "motor", "size": 0.1, "variant": "plain",
         "gap_refit_over_noise": {"train": 50.0, "holdout": 50.0}}
    return {"case": "c1", "class": "coulomb_motor", "half": "tuning", "axis": "seed", "sensors": "both", "noise_rad": 1e-4,
            "verdict": "effect", "effects": [e], "figures": {"train": fig, "holdout": fig}} | changes


def answer(effect, closure=0.99, **changes):
    family, place = effects.FAMILY[effect]
    return {"verdict": "effect", "causes": [{"id": effect, "family": family, "place": place}], "ranking": [], "confusable": [],
            "gap": {"closure": closure}} | changes


def test_wilson_agrees_with_scipy():
    for hits, n in ((0, 20), (19, 20), (20, 20), (490, 500)):
        expected = binomtest(hits, n).proportion_ci(0.95, "wilson")
        assert score.wilson(hits, n) == pytest.approx((expected.low, expected.high), abs=1e-4)


def test_a_twin_of_the_same_family_is_right_by_family_only():
    row = score.judge(seal(), answer("presliding_table"), 1.0)
    assert row["family_right"] and not row["place_right"] and not row["id_right"]


def test_a_confusable_counts_only_in_its_own_column_and_is_proven_by_likelihood():
    a = answer("load_motor", confusable=[["load_motor", "coulomb_motor", "no reversals"]],
               ranking=[{"id": "load_motor", "delta_bic": 0.0}, {"id": "coulomb_motor", "delta_bic": 3.0}])
    row = score.judge(seal(), a, 1.0)
    assert not row["family_right"] and row["family_confusable"] and row["confusable_proven"]
    a["ranking"][1]["delta_bic"] = 300.0
    assert not score.judge(seal(), a, 1.0)["confusable_proven"]


def test_a_torque_gain_called_parameters_is_right_and_the_other_way_round():
    gain = seal(effects=[seal()["effects"][0] | {"id": "torque_gain", "family": "parameters", "place": "input"}])
    row = score.judge(gain, {"verdict": "parameters", "causes": []}, 1.0)
    assert row["family_right"] and row["place_right"]
    row = score.judge(seal(verdict="parameters", effects=[], **{"class": "parameters"}), answer("torque_gain"), 1.0)
    assert row["family_right"] and row["place_right"]


def test_a_cause_named_under_unexplained_counts_as_suspect_only():
    a = answer("coulomb_motor", verdict="unexplained", where={"place": "motor"})
    row = score.judge(seal(), a, 1.0)
    assert not row["family_right"] and row["suspect_right"] and row["where_right"]


def test_a_failed_diagnosis_is_wrong():
    row = score.judge(seal(), None, None)
    assert not row["family_right"] and row["told"] == "failed" and row["closure_of_oracle"] == 0.0


def test_an_effect_named_on_clean_data_is_a_false_alarm_and_parameters_is_not():
    quiet = seal(verdict="no_gap", effects=[], **{"class": "none"})
    rows = [score.judge(quiet, answer("backlash"), 1.0), score.judge(quiet, {"verdict": "parameters"}, 1.0),
            score.judge(quiet, {"verdict": "no_gap"}, 1.0)]
    s = score.summary(rows, [])
    assert s["false_alarms"]["none"]["hits"] == 1 and s["quiet_right"]["none"]["hits"] == 1


def test_abstention_is_excused_only_where_another_family_closes_the_gap():
    assert score.abstained(seal(), {"verdict": "unexplained"}) == "abstained"
    assert score.abstained(seal(), answer("load_motor", 0.96)) == "excused"
    assert score.abstained(seal(), answer("load_motor", 0.90)) == "wrong"
    assert score.abstained(seal(), None) == "failed"


def test_a_pair_needs_both_families():
    two = seal(effects=[seal()["effects"][0], seal()["effects"][0] | {"id": "delay", "family": "delay", "place": "input"}])
    both = answer("coulomb_motor")
    assert not score.judge(two, both, 1.0)["all_named"]
    both["causes"].append({"id": "delay", "family": "delay", "place": "input"})
    assert score.judge(two, both, 1.0)["all_named"] and score.judge(two, both, 1.0)["extra"] == 0


FAKE = """#!{python}
import json, sys, pathlib
a = sys.argv[1:]
assert a[0] == "diagnose" and pathlib.Path(a[1]).exists() and pathlib.Path(a[a.index("--holdout") + 1]).exists()
axis = pathlib.Path(a[a.index("--axis") + 1]).read_text()
out = pathlib.Path(a[a.index("--json") + 1])
table = json.loads(pathlib.Path({table!r}).read_text())
told = table[pathlib.Path.cwd().name]
if told is None:
    print("this one breaks", file=sys.stderr); sys.exit(2)
if "--without" in a:
    assert told["causes"][0]["id"] in a[a.index("--without") + 1].split(",")
    told = {{"verdict": "unexplained", "causes": []}}
out.write_text(json.dumps(told))
sys.exit(1)
"""


def test_generate_and_run_end_to_end_with_a_stand_in(tmp_path, capsys):
    assert generate.main(["--out", str(tmp_path), "--classes", "delay,none,viscous_table", "--per-class", "2", "--seed", "9"]) == 0
    index = json.loads((tmp_path / "seals/index.json").read_text())
    told, broken = {}, None
    for name, entry in index.items():
        told[name] = {"verdict": "no_gap", "causes": []} if entry["class"] == "none" else answer(entry["class"])
        if entry["class"] == "delay" and entry["half"] == "tuning":
            told[name], broken = None, name
        case = tmp_path / "cases" / name
        text = "".join(p.read_text() for p in case.iterdir())
        assert sorted(p.name for p in case.iterdir()) == ["axis.toml", "holdout.csv", "train.csv"]
        assert not any(e in text + name for e in effects.FAMILY)
    table = tmp_path / "told.json"
    table.write_text(json.dumps(told))
    fake = tmp_path / "eixo"
    fake.write_text(FAKE.format(python=sys.executable, table=str(table)))
    fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
    argv = ["--cases", str(tmp_path), "--eixo", str(fake), "--jobs", "2"]
    assert run.main(argv + ["--need", "family=0.7"]) == 0
    assert run.main(argv + ["--rescore", "--need", "family=0.9"]) == 1
    result = json.loads((tmp_path / "result.json").read_text())
    figures = result["figures"]
    assert figures["singles"]["family_right"]["hits"] == 3 and figures["singles"]["family_right"]["n"] == 4
    assert figures["failed"] == [broken]
    assert "breaks" in (tmp_path / "answers" / f"{broken}.err").read_text()
    assert figures["abstention"]["hits"] == 3 and figures["abstention"]["n"] == 4
    assert figures["false_alarms"]["none"] == {"hits": 0, "n": 2, "share": 0.0, "wilson": pytest.approx([0.0, 0.6576], abs=1e-3)}
    assert "| delay |" in (tmp_path / "result.md").read_text()
    capsys.readouterr()


def test_the_same_seed_writes_the_same_case(tmp_path):
    for sub in ("a", "b"):
        generate.main(["--out", str(tmp_path / sub), "--classes", "backlash", "--per-class", "1", "--seed", "4"])
    files = [sorted(p.relative_to(tmp_path / s) for p in (tmp_path / s).rglob("*") if p.is_file()) for s in ("a", "b")]
    assert files[0] == files[1]
    assert all((tmp_path / "a" / f).read_bytes() == (tmp_path / "b" / f).read_bytes() for f in files[0])
