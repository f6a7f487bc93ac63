# SPDX-License-Identifier: Apache-2.0
"""Shift and power-of-two scale of the force, so that huge, tiny or far offset numbers are fitted like others.

The fit forms squares, and sums in single precision. A force within ordinary bounds is not touched, so that
its fit stays the same to the last bit. Beyond them the fit sees (force - offset) * factor with an exact power
of two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .._typing import Float1D
from .identified import IdentifiedNetwork, Readings
from .options import IdentifyOptions

FAR = 1e3
"""Ratio of the mean force to the force's range above which the mean is subtracted before fitting [-]"""

ORDINARY_EXPONENT = 50
"""A force range from 2^-50 to 2^50 is not scaled [-]"""


@dataclass(frozen=True)
class ForceScale:
    """The fit sees (force - offset) * factor."""

    offset: float = 0.0
    factor: float = 1.0

    @classmethod
    def of(cls, force: Float1D, options: IdentifyOptions) -> ForceScale:
        """The scale that a force (n,) needs; the identity for ordinary numbers.

        The perceptual criterion compares errors with the force itself, so that its offset stays.
        """
        reach = float(np.ptp(force))
        mean = float(np.mean(force)) if reach > 0.0 and options.criterion != "perceptual" else 0.0
        offset = mean if abs(mean) > FAR * reach else 0.0
        size = reach if offset else float(np.abs(force).max())
        if size == 0.0:
            return cls()
        exponent = math.frexp(size)[1]
        return cls(offset, 1.0 if abs(exponent) <= ORDINARY_EXPONENT else 2.0**-exponent)

    def __bool__(self) -> bool:
        return self.offset != 0.0 or self.factor != 1.0

    def scaled(self, force: Float1D) -> Float1D:
        """What the fit sees of a force (n,)."""
        return (force - self.offset) * self.factor

    def scaled_options(self, options: IdentifyOptions) -> IdentifyOptions:
        """The options, with those that hold a force or a slope in the scale of the fit."""
        factor = self.factor
        slopes, fixed, coupling = options.slope_bounds, options.fixed_force, options.coupling_stiffness
        return replace(
            options,
            slope_bounds=None if slopes is None else (slopes[0] * factor, slopes[1] * factor),
            fixed_force=None if fixed is None else (fixed[0], (fixed[1] - self.offset) * factor),
            coupling_stiffness=None if coupling is None else coupling * factor,
        )

    def unscaled_readings(self, readings: Readings) -> Readings:
        """g (and h) in the unit of the force; only g has the offset."""
        bias = readings.bias / self.factor
        bias[0] += self.offset
        return replace(
            readings,
            weights=readings.weights / self.factor,
            linear=readings.linear / self.factor,
            bias=bias,
            at_lower=readings.at_lower / self.factor + self.offset,
        )

    def unscaled(self, network: IdentifiedNetwork) -> IdentifiedNetwork:
        """The network in the unit of the force."""

        def back(value: Float1D | None) -> Float1D | None:
            return None if value is None else value / self.factor

        def one(value: float | None) -> float | None:
            return None if value is None else value / self.factor

        notes = network.notes
        if self.factor != 1.0:
            notes = (f"forces were multiplied by {self.factor:g} to identify them; notes name these", *notes)
        if self.offset:
            notes = (f"an offset of {self.offset:g} was subtracted from the force to identify it", *notes)
        below = "linear" if self.offset else network.below
        return replace(
            network,
            below=below,
            weight=network.weight / self.factor,
            linear=network.linear / self.factor,
            bias=network.bias / self.factor + self.offset,
            weight_hysteresis=back(network.weight_hysteresis),
            linear_hysteresis=back(network.linear_hysteresis),
            bias_hysteresis=one(network.bias_hysteresis),
            mass=one(network.mass),
            damping=one(network.damping),
            rmse=network.rmse / self.factor,
            path=tuple(replace(point, rmse=point.rmse / self.factor) for point in network.path),
            notes=notes,
        )
