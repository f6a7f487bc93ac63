# SPDX-License-Identifier: Apache-2.0
"""Exports models of measured objects, and compares their tables with the core."""

import os
from pathlib import Path

import palpate
from palpate._core.portable import ExportedModel
from palpate._core.rendering import Scheme, default_play_radius

SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))

FEW = 2
"""Number of recordings at scale 1: the smallest ones that give a model."""


def recordings(data: Path) -> list[Path]:
    """Returns the recordings in the order of their size; at scale 1 only small ones."""
    files = sorted(data.rglob("*.csv"), key=lambda path: path.stat().st_size)
    return files if SCALE > 1 else files[: 10 * FEW]


def identified(path: Path) -> palpate.Model | None:
    """Returns the model of a recording; None if the file is not a recording of one position and force."""
    try:
        model = palpate.identify(palpate.read_recording(path))
    except (palpate.InputError, OSError):
        return None
    return model if model.dimension == 1 else None


def test_every_measured_model_is_within_its_proved_bounds(data: Path) -> None:
    compared = 0
    for path in recordings(data):
        model = identified(path)
        if model is None:
            continue
        step = (model.upper[0] - model.lower[0]) / 20_000.0
        scheme = Scheme(structure="direct", play_radius=default_play_radius(model, step))
        for precision in ("single", "double"):
            tables = ExportedModel(model, scheme, encoder_step=step, precision=precision)
            check = tables.check(2000)
            assert check.passed, (path, precision, check.force, check.slope, check.energy, check.step)
            if precision == "single":
                assert tables.force_error <= 1e-6 * tables.largest_force, path
                assert tables.slope_error <= 3e-5 * tables.largest_slope, path
        compared += 1
        if SCALE == 1 and compared == FEW:
            break
    assert compared >= FEW
    print(f"{compared} models of measured objects")
