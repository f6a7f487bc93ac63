# SPDX-License-Identifier: Apache-2.0
"""palpate-control uses the plan that is stored in a model only if the plan is certified."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from control_program import control, needs_program
from models_by_hand import model_by_hand
from palpate import DeviceProfile, Scheme, load_model, plan, read_recording
from palpate.planning import Plan

pytestmark = needs_program

# Certificates for this knob allow periods up to 0.1 s, so that a busy machine keeps this limit.
SLOW_PERIOD_KNOB = DeviceProfile(id="knob", inertia=0.05, viscous_damping=50.0, coulomb_friction=0.01)


@pytest.fixture
def planned(tmp_path: Path) -> Path:
    return plan(model_by_hand(), SLOW_PERIOD_KNOB).stored().save(tmp_path / "planned.json")


def with_changed_certificate(path: Path, **certificate: Any) -> Path:
    content = json.loads(path.read_text(encoding="utf-8"))
    content["certificate"].update(certificate)
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def metadata(record: Path) -> str:
    return "\n".join(line for line in record.read_text(encoding="utf-8").splitlines() if line.startswith("#"))


def test_the_stored_plan_is_rendered(tmp_path: Path) -> None:
    scheme = Scheme(structure="massless", coupling_stiffness=70.0, coupling_damping=0.0)
    path = Plan(model_by_hand(), scheme).stored().save(tmp_path / "planned.json")
    # A force limit that the user sets does not replace the plan.
    for options in ([], ["--uncertified"], ["--slew-s", 0.1]):
        completed = control(path, "--duration-s", 0.2, *options)
        assert completed.returncode == 0, completed.stderr
        assert "massless, K_c = 70, B_c = 0" in completed.stderr
        assert "no plan" not in completed.stderr


@pytest.fixture
def limited(tmp_path: Path) -> Path:
    """Writes a model whose plan renders a changed network; the certificate allows long periods."""
    knob = DeviceProfile(
        id="weak knob",
        inertia=0.05,
        viscous_damping=0.2,
        coulomb_friction=0.01,
        period_s=0.01,
        jitter_s=0.09,
    )
    chosen = plan(model_by_hand(linear=[20.0]), knob, accept_force_error=1.0)
    assert chosen.limited is not None
    return chosen.stored().save(tmp_path / "limited.json")


def test_the_planned_network_is_rendered_and_with_a_chosen_structure_the_identified_one(
    limited: Path, tmp_path: Path
) -> None:
    stored = load_model(limited)
    arguments = ["--duration-s", 3, "--slew-s", 0, "--no-energy-account"]
    for options, rendered in (([], stored.planned), (["--structure", "direct", "--rate-hz", 100], stored)):
        record = tmp_path / f"rendered{len(options)}.csv"
        completed = control(limited, *arguments, *options, "--record", record)
        assert completed.returncode == 0, completed.stderr
        assert f"{rendered.n_wavelets} wavelets" in completed.stderr
        recording = read_recording(record)
        assert np.ptp(recording.force) > 0.0
        np.testing.assert_allclose(recording.force, rendered.force(recording.position), atol=1e-6)


def test_a_certificate_of_another_network_is_refused(limited: Path) -> None:
    content = json.loads(limited.read_text(encoding="utf-8"))
    content["plan"]["network"] = None
    limited.write_text(json.dumps(content), encoding="utf-8")
    completed = control(limited, "--duration-s", 0.2)
    assert completed.returncode == 2
    assert "certificate.model is " in completed.stderr
    assert "the model, its units or its certificate was changed" in completed.stderr


def test_the_default_coupling_is_reported_without_plan_and_structure(tmp_path: Path) -> None:
    path = model_by_hand().save(tmp_path / "unplanned.json")
    arguments = [path, "--duration-s", 0.1]
    assert "the model has no plan: rendered behind the default coupling" in control(*arguments).stderr
    assert "no plan" not in control(*arguments, "--structure", "massless").stderr


def test_a_certified_run_uses_the_rate_and_device_of_its_certificate(planned: Path, tmp_path: Path) -> None:
    record = tmp_path / "rendered.csv"
    completed = control(planned, "--duration-s", 0.6, "--record", record)
    assert completed.returncode == 0, completed.stderr
    assert "uncertified" not in completed.stderr
    assert "certified: certified" in metadata(record)


def test_a_rate_that_differs_from_the_certificate_is_refused(planned: Path) -> None:
    completed = control(planned, "--rate-hz", 500)
    assert completed.returncode == 2
    assert "rate_hz is 500, but the certificate is for 1000 Hz" in completed.stderr


@pytest.mark.parametrize(
    "arguments", [["--structure", "implicit"], ["--slew-s", "0.1"], ["--tolerated-samples", "3"]]
)
def test_options_outside_the_certificate_make_the_run_uncertified(
    planned: Path, tmp_path: Path, arguments: list[str]
) -> None:
    record = tmp_path / "rendered.csv"
    completed = control(
        planned,
        *arguments,
        "--duration-s",
        0.6,
        "--record",
        record,
        "--rate-hz",
        500,
    )
    assert completed.returncode == 0, completed.stderr
    assert "uncertified: the options change the plan" in completed.stderr
    assert "certified: no: the options" in metadata(record)


def test_one_lost_sample_ends_a_certified_run(planned: Path) -> None:
    arguments = ["--duration-s", 0.4, "--fault", "lost@0.1", "--json"]
    completed = control(planned, *arguments)
    assert completed.returncode == 1
    assert "zero force sent and confirmed, device closed" in completed.stderr
    assert control(planned, "--uncertified", *arguments).returncode == 0


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"verdict": "stable (local), passivity not certified"}, "certificate.verdict"),
        ({"longest_period_s": 10.0}, "certificate.longest_period_s"),
        ({"model": "0" * 16}, "certificate.model"),
        ({"bounds": None}, "certificate.bounds"),
    ],
)
def test_a_changed_certificate_is_refused(planned: Path, change: dict[str, Any], field: str) -> None:
    completed = control(with_changed_certificate(planned, **change), "--uncertified")
    assert completed.returncode == 2
    assert f": {field} " in completed.stderr


def test_a_plan_for_the_motor_controller_is_not_rendered_from_the_host(tmp_path: Path) -> None:
    path = plan(model_by_hand(), SLOW_PERIOD_KNOB, on_device=20e3).stored().save(tmp_path / "planned.json")
    for device in ("simulated", "inverse3"):
        completed = control(path, "--device", device)
        assert completed.returncode == 2
        assert completed.stderr == (
            f"error: {path} is planned for the motor controller of knob at 20000 Hz: set device to a "
            "USB device that contains the exported model, or make a plan for the host with 'palpate plan' "
            "without on_device\n"
        )
    completed = control(path, "--uncertified", "--duration-s", 0.1)
    assert completed.returncode == 0, completed.stderr
