# SPDX-License-Identifier: Apache-2.0
"""palpate simulate: renders a model on a simulated device."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from .._core.rendering import default_play_radius
from .._core.simulation import TestRig
from .._core.stability import device_difference
from ..model import Model, load_model
from ..planning import DeviceProfile, Plan, force_error, force_range, hand_for, judge, rig_for
from ..planning import simulate as render
from ..planning.device_profile import require_unit
from ..planning.simulation import covered_text, holding_hand
from ..verdict import Verdict, usable
from .exit_status import end_with, finishing
from .figures import drawing, picture_rendering
from .printing import (
    number,
    print_json,
    print_numbers,
    print_verdict,
    progress,
    talk,
)
from .profiles import ProfileName, device_for
from .verb import (
    PATH,
    accept_model_option,
    json_option,
    plot_option,
    require_writable,
    scheme_options,
    sized,
    verb,
)


@verb("palpate simulate press.json --structure direct --duration-s 4 -o rendered.csv")
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@scheme_options
@click.option(
    "--device",
    type=ProfileName(),
    default=None,
    show_default="that of the plan, else a knob",
    help="Profile of a device, or the name of an example; it needs no certificate.",
)
@click.option("--duration-s", type=float, default=4.0, help="Simulated time [s].")
@click.option(
    "--hold-at",
    type=float,
    default=None,
    help="Position at which the hand holds the handle, in SI units.  [default: (it sweeps)]",
)
@click.option(
    "-o", "--output", type=PATH, metavar="OUT.csv", default=None, help="Recording of the rendering to write."
)
@click.option("--force", is_flag=True, help="Replace an existing recording.")
@accept_model_option
@plot_option("rendered and modelled force, with their difference")
@json_option
def simulate(
    model_file: Path,
    device: str | None,
    duration_s: float,
    hold_at: float | None,
    output: Path | None,
    force: bool,
    accept_model: bool,
    plot: Path | None,
    as_json: bool,
    **scheme: Any,
) -> None:
    """Render a model in closed loop with a simulated device and a simulated hand.

    The hand sweeps through the model's domain twice in four seconds, as far as the device holds the force. An
    angle is rendered on a knob with a 16-bit encoder at 1 kHz; for other units the knob is scaled to the
    model's travel and force. A model with a plan is rendered as planned, on the device that it was certified
    for, unless a structure is given. --device renders it on any other device, without a certificate: the
    structure of the plan, or directly.
    A simulation shows one case; it does not prove stability.
    """
    require_writable(plot, recording=output, force=force, inputs=(model_file,))
    model = load_model(model_file).require_use(model_file, accepted=accept_model)
    rig = rig_for(model)
    other = None if device is None else device_for(model, device)
    plan = _chosen_plan(model, rig, scheme, other)
    simulated = other or (rig.device if plan.certificate is None else plan.certificate.device)
    talk(f"read {model_file}: {sized(model)}; rendering on the simulated device {simulated.id}")
    hand = hand_for(plan, simulated) if hold_at is None else holding_hand(plan, hold_at)
    ticks = max(duration_s / simulated.period_s, 1.0)
    with progress("simulating") as shown:
        rendered = render(
            plan,
            simulated,
            hand,
            duration_s,
            lambda tick: shown(f"{100 * tick / ticks:.1f} %"),
        )
    error = force_error(plan, rendered)
    verdict = model.verdict + judge(plan, rendered, error, simulated)
    if other is not None and plan.certificate is None:
        verdict += Verdict((usable(f"nothing is proved on {other.id}: this is one simulated motion"),))
    status_counts = Counter(rendered.columns["status"])
    span = force_range(plan)
    share = error.end / span if span > 0 else None
    extrapolated = float(rendered.columns["extrapolated"].mean())
    result = {
        "verdict": str(verdict),
        "structure": plan.structure,
        "duration_s": duration_s,
        "ticks": len(rendered),
        "force_error_end": error.end,
        "force_error_instant": error.instant,
        "force_error_mean": error.mean,
        "force_error_band": error.band,
        "force_error_work": error.work,
        "force_error_share": share,
        "extrapolated": extrapolated,
        "status": dict(status_counts),
    }
    written = None if status_counts["NonFinite"] else output
    with drawing() as write_figures:
        if plot is not None:
            picture_rendering(plot, plan, rendered)
    with finishing():
        if written is not None:
            rendered.write(written, replace=force)
        write_figures()
        if as_json:
            print_json(result)
        else:
            print_verdict(verdict)
            unit = rendered.units["force"]
            print_numbers(
                {
                    "structure": plan.description,
                    "duration": f"{number(duration_s)} s",
                    "handle": covered_text(plan, simulated, rendered),
                    "force error, end of tick": f"{number(error.end)} {unit} RMS"
                    + ("" if share is None else f", {100 * share:.3g} % of the object's force range"),
                    "force error, mean of a tick": f"{number(error.mean)} {unit} RMS",
                    "force error, below 50 Hz": f"{number(error.band)} {unit} RMS",
                    "force error, sampled": f"{number(error.instant)} {unit} RMS",
                    "work of the force error": f"{number(error.work)}{' J' if unit else ''}"
                    + ("" if error.work >= 0.0 else ", given to the hand"),
                    "extrapolated": f"{100 * extrapolated:.3g} %",
                    "ticks": ", ".join(f"{count} {word}" for word, count in status_counts.most_common()),
                    **({} if written is None else {"written": f"{written}, {len(rendered)} rows"}),
                }
            )
    end_with(verdict)


def _chosen_plan(model: Model, rig: TestRig, scheme: Mapping[str, Any], device: DeviceProfile | None) -> Plan:
    """Returns the requested plan, else the plan in the model file, else the default plan, with a note.

    On another device than that of the plan the plan has no certificate, and a model without a plan is
    rendered directly.
    """
    if device is not None:
        require_unit(device, model)
    if all(value is None or value is False for value in scheme.values()):
        if model.plan is not None:
            plan = Plan.of(model)
            certified = None if plan.certificate is None else plan.certificate.device
            is_other = device is not None and certified is not None and device_difference(certified, device)
            return replace(plan, certificate=None) if is_other else plan
        if device is not None:
            scheme = {"structure": "direct"}
        elif model.of_position:
            talk(
                "the model has no plan: the default coupling makes it softer; "
                "'palpate plan' finds a rendering without this error"
            )
    if device is not None and not scheme.get("play_radius"):
        scheme = {**scheme, "play_radius": default_play_radius(model, device.encoder_step) or None}
    return Plan(model, rig.scheme(model, **scheme))
