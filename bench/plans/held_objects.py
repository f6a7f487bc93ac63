# SPDX-License-Identifier: Apache-2.0
"""Compares measured objects that are proved with a held force and with a held line.

    PALPATE_DATA=FOLDER python bench/plans/held_objects.py --to docs [--every 4] [--models FOLDER]

The objects are those of renderable_pairs.py: key switches, domes and springs. Each is planned as a whole and
as its press curve alone, on example devices with a controller that holds lines, and on the same devices
without it. A rotary device carries the key on a lever of 20 mm. One press curve is also multiplied by the
largest number that is certified. --every 4 takes every fourth object, --models keeps the identified models.

Writes FOLDER/figures/held-objects.json, and the tables of FOLDER/held-lines.md if that page exists.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.plans.renderable_pairs import model_of, options_of, recordings
from bench.studies import fill_tables, markdown_table, measured_data, write_json

from palpate import DeviceProfile, Model, Scheme
from palpate._core.stability import certify, force_bounds, inner_need, line_for
from palpate.cli.printing import number
from palpate.planning import ACCEPTED_FORCE_ERROR, HeldLine, example_profiles
from palpate.planning.candidates import CANDIDATES, Refusal, Task
from palpate.planning.plan import LIMITED, static_force_error, with_network

LEVER_M = 0.02
"""Lever between a key and the shaft of a rotary device [m], an assumption"""

SPEED_M_S = 0.1
"""Largest speed of a press for which a line is certified in the table of curves [m/s]"""

CURVE = "clicky__cherry_mx_blue"
"""Measured object of the table of curves"""

SLIDE_LOOP = HeldLine(period_s=5e-5, delay_s=5e-5, encoder_step=1e-6)
"""Loop assumed for the voice coil: 20 kHz and one period of delay"""


@dataclass(frozen=True)
class Pair:
    """Proofs of one object on one device."""

    object: str
    device: str
    law: str
    """object or press curve"""
    hold: bool
    """True if it is proved with a held force and an accepted force error"""
    line: bool
    """True if it is proved with a held line, or with a held force"""


@dataclass(frozen=True)
class Curve:
    """Steepest slope of a multiple of one press curve that is certified on a device [N/mm]."""

    device: str
    hold: float
    any_speed: float
    line: float
    inner: float


def devices() -> list[DeviceProfile]:
    """Returns the example devices whose controller holds lines, stated or assumed, except wheels, which carry
    no key."""
    profiles = [DeviceProfile.load(file) for file, _ in example_profiles().values()]
    found = [each for each in profiles if each.held_line and each.held_line.largest_center is None]
    coil = DeviceProfile.load(example_profiles()["voice-coil"][0])
    return [*found, DeviceProfile(**coil.to_dict() | {"held_line": SLIDE_LOOP})]


def without_lines(device: DeviceProfile) -> DeviceProfile:
    return DeviceProfile(**device.to_dict() | {"held_line": None})


def on_lever(model: Model) -> Model:
    """Returns a model in m and N as an angle and a torque on the lever."""
    content = model.to_dict()
    network = content["network"]
    network["alpha"] = (np.asarray(network["alpha"]) * LEVER_M).tolist()
    network["beta"] = (np.asarray(network["beta"]) / LEVER_M).tolist()
    powers = {"weight": 1, "bias": 1, "linear": 2}
    for name, power in powers.items():
        for key in (name, f"{name}_hysteresis"):
            if network[key] is not None:
                network[key] = (np.asarray(network[key]) * LEVER_M**power).tolist()
    domain = content["domain"]
    content["domain"] = {end: [value / LEVER_M for value in values] for end, values in domain.items()}
    if content["play_radius"] is not None:
        content["play_radius"] /= LEVER_M
    content.update(units={"position": "rad", "force": "N*m"}, slope_bounds=None, plan=None, certificate=None)
    content.update(mass=None, damping=None)
    content.pop("band", None)
    return Model.from_dict(content)


def press_curve(model: Model, factor: float = 1.0) -> Model:
    """Returns the force of the press alone, multiplied by a number."""
    content = model.to_dict()
    network = content["network"]
    for name in ("weight", "linear", "bias"):
        both = np.asarray(network[name], dtype=np.float64)
        if network[f"{name}_hysteresis"] is not None:
            both = both + np.asarray(network[f"{name}_hysteresis"])
        network[name] = (factor * both).tolist()
        network[f"{name}_hysteresis"] = None
    content.update(kind="position", inputs=["position"], play_radius=None, slope_bounds=None)
    content.update(mass=None, damping=None, plan=None, certificate=None)
    content.pop("band", None)
    return Model.from_dict(content)


def is_proved(task: Task, structures: Sequence[str]) -> bool:
    """Returns True if one of these structures is proved with an accepted force error."""
    for name in structures:
        outcome = CANDIDATES[name].propose(task)
        if isinstance(outcome, Refusal) or not outcome.certificate.certified:
            continue
        error = static_force_error(task.model, outcome.rendered, outcome.scheme)
        if error.share <= ACCEPTED_FORCE_ERROR:
            return True
    return False


def pairs_of(name: str, model: Model, device: DeviceProfile) -> list[Pair]:
    """Returns the proofs of an object and of its press curve on a device."""
    placed = on_lever(model) if device.position_unit == "rad" else model
    found = []
    for law, each in (("object", placed), ("press curve", press_curve(placed))):
        task = Task(with_network(each), device, energy_account=False)
        hold = is_proved(replace(task, device=without_lines(device)), ("direct", LIMITED))
        found.append(Pair(name, device.id, law, hold, hold or is_proved(task, ("tangent",))))
    return found


def largest(holds: Callable[[float], bool]) -> float:
    """Returns the largest factor that is certified, within 0.1 %; 0 if none is."""
    low, high = 1e-4, 1e-4
    while holds(high) and high < 1e4:
        low, high = high, 2.0 * high
    if high == low:
        return 0.0
    while high / low > 1.001:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def curve_on(model: Model, device: DeviceProfile) -> Curve:
    rotary = device.position_unit == "rad"
    curve = press_curve(on_lever(model) if rotary else model)
    to_slope = 1e-3 / (LEVER_M**2 if rotary else 1.0)  # to N/mm at the key
    steepest = force_bounds(curve).slope_max

    def certified(factor: float, motion: float | None) -> bool:
        rendered = press_curve(curve, factor)
        scheme = Scheme(structure="direct")
        if motion is not None:
            scheme = Scheme(structure="tangent", line=line_for(with_network(rendered), device, motion))
            if motion > 1.0 and scheme.line.motion is not None:
                return False
        return bool(certify(rendered, scheme, device).certified)

    speed = SPEED_M_S / (LEVER_M if rotary else 1.0)
    factors = [
        largest(lambda factor: certified(factor, None)),
        largest(lambda factor: certified(factor, 1e3)),
        largest(lambda factor: certified(factor, speed * device.period_s)),
    ]
    inner = device.viscous_damping / inner_need(device.held_line, 1.0)
    return Curve(device.id, *(factor * steepest * to_slope for factor in factors), inner * to_slope)


def tables(pairs: Sequence[Pair], curves: Sequence[Curve]) -> dict[str, str]:
    """Returns the tables of the page; a key is the name in the mark before the table."""
    rows = []
    for device in dict.fromkeys(pair.device for pair in pairs):
        for law in ("object", "press curve"):
            of = [pair for pair in pairs if (pair.device, pair.law) == (device, law)]
            rows.append(
                (device, law, *(f"{sum(getattr(p, n) for p in of)} of {len(of)}" for n in ("hold", "line")))
            )

    def with_ratio(value: float, curve: Curve) -> str:
        return f"{number(value)} (×{value / curve.hold:.2g})" if curve.hold else number(value)

    return {
        "objects": markdown_table(("device", "force", "held force", "held line"), rows, text_columns=(0, 1)),
        "curves": markdown_table(
            ("device", "hold", "line, any speed", f"line, {SPEED_M_S:g} m/s", "controller alone"),
            [
                (
                    each.device,
                    number(each.hold),
                    *(with_ratio(value, each) for value in (each.any_speed, each.line, each.inner)),
                )
                for each in curves
            ],
        ),
    }


def main() -> int:
    options, folder = options_of(__doc__, every=4), measured_data()
    if folder is None:
        return 0
    every = recordings(folder)
    curve = model_of(next(file for _, file in every if file.stem == CURVE), options.models)
    curves = [curve_on(curve, device) for device in devices()]
    print(tables([], curves)["curves"], file=sys.stderr, flush=True)
    pairs: list[Pair] = []
    for _, file in every[:: options.every]:
        model = model_of(file, options.models)
        if model.verdict.level == "no":
            continue
        for device in devices():
            pairs += pairs_of(file.stem.removesuffix("__run1"), model, device)
            print(pairs[-2:], file=sys.stderr, flush=True)
    filled = tables(pairs, curves)
    print("\n\n".join(filled.values()))
    content: dict[str, Any] = {"pairs": [asdict(p) for p in pairs], "curves": [asdict(c) for c in curves]}
    write_json(options.to / "figures" / "held-objects.json", content)
    fill_tables(options.to / "held-lines.md", filled)
    return 0


if __name__ == "__main__":
    sys.exit(main())
