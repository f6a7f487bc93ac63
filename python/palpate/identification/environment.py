# SPDX-License-Identifier: Apache-2.0
"""fit_environment: from arrays to an identified force law."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .._typing import Float1D, Float2D
from .identified import IdentifiedNetwork, Readings
from .ladder import Ladder
from .options import IdentifyOptions
from .robust import robust_weights
from .rung import Rung
from .usable import require_usable

VELOCITY_INPUTS = ("position", "velocity")
"""Inputs of a force that depends on the motion."""

MOST_HALVINGS = 3
"""Times that cells are halved at most."""


def fit_environment(
    positions: Float2D,
    force: Float1D,
    side: Float1D | None = None,
    options: IdentifyOptions | None = None,
    *,
    starts: Sequence[int] | None = None,
    names: Sequence[str] | None = None,
    weight: Float1D | None = None,
    within: float = 0.0,
) -> IdentifiedNetwork:
    """Identify a force law from arrays.

    Parameters
    ----------
    positions : (n, d)
        Positions, growing into the object, and what else the force depends on.
    force : (n,)
        Force of the object against the tool.
    side : (n,), optional
        +1 in rows of a stroke into the object, -1 out of it, 0 for neither (left out to judge hysteresis).
    options : IdentifyOptions, optional
    starts : sequence of int, optional
        Rows at which a continuous motion starts. With it, and without side, hysteresis is tried with the play
        operator, s = (x - pi)/r (d = 1).
    names : sequence of str, optional
        Of the inputs, for the sentences.
    weight : (n,), optional
        Samples that each row stands for, above 0; 1 without it.
    within : float
        Sum of squares of the force inside rows that stand for several samples.

    Returns
    -------
    IdentifiedNetwork

    Raises
    ------
    palpate.InputError
        For data that cannot be identified, and for a hysteresis input that the data cannot give.
    """
    options = options or IdentifyOptions()
    names = tuple(names or _input_names(positions.shape[-1]))
    require_usable(positions, force, names)
    if side is not None and not ((side > 0).any() and (side < 0).any()):
        side = None
    if side is None or side.all() or not (options.inputs == "auto" or "hysteresis" in options.inputs):
        return _fitted(positions, force, side, options, starts, names, weight, within)
    directed = side != 0
    left_out = f"{np.count_nonzero(~directed)} rows without a direction were left out to judge hysteresis"
    found = _fitted(
        positions[directed],
        force[directed],
        side[directed],
        options,
        starts,
        names,
        None if weight is None else weight[directed],
        within,
    )
    found = replace(found, notes=(left_out, *found.notes))
    if found.weight_hysteresis is not None:
        return found
    # hysteresis was refused, so there is no reason any more to leave out rows that have no direction
    every_row = _fitted(positions, force, None, options, None, names, weight, within)
    return replace(every_row, path=found.path + every_row.path, notes=found.notes + every_row.notes)


def _fitted(
    positions: Float2D,
    force: Float1D,
    side: Float1D | None,
    options: IdentifyOptions,
    starts: Sequence[int] | None,
    names: tuple[str, ...],
    weight: Float1D | None,
    within: float,
) -> IdentifiedNetwork:
    """Climb with cells that are fine enough, again with outliers weighed down where that is asked for."""
    lower, reach = positions.min(axis=0), np.ptp(positions, axis=0)
    box = (positions - lower) / reach
    side = None if side is None else np.sign(side).astype(float)
    network = "velocity" if names == VELOCITY_INPUTS else "position" if len(names) == 1 else "network"
    limit = options.max_positions * 2 ** (positions.shape[1] - 1)

    def climbed(cells: int, weight: Float1D | None) -> tuple[Ladder, Rung]:
        ladder = Ladder(
            box,
            force,
            weight,
            side,
            starts,
            options,
            network=network,
            slope_unit=float(reach[0]),
            max_positions=cells,
            within=within,
        )
        return ladder, ladder.climb()

    ladder, best = climbed(limit, weight)
    for _ in range(MOST_HALVINGS):
        if not best.cells_too_wide():
            break
        limit *= 2
        ladder, best = climbed(limit, weight)
    if options.loss == "huber":
        weight, note = robust_weights(lambda weights: climbed(limit, weights)[1], best, box, force, weight)
        ladder, best = climbed(limit, weight)
        ladder.notes.append(note)
    return _identified(best, ladder, lower, reach, force, options)


def _identified(
    rung: Rung,
    ladder: Ladder,
    lower: Float1D,
    reach: Float1D,
    force: Float1D,
    options: IdentifyOptions,
) -> IdentifiedNetwork:
    """The rung in the units of the data."""
    law = Readings.of(rung.solution, rung.problem.readout, lower, reach)
    two = len(law.bias) == 2
    spread = float(np.std(force))
    near_zero = max(rung.rmse, options.contact_share * float(np.ptp(force)))
    left_there = len(lower) == 1 and abs(law.at_lower) <= near_zero
    return IdentifiedNetwork(
        alpha=law.alpha,
        beta=law.beta,
        weight=law.weights[0],
        linear=law.linear[0],
        bias=float(law.bias[0]),
        weight_hysteresis=law.weights[1] if two else None,
        linear_hysteresis=law.linear[1] if two else None,
        bias_hysteresis=float(law.bias[1]) if two else None,
        lower=lower,
        upper=lower + reach,
        below="free" if left_there else "linear",
        above="linear",
        play_radius=None if rung.play_radius is None else rung.play_radius * float(reach[0]),
        mass=None,
        damping=None,
        rung=rung.name,
        stop_reason=rung.stop_reason,
        n_parameters=rung.n_parameters,
        rmse=rung.rmse,
        nrmse=rung.rmse / spread if spread > 0 else 0.0,
        path=tuple(ladder.path),
        notes=tuple(ladder.notes),
    )


def _input_names(dimension: int) -> tuple[str, ...]:
    """Names for inputs that came without."""
    return ("position", *(f"input {k}" for k in range(2, dimension + 1)))
