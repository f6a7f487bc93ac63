# SPDX-License-Identifier: Apache-2.0
"""Rows and recordings that are left out of the fit: the error on them, and the band of several recordings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ...model.band import BAND_LEVEL, Band
from ...recording.motion import resolution_of
from ..data.compression import HELD_OUT_EVERY, Compressor, inside
from ..data.limits import distinct_rows
from ..data.repeats import Repeats, band_of, pure_error
from ..network.basis import Basis
from ..network.separable import SeparableProblem, Solution, problem_of
from ..search.evidence import Candidate
from .class_selection import ClassSelection

NO_BAND = "The recordings have few common positions, so that the model has no band."
"""Note on several recordings that cannot be compared."""


def band_with_check(selection: ClassSelection) -> tuple[Band | None, tuple[str, ...]]:
    """Returns the band of a model and a note on its check; no band if the recordings cannot be compared, and
    no note for one recording.

    The check leaves out one recording at a time, or one object if there are several. Weights, slopes and bias
    are fitted to the others with the wavelets of the model, and give a band. The RMS error and the share of
    rows in this band are those of the rows that were left out.
    """
    best, repeats = selection.best, selection.best.data.repeats
    if repeats is None:
        return None, ()
    used = best.error.weight > 0.0
    side = None if best.side is None else best.side[used]
    shared = pure_error(best.data.domain[used, 0], side, best.residual[used], repeats.recording[used])
    band = None if shared is None else _band(best, best.residual, used, repeats)
    squares, rows, within, judged = 0.0, 0, 0, 0
    group, data = repeats.groups, best.data
    force, compressor = best.static_force, _compressor(selection, data.weight)
    for number in np.unique(group[used]) if band is not None else ():
        others = used & (group != number)
        residual, left = _left_out(best, compressor, force, others, used & (group == number))
        squares += float(residual[left] @ residual[left])
        rows += int(np.count_nonzero(left))
        of_others = _band(best, residual, others, repeats)
        if of_others is not None and left.any():
            half = of_others.half_width(data.domain[left, 0])
            within += int(np.count_nonzero(np.abs(residual[left]) <= half))
            judged += len(half)
    if band is None or rows == 0:
        return None, (NO_BAND,)
    coverage = within / judged if judged else None
    band = replace(band, unseen_error=float(np.sqrt(squares / rows)), coverage=coverage)
    share = ""
    if coverage is not None:
        share = f", {coverage:.1%} of its rows in the band of the others (expected {BAND_LEVEL:.0%})"
    error = data.force_unit.text(band.unseen_error)
    return band, (f"One {band.left_out} left out of the fit at a time: RMS error {error} on it{share}.",)


Fit = Callable[[SeparableProblem, Basis], Solution]
"""Fits a network with these wavelets, or one that is refined from them."""


def left_out_residual(selection: ClassSelection) -> Float1D:
    """Returns the residual (n,) of rows that are left out of the fit, a fifth of them at a time.

    The numbers of the model are fitted again to the other rows, those of a model over one position by a few
    steps. Rows with correlated noise are left out together, and so are all rows at one position in one
    direction: a row whose position is known from another stroke does not test the force between rows.
    """
    best = selection.best
    data, used = best.data, best.error.weight > 0.0
    force, compressor = best.static_force, _compressor(selection, best.fit_weight)
    rows = np.flatnonzero(used)
    together = max(1, round(len(rows) / best.problem.independent))
    place = [np.rint(column / resolution_of(column)) for column in data.box[rows].T]
    first, at_place, _ = distinct_rows(
        np.column_stack(place if best.side is None else [*place, np.sign(best.side[rows])])
    )
    fold = np.full(len(used), -1)
    fold[rows] = (first // together % HELD_OUT_EVERY)[at_place]
    residual = best.error.residual.copy()
    fit: Fit = selection.growth.refined if len(data.names) == 1 else SeparableProblem.solve
    for number in range(HELD_OUT_EVERY):
        again, left = _left_out(
            best, compressor, force, used & (fold != number), used & (fold == number), fit
        )
        residual[left] = again[left]
    return residual


def _compressor(selection: ClassSelection, weight: Float1D | None) -> Compressor:
    """Returns the rows of the best candidate with weights (n,), without the forces of mass and damping."""
    data, cells = selection.best.data, selection.options.search.cells(len(selection.best.data.names))
    return Compressor(
        data.box, selection.best.static_force, weight=weight, max_positions=cells, limits=data.limits
    )


def _band(best: Candidate, residual: Float1D, rows: NDArray[np.bool_], repeats: Repeats) -> Band | None:
    data = best.data
    side = None if best.side is None else best.side[rows]
    ends = float(data.lower[0]), float(data.lower[0] + data.reach[0])
    reach = float(np.ptp(data.force))
    return band_of(data.domain[rows, 0], side, residual[rows], repeats.only(rows), ends, reach)


def _left_out(
    best: Candidate,
    compressor: Compressor,
    force: Float1D,
    fitted: NDArray[np.bool_],
    left: NDArray[np.bool_],
    fit: Fit = SeparableProblem.solve,
) -> tuple[Float1D, NDArray[np.bool_]]:
    """Returns the residual (n,) of the model fitted to some of the rows, and the left out rows (n,) within
    the positions and directions of these rows.

    `force` (n,) is that without the forces of mass and damping, and the rows of the compressor have it.
    """
    data = best.data
    if data.weight is not None:
        fitted = fitted & (data.weight > 0.0)
    left = left & inside(data.box, data.box[fitted])
    if best.side is not None:
        left &= np.isin(np.sign(best.side), np.sign(best.side[fitted]))
    if not left.any():
        return force, left
    if best.model_class == "constant":
        return force - float(np.mean(force[fitted])), left
    rows = compressor.rows(best.side, fitted)
    problem = replace(problem_of(rows, resolved_by=best.problem.resolved_by), prior=best.problem.prior)
    solution = fit(problem, best.solution.basis)
    return force - problem.force(solution, np.ascontiguousarray(data.box), best.side), left
