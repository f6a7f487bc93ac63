# SPDX-License-Identifier: Apache-2.0
"""palpate show: a model for a person."""

from __future__ import annotations

from pathlib import Path

import click

from .arguments import PATH
from .verb import Verb


@click.command(cls=Verb, no_args_is_help=True, epilog="Example: palpate show press.json")
@click.argument("model_file", metavar="MODEL.json", type=PATH)
def show(model_file: Path) -> None:
    """Print a model: its terms, its domain, its units, and how it was identified."""
    from ..model import load_model

    click.echo(str(load_model(model_file)))
