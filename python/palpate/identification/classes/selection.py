# SPDX-License-Identifier: Apache-2.0
"""The model selection of one recording, with fine cells and with outliers weighed down if asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..._typing import Float1D
from ..data.outliers import robust_weights, suspects
from ..options import IdentifyOptions
from ..search.evidence import Candidate, Report
from .climb import BoxRows, Climb, ModelClass
from .hysteresis import Hysteresis
from .position import Constant, Linear, Network

VELOCITY_INPUTS = ("position", "velocity")
"""Inputs of a force that depends on the motion."""

MOST_HALVINGS = 3
"""Times that cells are halved at most."""


@dataclass(frozen=True)
class Selected:
    """The candidate that a climb accepted, and how to climb again."""

    rows: BoxRows
    options: IdentifyOptions
    cells: int
    climb: Climb
    best: Candidate

    @classmethod
    def of(
        cls,
        rows: BoxRows,
        options: IdentifyOptions,
        cells: int,
        before: Climb | None = None,
        *,
        on_held_out: bool = True,
    ) -> Selected:
        """Climbs over the rows, positions in at most that many cells."""
        climb = Climb(rows, options, cells, before, on_held_out=on_held_out)
        return cls(rows, options, cells, climb, climb.best(model_classes(climb)))

    @property
    def report(self) -> Report:
        return self.climb.report

    def again(self, rows: BoxRows, *, keep: bool = False) -> Selected:
        """Climbs over changed rows. With keep, growth begins where this climb ended."""
        before = self.climb if keep else None
        on_held_out = self.climb.judge.on_held_out
        return Selected.of(rows, self.options, self.cells, before, on_held_out=on_held_out)


def model_classes(climb: Climb) -> list[ModelClass]:
    """The model classes that the options and the rows allow, the simplest first."""
    names = climb.data.names
    network = {("position",): "position", VELOCITY_INPUTS: "velocity"}.get(names, "network")
    classes: list[ModelClass] = [Constant(climb), Linear(climb)]
    if climb.options.max_wavelets > 0:
        classes.append(Network(climb, network))
    if Hysteresis.possible(climb):
        classes.append(Hysteresis(climb))
    return classes


def select(rows: BoxRows, options: IdentifyOptions, *, on_held_out: bool = True) -> Selected:
    """Selects a model with cells that are fine enough, with outliers weighed down if the loss is Huber's."""
    cells = options.search.max_positions * 2 ** (rows.box.shape[1] - 1)
    given, robust = rows.weight, options.loss == "huber"
    if robust:
        suspect = suspects(rows.box, rows.force, rows.side, given)
        rows = replace(rows, weight=np.where(suspect, 0.0, 1.0 if given is None else given))
    found = Selected.of(rows, options, cells, on_held_out=on_held_out)
    for _ in range(MOST_HALVINGS):
        if not found.best.cells_too_wide():
            break
        found = replace(found, cells=2 * found.cells).again(rows, keep=True)
    if not robust:
        return found

    def fit(weight: Float1D) -> Float1D:
        return found.again(replace(rows, weight=weight), keep=True).best.force_at(rows.box)

    weights = robust_weights(fit, found.best.force_at(rows.box), rows.force, given, suspect)
    found = found.again(replace(rows, weight=weights.weight, robust=weights), keep=True)
    found.report.notes.append(weights.note)
    return found
