# SPDX-License-Identifier: Apache-2.0
"""Udev rule: shipped with the package, installed by one command."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from palpate._core.device import usb_product, usb_vendor
from palpate.devices import DeviceError, install_rule, usb


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Returns the commands that would run."""
    commands: list[tuple[str, ...]] = []

    def run(command: tuple[str, ...], **_: Any) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(usb.subprocess, "run", run)
    monkeypatch.setattr(usb.shutil, "which", lambda name: f"/usr/bin/{name}")
    return commands


def test_one_call_writes_the_rule_and_asks_udev_to_read_it(
    tmp_path: Path, ran: list[tuple[str, ...]]
) -> None:
    told: list[str] = []
    install_rule(told.append, folder=tmp_path)
    (rule,) = tmp_path.iterdir()
    assert rule.name == "60-palpate.rules"
    text = rule.read_text(encoding="utf-8")
    assert f'ATTR{{idVendor}}=="{usb_vendor:04x}", ATTR{{idProduct}}=="{usb_product:04x}"' in text
    assert 'TAG+="uaccess"' in text
    assert ran == [
        ("udevadm", "control", "--reload-rules"),
        ("udevadm", "trigger", "--subsystem-match=usb"),
    ]
    assert told[0] == f"wrote {rule}:"
    assert told[-1] == "plug the device in again"


def test_a_rule_that_is_there_is_written_again(tmp_path: Path, ran: list[tuple[str, ...]]) -> None:
    (tmp_path / "60-palpate.rules").write_text("of an older version", encoding="utf-8")
    install_rule(lambda _: None, folder=tmp_path)
    assert "1209" in (tmp_path / "60-palpate.rules").read_text(encoding="utf-8")
    assert len(list(tmp_path.iterdir())) == 1


def test_a_machine_without_udev_is_told_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(usb.shutil, "which", lambda name: None)
    told: list[str] = []
    install_rule(told.append, folder=tmp_path)
    assert told[-1] == "there is no udevadm here: plug the device in again, or restart the machine"
    with pytest.raises(DeviceError, match="has no folder"):
        install_rule(told.append, folder=tmp_path / "none")


def test_without_root_it_says_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(usb.os, "access", lambda path, mode: False)
    with pytest.raises(DeviceError, match=r"needs root; run: sudo .*-m palpate devices --install-udev-rule"):
        install_rule(lambda _: None, folder=tmp_path)
    assert not list(tmp_path.iterdir())
