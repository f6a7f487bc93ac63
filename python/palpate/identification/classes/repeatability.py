# SPDX-License-Identifier: Apache-2.0
"""Rows and recordings that are left out of the fit: the error on them, and the band of several recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
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
    if band is None:
        return None, (NO_BAND,)
    squares, rows, within, judged, data = 0.0, 0, 0, 0, best.data
    for residual, others, left in _left_out(selection, data.weight, repeats.groups, SeparableProblem.solve):
        squares += float(residual[left] @ residual[left])
        rows += int(np.count_nonzero(left))
        of_others = _band(best, residual, others, repeats)
        if of_others is not None and left.any():
            half = of_others.half_width(data.domain[left, 0])
            within += int(np.count_nonzero(np.abs(residual[left]) <= half))
            judged += len(half)
    if rows == 0:
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
    data, rows = best.data, np.flatnonzero(best.error.weight > 0.0)
    together = max(1, round(len(rows) / best.problem.independent))
    place = [np.rint(column / resolution_of(column)) for column in data.box[rows].T]
    first, at_place, _ = distinct_rows(
        np.column_stack(place if best.side is None else [*place, np.sign(best.side[rows])])
    )
    fold = np.full(len(data.force), -1)
    fold[rows] = (first // together % HELD_OUT_EVERY)[at_place]
    residual = best.error.residual.copy()
    fit: Fit = selection.growth.refined if len(data.names) == 1 else SeparableProblem.solve
    for again, _, left in _left_out(selection, best.fit_weight, fold, fit):
        residual[left] = again[left]
    return residual


def _band(best: Candidate, residual: Float1D, rows: NDArray[np.bool_], repeats: Repeats) -> Band | None:
    data = best.data
    side = None if best.side is None else best.side[rows]
    ends = float(data.lower[0]), float(data.lower[0] + data.reach[0])
    reach = float(np.ptp(data.force))
    return band_of(data.domain[rows, 0], side, residual[rows], repeats.only(rows), ends, reach)


def _left_out(
    selection: ClassSelection, weight: Float1D | None, group: NDArray[np.intp], fit: Fit
) -> Iterator[tuple[Float1D, NDArray[np.bool_], NDArray[np.bool_]]]:
    """Yields, for each group (n,) of rows, the residual (n,) of the model fitted without it, the other rows
    (n,), and the rows (n,) of the group within the positions and directions of the fitted ones.

    The rows have the weights `weight` (n,) in the fit, which is one of the force without mass and damping.
    """
    best = selection.best
    data, force, used = best.data, best.static_force, best.error.weight > 0.0
    cells = selection.options.search.cells(len(data.names))
    compressor = Compressor(data.box, force, weight=weight, max_positions=cells, limits=data.limits)
    for number in np.unique(group[used]):
        others = used & (group != number)
        fitted = others if data.weight is None else others & (data.weight > 0.0)
        left = used & (group == number) & inside(data.box, data.box[fitted])
        if best.side is not None:
            left &= np.isin(np.sign(best.side), np.sign(best.side[fitted]))
        if not left.any():
            yield force, others, left
        elif best.model_class == "constant":
            yield force - float(np.mean(force[fitted])), others, left
        else:
            rows = compressor.rows(best.side, fitted)
            problem = problem_of(rows, resolved_by=best.problem.resolved_by)
            problem = replace(problem, prior=best.problem.prior)
            solution = fit(problem, best.solution.basis)
            residual = force - problem.force(solution, np.ascontiguousarray(data.box), best.side)
            yield residual, others, left
