# SPDX-License-Identifier: Apache-2.0
"""palpate report: written page, printed result, exit codes, and refused input."""

import json
import shutil
from pathlib import Path

import pytest

from models_by_hand import model_by_hand
from palpate import DeviceProfile
from palpate.cli.main import main
from palpate.verdict import Verdict, no
from test_cli_identify import spring


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Writes two recordings of a spring and a model of the first, and returns their folder."""
    folder = tmp_path_factory.mktemp("identified")
    spring(folder / "b.csv", seed=1)
    with pytest.MonkeyPatch.context() as context:
        context.chdir(folder)
        spring(folder / "a.csv")
        assert main(["identify", "a.csv", "-o", "m.json"]) == 0
    return folder


@pytest.fixture
def folder(identified: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(identified, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_page_is_written_and_left_out_sections_are_printed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["report", "m.json", "b.csv", "--identified-on", "a.csv", "-o", "report.html"]) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("verdict: good\nwritten ")
    assert "left out, certificate  the model has no plan: make one with palpate plan" in captured.out
    assert "read b.csv: 400 rows" in captured.err
    page = Path("report.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>")
    assert "Without band" not in page


def test_json_names_page_verdict_and_sections(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["report", "m.json", "-o", "report.html", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["report"] == "report.html"
    assert found["verdict"] == "good"
    assert found["sections"][:3] == ["verdict", "numbers", "force-curve"]
    assert found["left_out"]["whiteness"].startswith("no recording was given")
    assert found["bytes"] == Path("report.html").stat().st_size


def test_a_verdict_of_no_exits_with_1_and_writes_the_page(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand()
    model.notes["verdict"] = Verdict((no("the sensor is stuck"),)).record()
    model.save("bad.json")
    capsys.readouterr()
    assert main(["report", "bad.json", "-o", "report.html"]) == 1
    assert capsys.readouterr().out.startswith("verdict: no\n  the sensor is stuck\n")
    assert "The sensor is stuck." in Path("report.html").read_text(encoding="utf-8")


def test_a_refused_plan_is_shown_with_its_reason(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ruined = {"jitter_s": 0.02, "delay_s": 0.01, "viscous_damping": 0.0, "coulomb_friction": 0.0}
    DeviceProfile(id="ruined", **ruined).save("ruined.toml")
    capsys.readouterr()
    assert main(["report", "m.json", "--device", "ruined.toml", "-o", "report.html"]) == 1
    printed = capsys.readouterr().out
    assert printed.startswith("verdict: no\n  not renderable: no structure is proved stable on this device")
    assert "left out, certificate" not in printed
    page = Path("report.html").read_text(encoding="utf-8")
    assert "does not hold" in page
    assert "The certificate is refused" in page


def test_a_plan_on_a_device_replaces_the_plan_of_the_file(folder: Path) -> None:
    assert main(["plan", "m.json", "--device", "bench-knob", "-o", "planned.json"]) == 0
    DeviceProfile(id="other-knob").save("other.toml")
    assert main(["report", "planned.json", "--device", "other.toml", "-o", "report.html"]) == 0
    page = Path("report.html").read_text(encoding="utf-8")
    assert "on the device other-knob" in page
    assert "bench-knob" not in page


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["m.json"], "Missing option '-o'"),
        (["m.json", "-o", "report.pdf"], "report.pdf is not a page: its name must end in .html or .htm"),
        (
            ["m.json", "--device", "no-profile", "-o", "report.html"],
            "for a model with positions in rad are bench-knob",
        ),
        (["m.json", "--device", "touch", "-o", "report.html"], "the example profiles in rad are bench-knob"),
        (["a.csv", "m.json", "-o", "report.html"], "the model comes first: palpate report m.json a.csv"),
        (["m.json", "a.csv", "-o", "missing/report.html"], "there is no folder missing"),
        (["m.json", "a.csv", "-o", "a.csv"], "a.csv is also an input; the result would overwrite it"),
        (["m.json", "-o", "m.json"], "m.json is also an input; the result would overwrite it"),
        (["m.json", "c.csv", "-o", "report.html"], "c.csv"),
        (["m.json", "--identified-on", "b.csv", "-o", "report.html"], "b.csv did not identify the model"),
    ],
    ids=[
        "no output",
        "no page",
        "no profile",
        "other unit",
        "order",
        "no folder",
        "over the recording",
        "over the model",
        "no file",
        "other",
    ],
)
def test_wrong_input_is_refused_with_one_sentence_and_writes_nothing(
    arguments: list[str], message: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.read_bytes() for path in folder.iterdir()}
    capsys.readouterr()
    assert main(["report", *arguments]) == 2
    assert message in capsys.readouterr().err.splitlines()[-1]
    assert {path: path.read_bytes() for path in folder.iterdir()} == before
