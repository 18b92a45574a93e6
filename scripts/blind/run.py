"""Diagnoses every case, then opens the seals and scores.

    .venv/bin/python scripts/blind/run.py --cases DIR [--eixo target/release/eixo] [--jobs 2] [--half tuning|scoring|all]

DIR is what generate.py or conditions.py wrote (the index beside the seals tells which). Answers go to DIR/answers (kept with their
stderr, seconds and peak memory), the result to DIR/result.md and DIR/result.json, of the second edition with DIR/reliability.svg.
Exit code 0, or 1 when a threshold given by --need is missed, or 2 when the check could not run.
"""
from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import time

import effects
import outcome
import reliability
import score


def load(path: pathlib.Path):
    """The JSON in path, or None when the diagnosis left none or no valid one."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def diagnose(eixo: pathlib.Path, case: pathlib.Path, out: pathlib.Path, threads: int, timeout: float, without=()):
    """Run one diagnosis in the case's own folder, which holds nothing of the seal; returns its seconds (None if cut off) and peak memory in MB."""
    command = [str(eixo), "diagnose", "train.csv", "--axis", "axis.toml", "--holdout", "holdout.csv", "--json", str(out)]
    if without:
        command += ["--without", ",".join(without)]
    out.unlink(missing_ok=True)
    begun = time.perf_counter()
    with open(out.with_suffix(".err"), "w") as err:
        child = subprocess.Popen(command, cwd=case, stdout=subprocess.DEVNULL, stderr=err, env=os.environ | {"RAYON_NUM_THREADS": str(threads)})
        cut = False
        while True:  # wait4 tells the memory of this child alone
            pid, status, used = os.wait4(child.pid, os.WNOHANG)
            if pid:
                break
            if not cut and time.perf_counter() - begun > timeout:
                cut = True
                child.kill()
            time.sleep(0.01)
        child.returncode = os.waitstatus_to_exitcode(status)
        if cut:
            err.write(f"\ncut off after {timeout} s\n")
    if cut or child.returncode not in (0, 1):
        out.unlink(missing_ok=True)
    return None if cut else time.perf_counter() - begun, used.ru_maxrss / 1024


def run_all(tasks, jobs: int, label: str) -> dict:
    """tasks: {key: zero-argument callable}; results by key, progress on stderr when it is a terminal."""
    results = {}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        futures = {pool.submit(call): key for key, call in tasks.items()}
        for done, future in enumerate(concurrent.futures.as_completed(futures), 1):
            results[futures[future]] = future.result()
            if sys.stderr.isatty():
                print(f"\r{label} {done}/{len(futures)}", end="", file=sys.stderr)
    if sys.stderr.isatty():
        print(file=sys.stderr)
    return results


def check(needs: list[str], s: dict, second: bool = False) -> list[str]:
    """Thresholds missed, in words; needs are name=value."""
    if second:
        return [m for m in (outcome.check(need, s) for need in needs) if m]
    c = s["closure_of_oracle"]["all_singles"]
    value = {
        "family": s["singles"]["family_right"]["share"], "place": s["singles"]["place_right"]["share"],
        "family_confusable": s["singles"]["family_confusable"]["share"],
        "place_confusable": s["singles"]["place_confusable"]["share"],
        "abstention": s["abstention"]["share"], **{several: s[several]["families"]["share"] for several in score.SEVERAL},
        "closure_median": c["median"], "closure_share": c["at_least_0_95"], "false_alarms": s["false_alarms"]["both"]["share"],
    }
    missed = []
    for need in needs:
        name, _, text = need.partition("=")
        if name not in value:
            raise ValueError(f"--need {need}: no figure of that name; there are {', '.join(value)}")
        got, limit = value[name], float(text)
        bad = got is None or (got > limit if name == "false_alarms" else got < limit)
        if bad:
            missed.append(f"{name} is {'not measured' if got is None else f'{got:.4f}'}, needs {limit}")
    return missed


def main(argv=None) -> int:
    root = pathlib.Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=pathlib.Path, required=True, help="folder that generate.py wrote")
    parser.add_argument("--eixo", type=pathlib.Path, default=root / "target/release/eixo")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="diagnoses at a time, each on its share of the cores")
    parser.add_argument("--half", choices=["tuning", "scoring", "all"], default="all")
    parser.add_argument("--classes", help="only these classes (second edition: groups), comma-separated")
    parser.add_argument("--axes", help="second edition: only these axes, comma-separated")
    parser.add_argument("--conditions", help="second edition: only cases with one of these conditions, comma-separated, as in the tables")
    parser.add_argument("--only", help="only these cases, comma-separated")
    parser.add_argument("--no-without", action="store_true", help="skip the abstention run (half of the time)")
    parser.add_argument("--withheld", action="store_true",
                        help="second edition: each case with causes again, the family of one of them out of the library")
    parser.add_argument("--rescore", action="store_true", help="score the answers that are there; run only what is missing")
    parser.add_argument("--timeout", type=float, default=300.0, help="seconds a case")
    parser.add_argument("--need", action="append", default=[], help="threshold, e.g. family=0.98; repeatable")
    parser.add_argument("--report", type=pathlib.Path, help="also write the markdown table here")
    args = parser.parse_args(argv)
    eixo = args.eixo.resolve()
    cases = {p.name: p.resolve() for p in sorted((args.cases / "cases").glob("*")) if (p / "train.csv").exists()}
    if not cases:
        print(f"no cases in {args.cases}/cases; make some with generate.py --out {args.cases}", file=sys.stderr)
        return 2
    if not eixo.exists():
        print(f"no program {eixo}; build it (cargo build --release) or name it with --eixo", file=sys.stderr)
        return 2
    answers = args.cases.resolve() / "answers"
    answers.mkdir(exist_ok=True)
    # The index beside the seals says which half and class a case belongs to, so that the seals stay shut while cases run.
    index = json.loads((args.cases / "seals" / "index.json").read_text())
    second = any(entry.get("edition") == 2 for entry in index.values())
    listed = lambda text: None if text is None else {x.strip() for x in text.split(",")}
    classes, wanted, on, under = (listed(x) for x in (args.classes, args.only, args.axes, args.conditions))
    if (on or under) and not second:
        print(f"--axes and --conditions pick from a set of conditions.py; {args.cases} is one of generate.py", file=sys.stderr)
        return 2
    picked = [n for n in cases if args.half in ("all", index[n]["half"]) and (classes is None or index[n]["class"] in classes)
              and (wanted is None or n in wanted) and (on is None or index[n]["axis"] in on)
              and (under is None or under & set(index[n]["conditions"]))]
    if not picked:
        print(f"none of the {len(cases)} cases in {args.cases} is picked by --half, --classes, --axes, --conditions, --only", file=sys.stderr)
        return 2
    threads = max(1, (os.cpu_count() or 1) // args.jobs)

    def task(name, out, without=()):
        return lambda: diagnose(eixo, cases[name], out, threads, args.timeout, without)

    def run_without(families: dict) -> dict:
        """Diagnoses with a family of effects out of the library; families: {case: family}; answers by case."""
        out = {n: answers / f"{n}.without.json" for n in families}
        of_family = lambda family: [e for e, (f, _) in effects.KNOWN.items() if f == family]
        todo = {n: task(n, out[n], of_family(f)) for n, f in families.items() if not (args.rescore and out[n].exists())}
        run_all(todo, args.jobs, "diagnosed without the cause")
        return {n: load(path) for n, path in out.items()}

    todo = {n: task(n, answers / f"{n}.json") for n in picked if not (args.rescore and (answers / f"{n}.json").exists())}
    spent = {}
    for what in ("seconds", "memory_mb"):
        spent[what] = (load(answers / f"{what}.json") or {}) if args.rescore else {}
    for n, (seconds, memory) in run_all(todo, args.jobs, "diagnosed").items():
        spent["seconds"][n], spent["memory_mb"][n] = seconds, memory
    for what, values in spent.items():
        (answers / f"{what}.json").write_text(json.dumps(values, indent=1) + "\n")
    times = spent["seconds"]

    # Every diagnosis is done: open the seals.
    seals = {n: json.loads((args.cases / "seals" / f"{n}.json").read_text()) for n in picked}
    if second:
        rows = [outcome.judge(seals[n], load(answers / f"{n}.json"), times.get(n), spent["memory_mb"].get(n)) for n in picked]
        figures = outcome.summary(rows)
        if args.withheld:
            of = [n for n in picked if seals[n]["effects"]]
            told = run_without({n: outcome.to_withhold(seals[n], k)["family"] for k, n in enumerate(of)})
            figures["withheld"] = outcome.withheld([outcome.judge(seals[n], told[n], None) for n in of])
        (args.cases / "reliability.svg").write_text(reliability.svg(figures["calibration"]))
        title = f"Withheld-effect check, second edition: {len(rows)} cases, half: {args.half}"
        return finish(args, {"figures": figures, "cases": rows}, outcome.markdown(figures, rows, title, "reliability.svg"), True)
    without = []
    if not args.no_without:
        of = {n: seal["effects"][0] for n, seal in seals.items() if len(seal["effects"]) == 1}
        for n, answer in run_without({n: e["family"] for n, e in of.items() if e["id"] not in effects.ABSORBED}).items():
            without.append({"case": n, "class": seals[n]["class"], "outcome": score.abstained(seals[n], answer),
                            "told": score.named(answer)[2], "closure": score.closure(answer)})
    rows = [score.judge(seals[n], load(answers / f"{n}.json"), times.get(n)) for n in picked]
    figures = score.summary(rows, without)
    text = score.markdown(figures, rows, f"Withheld-effect check: {len(rows)} cases, half: {args.half}")
    lines = ["", "## Without the true family", "", "| case | class | outcome | told | closure |", "|---|---|---|---|---|"]
    lines += [f"| {w['case']} | {w['class']} | {w['outcome']} | {w['told']} | {score.number(w['closure'])} |"
              for w in sorted(without, key=lambda w: w["class"]) if w["outcome"] != "abstained"]
    text += "\n".join(lines) + "\n" if without else ""
    return finish(args, {"figures": figures, "cases": rows, "without": without}, text, False)


def finish(args, result: dict, text: str, second: bool) -> int:
    """Write the result, print it, and hold it against the thresholds."""
    (args.cases / "result.json").write_text(json.dumps(result, indent=1) + "\n")
    (args.cases / "result.md").write_text(text)
    if args.report:
        args.report.write_text(text)
    print(text)
    try:
        missed = check(args.need, result["figures"], second)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    for m in missed:
        print(f"threshold missed: {m}", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
