"""The commands."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, TypeAlias, Union

import numpy as np

from ._program import EixoError, called, unfoldered
from ._results import Diagnosis, Identification, Report
from ._tables import Arrays, File, Table, axis_of, columns, file_of, read

Axis: TypeAlias = Union[File, Mapping[str, Any]]
Hold: TypeAlias = Literal["zoh", "linear"]


def diagnose(
    trace: File | Table, axis: Axis, *, holdout: File | Table | None = None, without: Iterable[str] = (),
    start: float | None = None, stop: float | None = None, resample: float | None = None, trust: bool = False,
    fmu: File | None = None,
) -> Diagnosis:
    """Diagnoses the gap between a model and a record.

    trace: the record, a path or a table with `time` (s), `T` (N.m) and `theta1` or `theta2` (rad), or with the columns that
        `[signals]` of the axis file names.
    axis: the nominal model, a path or its tables: ``{"parameters": {"I1": 2.37e-4, ...}}``.
    holdout: a second record that the fits never see; without it, the last third is held out.
    without: effects that must not be named. fmu: where to write the improved model as an FMU.
    start, stop: the part of the record that is used, s. resample: bring it to even steps of so many seconds.
    trust: give a verdict though the examination of the record speaks against it.

    Raises EixoError, with code 1 where the record cannot carry a verdict.
    """
    effects = without if isinstance(without, str) else ",".join(without)
    given = {"from": start, "to": stop, "resample": resample, "trust": trust, "without": effects or None}
    with TemporaryDirectory(prefix="eixo-") as folder:
        if holdout is not None:
            given["holdout"] = file_of(holdout, folder, "holdout.csv")
        given["fmu"] = None if fmu is None else os.fspath(fmu)
        return Diagnosis(*found("diagnose", trace, axis, given, folder))


def identify(
    trace: File | Table, axis: Axis | None = None, *, method: str | Iterable[str] = "all", hold: Hold | None = None,
    start: float | None = None, stop: float | None = None, resample: float | None = None, trust: bool = False,
) -> Identification:
    """Identifies the axis from a record: its parameters with their standard errors.

    trace, axis, start, stop, resample, trust: as in `diagnose`; `axis` gives the references.
    method: ``ls``, ``rls``, ``els``, ``iv``, ``oe``, ``frequency`` or ``all``, or some of them.
    hold: what the torque does between samples; the axis file's word if not given.

    Raises EixoError, with code 1 where the record cannot carry a verdict.
    """
    methods = method if isinstance(method, str) else ",".join(method)
    given = {"from": start, "to": stop, "resample": resample, "trust": trust, "method": methods, "hold": hold}
    with TemporaryDirectory(prefix="eixo-") as folder:
        return Identification(*found("identify", trace, axis, given, folder))


def simulate(
    model: Axis, inputs: File | Table, *, settings: Mapping[str, float] | None = None,
    outputs: Iterable[str] | None = None, hold: Hold = "zoh", host: Literal["eixo", "fmpy"] = "eixo",
) -> Arrays:
    """Drives an FMU, or the axis as one, and records its outputs: arrays by name, with `time` (s).

    model: a co-simulation FMU, or an axis file, or its tables.
    inputs: `time` at even steps, and each input of the model (the axis has one: `T`, N.m).
    settings: parameters and start values, as in ``{"coulomb_motor.level": 0.004}``.
    outputs: those to record; all if not given. hold: what the inputs do between samples.
    host: who runs the FMU: the program, in a process of its own, or FMPy in this one (``pip install eixo[fmu]``). An output that
        follows an input at once (an acceleration) is recorded by the program behind the input's next value, by FMPy before it.
    """
    given = {name: float(value) for name, value in (settings or {}).items()}
    wanted = None if outputs is None else list(outputs)
    with TemporaryDirectory(prefix="eixo-") as folder:
        path, trace = axis_of(model, folder), Path(folder) / "out.csv"
        if host == "eixo":
            asked = {"input": file_of(inputs, folder, "inputs.csv"), "output": trace, "hold": hold, "outputs": wanted and ",".join(wanted)}
            called(["simulate", *options(asked), *(f"--set={n}={v!r}" for n, v in given.items()), "--", path], folder)
            return {name.split(" [")[0]: values for name, values in read(trace).items()}
        if hold != "zoh":
            raise EixoError('FMPy holds the inputs over each step: hold="zoh"')
        if not path.endswith(".fmu"):
            called(["export", f"--axis={path}", path := str(Path(folder) / "axis.fmu")], folder)
        return through_fmpy(path, {re.sub(r" \[(s|N|N\.m)\]$", "", n): v for n, v in columns(inputs).items()}, given, wanted)


def through_fmpy(fmu: str, inputs: Mapping[str, Any], settings: Mapping[str, float], outputs: list[str] | None) -> Arrays:
    try:
        import fmpy  # type: ignore[import-untyped]
    except ImportError as error:
        raise EixoError('host="fmpy" needs FMPy: pip install "eixo[fmu]"') from error
    time = inputs.get("time", np.empty(0))
    step = (time[-1] - time[0]) / (len(time) - 1) if len(time) > 1 else 0.0
    if step <= 0.0 or any("[" in name for name in inputs) or np.ptp(np.diff(time)) > 1e-3 * step:
        raise EixoError(f"FMPy takes `time` at even steps and inputs in SI units, not {', '.join(inputs)}")
    signal = np.zeros(len(time), dtype=[(name, "f8") for name in inputs])
    for name, values in inputs.items():
        signal[name] = values
    times = {"start_time": time[0], "stop_time": time[-1], "step_size": step, "output_interval": step}
    recorded = fmpy.simulate_fmu(fmu, **times, input=signal, start_values=dict(settings), output=outputs)
    return {name: np.asarray(recorded[name], dtype=np.float64) for name in recorded.dtype.names}


def found(command: str, trace: Any, axis: Axis | None, given: Mapping[str, Any], folder: str) -> tuple[dict[str, Any], str, Report]:
    """Runs a command that writes a result and a report: the result, what is printed, and the report."""
    result, report = Path(folder) / "result.json", Path(folder) / "report.html"
    named = {**given, "axis": None if axis is None else axis_of(axis, folder), "json": result, "report": report}
    code, text = called([command, *options(named), "--", file_of(trace, folder, "trace.csv")], folder)
    # Of a record that is refused there is no report, and no JSON or that of its examination.
    if not report.is_file():
        raise EixoError(text.strip(), code)
    data, html = (unfoldered(folder, file.read_text(encoding="utf-8")) for file in (result, report))
    return json.loads(data), text, Report(html)


def options(given: Mapping[str, Any]) -> list[str]:
    """The options of a command line; what is None or False is not among them."""
    said = {f"--{name}": value for name, value in given.items() if value is not None and value is not False}
    return [name if value is True else f"{name}={value}" for name, value in said.items()]
