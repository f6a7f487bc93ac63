# SPDX-License-Identifier: Apache-2.0
"""palpate-control on a Haply Inverse3: a real WebSocket, and a server of the documented messages."""

from __future__ import annotations

import json
import os
import subprocess
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("websockets")

from conftest import ROOT
from control_program import control, needs_program
from inverse3_service import Service, serving
from palpate import DeviceProfile, load_model, plan, read_recording

pytestmark = needs_program

STIFFNESS = 100.0
ALLOWED_MS = 4
FIRST_FAULT = 220
"""Number of the first message with a fault, after the start ramp"""
SCALE = max(1, int(os.environ.get("PALPATE_TEST_SCALE", "1")))
UNCONFIRMED = "zero force sent, but not confirmed by the device"
MODEL = ROOT / "tests" / "models" / "good" / "spring.json"


@pytest.fixture
def spring(tmp_path: Path) -> Path:
    """Writes the model file of a spring of 100 N/m with a domain of 20 mm."""
    model = json.loads(MODEL.read_text(encoding="utf-8"))
    model["units"] = {"position": "m", "force": "N"}
    model["network"]["linear"] = [STIFFNESS]
    model["domain"] = {"lower": [0.0], "upper": [0.02]}
    model["slope_bounds"] = {"min": STIFFNESS, "max": STIFFNESS}
    path = tmp_path / "spring.json"
    path.write_text(json.dumps(model), encoding="utf-8")
    return path


@contextmanager
def render_on_service(
    model: Path, *arguments: Any, axis: str = ":z", service: Service | None = None
) -> Iterator[tuple[subprocess.CompletedProcess[str], Service]]:
    with serving(service or Service()) as running_service:
        device = ["--device", f"inverse3{axis}@{running_service.port}", "--uncertified"]
        yield control(model, *device, *arguments, env=running_service.environment), running_service


@pytest.mark.parametrize("axis", "xyz")
def test_a_spring_is_rendered_along_one_axis_against_the_displacement(
    axis: str, spring: Path, tmp_path: Path
) -> None:
    out = tmp_path / "rendered.csv"
    arguments = ["--structure", "direct", "--duration-s", 1, "--record", out, "--json"]
    with render_on_service(spring, *arguments, axis=f":{axis}", service=Service(axis=axis)) as (
        completed,
        service,
    ):
        assert completed.returncode == 0, completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["inverse3"] == {"force_gate": 0.0, "damping": 0.0, "skipped_states": 0}
    assert "(the service's force gate 0, damping 0), uncertified, at 1000 Hz" in completed.stderr
    recording = read_recording(out)
    assert recording.units == {"position": "m", "force": "N"}
    assert recording.metadata["service"] == "force gate 0, damping 0"
    assert recording.position.max() > 0.003
    after_ramp = slice(300, None)
    expected_force = STIFFNESS * np.maximum(recording.position[after_ramp], 0.0)  # no force below position 0
    assert recording.force[after_ramp] == pytest.approx(expected_force, abs=1e-6)
    # The sent force has a component along the axis only, points out of the object, and is zero at the end.
    assert all(force[other] == 0.0 for force in service.forces for other in set("xyz") - {axis})
    assert min(force[axis] for force in service.forces) < -0.2
    assert service.forces[-1][axis] == 0.0
    assert service.closed


def test_the_first_two_messages_set_the_filters_and_request_them_with_zero_force(spring: Path) -> None:
    with render_on_service(spring, "--duration-s", 0.1, "--json") as (completed, service):
        assert completed.returncode == 0, completed.stderr
    ticks = json.loads(completed.stdout)["ticks"]
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    command = {"device_id": "049D", "commands": {"set_cursor_force": {"vector": zero}}}
    filters = {"force_gate": {"gain": 0.0}, "damping": {"scalar": 0.0, "vector": zero}}
    first_message, second_message, *later_messages = service.messages
    assert first_message == {
        "session": {"configure": {"profile": {"name": "palpate"}}},
        "inverse3": [{**command, "configure": filters}],
    }
    assert second_message == {"session": {"force_render_full_state": {}}, "inverse3": [command]}
    assert all(set(message) == {"inverse3"} for message in later_messages)
    assert all(set(message["inverse3"][0]) == {"device_id", "commands"} for message in later_messages)
    assert (
        ticks <= len(later_messages) <= ticks + 3
    )  # the program sends one message each tick, one before them, and at the end two more with zero force


def test_a_negative_axis_reverses_the_force(spring: Path) -> None:
    with render_on_service(spring, "--duration-s", 0.6, axis=":-z", service=Service(sweep=-0.01)) as (
        completed,
        service,
    ):
        assert completed.returncode == 0, completed.stderr
    assert max(force["z"] for force in service.forces) > 0.2


@pytest.mark.parametrize(
    ("fault", "reason", "zero_force"),
    [
        ({"unplug_after": 300}, "fault of the device", UNCONFIRMED),
        ({"close_after": 300}, "fault of the device", "zero force could not be sent"),
        ({"garbage_after": 300}, "fault of the device", "zero force sent and confirmed"),
        ({"garbage_after": 300, "garbage_messages": 10**9}, "fault of the device", UNCONFIRMED),
        ({"renamed_after": 300}, "fault of the device", UNCONFIRMED),
        ({"silent_after": 300}, "Timeout", UNCONFIRMED),
        ({"force_key": "values"}, "fault of the device", "zero force sent and confirmed"),
    ],
    ids=[
        "unplugged",
        "closed",
        "garbage once",
        "garbage",
        "another device",
        "silent",
        "force unheeded",
    ],
)
def test_a_fault_ends_the_run_with_a_record_and_the_truth_about_zero_force(
    spring: Path, tmp_path: Path, fault: dict[str, Any], reason: str, zero_force: str
) -> None:
    out, service = tmp_path / "rendered.csv", Service(**fault)
    with render_on_service(spring, "--duration-s", 2, "--record", out, service=service) as (completed, _):
        assert completed.returncode == 1, completed.stderr
    assert reason in completed.stderr
    assert f"; {zero_force}" in completed.stderr
    assert zero_force in out.read_text(encoding="utf-8")
    assert service.closed
    if service.close_after is None:
        assert service.forces[-1].get("z", 0.0) == 0.0
        assert min(force.get("z", 0.0) for force in service.forces) < -0.2 or service.force_key != "vector"
        assert service.close_code == 1000


@pytest.mark.parametrize("extra", [1, 5, 20])
def test_states_without_a_command_are_skipped_and_do_not_delay_later_forces(
    spring: Path, tmp_path: Path, extra: int
) -> None:
    out = tmp_path / "rendered.csv"
    service = Service(extra_states={300: extra})
    arguments = ["--structure", "direct", "--duration-s", 1, "--ramp-s", 0, "--record", out, "--json"]
    with render_on_service(spring, *arguments, service=service) as (completed, _):
        assert completed.returncode == 0, completed.stderr
    summary = json.loads(completed.stdout)
    assert summary["inverse3"]["skipped_states"] == extra
    assert summary["lost_samples"] == 0
    # The object of each command is the newest state that the service had sent before the command.
    positions = np.array(service.positions) - service.start
    forces = -np.array([force["z"] for force in service.forces])
    commands = np.arange(320, len(forces) - 3)  # without the last commands, of zero force
    commands = commands[(abs(np.diff(positions))[commands - 1] > 1e-6) & (forces[commands] > 0.0)]
    states = np.array([np.argmin(abs(STIFFNESS * positions[:k] - forces[k])) for k in commands])
    assert len(commands) > 100
    assert (commands - 1 - states).max() <= 1


def certified(folder: Path, spring: Path, delay_s: float) -> Path:
    """Plans the spring for the simulated service's device."""
    device = DeviceProfile(
        id="inverse3-049D",
        position_unit="m",
        encoder_step=1e-6,
        force_limit=2.0,
        inertia=0.2,
        viscous_damping=10.0,
        coulomb_friction=0.5,
        delay_s=delay_s,
    )
    return plan(load_model(spring), device).stored().save(folder / "certified.json")


def test_a_force_later_than_certified_ends_the_run_with_its_cause(spring: Path, tmp_path: Path) -> None:
    # The service answers within the period, but the loop sends the force of a state one period after it.
    model = certified(tmp_path, spring, delay_s=0.5e-3)
    with serving(Service()) as service:
        completed = control(model, "--device", f"inverse3:z@{service.port}", env=service.environment)
    assert completed.returncode == 1
    assert "stopped because the device applied a force" in completed.stderr
    assert "the certificate holds for at most 0.5 ms; plan with a larger delay_s" in completed.stderr
    assert service.forces[-1]["z"] == 0.0


def unknown(*keys: str, **filters: Any) -> Service:
    """Returns a service that ignores keys of the messages, as versions before 3.5 do."""
    return Service(unknown=frozenset(keys), **filters)


IGNORED = [
    (unknown("force_gate"), "force gate 0.3, damping 0"),
    (unknown("damping"), "force gate 0, damping 0.5"),
    (unknown("damping", added_damping=-0.5), "force gate 0, damping 0.5"),
    (unknown("vector", directional_damping={"x": 0.0, "y": -2.0, "z": 0.0}), "force gate 0, damping 2"),
    (unknown("force_render_full_state"), "force gate not given, damping not given"),
    (unknown("force_gate", force_gate=None), "force gate not given, damping 0"),
    (unknown("damping", added_damping=None), "force gate 0, damping not given"),
]


@pytest.mark.parametrize(("service", "reported"), IGNORED)
def test_a_certified_run_is_refused_unless_the_service_reports_that_its_filters_are_off(
    service: Service, reported: str, spring: Path, tmp_path: Path
) -> None:
    model = certified(tmp_path, spring, delay_s=2e-3)
    with serving(service):
        completed = control(model, "--device", f"inverse3:z@{service.port}", env=service.environment)
    assert completed.returncode == 2
    assert f"the Inverse Service reports {reported} after this program set both to 0" in completed.stderr
    assert "install version 3.5 or newer of the service and close programs that set its filters, or set" in (
        completed.stderr
    )
    assert all(force == {"x": 0.0, "y": 0.0, "z": 0.0} for force in service.forces)


def test_an_uncertified_run_states_the_filters_that_the_service_keeps(spring: Path) -> None:
    service = unknown("force_gate", "damping", added_damping=None)
    with render_on_service(spring, "--duration-s", 0.1, "--json", service=service) as (completed, _):
        assert completed.returncode == 0, completed.stderr
    assert "(the service's force gate 0.3, damping not given), uncertified" in completed.stderr
    assert json.loads(completed.stdout)["inverse3"]["damping"] is None


def largest_delay(service: Service, last: int) -> int:
    """Returns the longest time until the program knows a position of the handle, up to a message [ms].

    A position between two states is known when the later one, or one after it, is sent and has a force. The
    position of the handle rises, so each force has the number of its state.
    """
    positions = np.array(service.positions) - service.start
    forces = -np.array([force["z"] for force in service.forces])
    messages = np.arange(FIRST_FAULT, last)
    sources = np.array([np.argmin(abs(STIFFNESS * positions[:k] - forces[k])) for k in messages])
    newest = np.maximum.accumulate(sources)
    states = np.arange(newest[0] + 1, newest[-1])
    known = [service.answered[state] for state in newest[np.searchsorted(newest, states)]]
    return int((np.array(known) - np.array(service.times)[states - 1]).max())


def test_random_faults_of_the_service_make_no_force_older_than_certified(
    spring: Path, tmp_path: Path
) -> None:
    """Random answers are late, lost or held back together, or come without a message."""
    model = certified(tmp_path, spring, delay_s=ALLOWED_MS * 1e-3)
    generator = np.random.default_rng(3)
    ends = Counter[str]()
    ticks = 0
    for run in range(20 if SCALE == 1 else 60 * SCALE):
        service = Service(mass=0.02, sweep=0.02)
        first = int(generator.integers(FIRST_FAULT, 480))
        for number in range(first, first + int(generator.integers(1, 4))):
            kind, length = generator.choice(["late", "lost", "burst", "extra"]), int(generator.integers(1, 8))
            if kind == "extra":
                service.extra_states[number] = length
            elif kind == "burst":
                service.late_answers |= {number + k: length - k for k in range(length)}
            else:
                service.late_answers[number] = None if kind == "lost" else length
        with serving(service):
            arguments = ["--device", f"inverse3:z@{service.port}", "--duration-s", 0.48, "--json"]
            completed = control(model, *arguments, env=service.environment)
        summary = json.loads(completed.stdout)
        ticks += summary["ticks"]
        ends[summary["status"]] += 1
        last = len(service.forces) - 8
        if last > FIRST_FAULT + 20:
            assert largest_delay(service, last) <= ALLOWED_MS, f"run {run}: {service.late_answers}"
        if completed.returncode == 0:
            assert summary["largest_delay_s"] <= ALLOWED_MS * 1e-3
        else:
            assert service.forces[-1]["z"] == 0.0
    print(f"{ticks} ticks, runs ended with {dict(ends)}")
    assert set(ends) >= {"Ok", "Stale", "Timeout"}


@pytest.mark.parametrize(
    ("service", "reason"),
    [
        (Service(devices=0), "detects no Inverse3: plug the Inverse3 in"),
        (Service(calibrated=False), "Inverse3 049D is not calibrated"),
    ],
    ids=["no device", "not calibrated"],
)
def test_a_missing_or_uncalibrated_device_is_refused_with_the_cure(
    spring: Path, service: Service, reason: str
) -> None:
    with render_on_service(spring, service=service) as (completed, _):
        assert completed.returncode == 2
    assert reason in completed.stderr
    assert not service.messages


@pytest.mark.parametrize(
    ("device", "reason"),
    [
        ("inverse3:w", "must be inverse3[:AXIS[@PORT]]: AXIS is x, y, z, -x, -y or -z, PORT is the TCP port"),
        ("inverse3:z@0", "must be inverse3[:AXIS[@PORT]]"),
        ("inverse3:", "device is 'inverse3:', must be simulated, usb[:SERIAL], mit:BUS:NUMBER:KIND"),
        ("inverse3:z@1", "no Haply Inverse Service answers at 127.0.0.1:1 (Connection refused)"),
    ],
)
def test_a_wrong_axis_or_port_is_refused(spring: Path, device: str, reason: str) -> None:
    completed = control(spring, "--device", device, "--uncertified")
    assert completed.returncode == 2
    assert reason in completed.stderr


def test_a_certificate_or_the_full_option_uncertified_is_required(spring: Path) -> None:
    with serving(Service()) as service:
        completed = control(spring, "--device", f"inverse3@{service.port}", env=service.environment)
        assert completed.returncode == 2
        assert "or inverse3[:AXIS[@PORT]]" in completed.stderr
        completed = control(spring, "--device", f"inverse3:z@{service.port}", env=service.environment)
        assert completed.returncode == 2
        assert "has no certificate" in completed.stderr
        arguments = ["--device", f"inverse3:z@{service.port}", "--uncertified"]
        completed = control(MODEL, *arguments, env=service.environment)
        assert completed.returncode == 2
        assert "an Inverse3 moves along a line and needs a model in m and N" in completed.stderr
    assert all(force == {"x": 0.0, "y": 0.0, "z": 0.0} for force in service.forces)
