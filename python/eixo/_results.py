"""What the commands find, as tables."""

from __future__ import annotations

import html
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd


class Report(str):
    """A report: one HTML page that needs no other file. A notebook shows it."""

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the page; where."""
        Path(path).write_text(self, encoding="utf-8")
        return Path(path)

    def _repr_html_(self) -> str:
        return f'<iframe sandbox="allow-scripts" style="width: 100%; height: 45em" srcdoc="{html.escape(self)}"></iframe>'


@dataclass(frozen=True, repr=False)
class Result:
    """What a command found: `data` is the JSON it writes, `text` what it prints, `report` its page."""

    data: dict[str, Any]
    text: str
    report: Report

    def __repr__(self) -> str:
        return self.text


class Diagnosis(Result):
    """Where a record disagrees with the model, and why (`data`: schema eixo.diagnosis/1)."""

    @property
    def verdict(self) -> str:
        """``effect``, ``parameters``, ``no_gap`` or ``unexplained``."""
        return str(self.data["verdict"])

    @property
    def causes(self) -> pd.DataFrame:
        """What the model leaves out, the strongest first; probability and share of the gap as fractions of one."""
        return table(self.data["causes"], ["id", "family", "place", "variant", "probability", "share_of_gap"])

    @property
    def parameters(self) -> pd.DataFrame:
        """The improved model: the axis' parameters (with `nominal`), then the causes'; `std` is the standard error."""
        own = [{"parameter": n, "value": p["fitted"], **p} for n, p in self.data["parameters"].items()]
        of = [{"parameter": f"{c['id']}.{n}", **p} for c in self.data["causes"] for n, p in c["parameters"].items()]
        return table(own + of, ["parameter", "value", "std", "unit", "nominal"])

    @property
    def remainder(self) -> dict[str, Any]:
        """What no cause explains: `torque_rms` (N.m, N), `share` of the torque, `noise_multiple`, `place`, `summary`."""
        return dict(self.data["remainder"])

    @property
    def gap(self) -> pd.DataFrame:
        """Error of the models, rms over rms of the signal, on the fitted (`train`) and the held-out record."""
        on = {part: self.data["gap"][part] for part in ("train", "holdout")}
        models = ("before", "reidentified", "after", "noise_floor")
        return table(({"model": m, **{part: of[m] for part, of in on.items()}} for m in models), ["model", *on])

    def _repr_html_(self) -> str:
        known = self.remainder["torque_rms"] is not None
        stays = "No cause explains {torque_rms:.3g} rms of torque: {summary}.".format(**self.remainder) if known else ""
        said = [self.data["sentence"], stays, *self.data["warnings"], self.data["next_experiment"]]
        return page(said, [self.causes, self.parameters])


class Identification(Result):
    """The parameters of the axis from a record (`data`: schema eixo.identification/1)."""

    @property
    def verdict(self) -> str:
        """``identified`` or ``not identified``; `doubts` says why not."""
        return "identified" if self.data["earned"]["identified"] else "not identified"

    @property
    def doubts(self) -> list[str]:
        """What the record cannot tell, and what would; empty where it identifies the axis."""
        return [*self.data["earned"]["doubts"], *filter(None, [self.data["earned"]["advice"]])]

    @property
    def parameters(self) -> pd.DataFrame:
        """The recommended estimates; `std` is the standard error, `reference` the axis file's value. One that the record does not determine
        has no `value`."""
        best = self.data["recommended"]
        of = self.data["methods"][best["method"]]["parameters"] if best else []
        return table(of, ["name", "value", "std", "unit", "reference"])

    def _repr_html_(self) -> str:
        return page([f"{self.data['machine']}: {self.verdict}", *self.doubts, *self.data["warnings"]], [self.parameters])


def table(records: Iterable[Mapping[str, Any]], names: list[str]) -> pd.DataFrame:
    """A table with these columns, whatever the records have beside or lack."""
    made: pd.DataFrame = pd.DataFrame([[record.get(name) for name in names] for record in records], columns=names)
    return made


def page(sentences: Iterable[str], tables: Iterable[pd.DataFrame]) -> str:
    said = "".join(f"<p>{html.escape(s)}</p>" for s in sentences if s)
    return said + "".join(t.to_html(index=False, na_rep="", float_format="{:.6g}".format) for t in tables if len(t))
