# SPDX-License-Identifier: Apache-2.0
"""Model: the identified force law, with the recordings and settings from which it was identified."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import __version__
from .._core.io import check_model, read_json
from .._core.model import ForceModel, Memory
from .._typing import Float1D
from ..arguments import holds_numbers, instance_of, path_of, shown
from ..errors import InputError
from ..frames import pd
from ..recording import Source
from ..recording.files import require_file
from ..verdict import Verdict
from .band import Band
from .model_display import frame_of, html_of
from .model_file import Fit, PathStep, describe, memory_of, memory_record, terms_of, write_json

_VALUES_KEY = "sha256_of_values"
"""Key in the notes of a model file: SHA-256 of positions and forces of the recordings."""

_HELD_OUT_KEY = "held_out_every"
"""Key in the notes of a model file whose value is k if every k-th row of the recordings was held out."""

COMPENSATION_KEY = "compensation"
"""Key in the notes of a model file: the share of a motor's cogging that the model, its negative, cancels."""

_NUMBER_ARGUMENTS = ("bias", "bias_hysteresis", "period", "play_radius")
"""Arguments of `Model` that are one number."""

_OPTIONAL_ARGUMENTS = ("weight_hysteresis", "linear_hysteresis", "bias_hysteresis", "period", "play_radius")
"""Arguments of `Model` that may be None."""


class Model(ForceModel):
    """Force law identified from recordings (paper eq. 4), with domain, units, source and fit.

    ``force``, ``slope``, ``energy``, ``predict``, ``play`` and ``extrapolated`` are those of the compiled
    :class:`palpate._core.model.ForceModel`, as are the network's arrays.

    Parameters
    ----------
    kind : {"position", "hysteresis", "memory", "position_velocity", "general"}
        "hysteresis": f(x, s) = g(x) + s h(x), mean force g of both strokes, hysteresis h, direction state s.
        "memory": the network is the force at rest g(x), and `memory` relaxes.
    inputs : sequence of str
        One name for each dimension of the network, such as ("position",); without the direction of a
        hysteresis model.
    units : mapping
        {"position": "rad" | "m" | "count" | "", "force": "N*m" | "N" | "A" | ""}.
    alpha, beta : (N, d) array_like
        Dilations and translations; N may be 0.
    weight : (N,) array_like
    linear : (d,) array_like
    bias : float
    weight_hysteresis, linear_hysteresis, bias_hysteresis : optional
        Weights (N,), slopes (d,) and constant of the hysteresis h, which has the wavelets of g; all or none.
    harmonics : int
        Number of last wavelets that are harmonics of the period, w cos(alpha (x - beta)) in place of
        w psi(alpha (x - beta)), with order alpha period / (2 pi), amplitude w and phase alpha beta [rad].
    memory : Memory, optional
        Branches that relax, for a force of position: springs in series with dashpots.
    lower, upper : (d,) array_like
        Domain: least and largest value of each input in the recordings.
    below, above : {"linear", "free"}
        Continuation of the force below and above the domain.
    period : float, optional
        Period of a force that repeats over position [m or rad].
    play_radius : float, optional
        Play radius of the hysteresis [m or rad], if known.
    fit : Fit
        Result of the identification.
    data : Source
        Files, fingerprints and columns of the recordings.
    mass, damping : float, optional
        Mass and viscous damping of the object, fitted together with the force.
    band : Band, optional
        Range of force of a further recording, from several recordings.
    slope_bounds : (min, max), optional
        Bounds of df/dx over the domain; computed by default (d = 1).
    plan, certificate : mapping, optional
        Plan of the rendering and its certificate. The certificate is computed again, and refused if it
        differs.
    notes : mapping, optional
        Further information to keep in the file.
    created_by : str, optional
        Program that wrote the file; by default this palpate.

    Raises
    ------
    ValueError
        A shape or value is wrong; the message names the field.
    """

    def __init__(
        self,
        *,
        kind: str,
        inputs: Sequence[str],
        units: Mapping[str, str],
        alpha: npt.ArrayLike,
        beta: npt.ArrayLike,
        weight: npt.ArrayLike,
        linear: npt.ArrayLike,
        bias: float,
        weight_hysteresis: npt.ArrayLike | None = None,
        linear_hysteresis: npt.ArrayLike | None = None,
        bias_hysteresis: float | None = None,
        harmonics: int = 0,
        memory: Memory | None = None,
        lower: npt.ArrayLike,
        upper: npt.ArrayLike,
        below: str = "linear",
        above: str = "linear",
        period: float | None = None,
        play_radius: float | None = None,
        fit: Fit,
        data: Source,
        mass: float | None = None,
        damping: float | None = None,
        band: Band | None = None,
        slope_bounds: tuple[float, float] | None = None,
        plan: Mapping[str, Any] | None = None,
        certificate: Mapping[str, Any] | None = None,
        notes: Mapping[str, Any] | None = None,
        created_by: str | None = None,
    ) -> None:
        network: dict[str, Any] = {
            "alpha": alpha,
            "beta": beta,
            "weight": weight,
            "linear": linear,
            "bias": bias,
            "weight_hysteresis": weight_hysteresis,
            "linear_hysteresis": linear_hysteresis,
            "bias_hysteresis": bias_hysteresis,
            "lower": lower,
            "upper": upper,
            "period": period,
            "play_radius": play_radius,
        }
        for name, value in network.items():
            _require_numbers(name, value)
        for name, word in (("kind", kind), ("below", below), ("above", above)):
            instance_of(name, word, str, "one of the words in the documentation of Model")
        instance_of("harmonics", harmonics, int, "a whole number")
        if harmonics < 0:
            raise InputError(f"harmonics is {harmonics}: must be >= 0")
        instance_of("inputs", inputs, (list, tuple), "the names of the inputs")
        instance_of("units", units, Mapping, "the units of position and force")
        instance_of("fit", fit, Fit, "the result of the identification")
        instance_of("data", data, Source, "the source of the recordings")
        instance_of("band", band, (Band, NoneType), "the band of several recordings")
        of_velocity = kind == "position_velocity" and len(inputs) == 2
        position_unit, force_unit = (str(units.get(role, "")) for role in ("position", "force"))
        super().__init__(
            **network,
            harmonics=harmonics,
            below=below,
            above=above,
            of_velocity=of_velocity,
            memory=memory,
            position_unit=position_unit,
            force_unit=force_unit,
        )
        self.kind = kind
        self.inputs = tuple(inputs)
        self.units = dict(units)
        self.fit = fit
        self.data = data
        self.mass = mass
        self.damping = damping
        self.band = band
        if slope_bounds is None and self.dimension == 1:
            slope_bounds = self.slope_range()
        self.slope_bounds = slope_bounds
        self.plan = None if plan is None else dict(plan)
        self.certificate = None if certificate is None else dict(certificate)
        self.notes = dict(notes or {})
        self.created_by = created_by or f"palpate {__version__}"
        check_model(self.to_dict())

    @classmethod
    def from_network(
        cls,
        *,
        alpha: npt.ArrayLike,
        beta: npt.ArrayLike,
        weight: npt.ArrayLike,
        lower: npt.ArrayLike,
        upper: npt.ArrayLike,
        **arguments: Any,
    ) -> Model:
        """Returns a model from given numbers, without identification.

        Parameters
        ----------
        alpha, beta, weight, lower, upper : array_like
            As for Model.
        **arguments
            Any other argument of Model. Defaults: no linear part, no bias, unstated SI units, and the kind
            and input names that follow from the shapes.

        Raises
        ------
        ValueError
            A shape or value is wrong; the message names the field.
        """
        d, n = np.size(lower), np.size(weight)
        hysteretic = arguments.get("weight_hysteresis") is not None
        given: dict[str, Any] = {
            "kind": _kind_of(d, hysteretic=hysteretic, memory=arguments.get("memory") is not None),
            "inputs": ("position",) if d == 1 else tuple(f"input_{k + 1}" for k in range(d)),
            "units": {"position": "", "force": ""},
            "linear": np.zeros(d),
            "bias": 0.0,
            "fit": Fit("given", "given", 0.0, n, (2 * d + 1 + hysteretic) * n + (1 + hysteretic) * (d + 1)),
            "data": Source((), "", 0, {}),
        }
        return cls(alpha=alpha, beta=beta, weight=weight, lower=lower, upper=upper, **given | arguments)

    @property
    def n_parameters(self) -> int:
        """Number of fitted real numbers of the model, including dilations and translations."""
        return self.fit.n_parameters

    @property
    def orders(self) -> Float1D:
        """Order (H,) of each harmonic, the number of its waves in the period [-]; empty without harmonics."""
        waves = self.alpha[self.n_wavelets - self.harmonics :, 0]
        return np.rint(waves * (self.period or 0.0) / (2.0 * np.pi))

    @property
    def terms(self) -> str:
        """Numbers of wavelets and harmonics as text: "12 wavelets", "3 wavelets and 34 harmonics"."""
        return terms_of(self)

    @property
    def stop_reason(self) -> str:
        """Reason why identification stopped adding wavelets."""
        return self.fit.stop_reason

    @property
    def verdict(self) -> Verdict:
        """Verdict of the identification: "good", or "usable" or "no" with the reasons.

        ``model.verdict.level`` is the word, ``model.verdict.reasons`` are sentences with value, likely cause
        and cure, ``str(model.verdict)`` is both. A model without findings is "good".
        """
        record = self.notes.get("verdict", ())
        return Verdict.from_record(record if isinstance(record, list) else ())

    def require_use(self, name: Path | str, *, accepted: bool = False) -> Model:
        """Returns the model if it may be used. Every verb that plans, renders or exports a model calls this.

        Parameters
        ----------
        name : path or str
            Name of the model file, for the message.
        accepted : bool
            True: a model with the verdict "no" may be used. The verdict of the returned copy is "usable" and
            says so.

        Raises
        ------
        InputError
            The verdict of the model is "no".
        """
        verdict = self.verdict.require_use(str(name), "Identify a better model", accepted=accepted)
        if verdict == self.verdict:
            return self
        content = self.to_dict()
        content["notes"] = {**content["notes"], "verdict": verdict.record()}
        return Model.from_dict(content)

    @property
    def path(self) -> Sequence[PathStep]:
        """Networks that identification compared: the number of wavelets, error and criterion of each."""
        return self.fit.path

    @property
    def domain(self) -> tuple[Float1D, Float1D]:
        """Domain: least and largest value of each of the d inputs in the recording, as (lower, upper)."""
        return self.lower, self.upper

    def band_half_width(self, position: npt.ArrayLike) -> Float1D | None:
        """Returns the half width (n,) of the band about the force at positions [m or rad]; None without
        band."""
        if self.band is None:
            return None
        at = np.asarray(position, dtype=np.float64)
        if self.period is not None:
            at = self.lower[0] + np.mod(at - self.lower[0], self.period)
        return self.band.half_width(at)

    @property
    def planned(self) -> Model:
        """Model that the plan renders: with the network stored in the plan, if any, else this model."""
        network = None if self.plan is None else self.plan["network"]
        return self if network is None else self.with_network(**network)

    def with_network(self, **network: Any) -> Model:
        """Returns the model with other network parameters, without plan, certificate and slope bounds.

        Parameters
        ----------
        **network
            alpha, beta, weight, ..., as in a model file; missing ones do not change.
        """
        content = self.to_dict()
        content["network"].update(network)
        added = len(content["network"]["weight"]) - content["fit"]["n_wavelets"]
        content["fit"]["n_wavelets"] += added
        content["fit"]["n_parameters"] += added * (4 if self.hysteretic else 3)
        content.update(plan=None, certificate=None, slope_bounds=None)
        content.pop("band", None)  # it is that of the recordings about the force of this model
        return Model.from_dict(content)

    def to_dict(self) -> dict[str, Any]:
        """Returns the content of a model file."""
        notes = dict(self.notes)
        if self.data.held_out_every:
            notes[_HELD_OUT_KEY] = self.data.held_out_every
        if self.data.values_sha256:
            notes[_VALUES_KEY] = self.data.values_sha256
        hysteresis_weights = self.weight_hysteresis, self.linear_hysteresis
        bounds, memory = self.slope_bounds, self.memory
        return {
            "format": "palpate-model",
            "version": 1,
            "created_by": self.created_by,
            "kind": self.kind,
            "units": self.units,
            "inputs": list(self.inputs),
            "network": {
                "dimension": self.dimension,
                "alpha": self.alpha.tolist(),
                "beta": self.beta.tolist(),
                "weight": self.weight.tolist(),
                "weight_hysteresis": None
                if hysteresis_weights[0] is None
                else hysteresis_weights[0].tolist(),
                "linear": self.linear.tolist(),
                "bias": self.bias,
                "linear_hysteresis": None
                if hysteresis_weights[1] is None
                else hysteresis_weights[1].tolist(),
                "bias_hysteresis": self.bias_hysteresis,
                **({"harmonics": self.harmonics} if self.harmonics else {}),
            },
            **({} if memory is None else {"memory": memory_record(memory)}),
            "play_radius": self.play_radius,
            "mass": self.mass,
            "damping": self.damping,
            "domain": {"lower": self.lower.tolist(), "upper": self.upper.tolist()},
            "continuation": {"below": self.below, "above": self.above, "period": self.period},
            "slope_bounds": None if bounds is None else {"min": bounds[0], "max": bounds[1]},
            "data": {
                "sha256": self.data.sha256,
                # a name that is not UTF-8 contains surrogates, which JSON cannot store
                "files": [name.encode(errors="backslashreplace").decode() for name in self.data.files],
                "rows": self.data.rows,
                "columns": dict(self.data.columns),
            },
            "fit": self.fit.record(),
            **({} if self.band is None else {"band": self.band.record()}),
            "plan": self.plan,
            "certificate": self.certificate,
            "notes": notes,
        }

    @classmethod
    def from_dict(cls, content: Any) -> Model:
        """Returns a model from the content of a model file.

        Raises
        ------
        InputError
            A field is missing, unknown or wrong; the message gives its path and value.
        """
        check_model(content)
        file = dict(content)
        for part in ("format", "version"):
            del file[part]
        memory = file.pop("memory", None)
        network, domain, continuation = (file.pop(part) for part in ("network", "domain", "continuation"))
        bounds, fit, data = (file.pop(part) for part in ("slope_bounds", "fit", "data"))
        band = file.pop("band", None)
        notes = file.get("notes", {})
        held_out_every, values = notes.get(_HELD_OUT_KEY, 0), notes.get(_VALUES_KEY, "")
        return cls(
            **file,
            **{name: value for name, value in network.items() if name != "dimension"},
            **domain,
            **continuation,
            memory=None if memory is None else memory_of(memory),
            slope_bounds=None if bounds is None else (bounds["min"], bounds["max"]),
            fit=Fit(**fit),
            band=None if band is None else Band.from_record(band),
            data=Source(
                files=tuple(data["files"]),
                sha256=data["sha256"],
                rows=data["rows"],
                columns=data["columns"],
                held_out_every=held_out_every if type(held_out_every) is int else 0,
                values_sha256=values if isinstance(values, str) else "",
            ),
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the model file. The file gets its final name only when it is completely written.

        Raises
        ------
        InputError
            The folder does not exist or cannot be written, or a model file cannot store a field.
        """
        target = path_of("path", path)
        content = self.to_dict()
        check_model(content)
        return write_json(target, content)

    def to_frame(self) -> pd.DataFrame:
        """Returns a table of the wavelets, one row each.

        The names of the columns end in the unit: dilation alpha_per_m, translation beta_m, weight_N, and with
        hysteresis weight_hysteresis_N. With several inputs they also contain the name of the input. With
        harmonics, the columns order and phase_rad follow; the order of a wavelet is 0.
        """
        return frame_of(self)

    def _repr_html_(self) -> str:
        return html_of(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return Model.from_dict, (self.to_dict(),)

    def __eq__(self, other: object) -> bool:
        """Returns True if both models would be written as the same model file."""
        return self._text() == other._text() if isinstance(other, Model) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._text())

    def _text(self) -> str:
        return json.dumps(self.to_dict(), sort_keys=True)

    def __str__(self) -> str:
        return describe(self)

    def __repr__(self) -> str:
        return f"<palpate.Model: {self.kind}, {self.terms}, {self.n_parameters} parameters>"


def _kind_of(dimension: int, *, hysteretic: bool, memory: bool) -> str:
    if dimension > 1:
        return "general"
    return "hysteresis" if hysteretic else "memory" if memory else "position"


def _require_numbers(name: str, value: object) -> None:
    """Refuses a network argument that is not made of real numbers."""
    if value is None and name in _OPTIONAL_ARGUMENTS:
        return
    try:
        given = np.asarray(value)
        if not holds_numbers(given) or value is None or np.ma.is_masked(value):
            raise TypeError
        given.astype(np.float64)
    except (TypeError, ValueError):
        given = None
    if given is None or (name in _NUMBER_ARGUMENTS and given.ndim > 0):
        right = "a number" if name in _NUMBER_ARGUMENTS else "an array of numbers"
        raise InputError(f"{name} is {shown(value)}; it must be {right}")


def load_model(path: str | os.PathLike[str], *, with_plan: bool = True) -> Model:
    """Reads a model file.

    Parameters
    ----------
    path : str or path
        The file.
    with_plan : bool
        False ignores plan and certificate, for example to plan a changed model again.

    Raises
    ------
    InputError
        The file does not exist or is not JSON, or a field is missing, unknown or wrong. The message gives the
        file, the path of the field and the value.
    """
    file = path_of("path", path)
    require_file(file)
    content = read_json(file)
    if not with_plan and isinstance(content, dict):
        content = {**content, "plan": None, "certificate": None}
    try:
        return Model.from_dict(content)
    except ValueError as error:
        raise InputError(f"{file}: {error}") from None
