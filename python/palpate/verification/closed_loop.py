# SPDX-License-Identifier: Apache-2.0
"""Closed-loop verification: a recorded motion moves the simulated device, or a recorded force moves the
virtual object.

The recording is sampled on the even time grid of a controller, with recorded or assumed time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from .. import _core
from .._core.dynamics import paper_sample_time_s
from .._core.rendering import Scheme, default_play_radius, explicit_slope_limit
from .._core.status import Status
from .._typing import Float1D
from ..errors import InputError
from ..model import Model
from ..recording import Recording
from .metrics import normalised, root_mean_square
from .prediction import require_same_units

MOST_SAMPLES = 20_000_000
"""Largest number of samples of a motion on an even grid; limits memory."""

ASSUMED_STROKE_S = 1.0
"""Time in which the assumed motion of a recording without time crosses the range of positions once [s]."""


@dataclass(frozen=True)
class ClosedLoop:
    """Recorded and simulated motion and force of a closed loop, on an even time grid."""

    view: Literal["motion-driven", "force-driven"]
    scheme: Scheme
    """Scheme that was rendered; it can differ from the requested scheme (implicit in place of unstable
    explicit)"""
    period_s: float
    assumed_speed: float | None
    """Assumed speed of the motion if the recording has no time [position unit per second]; None if time is
    recorded"""
    time: Float1D
    """(k,) [s]"""
    recorded_position: Float1D
    recorded_force: Float1D
    rendered_position: Float1D
    """Handle position of the simulated loop: the recorded position if `view` is motion-driven, the resulting
    position of the environment if force-driven"""
    rendered_force: Float1D
    """Force of the simulated loop: the rendered force if `view` is motion-driven, the recorded force if
    force-driven"""
    environment_position: Float1D
    rmse: float
    """RMS error of the force if `view` is motion-driven, of the position if force-driven"""
    nrmse: float
    """RMS error divided by the population standard deviation of the recorded force (motion-driven) or
    position (force-driven) [-]"""
    status: Mapping[str, int]
    """Number of ticks with each status"""
    units: Mapping[str, str]
    notes: tuple[str, ...]


def motion_driven(
    model: Model,
    recording: Recording,
    scheme: Scheme | None = None,
    *,
    period_s: float = paper_sample_time_s,
    stroke_speed: float | None = None,
) -> ClosedLoop:
    """Moves the device along the recorded motion and compares the rendered force with the recorded one.

    Parameters
    ----------
    model : Model
        Rendered model of one position.
    recording : Recording
        Its motion is resampled every `period_s`; without time it has the speed `stroke_speed`.
    scheme : Scheme, optional
        Structure and coupling of the rendering; by default the direct structure.
    period_s : float
        Sample time [s].
    stroke_speed : float, optional
        Assumed speed [position unit per second] for a recording without time; by default the range of
        positions in one second.

    Raises
    ------
    InputError
        The model and the recording, or the model and the scheme, do not fit.
    """
    scheme = scheme or Scheme(structure="direct", play_radius=default_play_radius(model, 0.0))

    def run(position: Float1D, _force: Float1D) -> dict[str, Any]:
        rendered: dict[str, Any] = _core.simulation.motion_driven(model, scheme, position, period_s)
        return rendered

    return _closed_loop("motion-driven", model, recording, scheme, period_s, stroke_speed, run, ())


def force_driven(
    model: Model,
    recording: Recording,
    scheme: Scheme | None = None,
    *,
    period_s: float = paper_sample_time_s,
    stroke_speed: float | None = None,
) -> ClosedLoop:
    """Moves the virtual object alone, without device, by the recorded force (figure 14 of the paper).

    Force over the resulting position is figure 15 of the paper.

    Parameters
    ----------
    model : Model
        Driven model of one position.
    recording : Recording
        Its force is resampled every `period_s`; without time its motion has the speed `stroke_speed`.
    scheme : Scheme, optional
        Structure ("explicit" or "implicit"), mass and damping; by default the paper's explicit environment
        with its mass and damping. If the steepest slope of the model reaches `explicit_slope_limit`, an
        explicit environment would be unstable; the implicit one replaces it, and the notes report this.
    period_s, stroke_speed
        As for :func:`motion_driven`.

    Raises
    ------
    InputError
        The model and the recording, or the model and the scheme, do not fit.
    """
    require_period(period_s)
    default = scheme or Scheme(structure="explicit")
    if default.structure not in ("explicit", "implicit"):
        raise InputError(
            f"structure is {default.structure}: must be explicit or implicit for a recorded force"
        )
    radius = default.play_radius or default_play_radius(model, 0.0)
    scheme = Scheme(**{**default.to_dict(), "play_radius": radius})
    notes: tuple[str, ...] = ()
    steepest = scheme.steepest_slope(model)
    limit = explicit_slope_limit(scheme, period_s, coupled=False)
    if scheme.structure == "explicit" and not steepest < limit:
        scheme = Scheme(**{**scheme.to_dict(), "structure": "implicit"})
        notes = (
            f"The implicit environment is used: with object mass {scheme.mass:g} and object damping "
            f"{scheme.object_damping:g} the explicit one is stable below a slope of {limit:.4g}, and the "
            f"steepest slope of the model is {steepest:.4g}.",
        )

    def run(_position: Float1D, force: Float1D) -> dict[str, Any]:
        start = float(recording.position[0])
        driven: dict[str, Any] = _core.simulation.force_driven(model, scheme, force, period_s, start)
        return driven

    return _closed_loop("force-driven", model, recording, scheme, period_s, stroke_speed, run, notes)


def _closed_loop(
    view: Literal["motion-driven", "force-driven"],
    model: Model,
    recording: Recording,
    scheme: Scheme,
    period_s: float,
    stroke_speed: float | None,
    run: Callable[[Float1D, Float1D], dict[str, Any]],
    notes: tuple[str, ...],
) -> ClosedLoop:
    require_same_units(model, recording.units)
    motion = even_motion(recording, period_s, stroke_speed)
    if motion.assumed_speed is not None:
        unit = recording.units["position"] or "SI"
        notes += (
            f"The recording has no time. A stroke speed of {motion.assumed_speed:.4g} {unit}/s is assumed.",
        )
    try:
        result = run(motion.position, motion.force)
    except ValueError as error:
        raise InputError(str(error)) from None
    moved = view == "motion-driven"
    rendered_position = motion.position if moved else result["environment_position"]
    rendered_force = result["force"] if moved else motion.force
    recorded = motion.force if moved else motion.position
    rmse = root_mean_square((rendered_force if moved else rendered_position) - recorded)
    return ClosedLoop(
        view=view,
        scheme=scheme,
        period_s=period_s,
        assumed_speed=motion.assumed_speed,
        time=motion.time,
        recorded_position=motion.position,
        recorded_force=motion.force,
        rendered_position=rendered_position,
        rendered_force=rendered_force,
        environment_position=result["environment_position"],
        rmse=rmse,
        nrmse=normalised(rmse, recorded),
        status=_counted(result["status"]),
        units=dict(recording.units),
        notes=notes,
    )


def _counted(status: Any) -> dict[str, int]:
    names = {int(member): name for name, member in Status.__members__.items()}
    values, counts = np.unique(status, return_counts=True)
    return {names[int(value)]: int(count) for value, count in zip(values, counts, strict=True)}


@dataclass(frozen=True)
class EvenMotion:
    """Recorded motion and force on an even time grid."""

    time: Float1D
    """(k,) [s], from 0"""
    position: Float1D
    force: Float1D
    period_s: float
    assumed_speed: float | None
    """Assumed speed if the recording has no time [position unit per second]; None if time is recorded"""


def even_motion(recording: Recording, period_s: float, stroke_speed: float | None = None) -> EvenMotion:
    """Samples a recording every `period_s`, with straight lines between its rows.

    Parameters
    ----------
    recording : Recording
        Without time, the motion follows its positions at a constant speed.
    period_s : float
        Sample time [s].
    stroke_speed : float, optional
        Constant speed of a recording without time [position unit per second]; by default the range of
        positions in one second.

    Raises
    ------
    InputError
        The recording without time does not move, it lasts less than one period or more than MOST_SAMPLES
        periods, a speed was given in addition to time, or period or speed is not positive and finite.
    """
    require_period(period_s)
    if recording.time is not None:
        if stroke_speed is not None:
            raise InputError("stroke_speed is given, but the recording has time: omit stroke_speed")
        return _sampled(recording, recording.time - recording.time[0], period_s, None)
    travel = float(np.ptp(recording.position))
    if travel == 0:
        raise InputError("the position of the recording is constant: no time can be assumed")
    speed = travel / ASSUMED_STROKE_S if stroke_speed is None else stroke_speed
    if not 0 < speed < np.inf:
        raise InputError(f"stroke_speed is {speed}: must be > 0 and finite")
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(recording.position)))])
    with np.errstate(over="ignore"):  # an infinite duration of the motion is refused by a later check
        time = way / speed
    return _sampled(recording, time, period_s, speed)


def require_period(period_s: float) -> None:
    """Refuses a sample time that is not positive and finite."""
    if not 0 < period_s < np.inf:
        raise InputError(f"period_s is {period_s}: must be > 0 and finite")


def _sampled(recording: Recording, time: Float1D, period_s: float, assumed_speed: float | None) -> EvenMotion:
    if not time[-1] <= MOST_SAMPLES * period_s:
        raise InputError(
            f"the motion lasts {time[-1]:.4g} s, more than {MOST_SAMPLES} samples of {period_s:g} s: "
            + ("choose a larger period" if assumed_speed is None else "choose a higher stroke speed")
        )
    # Successive rows with equal position get the same assumed time: keep the last of these rows.
    last = np.append(np.diff(time) > 0, True)
    samples = int(time[-1] / period_s * (1 + 1e-12)) + 1
    if samples < 2:
        raise InputError(f"the recording lasts {time[-1]:g} s: must be at least one sample of {period_s:g} s")
    grid: Float1D = np.arange(samples, dtype=np.float64) * period_s
    return EvenMotion(
        time=grid,
        position=np.interp(grid, time[last], recording.position[last]),
        force=np.interp(grid, time[last], recording.force[last]),
        period_s=period_s,
        assumed_speed=assumed_speed,
    )
