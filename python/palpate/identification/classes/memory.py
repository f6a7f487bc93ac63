# SPDX-License-Identifier: Apache-2.0
"""Model class memory: how many branches that relax or slip the recordings support, and the force at rest.

Branches and wavelets of the ratio are added one at a time while the criterion decreases, and all are refined
after each. Then the force at rest is identified as any force of position.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..._core.model import Memory, wavelet_columns
from ..._typing import Float1D, Float2D
from ...recording import Recording
from ...recording.contact import contact_at
from ...recording.motion import FORCE_RESOLUTION, noise_band, ordered_strokes, states_its_order, velocities
from ...recording.roles import Role, roles_of
from ...recording.rows import of_each
from ...verdict import Finding, usable
from ..data.limits import LEAST_GAIN
from ..data.rows import Rows, rows_of
from ..fit import fit_rows
from ..log import Decision, Log, decided, lowered, not_tested, squared_error_change
from ..network.fitted import Errors, FittedNetwork
from ..network.separable import TINY
from ..options import IdentifyOptions
from ..search.evidence import deviance, on_fitted_rows
from .causes import first_strokes
from .class_selection import VELOCITY_INPUTS
from .findings import UNFIT_NRMSE, USABLE_NRMSE, drift_findings, judged_network, place_findings
from .memory_fit import CURVE_POINTS, MemoryFit, Motion, Ranges, Resting, Shape

MOST_ROWS = 12_000
"""Largest number of rows from which branches and ratio are chosen; of more rows an evenly spread part is
used."""

SPLINES = (4, 6, 8, 11, 15, 20, 28)
"""Numbers of B-splines of the force at rest that are tried while branches and ratio are chosen. Few rows of a
relaxation test determine the force at rest between its positions."""

MOST_BRANCHES = 6
"""Largest number of branches; the core allows 8."""

GRID_PER_DECADE = 3
"""Number of time constants, or of yield stretches, in a decade that are tried for a new branch."""

LEAST_CORRELATION = 0.1
"""Correlation of the residuals of neighbouring rows below which a memory is not tested [-], two standard
errors included. A branch decays by at most 40 % in a sample interval, because two intervals must resolve it.
Branches that explain the share LEAST_GAIN of the squared error therefore give a correlation of at least
0.15."""


@dataclass(frozen=True)
class Choice:
    """Fit with a number of splines for the force at rest, and the memory; None without branches."""

    splines: int
    """Index in SPLINES"""
    fit: MemoryFit
    shape: Shape | None = None

    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.fit.error(self.shape) ** 2)))


def grown(recorded: Recorded, options: IdentifyOptions) -> Choice:
    """Returns the branches, the ratio and the number of splines that the criterion accepts.

    All branches relax, or all slip: together they would fit friction that creeps in a pause, and predict
    other motions badly.
    """
    criterion = on_fitted_rows(options.criterion)
    kinds = [False] if recorded.ranges.log_tau is None else [True, False]
    found = [_grown(recorded, options, criterion, relaxes) for relaxes in kinds]
    rows = min(each.fit.independent(each.shape) for each in found)
    return min(found, key=lambda each: each.fit.value(each.shape, rows, criterion))


def _grown(recorded: Recorded, options: IdentifyOptions, criterion: str, relaxes: bool) -> Choice:
    """Returns the accepted choice of branches that all relax, or all slip."""
    best = Choice(0, recorded.fit(0))
    while True:
        expected = best.rms()
        current = replace(best, fit=recorded.fit(best.splines, expected))
        best, rows = current, current.fit.independent(current.shape)
        value = current.fit.value(current.shape, rows, criterion) - options.search.evidence
        for trial in _larger(current, recorded, relaxes):
            now = trial.fit.value(trial.shape, rows, criterion)
            if now < value:
                value, best = now, trial
        if best is current:
            break
    if best.shape is None:
        return best
    return replace(best, shape=best.fit.finished(best.shape, recorded.ranges))


def _larger(now: Choice, recorded: Recorded, relaxes: bool) -> Iterator[Choice]:
    """Yields refined memories with one more branch, one more term of the ratio, or more splines."""
    fit, shape, ranges = now.fit, now.shape, recorded.ranges

    def best(trials: Iterable[Shape]) -> Choice:
        return replace(now, shape=fit.refined(min(trials, key=fit.rss), ranges))

    for splines in range(now.splines + 1, len(SPLINES))[::2]:
        finer = Choice(splines, recorded.fit(splines, now.rms()), shape)
        yield finer if shape is None else replace(finer, shape=finer.fit.refined(shape, ranges))
    base = shape or Shape()
    if base.n_branches < MOST_BRANCHES:
        if relaxes and ranges.log_tau is not None:
            yield best(replace(base, log_tau=np.append(base.log_tau, at)) for at in _grid(*ranges.log_tau))
        else:
            grid = _grid(*ranges.log_yield)
            yield best(replace(base, log_yield=np.append(base.log_yield, at)) for at in grid)
    if shape is None:
        return
    if not shape.sloped and not len(shape.wavelets):
        yield best(replace(shape, sloped=True, slope=c) for c in (-1.0, 1.0))
    yield best(
        replace(shape, wavelets=np.vstack([shape.wavelets, [weight, beta, np.log(alpha)]]))
        for weight in (-0.5, 0.5)
        for beta in (0.0, 0.25, 0.5, 0.75, 1.0)
        for alpha in (1.5, 4.0, 10.0)
    )


def _grid(least: float, most: float) -> Float1D:
    """Returns evenly spread logarithms."""
    return np.linspace(least, most, max(2, 1 + round((most - least) / np.log(10.0) * GRID_PER_DECADE)))


def _splines(position: Float1D, count: int) -> Float2D:
    """Returns the columns (n, count) of cubic B-splines at positions (n,) in the unit box."""
    knots = np.r_[np.zeros(3), np.linspace(0.0, 1.0, count - 2), np.ones(3)]
    return np.asarray(scipy.interpolate.BSpline.design_matrix(position, knots, 3).toarray())


@dataclass(frozen=True)
class Recorded:
    """Recordings of one object, as shares of travel and spread."""

    recordings: Sequence[Recording]
    lower: float
    travel: float
    spread: float
    near_zero: float
    """Largest |force| without contact [force]; below 0 if the tool cannot leave the object"""
    left: str
    """Side on which the tool leaves the object, "below" or "above"; empty if it cannot"""
    below: str
    """Continuation of the force below the domain"""
    above: str
    """The same above the domain"""

    @classmethod
    def of(cls, recordings: Sequence[Recording], found: FittedNetwork, options: IdentifyOptions) -> Recorded:
        force = np.concatenate([part.force for part in recordings])
        position = np.concatenate([part.position for part in recordings])
        ends = [float(position.min()), float(position.max())]
        near_zero, left = options.search.contact_share * float(np.ptp(force)), ""
        outside = []
        # A network of several inputs does not state what is outside its domain.
        stated = found if len(found.lower) == 1 else options
        # An object that is pressed towards smaller positions is a mirror image: the tool leaves it above.
        for end, (side, into) in enumerate({"below": 1.0, "above": -1.0}.items()):
            free, chosen = getattr(stated, side) != "linear", getattr(options, side)
            if not left and free and (chosen == "free" or (into * force).min() >= -near_zero):
                left, ends[end] = side, into * contact_at(into * position, into * force)
            outside.append("free" if side == left or chosen == "free" else "linear")
        lower, upper = ends
        spread = float(np.std(force))
        return cls(recordings, lower, upper - lower, spread, near_zero if left else -1.0, left, *outside)

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """Rows of the recordings; of many rows an evenly spread part."""
        return tuple(self._motion(part) for part in self.recordings)

    @cached_property
    def every(self) -> slice:
        """Rows of each recording that are used."""
        return slice(None, None, max(1, -(-sum(map(len, self.recordings)) // MOST_ROWS)))

    def fitted(self, values: Sequence[NDArray[Any]]) -> NDArray[Any]:
        """Returns the values at the fitted rows, from those at all rows of each recording."""
        used = [each[self.every][m.touched] for each, m in zip(values, self.motions, strict=True)]
        return np.concatenate(used)

    @cached_property
    def moving(self) -> list[NDArray[np.bool_]]:
        """True for each row of each recording at which the tool moves; the other rows wait."""
        return [roles_of(part) == Role.MOVING for part in self.recordings]

    @cached_property
    def weight(self) -> Float1D:
        """Weight of each row of all recordings in the errors that are judged."""
        return balanced(np.concatenate(self.moving))

    @cached_property
    def judged_spread(self) -> float:
        """Standard deviation of the force with these weights [force]."""
        force = np.concatenate([part.force for part in self.recordings])
        return _rms(force - np.average(force, weights=self.weight), self.weight)

    def _motion(self, part: Recording) -> Motion:
        time, position, force = (
            values[self.every] for values in (part.time_or_row, part.position, part.force)
        )
        box = np.clip((position - self.lower) / self.travel, 0.0, 1.0)
        touched = np.abs(force) > self.near_zero
        touched[: np.argmax(touched)] = True  # before its first contact the object is at rest
        return Motion(time, box, force / self.spread, touched)

    @cached_property
    def ranges(self) -> Ranges:
        """Time constants and yield stretches that the recordings can resolve."""
        band = max(noise_band((part.position - self.lower) / self.travel) for part in self.recordings)
        timed = all(part.time is not None for part in self.recordings)
        return Ranges(self._log_tau() if timed else None, (float(np.log(min(band, 0.5))), 0.0))

    def _log_tau(self) -> tuple[float, float]:
        """Returns logarithms of the smallest and the largest time constant that the recordings can resolve
        [s]."""
        steps = np.concatenate(
            [
                np.diff(part.time)[np.abs(np.diff(part.position)) > 1e-4 * self.travel]
                for part in self.recordings
                if part.time is not None
            ]
        )
        longest = max(float(np.ptp(part.time)) for part in self.recordings if part.time is not None)
        shortest = 2.0 * float(np.median(steps)) if len(steps) else 0.01 * longest
        return float(np.log(min(shortest, 0.1 * longest))), float(np.log(longest))

    @cached_property
    def least(self) -> float:
        """Smallest mean squared error that the force sensor resolves."""
        force = np.concatenate([motion.force for motion in self.motions])
        return float((FORCE_RESOLUTION * np.ptp(force)) ** 2 + np.finfo(float).tiny)

    def fit(self, splines: int, rms: float = np.inf) -> MemoryFit:
        """Returns a fit with B-splines for the force at rest, for an expected RMS error."""
        return MemoryFit(self.motions, lambda box: _splines(box, SPLINES[splines]), self.least, rms)

    def at_rest(self, choice: Choice, options: IdentifyOptions) -> FittedNetwork:
        """Returns the force at rest as an identified network."""
        assert choice.shape is not None
        box = np.linspace(0.0, 1.0, CURVE_POINTS)
        count = SPLINES[choice.splines]
        curve = _splines(box, count) @ choice.fit.solved(choice.shape)[0]
        rows = Rows(
            ("position",),
            (self.lower + self.travel * box)[:, None],
            self.spread * curve,
            weight=np.full(CURVE_POINTS, choice.fit.n_rows / CURVE_POINTS),
            within=self.spread**2 * choice.fit.n_rows * choice.rms() ** 2,
            position_unit=self.recordings[0].file_unit("position"),
            force_unit=self.recordings[0].file_unit("force"),
        )
        most = min(options.max_wavelets, count)
        return fit_rows(rows, replace(options, inputs=("position",), max_wavelets=most))

    def wavelets(self, network: FittedNetwork) -> Resting:
        """Returns the columns of a network for the force at rest: wavelets, slope and constant."""

        def columns(box: Float1D) -> Float2D:
            x = self.lower + self.travel * box[:, None]
            return np.column_stack([wavelet_columns(x, network.alpha, network.beta), box, np.ones(len(x))])

        return columns

    def memory(self, shape: Shape, stiffness: Float1D) -> Memory:
        """Returns a memory in the units of the recordings, with its branches in order of time constant."""
        relaxes, slips = np.full(len(shape.log_tau), np.inf), np.full(len(shape.log_yield), np.inf)
        time_constant_s = np.append(np.exp(shape.log_tau), slips)
        yield_stretch = np.append(relaxes, self.travel * np.exp(shape.log_yield))
        order = np.lexsort([yield_stretch, time_constant_s])
        ratio = shape.ratio
        linear = ratio.linear / self.travel
        return Memory(
            alpha=ratio.alpha / self.travel,
            beta=self.lower + self.travel * ratio.beta,
            weight=ratio.weight,
            linear=linear,
            bias=ratio.bias - linear * self.lower,
            stiffness=stiffness[order] * self.spread / self.travel,
            time_constant_s=time_constant_s[order],
            yield_stretch=yield_stretch[order],
        )


def untested(found: FittedNetwork, recordings: Sequence[Recording], options: IdentifyOptions) -> str | None:
    """Returns the reason why a memory is not tested; an empty text if no decision is reported; None if it is
    tested."""
    automatic = options.inputs == "auto" and found.period is None
    in_order = all(part.time is not None or _in_order(part) for part in recordings)
    if not (automatic and in_order) or found.inputs not in (("position",), VELOCITY_INPUTS):
        return ""
    if any(len(part.input_names) for part in recordings) or not np.ptp(found.rows.force):
        return ""
    if found.inputs != VELOCITY_INPUTS:
        errors = found.errors
        every_second = 2 * errors.rows >= len(found.rows.force)
        upper = errors.correlation + 2.0 / np.sqrt(max(errors.rows, 1))
        if every_second and upper < LEAST_CORRELATION:
            return (
                "the error of the model without memory is noise: residuals of neighbouring rows have a "
                f"correlation below {upper:.2g}, a memory needs {LEAST_CORRELATION:g}"
            )
    if options.slope_limits is not None or options.fixed_force is not None:
        return "constraints of the slope or of a force are not imposed on a memory"
    return None


def _in_order(recording: Recording) -> bool:
    """True if the rows of a recording without time are in the order of a motion."""
    stated = recording.direction is not None
    return states_its_order(recording) if stated else ordered_strokes(recording) is not None


def better_with_memory(
    found: FittedNetwork, recordings: Sequence[Recording], options: IdentifyOptions
) -> FittedNetwork:
    """Returns the model with memory if the recordings support it, else the model found without memory."""
    reason = untested(found, recordings, options)
    if reason:
        found.log.decisions.append(Decision("memory", "not tested", reason))
    if reason is not None:
        return found
    tried = _with_memory(found, recordings, options)
    if isinstance(tried, FittedNetwork):
        return tried
    found.log.decisions.append(decided("memory", False, tried))
    return found


def _with_memory(
    found: FittedNetwork, recordings: Sequence[Recording], options: IdentifyOptions
) -> FittedNetwork | str:
    """Returns the model with memory, or the reason why it is not accepted."""
    recorded = Recorded.of(recordings, found, options)
    choice = grown(recorded, options)
    if choice.shape is None:
        return "no branch lowers the criterion"
    compared = _Compared.of(found, recorded)
    judged = judged_network(found, found.rows) if found.shows_all(recordings) else None
    first = first_strokes(judged) if judged else None
    moved = judged.changed if judged and first is None else 0.0
    before = max(compared.rmse**2 * (1.0 - moved), TINY) / recorded.spread**2
    in_sample = 1.0 - _rms(choice.fit.error(choice.shape), compared.balance) ** 2 / before
    over_velocity = "velocity" in found.inputs
    if in_sample < LEAST_GAIN and not over_velocity:
        return _gain_text(in_sample, 0.0, moved)
    at_rest = replace(recorded.at_rest(choice, options), below=recorded.below, above=recorded.above)
    fit = MemoryFit(recorded.motions, recorded.wavelets(at_rest), recorded.least, choice.rms())
    refined = fit.finished(choice.shape, recorded.ranges)
    if refined is None:
        return "no branch lowers the criterion"
    if len(refined.log_yield) == 1:
        return "one branch that slips is a play operator, as hysteresis has"
    coefficients, stiffness = fit.solved(refined)
    network = replace(
        at_rest,
        weight=recorded.spread * coefficients[:-2],
        linear=recorded.spread / recorded.travel * coefficients[-2:-1],
        bias=recorded.spread * float(coefficients[-1] - coefficients[-2] * recorded.lower / recorded.travel),
        memory=recorded.memory(refined, stiffness),
    )
    residual = recorded.spread * fit.error(refined)
    error, where_sure = _rms(residual, compared.weight), _rms(residual, compared.sure)
    law = network.force_model()
    of_rows = np.concatenate(
        [part.force - law.force_over_time(part.time_or_row, part.position)[0] for part in recordings]
    )
    of_all = _rms(of_rows, recorded.weight)
    if of_all > UNFIT_NRMSE * recorded.judged_spread:
        nrmse = of_all / recorded.judged_spread
        return f"contact is lost while the tool presses: NRMSE {nrmse:.3g}, at most {UNFIT_NRMSE:g} is usable"
    if len(refined.log_yield):
        # Waits do not change a branch that slips, and a play operator keeps its state without contact.
        error = max(where_sure, of_all)
        before = max(compared.rmse_where_sure**2 * (1.0 - moved), TINY) / recorded.spread**2
    # A network of velocity, which is as hard to render, is not preferred to a memory that is good in motion.
    allowed = USABLE_NRMSE * recorded.spread if over_velocity else 0.0
    if where_sure**2 > max((1.0 + LEAST_GAIN) * compared.rmse_where_sure**2, allowed**2):
        # The pauses of friction that creeps would accept a model that is wrong while the tool moves.
        change = recordings[0].file_unit("force").interval(compared.rmse_where_sure, where_sure)
        return (
            f"if the force creeps between press and release in pauses, it raises the RMS error from {change}"
        )
    held_out = fit.held_out_errors(refined, compared.balance)
    left_out_nrmse = float(np.sqrt(held_out.mean()))
    gain = 1.0 - max(error / recorded.spread, left_out_nrmse) ** 2 / before
    scatter = float(held_out.std(ddof=1)) / before / np.sqrt(len(held_out)) if len(held_out) > 1 else 0.0
    n_parameters = network.n_parameters + refined.n_parameters
    text = _gain_text(gain, scatter, moved)
    accepted = gain - scatter >= LEAST_GAIN
    if over_velocity:
        # Both are as hard to render. At one speed both fit the same recording, a branch with fewer numbers.
        n = min(found.independent_rows, fit.n_rows)
        errors = (before, found.n_parameters), (before * (1.0 - gain), n_parameters)
        falls = -float(np.diff([deviance("bic", n * square, n, p) for square, p in errors])[0])
        text = f"{lowered('BIC', falls)}, must lower it by at least {options.search.evidence:.4g}"
        accepted = falls >= options.search.evidence
    if not accepted:
        return text
    if first is not None:
        parts = zip(recordings, of_each(recordings, first), strict=True)
        others = [part.without(rows) for part, rows in parts]
        later = fit_rows(rows_of(others, options), options)
        alone = _Compared.of(later, Recorded.of(others, later, options))
        of_later = alone.rmse_where_sure if len(refined.log_yield) else alone.rmse
        # The first strokes would need as many numbers again.
        n = min(later.independent_rows, fit.n_rows)
        falls = deviance("bic", n * error**2, n, n_parameters)
        falls -= deviance("bic", n * of_later**2, n, 2 * later.n_parameters)
        if falls >= options.search.evidence:
            return f"without the first strokes over their places, which differ, {lowered('BIC', -falls)}"
    nrmse = of_all / recorded.judged_spread
    left_out_nrmse *= recorded.spread / recorded.judged_spread
    network = replace(
        network,
        rows=found.rows,
        model_class="memory",
        n_parameters=n_parameters,
        errors=Errors(
            of_all,
            nrmse,
            left_out_nrmse,
            settled_nrmse=(nrmse, left_out_nrmse),
            rows=len(of_rows),
            residual=of_rows,
            share=np.ones(len(of_rows)),
        ),
        log=Log(
            found.log.path + network.log.path,
            [*found.log.decisions, decided("memory", True, text)],
            found.log.rows,
            [*found.log.notes, *_branches(recorded, refined)],
            list(_undetermined(found, recordings)),
        ),
    )
    relaxing = judged_network(network, rows_of(recordings, options))
    findings = drift_findings(relaxing) or place_findings(relaxing)
    if recorded.left and 2.0 * error**2 <= of_all**2 and (findings or nrmse > USABLE_NRMSE):
        findings = [_forgotten(recorded, of_all, error)]
    network.log.findings.extend(findings)
    return network


def _branches(recorded: Recorded, shape: Shape) -> Iterator[str]:
    """Yields notes on the time constants and yield stretches of a memory, and on those that the recordings
    resolve."""
    if len(shape.log_tau) and recorded.ranges.log_tau is not None:
        shortest, longest = np.exp(recorded.ranges.log_tau)
        found = ", ".join(f"{tau:.3g}" for tau in np.sort(np.exp(shape.log_tau)))
        yield (
            f"Time constants between {shortest:.2g} and {longest:.2g} s are resolved by the recordings; "
            f"found: {found} s."
        )
    if len(shape.log_yield):
        position = recorded.recordings[0].file_unit("position")
        found = ", ".join(position.text(recorded.travel * most) for most in np.sort(np.exp(shape.log_yield)))
        yield f"The loops grow with the distance moved: the branches slip from stretches of {found} on."


def _undetermined(found: FittedNetwork, recordings: Sequence[Recording]) -> Iterator[Finding]:
    """Yields a finding if neither pauses nor different speeds show whether the force depends on time."""
    for decision in not_tested("damping", found.log.decisions):
        if not any((roles_of(part) == Role.HOLD).any() for part in recordings):
            yield usable(
                "the rows do not show whether the force relaxes with time or depends on earlier motion, as "
                f"friction and plasticity do: the tool never waits in contact, and {decision.reason}. Cure: "
                "wait in contact for some seconds, or record slow and fast strokes"
            )


def _forgotten(recorded: Recorded, of_all: float, in_contact: float) -> Finding:
    """Returns a finding on a model whose error comes from the rows behind those without contact: where the
    tool leaves the object, the branches are released, because a branch that stays stretched would pull the
    tool. The errors are RMS errors."""
    force = recorded.recordings[0].file_unit("force")
    return usable(
        "the model forgets how far the object had relaxed when the tool leaves it and returns: the RMS error "
        f"is {force.text(of_all)}, in contact {force.text(in_contact)}. Cure: stay in contact, or give "
        f"--{recorded.left} linear, with which the model remembers but pulls the tool"
    )


def _gain_text(gain: float, error: float, moved: float) -> str:
    change = squared_error_change(gain, error)
    compared = " compared with a zero or an object that changes" if moved else ""
    return f"{change}{compared}, must lower it by at least {100.0 * LEAST_GAIN:g} %"


@dataclass(frozen=True)
class _Compared:
    """Rows on which a memory is compared with the model without it, and the errors of the latter."""

    balance: Float1D
    """(n,) 1 for a row that moves; rows that wait count together at most as much"""
    weight: Float1D
    """(n,) weight in the fit without memory, times that of rows that wait"""
    sure: Float1D
    """(n,) the same, and 0 without force and for a wait between press and release, where friction may
    creep"""
    rmse: float
    """[force]"""
    rmse_where_sure: float
    """[force]"""

    @classmethod
    def of(cls, found: FittedNetwork, recorded: Recorded) -> _Compared:
        parts, errors = recorded.recordings, found.errors
        force, position = (
            recorded.fitted([getattr(part, name) for part in parts]) for name in ("force", "position")
        )
        moving = recorded.fitted(recorded.moving)
        balance = balanced(moving)
        if "velocity" in found.inputs:
            speed, known = (recorded.fitted(list(each)) for each in zip(*velocities(parts), strict=True))
            share, outside = known.astype(float), np.zeros(len(force))
            residual = force - found.force(np.column_stack([position, speed]), None)
        elif not found.shows_all(parts):
            whole, rmse = np.array(1.0), _rms(errors.residual, errors.share)
            return cls(balance, whole, whole, rmse, rmse)
        else:
            residual, share = (
                recorded.fitted(of_each(parts, each)) for each in (errors.residual, errors.share)
            )
            strokes = [found.force(position[:, None], np.full(len(force), side)) for side in (1.0, -1.0)]
            outside = force - np.clip(force, np.minimum(*strokes), np.maximum(*strokes))
        share = share * balance
        sure = share * (moving | (outside != 0.0)) * (np.abs(force) > recorded.near_zero)
        return cls(
            balance, share, sure, _rms(residual, share), _rms(np.where(moving, residual, outside), sure)
        )


def _rms(residual: Float1D, weight: NDArray[Any]) -> float:
    """Returns the RMS of residuals (n,) with weights (n,) or one weight; 0 without a weight above 0."""
    total = float(np.sum(np.broadcast_to(weight, residual.shape)))
    return float(np.sqrt(np.sum(weight * residual**2) / total)) if total else 0.0


def balanced(moving: NDArray[np.bool_]) -> Float1D:
    """Returns the weight of each row (n,): 1 while the tool moves. Rows that wait count together at most as
    much as these, because their number only shows how long the tool waited."""
    moves = int(np.count_nonzero(moving))
    waits = len(moving) - moves
    return np.where(moving, 1.0, min(1.0, moves / waits) if moves and waits else 1.0)
