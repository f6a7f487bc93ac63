# SPDX-License-Identifier: Apache-2.0
"""Identification from several recordings: model, band, and the check of the band."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import palpate
from any_input import SCALE
from palpate import InputError, Recording, identify, verify
from palpate.identification.classes.repeatability import NO_BAND


def recordings(n: int, *, spread: float = 0.02, seed: int = 0, rows: int = 300) -> list[Recording]:
    """Returns recordings of one stiffening object, each with another stiffness, shape and noise."""
    random = np.random.default_rng(seed)
    made = []
    for _ in range(n):
        x = np.sort(random.uniform(0.0, 0.01, rows))
        u = x / 0.01
        force = 5.0 * u + 20.0 * u**5 + np.exp(-(((u - 0.4) / 0.02) ** 2)) * 0.05
        stiffness, place = random.normal(size=2)
        force = force * (1.0 + spread * stiffness) + spread * np.sin(9.0 * u + place)
        force = force + 0.002 * random.normal(size=len(x))
        press = np.ones(len(x))
        made.append(Recording.from_arrays(x, force, direction=press, units={"position": "m", "force": "N"}))
    return made


@cache
def of_six_recordings() -> palpate.Model:
    """Returns the model of the first six recordings."""
    return identify(recordings(6))


def stiffer(recording: Recording, factor: float) -> Recording:
    return Recording.from_arrays(
        recording.position,
        factor * recording.force,
        direction=recording.direction,
        units=dict(recording.units),
    )


def test_the_model_of_several_recordings_is_as_exact_as_that_of_all_their_rows() -> None:
    seen, model = recordings(6), of_six_recordings()
    position = np.concatenate([each.position for each in seen])
    force = np.concatenate([each.force for each in seen])
    of_rows = identify(position, force, direction=np.ones(len(force)))
    assert model.stop_reason == of_rows.stop_reason == "bic"
    assert model.fit.nrmse == pytest.approx(of_rows.fit.nrmse, rel=0.01)


@pytest.mark.full
def test_the_check_estimates_error_and_coverage_of_unseen_recordings() -> None:
    found = []
    for seed in range(4 if SCALE == 1 else 10):
        seen, unseen = np.split(np.array(recordings(16, seed=seed, rows=600), dtype=object), 2)
        model = identify(list(seen))
        assert model.band is not None
        verified = [verify(model, each) for each in unseen]
        inside = np.mean([each.within_band for each in verified])
        square = np.mean([each.mse for each in verified])
        found.append((inside, model.band.coverage, square, model.band.unseen_error**2))
    inside, coverage, square, expected = np.mean(np.array(found, dtype=float), axis=0)
    assert 0.92 < inside < 0.98
    assert 0.92 < coverage < 0.98
    assert expected == pytest.approx(square, rel=0.4)


def test_one_recording_has_no_band() -> None:
    (only,) = recordings(1)
    model = identify(only)
    assert model.band is None
    assert verify(model, only).within_band is None
    assert identify([only, only]).band is None


def test_cycles_at_the_same_settings_do_not_show_the_force_between_them() -> None:
    """The wall begins between the last two settings of a linear stage, which every cycle repeats."""
    x = np.round(np.linspace(0.0, 9.9, 20), 2)
    x = np.tile(np.append(x, x[-2::-1]), 2)
    side = np.tile(np.append(np.ones(20), -np.ones(19)), 2)
    force = 3.0 + 0.45 * x + (0.5 + 0.05 * x) * side + 120.0 * np.maximum(x - 9.5, 0.0)
    model = identify(1e-3 * x, force + np.random.default_rng(1).normal(0.0, 0.02, len(x)))
    assert model.verdict.level == "usable"
    assert any("left out of the fit" in each.sentence for each in model.verdict.findings)


def test_recordings_of_different_strokes_have_no_band() -> None:
    x = np.linspace(0.0, 1.0, 200)
    press = Recording.from_arrays(x, 2.0 * x, direction=np.ones(200))
    release = Recording.from_arrays(x[::-1], 1.5 * x[::-1], direction=-np.ones(200))
    model = identify([press, release])
    assert model.band is None
    assert NO_BAND in model.notes["identification"]


@pytest.mark.full
def test_recordings_of_different_speeds_keep_their_damping() -> None:
    random = np.random.default_rng(0)
    made = []
    for seconds in (0.3, 1.2) if SCALE == 1 else (0.4, 1.0, 3.0):
        time = np.arange(0.0, seconds, 1e-3)
        x = 0.005 - 0.005 * np.cos(2.0 * np.pi * time / seconds)
        velocity = np.gradient(x, time)
        force = 300.0 * x + 0.3 * np.sin(600.0 * x) + 4.0 * velocity + random.normal(0.0, 0.002, len(x))
        made.append(Recording.from_arrays(x, force, time, units={"position": "m", "force": "N"}))
    model = identify(made)
    assert model.damping is not None or "velocity" in model.inputs
    assert verify(model, made[-1]).nrmse < 0.005


def test_objects_give_the_band_of_a_further_object() -> None:
    groups = [recordings(3, spread=0.005, seed=k) for k in range(4)]
    groups = [[stiffer(each, 1.0 + 0.05 * k) for each in group] for k, group in enumerate(groups)]
    band = identify(objects=groups).band
    assert band is not None
    assert band.repeat is not None
    assert band.object is not None
    assert (band.recordings, band.objects) == (12, 4)
    assert (band.object > 3.0 * band.repeat).all()
    assert band.coverage is not None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "recording is missing"),
        ({"recording": "a.csv", "objects": [["b.csv"]]}, "recording and objects are given"),
        ({"objects": []}, "must be a list"),
        ({"objects": ["a.csv"]}, r"objects\[0\] is"),
    ],
)
def test_wrong_objects_are_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        identify(**arguments)  # type: ignore[arg-type]


def test_a_recording_of_another_object_is_outside_the_band() -> None:
    *_, other = recordings(7)
    model = of_six_recordings()
    verified = verify(model, stiffer(other, 1.5))
    assert verified.within_band is not None
    assert verified.within_band < 0.2
    assert "rows lie in the band" in str(verified.verdict)


def test_forces_of_any_size_have_the_same_band() -> None:
    tiny = [stiffer(each, 2.0**-90) for each in recordings(6)]
    band, scaled = of_six_recordings().band, identify(tiny).band
    assert band is not None
    assert scaled is not None
    np.testing.assert_allclose(scaled.outer, 2.0**-90 * band.outer, rtol=1e-6)


def test_measured_silicone_needs_at_most_20_parameters(data: Path) -> None:
    """Five repeats of one sample; the fifth is not used."""
    files = sorted((data / "silicone_compression").glob("EF30_0T_A*.csv"))
    *seen, unseen = (palpate.read_recording(path) for path in files)
    model = identify(seen)
    assert 11 <= model.n_parameters <= 20
    assert model.band is not None
    assert verify(model, unseen).rmse < 2.0 * model.band.unseen_error
