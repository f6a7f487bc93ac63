# SPDX-License-Identifier: Apache-2.0
"""Writes the force law of a model as a CSV table over the position."""

from __future__ import annotations

import numpy as np

from ..frames import pd
from ..model import Model
from ..verdict import GOOD
from .exported import energy_unit, require_carried, units_of
from .request import Request, Written

ROWS = 1001
"""Number of rows of a table: positions at equal distances, both ends of the domain included."""


def write(request: Request) -> Written:
    """Writes position, force, slope and energy over the domain; with hysteresis press and release."""
    model = request.model
    table = table_of(model)
    request.write_text(table.to_csv(index=False, float_format="%.17g", lineterminator="\n"))
    return Written(
        GOOD,
        {"table": f"{request.output}: {len(table)} rows, {', '.join(table.columns)}"},
        {"rows": len(table), "columns": list(table.columns)},
    )


def table_of(model: Model) -> pd.DataFrame:
    """Returns the table of a force of position. The names of the columns contain the units.

    Raises
    ------
    InputError
        The force depends on other quantities than position and direction, or the model has mass or damping.
    """
    require_carried(model, "a table cannot")
    position, force = units_of(model)
    x = np.linspace(model.lower[0], model.upper[0], ROWS)
    columns = {f"position_{position}": x}
    sides = {"press": 1.0, "release": -1.0} if model.hysteretic else {"": None}
    for name, direction in sides.items():
        prefix = f"{name}_" if name else ""
        columns[f"{prefix}force_{force}"] = model.force(x, direction=direction)
        columns[f"{prefix}slope_{force}/{position}"] = model.slope(x, direction=direction)
    columns[f"energy_{energy_unit(position, force)}"] = model.energy(
        x, direction=0.0 if model.hysteretic else None
    )
    return pd.DataFrame(columns)
