# SPDX-License-Identifier: Apache-2.0
"""Identifies a force law from arrays or from rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .._typing import Float1D, Float2D
from .classes.findings import identified
from .classes.model_selection import select
from .data.limits import ForceScale
from .data.rows import Rows, require_usable
from .log import Log, latest
from .network.fitted import FittedNetwork
from .options import IdentifyOptions


def fit_environment(
    positions: Float2D,
    force: Float1D,
    side: Float1D | None = None,
    options: IdentifyOptions | None = None,
    *,
    starts: Sequence[int] | None = None,
    names: Sequence[str] | None = None,
) -> FittedNetwork:
    """Identifies a force law from arrays.

    Parameters
    ----------
    positions : (n, d)
        Positions, which increase into the object, and further inputs of the force.
    force : (n,)
        Force of the object against the tool.
    side : (n,), optional
        Direction of each row: +1 into the object, -1 out of the object, 0 neither (left out of the test of
        hysteresis).
    options : IdentifyOptions, optional
    starts : sequence of int, optional
        Indices of rows at which a continuous motion starts. If `starts` is given without `side`, hysteresis
        is tried with the play operator, s = (x - pi)/r (d = 1).
    names : sequence of str, optional
        Names of the inputs, for messages.

    Returns
    -------
    FittedNetwork

    Raises
    ------
    palpate.InputError
        The data cannot be identified, or the options name hysteresis and the data has no direction or motion.
    """
    options = options or IdentifyOptions()
    given = names or ("position", *(f"input {k}" for k in range(2, positions.shape[-1] + 1)))
    side = None if side is None else np.sign(side).astype(float)
    rows = Rows(tuple(given), positions, force, side, starts=starts, period=options.period)
    return fit_rows(rows, options)


def fit_rows(rows: Rows, options: IdentifyOptions) -> FittedNetwork:
    """Identifies a force law from rows, as :func:`fit_environment` does from arrays."""
    require_usable(rows, options)
    scale = ForceScale.of(rows.force, options)
    found = _fitted(rows.scaled(scale), scale.scaled_options(options))
    return replace(found.unscaled(scale, rows.force_unit), rows=rows)


def _fitted(rows: Rows, options: IdentifyOptions) -> FittedNetwork:
    """Identifies without the rows of direction 0 if hysteresis is tested; if it is not accepted, identifies
    again with all rows."""
    side = rows.side
    if side is not None and not ((side > 0).any() and (side < 0).any()):
        rows, side = replace(rows, side=None), None
    if (
        side is None
        or side[rows.reported].all()
        or not (options.inputs == "auto" or "hysteresis" in options.inputs)
    ):
        return identified(select(rows, options))
    found = identified(select(rows.only(side != 0), options))
    if found.weight_hysteresis is not None:
        found.log.rows.append(f"{np.count_nonzero(side == 0)} rows without a direction are not fitted.")
        return found
    # hysteresis was refused, so rows without a direction need not be left out
    every_row = replace(rows, side=None, starts=None, parts=(), log=Log(findings=rows.log.findings))
    again = identified(select(every_row, options))
    log = found.log
    log.extend(again.log)
    log.decisions, log.findings = latest(log.decisions)[0], again.log.findings
    return replace(again, log=log)
