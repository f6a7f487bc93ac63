# SPDX-License-Identifier: Apache-2.0
"""Parts of a model file except the network, and the description of a model as text.

The core reads and checks model files; `model.schema.json` describes them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

from .._core.io import largest_json_bytes
from .._core.model import Memory
from .._core.stability import Certificate
from .._typing import Float1D
from ..errors import InputError, escaped
from ..recording.files import replacing
from ..recording.units import Unit, unit_of_dynamics
from .band import BAND_LEVEL, Band

_MULTILINE_FIELDS = ("network", "memory", "fit", "band", "plan", "certificate")
"""JSON objects of a model file that are written with each of their fields on its own line."""


class PathStep(TypedDict):
    """One network that identification compared: its number of wavelets, error and criterion."""

    n_wavelets: int
    rmse: float
    criterion: float | None
    """Criterion that decides when to stop adding wavelets (smaller is better); None if it is not defined"""
    model_class: str


@dataclass(frozen=True)
class Fit:
    """Result of an identification: model class, error and size of the model."""

    model_class: str
    """Simplest accepted model class: constant, linear, position, hysteresis, ..."""
    stop_reason: str
    nrmse: float
    """RMS error divided by the population standard deviation of the force, on the rows that were fitted"""
    n_wavelets: int
    n_parameters: int
    """Number of fitted real numbers of the model, including dilations and translations"""
    path: Sequence[PathStep] = ()

    def record(self) -> dict[str, Any]:
        """Returns the fit for a model file, with NumPy numbers converted to Python."""
        return {
            "model_class": self.model_class,
            "stop_reason": self.stop_reason,
            "nrmse": float(self.nrmse),
            "n_wavelets": int(self.n_wavelets),
            "n_parameters": int(self.n_parameters),
            "path": [
                {
                    "n_wavelets": int(step["n_wavelets"]),
                    "rmse": float(step["rmse"]),
                    "criterion": None if step["criterion"] is None else float(step["criterion"]),
                    "model_class": step["model_class"],
                }
                for step in self.path
            ],
        }


def memory_record(memory: Memory) -> dict[str, Any]:
    """Returns the memory of a model for a model file; a branch that does not relax, or does not slip, has
    None."""
    record = {
        "alpha": memory.alpha.tolist(),
        "beta": memory.beta.tolist(),
        "weight": memory.weight.tolist(),
        "linear": memory.linear,
        "bias": memory.bias,
        "stiffness": memory.stiffness.tolist(),
        "time_constant_s": _finite(memory.time_constant_s),
    }
    if np.isfinite(memory.yield_stretch).any():
        record["yield_stretch"] = _finite(memory.yield_stretch)
    return record


def _finite(values: Float1D) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values.tolist()]


def memory_of(record: Mapping[str, Any]) -> Memory:
    """Returns the memory of a record of :func:`memory_record`."""
    given = dict(record)
    for name in ("time_constant_s", "yield_stretch"):
        if name in given:
            given[name] = [math.inf if value is None else value for value in given[name]]
    return Memory(**given)


def certificate_record(certificate: Certificate) -> dict[str, Any]:
    """Returns the certificate for a model file, without the scheme, which the plan stores."""
    record = certificate.to_dict()
    del record["scheme"]
    return {
        **record,
        "structure": certificate.scheme.structure,
        "device": certificate.device.to_dict(),
        "bounds": certificate.bounds.to_dict(),
        "inequalities": [line.to_dict() for line in certificate.inequalities],
    }


def write_json(path: Path, content: dict[str, Any]) -> Path:
    """Writes readable JSON; the file gets its name only when it is completely written."""
    text = f"{_lines(content, '')}\n".encode()
    if len(text) > largest_json_bytes:
        raise InputError(
            f"{path} would have {len(text)} bytes: must have at most {largest_json_bytes}, as otherwise it "
            "cannot be read; remove notes, or identify the model with fewer wavelets"
        )
    with replacing(path) as temporary:
        temporary.write_bytes(text)
    return path


def _lines(content: dict[str, Any], indent: str) -> str:
    inner = indent + "  "
    fields = []
    for key, value in content.items():
        multiline = key in _MULTILINE_FIELDS and not indent and value is not None
        text = _lines(value, inner) if multiline else json.dumps(value, allow_nan=False)
        fields.append(f"{inner}{json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(fields) + f"\n{indent}}}"


if TYPE_CHECKING:
    from .model import Model

CONTINUATIONS = {"free": "falls to zero", "linear": "continues straight"}
"""Maps the name of the continuation of a force to words"""


def describe(model: Model) -> str:
    """Returns verdict, terms, domain, units and fit of a model as text."""
    position, force = (model.units[role] or "SI" for role in ("position", "force"))
    fit, data = model.fit, model.data
    lines = [
        f"verdict: {model.verdict.level}",
        *(f"  {reason}" for reason in model.verdict.reasons),
        f"{model.kind} model: {model.terms}, {model.n_parameters} parameters "
        f"(model class {fit.model_class}, stopped by {fit.stop_reason})",
        f"  NRMSE {fit.nrmse:.4g} on {fitted_rows(model)} of "
        f"{', '.join(map(escaped, data.files)) or 'arrays'}",
    ]
    if data.held_out_every:
        lines.append(f"  every {data.held_out_every}th row was held out")
    for index, name in enumerate(model.inputs):
        unit = f" {position}" if name == "position" else ""
        lines.append(f"  {escaped(name)} from {model.lower[index]:.6g} to {model.upper[index]:.6g}{unit}")
    outside = f"below: {model.below}, above: {model.above}"
    lines.append(
        f"  outside: {outside}" if model.period is None else f"  repeats every {model.period:.6g} {position}"
    )
    if model.slope_bounds is not None:
        low, high = model.slope_bounds
        lines.append(f"  slope from {low:.4g} to {high:.4g} {force}/{position}")
    if model.band is not None:
        lines += _band_lines(model.band, model.units)
    if model.play_radius is not None:
        lines.append(f"  play radius {model.play_radius:.4g} {position}")
    lines += [f"  {name} {value}" for name, value in dynamics_of(model).items()]
    lines += ["", *_terms(model, force)]
    return "\n".join(lines)


def dynamics_of(model: Model) -> dict[str, str]:
    """Returns mass and damping of a model with their units for display, by name, without those that are
    zero or that it does not have."""
    units = model.units["force"], model.units["position"]
    values = {"mass": model.mass, "damping": model.damping}
    return {
        name: f"{value:.4g} {unit_of_dynamics(name, *units)}".rstrip()
        for name, value in values.items()
        if value
    }


def fitted_rows(model: Model) -> str:
    """Returns the rows with which the error of the fit was computed: "80 of 100 rows", or "100 rows"."""
    fitted, rows = model.notes.get("error_rows"), model.data.rows
    return f"{fitted} of {rows} rows" if isinstance(fitted, int) and fitted < rows else f"{rows} rows"


def _band_lines(band: Band, units: Mapping[str, str]) -> list[str]:
    """Returns the widths of the band and its check in sentences."""
    force = Unit.of_si(units["force"])
    widths = {"a further recording of the same object": band.repeat, "a further object": band.object}
    lines = [
        f"  {BAND_LEVEL:.0%} band of {name}: +- {force.interval(float(half.min()), float(half.max()))}"
        for name, half in widths.items()
        if half is not None
    ]
    inside = "" if band.coverage is None else f", {band.coverage:.1%} of its rows in the band"
    lines.append(
        f"  {band.recordings} recordings of {band.objects} object{'s' if band.objects > 1 else ''}; one "
        f"{band.left_out} left out of the fit at a time: RMS error {force.text(band.unseen_error)}{inside}"
    )
    return lines


def terms_of(model: Model) -> str:
    """Returns the numbers of wavelets and harmonics of a model as text."""
    counts = {"wavelet": model.n_wavelets - model.harmonics, "harmonic": len(np.unique(model.orders))}
    shown = [name for name, count in counts.items() if count or (name == "wavelet" and not model.harmonics)]
    return " and ".join(f"{counts[name]} {name}{'' if counts[name] == 1 else 's'}" for name in shown)


def phases_of(model: Model) -> Float1D:
    """Returns the phase (H,) of each harmonic at position 0, from -pi to pi [rad]."""
    hats = model.n_wavelets - model.harmonics
    return np.asarray(np.angle(np.exp(1j * model.alpha[hats:, 0] * model.beta[hats:, 0])))


def _terms(model: Model, force: str) -> list[str]:
    """Returns the model's force as a formula, and the wavelets and harmonics of its network as tables."""
    names = ["x"] if model.dimension == 1 else [f"x{k + 1}" for k in range(model.dimension)]
    slopes = zip(model.linear, names, strict=True)
    linear = "".join(f"{c:+.6g} {name} " for c, name in slopes if c or not model.harmonics)
    hats = model.n_wavelets - model.harmonics
    network = "sum_i w_i psi(alpha_i (x - beta_i)) " if hats else ""
    if model.harmonics:
        waves = "sum_k w_k cos(n_k 2 pi x / period - phase_k) "
        network = f"{network}+ {waves}" if hats else waves
    unit = f"  [{force}]"
    hysteretic = model.weight_hysteresis is not None and model.linear_hysteresis is not None
    if model.memory is not None:
        ratio = f"sum of {len(model.memory.weight)} wavelets " if len(model.memory.weight) else ""
        branches = zip(
            model.memory.stiffness, model.memory.time_constant_s, model.memory.yield_stretch, strict=True
        )
        formula = [
            f"  f(x, t) = g(x) + p(x) sum_j k_j e_j{unit}, de_j/dt = p(x) dx/dt - e_j / tau_j, |e_j| <= Y_j",
            f"  g(x) = {network}{linear}{model.bias:+.6g}",
            f"  p(x) = {ratio}{model.memory.linear:+.6g} x {model.memory.bias:+.6g}",
            *(
                f"  branch {j}: k = {k:.6g}"
                + (f", tau = {tau:.6g} s" if math.isfinite(tau) else "")
                + (f", Y = {most:.6g}" if math.isfinite(most) else "")
                for j, (k, tau, most) in enumerate(branches)
            ),
        ]
    elif not hysteretic:
        formula = [f"  f(x) = {network}{linear}{model.bias:+.6g}{unit}"]
    else:
        assert model.linear_hysteresis is not None
        loss = f"{model.linear_hysteresis[0]:+.6g} x {model.bias_hysteresis:+.6g}"
        network_h = network.replace("w_i", "v_i").replace("w_k", "v_k")
        formula = [
            f"  f(x, s) = g(x) + s h(x){unit}, s = +1 pressing, -1 releasing",
            f"  g(x) = {network}{linear}{model.bias:+.6g}",
            f"  h(x) = {network_h}{loss}",
        ]
    end = ["w", *(["v"] if hysteretic else [])]
    weights = [model.weight, *([] if model.weight_hysteresis is None else [model.weight_hysteresis])]
    values = np.column_stack([model.alpha, model.beta, *weights])[:hats]
    shape = [f"{word}{k}" for word in ("alpha", "beta") for k in _numbers(model.dimension)]
    lines = _table(["i", *shape, *end], [[str(i), *map(_shown, row)] for i, row in enumerate(values)])
    rows = zip(model.orders, phases_of(model), *(each[hats:] for each in weights), strict=True)
    harmonics = [[f"{order:.0f}", *map(_shown, row)] for order, *row in rows]
    return [*formula, *lines, *_table(["n", "phase [rad]", *end], harmonics)]


def _shown(value: float) -> str:
    return f"{value:.6g}"


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Returns the lines of a table with right-aligned columns; no line without rows."""
    table = [head, *rows] if rows else []
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in table
    ]


def _numbers(dimension: int) -> list[str]:
    return [""] if dimension == 1 else [str(k + 1) for k in range(dimension)]
