# SPDX-License-Identifier: Apache-2.0
"""Model selection of one recording: all model classes, repeated if correlated noise requires it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ...recording.motion import FORCE_RESOLUTION
from ..data.limits import (
    LEAST_GAIN,
    LEAST_INDEPENDENT_SHARE,
    MOST_COMPARED_ROWS,
    correlation,
    independent_share,
    innovation_deviance,
)
from ..data.rows import Rows
from ..log import Log, decided, in_words, lowered
from ..options import IdentifyOptions
from ..search.evidence import ON_HELD_OUT_ROWS, Candidate
from .causes import FASTER
from .class_selection import (
    REGROWTH_ERROR_RATIO,
    VELOCITY_INPUTS,
    ClassSelection,
    linear,
    network,
)
from .findings import USABLE_NRMSE, judged_candidate
from .hysteresis import hysteresis
from .shift import shift_of

SETTLED_INDEPENDENT_RATIO = 0.8
"""Ratio of the new to the previous share of independent rows, above which the model selection is not repeated
[-]."""


def select(rows: Rows, options: IdentifyOptions) -> ClassSelection:
    """Selects a model: first the model classes without velocity, mass and damping, then those with them."""
    found = correlated_noise(ClassSelection(rows.limited(), options, STATIC_CLASSES))
    found.try_classes(DYNAMIC_CLASSES)
    return found


def correlated_noise(first: ClassSelection) -> ClassSelection:
    """Selects the model again with fewer independent samples if the noise is correlated in recorded order.

    Wavelets that fit noise hide a part of its correlation, so that the correlation is estimated again after
    each selection. The result is the model with the best BIC of the residuals after each residual is
    predicted from the previous one. An unfitted part of the force is correlated too, but a model that fits
    this part predicts better.
    """
    data = first.data
    if data.counted is not None or first.options.criterion in ON_HELD_OUT_ROWS:
        return first
    count = len(data.force)
    first_row = max(0, (count - MOST_COMPARED_ROWS) // 2)
    rows = slice(first_row, first_row + MOST_COMPARED_ROWS)
    used = np.ones(count, dtype=bool) if data.weight is None else data.weight > 0.0
    least = (FORCE_RESOLUTION * float(np.ptp(data.force))) ** 2 + np.finfo(float).tiny
    found = []
    current = first
    while True:
        best, limits = current.best, current.data.limits
        residual = (data.force[rows] - best.force_at(rows))[used[rows]]
        found.append((innovation_deviance(residual, best.n_parameters, least), current))
        share = independent_share(correlation(residual))
        if share > SETTLED_INDEPENDENT_RATIO * limits.independent or share < LEAST_INDEPENDENT_SHARE:
            break
        repeated = current.repeated(replace(current.data, limits=replace(limits, independent=share)))
        note = f"The noise is correlated: {count} rows count as {share * count:.4g} independent rows."
        repeated.log.path[:0] = current.log.path
        repeated.log.notes.insert(0, note)
        current = repeated
    return min(found, key=lambda each: each[0])[1]


def mass_and_damping(selection: ClassSelection, below: Candidate) -> Candidate:
    """Fits mass and damping, then selects the model again on the force without their forces.

    Wavelets that fit inertia hide a part of it. Mass and damping are fitted again with the wavelets of
    the last selection until their force no longer changes the error.
    """
    motion, data = selection.motion, selection.data
    if motion is None:
        return below
    found, log, change = below, Log(), math.inf
    while True:
        values, decisions, findings = motion.accepted(found.solution.basis, found.strokes)
        moving = motion.moving(values)
        if not values or min(values.values()) <= 0.0 or not moving.known.any():
            found = below  # a passive object has no negative mass or damping
            break
        step = moving.force - (0.0 if found.moving is None else found.moving.force)
        last, change = change, float(np.sqrt(np.mean(step[moving.known > 0.0] ** 2)))
        settled = math.hypot(found.rmse, change) <= REGROWTH_ERROR_RATIO * found.rmse
        if found is not below and (settled or change >= last):
            break
        weight = moving.known if data.weight is None else moving.known * data.weight
        again = selection.repeated(replace(data, force=data.force - moving.force, weight=weight))
        log = again.log
        found = replace(
            again.best,
            model_class="velocity" if moving.mass is None else "mass and damping",
            data=data,
            n_parameters=again.best.n_parameters + len(values),
            moving=moving,
        )
    selection.log.decisions.extend(decisions)
    if found is below:
        selection.log.findings = selection.log.findings or findings
        return below
    note = f"The model was selected again after the force of {' and '.join(values)} was subtracted."
    selection.log.notes.append(note)
    selection.log.extend(log)
    selection.log.findings = findings or log.findings
    return selection.recorded(found)


def velocity(selection: ClassSelection, below: Candidate) -> Candidate:
    """Fits the model class velocity, a network over position and velocity, for damping or friction that
    depends on both.

    It must decrease the squared error enough; a periodic model has none.
    """
    data, log, motion, moving = selection.data, selection.log, selection.motion, below.moving
    if motion is None or not motion.accelerates or data.period is not None:
        return below
    damped = moving is not None and moving.mass is None
    residual = below.static_force - below.force_at()
    judged = judged_candidate(below)
    cause = judged.cause
    if cause is None or not (cause.by == FASTER and cause.perceptible and cause.share >= LEAST_GAIN):
        if not (damped or below.settled.nrmse > USABLE_NRMSE):
            return below
        if motion.share_of_velocity(residual, below.solution.basis) < LEAST_GAIN:
            return below
    speed, rows = motion.velocity()
    if not rows.any():
        return below
    over_both = Rows(
        VELOCITY_INPUTS,
        np.column_stack([data.positions, speed])[rows],
        data.force[rows],
        starts=(0,),
        weight=None if data.weight is None else data.weight[rows],
        role=data.roles[rows],
        log=data.log,
        repeats=None if data.repeats is None else data.repeats.only(rows),
        position_unit=data.position_unit,
        force_unit=data.force_unit,
    )
    both = select(over_both, selection.options)
    squares = below.fit_weight * residual**2
    before, unknown = float(np.sum(squares)), float(np.sum(squares[~rows]))  # the latter have no velocity
    after = float(below.fit_weight[rows] @ both.best.residual**2)
    constant = moving is not None and moving.damping is not None
    compared = "constant damping" if constant else in_words(below.model_class)
    if shift := selection.once(shift_of):
        # A network that is grown without the shift explains as much as the velocity of a late force.
        moved = shift.without
        grown = selection.growth.grow(moved.problem, moved.solution.basis, below.model_class)
        unshifted = (grown.problem.rmse(grown.solution) / shift.before) ** 2
        before, unknown = before * unshifted, unknown * unshifted
        compared = f"{compared} with shifted strokes"
    if judged.changed:
        before, unknown = before * (1.0 - judged.changed), unknown * (1.0 - judged.changed)
        compared = f"{compared} and a zero or an object that changes"
    share = 1.0 - (after + unknown) / before if before > 0.0 else 0.0
    change = f"{lowered('the squared error', 100 * share)} % compared with {compared}"
    bound = f"must lower it by at least {100 * LEAST_GAIN:g} %"
    decision = decided("velocity", share >= LEAST_GAIN, f"{change}, {bound}")
    if share < LEAST_GAIN:
        log.path += both.log.path
        log.decisions.append(decision)
        return below
    log.notes += [f"Over position and velocity: {each}." for each in both.log.decisions]
    log.extend(replace(both.log, decisions=[decision]))
    return both.best


STATIC_CLASSES = (linear, network, hysteresis)
"""Model classes other than constant that do not depend on velocity, the simplest first."""

DYNAMIC_CLASSES = (mass_and_damping, velocity)
"""Model classes with velocity, mass or damping, tried last."""
