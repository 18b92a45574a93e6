"""Runs an exported FMU through other importers and compares each with a trace of eixo's own harness.

    .venv/bin/python scripts/importers.py
    .venv/bin/python scripts/importers.py axis.fmu trace.csv [NAME=VALUE ...]

Without arguments it builds eixo, exports the FMU and makes the trace itself: the Schroeder excitation on the paper's axis. Else
trace.csv comes from `eixo simulate axis.fmu --step-end --set NAME=VALUE ...`: its columns T and the outputs, each row as the
step before left it. Prints one line an importer; exit code 1 when one disagrees or FMPy's validation has a finding.
An importer that is not installed is named as skipped.
"""

import csv
import ctypes
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

OUTPUTS = ["theta1", "omega1", "alpha1", "theta2", "omega2", "alpha2", "x2"]
ROOT = Path(__file__).resolve().parent.parent


def read_trace(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    names = [re.sub(r" \[.*\]$", "", name) for name in rows[0]]
    return {name: np.array([float(row[k]) for row in rows[1:]]) for k, name in enumerate(names)}


def largest_difference(got, trace):
    """Largest difference of any output, relative to that output's largest value."""
    return max(np.max(np.abs(got[:, k] - trace[name])) / np.max(np.abs(trace[name])) for k, name in enumerate(OUTPUTS))


def fmpy_validate(fmu, _trace, _settings):
    from fmpy.validation import validate_fmu

    findings = validate_fmu(fmu)
    if findings:
        raise AssertionError("; ".join(findings))
    return 0.0


def fmpy_simulate(fmu, trace, settings):
    import fmpy

    time = trace["time"]
    step = time[1] - time[0]
    signal = np.zeros(len(time), dtype=[("time", "f8"), ("T", "f8")])
    signal["time"], signal["T"] = time, trace["T"]
    result = fmpy.simulate_fmu(
        fmu,
        start_time=time[0],
        stop_time=time[-1],
        step_size=step,
        output_interval=step,
        start_values=dict(settings),
        input=signal,
        output=OUTPUTS,
    )
    assert len(result) == len(time), f"{len(result)} rows instead of {len(time)}"
    return largest_difference(np.array([result[name] for name in OUTPUTS]).T, trace)


def description(fmu):
    import fmpy

    return {v.name: v.valueReference for v in fmpy.read_model_description(fmu).modelVariables}


def libcosim(fmu, trace, settings):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.ERROR)
    references = description(fmu)
    step = trace["time"][1] - trace["time"][0]
    execution = CosimExecution.from_step_size(step_size=round(step * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=str(fmu), instance_name="axis"))
    for name, value in settings:
        execution.real_initial_value(slave, references[name], value)
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator=manipulator)
    execution.add_observer(observer=observer)
    got = [[trace[name][0] for name in OUTPUTS]]
    for torque in trace["T"][:-1]:
        manipulator.slave_real_values(slave, [references["T"]], [torque])
        assert execution.step(), "a step failed"
        got.append(observer.last_real_values(slave, [references[name] for name in OUTPUTS]))
    return largest_difference(np.array(got), trace)


def ecos(fmu, trace, settings):
    # ecospy's library needs libtbb, which the package tbb carries.
    for library in glob.glob(sys.prefix + "/lib/libtbb.so.12"):
        ctypes.CDLL(library, mode=ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation, EcosSimulationStructure

    step = trace["time"][1] - trace["time"][0]
    with EcosSimulationStructure() as structure:
        structure.add_model("axis", str(fmu))
        structure.add_parameter_set("initialValues", {f"axis::{name}": value for name, value in settings})
        with EcosSimulation(structure=structure, step_size=step) as simulation:
            assert simulation.init(parameter_set="initialValues"), "init failed"
            got = [[trace[name][0] for name in OUTPUTS]]
            for torque in trace["T"][:-1]:
                simulation.set_real("axis::T", torque)
                simulation.step()
                got.append([simulation.get_real(f"axis::{name}") for name in OUTPUTS])
            simulation.terminate()
    return largest_difference(np.array(got), trace)


def fmi_sim(fmu, trace, settings):
    program = shutil.which("fmi-sim", path=os.pathsep.join([str(ROOT / "target/fmi-sim/bin"), os.environ.get("PATH", "")]))
    if program is None:
        raise ImportError("no fmi-sim (cargo install fmi-sim@0.7.0 --locked --root target/fmi-sim)")
    step = trace["time"][1] - trace["time"][0]
    with tempfile.TemporaryDirectory() as folder:
        given, result = Path(folder, "input.csv"), Path(folder, "output.csv")
        rows = zip(trace["time"], trace["T"])
        given.write_text("time,T\n" + "".join(f"{float(t)!r},{float(u)!r}\n" for t, u in rows))
        command = [program, "--model", fmu, "-i", given, "-o", result, "co-simulation"]
        command += ["--output-interval", repr(float(step)), "-s", repr(float(trace["time"][0]))]
        command += ["-f", repr(float(trace["time"][-1]))]
        for name, value in settings:
            command += ["--init-values", f"{name}={value!r}"]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        assert run.returncode == 0, run.stderr.strip()[-500:]
        got = read_trace(result)
    return largest_difference(np.array([got[name] for name in OUTPUTS]).T, trace)


def fmi_crate(fmu, trace, settings):
    import clang

    crate = ROOT / "tests" / "importers" / "fmi-crate"
    environment = dict(os.environ, LIBCLANG_PATH=str(Path(clang.__file__).parent / "native"))
    # Not the project's own folder: the crate is a workspace of its own.
    environment["CARGO_TARGET_DIR"] = str(ROOT / "target" / "fmi-crate")
    include = subprocess.run(["gcc", "-print-file-name=include"], capture_output=True, text=True, check=False)
    if include.returncode == 0:
        environment["BINDGEN_EXTRA_CLANG_ARGS"] = f"-I{include.stdout.strip()}"
    build = subprocess.run(
        ["cargo", "build", "--quiet", "--locked", "--manifest-path", crate / "Cargo.toml"],
        env=environment, capture_output=True, text=True, check=False,
    )
    if build.returncode != 0:
        raise ImportError(f"the crate does not build here: {build.stderr.strip().splitlines()[-1:]}")
    step = trace["time"][1] - trace["time"][0]
    run = subprocess.run(
        [ROOT / "target/fmi-crate/debug/eixo-fmi-crate-importer", fmu, repr(float(step))]
        + [f"{name}={value!r}" for name, value in settings],
        input="\n".join(repr(float(t)) for t in trace["T"][:-1]) + "\n",
        capture_output=True, text=True, check=False,
    )
    assert run.returncode == 0, run.stderr.strip()
    got = np.array([[float(cell) for cell in line.split()] for line in run.stdout.splitlines()])
    return largest_difference(got, trace)


# Importer, what runs it, largest difference allowed. libcosim counts time in whole nanoseconds, ecos adds it up.
IMPORTERS = [
    ("FMPy validate_fmu", fmpy_validate, 0.0),
    ("FMPy simulate_fmu", fmpy_simulate, 1e-12),
    ("fmi crate", fmi_crate, 1e-12),
    ("fmi-sim", fmi_sim, 1e-9),
    ("libcosimpy", libcosim, 1e-9),
    ("ecospy", ecos, 1e-9),
]


def own(folder):
    """Builds eixo, exports the FMU, and makes the trace of the Schroeder excitation."""
    subprocess.run(["cargo", "build", "--quiet", "--bin", "eixo"], cwd=ROOT, check=True)
    eixo = ROOT / "target/debug/eixo"
    fmu, torque, trace = (str(Path(folder, name)) for name in ("axis.fmu", "excitation.csv", "trace.csv"))
    # Half a millisecond: a whole number of libcosim's nanoseconds.
    for command in (
        ["export", fmu],
        ["excite", "-o", torque, "--samples", "2000", "--dt", "0.0005"],
        ["simulate", fmu, "-i", torque, "-o", trace, "--step-end"],
    ):
        subprocess.run([eixo, *command], check=True, stdout=subprocess.DEVNULL)
    return [fmu, trace]


def main():
    with tempfile.TemporaryDirectory() as folder:
        return compare(*(sys.argv[1:] or own(folder)))


def compare(fmu, trace, *settings):
    fmu, trace = Path(fmu).resolve(), read_trace(trace)
    settings = [(name, float(value)) for name, value in (s.split("=") for s in settings)]
    warnings.simplefilter("ignore")
    failed = False
    print(f"{'importer':<20} {'difference':>12}  verdict")
    for name, run, allowed in IMPORTERS:
        try:
            difference = run(fmu, trace, settings)
            fine = difference <= allowed
            verdict = "agrees" if fine else f"DISAGREES: at most {allowed:g} is allowed"
            print(f"{name:<20} {difference:>12.2e}  {verdict}", flush=True)
            failed |= not fine
        except (ImportError, OSError) as missing:
            print(f"{name:<20} {'-':>12}  SKIPPED: {missing}", flush=True)
        except Exception as error:  # An importer's own error is a finding about the FMU until proven otherwise.
            print(f"{name:<20} {'-':>12}  FAILED: {error}", flush=True)
            failed = True
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
