# SPDX-License-Identifier: Apache-2.0
"""Sections that compare the model with a recording: force curve, error, whiteness, just noticeable band."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .._typing import Float1D
from ..model.band import BAND_LEVEL, Band
from ..plotting.look import Scale, scale_for, strokes, thinned
from ..recording import Recording
from ..verdict import FORCE_JND
from ..verification import Uncertainty, Verification
from ..verification.metrics import autocorrelation, force_jnd_band, within_force_jnd
from .charts import MOST_DOTS, Chart, Panel
from .page import Section
from .subject import Subject
from .words import amount, percent

CURVE_POSITIONS = 801
"""Number of positions of a drawn curve"""

MOST_BINS = 40
"""Largest number of bins of the error over position"""

ROWS_PER_BIN = 20
"""Least mean number of rows of a bin of the error over position"""

MOST_LAGS = 40
"""Largest distance of two rows whose residuals are correlated [rows]"""

LEAST_WHITENESS_ROWS = 20
"""Least number of rows from which an autocorrelation is computed"""

BOUND_95 = 1.96
"""Bound of 95 % of a standard normal distribution: the autocorrelation of n white residuals has the standard
deviation 1 / sqrt(n)"""

NO_RECORDING = "no recording was given: palpate report MODEL.json RECORDING -o REPORT.html"

_DOT_MARKS = {"press": "dots", "release": "open-dots", "": "dots"}
LINE_MARKS = {"press": "line", "release": "dashed", "": "line"}
"""Marks of the model's curves by stroke"""


@dataclass(frozen=True)
class Curve:
    """Force of the model over position in one stroke."""

    stroke: str
    """press, release, or empty if the model does not distinguish them"""
    position: Float1D
    force: Float1D
    half_width: Float1D | None
    """Half width of the band of a further recording, else of the 95 % band by the standard error; None if
    both are unknown"""

    @property
    def suffix(self) -> str:
        """Text that follows the name of a series of the stroke."""
        return f", {self.stroke}" if self.stroke else ""


def curves_of(subject: Subject) -> list[Curve]:
    """Returns the force of the model over its domain and the recorded positions; empty if position does not
    determine the force. The force of a model with memory is drawn at the rows of a recording; without one,
    its force at rest."""
    return [] if subject.model.memory is not None and subject.recording is not None else at_rest(subject)


def at_rest(subject: Subject) -> list[Curve]:
    """Returns the curves of `curves_of`, also for a model with memory: its force at rest."""
    model = subject.model
    if model.dimension > 1 or model.mass is not None or model.damping is not None:
        return []
    lower, upper = float(model.lower[0]), float(model.upper[0])
    if subject.verification is not None and subject.recording is not None and model.period is None:
        recorded = subject.recording.position
        lower, upper = min(lower, float(recorded.min())), max(upper, float(recorded.max()))
    x = np.linspace(lower, upper, CURVE_POSITIONS)
    known = subject.uncertainty
    curves = []
    for stroke, side in (("press", 1.0), ("release", -1.0)) if model.hysteretic else (("", 1.0),):
        direction = np.full(len(x), side)
        force = model.force(x, direction=direction)
        half = model.band_half_width(x)
        if half is None and isinstance(known, Uncertainty):
            half = 2.0 * known.force(x, direction)
        curves.append(Curve(stroke, x, force, half))
    return curves


@dataclass(frozen=True)
class Compared:
    """Compared rows of a recording, with the scales of the charts."""

    subject: Subject
    recording: Recording
    found: Verification

    @classmethod
    def of(cls, subject: Subject) -> Compared | None:
        """Returns the compared rows; None without a recording."""
        if subject.recording is None or subject.verification is None:
            return None
        return cls(subject, subject.recording, subject.verification)

    @cached_property
    def position(self) -> Float1D:
        """(n,) positions of the rows; those of a periodic model within one period"""
        return self.subject.folded(self.recording.position[self.found.rows])

    @cached_property
    def force(self) -> Float1D:
        """(n,) recorded force"""
        return self.recording.force[self.found.rows]

    @cached_property
    def direction(self) -> NDArray[np.int8] | None:
        """(n,) direction of the rows: recorded, or from the play operator"""
        if self.recording.direction is not None:
            return self.recording.direction[self.found.rows]
        side = self.found.prediction.side
        return None if side is None else np.sign(side).astype(np.int8)

    def strokes(self) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Yields the name and the rows of each stroke."""
        yield from strokes(self.direction, len(self.position))

    @cached_property
    def x(self) -> Scale:
        """Scale of the positions"""
        return scale_for(self.recording.units["position"], self.position)

    @cached_property
    def y(self) -> Scale:
        """Scale of the forces"""
        return scale_for(self.recording.units["force"], self.force, self.found.force)

    @cached_property
    def z(self) -> Scale:
        """Scale of the residuals"""
        return scale_for(self.recording.units["force"], self.found.residual)

    def amount(self, force: float) -> str:
        """Returns a force as text."""
        return amount(force, self.recording.units["force"])


def force_curve(subject: Subject) -> Section:
    """Force over position: recorded rows, model with its 95 % band, residuals below."""
    curves, compared = curves_of(subject), Compared.of(subject)
    key, title = "force-curve", "Force over position"
    explanation = (
        "The force of the object against the hand at each position; the model is good where its line runs "
        "through the dots."
    )
    if compared is None and not curves:
        return Section(key, title, explanation, left_out=NO_RECORDING)
    panels = [_force_panel(subject, curves, compared)]
    description = "Force of the model over position"
    if compared is not None:
        panels.append(_residual_panel(compared, curves, panels[0]))
        description = "Recorded and modelled force over position; below, the residuals (recorded minus model)"
    sentences = [] if compared is not None else [f"Without dots: {NO_RECORDING}."]
    if compared is not None and not curves:
        further = "memory" if subject.model.memory is not None else "mass or damping"
        sentences.append(
            "The force does not depend on position alone, so the model is drawn at the recorded rows: its "
            f"inputs are {', '.join(subject.model.inputs)}"
            + (f", with {further}." if subject.model.dimension == 1 else ".")
        )
    if (band := subject.model.band) is not None:
        sentences.append(_band_sentence(band, compared))
    elif isinstance(subject.uncertainty, Uncertainty):
        sentences.append(
            "The grey band contains the force with a probability of 95 %, as far as noise causes the error; "
            "it is often narrower than the line."
        )
    else:
        sentences.append(f"Without band: {subject.uncertainty}.")
    if curves and subject.model.units["position"] == "rad":
        panels.append(_energy_panel(subject, panels[-1]))
        description += "; at the bottom, the energy stored in the object"
    charts = [Chart(f"{description}.", *panels)]
    if compared is not None and not curves:
        charts.append(_modelled_over_recorded(compared))
        if compared.recording.time is not None:
            charts.append(_along_recording(compared, compared.recording.time))
    return Section(key, title, explanation, sentences, charts)


def _band_sentence(band: Band, compared: Compared | None) -> str:
    """Returns the meaning of the band, its check, and the share of the compared rows inside."""
    further = "further object of this kind" if band.objects > 1 else "further recording of the object"
    text = (
        f"The grey band should contain {BAND_LEVEL:.0%} of the rows of a {further}. It is known from "
        f"{band.recordings} recordings of {band.objects} object{'s' if band.objects > 1 else ''}."
    )
    if band.coverage is not None:
        text += (
            f" Of each {band.left_out} left out of the fit, {percent(band.coverage)} of the rows were inside "
            "in the mean."
        )
    if compared is not None and compared.found.within_band is not None:
        text += f" {percent(compared.found.within_band)} of the recorded rows are inside."
    return text


def _modelled_over_recorded(compared: Compared) -> Chart:
    y = compared.y
    panel = Panel(y.label("recorded force"), y.label("modelled force"), 340)
    panel.dots(y.factor * compared.force, y.factor * compared.found.force, "dots", "row of the recording")
    ends = y.factor * np.array([compared.force.min(), compared.force.max()])
    panel.line(ends, ends, "line", "equal forces", hover=False)
    return Chart("Modelled force over recorded force; in a good model the dots lie on the line.", panel)


def _along_recording(compared: Compared, time: Float1D) -> Chart:
    """Returns recorded and modelled force over time."""
    at, recorded, modelled = thinned(
        time[compared.found.rows], compared.force, compared.found.force, most=MOST_DOTS
    )
    y = compared.y
    panel = Panel("time [s]", y.label("force"), 260)
    panel.dots(at, y.factor * recorded, "soft-dots", "recorded")
    panel.line(at, y.factor * modelled, "line", "model")
    return Chart("Recorded and modelled force over time.", panel)


def _energy_panel(subject: Subject, above: Panel) -> Panel:
    """Returns the energy that the object stores, of the mean force of press and release, over its angle."""
    model = subject.model
    x = np.linspace(float(model.lower[0]), float(model.upper[0]), CURVE_POSITIONS)
    energy = np.mean([model.energy(x, direction=np.full(len(x), side)) for side in (1.0, -1.0)], axis=0)
    energy -= energy.min()
    compared = Compared.of(subject)
    angle = scale_for("rad", x) if compared is None else compared.x
    stored = scale_for("J", energy)
    panel = Panel(angle.label("position"), stored.label("energy"), 180, above=above)
    panel.line(angle.factor * x, stored.factor * energy, "line")
    return panel


def _force_panel(subject: Subject, curves: list[Curve], compared: Compared | None) -> Panel:
    units = subject.model.units if compared is None else compared.recording.units
    x = compared.x if compared else scale_for(units["position"], *(each.position for each in curves))
    y = compared.y if compared else scale_for(units["force"], *(each.force for each in curves))
    panel = Panel(x.label("position"), y.label("force"), 340)
    for curve in curves:
        if (half := curve.half_width) is not None:
            low, high = y.factor * (curve.force - half), y.factor * (curve.force + half)
            panel.band(x.factor * curve.position, low, high, "95 % band")
    if compared is not None:
        for name, rows in compared.strokes():
            suffix = f", {name}" if name else ""
            at = x.factor * compared.position[rows]
            panel.dots(at, y.factor * compared.force[rows], _DOT_MARKS[name], f"recorded{suffix}")
            if not curves:
                modelled = y.factor * compared.found.force[rows]
                panel.dots(at, modelled, "soft-dots", "model")
    for curve in curves:
        line = x.factor * curve.position, y.factor * curve.force
        panel.line(*line, LINE_MARKS[curve.stroke], f"model{curve.suffix}")
    return panel


def _residual_panel(compared: Compared, curves: list[Curve], above: Panel) -> Panel:
    x, z = compared.x, compared.z
    panel = Panel(x.label("position"), z.label("residual"), 210, above=above)
    for curve in curves:
        if curve.half_width is not None:
            half = z.factor * curve.half_width
            panel.band(x.factor * curve.position, -half, half)
    panel.level(0.0, "line")
    for name, rows in compared.strokes():
        residual = -z.factor * compared.found.residual[rows]
        panel.dots(x.factor * compared.position[rows], residual, _DOT_MARKS[name])
    return panel


def error_over_position(subject: Subject) -> Section:
    """RMS error and share of the squared error in bins of position."""
    key, title = "error-over-position", "Error over position"
    explanation = "High bars mark the positions at which the model differs most from the recording."
    compared = Compared.of(subject)
    if compared is None:
        return Section(key, title, explanation, left_out=NO_RECORDING)
    bins = int(np.clip(len(compared.position) // ROWS_PER_BIN, 5, MOST_BINS))
    edges = np.linspace(compared.position.min(), compared.position.max(), bins + 1)
    rows, _ = np.histogram(compared.position, edges)
    squares, _ = np.histogram(compared.position, edges, weights=compared.found.residual**2)
    used = rows > 0
    rms = np.sqrt(squares[used] / rows[used])
    share = squares[used] / squares.sum() if squares.any() else squares[used]
    x, y = compared.x, scale_for(compared.recording.units["force"], rms)
    left, right = x.factor * edges[:-1][used], x.factor * edges[1:][used]
    above = Panel(x.label("position"), y.label("RMS error"), 210)
    above.bars(left, right, y.factor * rms)
    below = Panel(x.label("position"), "share of squared error [%]", 190, above=above)
    below.bars(left, right, 100.0 * share)
    worst = int(np.argmax(share))
    mean = 0.5 * (edges[:-1] + edges[1:])[used]
    unit = compared.recording.units["position"]
    spread = float(np.std(compared.force))
    sentences = [
        f"The largest part, {percent(float(share[worst]))} of the squared error, lies near position "
        f"{amount(float(mean[worst]), unit)}: RMS {compared.amount(float(rms[worst]))}"
        + (f", NRMSE {percent(float(rms[worst]) / spread)}." if spread else ".")
    ]
    description = (
        "RMS error in equal intervals of position; below, the share of each interval in the squared error."
    )
    return Section(key, title, explanation, sentences, [Chart(description, above, below)])


def whiteness(subject: Subject) -> Section:
    """Autocorrelation of the residuals with its 95 % bound."""
    key, title = "whiteness", "Pattern in the residuals"
    explanation = (
        "Residuals without pattern are noise; bars beyond the dotted lines show that a part of the force is "
        "still missing in the model."
    )
    compared = Compared.of(subject)
    if compared is None:
        return Section(key, title, explanation, left_out=NO_RECORDING)
    residual, order = compared.found.residual, "time"
    n = len(residual)
    if n < LEAST_WHITENESS_ROWS:
        reason = f"{n} rows were compared; an autocorrelation needs {LEAST_WHITENESS_ROWS}"
        return Section(key, title, explanation, left_out=reason)
    if compared.recording.time is None:
        direction = np.zeros(n) if compared.direction is None else compared.direction
        residual, order = residual[np.lexsort((compared.position, direction))], "position"
    correlation = autocorrelation(residual - residual.mean(), min(MOST_LAGS, n // 4))
    bound = BOUND_95 / np.sqrt(n)
    lag = np.arange(1.0, len(correlation) + 1.0)
    panel = Panel("distance [rows]", "autocorrelation", 240)
    panel.bars(lag - 0.35, lag + 0.35, correlation, "autocorrelation")
    panel.level(0.0, "line")
    panel.level(bound, "dotted", "95 % bound of white residuals")
    panel.level(-bound, "dotted")
    outside = int(np.count_nonzero(np.abs(correlation) > bound))
    sentence = (
        f"{outside} of {len(lag)} bars are beyond the bound of {bound:.2g}; about {0.05 * len(lag):.2g} are "
        f"expected for residuals without pattern. Neighbouring rows correlate with {correlation[0]:.2g}. All "
        f"residuals together are {percent(compared.found.nrmse)} of the spread of the recorded force "
        "(NRMSE); the verdict judges this share."
    )
    description = f"Correlation of residuals at a distance of 1 to {len(lag)} rows, in the order of {order}."
    return Section(key, title, explanation, [sentence], [Chart(description, panel)])


def just_noticeable(subject: Subject) -> Section:
    """Curve with the band of forces that a hand does not distinguish, and the rows outside of it."""
    key, title = "just-noticeable", "Differences that a hand feels"
    explanation = (
        f"A hand does not feel a difference of less than about {FORCE_JND:.0%} of the force; dots in the "
        "grey band feel like the model."
    )
    compared = Compared.of(subject)
    if compared is None:
        return Section(key, title, explanation, left_out=NO_RECORDING)
    found, x, y = compared.found, compared.x, compared.y
    panel = Panel(x.label("position"), y.label("force"), 320)
    curves = curves_of(subject)
    for curve in curves:
        low, high = force_jnd_band(curve.force, found.jnd_floor)
        name = f"not noticeable{curve.suffix}"
        panel.band(x.factor * curve.position, y.factor * low, y.factor * high, name)
    inside = within_force_jnd(compared.force, found.residual)
    # Both series are thinned together, so that the picture shows the share of each.
    at, force, within = thinned(compared.position, compared.force, inside.astype(float), most=MOST_DOTS)
    for rows, mark, text in (
        (within > 0, "soft-dots", "not noticeable"),
        (within == 0, "outside", "noticeable"),
    ):
        panel.dots(x.factor * at[rows], y.factor * force[rows], mark, f"recorded, {text}")
    for curve in curves:
        line = x.factor * curve.position, y.factor * curve.force
        panel.line(*line, LINE_MARKS[curve.stroke], f"model{curve.suffix}")
    sentence = (
        f"{percent(found.within_jnd)} of {found.n} rows are inside. The smallest noticeable difference is "
        f"{compared.amount(found.jnd_floor)}, also where the force is near zero."
    )
    description = "Recorded force over position; rows with a noticeable difference to the model are marked."
    return Section(key, title, explanation, [sentence], [Chart(description, panel)])
