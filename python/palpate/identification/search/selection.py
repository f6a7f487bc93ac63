# SPDX-License-Identifier: Apache-2.0
"""Selection of wavelets and harmonics from a library of candidates (Zhang 1997).

Forward orthogonal least squares (Chen, Billings & Luo 1989) measures the gain of a new candidate.

Only the Gram matrix of each candidate is kept orthogonal to the columns of the taken wavelets: taking a
wavelet updates the projections of all other candidates by one product with its orthonormalised columns.
Linear and bias columns are always included. Orthogonal selection never takes a candidate that the taken
columns already span, so that the factors stay well conditioned.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..._core.model import wavelet_columns
from ..._typing import Float1D, Float2D
from ..network.basis import Basis
from ..network.separable import LEAST_DILATION, SeparableProblem, Solution, half_solved
from .evidence import choice, criterion_of

LEAST_NEW_SHARE = 1e-5
"""Least share of the squared norm of a candidate that is orthogonal to the taken wavelets [-]: above the
rounding error of seven digits."""

CANDIDATES_AT_ONCE = 16
"""Number of candidates whose columns are computed in one step: their values fit into the cache of a
processor."""

LEAST_DISTANCE = 1.0
"""Two candidate wavelets count as different from this distance on, in widths or as difference of
log(dilation): their refinement may then end in different minima [-]."""

STRETCH_FACTORS = (0.25, 0.5, 2.0, 4.0)
"""Factors by which the dilation of a candidate wavelet along one input is multiplied to get further
candidates [-]."""


class Library:
    """Candidate wavelets with their weighted columns for every block of rows, computed once.

    The columns have seven digits, which are enough to rank candidates and need half the memory of full
    precision.
    """

    def __init__(self, problem: SeparableProblem, candidates: Basis) -> None:
        resolved = np.all(candidates.alpha <= problem.finest(candidates), axis=1)
        self.basis = Basis(candidates.alpha[resolved], candidates.beta[resolved])
        self.columns: list[NDArray[np.float32]] = []
        """For each block of m rows (channels, candidates, m): values of each candidate wavelet times the
        channel"""
        self.grams: list[Float2D] = []
        """For each block of rows (channels, channels, candidates): products of two columns of one candidate
        wavelet"""
        for block in problem.blocks:
            self.columns.append(np.empty((block.n_channels, len(self), len(block.target)), np.float32))
            self.grams.append(np.empty((block.n_channels, block.n_channels, len(self))))
            pairs = block.channels.T[:, None] * block.channels.T
            for first in range(0, len(self), CANDIDATES_AT_ONCE):
                part = slice(first, first + CANDIDATES_AT_ONCE)
                wavelets = wavelet_columns(block.positions, self.basis.alpha[part], self.basis.beta[part])
                columns = self.columns[-1][:, part]
                np.multiply(wavelets.T, block.channels.T[:, None], out=columns, casting="same_kind")
                self.grams[-1][:, :, part] = pairs @ wavelets**2

    def __len__(self) -> int:
        return len(self.basis)

    def members(self, order: Sequence[int] | NDArray[np.intp]) -> Basis:
        """Returns the candidate wavelets with these indices."""
        chosen = np.asarray(order, dtype=np.intp)
        return Basis(self.basis.alpha[chosen], self.basis.beta[chosen])

    def stretched(self, problem: SeparableProblem, order: Sequence[int] | NDArray[np.intp]) -> "Library":
        """Returns the candidate wavelets with these indices, and copies with a changed dilation along one
        input that they use."""
        found = chosen = self.members(order)
        for k in range(problem.dimension):
            using = chosen.used[:, k]
            for factor in STRETCH_FACTORS:
                changed = Basis(chosen.alpha[using], chosen.beta[using])
                changed.alpha[:, k] = np.maximum(factor * changed.alpha[:, k], LEAST_DILATION)
                found = found.joined(changed)
        return Library(problem, found)

    def distinct(self, order: NDArray[np.intp], count: int) -> list[int]:
        """Returns at most `count` of the indices, the first ones, whose wavelets differ in place or
        dilation."""
        chosen: list[int] = []
        while len(order) and len(chosen) < count:
            chosen.append(int(order[0]))
            one, others = self.members(order[:1]), self.members(order)
            shift = np.abs(one.beta - others.beta) * np.sqrt(one.alpha * others.alpha)
            stretch = np.abs(np.log(one.alpha / others.alpha))
            order = order[np.maximum(shift, stretch).max(axis=1) > LEAST_DISTANCE]
        return chosen


class OrderLibrary:
    """Candidate harmonics of a periodic force: every order that the positions resolve, with a cosine and a
    sine for each channel.

    The shortest wave is two times as long as the gap between neighbouring positions: the usual gap of the
    recording, and the widest one within the period on any stroke.
    """

    def __init__(self, problem: SeparableProblem) -> None:
        gap = max(problem.limits.position_gap, *(each.widest_gap() for each in problem.resolutions))
        self.orders = np.arange(1.0, 0.5 / gap)
        basis = Basis.of_orders(self.orders)
        self.columns: list[NDArray[np.float32]] = []
        """For each block of m rows (2 channels, orders, m): cosine and sine of each order times the
        channel"""
        self.grams: list[Float2D] = []
        for block in problem.blocks:
            pairs = block.columns(basis).T
            columns = [pairs[part::2] * channel for channel in block.channels.T for part in (0, 1)]
            self.columns.append(np.array(columns, np.float32))
            self.grams.append(np.einsum("knm,lnm->kln", self.columns[-1], self.columns[-1], dtype=float))

    def __len__(self) -> int:
        return len(self.orders)


class OrthogonalSelection:
    """Forward selection: starts from fitted wavelets, computes the gain of each candidate, and takes
    candidates.

    For each block a candidate's columns (one a channel) have a projected Gram matrix S and a product z with
    the residual; the residual sum of squares falls by z' S^-1 z, summed over the blocks.
    """

    def __init__(self, library: Library | OrderLibrary, start: Solution) -> None:
        self._library = library
        self._factors = [np.linalg.qr(design)[0] for design in start.designs]
        self._residuals = list(start.residuals)
        self._grams, self._products = [], []
        for columns, gram, factor, residual in zip(
            library.columns, library.grams, self._factors, self._residuals, strict=True
        ):
            products = _products(np.vstack([factor.T, residual]), columns)
            self._grams.append(gram - _projected_gram(products[:, :-1]))
            self._products.append(products[:, -1])

    def gains(self) -> Float1D:
        """Returns, for each candidate wavelet, the decrease of the residual sum of squares if it were taken
        next."""
        total = np.zeros(len(self._library))
        for gram, left, product in zip(self._library.grams, self._grams, self._products, strict=True):
            total += _falls(gram, left, product)
        return total

    def take(self, index: int) -> float:
        """Adds a candidate wavelet; returns the residual sum of squares over all blocks of rows."""
        rss = 0.0
        for b, columns in enumerate(self._library.columns):
            factor = self._factors[b]
            fresh = columns[:, index].T.astype(np.float64)
            norm = np.linalg.norm(fresh, axis=0)
            for _ in range(2):  # two passes: columns orthogonal to the taken ones up to rounding (Kahan)
                fresh = fresh - factor @ (factor.T @ fresh)
            basis, triangle = np.linalg.qr(fresh)
            basis = basis[
                :,
                np.abs(np.diag(triangle)) > np.sqrt(LEAST_NEW_SHARE) * np.maximum(norm, np.finfo(float).tiny),
            ]
            shadows = _products(basis.T, columns)
            along = basis.T @ self._residuals[b]
            self._grams[b] = self._grams[b] - _projected_gram(shadows)
            self._products[b] = self._products[b] - along @ shadows
            self._residuals[b] = self._residuals[b] - basis @ along
            self._factors[b] = np.concatenate([factor, basis], axis=1)
            rss += float(self._residuals[b] @ self._residuals[b])
        return rss


def _falls(gram: Float2D, left: Float2D, product: Float2D) -> Float1D:
    """z' S^-1 z of every candidate (n,): gram, S (channels, channels, n), z (channels, n).

    Directions in which a candidate does not lie outside the design do not count.
    """
    if len(product) == 1:
        new = left[0, 0] > LEAST_NEW_SHARE * gram[0, 0]
        return np.asarray(np.where(new, product[0] ** 2 / np.where(new, left[0, 0], 1.0), 0.0))
    own = np.maximum(np.einsum("kkn->nk", gram), np.finfo(float).tiny)
    root = np.sqrt(own)
    value, vector = np.linalg.eigh(left.transpose(2, 0, 1) / (root[:, :, None] * root[:, None, :]))
    along = np.einsum("nkj,nk->nj", vector, product.T / root)
    new = value > LEAST_NEW_SHARE
    return np.asarray(np.sum(np.where(new, along**2 / np.where(new, value, 1.0), 0.0), axis=1))


def orthogonal_gains(library: Library, current: Solution) -> Float1D:
    """Returns the decrease of the residual sum of squares (candidates,) if a candidate were added to a fitted
    network.

    The result equals the gains at the start of a selection, except for the weight penalty in the factors of
    the solution, from which it is computed.
    """
    total = np.zeros(len(library))
    for columns, gram, design, factor, residual in zip(
        library.columns, library.grams, current.designs, current.factors, current.residuals, strict=True
    ):
        products = _products(np.vstack([half_solved(factor, design.T), residual]), columns)
        total += _falls(gram, gram - _projected_gram(products[:, :-1]), products[:, -1])
    return total


def select_orders(
    problem: SeparableProblem, start: Basis, *, max_wavelets: int, criterion: str, patience: int
) -> list[Solution]:
    """Adds harmonics of a periodic force to a basis, the order first that reduces the error most, until the
    criterion has not fallen for `patience` orders. Returns the solutions up to the one that it prefers."""
    library = OrderLibrary(problem)
    found = [problem.solve(start)]
    values = [criterion_of(problem, found[0], criterion)]
    selection = OrthogonalSelection(library, found[0])
    while (
        found[-1].basis.size < max_wavelets
        and problem.n_parameters(found[-1].basis) + 2 * problem.n_channels < problem.independent
        and len(values) - np.argmin(values) <= patience
    ):
        gains = selection.gains()
        if len(gains) == 0 or gains.max() <= 0.0:
            break
        best = int(np.argmax(gains))
        selection.take(best)
        found.append(problem.solve(found[-1].basis.joined(Basis.of_orders(library.orders[[best]]))))
        values.append(criterion_of(problem, found[-1], criterion))
    compared = problem.independent if problem.held_out is None else len(problem.held_out.force)
    return found[: 1 + choice(criterion, values, compared)]


def _products(rows: Float2D, columns: NDArray[np.float32]) -> Float2D:
    """Returns the scalar products of k vectors with the columns of all candidate wavelets (channels, k,
    candidates)."""
    products = columns @ np.ascontiguousarray(rows.T, dtype=np.float32)
    return products.transpose(0, 2, 1).astype(np.float64, order="C")


def _projected_gram(shadows: Float2D) -> Float2D:
    """Returns the scalar products of each two projected columns (channels) of every candidate wavelet
    (channels, channels, candidates)."""
    return np.asarray(np.einsum("kpn,lpn->kln", shadows, shadows))
