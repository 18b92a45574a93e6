"""Tables to the program's files and back."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeAlias, Union

import numpy as np
import numpy.typing as npt
import pandas as pd

from ._program import EixoError

Arrays: TypeAlias = dict[str, npt.NDArray[np.float64]]
File: TypeAlias = Union[str, "os.PathLike[str]"]
# What has named columns of one length: a DataFrame (of pandas or polars), arrays by name, a structured array (as FMPy's results).
Table: TypeAlias = Union[pd.DataFrame, Mapping[str, npt.ArrayLike], Any]


def columns(table: Table) -> dict[str, npt.NDArray[Any]]:
    """The columns of a table, or of a file that the program wrote, by name; a named index is the first of them."""
    if isinstance(table, (str, os.PathLike)):
        return dict(read(table))
    structure = getattr(getattr(table, "dtype", None), "names", None)
    names = structure or getattr(table, "columns", table if isinstance(table, Mapping) else None)
    if names is None:
        raise EixoError(f"a {type(table).__name__} has no named columns: give a DataFrame, arrays by name or a path")
    found = {str(name): np.asarray(table[name]) for name in names}
    if isinstance(table, pd.DataFrame) and table.index.name is not None:
        found = {str(table.index.name): np.asarray(table.index), **found}
    shapes = {name: values.shape for name, values in found.items()}
    if len(set(shapes.values())) != 1 or len(next(iter(shapes.values()))) != 1:
        raise EixoError(f"the columns of a table have one number a row and as many rows as each other; these have {shapes}")
    return found


def file_of(source: File | Table, folder: str, name: str) -> str:
    """The path of a trace: the one given, or that of the table, written into a folder as CSV with every number's digits."""
    if isinstance(source, (str, os.PathLike)):
        return os.fspath(source)
    named = {n: np.datetime_as_string(v) if v.dtype.kind == "M" else v for n, v in columns(source).items()}
    path = Path(folder) / name
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(named)
        # `tolist` gives Python's own floats, whose text is the shortest that reads back as the same number.
        rows.writerows(zip(*(values.tolist() for values in named.values())))
    return str(path)


def read(path: File) -> Arrays:
    """The columns of a CSV file of the program's, with their units as they stand there."""
    with open(path, newline="", encoding="utf-8") as file:
        return dict(zip(next(csv.reader(file)), np.loadtxt(file, delimiter=",", ndmin=2).T))


def axis_of(source: File | Mapping[str, Any], folder: str) -> str:
    """The path of an axis file: the one given, or that of its tables (as `tomllib.load` gives them), written into a folder."""
    if not isinstance(source, Mapping):
        return os.fspath(source)
    path = Path(folder) / "axis.toml"
    path.write_text("\n".join(f"{json.dumps(str(k))} = {toml(v)}" for k, v in source.items()), encoding="utf-8")
    return str(path)


def toml(value: Any) -> str:
    """A value of an axis file."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(k))} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (bool, str)):
        return json.dumps(value)
    if isinstance(value, Real):
        return repr(int(value) if isinstance(value, Integral) else float(value))
    raise EixoError(f"an axis file holds numbers, words and tables of them, no {type(value).__name__}")
