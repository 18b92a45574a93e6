"""The program: where it is, one call of it, and its errors."""

from __future__ import annotations

import os
import shutil
import subprocess
import sysconfig
import warnings
from pathlib import Path


class EixoError(Exception):
    """What the program refused, in its own words.

    `code` is its exit code: 1 where a record cannot carry a verdict, 2 where a command could not run; None where it was not asked.
    """

    def __init__(self, message: str, code: int | None = None) -> None:
        super().__init__(message)
        self.code = code


def program() -> str:
    """Path of the program: what EIXO_PROGRAM names, else the one installed with this package, else the one on the path."""
    if named := os.environ.get("EIXO_PROGRAM"):
        if found := shutil.which(named):
            return found
        raise EixoError(f"EIXO_PROGRAM names {named!r}, and there is no such program")
    # Where pip puts programs: of an environment, of a user, with --target.
    user = sysconfig.get_path("scripts", sysconfig.get_preferred_scheme("user"))
    for folder in (sysconfig.get_path("scripts"), user, str(Path(__file__).parents[1] / "bin"), None):
        if found := shutil.which("eixo", path=folder):
            return found
    raise EixoError("the program eixo is neither installed with this package nor on the path; EIXO_PROGRAM may name it")


def run(*arguments: str | os.PathLike[str]) -> str:
    """What a command prints, as in ``run("export", "axis.fmu")``. Raises EixoError when it could not run; findings are no error."""
    return called([os.fspath(a) for a in arguments])[1]


def called(arguments: list[str], own: str = "") -> tuple[int, str]:
    """Exit code and output of a command; its warnings are Python's. `own`: a temporary folder, of which nobody wants to read."""
    try:
        done = subprocess.run([program(), *arguments], stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", check=False)
    except OSError as error:
        raise EixoError(f"{program()} cannot be run: {error}") from error
    said = unfoldered(own, done.stderr).strip()
    if done.returncode not in (0, 1):
        message = said.removeprefix("error: ") or f"{program()} ended with code {done.returncode} and no word"
        raise EixoError(message, done.returncode)
    for line in said.splitlines():
        if line.startswith("warning: "):
            warnings.warn(line.removeprefix("warning: "), stacklevel=4)
    return done.returncode, unfoldered(own, done.stdout)


def unfoldered(folder: str, text: str) -> str:
    """A text in which a folder's files have their names alone, also where its separators are escaped, as in JSON."""
    whole = folder + os.sep
    return text.replace(whole.replace("\\", "\\\\"), "").replace(whole, "") if folder else text
