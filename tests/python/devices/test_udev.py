# SPDX-License-Identifier: Apache-2.0
"""The udev rule that permits access to the USB device is part of the package; one command installs it."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from palpate._core.device import usb_product, usb_vendor
from palpate.devices import DeviceError, install_rule, usb


@pytest.fixture
def commands_run(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Records the commands of the installation instead of running them; returns the list."""
    commands: list[tuple[str, ...]] = []

    def run(command: tuple[str, ...], **_: Any) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(usb.subprocess, "run", run)
    monkeypatch.setattr(usb.shutil, "which", lambda name: f"/usr/bin/{name}")
    return commands


def test_one_call_writes_the_rule_and_makes_udev_read_it(
    tmp_path: Path, commands_run: list[tuple[str, ...]]
) -> None:
    steps: list[str] = []
    install_rule(steps.append, folder=tmp_path)
    (rule,) = tmp_path.iterdir()
    assert rule.name == "60-palpate.rules"
    text = rule.read_text(encoding="utf-8")
    assert f'ATTR{{idVendor}}=="{usb_vendor:04x}", ATTR{{idProduct}}=="{usb_product:04x}"' in text
    assert 'TAG+="uaccess"' in text
    assert commands_run == [
        ("udevadm", "control", "--reload-rules"),
        ("udevadm", "trigger", "--subsystem-match=usb"),
    ]
    assert steps[0] == f"wrote {rule}:"
    assert steps[-1] == "plug the device in again"


def test_an_existing_rule_is_replaced(tmp_path: Path, commands_run: list[tuple[str, ...]]) -> None:
    (tmp_path / "60-palpate.rules").write_text("of an older version", encoding="utf-8")
    install_rule(lambda _: None, folder=tmp_path)
    assert "1209" in (tmp_path / "60-palpate.rules").read_text(encoding="utf-8")
    assert len(list(tmp_path.iterdir())) == 1


def test_without_udev_the_report_names_the_next_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(usb.shutil, "which", lambda name: None)
    steps: list[str] = []
    install_rule(steps.append, folder=tmp_path)
    assert steps[-1] == "udevadm is not installed: plug the device in again, or restart the machine"
    with pytest.raises(DeviceError, match="has no folder"):
        install_rule(steps.append, folder=tmp_path / "none")


def test_without_root_the_error_names_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(usb.os, "access", lambda path, mode: False)
    with pytest.raises(DeviceError, match=r"needs root; run: sudo .*-m palpate devices --install-udev-rule"):
        install_rule(lambda _: None, folder=tmp_path)
    assert not list(tmp_path.iterdir())
