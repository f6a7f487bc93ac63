# SPDX-License-Identifier: Apache-2.0
"""Setup of a device through real pyusb and libusb, with an emulated device below both."""

from __future__ import annotations

import errno
import json
import os
import stat
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from conftest import ROOT
from palpate.devices.usb import device_error
from usb_emulation import emulated, needs_emulation

USBError = pytest.importorskip("usb.core", reason="needs pyusb").USBError

pytestmark = needs_emulation

COUNTS_PER_TURN = 65536


@pytest.fixture(scope="module")
def reported() -> dict[str, Any]:
    """Returns the results of all setup actions in one session with the emulated device, by action."""
    answer = emulated(sys.executable, "-W", "error", ROOT / "tests" / "usb" / "set_up_over_pyusb.py")
    assert answer.returncode == 0, answer.stderr
    result: dict[str, Any] = json.loads(answer.stdout)
    return result


def devices(*words: str, device: Sequence[str] = ()) -> subprocess.CompletedProcess[str]:
    return emulated(sys.executable, "-m", "palpate", "devices", *words, device=device)


def test_a_device_is_found_with_its_identity(reported: dict[str, Any]) -> None:
    (found,) = reported["found"]
    assert (found["product"], found["serial"], found["problem"]) == ("emulated knob", "EMU-1", "")
    assert found["info"]["counts_per_rev"] == COUNTS_PER_TURN
    assert found["info"]["max_torque"] == pytest.approx(5.0)
    assert found["info"]["rate_hz"] == 1000
    assert found["info"]["transducer"]
    assert reported["name"].startswith("emulated knob EMU-1 (USB bus ")


def test_an_unknown_serial_number_is_refused_by_name(reported: dict[str, Any]) -> None:
    assert reported["another serial"] == (
        "no haptic USB device with serial number OTHER is plugged in; "
        "`palpate devices` lists the connected devices"
    )


def test_the_watchdog_is_set_and_read_back(reported: dict[str, Any]) -> None:
    assert reported["watchdog before"] == 20
    assert reported["watchdog after"] == 137
    assert reported["watchdog out of range"] == "watchdog is 1 ms, must be 2 to 1000"


def test_the_current_position_becomes_zero(reported: dict[str, Any]) -> None:
    few_ms_of_motion = 0.03 * COUNTS_PER_TURN / 6.28
    assert reported["count before"] > 0.15 * COUNTS_PER_TURN / 6.28
    assert abs(reported["count after"]) < few_ms_of_motion


def test_force_is_enabled_and_disabled(reported: dict[str, Any]) -> None:
    enabled, status = reported["enabled"]
    assert enabled
    assert status & 1
    enabled, status = reported["disabled"]
    assert not enabled
    assert not status & 1


def test_after_an_emergency_stop_enabling_stalls_until_the_fault_is_cleared(reported: dict[str, Any]) -> None:
    assert "enabling its force: the device refused a request" in reported["enabled after an emergency stop"]
    assert reported["enabled after it was cleared"]


def test_a_halted_endpoint_stalls_until_it_is_cleared(reported: dict[str, Any]) -> None:
    assert reported["stalls"][0] == errno.EPIPE
    assert len(reported["stalls"]) == 2  # reading fails until the USB halt is cleared
    assert reported["bytes after the stall"] == 32


def test_an_unplugged_device_is_not_found_until_it_is_plugged_in_again(
    reported: dict[str, Any],
) -> None:
    assert reported["unplugged"].endswith(
        "reading its identity: the device was unplugged; plug it in and try again"
    )
    assert reported["found without it"] == 0
    assert reported["opened without it"].startswith("no haptic USB device is plugged in")
    assert reported["found again"] == "EMU-1"


def test_devices_lists_every_connected_device() -> None:
    answer = devices(device=["--serial", "A", "--serial", "B", "--no-transducer"])
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.startswith("verdict: good\n")
    assert "emulated knob A (USB bus 1 address 2)" in answer.stdout
    assert "--device usb:B" in answer.stdout
    assert "torque up to 5 N*m, 1000 Hz, watchdog 20 ms" in answer.stdout
    assert "force transducer: no; velocity: measured; firmware 1.0, uid 00005041" in answer.stdout


def test_a_serial_number_that_controls_a_terminal_is_escaped_and_finds_the_device(tmp_path: Path) -> None:
    device = ["--serial", "A\udc9b2J"]  # byte 0x9b: a control sequence introducer
    assert "A\\x9b2J" in devices(device=device).stdout
    zeroed = devices("--zero", "--device", "usb:A\\x9b2J", device=device)
    assert zeroed.returncode == 0, zeroed.stderr
    words = ["record", tmp_path / "a.csv", "--device", "usb:A\\x9b2J", "--duration-s", 0.1]
    answer = emulated(sys.executable, "-m", "palpate", *words, device=device)
    assert answer.returncode == 1, answer.stderr  # the handle moved too little
    assert "\x9b" not in answer.stdout + answer.stderr
    assert "# device: A\\x9b2J\n" in (tmp_path / "a.csv").read_text(encoding="utf-8")


def test_devices_prints_the_model_on_the_device() -> None:
    answer = devices(device=["--model", "10"])
    model = "fingerprint 0123456789abcdef, certificate fedcba9876543210, certified for 10000 Hz"
    assert f"model on the device: {model}\n" in answer.stdout
    found = json.loads(devices("--json", device=["--model", "10"]).stdout)["devices"][0]
    assert found["model"] == {
        "fingerprint": "0123456789abcdef",
        "certificate": "fedcba9876543210",
        "rate_hz": 10000,
        "is_rendered": False,
    }
    assert "model on the device" not in devices().stdout


@pytest.mark.parametrize(
    ("device", "level", "sentence"),
    [
        (
            ["--no-device"],
            "usable",
            "no haptic USB device is plugged in; record and render need none with --device simulated",
        ),
        pytest.param(
            ["--info-bytes", "33"],
            "no",
            "the answer to GET_INFO has 33 bytes, must have 32",
            marks=pytest.mark.full,
        ),
        (["--wrong-magic"], "no", "the answer to GET_INFO begins with 0x58, must begin with 'I'"),
    ],
)
def test_devices_reports_why_a_device_cannot_be_used(device: list[str], level: str, sentence: str) -> None:
    for as_json in ([], ["--json"]):
        answer = devices(*as_json, device=device)
        assert answer.returncode == (1 if level == "no" else 0), answer.stderr
        assert sentence in " ".join(answer.stdout.split())
        verdict = json.loads(answer.stdout)["verdict"] if as_json else answer.stdout.removeprefix("verdict: ")
        assert verdict.startswith(level)


def only_root_may_run(program: Path) -> bool:
    return os.getuid() == 0 and any(not folder.stat().st_mode & stat.S_IXOTH for folder in program.parents)


@pytest.mark.skipif(
    only_root_may_run(Path(sys.executable).resolve()), reason="needs a Python that other users may run"
)
def test_without_permission_the_message_names_the_command() -> None:
    answer = devices(device=["--denied"])
    assert "permission denied; run 'sudo palpate devices --install-udev-rule' once" in answer.stdout


@pytest.mark.parametrize(
    ("code", "sentence"),
    [
        (
            -3,
            "knob, zeroing it: permission denied; run 'sudo palpate devices --install-udev-rule' once",
        ),
        (-6, "knob, zeroing it: another program uses the device; end that program, then try again"),
        (-7, "knob, zeroing it: the device does not answer; unplug it and plug it in again"),
        (-1, "knob, zeroing it: the transfer failed on the bus; try another cable or port"),
        (None, "knob, zeroing it: Other error; plug it in again"),
    ],
)
def test_an_error_of_libusb_becomes_device_reason_and_cure(code: int | None, sentence: str) -> None:
    assert str(device_error("knob", "zeroing it", USBError("Other error", error_code=code))).startswith(
        sentence
    )


def test_devices_sets_up_one_device() -> None:
    answer = devices("--clear", "--zero", "--disable", "--watchdog-ms", "50", "--json")
    assert answer.returncode == 0, answer.stderr
    assert "emulated knob EMU-1" in answer.stderr
    assert "disabled, faults cleared, zeroed, watchdog set" in answer.stderr
    assert json.loads(answer.stdout)["devices"][0]["info"]["watchdog_ms"] == 50


def test_a_setting_requires_exactly_one_device() -> None:
    answer = devices("--zero", device=["--serial", "A", "--serial", "B"])
    assert answer.returncode == 1
    assert "there are 2 USB devices (A, B); choose with usb:SERIAL" in answer.stderr
