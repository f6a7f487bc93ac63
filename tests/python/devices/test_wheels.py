# SPDX-License-Identifier: Apache-2.0
"""Wheels at hidraw nodes, with the report descriptors of the emulated wheel."""

from __future__ import annotations

import functools
import json
from pathlib import Path

import pytest

from control_program import control, needs_program
from emulated_device import emulated
from hid_wheel import Wheel, open_ff_board
from models_by_hand import model_by_hand
from palpate._core.device import wheel_has_springs
from palpate.cli.main import main
from palpate.devices import DeviceError, find_wheels

MOUSE = bytes.fromhex(
    "05010902a1010901a1000509190129031500250195037501810295017505810305010930093109381581257f750895038106c0c0"
)


def plug_in(folder: Path, number: int, descriptor: bytes, name: str = "OpenFFBoard", *, node: bool) -> Path:
    """Lists a hidraw device as /sys/class/hidraw does, and returns its node in a folder like /dev."""
    entry = folder / "class" / f"hidraw{number}" / "device"
    entry.mkdir(parents=True)
    (entry / "report_descriptor").write_bytes(descriptor)
    (entry / "uevent").write_text(f"DRIVER=hid-generic\nHID_NAME={name}\nHID_UNIQ=1\n", encoding="utf-8")
    path = folder / "dev" / f"hidraw{number}"
    path.parent.mkdir(exist_ok=True)
    if node:
        path.touch()
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Returns a folder that `palpate devices` searches; it finds no USB device."""
    search = functools.partial(find_wheels, tmp_path / "class", tmp_path / "dev")
    monkeypatch.setattr("palpate.cli.devices.find_wheels", search)
    monkeypatch.setattr("palpate.cli.devices.find_devices", list)
    return tmp_path


def words(capsys: pytest.CaptureFixture[str]) -> str:
    """Returns the printed words, without line breaks."""
    return " ".join(capsys.readouterr().out.split())


def test_only_descriptors_with_all_reports_of_a_wheel_are_accepted() -> None:
    assert wheel_has_springs(open_ff_board()) is True
    assert wheel_has_springs(open_ff_board(2, spring=False)) is False
    assert wheel_has_springs(MOUSE) is None
    assert wheel_has_springs(b"") is None
    whole = open_ff_board()
    assert all(wheel_has_springs(whole[:size]) is None for size in range(len(whole) - 1))


def test_wheels_are_listed_by_number_and_other_nodes_are_not(folder: Path) -> None:
    plug_in(folder, 10, open_ff_board(), node=True)
    node = plug_in(folder, 9, open_ff_board(spring=False), "Wheel\x1b[2J B", node=True)
    plug_in(folder, 1, MOUSE, node=True)
    (folder / "class" / "hidraw2").mkdir()  # unplugged while it is read
    without, with_springs = find_wheels(folder / "class", folder / "dev")
    assert (without.node, without.name) == (str(node), "Wheel\\x1b[2J B")
    assert without.device == f"wheel:{node}:DEGREES:TORQUE"
    assert with_springs.device == f"wheel:{folder / 'dev' / 'hidraw10'}:DEGREES:TORQUE[:STIFFNESS]"
    assert (without.springs, with_springs.springs) == (False, True)
    assert without.problem == with_springs.problem == ""


def test_a_listed_wheel_has_its_argument_and_a_good_verdict(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    node = plug_in(folder, 3, open_ff_board(), node=True)
    assert main(["devices"]) == 0
    assert words(capsys) == (
        f"verdict: good OpenFFBoard ({node}) --device wheel:{node}:DEGREES:TORQUE[:STIFFNESS] "
        "force-feedback wheel; springs: yes"
    )
    assert main(["devices", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["wheels"] == [
        {
            "node": str(node),
            "name": "OpenFFBoard",
            "springs": True,
            "problem": "",
            "device": f"wheel:{node}:DEGREES:TORQUE[:STIFFNESS]",
        }
    ]


def test_a_wheel_that_cannot_be_opened_is_listed_with_the_cure(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    node = plug_in(folder, 3, open_ff_board(), node=False)
    assert main(["devices"]) == 1
    problem = f'{node} cannot be opened: allow your user with a udev rule for SUBSYSTEM=="hidraw"'
    printed = words(capsys)
    assert printed.startswith(f"verdict: no OpenFFBoard: {problem}")
    assert "--device" not in printed
    plug_in(folder, 4, open_ff_board(), node=True)
    assert main(["devices"]) == 0
    assert words(capsys).startswith(f"verdict: usable OpenFFBoard: {problem}")


def test_without_a_wheel_nothing_changes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plug_in(folder, 1, MOUSE, node=True)
    assert main(["devices"]) == 0
    assert words(capsys) == (
        "verdict: usable no haptic USB device is plugged in; "
        "record and render need none with --device simulated"
    )


def test_a_wheel_is_listed_without_the_libraries_of_usb(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise DeviceError("USB devices need pyusb: pip install 'palpate[usb]'")

    monkeypatch.setattr("palpate.cli.devices.find_devices", fail)
    assert main(["devices"]) == 1
    node = plug_in(folder, 3, open_ff_board(), node=True)
    assert main(["devices"]) == 0
    printed = capsys.readouterr()
    assert f"wheel:{node}:" in printed.out
    assert "need pyusb" in printed.err


@needs_program
def test_the_listed_argument_opens_the_wheel(folder: Path) -> None:
    wheel = Wheel(period_s=2e-3)
    node = plug_in(folder, 3, open_ff_board(), node=False)
    model = model_by_hand(alpha=[[8.0]], weight=[0.02], linear=[0.1]).save(folder / "knob.json")
    with emulated(node, wheel):
        (listed,) = find_wheels(folder / "class", folder / "dev")
        device = listed.device.replace("DEGREES", "180").replace("TORQUE", f"{wheel.full_torque:g}")
        device = device.replace("[:STIFFNESS]", f":{wheel.stiffness:.6f}")
        ran = control(model, "--device", device, "--uncertified", "--rate-hz", 500, "--duration-s", 0.2)
    assert ran.returncode == 0, ran.stderr
    assert wheel.forces > 50
