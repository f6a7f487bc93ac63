# SPDX-License-Identifier: Apache-2.0
"""A model as a table of its wavelets, and as HTML for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._typing import Float1D
from ..frames import pd
from ..html_table import Curve, html_table
from ..recording.units import COLUMN_SUFFIX, Unit, split_name
from .model_file import fitted_rows, phases_of

if TYPE_CHECKING:
    from .model import Model

CURVE_POSITIONS = 501
"""Number of positions at which the force curve of a model is drawn [-]"""


def force_curves(model: Model, n: int = CURVE_POSITIONS) -> tuple[Float1D, dict[str, Float1D]]:
    """Returns n positions over the domain of a model of one input, and the force of each stroke there.

    The strokes are "press" and "release" for a model with hysteresis, else one stroke with the name "".
    """
    position = np.linspace(model.lower[0], model.upper[0], n)
    sides = {"press": 1, "release": -1} if model.hysteretic else {"": None}
    return position, {name: np.asarray(model.force(position, direction=side)) for name, side in sides.items()}


def frame_of(model: Model) -> pd.DataFrame:
    """Returns one row for each wavelet, with the unit of each column in its name."""
    columns: dict[str, Float1D] = {}
    several = model.dimension > 1
    for k, name in enumerate(model.inputs):
        stem, unit = split_name(name)
        suffix = COLUMN_SUFFIX.get(model.units["position"] if k == 0 else unit.si if unit else "", "")
        of_input = f"_{stem}" if several else ""
        columns[f"alpha{of_input}" + (f"_per_{suffix}" if suffix else "")] = model.alpha[:, k]
        columns[f"beta{of_input}" + (f"_{suffix}" if suffix else "")] = model.beta[:, k]
    force = COLUMN_SUFFIX.get(model.units["force"], "")
    ending = f"_{force}" if force else ""
    columns[f"weight{ending}"] = model.weight
    if model.weight_hysteresis is not None:
        columns[f"weight_hysteresis{ending}"] = model.weight_hysteresis
    if model.harmonics:
        hats = np.zeros(model.n_wavelets - model.harmonics)
        columns["order"] = np.append(hats, model.orders)
        columns["phase_rad"] = np.append(hats, phases_of(model))
    return pd.DataFrame(columns)


def html_of(model: Model) -> str:
    """Returns verdict, size, error, ranges and a sketch of a model as HTML."""
    position_unit, force_unit = (Unit.of_si(model.units[role]) for role in ("position", "force"))
    fit, data = model.fit, model.data
    rows = {
        "model": f"{model.kind}, {model.terms}, {model.n_parameters} parameters",
        "error": f"NRMSE {fit.nrmse:.4g} on {fitted_rows(model)} of {', '.join(data.files) or 'arrays'}",
        "model class": f"{fit.model_class}, growth stopped by {fit.stop_reason}",
    }
    for k, name in enumerate(model.inputs):
        unit = position_unit if k == 0 else Unit.of_si("")
        rows[name] = unit.interval(float(model.lower[k]), float(model.upper[k]))
    curves = []
    if model.dimension == 1:
        position, forces = force_curves(model)
        both = np.concatenate(list(forces.values()))
        rows["force"] = force_unit.interval(float(both.min()), float(both.max()))
        curves = [
            Curve(position, force, "dashed" if name == "release" else "line")
            for name, force in forces.items()
        ]
    if model.plan is not None:
        rows["plan"] = str(model.plan["structure"])
    return html_table("Model", model.verdict, rows, curves)
