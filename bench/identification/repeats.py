# SPDX-License-Identifier: Apache-2.0
"""Identifies silicone cylinders from several recordings and judges the models on recordings not used.

python bench/identification/repeats.py [--json FILE]

Each of six silicones has two samples of five recordings. A draw leaves out one or two recordings of a sample,
so that a silicone has 30 draws. PALPATE_DATA names the folder of recordings.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from statistics import mean, median
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import count, markdown_table, measured_data, write_results

import palpate
from palpate import Recording, identify
from palpate.baselines.methods import SmoothingSpline
from palpate.cli.figures import figure_file
from palpate.identification.data.repeats import pure_error
from palpate.plotting.look import grid

Array = NDArray[np.float64]

FOLDER = "silicone_compression"

SAMPLES = "AB"

LEFT_OUT = (1, 2)
"""Numbers of recordings of a sample that a draw leaves out"""

HEIGHT_M, DIAMETER_M = 0.03, 0.05
"""Size of the cylinders, from the head of the files"""

STRESS_KPA_TO_N = 1e3 * np.pi / 4.0 * DIAMETER_M**2
"""Force of an engineering stress of 1 kPa on a cylinder"""

YEOH = "Yeoh, order 3"

SEVERAL = "palpate, recordings of one object"


@dataclass(frozen=True)
class Fitted:
    """Fitted force law of a method."""

    force: Callable[[Array], Array]
    n_parameters: int
    half_width: Callable[[Array], Array] | None = None
    """Half width of the band of a further recording; None if the method has none"""


def of_one_object(recordings: Sequence[Recording]) -> Fitted:
    model = identify(recordings)
    assert model.band is not None
    return Fitted(lambda x: np.asarray(model.force(x)), model.n_parameters, model.band.half_width)


def of_first_recording(recordings: Sequence[Recording]) -> Fitted:
    model = identify(recordings[0])
    return Fitted(lambda x: np.asarray(model.force(x)), model.n_parameters)


def spline(recordings: Sequence[Recording]) -> Fitted:
    position, force = _rows(recordings)
    fitted = SmoothingSpline().fit(position[:, None], force)
    return Fitted(lambda x: fitted.predict(x[:, None]), fitted.n_parameters_)


def yeoh(recordings: Sequence[Recording]) -> Fitted:
    """Fits the hyperelastic law of Yeoh (1993) of order 3 to the stress of incompressible cylinders."""
    position, force = _rows(recordings)
    numbers, *_ = np.linalg.lstsq(_yeoh_columns(position), force, rcond=None)
    return Fitted(lambda x: np.asarray(_yeoh_columns(x) @ numbers), len(numbers))


def _yeoh_columns(position: Array) -> Array:
    stretch = 1.0 - position / HEIGHT_M
    invariant = stretch**2 + 2.0 / stretch - 3.0
    rows = [2.0 * i * invariant ** (i - 1) * (stretch**-2 - stretch) for i in (1, 2, 3)]
    return np.asarray(STRESS_KPA_TO_N * np.array(rows).T)


def _rows(recordings: Sequence[Recording]) -> tuple[Array, Array]:
    return (
        np.concatenate([each.position for each in recordings]),
        np.concatenate([each.force for each in recordings]),
    )


METHODS: Mapping[str, Callable[[Sequence[Recording]], Fitted]] = {
    SEVERAL: of_one_object,
    "palpate, one recording": of_first_recording,
    "smoothing spline": spline,
    YEOH: yeoh,
}


def error(fitted: Fitted, recordings: Sequence[Recording]) -> float:
    """Returns the RMS force error on recordings, each of which counts once [N]."""
    squares = [np.mean((fitted.force(each.position) - each.force) ** 2) for each in recordings]
    return float(np.sqrt(np.mean(squares)))


def coverage(fitted: Fitted, recordings: Sequence[Recording]) -> float | None:
    """Returns the share of the rows of recordings in the band; None without band."""
    if fitted.half_width is None:
        return None
    return float(
        np.mean(
            [
                np.mean(np.abs(fitted.force(each.position) - each.force) <= fitted.half_width(each.position))
                for each in recordings
            ]
        )
    )


def draws() -> list[tuple[str, tuple[int, ...]]]:
    """Returns the sample and the recordings that each draw leaves out."""
    return [(sample, left) for n in LEFT_OUT for sample in SAMPLES for left in combinations(range(5), n)]


def judged(samples: Mapping[str, Sequence[Recording]], method: str) -> dict[str, Any]:
    """Fits a method in each draw; returns parameters, errors and coverage of all draws."""
    found: dict[str, list[Any]] = {
        "n_parameters": [],
        "repeat": [],
        "sample": [],
        "coverage": [],
        "seconds": [],
    }
    every = draws()
    for sample, left in every[: count(len(every))]:
        seen = [each for k, each in enumerate(samples[sample]) if k not in left]
        start = time.perf_counter()
        fitted = METHODS[method](seen)
        found["seconds"].append(time.perf_counter() - start)
        unseen = [samples[sample][k] for k in left]
        found["n_parameters"].append(fitted.n_parameters)
        found["repeat"].append(error(fitted, unseen))
        found["coverage"].append(coverage(fitted, unseen))
        found["sample"].append(error(fitted, [each for s in SAMPLES if s != sample for each in samples[s]]))
    return found


def repeatability(recordings: Sequence[Recording]) -> float:
    """Returns the RMS difference of recordings from their mean [N]."""
    model = identify(recordings)
    position, force = _rows(recordings)
    number = np.repeat(np.arange(len(recordings)), [len(each) for each in recordings])
    found = pure_error(position, None, force - np.asarray(model.force(position)), number)
    assert found is not None
    return found


def residual_curves(samples: Mapping[str, Sequence[Recording]]) -> dict[str, Any]:
    """Returns the curves of the figure: band of the first sample, and the residual of every recording."""
    model = identify(samples[SAMPLES[0]])
    x = np.linspace(float(model.lower[0]), float(model.upper[0]), 81)
    half = model.band_half_width(x)
    assert half is not None
    curves = {
        sample: [
            (np.interp(x, each.position, each.force) - np.asarray(model.force(x))).tolist()
            for each in samples[sample]
        ]
        for sample in SAMPLES
    }
    return {"position": x.tolist(), "half_width": half.tolist(), **curves}


def study(folder: Path, silicone: str, published: Mapping[str, Any]) -> dict[str, Any]:
    """Returns all results of one silicone."""
    samples = {
        sample: [palpate.read_recording(folder / f"{silicone}_{sample}{k}.csv") for k in range(1, 6)]
        for sample in SAMPLES
    }
    every = [each for sample in SAMPLES for each in samples[sample]]
    within = [repeatability(samples[sample]) / STRESS_KPA_TO_N for sample in SAMPLES]
    return {
        "silicone": silicone,
        "methods": {method: judged(samples, method) for method in METHODS},
        "within_kPa": float(np.sqrt(np.mean(np.square(within)))),
        "both_kPa": repeatability(every) / STRESS_KPA_TO_N,
        "published_kPa": {name: fit["S"] for name, fit in published.items()},
        "curves": residual_curves(samples),
    }


def table(results: Sequence[Mapping[str, Any]]) -> str:
    """Returns the table of all silicones and methods: median and range over the draws, mean coverage."""
    rows = []
    for each in results:
        for method, found in each["methods"].items():
            inside = [value for value in found["coverage"] if value is not None]
            rows.append(
                (
                    f"{each['silicone']}, {method}",
                    _range(found["n_parameters"], "d"),
                    _range(found["repeat"], ".2f"),
                    _range(found["sample"], ".2f"),
                    f"{100 * mean(inside):.1f} %" if inside else "",
                    f"{median(found['seconds']):.2g}",
                )
            )
    shares = [v for each in results for v in each["methods"][SEVERAL]["coverage"] if v is not None]
    total = f"\nRows of unseen repeats in the band, all silicones: {100 * mean(shares):.1f} %.\n"
    header = (
        "silicone, method",
        "parameters",
        "error on an unseen repeat [N]",
        "error on the unseen sample [N]",
        "rows of unseen repeats in the band",
        "fit [s]",
    )
    return markdown_table(header, rows) + total


def _range(values: Sequence[float], form: str) -> str:
    middle = median(values)
    shown = f"{round(middle):d}" if form == "d" else f"{middle:{form}}"
    return f"{shown} ({min(values):{form}} to {max(values):{form}})"


def published_table(results: Sequence[Mapping[str, Any]]) -> str:
    """Returns the table of the published fits: repeatability, and the laws whose standard error is below."""
    rows = []
    for each in results:
        fits = sorted(each["published_kPa"].items(), key=lambda item: item[1])
        good = [name for name, value in fits if value <= each["both_kPa"]]
        best = ", ".join(f"{_words(name)} {value:.2f}" for name, value in fits[:3])
        rows.append(
            (
                each["silicone"],
                f"{each['within_kPa']:.2f}",
                f"{each['both_kPa']:.2f}",
                best,
                f"{len(good)} of {len(fits)}",
                ", ".join(map(_words, good)),
            )
        )
    header = (
        "silicone",
        "repeats of one sample [kPa]",
        "repeats of both samples [kPa]",
        "best published fits, standard error [kPa]",
        "at or below the repeats of both samples",
        "which",
    )
    return markdown_table(header, rows, text_columns=(0, 3, 5))


def _words(name: str) -> str:
    return name.replace("_o", " ")


def draw(path: Path, results: Sequence[Mapping[str, Any]]) -> None:
    """Draws, for the first sample of each silicone, the band and the residuals of both samples."""
    with figure_file(path, height_inches=5.6, rows=[1.0] * 3, columns=2) as panels:
        for axes, each in zip(panels, results, strict=False):
            curves = each["curves"]
            x, half = 1e3 * np.array(curves["position"]), np.array(curves["half_width"])
            axes.fill_between(x, -half, half, color="0.85", linewidth=0.0, label="band of sample A")
            looks = {"A": ("black", "solid", 0.8), "B": ("0.45", (0, (4, 2)), 0.7)}
            for sample, (color, dash, width) in looks.items():
                for k, values in enumerate(curves[sample]):
                    label = f"recordings of sample {sample}" if k == 0 else "_"
                    axes.plot(x, values, color=color, linestyle=dash, linewidth=width, label=label)
            limit = 2.5 * half.max()
            axes.set_ylim(-limit, limit)
            axes.set_title(each["silicone"], fontsize=7.0)
            grid(axes)
        for axes in panels[len(results) :]:
            axes.set_visible(False)
        for axes in panels[max(0, len(results) - 2) : len(results)]:
            axes.set_xlabel("compression [mm]")
        figure = panels[0].figure
        figure.supylabel("force minus model [N]", fontsize=8.0)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, frameon=False, loc="outside lower center", ncols=2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    data = measured_data()
    if data is None:
        return
    folder = data / FOLDER
    published = json.loads((folder / "published_fits.json").read_text(encoding="utf-8"))
    results = []
    for silicone in list(published)[: count(len(published))]:
        results.append(study(folder, silicone, published[silicone]))
        print(table(results[-1:]), flush=True)
    print(table(results))
    print(published_table(results))
    write_results(options.json, results)


if __name__ == "__main__":
    main()
