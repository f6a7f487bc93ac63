# SPDX-License-Identifier: Apache-2.0
"""A model says how much of the force position can explain, and never fits what it cannot."""

import os
from pathlib import Path

import numpy as np
import pytest

import palpate
from imperfect import Array, noise, recorded, strokes, sweep, wall
from palpate.identification.classes.findings import explained_findings, likely_cause, unexplained_variance

DATA = Path(os.environ.get("PALPATE_DATA", "../shared/data"))
N = 4000


def relaxation() -> tuple[Array, Array, Array]:
    """A ramp, then a pause during which the force relaxes and the position's sensor flickers."""
    random = np.random.default_rng(4)
    x = np.concatenate([np.linspace(0.0, 1.0, 200), 1.0 + random.normal(0.0, 1e-5, 2000)])
    force = np.concatenate([np.linspace(0.0, 1.0, 200), 0.3 + 0.7 * np.exp(-np.arange(2000) / 400.0)])
    return x, force + random.normal(0.0, 0.002, len(x)), 0.01 * np.arange(len(x))


def test_unexplained_variance_is_that_of_the_noise() -> None:
    x = strokes(N)
    assert unexplained_variance(x, wall(x) + noise(N)) == pytest.approx(0.02**2, rel=0.1)
    assert unexplained_variance(x, wall(x)) < 1e-6
    side = np.sign(np.gradient(x))
    both = wall(x) + side
    assert unexplained_variance(x, both) > 0.5
    assert unexplained_variance(x, both, side) < 1e-3
    # equal positions at different times are compared with each other
    assert unexplained_variance(np.repeat([0.0, 1.0], 1000), np.tile(np.arange(1000.0), 2)) > 5e4


def test_relaxation_is_named_and_gives_no_steep_slope() -> None:
    x, force, time = relaxation()
    model = palpate.identify(recorded(x, force, time))
    assert "explains at most" in str(model.verdict)
    assert "the force changes at a constant position (relaxation, creep or drift)" in str(model.verdict)
    assert model.slope_bounds is not None
    assert max(np.abs(model.slope_bounds)) < 200.0


def test_likely_cause_is_time_direction_or_another_input() -> None:
    x = strokes(N)
    random = np.random.default_rng(5)
    assert "time" in likely_cause(x, np.linspace(0.0, 1.0, N))[0]
    assert "press and release" in likely_cause(x, np.sign(np.gradient(x)) * x)[0]
    assert "another input" in likely_cause(x, random.normal(size=N))[0]


def test_model_with_a_small_error_has_no_finding() -> None:
    x = strokes(N)
    assert explained_findings(x, wall(x) + noise(N), noise(N), None, 0.005) == []
    # a force that the model misses, not the position
    assert explained_findings(x, wall(x), wall(x) - wall(x).mean(), None, 1.0) == []


@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data, set PALPATE_DATA")
@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("relax_stretch_1d5", 0.5),
        ("relax_stretch_2d0", 0.5),
        ("relax_stretch_4d0", 0.5),
        ("relax_stretch_6d0", 0.4),
    ],
)
def test_measured_relaxation_is_named(name: str, least: float) -> None:
    recording = palpate.read_recording(DATA / "vhb4910_viscoelastic" / f"{name}.csv")
    model = palpate.identify(recording)
    assert model.fit.nrmse > least
    assert "relaxation, creep or drift" in str(model.verdict)
    secant = float(np.ptp(recording.force) / np.ptp(recording.position))
    assert model.slope_bounds is not None
    assert max(np.abs(model.slope_bounds)) < 250.0 * secant  # 100 000 times before


@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data, set PALPATE_DATA")
def test_measured_probing_at_several_places_is_named() -> None:
    recording = palpate.read_recording(
        DATA / "organ_probing" / "pig_liver_20150826_v2_region2.csv",
        position="depth_mm",
        force="normal_force_N",
    )
    model = palpate.identify(recording)
    assert model.n_wavelets <= 3
    assert "position explains at most 62%" in str(model.verdict)
    assert "another input" in str(model.verdict)


def test_shuffled_rows_lose_nothing() -> None:
    order = np.random.default_rng(6).permutation(N)
    x = sweep(N)
    model = palpate.identify(recorded(x[order], (wall(x) + noise(N))[order]))
    assert 3 <= model.n_wavelets <= 8
    assert model.verdict.level == "good"
