# SPDX-License-Identifier: Apache-2.0
"""Another operating system: live control is refused in one sentence, everything else works."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from palpate import InputError, system
from palpate.cli.main import main
from palpate.devices import measure
from palpate.recording.files import replacing

PROGRAM = Path(__file__).with_name("another_system.py")


def test_all_verbs_without_a_device_work_on_another_system(tmp_path: Path) -> None:
    (tmp_path / "press.csv").write_text(
        "time_s,position_mm,force_N\n"
        + "".join(f"{0.001 * k:.3f},{0.01 * k:.2f},{0.02 * k + 0.01 * (k % 3):.3f}\n" for k in range(200))
    )
    lines = (
        "identify press.csv -o press.json",
        "verify press.json press.csv",
        "plan press.json --device voice-coil -o press.json",
        "simulate press.json --duration-s 0.5",
        "report press.json press.csv -o press.html",
        "export press.json --c -o press.h",
        "show press.csv",
    )
    done = subprocess.run([sys.executable, PROGRAM, *lines], cwd=tmp_path, capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    assert done.returncode == 0, (done.stderr, done.stdout)


@pytest.mark.parametrize("verb", ["render", "record", "devices", "check-device"])
def test_live_control_is_refused_in_one_sentence(
    verb: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(system, "HAS_LIVE_CONTROL", False)
    assert main([verb]) == 2
    assert f"error: palpate {verb} needs Linux, and this is " in capsys.readouterr().err
    with pytest.raises(InputError, match="a measurement on a device needs Linux"):
        measure()


def test_a_file_is_replaced_without_the_functions_for_its_owner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "fchown")
    target = tmp_path / "a.txt"
    target.write_text("old")
    with replacing(target) as temporary:
        temporary.write_text("new")
    assert target.read_text() == "new"
