"""Scores answers (diagnosis.json, contract in the project's design) against seals. Pure functions: no files, no processes."""
from __future__ import annotations

import math
import statistics
from collections import Counter

import effects

# Likelihood proof of a confusable pair: the two differ by less than this in BIC ("very strong" begins at 10, Kass & Raftery 1995).
BIC_PROOF = 10.0
NOT_AN_EFFECT = ("parameters", "no_gap")
# Classes of several effects at once: what they are called, and the share to reach.
SEVERAL = {"pairs": ("two effects", "90 %"), "triples": ("three effects", "")}


def wilson(hits: int, n: int, z: float = 1.96):
    """Wilson score interval of a proportion (low, high); (0, 1) when there is nothing to count."""
    if n == 0:
        return 0.0, 1.0
    p = hits / n
    mid = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max(0.0, mid - half), min(1.0, mid + half)


def family_of(effect: str) -> str:
    return effects.FAMILY[effect][0] if effect in effects.FAMILY else effect


def place_of(effect: str) -> str:
    return effects.FAMILY[effect][1] if effect in effects.FAMILY else effect


def truth(seal: dict):
    """(family, place) of the sealed cause; for no effect both are the verdict. A torque gain is a parameter error: its place
    cannot be told from that of the other parameters, so both read "parameters"."""
    if seal["verdict"] != "effect":
        return seal["verdict"], seal["verdict"]
    first = seal["effects"][0]
    if first["family"] == "parameters":
        return "parameters", "parameters"
    return first["family"], first["place"]


def named(answer: dict | None):
    """(family, place, id) of the strongest cause named; verdicts without an effect stand for themselves."""
    if answer is None:
        return "failed", "failed", "failed"
    verdict = answer.get("verdict", "failed")
    causes = answer.get("causes") or []
    if verdict != "effect" or not causes:
        return verdict, verdict, verdict
    top = causes[0]
    if top["family"] == "parameters":
        return "parameters", "parameters", top["id"]
    return top["family"], top["place"], top["id"]


def closure(answer: dict | None, of_effect: bool = False):
    """Closure on the held-out trace as the diagnosis states it, or None."""
    value = ((answer or {}).get("gap") or {}).get("closure_of_effect" if of_effect else "closure")
    return value if isinstance(value, (int, float)) and math.isfinite(value) else None


def oracle_closure(seal: dict) -> float:
    """Closure the true model itself reaches on the held-out trace, encoder noise as the floor; 1 unless the sensor is coarse."""
    before = after = floor = 0.0
    for name, f in seal["figures"]["holdout"].items():
        if name.startswith("theta"):
            before += (f["before"] / f["signal"]) ** 2
            after += (f["oracle"] / f["signal"]) ** 2
            floor += (f["noise"] / f["signal"]) ** 2
    # Below one part in a thousand of the gap the difference to the floor is chance of the noise drawn.
    left = max(0.0, after - floor)
    return 1.0 - (left / (before - floor) if left > 1e-3 * (before - floor) else 0.0)


def confusable(answer: dict | None, told: str, wanted: set):
    """Whether the answer names its top cause as confusable with one of `wanted` ids; returns (named, proven by likelihood)."""
    if answer is None:
        return False, False
    rank = {h["id"]: h for h in answer.get("ranking") or []}
    told_now = {told} | ({"parameters"} if told in NOT_AN_EFFECT else set())
    for pair in answer.get("confusable") or []:
        pair_ids = set(pair[:2])
        other = pair_ids - told_now
        if pair_ids & told_now and other & wanted:
            bic = [rank[i].get("delta_bic") for i in pair_ids if i in rank]
            proven = len(bic) == 2 and None not in bic and abs(bic[0] - bic[1]) < BIC_PROOF
            return True, proven
    return False, False


def rivals(answer: dict | None, causes: list) -> set:
    """Effects that the answer names as confusable with one of its causes."""
    pairs = [set(p[:2]) for p in (answer or {}).get("confusable") or []]
    return set().union(*(p for p in pairs if p & set(causes)))


def judge(seal: dict, answer: dict | None, seconds: float | None) -> dict:
    """One row of the result: the truth, the answer, and whether they agree."""
    true_family, true_place = truth(seal)
    family, place, told = named(answer)
    ids = [e["id"] for e in seal["effects"]]
    same_family = {e for e in effects.FAMILY if family_of(e) == true_family} | {true_family}
    same_place = {e for e in effects.FAMILY if place_of(e) == true_place} | {true_place}
    if true_family == "parameters":
        same_family |= {"parameters", "torque_gain"}
        same_place |= {"parameters", "torque_gain"}
    by_family, proven = confusable(answer, told, same_family)
    by_place, _ = confusable(answer, told, same_place)
    causes = [c["id"] for c in (answer or {}).get("causes") or []] if (answer or {}).get("verdict") == "effect" else []
    suspects = [family_of(c["id"]) for c in (answer or {}).get("causes") or []] or [family]
    where = ((answer or {}).get("where") or {}).get("place")
    found = closure(answer)
    best = oracle_closure(seal) if seal["verdict"] == "effect" else None
    return {
        "case": seal["case"], "class": seal["class"], "half": seal["half"], "axis": seal["axis"], "sensors": seal["sensors"],
        "noise_rad": seal["noise_rad"], "truth": ids or [seal["verdict"]], "variant": [e["variant"] for e in seal["effects"]],
        "size": [e["size"] for e in seal["effects"]],
        "gap_over_noise": [e["gap_refit_over_noise"]["train"] for e in seal["effects"]],
        "true_family": true_family, "true_place": true_place, "told": told, "told_family": family, "told_place": place,
        "causes": causes, "family_right": family == true_family, "place_right": place == true_place,
        "id_right": told in ids or (family == true_family and true_family in NOT_AN_EFFECT),
        "family_confusable": family == true_family or by_family, "place_confusable": place == true_place or by_place,
        "suspect_right": suspects[0] == true_family, "where_right": where == true_place,
        "confusable_proven": proven, "closure": found, "oracle_closure": best,
        "closure_of_oracle": None if best is None else (found or 0.0) / best, "seconds": seconds,
        "all_named": {family_of(i) for i in ids} <= {family_of(c) for c in causes},
        "all_ids_named": set(ids) <= set(causes),
        "all_ids_confusable": set(ids) <= set(causes) | rivals(answer, causes),
        "hits": sum(family_of(i) in {family_of(c) for c in causes} for i in ids),
        # A step below the noise is there in some cases, beside the hidden effect: naming it too is not wrong.
        "extra": len([c for c in causes if family_of(c) not in {family_of(i) for i in ids}
                      and not (c == "encoder_quantisation" and seal.get("light_step_rad"))]),
    }


def abstained(seal: dict, answer: dict | None) -> str:
    """With the true family out of the library: `abstained`, `excused` (another closes 95 % of the gap), `wrong` or `failed`."""
    if answer is None:
        return "failed"
    if answer.get("verdict") == "unexplained":
        return "abstained"
    return "excused" if (closure(answer) or 0.0) >= 0.95 else "wrong"


def proportion(rows, key) -> dict:
    hits, n = sum(bool(r[key]) for r in rows), len(rows)
    low, high = wilson(hits, n)
    return {"hits": hits, "n": n, "share": hits / n if n else None, "wilson": [low, high]}


def quantiles(values) -> dict:
    values = sorted(v for v in values if v is not None)
    if not values:
        return {"n": 0, "median": None, "p10": None, "at_least_0_95": None}
    return {"n": len(values), "median": statistics.median(values), "p10": values[int(0.1 * len(values))],
            "at_least_0_95": sum(v >= 0.95 for v in values) / len(values)}


def summary(rows: list[dict], without: list[dict]) -> dict:
    """All figures from judged rows and, for the abstention, rows {case, class, outcome}."""
    singles = [r for r in rows if r["class"] not in ("none", "parameters", *SEVERAL)]
    quiet = [r for r in rows if r["class"] in ("none", "parameters")]
    for r in quiet:
        r["false_alarm"] = r["told"] in effects.FAMILY and r["told_family"] != "parameters"
    keys = ("family_right", "place_right", "id_right", "family_confusable", "place_confusable", "confusable_proven", "suspect_right")
    out = {"cases": len(rows), "singles": {k: proportion(singles, k) for k in keys}}
    # A parameter error has no place of its own.
    out["where"] = proportion([r for r in singles if r["true_family"] != "parameters"], "where_right")
    out["by"] = {}
    for axis in ("class", "axis", "sensors"):
        groups = {}
        for r in singles:
            groups.setdefault(r[axis], []).append(r)
        out["by"][axis] = {g: {k: proportion(v, k) for k in ("family_right", "place_right", "family_confusable")}
                           for g, v in groups.items()}
    decades = {}
    for r in singles:
        decades.setdefault(f"1e{math.floor(math.log10(r['noise_rad']) + 1e-9)}", []).append(r)
    out["by"]["noise"] = {g: {k: proportion(v, k) for k in ("family_right", "place_right", "family_confusable")}
                          for g, v in sorted(decades.items(), key=lambda x: float(x[0]))}
    out["false_alarms"] = {c: proportion([r for r in quiet if r["class"] == c], "false_alarm") for c in ("none", "parameters")}
    out["false_alarms"]["both"] = proportion(quiet, "false_alarm")
    out["quiet_right"] = {c: proportion([r for r in quiet if r["class"] == c], "family_right") for c in ("none", "parameters")}
    out["closure_of_oracle"] = {"all_singles": quantiles(r["closure_of_oracle"] for r in singles),
                                "family_right": quantiles(r["closure_of_oracle"] for r in singles if r["family_right"])}
    for several in SEVERAL:
        of = [r for r in rows if r["class"] == several]
        out[several] = {"families": proportion(of, "all_named"), "ids": proportion(of, "all_ids_named"),
                        "ids_confusable": proportion(of, "all_ids_confusable"),
                        "causes_found": sum(r["hits"] for r in of), "causes": sum(len(r["truth"]) for r in of),
                        "false_causes": sum(r["extra"] for r in of)}
    out["extra_causes_in_singles"] = sum(r["extra"] > 0 and r["family_right"] for r in singles)
    judged = [w for w in without if w["outcome"] != "excused"]
    for w in judged:
        w["abstained"] = w["outcome"] == "abstained"
    out["abstention"] = proportion(judged, "abstained") | {"excused": len(without) - len(judged)}
    spent = sorted(r["seconds"] for r in rows if r["seconds"] is not None)
    out["seconds"] = {"median": statistics.median(spent), "max": spent[-1]} if spent else None
    out["failed"] = [r["case"] for r in rows if r["told"] == "failed"]
    for what in ("family", "place"):
        out[f"confusion_{what}"] = {}
        for r in singles + quiet:
            out[f"confusion_{what}"].setdefault(r[f"true_{what}"], Counter())[r[f"told_{what}"]] += 1
    return out


def percent(p: dict) -> str:
    if not p["n"]:
        return "-"
    return f"{100 * p['share']:.1f} % ({p['hits']}/{p['n']}; {100 * p['wilson'][0]:.1f} to {100 * p['wilson'][1]:.1f})"


def matrix(confusion: dict) -> list[str]:
    heads = sorted({t for c in confusion.values() for t in c} | set(confusion))
    lines = ["| true \\ told | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    for true in sorted(confusion):
        lines.append(f"| {true} | " + " | ".join(str(confusion[true].get(h, "") or "") for h in heads) + " |")
    return lines


def number(x, digits=3):
    return "-" if x is None else f"{x:.{digits}f}"


def markdown(s: dict, rows: list[dict], title: str) -> str:
    """The table for people."""
    one, c, a = s["singles"], s["closure_of_oracle"], s["abstention"]
    lines = [f"# {title}", "", "Share (hits/cases; 95 % Wilson interval in %).", "", "| figure | result | to reach |", "|---|---|---|",
             f"| family, strict | {percent(one['family_right'])} | 98 % |",
             f"| family, truth named or named as confusable | {percent(one['family_confusable'])} | 98 % |",
             f"| place, strict | {percent(one['place_right'])} | 98 % |",
             f"| place, truth named or named as confusable | {percent(one['place_confusable'])} | 98 % |",
             f"| place by the residual alone (`where`) | {percent(s['where'])} | |",
             f"| family of the strongest cause, also where the verdict is unexplained | {percent(one['suspect_right'])} | |",
             f"| the very effect | {percent(one['id_right'])} | |",
             f"| false alarms, no gap | {percent(s['false_alarms']['none'])} | 1 % |",
             f"| false alarms, parameters wrong | {percent(s['false_alarms']['parameters'])} | 1 % |",
             f"| verdict right, no gap | {percent(s['quiet_right']['none'])} | |",
             f"| verdict right, parameters wrong | {percent(s['quiet_right']['parameters'])} | |",
             f"| abstained, true family removed ({a['excused']} excused: another closes 95 %) | {percent(a)} | 95 % |"]
    for key, text in (("all_singles", "all single effects"), ("family_right", "family right")):
        q = c[key]
        share = "-" if q["at_least_0_95"] is None else f"{100 * q['at_least_0_95']:.1f} %"
        lines.append(f"| closure over the oracle's, {text}: median; share of cases at 0.95 or more | {number(q['median'], 4)}; {share} | 0.98; 90 % |")
    for several, (text, aim) in SEVERAL.items():
        p = s[several]
        if p["causes"] or aim:
            lines += [f"| {text}, all families named | {percent(p['families'])} | {aim} |",
                      f"| {text}, all effects named | {percent(p['ids'])} | |",
                      f"| {text}, each named or named as confusable with one that is | {percent(p['ids_confusable'])} | |",
                      f"| {text}: causes found, false ones | {p['causes_found']}/{p['causes']}, {p['false_causes']} | |"]
    lines.append(f"| single effects with a further, false cause | {s['extra_causes_in_singles']} | |")
    if s["seconds"]:
        lines.append(f"| seconds a case: median, longest | {s['seconds']['median']:.1f}, {s['seconds']['max']:.1f} | 10 |")
    lines.append(f"| diagnosis failed | {len(s['failed'])} | 0 |")
    for axis in ("axis", "sensors", "noise", "class"):
        lines += ["", f"## By {axis}", "", f"| {axis} | family | place | family or confusable |", "|---|---|---|---|"]
        lines += [f"| {g} | " + " | ".join(percent(v[k]) for k in ("family_right", "place_right", "family_confusable")) + " |"
                  for g, v in s["by"][axis].items()]
    lines += ["", "## Confusion by family", "", *matrix(s["confusion_family"])]
    lines += ["", "## Confusion by place", "", *matrix(s["confusion_place"])]
    wrong = [r for r in rows if r["class"] not in SEVERAL and not (r["family_right"] and r["place_right"])]
    wrong += [r for r in rows if r["class"] in SEVERAL and not r["all_named"]]
    lines += ["", "## Cases not right", "",
              "| case | truth | told | confusable | axis | sensors | noise | gap/noise | closure |", "|---|---|---|---|---|---|---|---|---|"]
    for r in sorted(wrong, key=lambda r: (r["class"], r["case"])):
        told = ", ".join(r["causes"]) or r["told"]
        truth_text = ", ".join(f"{t} ({v}, {z:.2f})" for t, v, z in zip(r["truth"], r["variant"], r["size"])) or r["truth"][0]
        gaps = ", ".join(f"{g:.1f}" for g in r["gap_over_noise"])
        lines.append(f"| {r['case']} | {truth_text} | {told} | {'yes' if r['family_confusable'] else ''} | {r['axis']} | {r['sensors']} "
                     f"| {r['noise_rad']:.1e} | {gaps} | {number(r['closure'])} |")
    return "\n".join(lines) + "\n"
