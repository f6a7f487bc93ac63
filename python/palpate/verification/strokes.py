# SPDX-License-Identifier: Apache-2.0
"""Direction of a recording that states neither direction nor time, for a model with hysteresis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model import Model
from ..recording import Recording
from ..recording.strokes import ordered_strokes, turns_of


def with_strokes(model: Model, recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The recording with the strokes that its order of rows gives, and a note; else as it is.

    Used where the model differs between press and release, and neither time nor a play radius is known. A
    recording that never turns back may be sorted by position: it is the stroke whose force is nearer.
    """
    known = recording.direction is not None or recording.time is not None or model.play_radius is not None
    if known or not model.hysteretic:
        return recording, ()
    direction = ordered_strokes(recording)
    if direction is None:
        return recording, ()
    turns = turns_of(direction)
    if turns:
        note = f"direction is taken from the order of rows: {turns} turn{'s' * (turns != 1)}"
        return replace(recording, direction=direction), (note,)

    def error(side: int) -> float:
        modelled = model.force(recording.position, direction=np.full(len(recording), float(side)))
        return float(np.sum((modelled - recording.force) ** 2))

    side = 1 if error(1) <= error(-1) else -1
    word = "press" if side > 0 else "release"
    note = f"the position never turns back: all rows are taken as {word}, whose force in the model is nearer"
    return replace(recording, direction=np.full(len(recording), side, dtype=np.int8)), (note,)
