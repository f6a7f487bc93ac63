# SPDX-License-Identifier: Apache-2.0
"""
Transfer functions and the filters of the paper.
"""
from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import typing
__all__: list[str] = ['EnvironmentFilters', 'TransferFunction', 'environment_filters', 'paper_sample_time_s']
class TransferFunction:
    """
    Filter H(z) = (b0 z^2 + b1 z + b2) / (z^2 + a1 z + a2) and its state.
    """
    def __init__(self, numerator: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], denominator: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> None:
        ...
    def at(self, z: complex | typing.SupportsComplex | typing.SupportsFloat | typing.SupportsIndex) -> complex:
        """
        Returns H(z), for instance at z = exp(1j * omega * T).
        """
    def filter(self, input: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Returns the filtered signal for an input signal (n,). The filter starts from its present
        state and keeps this state.
        """
    def poles(self) -> typing.Annotated[list[complex], "FixedSize(2)"]:
        ...
    def reset(self) -> None:
        """
        Sets the state of the filter to zero.
        """
    def step(self, input: typing.SupportsFloat | typing.SupportsIndex) -> float:
        """
        Filters the next input sample and returns the output sample.
        """
    @property
    def denominator(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        ...
    @property
    def numerator(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        ...
class EnvironmentFilters:
    """
    The paper's discrete integrators I1, I2 and differentiators G1, G2 (figures 10 to 14).
    """
    @property
    def g1(self) -> TransferFunction:
        ...
    @property
    def g2(self) -> TransferFunction:
        ...
    @property
    def i1(self) -> TransferFunction:
        ...
    @property
    def i2(self) -> TransferFunction:
        ...
def environment_filters(pair: str, design: str = 'paper') -> EnvironmentFilters:
    """
    Returns the paper's integrators and differentiators for the period T = 1 ms (section 4.3): as published,
    or such that integrator times differentiator is 1 at low frequency.
    """
paper_sample_time_s: float = 0.001
