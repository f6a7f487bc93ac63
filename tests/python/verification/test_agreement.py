# SPDX-License-Identifier: Apache-2.0
"""Two models beside each other: what a hand would notice."""

from pathlib import Path

import numpy as np
import pytest

from palpate import InputError, Model, Recording, identify
from palpate.cli.main import main
from palpate.verification import compare


def spring(stiffness: float, reach: float = 1.0, loss: float = 0.0) -> Model:
    x = np.concatenate([np.linspace(0, reach, 100), np.linspace(reach, 0, 100)])
    direction = np.repeat([1, -1], 100)
    force = stiffness * x + loss * direction
    return identify(Recording.from_arrays(x, force, direction=direction if loss else None))


def test_a_difference_counts_in_just_noticeable_ones() -> None:
    (stroke,) = compare(spring(10.0), spring(10.35))
    assert stroke.name == ""
    # 3.5 % of the force, where 7 % are just noticeable; near zero force 1 % of the largest is.
    assert stroke.worst == pytest.approx(0.5, rel=1e-6)
    assert stroke.perceptible[0] == pytest.approx(0.1, rel=1e-6)
    (same,) = compare(spring(10.0), spring(10.0))
    assert same.worst == pytest.approx(0.0, abs=1e-9)


def test_strokes_are_told_apart_where_one_of_the_models_does() -> None:
    press, release = compare(spring(10.0), spring(10.0, loss=0.2))
    assert (press.name, release.name) == ("press", "release")
    assert np.max(press.second - press.first) == pytest.approx(0.2, rel=1e-6)
    assert np.max(release.second - release.first) == pytest.approx(-0.2, rel=1e-6)


def test_models_are_compared_where_both_know_something() -> None:
    (stroke,) = compare(spring(10.0, reach=0.5), spring(10.0))
    assert (stroke.position[0], stroke.position[-1]) == (0.0, 0.5)
    x = np.linspace(2.0, 3.0, 100)
    with pytest.raises(InputError, match="share no position"):
        compare(spring(10.0), identify(Recording.from_arrays(x, 10.0 * x)))


def test_show_prints_and_draws_two_models(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, two, picture = (str(tmp_path / name) for name in ("one.json", "two.json", "both.png"))
    spring(10.0).save(one)
    spring(10.35).save(two)
    assert main(["show", one, "--beside", two, "--plot", picture]) == 0
    assert "0.5" in capsys.readouterr().out
    assert Path(picture).read_bytes().startswith(b"\x89PNG")


def test_show_draws_every_network_that_was_considered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, picture = str(tmp_path / "one.json"), str(tmp_path / "path.png")
    model = spring(10.0)
    model.save(one)
    assert main(["show", one, "--plot", picture]) == 0
    assert capsys.readouterr().out.strip() == str(model).strip()
    assert Path(picture).read_bytes().startswith(b"\x89PNG")
