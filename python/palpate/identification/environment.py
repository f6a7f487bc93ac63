# SPDX-License-Identifier: Apache-2.0
"""fit_environment: from arrays to an identified force law."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .._typing import Float1D, Float2D
from ..errors import InputError
from ..recording.motion import Piece
from ..verdict import Finding
from .classes.climb import BoxRows
from .classes.dynamics import NO_TERMS, Dynamics, Terms
from .classes.findings import USABLE_NRMSE, judged_on_rows, most_of_error, unexplained_share
from .classes.selection import VELOCITY_INPUTS, Selected, select
from .data.limits import (
    MOST_ORDERED,
    RESOLVED,
    STEP_ERROR,
    ForceScale,
    RowLimits,
    correlation,
    force_step,
    independent_share,
    innovation_deviance,
    position_noise,
    repeated,
)
from .data.rows import modulo, period_notes, require_one_input, require_usable
from .network.fitted import FittedNetwork
from .network.separable import NOISE_WIDTHS
from .options import IdentifyOptions
from .search.criteria import ON_HELD_OUT_ROWS

DYNAMIC_ROUNDS = 2
"""Times that the model is selected again beside velocity and mass, on ever better values of theirs."""

WORTH_A_VELOCITY = 0.05
"""Share of the squared error that velocity as an input must take away beside a constant damping: a force of
two inputs is harder to render."""

WORTH_FRICTION = 0.25
"""The same where no constant damping was found, such as for Coulomb friction: its sign changes with that of
the velocity."""

WORTH_MORE_THAN_HYSTERESIS = 0.75
"""The same where hysteresis was accepted, which is easier to render and certify."""

CORRELATION_ROUNDS = 5
"""Times that the correlation of noise is estimated at most."""

LEAST_INDEPENDENT = 0.02
"""Independent samples per sample below which a residual is memory or drift rather than noise [-]"""

WORTH_CLIMBING = 0.8
"""Ratio of the independent samples to those before from which the model is not selected again [-]"""

LARGE_ERROR = 0.2
"""NRMSE above which wavelets stay wide if position cannot explain most of it [-]"""

LEAST_CORE = 1.0 / 64.0
"""Half of the core of these wavelets, as a share of the travel [-]"""


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
    parts: Sequence[Piece] = (),
) -> FittedNetwork:
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
    parts : sequence of Piece
        The motion between gaps of time, for velocity, mass and damping (d = 1).

    Returns
    -------
    FittedNetwork

    Raises
    ------
    palpate.InputError
        For data that cannot be identified, and for a hysteresis input that the data cannot give.
    """
    options = options or IdentifyOptions()
    names = tuple(names or _input_names(positions.shape[-1]))
    require_usable(positions, force, names)
    if len(names) > 1 and (options.slope_limits is not None or options.fixed_force is not None):
        raise InputError(
            "slope_bounds, monotone, coupling_stiffness and fixed_force are for a force over position alone, "
            f"not over {', '.join(names)}"
        )
    if options.period is not None:
        require_one_input(names)
    if scale := ForceScale.of(force, options):
        return fit_environment(
            positions,
            scale.scaled(force),
            side,
            scale.scaled_options(options),
            starts=starts,
            names=names,
            weight=weight,
            within=within * scale.factor**2,
            parts=[replace(part, force=scale.scaled(part.force)) for part in parts],
        ).unscaled(scale)
    if side is not None and not ((side > 0).any() and (side < 0).any()):
        side = None
    if side is None or side.all() or not (options.inputs == "auto" or "hysteresis" in options.inputs):
        return _fitted(positions, force, side, options, starts, names, weight, parts, within)
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
        (),
        within,
    )
    found = replace(found, notes=(left_out, *found.notes))
    if found.weight_hysteresis is not None:
        return found
    # hysteresis was refused, so there is no reason any more to leave out rows that have no direction
    every_row = _fitted(positions, force, None, options, None, names, weight, (), within)
    return replace(
        every_row,
        path=found.path + every_row.path,
        notes=found.notes + every_row.notes,
        findings=found.findings + every_row.findings,
    )


def _fitted(
    positions: Float2D,
    force: Float1D,
    side: Float1D | None,
    options: IdentifyOptions,
    starts: Sequence[int] | None,
    names: tuple[str, ...],
    weight: Float1D | None,
    parts: Sequence[Piece],
    within: float,
) -> FittedNetwork:
    """Selects a model of the inputs, again where the noise asks for it; then velocity and mass."""
    rows, repeats = _in_box(positions, force, side, options, starts, names, weight, within)
    selected = select(rows, options)
    if rows.counted is None and options.criterion not in ON_HELD_OUT_ROWS:
        selected = _with_correlated_noise(selected)
    if rows.counted is None and len(names) == 1:
        selected = _no_finer_than_explained(selected)
    if repeats:
        selected.report.notes.append(repeats)
    if not parts or len(names) > 1 or options.inputs != "auto":
        return _identified(selected)
    corner, reach = float(rows.lower[0]), float(rows.reach[0])
    dynamics = Dynamics(parts, corner, reach, len(force), periodic=options.period is not None)
    selected, terms = _with_dynamics(selected, dynamics)
    found = _identified(selected, terms, dynamics)
    damped = terms.names == ("damping",)
    if options.period is not None or not (damped or found.nrmse > USABLE_NRMSE):
        return found
    best, rows = selected.best, selected.rows
    residual = rows.force - dynamics.force_of(terms)[0] - best.force_at(rows.box)
    worth = WORTH_A_VELOCITY if damped else WORTH_FRICTION
    if best.strokes is not None and not damped:
        worth = WORTH_MORE_THAN_HYSTERESIS
    if dynamics.left_to_velocity(residual, rows.box, best.solution.basis, friction=not damped) < worth:
        return found
    return _over_velocity(selected, dynamics, found, residual, worth)


def _in_box(
    positions: Float2D,
    force: Float1D,
    side: Float1D | None,
    options: IdentifyOptions,
    starts: Sequence[int] | None,
    names: tuple[str, ...],
    weight: Float1D | None,
    within: float,
) -> tuple[BoxRows, str]:
    """The rows in the unit box, and a sentence on rows that repeat others."""
    lower, reach = positions.min(axis=0), np.ptp(positions, axis=0)
    if options.period is not None:
        reach = np.array([options.period])
    path = (positions - lower) / reach
    limits = RowLimits()
    if weight is None:
        noise = position_noise(positions[:, 0] / reach[0]) if positions.shape[1] == 1 else 0.0
        limits = RowLimits(force_error=STEP_ERROR * force_step(force), position_noise=noise)
    rows = BoxRows(
        names=names,
        positions=positions if options.period is None else lower + modulo(path) * reach,
        lower=lower,
        reach=reach,
        box=path if options.period is None else modulo(path),
        path=path[:, 0],
        force=force,
        side=None if side is None else np.sign(side).astype(float),
        starts=starts,
        weight=weight,
        counted=weight,
        within=within,
        limits=limits,
    )
    if weight is not None:
        return rows, ""
    again, repeats = repeated(positions, force, side)
    return (replace(rows, weight=np.where(again, 0.0, 1.0)) if repeats else rows), repeats


def _no_finer_than_explained(selected: Selected) -> Selected:
    """The model selected again with wide wavelets, if position cannot explain most of a large error.

    Rows that differ for another reason, such as time during a pause, differ by as much between neighbouring
    positions as anywhere: narrow wavelets then give slopes that the object does not have.
    """
    data, best = selected.rows, selected.best
    rows = data.reported
    force, side = data.force[rows], None if best.side is None else best.side[rows]
    spread = float(np.std(force))
    if best.rmse <= LARGE_ERROR * spread or best.n_wavelets == 0:
        return selected
    error = float(np.std(force - best.force_at(data.box)[rows])) / spread
    if unexplained_share(data.box[rows, 0], force, side) < most_of_error(error):
        return selected
    noise = max(LEAST_CORE / NOISE_WIDTHS, data.limits.position_noise)
    wide = selected.again(replace(data, limits=replace(data.limits, position_noise=noise)))
    wide.report.path[:0] = selected.report.path
    wide.report.notes.insert(
        0,
        f"wavelets narrower than {2 * LEAST_CORE:g} of the travel were not tried: position does not explain "
        "most of the error",
    )
    return wide


def _with_correlated_noise(selected: Selected) -> Selected:
    """The model selected again on fewer independent samples, if the noise is correlated in recorded order.

    Wavelets that follow the noise hide part of its correlation, so that it is estimated again after each
    selection. Of all results that one is taken whose prediction of a row, from the residual of the row
    before, is best for its size: an unfitted structure is correlated too, but the prediction from the force
    itself beats it.
    """
    data = selected.rows
    count = len(data.force)
    first_row = max(0, (count - MOST_ORDERED) // 2)
    rows = slice(first_row, first_row + MOST_ORDERED)
    used = np.ones(count, dtype=bool) if data.weight is None else data.weight > 0.0
    least = (RESOLVED * float(np.ptp(data.force))) ** 2 + np.finfo(float).tiny
    found = []
    current = selected
    for _ in range(CORRELATION_ROUNDS):
        best, limits = current.best, current.rows.limits
        residual = (data.force[rows] - best.force_at(data.box, rows))[used[rows]]
        found.append((innovation_deviance(residual, best.n_parameters, least), current))
        share = independent_share(correlation(residual))
        if share > WORTH_CLIMBING * limits.independent or share < LEAST_INDEPENDENT:
            break
        path = current.report.path
        current = current.again(replace(current.rows, limits=replace(limits, independent=share)))
        current.report.path[:0] = path
        current.report.notes.insert(
            0, f"the noise is correlated: {share * count:.4g} of {count} rows are independent"
        )
    chosen = min(found, key=lambda each: each[0])[1]
    full = selected.best.stop_reason == "max_wavelets"
    if full and 2 * chosen.best.n_wavelets > selected.best.n_wavelets:
        return selected  # what so many wavelets left is unfitted structure rather than noise
    return chosen


def _with_dynamics(selected: Selected, dynamics: Dynamics) -> tuple[Selected, Terms]:
    """The model selected again without what velocity and acceleration explain, if they are accepted."""
    data, options, best = selected.rows, selected.options, selected.best
    terms = dynamics.terms(best.solution.basis, best.side, options)
    selected.report.notes.extend(terms.notes)
    if not terms:
        return selected, terms
    notes, path = selected.report.notes, selected.report.path
    current, found = selected, terms
    for _ in range(DYNAMIC_ROUNDS):
        if min(value for value in (terms.damping, terms.mass) if value is not None) <= 0.0:
            break  # a passive object has none below zero: the values of the round before stay
        moving, known = dynamics.force_of(terms)
        weight = known if data.weight is None else known * data.weight
        still = replace(data, force=data.force - moving, weight=weight)
        current, found = current.again(still, keep=current is not selected), terms
        best = current.best
        terms = dynamics.terms(best.solution.basis, best.side, options, allowed=terms.names, settled=True)
    report = current.report
    report.notes[:0] = [*notes, f"without the force of {' and '.join(found.names)}:"]
    report.path[:0] = path
    best = replace(best, model_class=found.name, n_parameters=best.n_parameters + len(found))
    report.path.append(best.point(options.criterion))
    return replace(selected, climb=current.climb, best=best), found


def _over_velocity(
    selected: Selected, dynamics: Dynamics, below: FittedNetwork, residual: Float1D, worth: float
) -> FittedNetwork:
    """A network over position and velocity, if it lowers the squared residual (n,) by that share."""
    data = selected.rows
    velocity, known = dynamics.velocity()
    rows = known if data.weight is None else known & (data.weight > 0.0)
    both = _fitted(
        np.column_stack([data.positions, velocity])[rows],
        data.force[rows],
        None,
        selected.options,
        (0,),
        VELOCITY_INPUTS,
        None if data.weight is None else data.weight[rows],
        (),
        0.0,
    )
    before = float(np.mean(residual[rows] ** 2))
    share = 1.0 - both.rmse**2 / before if before > 0.0 else 0.0
    beside = (
        "beside a constant damping" if below.damping is not None else f"compared with {below.model_class}"
    )
    gains = f"a network over position and velocity lowers the squared error by {100 * share:.3g} % {beside}"
    if share < worth:
        note = f"velocity refused as an input: {gains}, it has to be {100 * worth:g} % or more"
        return replace(below, path=below.path + both.path, notes=(*below.notes, note))
    signs: tuple[Finding, ...] = tuple(selected.report.sign_findings)
    return replace(
        both,
        path=below.path + both.path,
        notes=(*below.notes, f"velocity accepted as an input: {gains}", *both.notes),
        findings=signs + both.findings,
    )


def _identified(
    selected: Selected, terms: Terms = NO_TERMS, dynamics: Dynamics | None = None
) -> FittedNetwork:
    """The accepted model in the units of the data, with its error on the rows."""
    data, best, options, report = selected.rows, selected.best, selected.options, selected.report
    near_zero = max(best.rmse, options.search.contact_share * float(np.ptp(data.force[data.reported])))
    notes, findings = report.notes, report.findings
    if (period := options.period) is not None:
        note, of_period = period_notes(data.lower[0] + data.reach[0] * data.path, period)
        notes, findings = [note, *notes], [*of_period, *findings]
    left_there = len(data.lower) == 1 and abs(best.at_lower) <= near_zero and period is None
    network = FittedNetwork.of(
        best.solution,
        best.problem.readout,
        data.lower,
        data.reach,
        inputs=data.names,
        below="free" if left_there else "linear",
        play_radius=None if best.play_radius is None else best.play_radius * float(data.reach[0]),
        mass=terms.mass,
        damping=terms.damping,
        model_class=best.model_class,
        stop_reason=best.stop_reason,
        n_parameters=best.n_parameters,
        rmse=best.rmse,
        path=tuple(report.path),
        notes=tuple(notes),
        findings=tuple(findings),
    )
    moving = dynamics.force_of(terms) if dynamics else None
    return judged_on_rows(network, best, data, selected.cells, moving, periodic=period is not None)


def _input_names(dimension: int) -> tuple[str, ...]:
    """Names for inputs that came without."""
    return ("position", *(f"input {k}" for k in range(2, dimension + 1)))
