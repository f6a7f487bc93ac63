# SPDX-License-Identifier: Apache-2.0
"""The model file, version 1: its fields, what each may hold, and the JSON schema published from them.

``python -m palpate.model`` prints the JSON schema.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from .._core.rendering import most_prediction_taps

VERSION = 1
"""Version of the file format that is read and written."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0)]


class _Part(BaseModel):
    """Strict types, and no key that is not listed."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class Units(_Part):
    """SI units; "" where the data was handed over in SI without saying in which unit."""

    position: Literal["rad", "m", "count", ""]
    force: Literal["N*m", "N", "A", ""]


class Network(_Part):
    """f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b; with hysteresis f(x, s) = g(x) + s h(x)."""

    dimension: Annotated[int, Field(ge=1)]
    """Number of inputs d"""
    alpha: list[list[Positive]]
    """(N, d) dilations"""
    beta: list[list[Number]]
    """(N, d) translations"""
    weight: list[Number]
    """(N,)"""
    weight_hysteresis: list[Number] | None
    """(N,) weights of h, or null"""
    linear: list[Number]
    """(d,)"""
    bias: Number
    linear_hysteresis: list[Number] | None
    """(d,) or null"""
    bias_hysteresis: Number | None


class Domain(_Part):
    """The box that the data covered."""

    lower: list[Number]
    """(d,)"""
    upper: list[Number]
    """(d,)"""


class Continuation(_Part):
    """What the force is outside the domain: a line, a line that never pulls, or a period."""

    below: Literal["linear", "free"]
    above: Literal["linear", "free"]
    period: Positive | None


class SlopeBounds(_Part):
    """Smallest and largest df/dx measured over the domain."""

    min: Number
    max: Number


class Data(_Part):
    """What the model was identified on."""

    sha256: str
    """SHA-256 of each file, separated by spaces"""
    files: list[str]
    rows: Count
    columns: dict[str, str]


class Step(_Part):
    """One model that identification considered."""

    n_wavelets: Count
    rmse: NotNegative
    criterion: Number | None
    rung: str


class FitRecord(_Part):
    """How the identification ended."""

    rung: str
    stop_reason: str
    nrmse: NotNegative
    n_wavelets: Count
    n_parameters: Count
    path: list[Step]


Structure = Literal["direct", "massless", "implicit", "explicit", "energy-consistent"]


class CouplingRecord(_Part):
    """The spring and damper between device and object."""

    stiffness: Positive
    damping: NotNegative


class InertiaRecord(_Part):
    """What the object resists motion with besides its force."""

    mass: Positive
    damping: NotNegative


class PlanRecord(_Part):
    """How the model is rendered."""

    structure: Structure
    solver: str | None
    coupling: CouplingRecord | None
    """Null for the direct structure, which has none"""
    inertia: InertiaRecord | None
    """Null for structures without mass"""
    compensated: bool
    play_radius: Positive | None
    """In place of the model's own"""
    predict: Annotated[int, Field(ge=1, le=most_prediction_taps)] | None
    """Samples used to predict the position half a sample ahead"""
    refused: list[str]
    """Why simpler structures were refused"""
    network: Network | None
    """Rendered in place of the identified network; null where that is rendered itself"""
    accepted_force_error: NotNegative
    """Largest force error that was accepted [share of the range of the identified force]"""


class DeviceRecord(_Part):
    """The device that the certificate is for; SI units."""

    id: str
    position_unit: Literal["rad", "m"]
    period_s: Positive
    jitter_s: NotNegative
    inertia: Positive
    viscous_damping: NotNegative
    coulomb_friction: NotNegative
    encoder_step: NotNegative
    force_step: NotNegative
    delay_s: NotNegative
    force_limit: Positive


class BoundsRecord(_Part):
    """Proved bounds of the rendered force, continuations included."""

    slope_min: Number
    slope_max: Number
    steepest: Number
    sliding: Number
    loss_min: Number
    loss_max: Number
    loss_per_play: Number
    mean_force: Number
    drag: NotNegative = 0.0
    """Of the velocity; files from before forces of velocity were rendered leave it out"""


class InequalityRecord(_Part):
    """Both sides of one line. Its text, basis and strictness follow from its id."""

    id: str
    left: Number
    right: Number


class CertificateRecord(_Part):
    """What was proved of the plan. It is computed again whenever the file is read."""

    fingerprint: str
    """Over every number and name of the certificate, scheme and model"""
    model: str
    """Fingerprint of the network, domain and continuation"""
    structure: Structure
    device: DeviceRecord
    bounds: BoundsRecord
    inequalities: list[InequalityRecord]
    verdict: Literal["certified", "stable-locally", "refused"]
    longest_period_s: NotNegative
    """Time between two samples up to which every inequality holds"""


class ModelFile(_Part):
    """A model of a force, identified by palpate. SI units."""

    format: Literal["palpate-model"]
    version: Annotated[int, Field(ge=VERSION, le=VERSION)]
    created_by: str
    kind: Literal["position", "hysteresis", "position_velocity", "general"]
    units: Units
    inputs: list[str]
    """One name for each dimension of the network"""
    network: Network
    play_radius: Positive | None
    mass: NotNegative | None
    damping: NotNegative | None
    domain: Domain
    continuation: Continuation
    slope_bounds: SlopeBounds | None
    data: Data
    fit: FitRecord
    plan: PlanRecord | None
    certificate: CertificateRecord | None
    notes: dict[str, Any] = {}
    """Anything; the only place where keys are free"""


def json_schema() -> dict[str, Any]:
    """The JSON schema of a model file (draft 2020-12). Shapes that depend on each other are not in it."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **ModelFile.model_json_schema(),
    }
