# SPDX-License-Identifier: Apache-2.0
"""palpate show: a model for a person, by itself or beside another."""

from __future__ import annotations

from pathlib import Path

import click

from .arguments import PATH
from .figures import figure_file, require_figure_name
from .output import number, print_table
from .pictures import picture_path
from .verb import Verb


@click.command(cls=Verb, no_args_is_help=True, epilog="Example: palpate show press.json")
@click.argument("model_file", metavar="MODEL.json", type=PATH)
@click.option(
    "--beside",
    metavar="OTHER.json",
    type=PATH,
    help="Another model: print how far it is from the first, in shares of the just noticeable difference.",
)
@click.option(
    "--plot",
    metavar="PNG",
    type=PATH,
    help="Draw every network that was considered; with --beside both models and their difference.",
)
def show(model_file: Path, beside: Path | None, plot: Path | None) -> None:
    """Print a model: its terms, its domain, its units, and how it was identified."""
    from ..model import load_model

    if plot is not None:
        require_figure_name(plot)
    model = load_model(model_file)
    if beside is None:
        click.echo(str(model))
        if plot is not None:
            picture_path(plot, model)
        return
    from ..verification import compare

    strokes = compare(model, load_model(beside))
    print_table(
        ("stroke", "largest difference, in just noticeable ones"),
        [(stroke.name or "both", number(stroke.worst)) for stroke in strokes],
    )
    if plot is not None:
        from ..plotting import draw_two_models

        with figure_file(plot, height_inches=3.6, rows=(2.2, 1.0)) as (above, beneath):
            draw_two_models(above, beneath, strokes, model.units, names=(model_file.stem, beside.stem))
