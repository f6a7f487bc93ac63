# SPDX-License-Identifier: Apache-2.0
"""Findings on an identified model: error on the rows, size, and force that the inputs cannot explain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ...recording import Recording
from ...recording.motion import noise_band
from ...recording.quality import findings_of
from ...recording.units import UNSTATED_UNIT, Unit
from ...verdict import FORCE_FLOOR, FORCE_JND, Finding, Verdict, no, usable
from ..data.limits import neighbour_correlation
from ..data.rows import period_notes
from ..decision import latest
from ..network.fitted import FittedNetwork
from ..options import IdentifyOptions
from ..search.evidence import Candidate, RowError
from .class_selection import ClassSelection
from .repeatability import band_with_check, left_out_nrmse

PULLING_ROWS = 0.002
"""If more than this share of the rows, and more than one row, pulls the tool, it cannot leave the object
[-]."""

USABLE_NRMSE = 0.1
"""NRMSE above which a model is usable with a reservation: the RMS error is then a tenth of the standard
deviation of the force [-]."""

UNFIT_NRMSE = 0.5
"""NRMSE above which a model is unfit: it leaves a quarter of the force's variance unexplained [-]."""


def error_findings(nrmse: float, rows: str) -> list[Finding]:
    """Returns findings on the size of the NRMSE; `rows` names the rows on which the NRMSE was computed."""
    if nrmse <= USABLE_NRMSE:
        return []
    judge = no if nrmse > UNFIT_NRMSE else usable
    explained = max(0.0, 1.0 - nrmse * nrmse)
    return [
        judge(
            f"the NRMSE on {rows} is {nrmse:.3g}, a good model has at most {USABLE_NRMSE:g}: the model "
            f"explains {explained:.0%} of the variance of the force"
        )
    ]


def verdict_of(
    network: FittedNetwork, recordings: Sequence[Recording], side: Float1D | None = None
) -> Verdict:
    """Returns the verdict on an identified network; `side` (n,) is the direction of all rows."""
    findings = [*findings_of(recordings, side, relaxes=network.memory is not None), *network.findings]
    largest = max(network.nrmse, network.left_out_nrmse)
    rows = (
        "rows that were left out of the fit" if largest > network.nrmse else "the rows of the identification"
    )
    findings += error_findings(largest, rows)
    return Verdict(tuple(dict.fromkeys(findings)))


REPORTED_UNEXPLAINED_SHARE = 0.25
"""If at least this share of the mean squared error cannot be explained by position, a finding reports the
share [-]."""

LEAST_CAUSE_SHARE = 0.4
"""A finding names a likely cause of the residual only if the cause explains at least this share of the
variance of the residual [-]."""

TIME_BLOCKS = 40
"""Number of successive sections of the recording; differences of their mean residuals show that the residual
depends on time."""

TRAVEL_PARTS = 8
"""Number of parts of the travel; in each part it is computed separately how the residual depends on the
direction."""

MOST_ROWS = 50_000
"""Largest number of rows from which the share of variance that a cause explains is estimated; of more rows an
evenly spread part is used."""


FULL_STROKE_STATE = 0.999
"""Size of the direction state s above which a row belongs to a complete stroke [-]; 1 except for rounding."""


def unexplained_variance(position: Float1D, force: Float1D, side: Float1D | None = None) -> float:
    """Returns the variance of the force (n,) around the straight line between its two neighbours in position
    (n,).

    Rows are in recorded order; neighbours are on the same stroke if `side` is given. A row whose neighbours
    in position are also its neighbours in time has no variance.
    """
    shuffled = np.random.default_rng(0).permutation(len(position))  # random order of rows at equal position
    position, force = position[shuffled], force[shuffled]
    keys = (position,) if side is None else (position, side[shuffled])
    order = np.lexsort(keys)
    x, y = position[order], force[order]
    whole = x[2:] - x[:-2]
    right = np.divide(x[1:-1] - x[:-2], whole, out=np.full(len(whole), 0.5), where=whole > 0.0)
    inner = np.ones(len(whole), dtype=bool)
    if side is not None:
        strokes = side[shuffled][order]
        inner = (strokes[2:] == strokes[1:-1]) & (strokes[1:-1] == strokes[:-2])
    right = np.clip(right, 0.0, 1.0)[inner]
    between = (1.0 - right) * y[:-2][inner] + right * y[2:][inner]
    apart = y[1:-1][inner] - between
    # forces of successive rows of one stroke differ because the position changes, not only because of noise
    steps = np.abs(np.diff(shuffled[order]))
    swept = ((steps[1:] == 1) & (steps[:-1] == 1))[inner]
    variance = np.where(swept, 0.0, apart**2 / (1.0 + right**2 + (1.0 - right) ** 2))
    return float(np.mean(variance)) if len(apart) else 0.0


def unexplained_share(position: Float1D, force: Float1D, side: Float1D | None) -> float:
    """Returns the share of the variance of the force that position and direction state cannot explain [-].

    Rows inside the play (|s| < 1) are not compared: between a reversal and the next complete stroke the force
    at one position may have any value between press and release.
    """
    rows, spread = _thinned(force), float(np.var(force))
    if spread == 0.0:
        return 0.0
    position, force = position[rows], force[rows]
    if side is None:
        return unexplained_variance(position, force) / spread
    full = np.abs(side[rows]) > FULL_STROKE_STATE
    variance = unexplained_variance(position[full], force[full], np.sign(side[rows][full]))
    return float(np.mean(full)) * variance / spread


def _thinned(values: Float1D) -> slice:
    """Returns a slice of at most about MOST_ROWS rows, evenly spread."""
    return slice(None, None, max(1, len(values) // MOST_ROWS))


def likely_cause(position: Float1D, residual: Float1D) -> tuple[str, str]:
    """Returns the likely cause of a residual (n,) at positions (n,) in recorded order, and the cure."""
    part = np.argsort(np.argsort(position, kind="stable"), kind="stable") * TRAVEL_PARTS // len(position)
    ahead = np.sign(np.gradient(position))
    by_direction = _explained(residual, 3 * part + ahead.astype(np.intp) + 1) - _explained(residual, part)
    in_time = _explained(residual, np.arange(len(residual)) * TIME_BLOCKS // len(residual))
    if max(by_direction, in_time) < LEAST_CAUSE_SHARE:
        return (
            "the force depends on another input (a second position, the place on the object, velocity) or "
            "has noise",
            "record the other inputs as columns and name them with --inputs, or identify each place "
            "separately",
        )
    if by_direction >= in_time:
        return (
            "press and release differ",
            "record a direction or a time column, so that hysteresis can be identified",
        )
    return (
        "the force changes with time at a constant position (relaxation, creep or drift)",
        "record continuous strokes without pauses, or remove the pauses",
    )


def _explained(values: Float1D, group: NDArray[np.intp]) -> float:
    """Returns the share of the variance of values (n,) that lies between the means of the groups `group`
    (n,), minus the share expected for random groups."""
    _, index, count = np.unique(group, return_inverse=True, return_counts=True)
    mean = np.bincount(index, values) / count
    total = float(np.sum((values - values.mean()) ** 2))
    if total == 0.0:
        return 0.0
    between = float(count @ (mean - values.mean()) ** 2) / total
    return between - (len(count) - 1) / len(values)


def explained_findings(
    position: Float1D,
    force: Float1D,
    residual: Float1D,
    side: Float1D | None,
    nrmse: float,
    force_unit: Unit = UNSTATED_UNIT,
) -> list[Finding]:
    """Returns a finding if position cannot explain most of a model's error.

    Parameters
    ----------
    position, force, residual : (n,)
        Rows in recorded order, and the residual of the model.
    side : (n,) or None
        Direction of each row, for a model with hysteresis.
    nrmse : float
        Of the model.
    force_unit : Unit
        For the message.
    """
    rows = _thinned(force)
    spread = float(np.var(force))
    if nrmse <= USABLE_NRMSE or spread == 0.0:
        return []
    least = unexplained_share(position, force, side)
    if least < REPORTED_UNEXPLAINED_SHARE * nrmse**2:
        return []
    judge = no if nrmse > UNFIT_NRMSE else usable
    share = max(0.0, 1.0 - least)
    inputs = "position" if side is None else "position and direction state"
    cause, cure = likely_cause(position[rows], residual[rows])
    apart = float(np.sqrt(2.0 * least * spread))
    return [
        judge(
            f"{inputs} can explain at most {share:.0%} of the variance of the force: rows at neighbouring "
            f"positions differ by {force_unit.text(apart)} RMS. No model of {inputs} has an NRMSE below "
            f"{np.sqrt(least):.2g}. Likely cause: {cause}. Cure: {cure}"
        )
    ]


MOST_SAMPLED_ROWS = 10_000
"""Largest number of rows from which the standard deviation of the force is computed; of more rows an evenly
spread part is used."""

EXTREME_SHARE = 0.01
"""Share of the rows, those with the most extreme forces, that a second NRMSE leaves out, to show an error
that these rows hide [-]."""

LEAST_ROWS = 100
"""Least number of rows for the check of extreme forces: 1 % of them is one row."""

HIDDEN_ERROR_RATIO = 1.2
"""Ratio of the NRMSE without the rows of extreme force to the NRMSE over all rows, above which a finding
reports both [-]."""


def extreme_force_findings(error: RowError, force_unit: Unit = UNSTATED_UNIT) -> list[Finding]:
    """Returns a finding if few rows of extreme force hide a large error of all other rows."""
    rows = np.flatnonzero(error.weight > 0.0)
    if len(rows) < LEAST_ROWS or error.spread == 0.0 or _plainly_small(error, rows):
        return []
    far = np.abs(error.force[rows] - np.median(error.force[rows]))
    count = len(rows) - int(EXTREME_SHARE * len(rows))
    kept = rows[np.sort(np.argpartition(far, count - 1)[:count])]
    inner = RowError(error.residual[kept], error.force[kept], error.weight[kept])
    if inner.nrmse <= max(USABLE_NRMSE, HIDDEN_ERROR_RATIO * error.nrmse):
        return []
    judge = no if inner.nrmse > UNFIT_NRMSE else usable
    return [
        judge(
            f"the NRMSE is {error.nrmse:.3g} over all rows, but {inner.nrmse:.3g} without the "
            f"{EXTREME_SHARE:.0%} with the most extreme forces. These reach "
            f"{force_unit.text(float(np.abs(error.force).max()))}, the others have a range of "
            f"{force_unit.text(float(np.ptp(error.force[kept])))}, so that few rows hide the error of the "
            "others. If they are wrong readings, remove these rows"
        )
    ]


def _plainly_small(error: RowError, rows: NDArray[np.intp]) -> bool:
    """True if the RMS error of the model is small compared with the standard deviation of the recorded forces
    (k,) without the most extreme ones."""
    some = error.force[rows[:: max(1, len(rows) // MOST_SAMPLED_ROWS)]]
    low, high = np.quantile(some, (EXTREME_SHARE, 1.0 - EXTREME_SHARE))
    inner = some[(some >= low) & (some <= high)]
    return bool(error.rmse < 0.5 * USABLE_NRMSE * float(np.std(inner)))


def wait_findings(best: Candidate) -> list[Finding]:
    """Returns a finding if the force at rows that are not fitted differs much from the model.

    Between press and release any force is possible, and a position within its noise.
    """
    data = best.data
    if data.fitted.all() or best.error.spread == 0.0:
        return []
    box, force, band = data.box[~data.fitted], data.force[~data.fitted], noise_band(data.path[:, 0])
    low, high = np.full(len(force), np.inf), np.full(len(force), -np.inf)
    for shift in (-band, 0.0, band):
        near = np.clip(box + shift, 0.0, 1.0)
        middle, half = best.parts_at(near) if best.strokes is not None else (best.force_near(near), 0.0)
        low, high = np.minimum(low, middle - half), np.maximum(high, middle + half)
    outside = np.maximum(force - high, low - force).clip(min=0.0)
    error = float(np.sqrt(np.mean(outside**2)))
    if error <= USABLE_NRMSE * best.error.spread:
        return []
    return [
        usable(
            f"in {len(force)} rows in which the tool waits, the force differs from the model by "
            f"{data.force_unit.text(error)} RMS: it changes with time at a constant position (relaxation, "
            "creep or drift), which a model of position does not show. Cure: record time, so that a memory "
            "can be identified, or use the model only while the tool moves"
        )
    ]


PLACES = 100
"""Number of places of the travel; in each of them the mean residual of each stroke is compared with a just
noticeable difference."""

PLACE_ERRORS = 2.0
"""Part of a mean residual that can be random [standard errors]."""

MOST_JND = 2.0
"""Mean residual of a place above which a hand feels a wrong force there [just noticeable differences]."""


def place_findings(best: Candidate) -> list[Finding]:
    """Returns a finding on the place at which the mean force of the rows differs most from the model, if a
    hand feels the difference."""
    rows = np.flatnonzero(best.error.weight > 0.0)
    if len(best.data.names) > 1 or not len(rows):
        return []
    data, residual = best.data, best.residual[rows]
    place = np.minimum((data.box[rows, 0] * PLACES).astype(np.intp), PLACES - 1)
    group = place if best.side is None else place + PLACES * (best.side[rows] < 0.0)
    count = np.maximum(np.bincount(group, minlength=2 * PLACES), 1)
    mean, force, square = (
        np.bincount(group, values, 2 * PLACES) / count for values in (residual, data.force[rows], residual**2)
    )
    error = np.sqrt(np.maximum(square - mean**2, 0.0) / np.maximum(count - 1, 1))
    jnd = np.maximum(FORCE_JND * np.abs(force), FORCE_FLOOR * float(np.abs(data.force[rows]).max()) or 1.0)
    noticed = np.where(count > 2, (np.abs(mean) - PLACE_ERRORS * error) / jnd, 0.0)
    worst = int(np.argmax(noticed))
    if noticed[worst] <= MOST_JND:
        return []
    stroke = "" if best.side is None else (" of the release" if worst >= PLACES else " of the press")
    at = float(data.lower[0] + data.reach[0] * (worst % PLACES + 0.5) / PLACES)
    return [
        usable(
            f"at {data.position_unit.text(at)}{stroke} the rows differ from the model by "
            f"{data.force_unit.text(abs(float(mean[worst])))} on average, {noticed[worst]:.2g} just "
            "noticeable differences: the force there depends on more than position and direction, or on "
            "earlier motion"
        )
    ]


def limit_findings(best: Candidate, options: IdentifyOptions) -> list[Finding]:
    """Returns a finding if growth ended at max_wavelets although neighbouring residuals are still
    correlated."""
    limit = options.max_wavelets
    if best.stop_reason != "max_wavelets" or not best.problem.structured(best.solution):
        return []
    return [
        usable(
            f"the network has {limit} wavelets, the largest number allowed, and the error (NRMSE "
            f"{best.error.nrmse:.3g}) is not yet noise; give --max-wavelets {4 * limit}"
        )
    ]


def identified(selection: ClassSelection) -> FittedNetwork:
    """Returns the accepted network in the units of the recording, with its error on the rows, all notes and
    findings."""
    best, report, options = selection.best, selection.report, selection.options
    data, error, network = best.data, best.error, best.network
    single, counted = len(data.names) == 1, error.weight
    notes, findings = list(data.notes), list(data.findings)
    decisions, replaced = latest([*report.decisions, *data.decisions])
    if data.period is not None:
        positions = data.lower[0] + data.reach[0] * data.path[:, 0]
        note, of_period = period_notes(positions, data.period, data.position_unit.si)
        notes, findings = [*notes, note], findings + of_period
    findings += report.findings + limit_findings(best, options) + wait_findings(best) + place_findings(best)
    findings += extreme_force_findings(error, data.force_unit)
    if data.counted is None and single:
        rows = np.flatnonzero(counted)
        side, position = None if best.side is None else best.side[rows], data.domain[rows, 0]
        findings += explained_findings(
            position, data.force[rows], best.residual[rows], side, error.nrmse, data.force_unit
        )
    band, checked = band_with_check(best)
    below = options.below
    if below == "auto":
        force = data.force[data.reported]
        near_zero = max(best.rmse, options.search.contact_share * float(np.ptp(force)))
        most = max(1, int(PULLING_ROWS * len(force)))
        pulls = float(np.partition(force, most)[most]) < -near_zero
        below = "free" if single and data.period is None and not pulls else "linear"
    return replace(
        network,
        below=below,
        rmse=error.rmse,
        nrmse=error.nrmse,
        rmse_of_all=best.error_on(None).rmse,
        left_out_nrmse=left_out_nrmse(selection),
        residuals=int(np.count_nonzero(counted)),
        residual_correlation=neighbour_correlation(best.residual[best.error_on(None).weight > 0.0]),
        path=tuple(report.path),
        decisions=decisions,
        notes=(*notes, *report.notes, *(f"Replaced decision: {each}." for each in replaced)),
        findings=tuple(findings),
        band=band,
        band_check=checked,
    )
