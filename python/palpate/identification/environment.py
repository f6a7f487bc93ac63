# SPDX-License-Identifier: Apache-2.0
"""fit_environment: from arrays to an identified force law."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .._typing import Float1D, Float2D
from ..errors import InputError
from ..recording.motion import Piece
from .dynamics import NO_TERMS, Dynamics, Terms
from .growth import PathPoint
from .identified import IdentifiedNetwork, Readings
from .ladder import Ladder
from .options import IdentifyOptions
from .robust import robust_weights
from .rung import Rung
from .usable import require_usable

VELOCITY_INPUTS = ("position", "velocity")
"""Inputs of a force that depends on the motion."""

DYNAMIC_ROUNDS = 2
"""Times that the ladder is climbed again beside velocity and mass, on ever better values of theirs."""

WORTH_A_VELOCITY = 0.05
"""Share of the squared error that velocity as an input must take away beside a constant damping: a force of
two inputs is harder to render."""

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
    return replace(every_row, path=found.path + every_row.path, notes=found.notes + every_row.notes)


@dataclass(frozen=True)
class _Data:
    """What is identified, rows in the unit box."""

    lower: Float1D
    reach: Float1D
    box: Float2D
    force: Float1D
    side: Float1D | None
    starts: Sequence[int] | None
    weight: Float1D | None
    names: tuple[str, ...]
    options: IdentifyOptions
    within: float
    """Sum of squares inside rows that stand for several samples [force^2]"""

    def climbed(self, cells: int, before: Ladder | None = None) -> tuple[Ladder, Rung]:
        """The highest rung that earned its place, with positions in at most that many cells."""
        ladder = Ladder(
            self.box,
            self.force,
            self.weight,
            self.side,
            self.starts,
            self.options,
            network=_network_rung(self.names),
            lower=float(self.lower[0]),
            reach=float(self.reach[0]),
            max_positions=cells,
            within=self.within,
            before=before,
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
    data = _Data(
        lower,
        reach,
        (positions - lower) / reach,
        force,
        None if side is None else np.sign(side).astype(float),
        starts,
        weight,
        names,
        options,
        within,
    )
    cells = options.max_positions * 2 ** (positions.shape[1] - 1)
    ladder, best = data.climbed(cells)
    for _ in range(MOST_HALVINGS):
        if not best.cells_too_wide():
            break
        cells *= 2
        ladder, best = data.climbed(cells, ladder)
    if options.loss == "huber":

        def fit(weights: Float1D) -> Rung:
            return replace(data, weight=weights).climbed(cells, ladder)[1]

        weights, note = robust_weights(fit, best, data.box, force, weight)
        data = replace(data, weight=weights)
        ladder, best = data.climbed(cells, ladder)
        ladder.notes.append(note)
    if not parts or len(names) > 1 or options.inputs != "auto":
        return _identified(best, NO_TERMS, ladder, data)
    dynamics = Dynamics(parts, float(lower[0]), float(reach[0]), len(force))
    ladder, best, terms = _with_dynamics(data, cells, dynamics, ladder, best)
    found = _identified(best, terms, ladder, data)
    if terms.names != ("damping",):
        return found
    residual = data.force - dynamics.force_of(terms)[0] - best.modelled(data.box)
    if dynamics.left_to_velocity(residual, data.box, best.solution.basis) < WORTH_A_VELOCITY:
        return found
    return _over_velocity(data, dynamics, found)


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
    for _ in range(DYNAMIC_ROUNDS):
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


def _over_velocity(data: _Data, dynamics: Dynamics, damped: IdentifiedNetwork) -> IdentifiedNetwork:
    """A network over position and velocity, where it says clearly more than a constant damping."""
    velocity, known = dynamics.velocity()
    rows = known if data.weight is None else known & (data.weight > 0.0)
    positions = data.lower + data.box * data.reach
    both = _fitted(
        np.column_stack([positions, velocity])[rows],
        data.force[rows],
        None,
        data.options,
        None,
        VELOCITY_INPUTS,
        None if data.weight is None else data.weight[rows],
        (),
        0.0,
    )
    share = 1.0 - (both.rmse / damped.rmse) ** 2 if damped.rmse > 0.0 else 0.0
    said = f"a network over position and velocity lowers the squared error by {100 * share:.3g} %"
    if share < WORTH_A_VELOCITY:
        note = f"velocity refused as an input: {said}, it has to be {100 * WORTH_A_VELOCITY:g} % or more"
        return replace(damped, path=damped.path + both.path, notes=(*damped.notes, note))
    note = f"velocity taken as an input: beside a constant damping {said}"
    return replace(both, path=damped.path + both.path, notes=(*damped.notes, note, *both.notes))


def _identified(
    rung: Rung,
    terms: Terms,
    ladder: Ladder,
    data: _Data,
) -> IdentifiedNetwork:
    """The rung in the units of the data."""
    lower, reach, force = data.lower, data.reach, data.force
    law = Readings.of(rung.solution, rung.problem.readout, lower, reach)
    two = len(law.bias) == 2
    spread = float(np.std(force))
    near_zero = max(rung.rmse, data.options.contact_share * float(np.ptp(force)))
    left_there = len(lower) == 1 and abs(law.at_lower) <= near_zero
    return IdentifiedNetwork(
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
        nrmse=rung.rmse / spread if spread > 0 else 0.0,
        path=tuple(ladder.path),
        notes=tuple(ladder.notes),
    )


def _network_rung(names: tuple[str, ...]) -> str:
    """Name of the rung that a network over these inputs is."""
    return "velocity" if names == VELOCITY_INPUTS else "position" if len(names) == 1 else "network"


def _input_names(dimension: int) -> tuple[str, ...]:
    """Names for inputs that came without."""
    return ("position", *(f"input {k}" for k in range(2, dimension + 1)))
