# SPDX-License-Identifier: Apache-2.0
"""Charts of the page, in the units of the recording's file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..model import Model
from ..model.model_display import force_curves
from ..planning import Plan
from ..plotting.look import Scale, scale_for, strokes
from ..recording import Recording
from ..recording.motion import directions_of
from ..recording.roles import ROLE_NAMES, Role, roles_of
from ..recording.units import Unit
from ..report.charts import MOST_DOTS, Chart, Panel
from ..report.of_comparison import LINE_MARKS, Compared
from ..report.subject import Subject
from ..verdict import force_jnd
from .designer import Curves

DOTS = {"press": "dots", "release": "open-dots", "": "dots"}
"""Marks of recorded rows by stroke"""

ROLE_MARKS = {Role.APPROACH: "strip-1", Role.REST: "strip-2", Role.HOLD: "strip-3"}
"""Marks of the rows that are not fitted, by role"""

LEFT_OUT_MARK = "strip-4"


@dataclass(frozen=True)
class Axes:
    """Scales of position and force: in the units of the file, or in SI units with a prefix."""

    x: Scale
    y: Scale

    def unit(self, role: str) -> Unit:
        """Returns the unit of the axis of "position" or "force", for texts and fields."""
        scale = self.x if role == "position" else self.y
        symbol = scale.unit.replace("*", "·")
        return Unit(symbol, symbol, 1.0 / scale.factor)

    @classmethod
    def of(cls, recording: Recording) -> Axes:
        """Returns the scales of a recording."""
        units, of_file = recording.units, recording.file_units
        return cls(
            scale_for(units["position"], recording.position, of_file=of_file.get("position")),
            scale_for(units["force"], recording.force, of_file=of_file.get("force")),
        )

    def panel(self, height: int, *, force: str = "force", above: Panel | None = None) -> Panel:
        """Returns a panel of force over position."""
        return Panel(self.x.label("position"), self.y.label(force), height, above=above)


def recorded(recording: Recording) -> Chart:
    """Draws force over position: press and release in two colours, rows that are not fitted in grey."""
    axes = Axes.of(recording)
    panel = axes.panel(320)
    role = roles_of(recording, float(recording.position.max()))
    x, y = axes.x.factor * recording.position, axes.y.factor * recording.force
    waiting = role != Role.MOVING
    panel.dots(x[waiting], y[waiting], "soft-dots", "not fitted")
    for name, rows in strokes(directions_of(recording), len(recording)):
        shown = rows & ~waiting
        panel.dots(x[shown], y[shown], DOTS[name], name or "recorded")
    panel.select()
    return Chart("Recorded force over position.", panel)


def course_axis(recording: Recording) -> tuple[str, Float1D]:
    """Returns the label and the values of the axis along a recording: its time, else its row numbers."""
    if recording.time is None:
        return "row", np.arange(len(recording), dtype=np.float64)
    return "time [s]", recording.time


def course(whole: Recording, used: NDArray[np.bool_]) -> Chart:
    """Draws force and position in recorded order, with shades for the roles of the rows.

    `used` (n,) is True for the rows that the user has not left out.
    """
    axes = Axes.of(whole)
    name, at = course_axis(whole)
    force = Panel(name, axes.y.label("force"), 180)
    force.line(*thinned_line(at, axes.y.factor * whole.force), "thin", "force", hover=False)
    position = Panel(name, axes.x.label("position"), 130, above=force)
    position.line(*thinned_line(at, axes.x.factor * whole.position), "second", "position", hover=False)
    role = roles_of(whole, float(whole.position.max()))
    shades = [(used & (role == each), mark, ROLE_NAMES[each]) for each, mark in ROLE_MARKS.items()]
    for rows, mark, text in [*shades, (~used, LEFT_OUT_MARK, "left out by you")]:
        for number, panel in enumerate((force, position)):
            panel.strips(*_runs(rows, at), mark, "" if number else text)
    for panel in (force, position):
        panel.select()
    return Chart("Force and position in recorded order; shaded rows are not fitted.", force, position)


def thinned_line(at: Float1D, values: Float1D) -> tuple[Float1D, Float1D]:
    """Returns at most about MOST_DOTS points of a line (n,).

    The least and the largest value of each block of rows stay, so that no single wrong reading disappears.
    """
    blocks = MOST_DOTS // 2
    if len(at) <= MOST_DOTS:
        return at, values
    size = -(-len(at) // blocks)
    padded = np.pad(values, (0, -len(values) % size), mode="edge").reshape(-1, size)
    first = size * np.arange(len(padded))
    rows = np.sort(np.stack([first + padded.argmin(axis=1), first + padded.argmax(axis=1)]), axis=0)
    rows = np.unique(np.minimum(rows, len(at) - 1))
    return at[rows], values[rows]


def _runs(rows: NDArray[np.bool_], at: Float1D) -> tuple[Float1D, Float1D]:
    """Returns start and end of each run of rows that are True."""
    edges = np.flatnonzero(np.diff(rows, prepend=False, append=False))
    return at[edges[::2]], at[edges[1::2] - 1]


def modelled(compared: Compared) -> Chart:
    """Draws the model over the recorded dots; below, the difference in just noticeable differences."""
    axes = Axes.of(compared.recording)
    x, y = axes.x.factor * compared.position, axes.y.factor * compared.force
    noticed = differences(compared)
    direction = directions_of(compared.recording)
    kept = None if direction is None else direction[compared.found.rows]
    groups = list(strokes(kept, len(x)))
    above = axes.panel(320)
    for name, rows in groups:
        above.dots(x[rows], y[rows], DOTS[name], f"recorded, {name}" if name else "recorded")
    noticed_rows = np.abs(noticed) > 1.0
    below = Panel(axes.x.label("position"), "difference [JND]", 170, above=above)
    if one_curve(compared.subject.model):
        text = "model at rest" if is_dynamic(compared.subject.model) else "model"
        at, forces = force_curves(compared.subject.model)
        for name, force in forces.items():
            line = axes.x.factor * at, axes.y.factor * force
            above.line(*line, LINE_MARKS[name], ", ".join(filter(None, (text, name))))
    else:
        above.dots(x, axes.y.factor * compared.found.force, "soft-dots", "model")
    for name, rows in groups:
        below.dots(x[rows & ~noticed_rows], noticed[rows & ~noticed_rows], DOTS[name])
    below.dots(x[noticed_rows], noticed[noticed_rows], "outside", "a hand feels the difference")
    for level in (-1.0, 1.0):
        ends = np.array([x.min(), x.max()])
        below.line(ends, np.full(2, level), "dotted", "1 just noticeable difference (JND)", hover=False)
    return Chart(
        "Recorded force and model over position; below, recorded minus modelled force in just noticeable "
        "differences.",
        above,
        below,
    )


def one_curve(model: Model) -> bool:
    """Returns True if position and stroke alone determine the force of a model at rest."""
    return model.dimension == 1 and model.of_position


def is_dynamic(model: Model) -> bool:
    """Returns True if the force also depends on the motion by a mass or a damping."""
    return model.mass is not None or model.damping is not None


def differences(compared: Compared) -> Float1D:
    """Returns recorded minus modelled force (n,) in just noticeable differences."""
    perceptible = force_jnd(compared.force, compared.found.jnd_floor)
    return np.asarray(-compared.found.residual / perceptible)


def lost(plan: Plan, recording: Recording) -> Chart:
    """Draws the identified force and the one that the device can give; the lost part is shaded."""
    axes = Axes.of(recording)
    x, identified, rendered = plan.forces_at_rest()
    panel = axes.panel(300)
    at = axes.x.factor * x
    names = ("press", "release") if len(identified) == 2 else ("",)
    for name, full, left in zip(names, axes.y.factor * identified, axes.y.factor * rendered, strict=True):
        suffix = f", {name}" if name else ""
        panel.band(at, np.minimum(full, left), np.maximum(full, left), "lost on this device")
        panel.line(at, full, LINE_MARKS[name], f"object{suffix}")
        panel.line(at, left, "thin", "on the device", hover=False)
    return Chart("Force of the object and of the device at rest, over position.", panel)


FRAME_S = 1.0 / 60.0
"""Time between two pictures of a rendering that is played [s]"""


def cursor(plan: Plan, recording: Recording) -> Chart:
    """Draws the force on the device with a cursor, which the page moves."""
    axes = Axes.of(recording)
    x, _, rendered = plan.forces_at_rest()
    panel = axes.panel(260)
    names = ("press", "release") if len(rendered) == 2 else ("",)
    for name, force in zip(names, rendered, strict=True):
        line = axes.x.factor * x, axes.y.factor * force
        panel.line(*line, LINE_MARKS[name], f"rendered, {name}" if name else "rendered", hover=False)
    panel.cursor("handle")
    return Chart("Force on the device over position; the cursor is the handle.", panel)


def frames(rendered: Recording, subject: Subject, axes: Axes) -> list[list[float]]:
    """Returns time [s], position and force of the pictures of a rendering, in the units of the axes."""
    period = rendered.sample_period
    assert period is not None
    assert rendered.time is not None
    rows = slice(None, None, max(1, round(FRAME_S / period)))
    return [
        np.round(values[rows], 5).tolist()
        for values in (
            rendered.time - rendered.time[0],
            axes.x.factor * subject.folded(rendered.position),
            axes.y.factor * rendered.force,
        )
    ]


def design(curves: Curves, before: Curves | None, recording: Recording) -> Chart:
    """Draws the curves of an object with handles at peak, contact and stop, which the mouse drags.

    `before` are the curves before they were edited.
    """
    axes = Axes.of(recording)
    panel = axes.panel(300)

    def line(found: Curves, force: Float1D, mark: str, text: str) -> None:
        panel.line(axes.x.factor * found.position, axes.y.factor * force, mark, text, hover=False)

    if before is not None:
        line(before, before.press, "dotted", "before, press")
    line(curves, curves.press, "line", "press")
    if not np.array_equal(curves.press, curves.release):
        line(curves, curves.release, "dashed", "release")
    if curves.click is not None:
        places = [*curves.click, *([curves.stop] if "stop position" in curves.numbers() else [])]
        panel.handles(axes.x.factor * curves.position[places], axes.y.factor * curves.press[places])
    return Chart("Force over position; drag a handle: peak, end of the drop, stop.", panel)


def together(models: Sequence[tuple[str, Model]], recording: Recording) -> Chart:
    """Draws the press force of several models in one picture."""
    axes = Axes.of(recording)
    panel = axes.panel(320)
    for number, (name, model) in enumerate(models):
        at, forces = force_curves(model)
        force = next(iter(forces.values()))
        panel.line(axes.x.factor * at, axes.y.factor * force, f"class-{number % 8}", name)
    return Chart("Press force of all objects over position.", panel)
