# SPDX-License-Identifier: Apache-2.0
"""fit_environment: from arrays to an identified force law."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D, Float2D
from ..errors import InputError
from ..recording.motion import Piece
from ..verdict import Finding
from .dynamics import NO_TERMS, Dynamics, Terms
from .explained import enough, explained_findings, unexplained_share
from .growth import PathPoint
from .identified import IdentifiedNetwork, Readings
from .judgement import USABLE_NRMSE
from .ladder import Ladder
from .limits import (
    MOST_ORDERED,
    NO_LIMITS,
    STEP_ERROR,
    RowLimits,
    correlation,
    force_step,
    independent_share,
    innovation_deviance,
    position_noise,
    repeated,
)
from .options import IdentifyOptions
from .periodic import modulo, require_one_input, turns_of
from .robust import Robust, robust_weights, suspects
from .row_error import RowError, beyond_rows, disagreement, modelled
from .rung import Rung
from .scaling import ForceScale
from .separable import NOISE_WIDTHS, RESOLVED
from .stopping import ON_FRESH_ROWS
from .usable import require_usable

VELOCITY_INPUTS = ("position", "velocity")
"""Inputs of a force that depends on the motion."""

DYNAMIC_ROUNDS = 2
"""Times that the ladder is climbed again beside velocity and mass, on ever better values of theirs."""

WORTH_A_VELOCITY = 0.05
"""Share of the squared error that velocity as an input must take away beside a constant damping: a force of
two inputs is harder to render."""

CORRELATION_ROUNDS = 5
"""Times that the correlation of noise is estimated at most."""

LEAST_INDEPENDENT = 0.02
"""Independent samples per sample below which a residual is memory or drift rather than noise [-]"""

LARGE_ERROR = 0.2
"""NRMSE above which wavelets stay wide if position cannot explain most of it [-]"""

LEAST_CORE = 1.0 / 64.0
"""Half of the core of these wavelets, as a share of the travel [-]"""

WORTH_CLIMBING = 0.8
"""Ratio of the independent samples to those before from which the ladder is not climbed again [-]"""
WORTH_FRICTION = 0.25
"""The same where no constant damping was found, such as for Coulomb friction: its sign changes with that of
the velocity."""

WORTH_MORE_THAN_HYSTERESIS = 0.75
"""The same where hysteresis was accepted, which is easier to render and certify."""

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
    parts: Sequence[Piece] = (),
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
    parts : sequence of Piece
        The motion between gaps of time, for velocity, mass and damping (d = 1).

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
    if len(names) > 1 and (options.slope_limits is not None or options.fixed_force is not None):
        raise InputError(
            "slope_bounds, monotone, coupling_stiffness and fixed_force are for a force over position alone, "
            f"not over {', '.join(names)}"
        )
    if options.period is not None:
        require_one_input(names)
    if scale := ForceScale.of(force, options):
        return scale.unscaled(
            fit_environment(
                positions,
                scale.scaled(force),
                side,
                scale.scaled_options(options),
                starts=starts,
                names=names,
                weight=weight,
                within=within * scale.factor**2,
                parts=[replace(part, force=scale.scaled(part.force)) for part in parts],
            )
        )
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


@dataclass(frozen=True)
class _Data:
    """What is identified, rows in the unit box."""

    lower: Float1D
    reach: Float1D
    positions: Float2D
    """(n, d) in the unit of the recording"""
    box: Float2D
    path: Float1D
    """(n,) positions as they were moved through, not taken modulo a period"""
    force: Float1D
    side: Float1D | None
    starts: Sequence[int] | None
    weight: Float1D | None
    names: tuple[str, ...]
    options: IdentifyOptions
    within: float
    """Sum of squares inside rows that stand for several samples [force^2]"""
    counted: Float1D | None
    """(n,) samples that each row stands for in the error that is reported; None: 1"""
    robust: Robust | None = None
    """Outliers, where the loss is Huber's"""
    limits: RowLimits = NO_LIMITS
    """What limits the information in the rows"""

    @property
    def reported(self) -> NDArray[np.bool_]:
        """(n,) rows that count in the error."""
        rows = np.ones(len(self.force), dtype=bool) if self.counted is None else self.counted > 0.0
        return rows if self.robust is None else rows & ~self.robust.outliers

    def climbed(self, cells: int, before: Ladder | None = None) -> tuple[Ladder, Rung]:
        """The highest rung that earned its place, with positions in at most that many cells."""
        ladder = Ladder(
            self.box,
            self.force,
            self.weight,
            self.side,
            self.starts,
            self.options,
            path=self.path,
            network=_network_rung(self.names),
            lower=float(self.lower[0]),
            reach=float(self.reach[0]),
            max_positions=cells,
            within=self.within,
            before=before,
            limits=self.limits,
        )
        return ladder, ladder.climb()


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
) -> IdentifiedNetwork:
    """Climb with cells that are fine enough, outliers weighed down if asked for; then velocity and mass."""
    lower, reach = positions.min(axis=0), np.ptp(positions, axis=0)
    if options.period is not None:
        reach = np.array([options.period])
    path = (positions - lower) / reach
    data = _Data(
        lower,
        reach,
        positions if options.period is None else lower + modulo(path) * reach,
        path if options.period is None else modulo(path),
        path[:, 0],
        force,
        None if side is None else np.sign(side).astype(float),
        starts,
        weight,
        names,
        options,
        within,
        counted=weight,
        limits=NO_LIMITS if weight is not None else _limits(positions, reach, force),
    )
    repeats = ""
    if weight is None:
        again, repeats = repeated(positions, force, side)
        if repeats:
            weight = np.where(again, 0.0, 1.0)
            data = replace(data, weight=weight)
    cells = options.max_positions * 2 ** (positions.shape[1] - 1)
    if options.loss == "huber":
        suspect = suspects(data.box, force, data.side, weight)
        data = replace(data, weight=np.where(suspect, 0.0, 1.0 if weight is None else weight))
    ladder, best = data.climbed(cells)
    for _ in range(MOST_HALVINGS):
        if not best.cells_too_wide():
            break
        cells *= 2
        ladder, best = data.climbed(cells, ladder)
    if options.loss == "huber":

        def fit(weights: Float1D) -> Rung:
            return replace(data, weight=weights).climbed(cells, ladder)[1]

        robust = robust_weights(fit, best, data.box, force, weight, suspect)
        data = replace(data, weight=robust.weight, robust=robust)
        ladder, best = data.climbed(cells, ladder)
        ladder.notes.append(robust.note)
    if data.counted is None and options.criterion not in ON_FRESH_ROWS:
        data, ladder, best = _with_correlated_noise(data, cells, ladder, best)
    if data.counted is None and len(names) == 1:
        data, ladder, best = _no_finer_than_explained(data, cells, ladder, best)
    if repeats:
        ladder.notes.append(repeats)
    if not parts or len(names) > 1 or options.inputs != "auto":
        return _identified(best, NO_TERMS, ladder, data, cells)
    dynamics = Dynamics(
        parts, float(lower[0]), float(reach[0]), len(force), periodic=options.period is not None
    )
    ladder, best, terms = _with_dynamics(data, cells, dynamics, ladder, best)
    found = _identified(best, terms, ladder, data, cells, dynamics)
    damped = terms.names == ("damping",)
    if options.period is not None or not (damped or found.nrmse > USABLE_NRMSE):
        return found
    residual = data.force - dynamics.force_of(terms)[0] - best.modelled(data.box)
    worth = WORTH_A_VELOCITY if damped else WORTH_FRICTION
    if best.strokes is not None and not damped:
        worth = WORTH_MORE_THAN_HYSTERESIS
    left = dynamics.left_to_velocity(residual, data.box, best.solution.basis, friction=not damped)
    if left < worth:
        return found
    return _over_velocity(data, dynamics, found, residual, worth, tuple(ladder.sign_findings))


def _limits(positions: Float2D, reach: Float1D, force: Float1D) -> RowLimits:
    """What limits the information in rows in recorded order, before any fit."""
    noise = position_noise(positions[:, 0] / reach[0]) if positions.shape[1] == 1 else 0.0
    return RowLimits(force_error=STEP_ERROR * force_step(force), position_noise=noise)


def _no_finer_than_explained(
    data: _Data, cells: int, ladder: Ladder, best: Rung
) -> tuple[_Data, Ladder, Rung]:
    """The ladder climbed again with wide wavelets, if most of a large error is not position's to explain.

    Rows that differ for another reason, such as time during a pause, differ by as much between neighbouring
    positions as anywhere: narrow wavelets then give slopes that the object does not have.
    """
    rows = data.reported
    force, side = data.force[rows], None if best.side is None else best.side[rows]
    spread = float(np.std(force))
    if best.rmse <= LARGE_ERROR * spread or len(best.solution.basis) == 0:
        return data, ladder, best
    error = float(np.std(force - best.modelled(data.box)[rows])) / spread
    if unexplained_share(data.box[rows, 0], force, side) < enough(error):
        return data, ladder, best
    noise = max(LEAST_CORE / NOISE_WIDTHS, data.limits.position_noise)
    data = replace(data, limits=replace(data.limits, position_noise=noise))
    path = ladder.path
    ladder, best = data.climbed(cells)
    ladder.path[:0] = path
    ladder.notes.insert(
        0,
        f"wavelets narrower than {2 * LEAST_CORE:g} of the travel were not tried: most of the "
        "error is not explained by position",
    )
    return data, ladder, best


def _with_correlated_noise(data: _Data, cells: int, ladder: Ladder, best: Rung) -> tuple[_Data, Ladder, Rung]:
    """The ladder climbed again on fewer independent samples, if the noise is correlated in recorded order.

    Wavelets that follow the noise hide part of its correlation, so that it is estimated again after each
    climb. Of all results that one is taken whose prediction of a row, from the residual of the row before, is
    best for its size: an unfitted structure is correlated too, but the prediction from the force itself beats
    it.
    """
    count = len(data.force)
    rows = slice(max(0, (count - MOST_ORDERED) // 2), max(0, (count - MOST_ORDERED) // 2) + MOST_ORDERED)
    used = np.ones(count, dtype=bool) if data.weight is None else data.weight > 0.0
    least = (RESOLVED * float(np.ptp(data.force))) ** 2 + np.finfo(float).tiny
    found = []
    for _ in range(CORRELATION_ROUNDS):
        residual = (data.force[rows] - best.modelled(data.box, rows))[used[rows]]
        found.append((innovation_deviance(residual, best.n_parameters, least), data, ladder, best))
        share = independent_share(correlation(residual))
        if share > WORTH_CLIMBING * data.limits.independent or share < LEAST_INDEPENDENT:
            break
        data = replace(data, limits=replace(data.limits, independent=share))
        path = ladder.path
        ladder, best = data.climbed(cells)
        ladder.path[:0] = path
        ladder.notes.insert(
            0, f"the noise is correlated: {share * count:.4g} of {count} rows are independent"
        )
    first, chosen = found[0], min(found, key=lambda each: each[0])
    full = first[3].stop_reason == "max_wavelets"
    if full and 2 * len(chosen[3].solution.basis) > len(first[3].solution.basis):
        chosen = first  # what so many wavelets left is unfitted structure rather than noise
    return chosen[1:]


def _with_dynamics(
    data: _Data, cells: int, dynamics: Dynamics, ladder: Ladder, best: Rung
) -> tuple[Ladder, Rung, Terms]:
    """The ladder climbed again without what velocity and acceleration explain, if they earn their place."""
    terms = dynamics.terms(best.solution.basis, best.side, data.options)
    ladder.notes.extend(terms.notes)
    if not terms:
        return ladder, best, terms
    notes, path = ladder.notes, ladder.path
    again = None
    found = terms
    for _ in range(DYNAMIC_ROUNDS):
        if min(value for value in (terms.damping, terms.mass) if value is not None) <= 0.0:
            break  # a passive object has none below zero: the values of the round before stay
        moving, known = dynamics.force_of(terms)
        weight = known if data.weight is None else known * data.weight
        ladder, best = replace(data, force=data.force - moving, weight=weight).climbed(cells, again)
        again, found = ladder, terms
        terms = dynamics.terms(
            best.solution.basis, best.side, data.options, allowed=terms.names, settled=True
        )
    ladder.notes[:0] = [*notes, f"without the force of {' and '.join(found.names)}:"]
    ladder.path[:0] = path
    best = replace(best, name=found.name, n_parameters=best.n_parameters + len(found))
    point = PathPoint(best.name, len(best.solution.basis), best.rmse, best.criterion(data.options))
    ladder.path.append(point)
    return ladder, best, found


def _over_velocity(
    data: _Data,
    dynamics: Dynamics,
    below: IdentifiedNetwork,
    residual: Float1D,
    worth: float,
    signs: tuple[Finding, ...],
) -> IdentifiedNetwork:
    """A network over position and velocity, if it lowers the squared residual (n,) by that share.

    signs are findings on the signs of position and force, which hold for it as well.
    """
    velocity, known = dynamics.velocity()
    rows = known if data.weight is None else known & (data.weight > 0.0)
    both = _fitted(
        np.column_stack([data.positions, velocity])[rows],
        data.force[rows],
        None,
        data.options,
        (0,),
        VELOCITY_INPUTS,
        None if data.weight is None else data.weight[rows],
        (),
        0.0,
    )
    before = float(np.mean(residual[rows] ** 2))
    share = 1.0 - both.rmse**2 / before if before > 0.0 else 0.0
    beside = "beside a constant damping" if below.damping is not None else f"compared with {below.rung}"
    said = f"a network over position and velocity lowers the squared error by {100 * share:.3g} % {beside}"
    if share < worth:
        note = f"velocity refused as an input: {said}, it has to be {100 * worth:g} % or more"
        return replace(below, path=below.path + both.path, notes=(*below.notes, note))
    return replace(
        both,
        path=below.path + both.path,
        notes=(*below.notes, f"velocity taken as an input: {said}", *both.notes),
        findings=signs + both.findings,
    )


def _identified(
    rung: Rung,
    terms: Terms,
    ladder: Ladder,
    data: _Data,
    cells: int,
    dynamics: Dynamics | None = None,
) -> IdentifiedNetwork:
    """The rung in the units of the data, with its error on the rows."""
    lower, reach, force = data.lower, data.reach, data.force
    law = Readings.of(rung.solution, rung.problem.readout, lower, reach)
    two = len(law.bias) == 2
    near_zero = max(rung.rmse, data.options.contact_share * float(np.ptp(force[data.reported])))
    period, notes, findings = data.options.period, ladder.notes, ladder.findings
    if period is not None:
        turns = turns_of(lower[0] + reach[0] * data.path, period)
        notes, findings = [turns.note, *notes], [*turns.findings, *findings]
    left_there = len(lower) == 1 and abs(law.at_lower) <= near_zero and period is None
    network = IdentifiedNetwork(
        inputs=data.names,
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
        mass=terms.mass,
        damping=terms.damping,
        rung=rung.name,
        stop_reason=rung.stop_reason,
        n_parameters=rung.n_parameters,
        rmse=rung.rmse,
        nrmse=0.0,
        path=tuple(ladder.path),
        notes=tuple(notes),
        findings=tuple(findings),
    )
    return _judged_on_rows(network, rung, data, cells, dynamics.force_of(terms) if dynamics else None)


def _judged_on_rows(
    network: IdentifiedNetwork,
    rung: Rung,
    data: _Data,
    cells: int,
    moving: tuple[Float1D, Float1D] | None,
) -> IdentifiedNetwork:
    """The network with the error that its evaluator leaves on the rows, and the findings on this error.

    moving: force of mass and damping (n,), and 1 in the rows where it is known, else 0.
    """
    residual = data.force - modelled(network, data.positions, rung.side)
    counted = np.ones(len(residual)) if data.counted is None else data.counted
    fitted = np.ones(len(residual)) if data.weight is None else data.weight
    if moving is not None:
        residual, counted, fitted = residual - moving[0], counted * moving[1], fitted * moving[1]
    if rung.strokes is not None:
        counted, fitted = counted * rung.strokes.known, fitted * rung.strokes.known
    findings = []
    if data.robust is not None:
        counted = np.where(data.robust.outliers, 0.0, counted)
        findings += data.robust.findings(residual)
    error = RowError(residual, data.force, counted, data.within)
    on_fitted = RowError(residual, data.force, fitted, data.within)
    findings += [*error.findings(), *disagreement(on_fitted, rung.rmse, float(data.reach[0]), cells)]
    findings += beyond_rows(network, data.force[counted > 0.0], repeats=data.options.period is not None)
    if data.counted is None and len(data.names) == 1:
        rows = np.flatnonzero(counted)
        side = None if rung.side is None else rung.side[rows]
        findings += explained_findings(
            data.positions[rows, 0], data.force[rows], residual[rows], side, error.nrmse
        )
    return replace(
        network,
        rmse=error.rmse,
        nrmse=error.nrmse,
        independent_rows=rung.problem.independent,
        findings=(*network.findings, *findings),
    )


def _network_rung(names: tuple[str, ...]) -> str:
    """Name of the rung that a network over these inputs is."""
    return "velocity" if names == VELOCITY_INPUTS else "position" if len(names) == 1 else "network"


def _input_names(dimension: int) -> tuple[str, ...]:
    """Names for inputs that came without."""
    return ("position", *(f"input {k}" for k in range(2, dimension + 1)))
