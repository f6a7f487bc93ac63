# SPDX-License-Identifier: Apache-2.0
"""Wavelets without weights: the narrowest wavelets that data resolve, and the frames of candidate wavelets.

The members of a frame (paper section 2.4) are a0^(-m/2) psi_v(a0^(-m) x - k b0) over all integers m and k,
with V voices psi_v(x) = 2^(-v/V) psi(2^(-v/V) x), v = 0 .. V - 1, all on the same step b0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
import scipy
from numpy.typing import NDArray

from ..._core.model import wavelet_columns, wavelet_slope_columns
from ..._typing import Float1D, Float2D
from ...arguments import number_of
from ...errors import InputError
from ..data.limits import distinct_rows

UNUSED_DILATION = 2.0**-13
"""Dilation of a wavelet along an input that it does not use [1/range of recorded positions]. Along this input
the value of the wavelet changes by less than 1e-7 of its maximum."""

UNUSED_TRANSLATION = 0.5
"""Translation of a wavelet along an input that it does not use [range of recorded positions]."""


@dataclass(frozen=True)
class Basis:
    """Wavelets without their weights: dilations alpha (N, d) > 0 and translations beta (N, d).

    A wavelet may use only some of several inputs. Along the others its dilation is `UNUSED_DILATION`. The
    last `harmonics` of the N columns are cos(alpha (x - beta)), for a periodic force: a cosine and a sine for
    each order.
    """

    alpha: Float2D
    beta: Float2D
    harmonics: int = 0

    @staticmethod
    def empty(dimension: int) -> "Basis":
        return Basis(np.zeros((0, dimension)), np.zeros((0, dimension)))

    @staticmethod
    def of_orders(orders: Float1D) -> "Basis":
        """Returns a cosine and a sine of each order, the number of waves in the unit box (k,)."""
        wave = np.repeat(orders, 2)
        quarter = np.tile([0.0, 0.25], len(orders)) / wave
        return Basis(2.0 * np.pi * wave[:, None], quarter[:, None], len(wave))

    def __len__(self) -> int:
        return len(self.alpha)

    @property
    def hats(self) -> int:
        """Number of wavelets without the harmonics."""
        return len(self.alpha) - self.harmonics

    @property
    def size(self) -> int:
        """Number of wavelets and orders of harmonics."""
        return self.hats + self.harmonics // 2

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """True (N, d) for the inputs with a fitted dilation and translation of each wavelet; harmonics have
        none."""
        used = np.asarray(self.alpha > UNUSED_DILATION)
        used[self.hats :] = False
        return used

    def columns(self, positions: Float2D) -> Float2D:
        """Returns the values (n, N) of all wavelets and harmonics at positions (n, d)."""
        return np.asarray(wavelet_columns(positions, self.alpha, self.beta, self.harmonics))

    def slopes(self, x: Float1D) -> Float2D:
        """Returns the slopes (n, N) of all wavelets and harmonics at positions (n,) of one input."""
        return np.asarray(wavelet_slope_columns(x, self.alpha, self.beta, self.harmonics))

    def over(self, inputs: Sequence[int], dimension: int) -> "Basis":
        """Returns these wavelets of some inputs as wavelets of `dimension` inputs, which do not use the
        others."""
        shape = (len(self), dimension)
        found = Basis(np.full(shape, UNUSED_DILATION), np.full(shape, UNUSED_TRANSLATION))
        found.alpha[:, inputs], found.beta[:, inputs] = self.alpha, self.beta
        return found

    def joined(self, other: "Basis") -> "Basis":
        """Returns the wavelets of both, then the harmonics of both."""

        def both(mine: Float2D, its: Float2D) -> Float2D:
            return np.concatenate(
                [mine[: self.hats], its[: other.hats], mine[self.hats :], its[other.hats :]]
            )

        harmonics = self.harmonics + other.harmonics
        return Basis(both(self.alpha, other.alpha), both(self.beta, other.beta), harmonics)

    def without_harmonics(self) -> "Basis":
        return self if self.harmonics == 0 else Basis(self.alpha[: self.hats], self.beta[: self.hats])

    def without(self, index: int) -> "Basis":
        """Returns the basis without one of its `size` wavelets or orders."""
        order = index - self.hats
        gone = [index] if order < 0 else [index + order, index + order + 1]
        left = self.harmonics if order < 0 else self.harmonics - 2
        return Basis(np.delete(self.alpha, gone, axis=0), np.delete(self.beta, gone, axis=0), left)

    def without_input(self, index: int, k: int) -> "Basis":
        """Returns the wavelets with one that no longer uses input k."""
        found = replace(self, alpha=self.alpha.copy(), beta=self.beta.copy())
        found.alpha[index, k], found.beta[index, k] = UNUSED_DILATION, UNUSED_TRANSLATION
        return found


MOST_TREE_INPUTS = 3
"""Largest number of inputs for which a tree finds the nearest positions faster than a list of all
distances."""

MOST_DISTANCES = 4096
"""Largest number of positions whose distances to a place are computed. Of more positions a random part is
used."""


class Resolution:
    """Computes distances from a place to the nearest distinct positions of a set of positions (m, d)."""

    def __init__(self, positions: Float2D) -> None:
        self._positions = positions[distinct_rows(positions)[0]]
        self._subsets: dict[int, Resolution] = {}
        """Positions over some of the inputs k, by the sum of 2^k"""
        self._middles: dict[int, Float1D] = {}

    def __len__(self) -> int:
        return len(self._positions)

    def widest_gap(self) -> float:
        """Returns the widest gap between neighbouring positions of one input that repeat with the period
        1."""
        places = np.unique(np.mod(self._positions[:, 0], 1.0))
        return float(np.diff(places, append=places[0] + 1.0).max())

    def reach(self, basis: Basis, count: int) -> Float1D:
        """Returns the radius (N,) around the translation of each of N wavelets that contains `count`
        positions.

        Distances and distinct positions are those over the inputs that the wavelet uses. The radius is
        infinite if there are fewer positions.
        """
        if self._positions.shape[1] == 1:
            return self._around(basis.beta, count)
        bits = 1 << np.arange(basis.beta.shape[1])
        subset, radius = basis.used @ bits, np.empty(len(basis))
        for code in np.unique(subset):
            inputs, those = np.flatnonzero(code & bits), subset == code
            if code not in self._subsets:
                self._subsets[code] = Resolution(self._positions[:, inputs])
            radius[those] = self._subsets[code]._around(basis.beta[those][:, inputs], count)
        return radius

    @cached_property
    def _compared(self) -> Float2D:
        """Positions whose distances are computed"""
        if self._positions.shape[1] <= MOST_TREE_INPUTS or len(self) <= MOST_DISTANCES:
            return self._positions
        return np.random.default_rng(0).choice(self._positions, MOST_DISTANCES, replace=False)

    @cached_property
    def _tree(self) -> "scipy.spatial.cKDTree":
        return scipy.spatial.cKDTree(self._compared)

    def _around(self, places: Float2D, count: int) -> Float1D:
        """Returns the radius (N,) around each place (N, d) that contains `count` positions; infinite if there
        are fewer."""
        positions, d = self._compared, places.shape[1]
        if len(positions) < len(self):
            count = max(2, round(len(positions) / len(self) * count))
        if count > len(positions):
            return np.full(len(places), np.inf)
        if 1 < d <= MOST_TREE_INPUTS:
            return np.asarray(self._tree.query(places, k=[count])[0])[:, 0]
        if d > 1:
            square = scipy.spatial.distance.cdist(places, positions, "sqeuclidean")
            return np.asarray(np.sqrt(np.partition(square, count - 1, axis=1)[:, count - 1]))
        # On a line the nearest positions are neighbours in order, with their middle next to the place.
        line, place, most = positions[:, 0], places[:, 0], len(positions) - count
        if count not in self._middles:
            self._middles[count] = 0.5 * (line[: most + 1] + line[count - 1 :])
        above = np.searchsorted(self._middles[count], place)
        first = np.array([np.maximum(above - 1, 0), np.minimum(above, most)])
        left, right = line[first], line[first + (count - 1)]
        return np.asarray(np.maximum(place - left, right - place).min(axis=0))


COARSEST_CANDIDATE = 1.0
"""Dilation of the widest wavelets of the frame [1/range of recorded positions]."""

MOST_LIBRARY_ENTRIES = 2**25
"""Largest number of stored values of all candidate wavelets at all rows, 128 MiB for each channel of a row.
Many rows allow fewer candidates."""


def frame_bounds(a0: float, b0: float, voices: int = 1) -> tuple[float, float]:
    """Estimates the frame bounds A, B of the unit-norm Mexican hat psi (Daubechies 1990, section II.C).

    With the Fourier transform psi^: A, B = (2 pi / b0) (inf, sup over 1 <= |xi| <= a0 of sum_v sum_m
    |psi_v^(a0^m xi)|^2 -/+ sum_v sum_(k != 0) [beta_v(2 pi k / b0) beta_v(-2 pi k / b0)]^(1/2)).

    beta_v(s) = sup over xi of sum_m |psi_v^(a0^m xi)| |psi_v^(a0^m xi + s)|.

    Parameters
    ----------
    a0 : float
        Ratio of neighbouring dilations, above 1.
    b0 : float
        Translation step, above 0, the same for every voice.
    voices : int
        Number of voices V.

    Returns
    -------
    (A, B) : tuple of float
        The closer B/A is to 1, the tighter the frame. With A <= 0 the estimate does not prove that the
        wavelets form a frame.

    Raises
    ------
    palpate.InputError
        An argument is out of range; the message names the argument.
    """
    a0, b0, whole = number_of("a0", a0), number_of("b0", b0), number_of("voices", voices)
    if not a0 > 1.0:
        raise InputError(f"a0, the ratio of neighbouring dilations, is {a0!r}: must be a finite number > 1")
    if not b0 > 0.0:
        raise InputError(f"b0, the translation step, is {b0!r}: must be a finite number > 0")
    if int(whole) != whole or whole < 1:
        raise InputError(f"voices is {voices!r}: must be a whole number >= 1")
    # the Fourier transform of each voice is below 2e-15 of its peak outside the frequencies 2^-26 .. 2^4
    levels = np.arange(np.floor(-26.0 / np.log2(a0)), np.ceil(5.0 / np.log2(a0)) + 1.0)
    frequency = np.linspace(1.0, a0, 1001)[:, None] * a0**levels
    diagonal, cross = np.zeros(len(frequency)), 0.0
    for stretch in 2.0 ** (-np.arange(voices) / voices):
        here = _spectrum(frequency / stretch)
        diagonal += (here * here).sum(axis=1)
        shift, overlap = 1, 1.0
        while overlap > 0.0:
            step = 2.0 * np.pi * shift / b0
            # the Fourier transform is even: the supremum over -xi at +s equals the one over xi at -s, so both
            # factors of the product are equal
            overlap = max(
                float((here * _spectrum((frequency + sign * step) / stretch)).sum(axis=1).max())
                for sign in (1, -1)
            )
            cross += 2.0 * overlap
            shift += 1
    unit = 2.0 * np.pi / b0
    return float(unit * (diagonal.min() - cross)), float(unit * (diagonal.max() + cross))


def _spectrum(frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the absolute value of the unitary Fourier transform of the unit-norm Mexican hat."""
    return np.asarray(2.0 / np.sqrt(3.0) * np.pi**-0.25 * frequency**2 * np.exp(-0.5 * frequency**2))


def truncated_frame(
    positions: Float2D,
    *,
    coarsest: float,
    finest: float,
    frame_scale: float,
    frame_step: float,
    max_candidates: int,
) -> Basis:
    """Returns the wavelets of the single-scaling frame that have data in their core, the widest first.

    The translations of each dilation are the lattice points around the data, so that the full grid, whose
    size grows exponentially with the number of inputs, is never built. If a dilation would bring more than
    max_candidates wavelets in total, only the lattice points nearest to data are taken. If these are still
    too many, those with most data are taken, and larger dilations are left out: refinement can still make
    wavelets narrower.

    positions (m, d) in the unit box; dilations coarsest * frame_scale^j [1/box]; step frame_step / dilation.
    """
    d = positions.shape[1]
    # a lattice point has 3^d - 1 neighbours: with more than three inputs only those along one input are used
    around = product((-1, 0, 1), repeat=d) if d <= 3 else (*np.eye(d), *-np.eye(d), np.zeros(d))
    offsets = np.array(list(around), dtype=np.int64)
    alpha: list[Float2D] = []
    beta: list[Float2D] = []
    left, dilation = max_candidates, coarsest
    while dilation <= finest and left > 0:
        step = frame_step / dilation
        nearest = np.rint(positions / step).astype(np.int64)
        chosen, _, count = distinct_rows(nearest)
        nearest = nearest[chosen]
        if len(nearest) <= left:
            lattice = (nearest[:, None, :] + offsets).reshape(-1, d)
            lattice = lattice[distinct_rows(lattice)[0]]
            if len(lattice) > left:
                lattice = nearest
        else:
            lattice = nearest[np.argsort(-count, kind="stable")[:left]]
        beta.append(np.asarray(lattice * step))
        alpha.append(np.full((len(lattice), d), dilation))
        left -= len(lattice)
        dilation *= frame_scale
    if not alpha:
        return Basis.empty(d)
    return Basis(np.concatenate(alpha), np.concatenate(beta))
