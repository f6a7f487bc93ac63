# SPDX-License-Identifier: Apache-2.0
"""Check what a model file holds, and name the first field that is wrong."""

from __future__ import annotations

import json
import math
from typing import Any

from pydantic import ValidationError

from .._core.device import longest_delay_s
from ..arguments import shown
from ..errors import InputError
from .schema import VERSION, ModelFile, Network

_PERIOD_TOLERANCE = 1e-9
"""How far, as a share of the travel, the period may be from upper - lower."""

_SHOWN = 40
"""Characters of a wrong value that an error shows."""


def checked(content: Any) -> ModelFile:
    """Check the parsed content of a model file.

    Raises
    ------
    InputError
        ``network.alpha[0][0] is -1.0: must be > 0`` and the like: field path, value, what would be right.
    """
    if not isinstance(content, dict):
        raise InputError(f"the file holds {shown(content)}: must be an object")
    _require_known_version(content)
    _require_finite(content, "")
    try:
        file = ModelFile.model_validate(content)
    except ValidationError as error:
        raise InputError(_sentence(error.errors()[0])) from None
    _check_network(file.network, "network")
    _check_kind(file)
    _check_domain(file)
    _check_rest(file)
    _check_plan(file)
    return file


def _require_known_version(content: dict[str, Any]) -> None:
    """Before anything else: a file of another version may differ in every other field."""
    version = content.get("version")
    if type(version) is int and version != VERSION:
        raise InputError(f"version is {version}: must be {VERSION}, the version that this palpate reads")


def _require_finite(value: Any, path: str) -> None:
    """NaN and Infinity are no JSON, but Python's parser lets them in, and reads 1e999 as infinity."""
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{path} is {value}: must be a finite number")
    if isinstance(value, dict):
        for key, item in value.items():
            _require_finite(item, f"{path}.{key}" if path else str(key))
    if isinstance(value, list):
        for index, item in enumerate(value):
            _require_finite(item, f"{path}[{index}]")


def _sentence(error: Any) -> str:
    path = ""
    for part in error["loc"]:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else str(part)
    context = error.get("ctx", {})
    kind = error["type"]
    if kind == "missing":
        return f"{path} is missing"
    if kind == "extra_forbidden":
        return f"{path} is not a key of this format (free keys go under notes)"
    right = {
        "greater_than": f"> {context.get('gt', 0):g}",
        "greater_than_equal": f">= {context.get('ge', 0):g}",
        "less_than_equal": f"<= {context.get('le', 0):g}",
        "bool_type": "true or false",
        "float_type": "a number",
        "int_type": "a whole number",
        "int_from_float": "a whole number",
        "string_type": "text",
        "list_type": "a list",
        "dict_type": "an object",
        "model_type": "an object",
        "literal_error": context.get("expected", ""),
    }.get(kind, error["msg"])
    return f"{path} is {_shown(error['input'])}: must be {right}"


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def _require(holds: bool, path: str, found: Any, right: str) -> None:
    if not holds:
        raise InputError(f"{path} is {_shown(found)}: must be {right}")


def _require_length(values: list[Any], length: int, path: str, meaning: str) -> None:
    if len(values) != length:
        raise InputError(f"{path} has {len(values)} values: must have {length}, {meaning}")


def _check_network(network: Network, path: str) -> None:
    d, n = network.dimension, len(network.alpha)
    one_each, one_per_input = "one for each wavelet of alpha", "one for each dimension"
    for name, rows in (("alpha", network.alpha), ("beta", network.beta)):
        _require_length(rows, n, f"{path}.{name}", one_each)
        for index, row in enumerate(rows):
            _require_length(row, d, f"{path}.{name}[{index}]", one_per_input)
    _require_length(network.weight, n, f"{path}.weight", one_each)
    _require_length(network.linear, d, f"{path}.linear", one_per_input)
    hysteretic = network.weight_hysteresis is not None
    for name in ("linear_hysteresis", "bias_hysteresis"):
        value = getattr(network, name)
        right = "given, because weight_hysteresis is" if hysteretic else "null, because weight_hysteresis is"
        _require((value is not None) == hysteretic, f"{path}.{name}", value, right)
    if network.weight_hysteresis is not None and network.linear_hysteresis is not None:
        _require(d == 1, f"{path}.dimension", d, "1 in a model with hysteresis")
        _require_length(network.weight_hysteresis, n, f"{path}.weight_hysteresis", one_each)
        _require_length(network.linear_hysteresis, d, f"{path}.linear_hysteresis", one_per_input)


def _check_kind(file: ModelFile) -> None:
    hysteretic = file.network.weight_hysteresis is not None
    _require(
        file.kind != "hysteresis" or hysteretic, "kind", file.kind, "another kind: weight_hysteresis is null"
    )
    _require(
        file.kind != "position" or not hysteretic, "kind", file.kind, "hysteresis: weight_hysteresis is given"
    )
    _require_length(file.inputs, file.network.dimension, "inputs", "one for each dimension")
    if not hysteretic:
        _require(
            file.play_radius is None, "play_radius", file.play_radius, "null in a model without hysteresis"
        )


def _check_domain(file: ModelFile) -> None:
    d, domain, period = file.network.dimension, file.domain, file.continuation.period
    for name in ("lower", "upper"):
        _require_length(getattr(domain, name), d, f"domain.{name}", "one for each dimension")
    for index, (low, high) in enumerate(zip(domain.lower, domain.upper, strict=True)):
        _require(low < high, f"domain.lower[{index}]", low, f"below domain.upper[{index}] = {high}")
    if period is not None:
        travel = domain.upper[0] - domain.lower[0]
        _require(d == 1, "continuation.period", period, "null in a model of several inputs")
        _require(
            abs(period - travel) <= _PERIOD_TOLERANCE * travel,
            "continuation.period",
            period,
            f"domain.upper - domain.lower = {travel}",
        )


def _check_rest(file: ModelFile) -> None:
    n = len(file.network.alpha)
    bounds = file.slope_bounds
    if bounds is not None:
        _require(
            bounds.min <= bounds.max,
            "slope_bounds.min",
            bounds.min,
            f"at most slope_bounds.max = {bounds.max}",
        )
    _require(
        file.fit.n_wavelets == n, "fit.n_wavelets", file.fit.n_wavelets, f"{n}, the wavelets of the network"
    )


def _check_planned_network(planned: Network, identified: Network) -> None:
    """The network of a plan has the inputs and the hysteresis of the identified one."""
    _check_network(planned, "plan.network")
    _require(
        planned.dimension == identified.dimension,
        "plan.network.dimension",
        planned.dimension,
        f"{identified.dimension}, that of network",
    )
    hysteretic = identified.weight_hysteresis is not None
    _require(
        (planned.weight_hysteresis is not None) == hysteretic,
        "plan.network.weight_hysteresis",
        planned.weight_hysteresis,
        "given, because that of network is" if hysteretic else "null, because that of network is",
    )


def _check_plan(file: ModelFile) -> None:
    plan, certificate = file.plan, file.certificate
    if plan is not None:
        for name, used in (
            ("coupling", plan.structure != "direct"),
            ("inertia", plan.structure not in ("direct", "massless")),
        ):
            value = getattr(plan, name)
            right = f"given: the structure has {name}" if used else f"null: the structure has no {name}"
            found = None if value is None else value.model_dump()
            _require((value is not None) == used, f"plan.{name}", found, right)
        if plan.network is not None:
            _check_planned_network(plan.network, file.network)
    if certificate is None:
        return
    if plan is None:
        raise InputError("certificate is given: must be null, because plan is")
    _require(
        certificate.structure == plan.structure,
        "certificate.structure",
        certificate.structure,
        "that of the plan",
    )
    longest = longest_delay_s(certificate.device.period_s)
    _require(
        certificate.device.delay_s <= longest,
        "certificate.device.delay_s",
        certificate.device.delay_s,
        f"at most {longest}",
    )
    unit = certificate.device.position_unit
    _require(
        file.units.position in ("", unit),
        "certificate.device.position_unit",
        unit,
        "the unit of the model's position",
    )
