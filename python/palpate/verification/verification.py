# SPDX-License-Identifier: Apache-2.0
"""Verification: a model beside a recording, best one that it has not seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from .._typing import Float1D
from ..arguments import instance_of
from ..errors import InputError
from ..identification.data.rows import require_in_range
from ..model import Model
from ..recording import Recording, Source
from ..recording.given import Given, recording_from
from ..verdict import GOOD, Verdict
from .judgement import findings_of
from .metrics import durbin_watson, lag_one_autocorrelation, normalised, root_mean_square
from .perception import force_floor, share_within_force_jnd, share_within_stiffness_jnd
from .prediction import Prediction, predict


@dataclass(frozen=True)
class Verification:
    """How far a model is from a recording. Forces are in the recording's unit (`units`)."""

    nrmse: float
    """RMSE over the population standard deviation of the recorded force, on the evaluated rows"""
    rmse: float
    mse: float
    r2: float
    """1 - nrmse^2"""
    worst: float
    """Largest absolute error"""
    within_jnd: float
    """Share of samples within 7 % of the local force, or within `jnd_floor`"""
    jnd_floor: float
    """1 % of the largest |force| of the evaluated rows"""
    stiffness_within_jnd: float | None
    """Share of position cells whose stiffness is within 23 %; None where no cell holds enough rows"""
    whiteness: float
    """Lag-1 autocorrelation of the residuals in recorded order: 0 is white"""
    durbin_watson: float
    """2 is white"""
    n: int
    """Evaluated rows"""
    fresh: bool
    """The model was not identified on this data"""
    extrapolated: int
    """Evaluated rows outside the model's domain"""
    units: Mapping[str, str]
    notes: tuple[str, ...] = ()
    verdict: Verdict = GOOD
    """Judges the model on the recording, with likely causes of a large error"""
    prediction: Prediction = field(repr=False, compare=False, kw_only=True)
    """The model's force at the evaluated rows"""
    residual: Float1D = field(repr=False, compare=False, kw_only=True)
    """(n,) the model's force minus the recorded one"""

    @property
    def rows(self) -> NDArray[np.bool_]:
        """(rows of the recording,) which of them were evaluated"""
        return self.prediction.rows

    @property
    def force(self) -> Float1D:
        """(n,) the model's force at the evaluated rows"""
        return self.prediction.force


def verify(
    model: Model,
    recording: Given | npt.ArrayLike,
    force: npt.ArrayLike | None = None,
    *,
    time: npt.ArrayLike | None = None,
    direction: npt.ArrayLike | None = None,
    play_radius: float | None = None,
) -> Verification:
    """Compares a model with a recording, row by row.

    Parameters
    ----------
    model : Model
        The identified model.
    recording : Recording, path, DataFrame or (n,) array_like
        The recording; ``fresh`` in the result is true if the model was not identified on it. With `force` it
        is the array of positions.
    force, time, direction : (n,) array_like, optional
        As in :func:`palpate.identify`.
    play_radius : float, optional
        Play radius of a hysteresis model [m or rad]. With it the play operator follows the positions and a
        direction in the recording is not used. Without it and without a direction, the radius is that of the
        flight record, the model or its plan, else 1 % of the model's travel; the notes say which.

    Returns
    -------
    Verification
        Errors, the share that a hand would not feel, residual whiteness, freshness, and the verdict.

    Raises
    ------
    InputError
        The recording lacks an input or a direction that the model needs, or is in other units.
    """
    instance_of("model", model, Model, "make one with palpate.identify or palpate.load_model")
    recording = recording_from(recording, force, time, direction, inputs=columns_of(model))
    require_in_range("position", recording.position)
    require_in_range("force", recording.force)
    prediction = predict(model, recording, play_radius=play_radius)
    rows = prediction.rows
    reference = recording.force[rows]
    residual = prediction.force - reference
    if not np.isfinite(residual).all():
        raise InputError("the model's force is not a finite number at every row of the recording")
    rmse = root_mean_square(residual)
    nrmse = normalised(rmse, reference)
    fresh = is_fresh(model.data, recording.source)
    notes = prediction.notes
    if not fresh:
        notes += ("the model was identified on this data: this is not a fresh recording",)
    found = Verification(
        nrmse=nrmse,
        rmse=rmse,
        mse=rmse**2,
        r2=1 - nrmse**2,
        worst=float(np.abs(residual).max()),
        within_jnd=share_within_force_jnd(reference, residual),
        jnd_floor=force_floor(reference),
        stiffness_within_jnd=_stiffness_share(recording, rows, residual),
        whiteness=lag_one_autocorrelation(residual),
        durbin_watson=durbin_watson(residual),
        n=len(residual),
        fresh=fresh,
        extrapolated=prediction.extrapolated,
        units=dict(recording.units),
        notes=notes,
        prediction=prediction,
        residual=residual,
    )
    return replace(found, verdict=Verdict(findings_of(model, recording, found)))


def columns_of(model: Model) -> list[str]:
    """Columns that the model's inputs beside the position have in a file; a velocity may come from time."""
    known = model.data.columns
    return [known.get(name, name) for name in model.inputs[1:] if name != "velocity" or name in known]


def is_fresh(identified_on: Source, data: Source) -> bool:
    """Whether a model has not seen the data: another file, or the rows held out of the same one."""
    same_file = not set(data.sha256.split()).isdisjoint(identified_on.sha256.split())
    held_out = data.held_out and data.held_out_every == identified_on.held_out_every
    return not same_file or held_out


def _stiffness_share(recording: Recording, rows: NDArray[np.bool_], residual: Float1D) -> float | None:
    """Mean of the strokes' shares, each stroke having a stiffness of its own."""
    position, reference = recording.position[rows], recording.force[rows]
    strokes = np.zeros(len(position)) if recording.direction is None else recording.direction[rows]
    shares = [
        share_within_stiffness_jnd(position[strokes == s], reference[strokes == s], residual[strokes == s])
        for s in np.unique(strokes)
    ]
    known = [share for share in shares if share is not None]
    return float(np.mean(known)) if known else None
