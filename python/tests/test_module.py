"""The Python module: its tables are the program's numbers, its arrays those of another importer, its errors the program's words."""
import csv
import os
import re
import tempfile

import numpy as np
import pandas as pd
import pytest

import eixo

AXIS = {"name": "X <axis>", "parameters": {"I1": 2.37e-4, "I2": 6.07e-6, "B": 5.4e-4, "K": 1.76e-2, "rho": 3.18e-4}}
LEVEL = 0.004
NOISE = 1e-4


@pytest.fixture(scope="session")
def excitation(tmp_path_factory):
    path = tmp_path_factory.mktemp("excitation") / "u.csv"
    assert "2048 samples" in eixo.run("excite", "-o", path, "--kind", "odd")
    return path


def recorded(excitation, settings):
    """A record of positions with the noise of encoders."""
    run = eixo.simulate(AXIS, excitation, settings=settings, outputs=["theta1", "theta2"])
    noise = np.random.default_rng(7).normal(0.0, NOISE, (2, len(run["time"])))
    return pd.DataFrame({**run, "theta1": run["theta1"] + noise[0], "theta2": run["theta2"] + noise[1]})


@pytest.fixture(scope="session")
def record(excitation):
    return recorded(excitation, {"coulomb_motor.level": LEVEL})


@pytest.fixture(scope="session")
def diagnosis(record):
    return eixo.diagnose(record, AXIS)


@pytest.fixture
def own_temporary_folder(tmp_path, monkeypatch):
    """A temporary folder that nothing else uses, and a working folder that is empty."""
    (tmp_path / "temporary").mkdir()
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    return tmp_path


def test_the_hidden_friction_is_the_cause_and_its_level_within_the_told_error(diagnosis):
    assert diagnosis.verdict == "effect"
    assert list(diagnosis.causes["id"]) == ["coulomb_motor"]
    assert diagnosis.causes["place"][0] == "motor" and diagnosis.causes["probability"][0] > 0.9
    found = diagnosis.parameters.set_index("parameter")
    level = found.loc["coulomb_motor.level"]
    assert abs(level["value"] - LEVEL) < 5 * level["std"] and level["std"] < 0.01 * LEVEL
    assert (found.loc["I1", "nominal"], found.loc["I1", "unit"]) == (2.37e-4, "kg.m2")
    gap = diagnosis.gap.set_index("model")
    assert gap.loc["after", "holdout"] < 0.01 * gap.loc["before", "holdout"]
    assert diagnosis.remainder["torque_rms"] < 0.01 * LEVEL


def test_a_table_and_its_file_give_the_same_result_to_the_bit(record, diagnosis, tmp_path):
    path, axis = tmp_path / "log.csv", tmp_path / "axis.toml"
    record.to_csv(path, index=False)
    axis.write_text('name = "X <axis>"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n')
    assert eixo.diagnose(path, axis).data == diagnosis.data


def test_the_result_shows_itself(diagnosis, tmp_path):
    assert diagnosis.report.startswith("<!DOCTYPE html>") and "trace.csv" in diagnosis.report
    assert diagnosis.report.save(tmp_path / "d.html").read_text(encoding="utf-8") == diagnosis.report
    assert "coulomb_motor" in diagnosis._repr_html_() and diagnosis.data["sentence"].split(" (")[0] in diagnosis._repr_html_()
    assert repr(diagnosis).startswith("! The model leaves out one thing")
    shown = diagnosis.report._repr_html_()
    assert shown.startswith("<iframe sandbox") and shown.count("<") == 2 and "&lt;!DOCTYPE" in shown


def test_options_reach_the_program(record):
    found = eixo.diagnose(record, AXIS, without=["coulomb_motor"], stop=0.8)
    assert "coulomb_motor" not in list(found.causes["id"])
    samples = int(re.search(r"trace\.csv: (\d+) samples", found.report)[1])
    assert abs(samples - 0.8 / 5.626e-4) < 2


def test_the_improved_model_runs_as_an_fmu(record, excitation, tmp_path):
    fmu = tmp_path / "improved.fmu"
    eixo.diagnose(record, AXIS, fmu=fmu)
    error = [
        np.std(eixo.simulate(model, excitation, outputs=["theta1"])["theta1"] - record["theta1"]) for model in (AXIS, fmu)
    ]
    assert error[1] < 0.05 * error[0]


def test_identify_finds_the_axis(excitation):
    found = eixo.identify(eixo.simulate(AXIS, excitation), AXIS)
    assert found.verdict == "identified" and found.doubts == []
    p = found.parameters.set_index("name")
    for name in ("I1", "I2", "B", "K"):
        assert p.loc[name, "value"] == pytest.approx(AXIS["parameters"][name], rel=1e-7)
    assert "identified" in found._repr_html_() and "X &lt;axis&gt;" in found._repr_html_()
    only = eixo.identify(eixo.simulate(AXIS, excitation), method=["ls", "rls"])
    assert [m["method"] for m in only.data["methods"]] == ["ls", "rls"]


def test_a_record_that_says_too_little_is_not_identified(excitation):
    run = eixo.simulate(AXIS, excitation, outputs=["theta1", "theta2"])
    noise = np.random.default_rng(1).normal(0.0, 0.2, (2, len(run["time"])))
    found = eixo.identify({**run, "theta1": run["theta1"] + noise[0], "theta2": run["theta2"] + noise[1]}, AXIS, trust=True)
    assert found.verdict == "not identified" and found.doubts


def test_units_in_the_names_of_columns_are_the_programs(excitation):
    record = recorded(excitation, {})
    degrees = pd.DataFrame(
        {
            "time [ms]": record["time"] * 1e3,
            "T [mN.m]": record["T"] * 1e3,
            "theta1 [deg]": np.degrees(record["theta1"]),
            "theta2 [deg]": np.degrees(record["theta2"]),
        }
    )
    one, other = (eixo.identify(t, AXIS, method="oe").parameters["value"] for t in (record, degrees))
    # The rounding of the conversion, through a fit that ends where it no longer pays.
    np.testing.assert_allclose(one, other, rtol=1e-4)


def test_every_number_is_written_with_the_digits_that_give_it_back(tmp_path):
    from eixo._tables import file_of, read

    hard = np.array([0.1 + 0.2, 1 / 3, 5e-324, -1.7976931348623157e308, 2**53 + 2.0, -0.0])
    table = pd.DataFrame({"T [N.m]": hard, "theta1": np.float32(hard / 1e300), "count": np.arange(6)})
    table.index.name = "time [s]"
    path = file_of(table, str(tmp_path), "t.csv")
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["time [s]", "T [N.m]", "theta1", "count"]
    assert [float(row[1]).hex() for row in rows[1:]] == [v.hex() for v in hard]
    assert [np.float32(row[2]) for row in rows[1:]] == list(np.float32(hard / 1e300))
    assert [row[3] for row in rows[1:]] == list("012345")
    back = read(path)
    assert list(back) == rows[0] and back["T [N.m]"].tobytes() == hard.tobytes()


def test_time_stamps_are_read(record):
    stamped = record.drop(columns="time")
    stamped.index = pd.Index(pd.Timestamp("2026-03-01T08:00") + pd.to_timedelta(np.round(record["time"] * 1e9), unit="ns"), name="time")
    one, other = (eixo.identify(t, AXIS, method="oe").data["trace"] for t in (record, stamped))
    assert other["samples"] == one["samples"] and other["dt"] == pytest.approx(one["dt"], rel=1e-6)


def test_a_simulation_is_that_of_fmpy(excitation, tmp_path):
    pytest.importorskip("fmpy")
    settings = {"coulomb_motor.level": LEVEL, "backlash.half_gap": 0.01}
    fmu = tmp_path / "axis.fmu"
    eixo.run("export", fmu)
    still = eixo.simulate(fmu, excitation)
    one = eixo.simulate(fmu, excitation, settings=settings)
    other = eixo.simulate(AXIS, excitation, settings=settings, host="fmpy", outputs=["theta1", "omega1", "x2"])
    assert list(other) == ["time", "theta1", "omega1", "x2"]
    for name in other:
        # FMPy counts time in steps of its own, off by some units in the last place.
        np.testing.assert_allclose(other[name], one[name], rtol=0, atol=1e-9 * np.max(np.abs(one[name])))
    linear = eixo.simulate(fmu, excitation, settings=settings, hold="linear")
    for unlike in (still, linear):
        assert np.max(np.abs(one["theta1"] - unlike["theta1"])) > 1e-3 * np.max(np.abs(unlike["theta1"]))
    with pytest.raises(eixo.EixoError, match="FMPy holds the inputs"):
        eixo.simulate(fmu, excitation, hold="linear", host="fmpy")
    inputs = {"time [s]": one["time"], "T [N.m]": one["T"]}
    named = eixo.simulate(fmu, inputs, settings=settings, host="fmpy", outputs=["x2"])
    assert named["x2"].tobytes() == other["x2"].tobytes()
    for wrong in ({"time": one["time"], "T [mN.m]": one["T"]}, {"time": one["time"] ** 2, "T": one["T"]}, {"T": one["T"]}):
        with pytest.raises(eixo.EixoError, match="FMPy takes `time` at even steps and inputs in SI units"):
            eixo.simulate(fmu, wrong, host="fmpy")


def test_errors_are_the_programs_own_words(record, own_temporary_folder):
    broken = record.copy()
    broken.loc[99, "theta1"] = np.inf
    with pytest.raises(eixo.EixoError, match=r"^trace\.csv: row 101, column theta1: \"inf\" is not a finite number") as caught:
        eixo.diagnose(broken, AXIS)
    assert caught.value.code == 2
    with pytest.raises(eixo.EixoError, match="^nowhere.csv: cannot "):
        eixo.diagnose("nowhere.csv", AXIS)
    with pytest.raises(eixo.EixoError, match="there is no such effect|invalid value 'nonsense'"):
        eixo.diagnose(record, AXIS, without="nonsense")
    with pytest.raises(eixo.EixoError, match="axis.toml"):
        eixo.diagnose(record, {"parameters": {"I1": "heavy"}})


def test_a_record_that_is_not_to_be_believed_is_refused(excitation):
    record = recorded(excitation, {})
    record.loc[400:, "theta2"] = record["theta2"][400]
    for command in (eixo.diagnose, eixo.identify):
        with pytest.raises(eixo.EixoError, match="theta2 keeps one value for 1648 samples") as caught:
            command(record, AXIS)
        assert caught.value.code == 1
    assert eixo.identify(record, AXIS, method="ls", trust=True).verdict


def test_what_is_no_table_is_said(record):
    for table, words in [
        (3.0, "a float has no named columns"),
        (np.zeros((4, 2)), "a ndarray has no named columns"),
        ({}, "as many rows as each other"),
        ({"time": [0.0, 1.0], "T": [0.0]}, "as many rows as each other"),
        ({"time": [[0.0], [1.0]]}, "one number a row"),
    ]:
        with pytest.raises(eixo.EixoError, match=words):
            eixo.diagnose(table, AXIS)
    with pytest.raises(eixo.EixoError, match="no NoneType"):
        eixo.diagnose(record, {"parameters": None})


def test_warnings_are_pythons(record):
    rigid = {"structure": "rigid", "parameters": {"I1": 2.43e-4}}
    with pytest.warns(UserWarning, match="A rigid axis has no table of its own"):
        eixo.diagnose(record, rigid, stop=0.5, trust=True)


def test_nothing_is_left_behind(record, excitation, own_temporary_folder):
    eixo.identify(record, AXIS, method="oe")
    eixo.simulate(AXIS, excitation)
    with pytest.raises(eixo.EixoError):
        eixo.diagnose(record.drop(columns="T"), AXIS)
    assert sorted(os.listdir(own_temporary_folder)) == ["temporary", "work"]
    assert os.listdir(own_temporary_folder / "work") == []
    assert os.listdir(own_temporary_folder / "temporary") == []


def test_a_program_that_is_not_there_is_said(monkeypatch):
    monkeypatch.setenv("EIXO_PROGRAM", "/no/such/eixo")
    with pytest.raises(eixo.EixoError, match="EIXO_PROGRAM names '/no/such/eixo'"):
        eixo.run("effects")
    monkeypatch.delenv("EIXO_PROGRAM")
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(eixo._program.sysconfig, "get_path", lambda *_: "/no/such/folder")
    with pytest.raises(eixo.EixoError, match="neither installed with this package nor on the path"):
        eixo.program()
