# SPDX-License-Identifier: Apache-2.0
"""Comparison of all baselines on one recording: fitted to the model's rows, judged on held-out rows."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D, Float2D
from ..errors import InputError
from ..recording import Recording
from ..recording.motion import velocity
from ..recording.roles import Role, roles_of
from ..verification.metrics import normalised, root_mean_square
from .methods import (
    Estimator,
    HuntCrossley,
    LinearZones,
    LookupTable,
    PerStroke,
    SmoothingSpline,
    TissueParameters,
)


@dataclass(frozen=True)
class Compared:
    """Result of one baseline on held-out rows."""

    name: str
    nrmse: float
    """RMS error divided by the standard deviation of the force on the held-out rows [-]; NaN if the fit was
    refused"""
    n_parameters: int
    seconds: float
    """Duration of the fit of this baseline, including the choice of its settings [s]"""
    refused: str | None = None
    """Reason why the baseline could not be fitted"""


PASSIVE_SPLINE = "smoothing spline, two strokes, h >= 0"
"""Name of the baseline of two splines in which the press force is never below the release force, for a fair
comparison with a passive model."""

LEAST_STROKE_SHARE = 0.1
"""Least share of the travel that press and release must each cover; otherwise a baseline is fitted to both
strokes together [-]."""


def baselines(strokes: bool) -> dict[str, Estimator]:
    """Returns every baseline by name; if `strokes` is True, each baseline has separate fits for press and
    release."""
    single: dict[str, Estimator] = {
        "linear zones (Haptic Camera)": LinearZones(),
        "tissue parameters": TissueParameters(),
        "Hunt-Crossley": HuntCrossley(),
        "lookup table": LookupTable(),
        "smoothing spline": SmoothingSpline(),
    }
    if not strokes:
        return single
    pairs: dict[str, Estimator] = {f"{name}, two strokes": PerStroke(each) for name, each in single.items()}
    return {**pairs, PASSIVE_SPLINE: PerStroke(SmoothingSpline(), passive=True)}


def comparable(recording: Recording) -> NDArray[np.bool_]:
    """Returns the rows (n,) of a recording to which baselines are fitted and on which they are judged."""
    return _columns(recording, _has_strokes(recording))[1]


def compare(recordings: Sequence[Recording], every: int) -> list[Compared]:
    """Fits each baseline to all rows except every `every`-th row, and computes its error on the excluded
    rows.

    If the recordings distinguish strokes, each baseline is fitted to press and release separately. These are
    two fits, but the identified model is a single one. Rows without a direction are left out.
    """
    strokes = all(map(_has_strokes, recordings))
    tables = [_columns(part, strokes) for part in recordings]
    width = min(X.shape[1] for X, _ in tables)
    # the stroke is the last column; velocity and acceleration are columns only if every recording has them
    X = np.concatenate([table[:, [*range(width - strokes), *([-1] * strokes)]] for table, _ in tables])
    y = np.concatenate([part.force for part in recordings])
    used = np.concatenate([rows for _, rows in tables])
    held_out = np.concatenate([np.arange(len(part)) % every == every - 1 for part in recordings])
    train, test = used & ~held_out, used & held_out
    return [
        _compared(name, each, (X[train], y[train]), (X[test], y[test]))
        for name, each in baselines(strokes).items()
    ]


def _compared(
    name: str, estimator: Estimator, train: tuple[Float2D, Float1D], test: tuple[Float2D, Float1D]
) -> Compared:
    start = time.perf_counter()
    try:
        fitted = estimator.fit(*train)
    except (ValueError, np.linalg.LinAlgError) as error:
        return Compared(name, float("nan"), 0, time.perf_counter() - start, str(error))
    seconds = time.perf_counter() - start
    rest = fitted.predict(test[0]) - test[1]
    nrmse = normalised(root_mean_square(rest), test[1])
    return Compared(name, nrmse, fitted.n_parameters_, seconds)


def _has_strokes(recording: Recording) -> bool:
    """Returns True if press and release of the recording each cover at least LEAST_STROKE_SHARE of the
    travel."""
    if recording.direction is None:
        return False
    strokes = [recording.position[recording.direction == side] for side in (1, -1)]
    least = LEAST_STROKE_SHARE * float(np.ptp(recording.position))
    return all(len(stroke) > 0 and float(np.ptp(stroke)) >= least for stroke in strokes)


def _columns(recording: Recording, strokes: bool) -> tuple[Float2D, NDArray[np.bool_]]:
    """Returns the inputs of the baselines as columns (position; velocity, acceleration and stroke if known),
    and the usable rows: those in which the tool moves near the object, to which a model is fitted too."""
    columns = [recording.position]
    rows = roles_of(recording, float(recording.position.max())) == Role.MOVING
    if recording.time is not None:
        try:
            speed, known = velocity(recording)
        except InputError:
            pass
        else:
            columns += [speed, np.gradient(speed, recording.time)]
            rows &= known
    if strokes:
        assert recording.direction is not None
        columns.append(recording.direction.astype(np.float64))
        rows &= recording.direction != 0
    return np.column_stack(columns), rows
