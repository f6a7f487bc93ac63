# SPDX-License-Identifier: Apache-2.0
"""palpate plan: chooses the simplest certified structure for a model on a device."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from .._core.stability import Certificate
from ..model import load_model
from ..model.model_file import certificate_record
from ..planning import DeviceProfile, Plan, example_profiles, profile_file
from ..planning.candidates import CANDIDATES
from ..planning.search import plan as choose
from .exit_status import end_with, finishing
from .figures import figure_file, source_name
from .printing import (
    Verb,
    number,
    print_json,
    print_line,
    print_numbers,
    print_paragraph,
    print_verdict,
    talk,
)
from .verb import PATH, json_option, plot_option, require_writable, verb


class Samples(click.ParamType[int | str]):
    """A number of samples, auto or off. The called function checks the range."""

    name = "M|auto|off"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | str:
        if value in ("auto", "off"):
            return str(value)
        try:
            return int(value)
        except ValueError:
            self.fail(f"'{value}' is no number of samples: give 0 to 16, auto or off", param, ctx)


class _PlanVerb(Verb):
    """Verb or list of example profiles, which needs neither model nor device."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if "--examples" in args:
            _list_examples(as_json="--json" in args)
            ctx.exit()
        return super().parse_args(ctx, args)


_HELP = """Choose the structure that renders a model on a device, and certify it.

The first of these structures that is certified is taken:

\b
{}

Every refusal names the inequality that failed and by how much. The identified network stays in the file; a
limited network stands under plan. Exit code 1: no structure holds, or the force error is larger than
accepted. Nothing is written then.
""".format("\n".join(f"  {name}: {candidate.use}" for name, candidate in CANDIDATES.items()))


def _list_examples(*, as_json: bool) -> None:
    """Prints every example profile with its file and its sources."""
    examples = example_profiles()
    if as_json:
        print_json(
            {name: {"file": str(file), "sources": list(told)} for name, (file, told) in examples.items()}
        )
        return
    for name, (file, sources) in examples.items():
        print_line(f"{name}  {file}")
        for paragraph in sources:
            print_paragraph(paragraph, indent="  ")


@verb("palpate plan press.json --device knob.toml -o press.json", cls=_PlanVerb, help=_HELP)
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@click.option(
    "--device",
    metavar="PROFILE.toml",
    required=True,
    help="Profile of the device, or the name of an example.",
)
@click.option("-o", "--output", type=PATH, metavar="OUT.json", default=None, help="Write model and plan.")
@click.option("--coupling", is_flag=True, help="Render through a virtual coupling.")
@click.option("--coupling-stiffness", type=float, default=None, help="K_c; chosen from the device.")
@click.option("--coupling-damping", type=float, default=None, help="B_c; chosen from the device.")
@click.option("--mass", type=float, default=None, help="Object mass; the model's own. 0 leaves it out.")
@click.option("--object-damping", type=float, default=None, help="Object damping; the model's own. 0 leaves it out.")
@click.option("--play-radius", type=float, default=None, help="r of a model with hysteresis.")
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
    help="Largest difference of felt and identified force to accept, over the range of the force.",
)
@plot_option("the root locus of the explicit structure over its damping")
@click.option(
    "--examples",
    is_flag=True,
    expose_value=False,
    help="List the example profiles with their sources, and end.",
)
@json_option
def plan(
    model_file: Path, device: str, output: Path | None, plot: Path | None, as_json: bool, **wishes: Any
) -> None:
    """Choose the structure that renders a model on a device, and certify it."""
    profile_path = profile_file(device)
    require_writable(plot, inputs=(model_file, profile_path))
    require_writable(output, plot, inputs=(profile_path,))  # the model file may be replaced
    profile = DeviceProfile.load(profile_path)
    model = load_model(model_file, with_plan=False)
    talk(f"read {model_file}: {model!r}; for {profile.id}, {profile_path}")
    began = time.perf_counter()
    chosen = choose(model, profile, **{name: wish for name, wish in wishes.items() if wish is not None})
    seconds = time.perf_counter() - began
    verdict, certificate = chosen.verdict, chosen.certificate
    assert certificate is not None
    holds = verdict.level != "no"
    with finishing():
        if output is not None and holds:
            chosen.stored().save(output)
        if plot is not None:
            _picture(plot, chosen, profile)
        written = output if holds else None
        if as_json:
            print_json(_result(chosen, certificate, written, seconds))
        else:
            _print(chosen, certificate, written, seconds)
    end_with(verdict)


_LINE = ("id", "name", "formula", "left", "right", "margin", "strict", "holds", "basis", "source")


def _result(plan: Plan, certificate: Certificate, written: Path | None, seconds: float) -> dict[str, Any]:
    error = plan.force_error
    felt, steepest = plan.slope_behind_couplings
    return {
        "structure": plan.structure,
        "verdict": str(plan.verdict),
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
        "slope_behind_coupling": felt,
        "seconds": seconds,
    }


def _print(plan: Plan, certificate: Certificate, written: Path | None, seconds: float) -> None:
    """Prints the verdict, the plan, the refused structures, and every inequality."""
    print_verdict(plan.verdict)
    file = "nothing; -o OUT.json writes model and plan" if written is None else str(written)
    if plan.verdict.level == "no":
        file = "nothing, because the verdict is no"
    print_numbers({**plan.rows(), "planned in": f"{seconds:.1f} s", "written": file})
    if plan.refused:
        click.echo("\nrefused")
        for sentence in plan.refused:
            print_paragraph(sentence, indent="  ")
    click.echo("\ninequalities")
    for line in certificate.inequalities:
        word = "holds" if line.holds else "fails"
        print_paragraph(f"{line.name}: {word}, {line.basis}", indent="  ")
        print_paragraph(line.formula, indent="    ")
        sides = f"{number(line.left)} against {number(line.right)}, margin {number(line.margin)}"
        print_paragraph(sides, indent="    ")
    print_paragraph(certificate.reason)


def _picture(path: Path, plan: Plan, profile: DeviceProfile) -> None:
    """Draws the root locus of the explicit structure."""
    from ..plotting import draw_root_locus

    title = f"model of {source_name(plan.model.data.files)}, explicit, on {profile.id}"
    with figure_file(path, height_inches=3.8, title=title) as (axes,):
        draw_root_locus(axes, plan, profile)
