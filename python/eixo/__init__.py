"""Where does the machine disagree with its model, why, and how far does the gap shrink once the cause is in the model?

    import eixo
    found = eixo.diagnose("log.csv", "axis.toml")       # paths or tables: a DataFrame, arrays by name
    found.verdict, found.causes, found.remainder
    found.report.save("diagnosis.html")

The work is done by the program `eixo`, which comes with this package: the module calls it and reads its JSON, so the numbers are
those of the terminal. Quantities are in SI units; the column of a table may name another one, as in ``theta1 [deg]``. What the
program refuses is an `EixoError` with its own words, what it warns of a `UserWarning`.

`identify` gives the parameters of the axis from a record, `simulate` NumPy arrays from the axis or any co-simulation FMU, and `run`
calls any command of the program.
"""

from ._commands import diagnose, identify, simulate
from ._program import EixoError, program, run
from ._results import Diagnosis, Identification, Report

__all__ = ["Diagnosis", "EixoError", "Identification", "Report", "diagnose", "identify", "program", "run", "simulate"]
