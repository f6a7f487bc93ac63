# SPDX-License-Identifier: Apache-2.0
"""palpate plan: chooses the simplest certified structure for a model on a device."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from .._core.stability import Certificate
from ..errors import InputError
from ..model import Model, load_model
from ..model.model_file import certificate_record
from ..planning import (
    DeviceProfile,
    Plan,
    Ripple,
    example_profiles,
    friction_of,
    mechanical_units,
    profile_file,
    ripple_left,
)
from ..planning import compensate as compensation_plan
from ..planning.candidates import CANDIDATES
from ..planning.plan import PLAN_WORDS
from ..planning.search import plan as choose
from ..recording import read_recording
from ..verdict import Verdict
from .exit_status import end_with, finishing
from .figures import drawing, figure_file, source_name
from .printing import (
    Verb,
    number,
    print_details,
    print_json,
    print_line,
    print_numbers,
    print_paragraph,
    print_verdict,
    talk,
)
from .profiles import ProfileName, device_for
from .verb import (
    PATH,
    accept_model_option,
    json_option,
    plot_option,
    require_model_name,
    require_writable,
    sized,
    verb,
    verbose_option,
)


class Samples(click.ParamType[int | str]):
    """Value of --predict: a number of samples, auto or off. The range is checked later, by `plan`."""

    name = "M|auto|off"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | str:
        if value in ("auto", "off"):
            return str(value)
        try:
            return int(value)
        except ValueError:
            self.fail(f"'{value}' is not a number of samples: give 0 to 16, auto or off", param, ctx)


class _PlanVerb(Verb):
    """Command `palpate plan`; with --examples it needs neither a model nor a device."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if "--examples" in args and not ctx.resilient_parsing:
            _list_examples(as_json="--json" in args, verbose="--verbose" in args)
            ctx.exit()
        return super().parse_args(ctx, args)


_HELP = """Choose the structure that renders a model on a device, and certify it.

The first of these structures that is certified is chosen:

\b
{}

Each refusal names the inequality that fails and the missing amount. The file keeps the identified network; a
limited network is stored with the plan. Exit code 1: no structure is certified, or the force error is larger
than accepted. Then nothing is written.
""".format("\n".join(f"  {name}: {candidate.use}" for name, candidate in CANDIDATES.items()))


def _list_examples(*, as_json: bool, verbose: bool) -> None:
    """Prints every example profile with its file and its first paragraph; `verbose` adds its sources."""
    examples = example_profiles()
    if as_json:
        print_json(
            {
                name: {"file": str(file), "sources": list(sources)}
                for name, (file, sources) in examples.items()
            }
        )
        return
    for name, (file, sources) in examples.items():
        print_line(f"{name}  {file}")
        for paragraph in sources if verbose else sources[:1]:
            print_paragraph(paragraph, indent="  ")
    if not verbose:
        print_line("--verbose states where the numbers of each profile come from.")


@verb("palpate plan press.json --device knob.toml -o press.json", cls=_PlanVerb, help=_HELP)
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@click.option(
    "--device",
    type=ProfileName(),
    metavar="PROFILE.toml",
    required=True,
    help="Profile of the device, or the name of an example.",
)
@click.option("-o", "--output", type=PATH, metavar="OUT.json", default=None, help="Write model and plan.")
@click.option(
    "--on-device",
    type=float,
    metavar="RATE",
    default=None,
    show_default="the host renders",
    help="The motor controller of the device runs the model itself, at this rate [Hz].",
)
@click.option("--coupling", is_flag=True, help="Render through a virtual coupling.")
@click.option(
    "--coupling-stiffness",
    type=float,
    default=None,
    help="K_c [N/m or N*m/rad]; default: chosen from the device.",
)
@click.option(
    "--coupling-damping",
    type=float,
    default=None,
    help="B_c [N*s/m or N*m*s/rad]; default: chosen from the device.",
)
@click.option(
    "--mass",
    type=float,
    default=None,
    help="Mass of the object [kg or kg*m^2]; default: that of the model; 0: none.",
)
@click.option(
    "--object-damping",
    type=float,
    default=None,
    help="Damping of the object; default: that of the model; 0: none.",
)
@click.option(
    "--play-radius", type=float, default=None, help="Play radius r of a model with hysteresis [m or rad]."
)
@click.option(
    "--predict",
    type=Samples(),
    default=None,
    show_default="auto",
    help="Samples used to predict the position half a sample ahead: M (0 to 16), auto or off. Direct only.",
)
@click.option(
    "--accept-force-error",
    type=float,
    metavar="SHARE",
    default=None,
    show_default="0.1",
    help="Largest accepted force error, as a share of the range of the force.",
)
@click.option(
    "--no-energy-account",
    "energy_account",
    is_flag=True,
    flag_value=False,
    default=True,
    show_default=False,
    help="Choose proved slopes only, not steeper ones that the energy account holds.",
)
@click.option(
    "--compensate",
    is_flag=True,
    help="Cancel the cogging of a motor: plan its negative, with the largest scale that is proved.",
)
@click.option(
    "--fresh",
    type=PATH,
    metavar="RECORDING",
    default=None,
    show_default=False,
    help="Fresh recording of the motor, whose remaining ripple --compensate prints.",
)
@accept_model_option
@plot_option("the root locus of the explicit structure over its damping")
@click.option(
    "--examples",
    is_flag=True,
    expose_value=False,
    help="List the example profiles with their sources, then exit.",
)
@json_option
@verbose_option
def plan(
    model_file: Path,
    device: str,
    output: Path | None,
    compensate: bool,
    fresh: Path | None,
    accept_model: bool,
    plot: Path | None,
    as_json: bool,
    verbose: bool,
    **given: Any,
) -> None:
    """Choose the structure that renders a model on a device, and certify it."""
    if output is not None:
        require_model_name(output)
    profile_path = profile_file(device)
    require_writable(plot, inputs=(model_file, profile_path))
    require_writable(output, plot, inputs=(profile_path,))  # the output may be the model file
    if fresh is not None and not compensate:
        raise InputError("--fresh is given without --compensate, which uses it: leave it out")
    model = load_model(model_file, with_plan=False).require_use(model_file, accepted=accept_model)
    profile = device_for(model, device)
    talk(f"read {model_file}: {sized(model)}; for {profile.id}, {profile_path}")
    began = time.perf_counter()
    if compensate:
        chosen = _compensated(model, profile, given)
    else:
        chosen = choose(model, profile, **{name: value for name, value in given.items() if value is not None})
    ripple = None
    if fresh is not None and chosen.scale is not None and chosen.verdict.level != "no":
        ripple = ripple_left(model, chosen.scale, read_recording(fresh))
    seconds = time.perf_counter() - began
    verdict, certificate = model.verdict + chosen.verdict, chosen.certificate
    assert certificate is not None
    holds = verdict.level != "no"
    with drawing() as write_figures:
        if plot is not None:
            _picture(plot, chosen, profile)
    with finishing():
        if output is not None and holds:
            chosen.stored().save(output)
        write_figures()
        written = output if holds else None
        if as_json:
            result = _result(chosen, verdict, certificate, written, seconds)
            if compensate:
                result["compensation"] = _compensation(model, chosen, ripple)
            print_json(result)
        else:
            print_verdict(verdict)
            rows = _summary(chosen, certificate, profile, written)
            if compensate:
                rows = _compensation_rows(model, ripple, fresh) | rows
            print_numbers(rows)
            if verbose:
                print_details([f"planned in {seconds:.1f} s", *_details(chosen, certificate)])
    end_with(verdict)


def _compensated(model: Model, profile: DeviceProfile, given: dict[str, Any]) -> Plan:
    """Returns the plan of the compensation, which has no other options than the controller's rate."""
    context = click.get_current_context()
    for param in context.command.params:
        name = str(param.name)
        is_given = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if is_given and name in given and name != "on_device":
            raise InputError(f"{param.opts[0]} is given, but --compensate does not use it: leave it out")
    return compensation_plan(model, profile, on_device=given["on_device"])


def _compensation_rows(model: Model, ripple: Ripple | None, fresh: Path | None) -> dict[str, str]:
    """Returns remaining ripple and friction for display."""
    unit, rows = model.units["force"], {}
    friction = friction_of(model)
    if ripple is not None and fresh is not None:
        rows[f"ripple of {fresh.name}"] = (
            f"{ripple.recorded:.3g} {unit} RMS, {ripple.left:.3g} {unit} with the compensation "
            f"({100.0 * ripple.left / ripple.recorded:.2g} %, noise included)"
        )
        friction = ripple.friction
    rows["friction"] = f"{friction:.3g} {unit}, not compensated: that would give energy"
    return rows


def _compensation(model: Model, plan: Plan, ripple: Ripple | None) -> dict[str, Any]:
    """Returns scale, remaining ripple and friction for --json."""
    found = None if ripple is None else {"recorded_rms": ripple.recorded, "left_rms": ripple.left}
    friction = friction_of(model) if ripple is None else ripple.friction
    scale = None if plan.verdict.level == "no" else plan.scale
    return {"scale": scale, "friction": friction, "ripple": found}


_LINE = ("id", "name", "formula", "left", "right", "margin", "strict", "holds", "basis", "source")


def _result(
    plan: Plan, verdict: Verdict, certificate: Certificate, written: Path | None, seconds: float
) -> dict[str, Any]:
    error = plan.force_error
    slope, steepest = plan.slopes_behind_coupling
    return {
        "structure": plan.structure,
        "verdict": str(verdict),
        "word": PLAN_WORDS[certificate.verdict],
        "energy_account": None if plan.account is None else _account(plan),
        "force_error_share": error.share,
        "force_error_rms_share": error.rms_share,
        "force_error": {"largest": error.largest, "rms": error.rms},
        "needs": plan.needs,
        "written": None if written is None else str(written),
        "plan": plan.record(),
        "certificate": certificate_record(certificate),
        "inequalities": [{name: getattr(line, name) for name in _LINE} for line in certificate.inequalities],
        "reason": certificate.reason,
        "steepest_slope": steepest,
        "slope_behind_coupling": slope,
        "seconds": seconds,
    }


def _account(plan: Plan) -> dict[str, Any]:
    """Returns the numbers of the energy account that holds a plan."""
    use = plan.account
    assert use is not None
    return {**use.to_dict(), "proved_ratio": plan.proved_ratio}


def _summary(
    plan: Plan, certificate: Certificate, device: DeviceProfile, written: Path | None
) -> dict[str, str]:
    """Returns the summary of a plan: structure, needed device properties and certificate, one line each.

    After the verdict no it has only what fails.
    """
    rows, refused = plan.summary(), plan.verdict.level == "no"
    if refused and not certificate.refused:
        passed = {"certificate", *plan.account_rows()}
        rows = {name: text for name, text in rows.items() if name not in passed}
    _, damping, force = mechanical_units(device.position_unit)
    units = {"b": ("device damping", damping), "f_c": ("device friction", force)}
    lines = [] if certificate.refused else certificate.inequalities
    lines = [line for line in lines if not (refused and line.holds)]
    # Of several inequalities on one device property, the last one, with the least margin, is printed.
    for line in sorted(lines, key=lambda each: -each.margin):
        name, unit = units.get(line.formula.split(" ")[0], ("", ""))
        if name:
            sign, judged = (">=", "OK") if line.holds else ("<", "not enough")
            rows[name] = f"{number(line.left)} {sign} needed {number(line.right)} {unit}: {judged}"
    if written is not None:
        rows["written"] = str(written)
    elif refused:
        rows["written"] = "nothing, because the verdict is no"
    else:
        rows["written"] = "nothing; -o OUT.json writes model and plan"
    return rows


def _details(plan: Plan, certificate: Certificate) -> list[str]:
    """Returns the settings of the structure, the refused structures and every inequality, in sentences."""
    details = [f"{name}: {value}" for name, value in plan.settings().items()]
    details += [f"refused: {sentence}" for sentence in plan.refused]
    for line in certificate.inequalities:
        word = "holds" if line.holds else "fails"
        details.append(
            f"{line.name}: {word}, {line.basis}; {line.formula}; {number(line.left)} against "
            f"{number(line.right)}, margin {number(line.margin)}"
        )
    return [*details, certificate.reason]


def _picture(path: Path, plan: Plan, profile: DeviceProfile) -> None:
    """Draws the root locus of the explicit structure."""
    from ..plotting import draw_root_locus

    title = f"model of {source_name(plan.model.data.files)}, explicit, on {profile.id}"
    with figure_file(path, height_inches=3.8, title=title) as (axes,):
        draw_root_locus(axes, plan, profile)
