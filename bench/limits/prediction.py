# SPDX-License-Identifier: Apache-2.0
"""Measures the force error of the half-sample prediction and draws it over the certified damping.

python bench/limits/prediction.py --to docs

Devices, objects and hands are simulated. Writes prediction.png and prediction.json to FOLDER/figures.
Writes the tables of FOLDER/certificate.md if that page exists. Takes about a minute.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import StrMethodFormatter
from numpy.typing import NDArray

from palpate.cli.figures import figure_file
from palpate.cli.printing import number

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import fill_tables, markdown_table, write_json

from palpate import DeviceProfile, Hand, Model, Scheme, identify
from palpate._core.stability import ForceBounds, certify_bounds, force_bounds
from palpate.planning import Plan, force_error, simulate
from palpate.plotting.look import grid
from palpate.recording.sample import sample_recording

PREDICTIONS = (0, 1, 2, 4, 8, 16)
"""Compared numbers of past positions from which the prediction is computed; 0: no prediction"""

ERRORS = ("mean", "band", "end", "work")
STEEPEST = 45.0
"""Largest absolute force slope of the randomly drawn objects [N*m/rad]"""
RANDOM_OBJECTS = 6
HANDS = ((0.5, 15.0), (1.0, 30.0), (2.0, 15.0), (2.0, 60.0), (4.0, 30.0))
"""Frequency [Hz] and stiffness [N*m/rad] of the simulated hands"""
DURATION_S = 2.0


@dataclass(frozen=True)
class PredictionGain:
    """Results for one number of past samples in the prediction, with all simulated objects and hands."""

    samples: int
    damping: tuple[float, float]
    """Required device damping b divided by period T and slope M, for force slopes 0 to M, and -M to M"""
    friction: float
    """Required Coulomb friction with prediction divided by that without prediction"""
    knob: dict[str, float]
    """Knob of the sample recording, hand at 2 Hz for 4 s: force errors [N*m] and their work [J]"""
    ratio: dict[str, NDArray[np.float64]]
    """Kind of error -> force error without prediction divided by that with prediction, (cases,)"""

    def spread(self, error: str) -> tuple[float, float, float]:
        """Returns the median, 10 % and 90 % quantile of the force-error ratio of one kind of error."""
        lower, middle, upper = np.quantile(self.ratio[error], (0.1, 0.5, 0.9))
        return float(middle), float(lower), float(upper)

    @property
    def name(self) -> str:
        """Returns as text the number of past samples in the prediction; "none" without prediction."""
        return str(self.samples) if self.samples else "none"

    def as_json(self) -> dict[str, Any]:
        return {
            "samples": self.samples,
            "damping": list(self.damping),
            "friction": self.friction,
            "knob": self.knob,
            "ratio": {name: [float(value) for value in values] for name, values in self.ratio.items()},
        }


def measure() -> list[PredictionGain]:
    """Simulates identified and random objects with several hands, for each number of past samples."""
    device = DeviceProfile()
    knob = identify(sample_recording(seed=1))
    cases = [
        [errors(model, samples, device, hand, DURATION_S) for samples in PREDICTIONS]
        for model in objects(knob)
        for hand in hands(model)
    ]
    hand_at_2_hz = Hand(frequency_hz=2.0)
    return [
        PredictionGain(
            samples,
            (damping(samples, 0.0), damping(samples, 1.0)),
            friction(samples),
            errors(knob, samples, device, hand_at_2_hz, 4.0),
            {name: np.array([abs(case[0][name] / case[k][name]) for case in cases]) for name in ERRORS},
        )
        for k, samples in enumerate(PREDICTIONS)
    ]


def errors(
    model: Model, samples: int, device: DeviceProfile, hand: Hand, duration: float
) -> dict[str, float]:
    plan = Plan(model, Scheme(structure="direct", predict=samples))
    error = force_error(plan, simulate(plan, device, hand, duration))
    return {name: float(getattr(error, name)) for name in ERRORS}


def objects(knob: Model) -> Iterator[Model]:
    """Yields two models identified from sample recordings, and random networks over the same positions."""
    yield knob
    yield identify(sample_recording(seed=2))
    random = np.random.default_rng(0)
    for _ in range(RANDOM_OBJECTS):
        size = int(random.integers(3, 12))
        alpha = np.exp(random.uniform(np.log(10.0), np.log(120.0), size))
        beta = random.uniform(knob.lower[0], knob.upper[0], size)
        weight = random.normal(size=size) / np.sqrt(alpha)
        linear = random.uniform(0.0, 8.0)
        shape: dict[str, Any] = {
            "alpha": alpha[:, None].tolist(),
            "beta": beta[:, None].tolist(),
            "bias": 0.0,
        }
        bounds = force_bounds(knob.with_network(**shape, weight=weight.tolist(), linear=[linear]))
        scale = STEEPEST / max(bounds.slope_max, -bounds.slope_min)
        yield knob.with_network(**shape, weight=(scale * weight).tolist(), linear=[scale * linear])


def hands(model: Model) -> Iterator[Hand]:
    lower, upper = float(model.lower[0]), float(model.upper[0])
    for frequency, stiffness in HANDS:
        yield Hand(
            frequency_hz=frequency, stiffness=stiffness, lower=lower + 0.03 * (upper - lower), upper=upper
        )


def certificate(samples: int, steepest_fall: float, device: DeviceProfile) -> dict[str, float]:
    """Returns the right side of each certificate inequality, for force slopes from -steepest_fall to 1."""
    bounds = ForceBounds(slope_min=-steepest_fall, slope_max=1.0, steepest=1.0, sliding=1.0)
    scheme = Scheme(structure="direct", predict=samples)
    return {line.id: line.right for line in certify_bounds(bounds, scheme, device).inequalities}


def damping(samples: int, steepest_fall: float) -> float:
    device = DeviceProfile()
    return certificate(samples, steepest_fall, device)["damping-hold"] / device.period_s


def friction(samples: int) -> float:
    device = DeviceProfile()
    steps = certificate(samples, 0.0, device)["friction-steps"]
    return float(steps / (0.5 * device.encoder_step))


def draw_prediction(axes: Axes, gains: Sequence[PredictionGain]) -> None:
    """Draws force errors divided by those without prediction; the x axis is the required device damping."""
    x = np.array([gain.damping[1] for gain in gains])
    for name, error, marker, filled, sign in (
        ("mean of a tick", "mean", "o", "white", -1),
        ("below 50 Hz", "band", "s", "black", 1),
    ):
        middle, lower, upper = 1.0 / np.array([gain.spread(error) for gain in gains]).T
        axes.errorbar(
            x * (1.0 + 0.006 * sign),
            middle,
            yerr=(middle - upper, lower - middle),
            linestyle="none",
            marker=marker,
            markersize=4.5,
            color="black",
            markerfacecolor=filled,
            elinewidth=0.6,
            capsize=2.0,
            label=name,
        )
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    grid(axes)
    axes.set_xlabel("certified damping b / (T M), slopes from −M to M")
    axes.set_ylabel("force error over that without prediction")
    top_axis = axes.secondary_xaxis("top")
    top_axis.set_xticks(x, [str(gain.samples) for gain in gains])
    top_axis.set_xlabel("samples m of the prediction")
    axes.figure.legend(frameon=False, loc="outside lower center", ncols=2)


def cost_table(gains: Sequence[PredictionGain]) -> str:
    return markdown_table(
        ("samples m", "b / (T M), s_ = 0", "b / (T M), s_ = M", "f_c over that without"),
        [
            (gain.name, number(gain.damping[0]), number(gain.damping[1]), number(gain.friction))
            for gain in gains
        ],
    )


def gain_table(gains: Sequence[PredictionGain]) -> str:
    header = (
        "samples m",
        "knob: mean of a tick [N·m]",
        "below 50 Hz [N·m]",
        "work [J]",
        "all: mean of a tick, times smaller",
        "below 50 Hz, times smaller",
    )
    return markdown_table(
        header,
        [
            (
                gain.name,
                *(number(gain.knob[error]) for error in ("mean", "band", "work")),
                *(spread(gain, error) for error in ("mean", "band")),
            )
            for gain in gains
        ],
    )


def spread(gain: PredictionGain, error: str) -> str:
    if not gain.samples:
        return "1"
    middle, lower, upper = gain.spread(error)
    return f"{middle:.1f} ({lower:.1f} to {upper:.1f})"


def write(gains: Sequence[PredictionGain], to: Path) -> None:
    """Draws the figure of the prediction, writes its numbers, and fills the tables of the page."""
    write_json(to / "figures" / "prediction.json", {"predictions": [gain.as_json() for gain in gains]})
    with figure_file(to / "figures" / "prediction.png", height_inches=3.2) as (axes,):
        draw_prediction(axes, gains)
    fill_tables(
        to / "certificate.md", {"prediction": cost_table(gains), "prediction-gain": gain_table(gains)}
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--to", type=Path, required=True, help="folder of figures/ and of the page")
    write(measure(), parser.parse_args().to)


if __name__ == "__main__":
    main()
