"""Scores answers on the second edition's seals. Pure functions: no files, no processes.

A cause is right when its family or id is in the sealed effect's `accepted` list, neutral when it is in the case's `tolerated` list or a
parameter error (torque_gain), else false. Every effect sealed as `required` must be named.
"""
from __future__ import annotations

import statistics

import intervals
import reliability
from score import percent, wilson

OUTCOMES = ("right", "right with remainder", "incomplete", "extra", "wrong", "unexplained", "missed", "false alarm", "failed")
GOOD = {"right", "right with remainder"}
HEALTHY = {"healthy", "parameters"}
SURE = 0.9  # a false cause told at this probability or more is confidently wrong
STATED = 2.0  # a remainder of this many noise floors counts as stated
VISIBLE = 3.0  # parameter errors of this many noise floors are a gap that "no gap" overlooks


def names(cause: dict, listed) -> bool:
    return cause.get("family") in listed or cause.get("id") in listed


def causes_of(answer: dict | None) -> list:
    """Physical causes under the verdict `effect`; a parameter error is none."""
    if not answer or answer.get("verdict") != "effect":
        return []
    return [c for c in answer.get("causes") or [] if c.get("family") != "parameters"]


def verdict_of(answer: dict) -> str:
    """The verdict; an effect that is a parameter error only is `parameters`."""
    verdict = answer.get("verdict", "failed")
    return "parameters" if verdict == "effect" and answer.get("causes") and not causes_of(answer) else verdict


def outcome(seal: dict, answer: dict | None) -> tuple[str, list, list]:
    """(one of OUTCOMES, false causes, required effects that are not named)."""
    if answer is None:
        return "failed", [], []
    verdict, told = verdict_of(answer), causes_of(answer)
    true = [e["accepted"] for e in seal["effects"]]
    false = [c for c in told if not names(c, seal["tolerated"]) and not any(names(c, a) for a in true)]
    missing = [e for e in seal["effects"] if e["required"] and not any(names(c, e["accepted"]) for c in told)]
    if verdict not in ("effect", "parameters", "no_gap", "unexplained"):
        return "failed", [], missing
    if seal["group"] in HEALTHY:
        if verdict == "unexplained":
            return "unexplained", false, missing
        if false:
            return "false alarm", false, missing
        overlooked = verdict == "no_gap" and (seal["parameters_over_noise"] >= VISIBLE or seal["bias"])
        return ("missed" if overlooked else "right"), false, missing
    if seal["group"] == "foreign":
        return ("right" if verdict == "unexplained" else "wrong" if false else "right" if told else "missed"), false, missing
    if verdict == "unexplained":
        return "unexplained", false, missing
    if verdict != "effect":
        return "missed", false, missing
    if false:
        return ("wrong" if missing else "extra"), false, missing
    if missing:
        return "incomplete", false, missing
    stated = (answer.get("remainder") or {}).get("noise_multiple")
    return ("right with remainder" if isinstance(stated, (int, float)) and stated >= STATED else "right"), false, missing


def judge(seal: dict, answer: dict | None, seconds: float | None, memory: float | None = None) -> dict:
    """One row: the truth, the answer and how they agree."""
    result, false, missing = outcome(seal, answer)
    told = causes_of(answer)
    places = []
    for e in seal["effects"]:
        of = [c for c in told if c.get("family") == e["family"]]
        if of:
            places.append(any(c.get("place") == e["place"] for c in of))
    suspects = (answer or {}).get("causes") or []
    right = lambda c: names(c, seal["tolerated"]) or any(names(c, e["accepted"]) for e in seal["effects"])
    probability = lambda c: min(1.0, max(0.0, float(c.get("probability") or 0.0)))
    return {
        "case": seal["case"], "group": seal["group"], "half": seal["half"], "axis": seal["axis"], "sensors": seal["sensors"],
        "conditions": seal["conditions"], "truth": [e["id"] for e in seal["effects"]],
        "required": [e["id"] for e in seal["effects"] if e["required"]],
        "missing": [e["id"] for e in missing], "outcome": result, "good": result in GOOD,
        "told": [(c.get("id"), c.get("place"), probability(c)) for c in told] or [("" if answer is None else answer.get("verdict", ""), "", 0.0)],
        "false": [c.get("id") for c in false], "confidently_wrong": any(probability(c) >= SURE for c in false),
        "false_alarm": seal["group"] in HEALTHY and bool(false), "places": places,
        "probabilities": [(probability(c), right(c)) for c in told],
        "probabilities_of_suspects": [(probability(c), right(c)) for c in suspects if c.get("family") != "parameters"],
        "verdict_exact": bool(answer) and verdict_of(answer) == seal["verdict"],
        "gaps": [e["gap_over_noise"] for e in seal["effects"]], "remainder": (answer or {}).get("remainder"),
        "seconds": seconds, "memory_mb": memory, "standard_errors": intervals.errors(seal, answer, result in GOOD),
    }


def to_withhold(seal: dict, turn: int) -> dict:
    """The effect of a case whose family is taken out of the library: by turns, so that each of several comes up."""
    return seal["effects"][turn % len(seal["effects"])]


def withheld(rows: list[dict]) -> dict:
    """Figures of answers by a library that lacks a cause: what is then named beside those that are there is false."""
    told = [r for r in rows if r["outcome"] != "failed"]
    return {"nothing_false": share(told, lambda r: not r["false"]), "confidently_wrong": share(told, lambda r: r["confidently_wrong"]),
            "unexplained": share(told, lambda r: r["outcome"] == "unexplained"),
            "calibration": reliability.table([p for r in told for p in r["probabilities"]])}


def share(rows, test) -> dict:
    hits, n = sum(bool(test(r)) for r in rows), len(rows)
    return {"hits": hits, "n": n, "share": hits / n if n else None, "wilson": list(wilson(hits, n))}


def count(rows) -> dict:
    out = {o: sum(r["outcome"] == o for r in rows) for o in OUTCOMES}
    return {"n": len(rows)} | out | {"confidently wrong": sum(r["confidently_wrong"] for r in rows),
                                     "good": share(rows, lambda r: r["good"])}


def covered(rows) -> dict:
    return share([z for r in rows for _, z in r["standard_errors"]], lambda z: z < intervals.COVERED)


def summary(rows: list[dict]) -> dict:
    """All figures of a scored set."""
    healthy = [r for r in rows if r["group"] in HEALTHY]
    of = lambda *groups: [r for r in rows if r["group"] in groups]
    sick = [r for r in rows if r["group"] not in HEALTHY]
    places = [p for r in rows for p in r["places"]]
    out = {
        "all": count(rows), "right": share(rows, lambda r: r["good"]), "sick_right": share(sick, lambda r: r["good"]),
        "confidently_wrong": share(rows, lambda r: r["confidently_wrong"]), "false_alarms": share(healthy, lambda r: r["false_alarm"]),
        "healthy": share(healthy, lambda r: r["good"]), "verdict_exact": share(healthy, lambda r: r["verdict_exact"]),
        "two": share(of("two"), lambda r: r["good"]), "three": share(of("three"), lambda r: r["good"]),
        "machine": share(of("machine", "whole_machine"), lambda r: r["good"]), "place": share(places, bool), "intervals": covered(rows),
        "calibration": reliability.table([p for r in rows for p in r["probabilities"]]),
        "calibration_of_suspects": reliability.table([p for r in rows for p in r["probabilities_of_suspects"]]),
        "by": {"group": {}, "axis": {}, "condition": {}, "cause": {}, "sensors": {}},
        "failed": [r["case"] for r in rows if r["outcome"] == "failed"],
    }
    for r in rows:
        keys = [("group", r["group"]), ("axis", r["axis"]), ("sensors", r["sensors"])]
        keys += [("condition", c) for c in r["conditions"]] + [("cause", e) for e in r["required"]]
        for by, key in keys:
            out["by"][by].setdefault(key, []).append(r)
    of_all = sorted({name for r in rows for name, _ in r["standard_errors"]})
    only = lambda name: [r | {"standard_errors": [e for e in r["standard_errors"] if e[0] == name]} for r in rows]
    out["intervals_by"] = {"condition": {k: covered(v) for k, v in sorted(out["by"]["condition"].items())},
                           "parameter": {name: covered(only(name)) for name in of_all}}
    out["by"] = {by: {k: count(v) for k, v in sorted(groups.items())} for by, groups in out["by"].items()}
    for what in ("seconds", "memory_mb"):
        spent = sorted(r[what] for r in rows if r[what] is not None)
        out[what] = {"median": statistics.median(spent), "max": spent[-1]} if spent else None
    out["slowest"] = [(r["case"], r["seconds"]) for r in sorted(rows, key=lambda r: -(r["seconds"] or 0.0))[:5]]
    return out


AIMS = (("right", "all conditions together right", ">= 90 %"), ("sick_right", "of these the axes that are not healthy", ""),
        ("confidently_wrong", f"a false cause at {SURE:g} or more", "<= 1 %"), ("false_alarms", "false alarms on healthy axes", "<= 1 %"),
        ("healthy", "healthy axes called healthy", ">= 95 %"), ("verdict_exact", "of these with the very verdict (no gap or parameters)", ""),
        ("two", "two causes", ">= 92 %"), ("three", "three causes", ">= 85 %"),
        ("machine", "like real machines: friction, viscosity, bias, a remainder", ""),
        ("place", "place of the causes that are right by family", ""),
        ("intervals", "95 % intervals of parameters that hold the truth", "85 to 99 %"))


WITHHELD = (("nothing_false", "nothing false named"), ("confidently_wrong", f"a false cause at {SURE:g} or more"),
            ("unexplained", "verdict unexplained"))


def check(need: str, s: dict) -> str | None:
    """The threshold `name=value` missed, in words, or None."""
    name, _, text = need.partition("=")
    value = {k: s[k]["share"] for k, _, _ in AIMS} | {"ece": s["calibration"]["ece"]}
    if name not in value:
        raise ValueError(f"--need {need}: no figure of that name; there are {', '.join(value)}")
    got, limit = value[name], float(text)
    most = name in ("false_alarms", "confidently_wrong", "ece")
    if got is None or (got > limit if most else got < limit):
        return f"{name} is {'not measured' if got is None else f'{got:.4f}'}, needs {'at most' if most else 'at least'} {limit}"
    return None


def rows_of(groups: dict) -> list[str]:
    head = ["n", *OUTCOMES, "confidently wrong"]
    lines = ["| | right in all | " + " | ".join(head) + " |", "|---" * (len(head) + 2) + "|"]
    for key, c in groups.items():
        lines.append(f"| {key} | {100 * c['good']['share']:.0f} % | " + " | ".join(str(c[h] or "") for h in head) + " |")
    return lines


def markdown(s: dict, rows: list[dict], title: str, picture: str) -> str:
    """The tables for people; `picture` is the reliability diagram's file name."""
    lines = [f"# {title}", "", "Share (hits/cases; 95 % Wilson interval in %).", "", "| figure | result | to reach |", "|---|---|---|"]
    lines += [f"| {text} | {percent(s[key])} | {aim} |" for key, text, aim in AIMS]
    for key, text, aim in (("calibration", "calibration error of the causes named", "<= 5 %"),
                           ("calibration_of_suspects", "the same with suspects under `unexplained`", "")):
        lines.append(f"| {text} | {reliability.percent_of(s[key])} | {aim} |")
    for key, text, aim in (("seconds", "seconds a case", "20 s"), ("memory_mb", "MB a case, peak", "")):
        if s[key]:
            lines.append(f"| {text}: median, largest | {s[key]['median']:.1f}, {s[key]['max']:.1f} | {aim} |")
    if w := s.get("withheld"):
        lines += [f"| a family withheld: {text} | {percent(w[key])} | |" for key, text in WITHHELD]
        lines.append(f"| a family withheld: calibration error of the causes named | {reliability.percent_of(w['calibration'])} | |")
    lines += ["", "Right with remainder: every required cause, nothing false, and what stays is stated. Incomplete: nothing false, a required",
              "cause is missing. Extra: all required and a false one. Wrong: a false one, and a required one is missing. Missed: an effect that is there, and",
              "the verdict is no gap or parameters.", "", "## By group", "", *rows_of(s["by"]["group"] | {"all": s["all"]})]
    for by in ("axis", "condition", "sensors", "cause"):
        note = " (required; a case of several counts for each)" if by == "cause" else ""
        lines += ["", f"## By {by}{note}", "", *rows_of(s["by"][by])]
    lines += ["", "## Probabilities", "", f"![reliability diagram]({picture})", "", *reliability.markdown(s["calibration"])]
    lines += ["", "## Intervals", "", "Values told with a standard error whose 95 % interval holds the sealed one, in answers that are right (intervals.py).", "",
              "| | share of the values |", "|---|---|"]
    lines += [f"| {key} | {percent(c)} |" for by in s["intervals_by"].values() for key, c in by.items() if c["n"]]
    lines += ["", "## Slowest", ""] + [f"- {case}: {'cut off' if t is None else f'{t:.1f} s'}" for case, t in s["slowest"]]
    lines += ["", "## Cases not right", "", "Causes in brackets need not be named.", "",
              "| case | group | axis | truth | told | outcome | false | conditions | gap/noise |", "|---" * 9 + "|"]
    for r in sorted((r for r in rows if not r["good"]), key=lambda r: (r["outcome"], r["group"], r["case"])):
        told = ", ".join(f"{i} {place} {p:.2f}" if place else str(i) for i, place, p in r["told"])
        truth = ", ".join(t if t in r["required"] else f"({t})" for t in r["truth"]) or "-"
        lines.append(f"| {r['case']} | {r['group']} | {r['axis']} | {truth} | {told} | {r['outcome']}{' (sure)' if r['confidently_wrong'] else ''} | "
                     f"{', '.join(map(str, r['false']))} | {'; '.join(r['conditions'])} | {', '.join(f'{g:.0f}' for g in r['gaps'])} |")
    return "\n".join(lines) + "\n"
