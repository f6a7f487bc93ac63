# SPDX-License-Identifier: Apache-2.0
"""palpate identify: written and printed results, and one clear sentence for every wrong input."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from conftest import sampled
from imperfect import knob, loop, press_and_release
from palpate import IdentifyOptions, Recording, load_model, read_recording
from palpate.cli.main import main, palpate
from palpate.recording.sample import sample_recording

JSON_FIELDS = [
    "model",
    "n_wavelets",
    "n_parameters",
    "model_class",
    "stop_reason",
    "nrmse",
    "settled_nrmse",
    "verdict",
    "seconds",
    "roles",
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def spring(path: Path, *, n: int = 400, seed: int = 0) -> Path:
    """Writes a recording of a spring of 3 N*m/rad with a little force noise."""
    random = np.random.default_rng(seed)
    position = random.uniform(0.0, 1.0, n)
    force = 3.0 * position + random.normal(0.0, 0.01, n)
    return Recording.from_arrays(position, force, units={"position": "rad", "force": "N*m"}).write(path)


def test_the_written_model_can_be_loaded(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spring(folder / "a.csv")
    assert main(["identify", "a.csv", "-o", "m.json"]) == 0
    model = load_model(folder / "m.json")
    assert model.slope(0.5) == pytest.approx(3.0, rel=0.02)
    captured = capsys.readouterr()
    assert captured.err.splitlines()[0].startswith("read a.csv: 400 rows; ")
    assert "position_rad" in captured.err.splitlines()[0]
    assert ": linear, 0 wavelets, 2 parameters" in captured.out
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv", "m.json"]


def test_json_is_one_object_with_the_fields_of_the_contract(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spring(folder / "a.csv")
    assert main(["identify", "a.csv", "-o", "m.json", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    model = load_model(folder / "m.json")
    assert list(result) == JSON_FIELDS
    assert result["model"] == "m.json"
    assert (result["n_wavelets"], result["n_parameters"]) == (model.n_wavelets, model.n_parameters)
    assert (result["model_class"], result["stop_reason"]) == (model.fit.model_class, model.stop_reason)
    assert result["nrmse"] == model.fit.nrmse
    assert result["seconds"] > 0


@pytest.mark.full
def test_only_rows_with_a_velocity_are_held_out_for_a_model_over_velocity(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every fifth row of 100 Hz alone gives no velocity, so velocity is computed before rows are held out."""
    time = 0.01 * np.arange(2000)
    position = 0.3 - 0.3 * np.cos(2.0 * np.pi * 0.5 * time)
    speed = np.gradient(position, time)
    force = np.sin(4.0 * position) * (1.0 + speed) + np.random.default_rng(0).normal(0.0, 0.01, len(time))
    recording = Recording.from_arrays(position, force, time, units={"position": "rad", "force": "N*m"})
    recording.write(folder / "a.csv")
    arguments = ["identify", "a.csv", "-o", "m.json", "--inputs", "position,velocity"]
    assert main([*arguments, "--hold-out-every", "5", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["nrmse"] < 0.03
    assert 300 < result["held_out_rows"] < 400
    assert main([*arguments, "--hold-out-every", "5"]) == 0
    assert f"{result['held_out_rows']} of 400 rows held out" in capsys.readouterr().out


def test_held_out_rows_receive_the_verdict_of_verify(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only the held-out rows have a force other than 0, so the model is a constant and its verdict is no."""
    position = np.linspace(0.0, 1.0, 400)
    force = np.where(np.arange(400) % 5 == 4, 3.0 * position, 0.0)
    Recording.from_arrays(position, force, units={"position": "rad", "force": "N*m"}).write(folder / "a.csv")
    assert main(["identify", "a.csv", "-o", "m.json", "--hold-out-every", "5", "--json"]) == 1
    verdict = json.loads(capsys.readouterr().out)["verdict"]
    assert "the NRMSE on 80 held-out rows is" in verdict
    assert "a hand feels the difference on" in verdict


def test_the_error_is_computed_on_the_held_out_rows(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = read_recording(spring(folder / "a.csv"))
    assert main(["identify", "a.csv", "-o", "m.json", "--hold-out-every", "5", "--json"]) == 0
    model = load_model(folder / "m.json")
    held_out = np.arange(len(recording)) % 5 == 4
    error = model.force(recording.position[held_out]) - recording.force[held_out]
    expected = np.sqrt(np.mean(error**2)) / np.std(recording.force[held_out])
    result = json.loads(capsys.readouterr().out)
    assert result["nrmse"] == pytest.approx(expected, rel=1e-9)
    assert result["held_out_rows"] == 80
    assert model.data.held_out_every == 5


def test_several_recordings_give_one_model(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for seed, name in enumerate(["a.csv", "b.csv"]):
        spring(folder / name, seed=seed)
    assert main(["identify", "a.csv", "b.csv", "-o", "m.json", "--plot", "m.png"]) == 0
    assert set(load_model(folder / "m.json").data.files) == {"a.csv", "b.csv"}
    assert (folder / "m.png").read_bytes().startswith(b"\x89PNG")


def test_columns_units_and_signs_are_options(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    position = np.linspace(0.0, 5.0, 100)
    table = "\n".join(f"{a!r},{-2.0 * a!r},{a!r}" for a in position.tolist())
    (folder / "a.csv").write_text(f"depth,load,other_mm\n{table}\n")
    arguments = ["identify", "a.csv", "-o", "m.json", "--position", "depth", "--force", "load"]
    arguments += ["--units", "depth=mm", "--units", "load=N", "--negate", "force", "--rows", "10:90"]
    assert main(arguments) == 0
    model = load_model(folder / "m.json")
    assert model.units == {"position": "m", "force": "N"}
    assert model.slope(0.0025) == pytest.approx(2000.0, rel=1e-6)
    assert model.data.rows == 80


def test_rows_without_a_number_can_be_dropped(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "a.csv").write_text("\n".join([HEADER, *ROWS, "nan,1.0"]))
    assert main(["identify", "a.csv", "-o", "m.json", "--invalid", "drop"]) == 0
    assert load_model(folder / "m.json").data.rows == len(ROWS)


def test_notes_of_the_identification_are_printed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    position = np.concatenate([np.linspace(0.0, 1.0, 200), np.full(5, 1.0), np.linspace(1.0, 0.0, 200)])
    direction = np.repeat([1, 0, -1], [200, 5, 200])
    Recording.from_arrays(position, 3.0 * position + 0.2 * direction, direction=direction).write(
        folder / "a.csv"
    )
    assert main(["identify", "a.csv", "-o", "m.json", "--verbose"]) == 0
    stored = load_model(folder / "m.json").notes
    notes = [*stored["rows"], *stored["identification"]]
    assert stored["rows"]
    details = " ".join(capsys.readouterr().out.split())
    assert all(" ".join(note.split()) in details for note in notes)


def test_the_line_on_rows_explains_every_row_without_an_error(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(4)
    way, stroke = np.linspace(-400.0, -0.2, 40, endpoint=False), np.linspace(-0.2, 4.0, 1000)
    position = np.concatenate([way, stroke, np.full(60, 4.0), stroke[::-1], way[::-1]])
    force = np.maximum(12.0 * position, 0.0) + 8.0 * np.maximum(position - 2.0, 0.0)
    force += rng.normal(0.0, 0.05, len(force))
    force[[500, 1500]] = 1e3
    again = np.repeat(np.arange(len(force)), 2)
    Recording.from_arrays(position[again], force[again]).write(folder / "a.csv")
    assert main(["identify", "a.csv", "-o", "m.json"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    used, given = map(int, re.findall(r"on (\d+) of (\d+) rows", printed)[0])
    counts = re.findall(r"(\d+) of \d+ rows (?:dropped \()?(repeats|wrong|far|are not fitted)", printed)
    assert [reason for _, reason in counts] == ["repeats", "wrong", "far", "are not fitted"]
    assert sum(int(count) for count, _ in counts) == given - used


def test_a_torque_constant_converts_current_to_torque(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    position = np.linspace(0.0, 1.0, 50).tolist()
    (folder / "a.csv").write_text("angle_rad,current_A\n" + "\n".join(f"{a!r},{a!r}" for a in position))
    assert main(["identify", "a.csv", "-o", "m.json", "--torque-constant-Nm-per-A", "0.5"]) == 0
    model = load_model(folder / "m.json")
    assert model.units["force"] == "N*m"
    assert model.slope(0.5) == pytest.approx(0.5, rel=1e-6)


def test_every_identification_setting_is_an_option_with_its_default() -> None:
    captured = CliRunner().invoke(palpate, ["identify", "--help"]).output
    for each in fields(IdentifyOptions):
        assert "--" + each.name.replace("_", "-") in captured
    assert f"[default: {IdentifyOptions().max_wavelets}]" in captured


def test_settings_reach_the_identification(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sample_recording(3, 5.0).write(folder / "a.csv")
    arguments = ["identify", "a.csv", "-o", "m.json", "--max-wavelets", "2", "--inputs", "position"]
    assert main([*arguments, "--slope-bounds", "-5", "30", "--search", "patience=2"]) == 0
    model = load_model(folder / "m.json")
    assert model.n_wavelets <= 2
    assert model.slope(np.linspace(-0.2, 0.469, 2001)).max() <= 30.0 * (1 + 1e-6)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--max-wavelets", "-1"], "max_wavelets is -1"),
        (["--max-wavelets", "many"], "'many' is not a valid integer"),
        (["--criterion", "unknown"], "'unknown' is not one of"),
        (["--slope-bounds", "3", "1"], "slope_bounds is (3.0, 1.0)"),
        (["--inputs", "mood"], "mood"),
        (["--hold-out-every", "1"], "--hold-out-every"),
        (["--units", "mm"], "must be NAME=UNIT"),
        (["--units", "position_rad=parsec"], "parsec"),
        (["--rows", "10"], "must be START:STOP"),
        (["--position", "depth"], "no column 'depth'"),
        (["--search", "play_radius=wide"], "play_radius is 'wide': must be numbers joined by commas"),
        (["--search", "unknown=1"], "search has no setting 'unknown'"),
        (["--search", "patience"], "must be NAME=VALUE"),
        (["--period", "15parsec"], "'15parsec' must be a number in m or rad, or a number and a unit (m, mm"),
        (["--period", "deg"], "'deg' must be a number"),
        (["--period", "15ms"], "'15ms' must be a number"),
        (["--period", "2.5mm"], "--period is in m and the position in rad"),
        (["--period", "0deg"], "period is 0.0: must be a finite number > 0"),
        (["--plot", "m.doc"], "is not a figure file"),
        (["--plot", "m.json"], "is not a figure file"),
        (["--plot", "nowhere/m.png"], "there is no folder nowhere"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_usage_is_reported_in_one_sentence_and_writes_nothing(
    arguments: list[str], sentence: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spring(folder / "a.csv")
    assert main(["identify", "a.csv", "-o", "m.json", "--json", *arguments]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert sentence in error
    assert "\n" not in error
    assert [path.name for path in folder.iterdir()] == ["a.csv"]


HEADER = "position_rad,torque_Nm"
ROWS = [f"{0.1 * k},{0.3 * k}" for k in range(20)]

BAD_FILES = {
    "no such file": (None, "there is no file a.csv"),
    "empty": ("", "a.csv is empty"),
    "header only": (f"{HEADER}\n", "a.csv"),
    "one column": ("position_rad\n" + "0.1\n" * 20, "one column"),
    "no units": ("x,y\n" + "0.1,0.2\n" * 20, "--units"),
    "NaN": ("\n".join([HEADER, *ROWS, "nan,1.0"]), "line 22"),
    "inf": ("\n".join([HEADER, *ROWS, "0.5,inf"]), "line 22"),
    "text in a number": ("\n".join([HEADER, *ROWS, "0.5,soft"]), "soft"),
    "all positions equal": ("\n".join([HEADER, *["0.1,0.2"] * 20]), "position"),
    "3 rows": ("\n".join([HEADER, *ROWS[:3]]), "3"),
    "no text at all": ("\x00\xff", "a.csv"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_bad_recording_is_reported_in_one_sentence(
    case: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content, expected = BAD_FILES[case]
    if content is not None:
        (folder / "a.csv").write_bytes(content.encode("latin-1"))
    assert main(["identify", "a.csv", "-o", "m.json"]) == 2
    captured = capsys.readouterr()
    sentence = captured.err.splitlines()[-1]
    assert sentence.startswith("error: ")
    assert "a.csv" in sentence
    assert expected in sentence
    assert captured.out == ""
    assert not (folder / "m.json").exists()


def in_a_missing_folder(folder: Path) -> str:
    return "nowhere/m.json"


def below_a_file(folder: Path) -> str:
    return "a.csv/m.json"


def in_proc(folder: Path) -> str:
    return "/proc/m.json"


def over_the_input(folder: Path) -> str:
    return "a.csv"


def over_the_figure(folder: Path) -> str:
    return "m.png"


@pytest.mark.parametrize(
    "target", [in_a_missing_folder, below_a_file, in_proc, over_the_input, over_the_figure]
)
def test_an_output_that_cannot_be_written_is_refused_before_the_work(
    target: Callable[[Path], str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spring(folder / "a.csv")
    content_before = (folder / "a.csv").read_bytes()
    assert main(["identify", "a.csv", "-o", target(folder), "--plot", "m.png"]) == 2
    captured = capsys.readouterr()
    assert "identifying" not in captured.err
    assert "read a.csv" not in captured.err
    assert captured.err.count("\n") == 1
    assert (folder / "a.csv").read_bytes() == content_before


def test_ctrl_c_ends_with_130_and_writes_nothing(folder: Path) -> None:
    sample_recording(1).write(folder / "a.csv")
    with subprocess.Popen(
        [sys.executable, "-m", "palpate", "identify", "a.csv", "-o", "m.json"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("identifying"):
                process.send_signal(signal.SIGINT)
                break
        output, messages = process.communicate()
    assert process.returncode == 130
    assert output == ""
    assert messages == "error: interrupted; nothing was written\n"
    assert [path.name for path in folder.iterdir()] == ["a.csv"]


def test_an_output_that_is_not_a_model_file_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sample_recording(1).write(folder / "a.csv")
    assert main(["identify", "a.csv", "-o", "x.csv"]) == 2
    assert "x.csv is not a model file: its name must end in .json" in capsys.readouterr().err
    assert [path.name for path in folder.iterdir()] == ["a.csv"]


def test_recordings_of_objects_give_bands_of_repeats_and_of_objects(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for seed, name in enumerate(("a1", "a2", "b1", "b2", "c1")):
        spring(folder / f"{name}.csv", seed=seed)
    given = ["--object", "a1.csv", "a2.csv", "--object", "b1.csv", "b2.csv", "--object", "c1.csv"]
    assert main(["identify", *given, "-o", "m.json", "--json"]) == 0
    band = load_model("m.json").band
    assert band is not None
    assert (band.recordings, band.objects) == (5, 3)
    assert band.repeat is not None
    assert json.loads(capsys.readouterr().out)["unseen_error"] == band.unseen_error
    main(["identify", "a1.csv", "a2.csv", "b1.csv", "-o", "one.json"])
    assert "on each recording left out of the fit" in capsys.readouterr().out
    model = load_model("one.json")
    assert model.band is not None
    assert model.band.objects == 1


@pytest.mark.parametrize(
    "given", [["a.csv", "--object", "b.csv"], ["--object", "a.csv", "--object"], ["--object"]]
)
def test_files_without_object_and_objects_without_files_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], given: list[str]
) -> None:
    spring(folder / "a.csv")
    spring(folder / "b.csv", seed=1)
    assert main(["identify", "-o", "m.json", *given]) == 2
    assert "error: " in capsys.readouterr().err
    assert not (folder / "m.json").exists()


def test_a_file_read_by_parts_belongs_to_no_object(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spring(folder / "a.csv")
    assert main(["identify", "--object", "a.csv", "-o", "m.json", "--out-of-core"]) == 2
    assert "--object needs all rows at once" in capsys.readouterr().err


def test_a_late_force_is_found_and_its_correction_improves_the_model(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    time, random = 4e-3 * np.arange(750), np.random.default_rng(0)
    speed = 2.0 * np.pi * np.where(time < 1.5, 2.0 / 3.0, 4.0 / 3.0)
    position = 2e-3 * (1.0 - np.cos(4e-3 * np.cumsum(speed)))
    wall = 300.0 * position + 4000.0 * np.maximum(position - 2.4e-3, 0.0)
    force = np.interp(time - 0.02, time, wall) + random.normal(0.0, 0.005, len(time))
    Recording.from_arrays(position, force, time).write(folder / "a.csv")

    def printed(*options: str) -> str:
        assert main(["identify", "a.csv", "-o", "m.json", *options]) == 0
        return " ".join(capsys.readouterr().out.split())

    advised = re.search(r"press and release are shifted .* give --force-late-s (\d\S+) ", printed())
    assert advised
    assert float(advised[1]) == pytest.approx(0.02, rel=0.05)
    corrected = printed("--force-late-s", advised[1])
    assert corrected.startswith("verdict: good")
    assert f"force lag {1e3 * float(advised[1]):.3g} ms corrected" in corrected
    assert main(["identify", "a.csv", "-o", "m.json", "--force-late-s", "soon"]) == 2
    assert "'soon' is not a valid float" in capsys.readouterr().err


def knob_file(path: Path) -> Path:
    """Writes two turns of a knob with 24 detents, with a pause at the end, in deg and mNm."""
    angle = press_and_release(600, 720.0)
    angle = np.insert(angle, [600] * 100, 720.0)
    way = np.repeat([1.0, 0.0, -1.0], [600, 100, 600])
    torque = knob(angle) + 2.5 * way + np.random.default_rng(1).normal(0.0, 0.25, len(angle))
    rows = (f"{x:.4f},{f:.4f}" for x, f in zip(angle, torque, strict=True))
    path.write_text("\n".join(["angle_deg,torque_mNm", *rows, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text", sampled(["15 deg", "15deg", "15\u00b0", "0.2617993877991494", "0.2617993877991494rad"], "15 deg")
)
def test_a_period_has_a_unit_or_is_in_si(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    knob_file(folder / "knob.csv")
    assert main(["identify", "knob.csv", "-o", "m.json", "--period", text]) == 0
    assert load_model(folder / "m.json").period == pytest.approx(np.radians(15.0), rel=1e-12)
    assert "period               the force repeats every 15 deg\n" in capsys.readouterr().out


def test_a_period_that_is_found_and_rows_that_wait_are_printed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    knob_file(folder / "knob.csv")
    assert main(["identify", "knob.csv", "-o", "m.json"]) == 0
    printed = capsys.readouterr().out
    (rows,) = (line for line in printed.splitlines() if line.startswith("rows "))
    waiting = int(rows.split()[1])
    assert waiting == pytest.approx(100, abs=5)
    assert rows == f"rows                 {waiting} of 1300 rows are not fitted: {waiting} wait in contact"
    assert "period               the force repeats every 15 deg\n" in printed
    assert "outside" not in printed


def press_file(path: Path) -> Path:
    """Writes a press and a release in mm with two wrong readings and a wait before them."""
    x = press_and_release()
    f = loop(x) + np.random.default_rng(0).normal(0.0, 0.05, len(x))
    f[50], f[60] = 0.0, 200.0
    x, f = np.concatenate([np.zeros(155), x]), np.concatenate([np.zeros(155), f])
    rows = (f"{a:.4f},{b:.4f}" for a, b in zip(x, f, strict=True))
    path.write_text("\n".join(["position_mm,force_N", *rows, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("arguments", "below", "above"),
    [
        ([], "falls to zero (the tool leaves)", "continues straight with {above:.4g} N/mm"),
        (
            ["--below", "linear", "--above", "free"],
            "continues straight with {below:.4g} N/mm",
            "falls to zero (the tool leaves)",
        ),
    ],
)
def test_the_summary_names_rows_that_were_left_out_and_the_force_outside(
    arguments: list[str], below: str, above: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    press_file(folder / "press.csv")
    assert main(["identify", "press.csv", "-o", "m.json", *arguments]) == 0
    printed = capsys.readouterr().out
    assert (
        "rows                 154 of 455 rows dropped (repeats of the previous reading). 2 of 455 rows "
        "dropped (wrong readings): row 205: 0 N at 1.342 mm, row 215: 200 N at 1.611 mm. "
        "2 of 299 rows are not fitted: 2 wait in air\n"
    ) in printed
    model = load_model("m.json")
    slope = {side: 1e-3 * model.slope(at, direction=1.0) for side, at in (("below", -1.0), ("above", 1.0))}
    assert f"outside              below 0 mm: {below}; above 4 mm: {above}\n".format(**slope) in printed
