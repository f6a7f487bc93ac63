# SPDX-License-Identifier: Apache-2.0
"""Summaries of identify, verify, plan and check-device: verdict, at most ten lines, details on request."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from conftest import sampled
from models_by_hand import model_by_hand
from palpate import DeviceProfile, Model, load_model, read_recording, verify
from palpate.cli import identify
from palpate.cli.main import main
from palpate.recording.units import GRAVITY

MOST_LINES = 10
"""Largest number of lines that a summary prints below the verdict and its reasons."""

MOST_OPTION_LINES = 16
"""Largest number of lines that the help of palpate identify uses for options that are not for experts."""

SUMMARIES = {
    "identify": "identify dome.csv -o dome.json --hold-out-every 5",
    "identify, not held out": "identify dome.csv -o dome.json",
    "verify": "verify dome-model.json dome.csv",
    "plan": "plan m.json --device bench-knob",
    "plan, refused": "plan m.json --device weak.toml --coupling",
    "check-device": "check-device --duration-s 2 --push",
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns a folder with a recording in mm and gf, models, and the profile of a weak device."""
    folder = tmp_path_factory.mktemp("files")
    model_by_hand().save(folder / "m.json")
    time = np.arange(2000) * 1e-3
    depth = 2.0 - 2.0 * np.cos(2.0 * np.pi * time)
    side = np.sign(np.sin(2.0 * np.pi * time))
    force = 40.0 * depth + 3.0 * side + np.random.default_rng(0).normal(0.0, 0.2, time.size)
    rows = "\n".join(f"{a:.6f},{b:.6f},{c:.6f}" for a, b, c in zip(time, depth, force, strict=True))
    (folder / "dome.csv").write_text(f"time_s,depth_mm,load_gf\n{rows}\n", encoding="utf-8")
    assert main(["identify", str(folder / "dome.csv"), "-o", str(folder / "dome-model.json")]) == 0
    DeviceProfile(viscous_damping=1e-9, coulomb_friction=1e-9).save(folder / "weak.toml")
    return folder


@pytest.fixture
def here(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Returns a copy of the folder `files`, which is the working directory of the test."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def printed(arguments: str, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Runs a command and returns the lines of its standard output."""
    capsys.readouterr()
    main(arguments.split())
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("case", sorted(SUMMARIES))
def test_a_summary_is_a_verdict_and_at_most_ten_lines(
    case: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, *rest = printed(SUMMARIES[case], capsys)
    assert first.startswith("verdict: ")
    lines = [line for line in rest if not line.startswith("  ")]
    assert 3 <= len(lines) <= MOST_LINES
    assert all(re.match(r"[a-z][a-zA-Z -]*  +\S", line) for line in lines), lines


@pytest.mark.parametrize("case", sampled(sorted(SUMMARIES), "verify", "plan, refused"))
def test_verbose_prints_the_summary_and_then_details(
    case: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = printed(f"{SUMMARIES[case]} --verbose", capsys)
    assert lines[0].startswith("verdict: ")
    details = lines[lines.index("details") + 1 :]
    assert details
    assert all(line.startswith("  ") for line in details)


def test_a_summary_uses_the_units_of_the_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = dict(line.split("  ", 1) for line in printed(SUMMARIES["verify"], capsys)[1:] if "  " in line[1:])
    rms = verify(load_model("dome-model.json"), read_recording("dome.csv")).rmse
    assert lines["error"].strip().startswith(f"RMS {rms / (1e-3 * GRAVITY):.4g} gf, ")
    assert re.search(r" gf in one row, at position \S+ mm", lines["largest"])
    identified = "\n".join(printed(SUMMARIES["identify"], capsys))
    assert re.search(r"error +RMS \S+ gf, ", identified)


def test_identify_prints_mass_and_damping_of_the_object_with_their_units(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    content = load_model("dome-model.json").to_dict() | {"mass": 0.25, "damping": 12.5}
    monkeypatch.setattr(identify, "identify_model", lambda *_, **__: Model.from_dict(content))
    (found,) = [line for line in printed(SUMMARIES["identify, not held out"], capsys) if line[:6] == "object"]
    assert re.fullmatch(r"object +mass 0.25 kg, damping 12.5 N\*s/m", found)


def test_the_help_of_identify_has_at_most_16_lines_before_the_expert_options(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["identify", "--help"]) == 0
    shown = capsys.readouterr().out
    before, expert = shown.split("\nExpert:\n")
    options = before[before.index("Input:") :]
    assert sum(bool(line.strip()) for line in options.splitlines()) <= MOST_OPTION_LINES
    assert [line for line in options.splitlines() if line.endswith(":")] == [
        "Input:",
        "Model:",
        "Constraints:",
        "Output:",
    ]
    assert "--max-wavelets" in expert


def test_a_plan_compares_the_device_with_its_needs(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(printed(SUMMARIES["plan"], capsys))
    assert re.search(r"device damping +0\.06 >= needed \S+ N\*m\*s/rad: OK", text)
    assert re.search(r"device friction +0\.01 >= needed \S+ N\*m: OK", text)
    assert "K_c" not in text, "symbols are details"
