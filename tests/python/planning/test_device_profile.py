# SPDX-License-Identifier: Apache-2.0
"""TOML file of a device profile: every refusal is one sentence with the file's name."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from conftest import ROOT
from models_by_hand import model_by_hand
from palpate import DeviceProfile, InputError, read_recording
from palpate.cli.main import main
from palpate.planning.device_profile import find_profile, require_unit

MODEL = ROOT / "tests" / "models" / "good" / "position.json"


@pytest.mark.parametrize(
    ("field", "value", "sentence"),
    [
        ("inertia", "1" + "0" * 400, "inertia is inf: must be a finite number"),
        ("inertia", "0x" + "f" * 6000, "inertia is inf: must be a finite number"),
        (
            "inertia",
            "9" * 5000,
            "a value cannot be read: a number has more than 4300 digits; write 17 or fewer",
        ),
        ("inertia", "1e400", "inertia is inf: must be a finite number"),
        ("inertia", "nan", "inertia is nan: must be a finite number"),
        ("inertia", "true", "inertia is true: must be a number"),
        ("inertia", '"heavy"', 'inertia is "heavy": must be a number'),
        ("inertia", "[1.0]", "inertia is [1.0]: must be a number"),
        ("inertia", "[" * 5000 + "]" * 5000, "the file is nested too deeply; a profile has no"),
        ("inertia", "{a = " * 3000 + "1" + "}" * 3000, "the file is nested too deeply; a profile has no"),
        (
            "inertia",
            "1979-05-27",
            "the content has a value of type date: must be a number, text, list, dict, true, false or null",
        ),
        ("inertia", '"' + "x" * 10_000 + '"', 'inertia is "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...: must be'),
        ("delay_s", str(2**2000), "delay_s is inf: must be a finite number"),
        ("delay_s", "nan", "delay_s is nan: must be a finite number"),
        ("delay_s", "inf", "delay_s is inf: must be a finite number"),
        ("delay_s", "false", "delay_s is false: must be a number"),
        ("delay_s", "99", "delay_s is 99, must be 0 to 16 periods"),
        ("id", "7", "id is 7: must be text"),
        ("position_unit", "[]", "position_unit is []: must be 'rad' or 'm'"),
    ],
    ids=lambda value: value[:24],
)
def test_invalid_profile_value_is_reported_in_one_sentence(
    tmp_path: Path, field: str, value: str, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = DeviceProfile(id="knob").save(tmp_path / "p.toml")
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(rf"(?m)^{field} = .*$", f"{field} = {value}", text), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(sentence)) as refused:
        DeviceProfile.load(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert main(["plan", str(MODEL), "--device", str(path)]) == 2
    printed = capsys.readouterr().err.splitlines()[-1]
    assert printed.startswith(f"error: {path}: ")
    assert "defect" not in printed
    assert "sys." not in printed


def test_a_long_profile_is_refused_before_it_is_parsed(tmp_path: Path) -> None:
    file = tmp_path / "long.toml"
    file.write_text(".".join("a" * 45_000) + " = 1", encoding="utf-8")  # a minute in tomllib
    with pytest.raises(InputError, match=r"has 90003 bytes: a device profile must have at most 20000"):
        DeviceProfile.load(file)


def test_the_message_on_a_profile_names_a_limited_number_of_fields(tmp_path: Path) -> None:
    file = tmp_path / "other.toml"
    file.write_text("".join(f"k{number} = 1\n" for number in range(900)), encoding="utf-8")
    with pytest.raises(InputError, match=r"k0 is not a key of this format; .*; and more$") as refused:
        DeviceProfile.load(file)
    assert len(str(refused.value)) < 1000 + len(str(file))


def test_a_model_in_counts_is_refused_with_the_option_that_states_the_step() -> None:
    with pytest.raises(InputError, match=r"must be count, .* --units NAME=rev/4096 for 4096 steps"):
        require_unit(find_profile("smartknob"), model_by_hand(units={"position": "count", "force": ""}))


@pytest.mark.parametrize(("force", "position_unit"), [("gf", "m"), ("mNm", "rad")])
def test_the_advised_step_of_the_encoder_suits_the_force(
    force: str, position_unit: str, tmp_path: Path
) -> None:
    file = tmp_path / "press.csv"
    rows = "".join(f"{k},{k}\n" for k in [*range(20), *range(20)[::-1]])
    file.write_text(f"axis counts,force_{force}\n{rows}", encoding="utf-8")
    source = read_recording(file)
    assert source.units["position"] == "count"
    model = model_by_hand(units=source.units, data=source.source)
    with pytest.raises(InputError, match=r"--units .* for ") as refused:
        require_unit(find_profile("smartknob"), model)
    words = shlex.split(re.findall(r"--units (.*) for ", str(refused.value))[0])
    read = read_recording(file, units=dict([words[0].rsplit("=", 1)]))
    assert read.units["position"] == position_unit
