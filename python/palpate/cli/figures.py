# SPDX-License-Identifier: Apache-2.0
"""Figure files in the width of a printed column, drawn without a screen, and the figures of the verbs."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .._core.rendering import Scheme
from ..errors import InputError
from ..identification import SearchOptions
from ..model import Model
from ..planning import Comparison, Plan, describe, force_at
from ..recording import Recording
from ..recording.files import replacing
from ..verification import ClosedLoop, Verification, force_driven, motion_driven, uncertainty
from .printing import number, print_table, talk, visible

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMN_INCHES = 3.5
"""Width of a figure: one column of a journal page [inch]."""

_PAGE_INCHES = 7.2
"""Width of a figure of several columns: both columns of a journal page [inch]."""

_DOTS_PER_INCH = 200

_TITLE_COLUMNS = 60
"""Largest number of characters in a line of a figure's title."""

_STYLE: Any = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "legend.fontsize": 7.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "hatch.linewidth": 0.5,
}

_LIGHTER = 0.01
"""Factor from mass and damping of the explicit structure's virtual object to those of the implicit one.

The explicit structure has the least mass and damping that it needs.
"""

_MOST_NAMES = 2
"""Largest number of source files that the title of a figure names."""

_DRIVEN = {
    "motion-driven": "recorded motion drives the device",
    "force-driven": "recorded force drives the object",
}


_LATER: ContextVar[list[tuple[Path, bytes]] | None] = ContextVar("figures to write later", default=None)
"""Figures that were drawn inside `drawing` and are not yet written"""


@contextmanager
def drawing() -> Iterator[Callable[[], None]]:
    """Context in which figures are drawn in memory; yields the function that writes their files.

    Drawing takes seconds. Ctrl-C ends it without a file; `finishing` ignores Ctrl-C only while files are
    written.
    """
    drawn: list[tuple[Path, bytes]] = []

    def write() -> None:
        for path, content in drawn:
            _write(path, content)

    outer = _LATER.set(drawn)
    try:
        yield write
    finally:
        _LATER.reset(outer)


def _write(path: Path, content: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    talk(f"wrote {path}")


@contextmanager
def figure_file(
    path: Path, *, height_inches: float, rows: Sequence[float] = (1.0,), columns: int = 1, title: str = ""
) -> Iterator[list[Axes]]:
    """Yields axes one below the other, with the given shares of the height, and writes the figure at the end.

    Several axes share their position axis. In several columns, filled row by row, each has a separate one.
    """
    with _written(path, (_COLUMN_INCHES, height_inches), title=title) as figure:
        axes = figure.subplots(
            len(rows), columns, squeeze=False, sharex=columns == 1, gridspec_kw={"height_ratios": rows}
        ).ravel()
        yield list(axes)
        if columns == 1:
            for each in axes:
                each.label_outer()


@contextmanager
def _written(path: Path, inches: tuple[float, float], *, title: str = "") -> Iterator[Figure]:
    """Yields an empty figure of this width and height, and writes it at the end.

    The title is above the axes, wrapped to the width of the figure.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=inches, dpi=_DOTS_PER_INCH, layout="constrained")
        if title:
            columns = int(_TITLE_COLUMNS * inches[0] / _COLUMN_INCHES)
            lines = [part for line in title.split("\n") for part in textwrap.wrap(visible(line), columns)]
            figure.suptitle("\n".join(lines).replace("$", r"\$"), fontsize=_STYLE["axes.titlesize"])
        yield figure
        stream = io.BytesIO()
        figure.savefig(stream, format=path.suffix.lower().removeprefix("."))
    later = _LATER.get()
    if later is None:
        _write(path, stream.getvalue())
    else:
        later.append((path, stream.getvalue()))


def close_loops(model: Model, recording: Recording) -> list[ClosedLoop]:
    """Simulates a recording and its model in closed loop in two ways.

    The recorded motion drives the device. The recorded force drives the object: once with the mass and
    damping of the paper's explicit environment, once with the small values that the implicit one needs.
    """
    paper = force_driven(model, recording)
    light = Scheme(
        structure="implicit",
        mass=_LIGHTER * paper.scheme.mass,
        object_damping=_LIGHTER * paper.scheme.object_damping,
        play_radius=paper.scheme.play_radius,
    )
    return [motion_driven(model, recording), paper, force_driven(model, recording, light)]


def print_closed_loops(loops: Sequence[ClosedLoop]) -> None:
    """Prints the error of each closed loop: the force error if the recorded motion drives it, else the
    position error.
    """
    print_table(
        ("closed loop", "NRMSE"),
        [(f"{loop.view}, {describe(loop.scheme)}", number(loop.nrmse)) for loop in loops],
    )


def _is_simulated(recording: Recording) -> bool:
    return "simulated" in recording.metadata


def source_name(files: Iterable[str]) -> str:
    """Returns the names of source files without their folders, for the title of a figure."""
    names = [Path(file).name for file in files]
    if len(names) > _MOST_NAMES:
        return f"{names[0]} and {len(names) - 1} more"
    return " and ".join(names) or "arrays"


def _error_text(reference: NDArray[np.float64], other: NDArray[np.float64]) -> str:
    """Returns the text "NRMSE ... on ... rows" for the two forces that a figure compares."""
    spread = float(np.std(reference))
    error = float(np.sqrt(np.mean((other - reference) ** 2)))
    return f"NRMSE {number(error / spread) if spread else 'not defined'} on {len(reference)} rows"


def picture_verification(
    path: Path,
    model: Model,
    verified: Sequence[tuple[Recording, Verification]],
    identified_on: Sequence[Recording] = (),
) -> None:
    """Draws measured and modelled force over position, and their difference below them, for all recordings.

    It also draws the band of the model, or else, for the recordings from which the model was identified, the
    95 % band of the model's force by its standard error.
    """
    from ..plotting import draw_measured_and_modelled

    directions = [
        recording.direction[verification.rows]
        for recording, verification in verified
        if recording.direction is not None
    ]
    all_directed = len(directions) == len(verified)
    one_curve = model.of_position and (all_directed or not model.hysteretic)
    drawn = Recording.from_arrays(
        np.concatenate([recording.position[verification.rows] for recording, verification in verified]),
        np.concatenate([recording.force[verification.rows] for recording, verification in verified]),
        direction=np.concatenate(directions) if all_directed else None,
        units=verified[0][0].units,
    )
    if model.period is not None:
        drawn = replace(
            drawn, position=model.lower[0] + np.mod(drawn.position - model.lower[0], model.period)
        )
    recording = replace(drawn, file_units=verified[0][0].file_units)
    modelled = np.concatenate([verification.force for _, verification in verified])
    bands = [verification.band for _, verification in verified]
    band = None if model.band is None else np.concatenate([each for each in bands if each is not None])
    simulated = any(_is_simulated(recording) for recording, _ in verified)
    files = source_name(file for each, _ in verified for file in each.source.files)
    title = f"{files}\n{_error_text(recording.force, modelled)}"
    with figure_file(path, height_inches=4.0, rows=(2.5, 1.0), title=title) as (force, residual):
        draw_measured_and_modelled(
            force,
            residual,
            recording,
            modelled,
            one_curve=one_curve,
            seen="simulated data" if simulated else "measured",
            standard_error=_standard_error(model, identified_on, recording) if band is None else None,
            band=band,
        )


def _standard_error(
    model: Model, identified_on: Sequence[Recording], drawn: Recording
) -> NDArray[np.float64] | None:
    """Returns the standard error of the model's force at the drawn rows; None if it is not known."""
    if not identified_on or (model.hysteretic and drawn.direction is None):
        return None
    try:
        known = uncertainty(model, identified_on)
    except InputError:
        return None
    stroke = None if drawn.direction is None else drawn.direction.astype(np.float64)
    return known.force(drawn.position, stroke)


def picture_recording(path: Path, recording: Recording) -> tuple[str, ...]:
    """Draws the views of a recording side by side; returns notes on the axis of the transforms."""
    from ..plotting import draw_views, history_of

    history = history_of(recording)
    title = f"{source_name(recording.source.files)}: {len(recording)} rows"
    with _written(path, (_PAGE_INCHES, 5.2), title=title) as figure:
        axes = figure.subplot_mosaic(
            [["position", "position", "history"], ["spectrum", "short-time", "wavelet"]],
            height_ratios=(1.6, 1.0),
        )
        draw_views(axes, recording, history)
    return history.notes


@dataclass(frozen=True)
class FrameFigure:
    """File and settings of the figure of a frame."""

    path: Path
    a0: float = SearchOptions.frame_scale
    b0: float = SearchOptions.frame_step
    voices: tuple[int, ...] = (1, 2, 4)


def picture_frame(drawn: FrameFigure, domain: tuple[float, float], position_unit: str, *, of: str) -> None:
    """Draws the bounds of the frame of candidate wavelets, and its grid over a domain."""
    from ..plotting import draw_frame_bounds, draw_frame_grid

    title = f"frame of candidate wavelets over the positions of {of}"
    with _written(drawn.path, (_PAGE_INCHES, 5.2), title=title) as figure:
        axes = figure.subplot_mosaic([["bounds", "voices", "scales"], ["grid", "grid", "grid"]])
        draw_frame_bounds(
            axes["bounds"],
            axes["voices"],
            axes["scales"],
            scale=drawn.a0,
            step=drawn.b0,
            voices=drawn.voices,
        )
        draw_frame_grid(axes["grid"], domain, position_unit, scale=drawn.a0, step=drawn.b0)


def picture_rendering(path: Path, plan: Plan, rendered: Recording) -> None:
    """Draws rendered force and model force at the measured position, and their difference below them."""
    from ..plotting import draw_measured_and_modelled

    modelled = force_at(plan, rendered.position, rendered.sample_period)
    one_curve = plan.model.of_position and not plan.model.hysteretic
    title = (
        f"model of {source_name(plan.model.data.files)}, rendered: {plan.structure}\n"
        f"{_error_text(modelled, rendered.force)}"
    )
    with figure_file(path, height_inches=4.0, rows=(2.5, 1.0), title=title) as (force, residual):
        draw_measured_and_modelled(force, residual, rendered, modelled, one_curve=one_curve, seen="rendered")


def picture_closed_loops(path: Path, recording: Recording, loops: Sequence[ClosedLoop]) -> None:
    """Draws recorded and rendered force over position, one panel for each closed loop of a recording."""
    from ..plotting import draw_real_against_rendered

    height, rows = 0.5 + 2.2 * len(loops), (1.0,) * len(loops)
    with figure_file(
        path, height_inches=height, rows=rows, title=source_name(recording.source.files)
    ) as axes:
        for each, loop in zip(axes, loops, strict=True):
            draw_real_against_rendered(
                each,
                (loop.recorded_position, loop.recorded_force),
                (loop.rendered_position, loop.rendered_force),
                loop.units,
                title=f"{_DRIVEN[loop.view]}\n{describe(loop.scheme)}: NRMSE {number(loop.nrmse)}",
                real_name="recorded (simulated)" if _is_simulated(recording) else "recorded",
            )
        handles, names = axes[0].get_legend_handles_labels()
        axes[0].figure.legend(
            handles, names, frameon=False, markerscale=1.5, loc="outside lower center", ncols=2
        )


def picture_structures(path: Path, rows: Sequence[Comparison], force_unit: str, *, of: str) -> None:
    """Draws the force error of each rendered structure; `of` is the title of the figure."""
    from ..plotting import draw_structures

    shown = [(row.name, row.error) for row in rows if row.error is not None]
    with figure_file(path, height_inches=0.9 + 0.3 * len(shown), title=of) as (axes,):
        draw_structures(
            axes,
            [name for name, _ in shown],
            [error.mean for _, error in shown],
            [error.end for _, error in shown],
            force_unit,
        )


def picture_path(path: Path, model: Model) -> None:
    """Draws the force of a model, and below it error and criterion of each compared network over the number
    of wavelets."""
    from ..plotting import draw_model, draw_path

    if not model.path:
        raise InputError("the model file lists no networks that identification compared: identify again")
    fit = model.fit
    title = f"{source_name(model.data.files)}\n{model.terms}, NRMSE {number(fit.nrmse)}"
    with _written(path, (_COLUMN_INCHES, 6.0), title=title) as figure:
        force, error, criterion = figure.subplots(3, 1, gridspec_kw={"height_ratios": (1.6, 1.4, 1.0)})
        draw_model(force, model)
        draw_path(error, criterion, model.path, model.units["force"])
        error.sharex(criterion)
        error.tick_params(labelbottom=False)
