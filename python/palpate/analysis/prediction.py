# SPDX-License-Identifier: Apache-2.0
"""Gain and price of the half-sample prediction: force errors in simulation beside the certified damping."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._core.device import DeviceProfile
from .._core.rendering import Scheme
from .._core.simulation import Hand
from .._core.stability import ForceBounds, certify_bounds, force_bounds
from .._typing import Float1D
from ..identification import identify
from ..model import Model
from ..planning import Plan, force_error, simulate
from ..recording.sample import sample_recording

PREDICTIONS = (0, 1, 2, 4, 8, 16)
"""Samples of the predictions that are compared [-]"""

_ERRORS = ("mean", "band", "end", "work")
_STEEPEST = 45.0
"""Steepest slope of the random objects [N*m/rad]"""
_RANDOM_OBJECTS = 6
_HANDS = ((0.5, 15.0), (1.0, 30.0), (2.0, 15.0), (2.0, 60.0), (4.0, 30.0))
"""Frequency [Hz] and stiffness [N*m/rad] of the simulated hands"""
_DURATION_S = 2.0


@dataclass(frozen=True)
class PredictionGain:
    """One number of samples, over all objects and hands."""

    samples: int
    damping: tuple[float, float]
    """Certified b / (T M): slopes from 0 to M, and from -M to M"""
    friction: float
    """Certified f_c over that without prediction"""
    knob: dict[str, float]
    """Force errors of the sample's knob at 2 Hz in 4 s [N*m], and the work of the error [J]"""
    ratio: dict[str, Float1D]
    """(cases,) force error without prediction over that with it, for each error"""

    def spread(self, error: str) -> tuple[float, float, float]:
        """Median, 10 % and 90 % quantile of a ratio."""
        low, middle, high = np.quantile(self.ratio[error], (0.1, 0.5, 0.9))
        return float(middle), float(low), float(high)

    def as_json(self) -> dict[str, Any]:
        """The same, for a file."""
        return {
            "samples": self.samples,
            "damping": list(self.damping),
            "friction": self.friction,
            "knob": self.knob,
            "ratio": {name: [float(value) for value in values] for name, values in self.ratio.items()},
        }


def measure_prediction() -> tuple[PredictionGain, ...]:
    """Render identified and random objects under several hands, with each prediction."""
    device = DeviceProfile()
    knob = identify(sample_recording(seed=1))
    cases = [
        [_errors(model, samples, device, hand, _DURATION_S) for samples in PREDICTIONS]
        for model in _objects(knob)
        for hand in _hands(model)
    ]
    at_two_hertz = Hand(frequency_hz=2.0)
    return tuple(
        PredictionGain(
            samples,
            (_damping(samples, 0.0), _damping(samples, 1.0)),
            _friction(samples),
            _errors(knob, samples, device, at_two_hertz, 4.0),
            {name: np.array([abs(case[0][name] / case[k][name]) for case in cases]) for name in _ERRORS},
        )
        for k, samples in enumerate(PREDICTIONS)
    )


def _errors(
    model: Model, samples: int, device: DeviceProfile, hand: Hand, duration: float
) -> dict[str, float]:
    plan = Plan(model, Scheme(structure="direct", predict=samples))
    error = force_error(plan, simulate(plan, device, hand, duration))
    return {name: float(getattr(error, name)) for name in _ERRORS}


def _objects(knob: Model) -> Iterator[Model]:
    """Two identified samples, and random networks over the same travel."""
    yield knob
    yield identify(sample_recording(seed=2))
    random = np.random.default_rng(0)
    for _ in range(_RANDOM_OBJECTS):
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
        scale = _STEEPEST / max(bounds.slope_max, -bounds.slope_min)
        yield knob.with_network(**shape, weight=(scale * weight).tolist(), linear=[scale * linear])


def _hands(model: Model) -> Iterator[Hand]:
    lower, upper = float(model.lower[0]), float(model.upper[0])
    for frequency, stiffness in _HANDS:
        yield Hand(
            frequency_hz=frequency, stiffness=stiffness, lower=lower + 0.03 * (upper - lower), upper=upper
        )


def _certificate(samples: int, falling: float, device: DeviceProfile) -> dict[str, float]:
    """What each line needs for slopes from -falling to 1."""
    bounds = ForceBounds(slope_min=-falling, slope_max=1.0, steepest=1.0, sliding=1.0)
    scheme = Scheme(structure="direct", predict=samples)
    return {line.id: line.right for line in certify_bounds(bounds, scheme, device).inequalities}


def _damping(samples: int, falling: float) -> float:
    device = DeviceProfile()
    return _certificate(samples, falling, device)["damping-hold"] / device.period_s


def _friction(samples: int) -> float:
    device = DeviceProfile()
    steps = _certificate(samples, 0.0, device)["friction-steps"]
    return float(steps / (0.5 * device.encoder_step))
