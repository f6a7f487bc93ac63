# SPDX-License-Identifier: Apache-2.0
"""palpate chart prediction: gain and price of the half-sample prediction."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .arguments import PATH
from .figures import figure_file
from .output import number, talk
from .pages import markdown_table, with_tables, write_text
from .verb import Verb

if TYPE_CHECKING:
    from ..analysis import PredictionGain

_PAGE = "certificate.md"
_DRAWN = (("mean of a tick", "mean"), ("below 50 Hz", "band"))


@click.command(cls=Verb, no_args_is_help=True, epilog="Example: palpate chart prediction --to docs")
@click.option(
    "--to", metavar="FOLDER", type=PATH, required=True, help="Where figures/ goes, and the page is found."
)
def chart_prediction(to: Path) -> None:
    """Measure the force error of predictions from 0 to 16 samples, and draw it over the damping they need.

    Devices, objects and hands are simulated. Writes prediction.png and prediction.json to FOLDER/figures;
    where FOLDER holds certificate.md, its tables follow. Takes about a minute.
    """
    from ..analysis import measure_prediction
    from ..plotting import draw_prediction

    page = to / _PAGE
    text = page.read_text(encoding="utf-8") if page.exists() else None
    figures = to / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    gains = measure_prediction()
    with figure_file(figures / "prediction.png", height_inches=3.2) as (axes,):
        draw_prediction(
            axes,
            [gain.samples for gain in gains],
            [gain.damping[1] for gain in gains],
            [(name, [gain.spread(error) for gain in gains]) for name, error in _DRAWN],
        )
    written = {"predictions": [gain.as_json() for gain in gains]}
    write_text(figures / "prediction.json", json.dumps(written, indent=1) + "\n")
    talk(f"wrote prediction.png and prediction.json to {figures}")
    if text is not None:
        write_text(
            page, with_tables(text, page, {"prediction": _price(gains), "prediction-gain": _gain(gains)})
        )
        talk(f"wrote the tables of {page}")


def _price(gains: tuple[PredictionGain, ...]) -> str:
    header = ("samples m", "b / (T M), s_ = 0", "b / (T M), s_ = M", "f_c over that without")
    rows = [
        (_name(gain), number(gain.damping[0]), number(gain.damping[1]), number(gain.friction))
        for gain in gains
    ]
    return markdown_table(header, rows)


def _gain(gains: tuple[PredictionGain, ...]) -> str:
    header = (
        "samples m",
        "knob: mean of a tick [N·m]",
        "below 50 Hz [N·m]",
        "work [J]",
        "all: mean of a tick, times smaller",
        "below 50 Hz, times smaller",
    )
    rows = [
        (
            _name(gain),
            *(number(gain.knob[error]) for error in ("mean", "band", "work")),
            *(_spread(gain, error) for error in ("mean", "band")),
        )
        for gain in gains
    ]
    return markdown_table(header, rows)


def _name(gain: PredictionGain) -> str:
    return str(gain.samples) if gain.samples else "none"


def _spread(gain: PredictionGain, error: str) -> str:
    if not gain.samples:
        return "1"
    middle, low, high = gain.spread(error)
    return f"{middle:.1f} ({low:.1f} to {high:.1f})"
