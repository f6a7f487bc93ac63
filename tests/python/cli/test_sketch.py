# SPDX-License-Identifier: Apache-2.0
"""Sketch of the force curve in the terminal: size, axes, strokes, encoding, and when it is printed."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import Model
from palpate.cli.main import main
from palpate.cli.sketch import HEIGHT, WIDEST, sketch_of
from palpate.recording.units import UNITS
from test_cli_identify import spring

Terminal = Callable[..., str]


def keyswitch_sketch(*, columns: int = 80, unicode: bool = True) -> list[str]:
    return sketch_of(keyswitch_by_hand(), UNITS["mm"], UNITS["mN"], columns=columns, unicode=unicode)


def test_the_axes_have_numbers_in_the_units_of_the_file() -> None:
    model = keyswitch_by_hand()
    title, *area = keyswitch_sketch()
    assert title.strip() == "force [mN]"
    position = np.linspace(0.0, 0.004, 1001)
    press, release = (np.asarray(model.force(position, direction=side)) for side in (1, -1))
    assert float(area[0].split()[0]) == pytest.approx(1e3 * press.max(), rel=0.01)
    assert float(area[HEIGHT - 1].split()[0]) == pytest.approx(1e3 * release.min(), rel=0.01)
    assert area[HEIGHT + 1].split() == ["0", "position", "[mm]", "4"]


@pytest.mark.parametrize("unicode", [True, False])
@pytest.mark.parametrize("columns", [40, 50, 80, 200])
def test_a_sketch_fits_its_terminal(columns: int, unicode: bool) -> None:
    lines = keyswitch_sketch(columns=columns, unicode=unicode)
    assert len(lines) == HEIGHT + 4
    assert max(map(len, lines)) <= min(columns, WIDEST + 10)
    assert all(line.isascii() for line in lines) != unicode


def test_a_narrow_terminal_and_several_inputs_have_no_sketch() -> None:
    assert keyswitch_sketch(columns=39) == []
    two = Model.from_network(alpha=[[1.0, 1.0]], beta=[[0.0, 0.0]], weight=[1.0], lower=[0, 0], upper=[1, 1])
    assert sketch_of(two, UNITS["m"], UNITS["N"], columns=80, unicode=True) == []


def dots(lines: list[str]) -> int:
    """Returns the number of dots of the Braille patterns in a sketch."""
    return sum((ord(c) - 0x2800).bit_count() for line in lines for c in line if 0x2800 < ord(c) < 0x2900)


def test_press_is_a_solid_line_and_release_a_dotted_one() -> None:
    text = "\n".join(keyswitch_sketch(unicode=False))
    assert text.endswith("*: press, o: release")
    assert text.count("*") >= WIDEST
    assert text.count("o") > WIDEST // 2
    without = dict.fromkeys(("weight_hysteresis", "linear_hysteresis", "bias_hysteresis"))
    press = dots(sketch_of(keyswitch_by_hand(**without), UNITS["mm"], UNITS["mN"], columns=80, unicode=True))
    assert press >= 2 * WIDEST
    assert WIDEST // 3 < dots(keyswitch_sketch()) - press < WIDEST


def test_a_steep_curve_has_no_gaps() -> None:
    wall = model_by_hand(alpha=[[400.0]], weight=[5.0], linear=[0.0])
    area = sketch_of(wall, UNITS["rad"], UNITS["Nm"], columns=80, unicode=False)[1 : HEIGHT + 1]
    assert all("*" in line for line in area)


def test_a_constant_force_has_one_number() -> None:
    flat = model_by_hand(weight=[0.0], linear=[0.0], bias=2.0)
    area = sketch_of(flat, UNITS["rad"], UNITS["Nm"], columns=80, unicode=False)[1 : HEIGHT + 1]
    assert [line.split()[0] for line in area if line.split()[0] != "|"] == ["2"]
    assert sum("*" in line for line in area) == 1


@pytest.fixture
def recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    spring(tmp_path / "a.csv")
    return "a.csv"


def test_identify_sketches_on_a_terminal_only(
    recording: str, terminal: Terminal, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["identify", recording, "-o", "m.json"]
    on_terminal = terminal(lambda: main(command))
    assert "position [rad]" in on_terminal
    assert any(0x2800 < ord(c) < 0x2900 for c in on_terminal)
    assert "position [rad]" not in terminal(lambda: main([*command, "--no-sketch"]))
    assert "position [rad]" not in terminal(lambda: main([*command, "--quiet"]))
    main(command)
    assert "position [rad]" not in capsys.readouterr().out
    main([*command, "--sketch"])
    assert "position [rad]" in capsys.readouterr().out


def test_another_encoding_than_utf_8_gets_an_ascii_sketch(
    recording: str, terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def work() -> None:
        sys.stdout.reconfigure(encoding="latin-1")  # type: ignore[union-attr]
        main(["identify", recording, "-o", "m.json"])

    output = terminal(work)
    assert "position [rad]" in output
    assert output.isascii()
