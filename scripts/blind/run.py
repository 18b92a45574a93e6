"""Diagnoses every case, then opens the seals and scores.

    .venv/bin/python scripts/blind/run.py --cases DIR [--eixo target/release/eixo] [--jobs 2] [--half tuning|scoring|all]

DIR is what generate.py wrote. Answers go to DIR/answers (kept with their stderr), the result to DIR/result.md and
DIR/result.json. Exit code 0, or 1 when a threshold given by --need is missed, or 2 when the check could not run.
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
import score


def load(path: pathlib.Path):
    """The JSON in path, or None when the diagnosis left none or no valid one."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def diagnose(eixo: pathlib.Path, case: pathlib.Path, out: pathlib.Path, threads: int, timeout: float, without=()):
    """Run one diagnosis in the case's own folder, which holds nothing of the seal; returns the seconds it took, or None if cut off."""
    command = [str(eixo), "diagnose", "train.csv", "--axis", "axis.toml", "--holdout", "holdout.csv", "--json", str(out)]
    if without:
        command += ["--without", ",".join(without)]
    out.unlink(missing_ok=True)
    begun = time.perf_counter()
    with open(out.with_suffix(".err"), "w") as err:
        try:
            code = subprocess.run(command, cwd=case, stdout=subprocess.DEVNULL, stderr=err, timeout=timeout,
                                  env=os.environ | {"RAYON_NUM_THREADS": str(threads)}).returncode
        except subprocess.TimeoutExpired:
            err.write(f"\ncut off after {timeout} s\n")
            return None
    if code not in (0, 1):
        out.unlink(missing_ok=True)
    return time.perf_counter() - begun


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


def check(needs: list[str], s: dict) -> list[str]:
    """Thresholds missed, in words; needs are name=value."""
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
    parser.add_argument("--classes", help="only these classes, comma-separated")
    parser.add_argument("--no-without", action="store_true", help="skip the abstention run (half of the time)")
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
    picked = [n for n in cases if args.half in ("all", index[n]["half"])
              and (not args.classes or index[n]["class"] in args.classes.split(","))]
    threads = max(1, (os.cpu_count() or 1) // args.jobs)

    def task(name, out, without=()):
        return lambda: diagnose(eixo, cases[name], out, threads, args.timeout, without)

    todo = {n: task(n, answers / f"{n}.json") for n in picked if not (args.rescore and (answers / f"{n}.json").exists())}
    times_path = answers / "seconds.json"
    times = (load(times_path) or {}) if args.rescore else {}
    times |= run_all(todo, args.jobs, "diagnosed")
    times_path.write_text(json.dumps(times, indent=1) + "\n")

    # Every diagnosis is done: open the seals.
    seals = {n: json.loads((args.cases / "seals" / f"{n}.json").read_text()) for n in picked}
    without = []
    if not args.no_without:
        todo, singles = {}, []
        for n, seal in seals.items():
            if len(seal["effects"]) != 1 or seal["effects"][0]["id"] in effects.ABSORBED:
                continue
            singles.append(n)
            out = answers / f"{n}.without.json"
            family = seal["effects"][0]["family"]
            if not (args.rescore and out.exists()):
                todo[n] = task(n, out, [e for e, (f, _) in effects.FAMILY.items() if f == family])
        run_all(todo, args.jobs, "diagnosed without the cause")
        for n in singles:
            answer = load(answers / f"{n}.without.json")
            without.append({"case": n, "class": seals[n]["class"], "outcome": score.abstained(seals[n], answer),
                            "told": score.named(answer)[2], "closure": score.closure(answer)})
    rows = [score.judge(seals[n], load(answers / f"{n}.json"), times.get(n)) for n in picked]
    figures = score.summary(rows, without)
    text = score.markdown(figures, rows, f"Withheld-effect check: {len(rows)} cases, half: {args.half}")
    lines = ["", "## Without the true family", "", "| case | class | outcome | told | closure |", "|---|---|---|---|---|"]
    lines += [f"| {w['case']} | {w['class']} | {w['outcome']} | {w['told']} | {score.number(w['closure'])} |"
              for w in sorted(without, key=lambda w: w["class"]) if w["outcome"] != "abstained"]
    text += "\n".join(lines) + "\n" if without else ""
    (args.cases / "result.json").write_text(json.dumps({"figures": figures, "cases": rows, "without": without}, indent=1) + "\n")
    (args.cases / "result.md").write_text(text)
    if args.report:
        args.report.write_text(text)
    print(text)
    try:
        missed = check(args.need, figures)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    for m in missed:
        print(f"threshold missed: {m}", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
