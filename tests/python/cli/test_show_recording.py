# SPDX-License-Identifier: Apache-2.0
"""Tests of `palpate show` for a recording: recognition, printed properties, views."""

import json
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest

from conftest import sampled
from models_by_hand import model_by_hand
from palpate import Recording, read_recording
from palpate.cli.main import main
from palpate.plotting import plot
from palpate.recording.sample import sample_recording


@pytest.fixture
def timed(tmp_path: Path) -> Path:
    return sample_recording(seed=1, duration_s=5.0).write(tmp_path / "timed.csv")


@pytest.fixture
def strokes(tmp_path: Path) -> Path:
    """Writes two presses and one release of a spring without time, in mm and gf."""
    x = np.concatenate([np.linspace(0.0, 4.0, 60), np.linspace(4.0, 0.0, 60), np.linspace(0.0, 3.0, 50)])
    rows = (f"{each:.4f},{50.0 * each:.4f}" for each in x)
    path = tmp_path / "strokes.csv"
    path.write_text("\n".join(["depth_mm,load_gf", *rows, ""]), encoding="utf-8")
    return path


def printed(capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    lines = capsys.readouterr().out.splitlines()
    return {line.split("  ")[0]: line.split("  ", 1)[1].strip() for line in lines if "  " in line.strip()}


def test_a_recording_with_time_prints_verdict_rows_ranges_and_rate(
    timed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", str(timed)]) == 0
    output = capsys.readouterr().out
    assert output.startswith("verdict: good\n")
    for text in (
        "rows     5000 of 5000 in the file: 5000 move\n",
        "position 'position_rad'",
        "4.999 s at 1000 Hz, 0 gaps",
    ):
        assert text in output
    assert " N*m, time" in output
    assert "missing  nothing" in output


def test_a_recording_without_time_prints_strokes_in_the_units_of_the_file(
    strokes: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", str(strokes)]) == 0
    shown = printed(capsys)
    assert shown["ranges"] == "position 0 to 4 mm, force 0 to 200 gf"
    assert shown["missing"] == "no time, so no velocity, damping or memory"
    assert shown["strokes"] == (
        "2 press, 1 release, from the order of the rows; --part 'cycle N' reads one: cycle 1 (rows 0 to 119) "
        "to cycle 2 (rows 120 to 169)"
    )


def test_json_has_the_same_properties(strokes: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(strokes), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"].partition(":")[0] in ("good", "usable")
    assert found["rows"] == 170
    assert found["units"] == {"position": "m", "force": "N"}
    assert found["position"] == pytest.approx([0.0, 4e-3])
    assert found["strokes"] == {"press": 2, "release": 1}
    assert found["rate_hz"] is None
    assert found["roles"] == {"move": 170}


def test_json_counts_the_rows_of_each_role(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    depth = np.concatenate([np.linspace(0.0, 4.0, 200), np.full(60, 4.0), np.linspace(4.0, 0.0, 200)])
    load = 50.0 * depth
    load[100] = 5000.0
    path = tmp_path / "hold.csv"
    pd.DataFrame({"depth_mm": depth, "load_gf": load}).to_csv(path, index=False)
    assert main(["show", str(path), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)["roles"]
    assert shown == {"move": 397, "wait in contact": 62, "wrong reading": 1}
    assert main(["identify", str(path), "-o", str(tmp_path / "m.json"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["roles"] == shown
    assert main(["identify", str(path), "-o", str(tmp_path / "m.json")]) == 0
    assert "on 397 of 460 rows" in printed(capsys)["error"]


@pytest.mark.parametrize("name", sampled(["timed", "strokes"], "strokes"))
def test_the_views_are_drawn(
    name: str, timed: Path, strokes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture, frame = tmp_path / "views.png", tmp_path / "frame.svg"
    file = {"timed": timed, "strokes": strokes}[name]
    figures = ["--plot", str(picture), "--plot-frame", str(frame), "--voices", "1"]
    assert main(["show", str(file), *figures]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in frame.read_bytes()
    missing = "the recording has no time, so no frequency is known in Hz"
    assert (missing in " ".join(capsys.readouterr().out.split())) == (name == "strokes")


@pytest.mark.full
def test_the_frame_of_a_model_is_drawn(tmp_path: Path) -> None:
    model, frame = model_by_hand().save(tmp_path / "m.json"), tmp_path / "frame.png"
    assert main(["show", str(model), "--plot-frame", str(frame)]) == 0
    assert frame.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", sampled(["model", "recording"], "model"))
def test_the_figure_of_the_frame_has_the_given_settings(name: str, timed: Path, tmp_path: Path) -> None:
    file = timed if name == "recording" else model_by_hand().save(tmp_path / "m.json")
    frame = tmp_path / "frame.svg"
    with mpl.rc_context({"svg.fonttype": "none"}):  # text as text
        settings = ["--a0", "1.5", "--b0", "0.75", "--voices", "3,5"]
        assert main(["show", str(file), "--plot-frame", str(frame), *settings]) == 0
    drawn = frame.read_text(encoding="utf-8")
    for text in ("bounds, a0 = 1.5: A grey, B black", "grid, a0 = 1.5, b0 = 0.75", "3 voices", "5 voices"):
        assert text in drawn
    assert "4 voices" not in drawn


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["--a0", "1"], "a0, the ratio of neighbouring dilations, is 1.0: must be a finite number > 1"),
        (["--b0", "0"], "b0, the translation step, is 0.0: must be a finite number > 0"),
        (["--voices", "0"], "voices is 0: must be a whole number >= 1"),
        (["--voices", "1,2,3,4,5"], "voices has 5 values: must have 1 to 4"),
        (["--voices", "two"], "'two' must be whole numbers separated by commas, such as 1,2,4"),
    ],
)
def test_settings_of_the_frame_out_of_range_are_refused(
    settings: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, frame = model_by_hand().save(tmp_path / "m.json"), tmp_path / "frame.png"
    assert main(["show", str(model), "--plot-frame", str(frame), *settings]) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not frame.exists()


def test_settings_of_the_frame_without_its_figure_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand().save(tmp_path / "m.json")
    assert main(["show", str(model), "--b0", "1"]) == 2
    assert "--b0 is a setting of the figure --plot-frame PNG" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("rows", sampled([9, 10, 11], 9))
def test_a_recording_of_few_rows_is_refused_or_drawn(
    rows: int, tmp_path: Path, csv_file: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    file = csv_file("depth_mm,load_N", [f"{k},{k * k}" for k in range(rows)])
    code = main(["show", str(file), "--plot", str(tmp_path / "views.png")])
    assert code == (2 if rows < 10 else 0), capsys.readouterr().err
    assert (tmp_path / "views.png").exists() == (rows >= 10)


def test_a_model_without_the_usual_suffix_is_not_read_as_a_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "model.txt"
    copy.write_text(model_by_hand().save(tmp_path / "m.json").read_text(encoding="utf-8"), encoding="utf-8")
    main(["show", str(copy)])
    assert "a recording is" not in capsys.readouterr().err


def test_a_finding_sets_the_verdict_of_a_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    x = np.concatenate([np.linspace(0.0, 1e-3, 200), np.linspace(3e-3, 4e-3, 200)])
    recording = Recording.from_arrays(x, 500.0 * x, units={"position": "m", "force": "N"})
    assert main(["show", str(recording.write(tmp_path / "gap.csv"))]) == 0
    assert capsys.readouterr().out.startswith("verdict: usable\n  the recording has no rows from")


@pytest.mark.full
def test_measured_recordings_of_all_kinds_are_drawn(data: Path, tmp_path: Path) -> None:
    for number, name in enumerate(
        [
            "keyswitches/clicky__cherry_mx_blue.csv",
            "rubber_domes/topre_r1_55g__run1.csv",
            "motor_cogging/map_b_16.csv",
            "organ_probing/meat0904_region4.csv",
            "afm_indentation/cellhesion_force_distance.csv",
            "silicone_compression/EF30_0T_A3.csv",
        ]
    ):
        picture = tmp_path / f"{number}.png"
        assert main(["show", str(data / name), "--plot", str(picture)]) == 0
        assert picture.stat().st_size > 50_000


def waiting(path: Path) -> Path:
    """Writes an approach through air, a press, a hold and a release in mm and N."""
    x = np.concatenate([np.linspace(-40.0, 4.0, 4400), np.full(100, 4.0), np.linspace(4.0, -1.0, 500)])
    rows = (f"{each:.4f},{50.0 * max(each, 0.0):.4f}" for each in x)
    path.write_text("\n".join(["depth_mm,load_N", *rows, ""]), encoding="utf-8")
    return path


def test_the_roles_of_the_rows_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(waiting(tmp_path / "held.csv"))]) == 0
    roles = printed(capsys)["rows"].partition(": ")[2].split(", ")
    assert [each.split(" ", 1)[1] for each in roles] == ["move", "wait in contact", "approach"]
    counts = [int(each.split(" ", 1)[0]) for each in roles]
    # The contact is known to one block of rows: the square root of their number.
    assert counts == pytest.approx([880, 100, 4020], abs=71)
    assert sum(counts) == 5000


def test_rows_of_each_role_have_a_colour(tmp_path: Path) -> None:
    axes = plot(read_recording(waiting(tmp_path / "held.csv")))
    dots = {str(line.get_label()): line for line in axes.get_lines()}
    assert list(dots) == ["recorded", "approach", "wait in contact"]
    assert len({line.get_color() for line in dots.values()}) == 3
    assert sum(len(line.get_xdata()) for line in dots.values()) == 5000  # type: ignore[arg-type]


def test_a_recording_without_waits_has_one_role(strokes: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(strokes)]) == 0
    assert printed(capsys)["rows"] == "170 of 170 in the file: 170 move"
