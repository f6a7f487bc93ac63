# SPDX-License-Identifier: Apache-2.0
"""A C++ program and the Python package compute equal forces of the same networks and positions."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from conftest import ROOT
from palpate._core.model import ForceModel

Array = NDArray[np.float64]

NETWORKS = 1000 * int(os.environ.get("PALPATE_TEST_SCALE", "1"))
CONTINUATIONS = ("linear", "free")
TOLERANCE = 1e-12
"""Largest allowed difference of C++ and Python results, divided by the sum of the absolute terms."""

DIFFICULT = [0.0, -0.0, np.nan, np.inf, -np.inf, 5e-324, -2e-310, 1e300, -1e300, np.finfo(float).max]


@dataclass
class Case:
    """Wavelet network with the domain [lower, upper], and the positions at which it is evaluated."""

    alpha: Array
    beta: Array
    weight: Array
    linear: float
    bias: float
    lower: float
    upper: float
    below: int
    above: int
    x: Array

    def stream(self) -> bytes:
        """Returns the text that the test program forces.cpp reads: networks and positions."""
        header = [len(self.alpha), len(self.x), self.linear, self.bias, self.lower, self.upper]
        parts = [[*header, self.below, self.above], self.alpha, self.beta, self.weight, self.x]
        return np.concatenate(parts).astype(np.float64).tobytes()

    def model(self) -> ForceModel:
        return ForceModel(
            alpha=self.alpha[:, None],
            beta=self.beta[:, None],
            weight=self.weight,
            linear=[self.linear],
            bias=self.bias,
            lower=[self.lower],
            upper=[self.upper],
            below=CONTINUATIONS[self.below],
            above=CONTINUATIONS[self.above],
        )


def cases() -> Iterator[Case]:
    random = np.random.default_rng(17)
    for _ in range(NETWORKS):
        size = int(random.integers(0, 65))
        travel = 10.0 ** random.uniform(-6, 3)
        lower = travel * random.uniform(-2, 1)
        x = lower + travel * random.uniform(-0.2, 1.2, 8)
        # each network is also evaluated at four numbers made of random bits
        bits = random.integers(-(2**63), 2**63 - 1, 4, dtype=np.int64).view(np.float64)
        yield Case(
            np.exp(random.uniform(0.0, 5.0, size)) / travel,
            lower + travel * random.uniform(-0.1, 1.1, size),
            10.0 ** random.uniform(-3, 6, size) * random.choice([-1.0, 1.0], size),
            random.uniform(-10, 10) / travel,
            random.uniform(-1, 1),
            lower,
            lower + travel,
            *(int(k) for k in random.integers(0, 2, 2)),
            x=np.concatenate(
                [x, random.choice(DIFFICULT, 4), bits, lower + travel * random.uniform(0, 1, 2)]
            ),
        )


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compiles the test program forces.cpp as C++20 with no other option than the include folder."""
    compiler = shutil.which(os.environ.get("CXX", "c++"))
    if compiler is None:
        pytest.skip("needs a C++ compiler")
    path = tmp_path_factory.mktemp("program") / "forces"
    source = ROOT / "tests" / "python" / "forces.cpp"
    command = [compiler, "-std=c++20", "-O2", f"-I{ROOT / 'cpp' / 'include'}", source, "-o", path, "-pthread"]
    subprocess.run(command, check=True)
    return path


def magnitudes(case: Case) -> Array:
    """Returns the scale of a rounding error: sums of absolute terms of force, slope and energy, (3,)."""
    weight, c = np.abs(case.weight), abs(case.linear)
    largest_position = max(abs(case.lower), abs(case.upper))
    return np.array(
        [
            2.0 * weight.sum() + c * largest_position + abs(case.bias),
            2.0 * (weight * case.alpha).sum() + c,
            (weight / case.alpha).sum() + (c * largest_position + abs(case.bias)) * largest_position,
        ]
    )


@pytest.mark.full
def test_force_slope_and_energy_are_equal_in_cpp_and_python(program: Path) -> None:
    all_cases = list(cases())
    stream = b"".join(case.stream() for case in all_cases)
    out = subprocess.run([program], input=stream, stdout=subprocess.PIPE, check=True).stdout
    rows = iter(
        np.split(np.frombuffer(out).reshape(-1, 3), np.cumsum([len(case.x) for case in all_cases])[:-1])
    )
    for case in all_cases:
        expected, model, magnitude = next(rows), case.model(), magnitudes(case)
        quantities = (model.force, model.slope, model.energy)
        batch = np.stack([quantity(case.x) for quantity in quantities], axis=1)
        single = np.array([[quantity(float(x)) for quantity in quantities] for x in case.x])
        for python in (batch, single):
            with np.errstate(invalid="ignore", over="ignore"):
                is_near = np.abs(python - expected) <= TOLERANCE * np.maximum(magnitude, np.abs(expected))
            is_equal = is_near | (python == expected) | (np.isnan(python) & np.isnan(expected))
            assert is_equal.all(), (case, python[~is_equal], expected[~is_equal])


def test_inside_the_domain_the_force_is_equation_4() -> None:
    for case in list(cases())[: NETWORKS // 4]:
        x = case.x[(case.x >= case.lower) & (case.x <= case.upper)]
        u = case.alpha * (x[:, None] - case.beta)
        expected = ((u**2 - 1.0) * np.exp(-0.5 * u**2)) @ case.weight + case.linear * x + case.bias
        # a rounding error of the wavelet's argument u = alpha (x - beta) is about alpha eps |x|
        largest_position = max(abs(case.lower), abs(case.upper))
        magnitude = magnitudes(case)[0] + magnitudes(case)[1] * largest_position
        assert np.abs(case.model().force(x) - expected).max(initial=0.0) <= TOLERANCE * magnitude
