# SPDX-License-Identifier: Apache-2.0
"""Sections on the model alone: its wavelets, the path of the selection, and where everything comes from."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from .._core.model import wavelet_columns
from .._typing import Float1D
from ..identification.options import CHOICES
from ..model import Model
from ..model.model_file import fitted_rows
from ..plotting.look import scale_for
from .charts import CLASS_MARKS, Chart, Panel
from .of_comparison import LINE_MARKS, at_rest
from .page import Section
from .subject import Subject
from .words import amount, counted, date_text, interval, percent

WAVELET_POINTS = 61
"""Number of points at which one wavelet is drawn"""

POINTS_PER_WAVE = 8
"""Number of points at which one wave of the harmonic of the highest order is drawn"""

MOST_ORDERS = 5
"""Number of harmonics that the text names"""

WAVELET_HALF_WIDTH = 5.0
"""Half the drawn width of a wavelet, in units of 1/alpha; beyond it the wavelet is below 1e-4 of its peak"""

STOPS = {
    "max_wavelets": "Growth ended at the largest number of wavelets allowed",
    "data": "Growth ended because no further wavelet changes the force at the recorded positions",
    **{
        name: f"Growth ended because the criterion {name.upper()} no longer fell"
        for name in CHOICES["criterion"]
    },
}
"""Reason why the network was not grown further, in words, by its name in the model file"""

_VERDICT_NOTE = "verdict"
"""Key of the notes of a model file that the first section shows"""


def wavelets(subject: Subject) -> Section:
    """Curve of the model, and the line and the wavelets whose sum it is."""
    key, title = "wavelets", "Wavelets of the model"
    explanation = (
        "The curve is the sum of a straight line and these small waves, the wavelets; of a periodic force "
        "also of harmonics."
    )
    model = subject.model
    if model.dimension > 1:
        reason = f"the model has the inputs {', '.join(model.inputs)}; wavelets are drawn for one input"
        return Section(key, title, explanation, left_out=reason)
    if not model.n_wavelets:
        return Section(key, title, explanation, left_out="the model is a straight line without wavelets")
    lower, upper = float(model.lower[0]), float(model.upper[0])
    at, parts = _wavelet_curves(model)
    ends = np.array([lower, upper])
    straight = model.linear[0] * ends + model.bias
    curves = at_rest(subject)
    x = scale_for(model.units["position"], ends)
    y = scale_for(model.units["force"], straight, *(curve.force for curve in curves))
    z = scale_for(model.units["force"], *parts)
    above = Panel(x.label("position"), y.label("force"), 220)
    for curve in curves:
        inside = (curve.position >= lower) & (curve.position <= upper)
        line = x.factor * curve.position[inside], y.factor * curve.force[inside]
        above.line(*line, LINE_MARKS[curve.stroke], f"model{curve.suffix}")
    above.line(x.factor * ends, y.factor * straight, "second", "straight line c x + b", hover=False)
    below = Panel(x.label("position"), z.label("wavelets"), 220, above=above)
    below.lines(
        [x.factor * each for each in at], [z.factor * each for each in parts], "thin", "w ψ(α (x − β)), each"
    )
    below.level(0.0, "dotted")
    sentences = []
    if model.harmonics:
        sentences.append(_largest_orders(model))
    if model.hysteretic:
        sentences.append(
            "Wavelets and line give the mean force of press and release; the hysteresis uses the same "
            "wavelets with other weights."
        )
    description = f"Force of the model with its straight line; below, its {model.terms}."
    return Section(key, title, explanation, sentences, [Chart(description, above, below)])


def _largest_orders(model: Model) -> str:
    """Returns a sentence on the harmonics with the largest amplitudes."""
    orders, place = np.unique(model.orders, return_inverse=True)
    weights = model.weight[model.n_wavelets - model.harmonics :]
    amplitude = np.sqrt(np.bincount(place, weights**2))
    largest = np.argsort(-amplitude)[:MOST_ORDERS]
    unit = model.units["force"]
    named = ", ".join(f"{orders[k]:.0f} ({amount(float(amplitude[k]), unit)})" for k in largest)
    return (
        f"The sum of {counted(len(orders), 'harmonic')} of the period is one curve. The orders with the "
        f"largest amplitudes are {named}."
    )


def _wavelet_curves(model: Model) -> tuple[list[Float1D], list[Float1D]]:
    """Returns positions and values of each weighted wavelet within the domain, and of the sum of all
    harmonics."""
    at, parts = [], []
    hats = model.n_wavelets - model.harmonics
    for alpha, beta, weight in zip(model.alpha[:hats], model.beta[:hats], model.weight[:hats], strict=True):
        reach = WAVELET_HALF_WIDTH / alpha[0]
        low, high = max(model.lower[0], beta[0] - reach), min(model.upper[0], beta[0] + reach)
        if low < high:
            x = np.linspace(low, high, WAVELET_POINTS)
            at.append(x)
            parts.append(weight * wavelet_columns(x[:, None], alpha[None, :], beta[None, :])[:, 0])
    if model.harmonics:
        points = POINTS_PER_WAVE * int(model.orders.max()) + 1
        x = np.linspace(model.lower[0], model.upper[0], max(points, WAVELET_POINTS))
        waves = wavelet_columns(x[:, None], model.alpha[hats:], model.beta[hats:], model.harmonics)
        at.append(x)
        parts.append(waves @ model.weight[hats:])
    return at, parts


def selection_path(subject: Subject) -> Section:
    """Error and criterion over the number of wavelets, one line for each model class."""
    key, title = "selection", "How the size was chosen"
    explanation = (
        "More wavelets reduce the error; the criterion adds the cost of their parameters, and growth ends "
        "when it no longer falls."
    )
    model = subject.model
    if not model.path:
        reason = "the model file lists no networks that identification compared"
        return Section(key, title, explanation, left_out=reason)
    rmse = np.array([step["rmse"] for step in model.path])
    y = scale_for(model.units["force"], rmse)
    criteria = [step["criterion"] for step in model.path]
    least = min((each for each in criteria if each is not None), default=0.0)
    criterion = np.array([np.nan if c is None else c - least + 1.0 for c in criteria])
    above = Panel("wavelets", y.label("RMS error"), 220, log=y.factor * rmse if (rmse > 0.0).all() else None)
    below = Panel(
        "wavelets", "criterion − least + 1", 200, log=criterion[np.isfinite(criterion)], above=above
    )
    size = np.array([float(step["n_wavelets"]) for step in model.path])
    classes = np.array([step["model_class"] for step in model.path])
    for k, name in enumerate(dict.fromkeys(classes)):
        mark, rows = f"class-{k % CLASS_MARKS}", classes == name
        above.steps(size[rows], y.factor * rmse[rows], mark, str(name))
        judged = rows & np.isfinite(criterion)
        below.steps(size[judged], criterion[judged], mark, "")
    sentence = (
        f"The model class is {model.fit.model_class} with {model.terms} and "
        f"{model.n_parameters} parameters: the last point of its line, after wavelets that were not needed "
        f"were removed. {STOPS.get(model.stop_reason, f'Growth was stopped by {model.stop_reason}')}."
    )
    description = "RMS error, and below the criterion minus its least value, over the number of wavelets."
    return Section(key, title, explanation, [sentence], [Chart(description, above, below)])


def provenance(subject: Subject) -> Section:
    """Files with fingerprints, rows, columns, versions, options and dates."""
    model, data, recording = subject.model, subject.model.data, subject.recording
    facts: dict[str, Sequence[str]] = {"report": [f"palpate {_core.__version__}, {date_text(time.time())}"]}
    if subject.file is not None:
        facts["model file"] = [
            str(subject.file),
            f"SHA-256 {subject.sha256}",
            f"written by {model.created_by}, {date_text(subject.written_at_s)}",
        ]
    facts["identified on"] = [
        *_files(data.files, data.sha256),
        f"{fitted_rows(model)} fitted"
        + (f"; every {data.held_out_every}th row was held out" if data.held_out_every else ""),
        *_columns(data.columns),
    ]
    facts["model"] = [
        f"{model.kind}, model class {model.fit.model_class}, {model.terms}, {model.n_parameters} parameters",
        f"NRMSE {percent(model.fit.nrmse)} on the fitted rows",
        *_domain(model),
    ]
    if recording is not None and subject.verification is not None:
        source = recording.source
        of_file = f" of {source.file_rows} in the file" if source.file_rows else ""
        held_out = ", the held-out rows" if source.held_out else ""
        facts["compared with"] = [
            *_files(source.files, source.sha256),
            f"{source.rows} rows read{of_file}{held_out}; {subject.verification.n} compared",
            *(recording.notes or _columns(source.columns)),
            *subject.verification.notes,
            *(f"{name}: {value}" for name, value in recording.metadata.items()),
        ]
    for name, note in model.notes.items():
        if name != _VERDICT_NOTE and (lines := [_text(each) for each in _listed(note)]):
            facts[name.replace("_", " ")] = lines
    explanation = (
        "With these files, columns and versions the result can be repeated; a file is the same if its "
        "SHA-256 is the same."
    )
    return Section("provenance", "Origin of the data", explanation, facts=facts)


def _files(files: Sequence[str], sha256: str) -> list[str]:
    digests = sha256.split()
    names = [*files, *["arrays in memory"] * (len(digests) - len(files))]
    return [f"{name}\nSHA-256 {digest}" for name, digest in zip(names, digests, strict=False)] or list(names)


def _columns(columns: Mapping[str, str]) -> list[str]:
    return ["columns: " + ", ".join(f"{role} is {name}" for role, name in columns.items())] if columns else []


def _domain(model: Model) -> list[str]:
    lines = []
    for name, low, high in zip(model.inputs, model.lower, model.upper, strict=True):
        unit = model.units["position"] if name == "position" else ""
        lines.append(f"domain of {name}: {interval(float(low), float(high), unit)}")
    if model.period is not None:
        lines.append(f"repeats every {amount(model.period, model.units['position'])}")
    else:
        lines.append(f"continuation below the domain: {model.below}, above: {model.above}")
    return lines


def _listed(note: Any) -> list[Any]:
    """Returns the entries of a note of a model file; none if it has no content."""
    return note if isinstance(note, list) else [] if note is None else [note]


def _text(note: Any) -> str:
    """Returns a note in words: "press: 900, release: 850" for a mapping."""
    if isinstance(note, dict):
        return ", ".join(f"{str(name).replace('_', ' ')}: {_text(each)}" for name, each in note.items())
    if isinstance(note, list):
        return ", ".join(map(_text, note))
    return f"{note:.4g}" if isinstance(note, float) else str(note)
