# SPDX-License-Identifier: Apache-2.0
"""Verification: comparison of a model with a recording, preferably a fresh one, and its verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from .._typing import Float1D
from ..arguments import instance_of
from ..errors import InputError
from ..frames import pd
from ..html_table import Curve, html_table
from ..identification.classes.findings import USABLE_NRMSE, error_findings, error_text
from ..identification.classes.memory import balanced
from ..identification.data.rows import require_in_range
from ..identification.data.strokes import weights_of_shared_errors
from ..identification.options import SearchOptions
from ..identification.search.evidence import RowError
from ..model import Model
from ..model.band import BAND_LEVEL
from ..recording import Recording, Source
from ..recording.checks import quality_findings
from ..recording.files import free_name
from ..recording.motion import ordered_strokes
from ..recording.reading import RecordingLike, recording_from
from ..recording.roles import Informative, Role, roles_of
from ..recording.units import COLUMN_SUFFIX, Unit
from ..verdict import GOOD, Finding, Verdict, no, usable
from .explanation import explanation
from .metrics import (
    Stroke,
    durbin_watson,
    force_floor,
    lag_one_autocorrelation,
    mean_forces,
    most_noticed,
    normalised,
    noticed_findings,
    root_mean_square,
    share_within_force_jnd,
    share_within_stiffness_jnd,
)
from .prediction import Prediction, flight_of, predict

FEW_OUTSIDE = 0.01
"""Share of rows outside the model's domain above which the result is usable with a reservation [-]."""

MOST_OUTSIDE = 0.5
"""Share of rows outside the model's domain above which the model is unfit for the recording [-]."""

LEAST_COMPARED_SHARE = 0.5
"""Share of compared rows below which a comparison does not represent the recording [-]."""

LEAST_SHARE_IN_BAND = 0.5
"""Share of rows in the band of the model below which the recording is not one of the same object [-]. The
rows of one recording differ from the model in a similar way, so that single repeats can have fewer than 95
%."""

STRUCTURED_CORRELATION = 0.5
"""Lag-1 autocorrelation above which the error is structured [-]."""


@dataclass(frozen=True)
class Verification:
    """Errors of a model on a recording. Forces are in the recording's unit (`units`)."""

    nrmse: float
    """RMS error divided by the population standard deviation of the recorded force, on the evaluated rows
    [-]"""
    rmse: float
    mse: float
    r2: float
    """1 - nrmse^2"""
    worst: float
    """Largest absolute error"""
    within_jnd: float
    """Share of samples within 7 % of the local force, or within `jnd_floor`"""
    jnd_floor: float
    """Smallest just noticeable difference: 1 % of the largest |force| of the evaluated rows"""
    stiffness_within_jnd: float | None
    """Share of position cells in which the stiffness of the model is within 23 % of the recorded stiffness;
    None if no cell has enough rows"""
    whiteness: float
    """Lag-1 autocorrelation of the residuals in recorded order: 0 for white noise"""
    durbin_watson: float
    """2 is white"""
    n: int
    """Number of evaluated rows of the recording"""
    fresh: bool
    """True if the model was not identified on the rows of this recording"""
    extrapolated: int
    """Number of evaluated rows at which the tool moves and the force is extrapolated: outside the model's
    domain, except in the air in which the model states that the force is zero"""
    units: Mapping[str, str]
    notes: tuple[str, ...] = ()
    verdict: Verdict = GOOD
    """Verdict on the model for this recording, with likely causes of a large error"""
    prediction: Prediction = field(repr=False, compare=False, kw_only=True)
    """Force of the model at the evaluated rows"""
    residual: Float1D = field(repr=False, compare=False, kw_only=True)
    """(n,) force of the model minus the recorded one"""
    weight: Float1D = field(repr=False, compare=False, kw_only=True)
    """(n,) weight of each evaluated row in the error that the verdict uses, from 0 to 1"""
    band: Float1D | None = field(repr=False, compare=False, kw_only=True)
    """(n,) half width of the band of the model about its force; None without band"""
    recording: Recording = field(repr=False, compare=False, kw_only=True)
    """The recording with which the model was compared, with all its rows"""
    dropped: tuple[str, ...] = field(default=(), kw_only=True)
    """Sentences on rows that are dropped, such as wrong readings"""

    @property
    def rows(self) -> NDArray[np.bool_]:
        """(n,) True for the evaluated rows of the recording"""
        return self.prediction.rows

    @property
    def force(self) -> Float1D:
        """(n,) force of the model at the evaluated rows"""
        return self.prediction.force

    @property
    def strokes(self) -> tuple[Stroke, ...]:
        """Recorded and modelled force along each stroke, as means over cells of the positions"""
        return self._strokes(np.ones(self.n, dtype=bool))

    @property
    def judged_strokes(self) -> tuple[Stroke, ...]:
        """The same without the rows behind turns that share an error"""
        return self.strokes if self.prediction.side is None else self._strokes(self.weight == 1.0)

    def _strokes(self, kept: NDArray[np.bool_]) -> tuple[Stroke, ...]:
        recording, rows = self.recording, np.flatnonzero(self.rows)[kept]
        side = self.prediction.side if recording.direction is None else recording.direction[self.rows]
        side = None if side is None else side[kept]
        return mean_forces(recording.position[rows], side, recording.force[rows], self.force[kept])

    @property
    def settled_nrmse(self) -> float:
        """NRMSE that the verdict uses: as `nrmse`, but rows behind turns share an error if the direction of
        the model changes at once there [-]"""
        whole = bool((self.weight == 1.0).all())
        return self.nrmse if whole else errors_of([self])[1].nrmse

    @property
    def file_units(self) -> tuple[Unit, Unit]:
        """Units of position and force in the file of the recording"""
        return self.recording.file_unit("position"), self.recording.file_unit("force")

    @property
    def within_band(self) -> float | None:
        """Share of samples in the band of the model, which should contain 95 % of the rows of a further
        recording of the object; None without band"""
        return None if self.band is None else float(np.mean(np.abs(self.residual) <= self.band))

    @property
    def compared(self) -> Recording:
        """The evaluated rows of the recording."""
        return self.recording.without(~self.rows)

    def summary(self) -> dict[str, str]:
        """Returns the main numbers in the units of the recording's file for display, by name."""
        recording = self.recording
        position_unit, force_unit = self.file_units
        worst = int(np.argmax(np.abs(self.residual)))
        position = position_unit.text(float(recording.position[self.rows][worst]))
        band = {} if self.within_band is None else {"band": f"{self.within_band:.1%} of the rows are inside"}
        return {
            "error": f"RMS {force_unit.text(self.rmse)}, "
            + error_text(self.nrmse, self.settled_nrmse, f"{self.n} rows"),
            "largest": f"{force_unit.text(self.worst)} in one row, at position {position}",
            "felt": most_noticed(self.strokes).noticed(position_unit, force_unit),
            **band,
            "rows": f"{self.n} of {len(recording)} compared, {self.extrapolated} extrapolated",
            **({"dropped": " ".join(self.dropped).removesuffix(".")} if self.dropped else {}),
            "recording": self._freshness,
        }

    @property
    def _freshness(self) -> str:
        if not self.fresh:
            return "not fresh: the model was identified on this recording"
        return "held-out rows, new to the model" if self.recording.source.held_out else "fresh"

    def to_frame(self) -> pd.DataFrame:
        """Returns the evaluated rows with the model's force, as a DataFrame.

        The columns are those of :meth:`palpate.Recording.to_frame`, then ``modelled_force_N`` and
        ``residual_N`` (modelled minus recorded force) in the recording's unit of force.
        :meth:`palpate.Recording.from_frame` reads the recording back exactly, with both as further columns.
        """
        frame = self.compared.to_frame()
        suffix = COLUMN_SUFFIX.get(self.units["force"], "")
        for stem, values in (("modelled_force", self.force), ("residual", self.residual)):
            frame[free_name(stem, f"_{suffix}" if suffix else "", frame.columns)] = values
        return frame

    def _repr_html_(self) -> str:
        recording = self.compared
        curves = [
            Curve(recording.position, recording.force, "dots"),
            Curve(recording.position, self.force, "dots"),
        ]
        return html_table("Verification", self.verdict, self.summary(), curves)


def verify(
    model: Model,
    recording: RecordingLike | npt.ArrayLike,
    force: npt.ArrayLike | None = None,
    *,
    time: npt.ArrayLike | None = None,
    direction: npt.ArrayLike | None = None,
    play_radius: float | None = None,
) -> Verification:
    """Compares a model with a recording, row by row, as an identification states its error: wrong readings
    are dropped first, and rows that wait are not compared.

    Parameters
    ----------
    model : Model
        The identified model.
    recording : Recording, path, DataFrame or (n,) array_like
        The recording, or the array of positions if `force` is given. ``fresh`` in the result is true if the
        model was not identified on it.
    force, time, direction : (n,) array_like, optional
        As in :func:`palpate.identify`.
    play_radius : float, optional
        Play radius of a hysteresis model [m or rad]. With it the play operator follows the positions, and a
        direction in the recording is ignored. Without it and without a direction, given or from the order of
        rows, the radius is that of the flight record, the model or its plan, else 1 % of the model's travel;
        the notes report its origin.

    Returns
    -------
    Verification
        Errors, the share of rows within the just noticeable difference, residual whiteness, freshness, and
        the verdict.

    Raises
    ------
    InputError
        The recording lacks an input or a direction that the model needs, or is in other units.
    """
    instance_of("model", model, Model, "make one with palpate.identify or palpate.load_model")
    recording = recording_from(recording, force, time, direction, inputs=columns_of(model))
    require_in_range("position", recording.position)
    require_in_range("force", recording.force)
    informative, prediction, weight = _compared(model, recording, play_radius)
    (recording,) = informative.given
    rows, dropped = prediction.rows, tuple(informative.notes)
    informative.drop_approach()
    reference = recording.force[rows]
    residual = prediction.force - reference
    if not np.isfinite(residual).all():
        raise InputError("the force of the model is not finite in every row of the recording")
    rmse = root_mean_square(residual)
    nrmse = normalised(rmse, reference)
    fresh = is_fresh(model.data, recording.source)
    notes = dropped + prediction.notes
    if not fresh:
        notes += ("The model was identified on this recording: this is not a fresh recording.",)
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
        extrapolated=int(np.count_nonzero(prediction.extrapolated)),
        units=dict(recording.units),
        notes=notes,
        prediction=prediction,
        residual=residual,
        weight=weight,
        dropped=dropped,
        band=model.band_half_width(prediction.position),
        recording=recording,
    )
    return replace(found, verdict=Verdict(findings_of(model, found, informative.recordings[0])))


def _compared(
    model: Model, recording: Recording, play_radius: float | None = None
) -> tuple[Informative, Prediction, Float1D]:
    """Returns the recording without the rows that an identification drops before its fit, the force of the
    model at its rows, and the weight of each evaluated row in the error that the verdict uses."""
    informative = Informative([recording], float(model.lower[0]))
    (kept,) = informative.recordings
    found = predict(model, kept, play_radius=play_radius)
    weight = _weights(model, kept, found)
    rows = np.zeros(len(recording), dtype=bool)
    rows[informative.kept[0][found.rows]] = True
    without_motion = found.without_motion + len(recording) - len(kept)
    return informative, replace(found, rows=rows, without_motion=without_motion), weight


def _weights(model: Model, recording: Recording, found: Prediction) -> Float1D:
    """Returns the weights (k,) of the evaluated rows: rows behind turns share an error if the direction of
    the model changes at once there. A play operator states how friction reverses: all rows count whole. With
    a memory, rows that wait count at most as much as motion."""
    if model.memory is not None:
        return balanced((roles_of(recording) == Role.MOVING)[found.rows])
    rows, order = found.rows, ordered_strokes(recording)
    if found.side is None or order is None or not (np.abs(found.side) == 1.0).all():
        return np.ones(len(found.force))
    residual = np.zeros(len(recording))
    residual[rows] = recording.force[rows] - found.force
    path = (recording.position - found.position.min()) / (np.ptp(found.position) or 1.0)
    share = SearchOptions.contact_share
    moved: Float1D = np.where(rows, order, 0).astype(np.float64)
    return weights_of_shared_errors(path, moved, residual, recording.force, share)[rows]


def errors_of(verified: Sequence[Verification]) -> tuple[RowError, RowError]:
    """Returns the error of all evaluated rows together, each of them whole, and the error that the verdict
    uses."""
    residual = np.concatenate([each.residual for each in verified])
    force = np.concatenate([each.recording.force[each.rows] for each in verified])
    judged = RowError(residual, force, np.concatenate([each.weight for each in verified]))
    return replace(judged, weight=np.ones(len(force))), judged


def columns_of(model: Model) -> list[str]:
    """Returns the columns of the model's inputs except position; velocity is computed from time if not
    recorded."""
    known = model.data.columns
    return [known.get(name, name) for name in model.inputs[1:] if name != "velocity" or name in known]


def is_fresh(identified_on: Source, data: Source) -> bool:
    """Returns True if the model was identified on other data: a file of other values, or other rows of the
    same file."""
    same_file = any(
        not set(theirs.split()).isdisjoint(ours.split())
        for theirs, ours in (
            (data.sha256, identified_on.sha256),
            (data.values_sha256, identified_on.values_sha256),
        )
    )
    same_split = data.held_out_every == identified_on.held_out_every > 0
    return not same_file or (same_split and data.held_out != identified_on.held_out)


def _stiffness_share(recording: Recording, rows: NDArray[np.bool_], residual: Float1D) -> float | None:
    """Returns the share of position cells within the stiffness JND, averaged over the directions."""
    position, reference = recording.position[rows], recording.force[rows]
    strokes = np.zeros(len(position)) if recording.direction is None else recording.direction[rows]
    shares = [
        share_within_stiffness_jnd(position[strokes == s], reference[strokes == s], residual[strokes == s])
        for s in np.unique(strokes)
    ]
    known = [share for share in shares if share is not None]
    return float(np.mean(known)) if known else None


def findings_of(model: Model, found: Verification, kept: Recording) -> tuple[Finding, ...]:
    """Returns all findings of a verification; a defect of the recording, without dropped rows, limits what it
    shows of a model. The recording of the identification shows what the findings of the model state, unless
    the error is worse."""
    known = Verdict() if found.fresh else model.verdict
    error = Verdict(tuple(error_findings(found.settled_nrmse, f"{found.n} rows")))
    # A time that was not read prevents tests of damping and memory, which are not tested here
    defects = quality_findings(replace(kept, unread_time=""), attracts=model.below == "linear")
    of_error = (*error.findings, *_of_cause(model, found.recording, found, defects))
    return (
        *known.findings,
        *(of_error if found.fresh or (error + known).level != known.level else ()),
        *_of_rows(model, found.recording, found),
        *defects,
    )


def circumstances(model: Model, recording: Recording, found: Verification) -> tuple[Finding, ...]:
    """Returns the findings on the compared rows and on the likely cause of an error, without those on its
    size."""
    return (*_of_cause(model, recording, found), *_of_rows(model, recording, found))


def _of_rows(model: Model, recording: Recording, found: Verification) -> list[Finding]:
    """Returns findings on rows that the model was identified on, rows outside the domain, the handle behind a
    virtual coupling, and rows left out."""
    findings = []
    if not found.fresh:
        findings.append(
            usable(
                "the model was identified on this recording, and the error on other data may be larger: "
                "verify with another recording, or identify with --hold-out-every 5"
            )
        )
    of_moving = found.prediction.extrapolated
    count, outside = len(of_moving), float(np.mean(of_moving))
    if outside > FEW_OUTSIDE:
        judge = no if outside > MOST_OUTSIDE else usable
        findings.append(
            judge(
                f"{found.extrapolated} of {count} rows ({outside:.0%}) lie outside the model's domain"
                f"{_domain(model, recording)}, where the force is extrapolated: identify on a recording of "
                "this range"
            )
        )
    flight = flight_of(recording)
    if flight.object_position is not None and not flight.predicted:
        _, handle, _ = _compared(model, replace(recording, columns={}))
        reference = recording.force[handle.rows]
        handle_nrmse = normalised(root_mean_square(handle.force - reference), reference)
        if handle_nrmse > USABLE_NRMSE:
            findings.append(
                usable(
                    f"at the position of the handle the NRMSE is {handle_nrmse:.3g}, above {USABLE_NRMSE:g}: "
                    "the virtual coupling yields, so that the object feels softer. Plan the model with "
                    "palpate plan, or render with --structure direct"
                )
            )
    moving = len(recording) - found.prediction.without_motion
    if found.n < LEAST_COMPARED_SHARE * moving:
        findings.append(
            usable(
                f"only {found.n} of {moving} rows were compared, fewer than "
                f"{LEAST_COMPARED_SHARE:.0%}: {' '.join(found.notes)}"
            )
        )
    return findings


def _of_cause(
    model: Model, recording: Recording, found: Verification, defects: Sequence[Finding] = ()
) -> list[Finding]:
    """Returns findings on the error: perceptible by a hand, and its likely cause, unless the recording has
    `defects`, which may be the cause."""
    findings = []
    noticed = noticed_findings(found.judged_strokes, *found.file_units)
    if found.within_band is not None and found.within_band < LEAST_SHARE_IN_BAND:
        of = "objects" if model.band is not None and model.band.objects > 1 else "recordings"
        findings.append(
            usable(
                f"only {found.within_band:.0%} of the rows lie in the band of the {of} that the model was "
                f"identified on, which should contain {BAND_LEVEL:.0%}. Likely cause: another object, zero "
                "position or device. Few repeats of one object differ this much"
            )
        )
    large = found.settled_nrmse > USABLE_NRMSE
    cause = explanation(model, recording, found.prediction) if large or noticed else None
    if cause is not None:
        findings.append(usable(f"{cause.sentence} (NRMSE {cause.nrmse:.3g})"))
    elif large and not defects and found.whiteness > STRUCTURED_CORRELATION:
        known = {
            "velocity": model.of_velocity,
            "hysteresis": model.hysteretic,
            "memory": model.memory is not None,
        }
        missing = ", ".join(name for name, has in known.items() if not has)
        missing = f"{missing} or another column" if missing else "another column"
        findings.append(
            usable(
                f"the errors of neighbouring rows are correlated ({found.whiteness:.2g}, above "
                f"{STRUCTURED_CORRELATION:g}): the object is not the same, its zero position is not the "
                f"same, or the force depends on an input that the model does not have, such as {missing}"
            )
        )
    return [*findings, *noticed]


def _domain(model: Model, recording: Recording) -> str:
    if model.dimension > 1:
        return ""
    return f" from {recording.file_unit('position').interval(float(model.lower[0]), float(model.upper[0]))}"
