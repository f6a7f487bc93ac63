# SPDX-License-Identifier: Apache-2.0
"""palpate-control with the plan of its model: used and kept only if it is certified."""

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

# Certificate that holds on a busy machine: its longest period is a tenth of a second.
PATIENT_KNOB = DeviceProfile(id="knob", inertia=0.05, viscous_damping=50.0, coulomb_friction=0.01)


@pytest.fixture
def planned(tmp_path: Path) -> Path:
    return plan(model_by_hand(), PATIENT_KNOB).stored().save(tmp_path / "planned.json")


def changed(path: Path, **certificate: Any) -> Path:
    content = json.loads(path.read_text(encoding="utf-8"))
    content["certificate"].update(certificate)
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def metadata(record: Path) -> str:
    return "\n".join(line for line in record.read_text(encoding="utf-8").splitlines() if line.startswith("#"))


def test_the_plan_of_the_file_is_what_is_rendered(tmp_path: Path) -> None:
    scheme = Scheme(structure="massless", coupling_stiffness=70.0, coupling_damping=0.0)
    path = Plan(model_by_hand(), scheme).stored().save(tmp_path / "planned.json")
    # A limit of the user does not replace the plan.
    for others in ([], ["--uncertified"], ["--slew-s", 0.1]):
        answer = control(path, "--duration-s", 0.2, "--lowest-rate-share", 0, *others)
        assert answer.returncode == 0, answer.stderr
        assert "massless, K_c = 70, B_c = 0" in answer.stderr
        assert "no plan" not in answer.stderr


@pytest.fixture
def limited(tmp_path: Path) -> Path:
    """Writes a plan that renders another network than the identified one; its device allows long periods."""
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


def test_the_network_of_the_plan_is_rendered_and_the_identified_one_with_a_structure_of_one_s_own(
    limited: Path, tmp_path: Path
) -> None:
    stored = load_model(limited)
    words = ["--duration-s", 3, "--lowest-rate-share", 0, "--slew-s", 0, "--no-energy-tank"]
    for others, rendered in (([], stored.planned), (["--structure", "direct", "--rate-hz", 100], stored)):
        record = tmp_path / f"felt{len(others)}.csv"
        answer = control(limited, *words, *others, "--record", record)
        assert answer.returncode == 0, answer.stderr
        assert f"{rendered.n_wavelets} wavelets" in answer.stderr
        felt = read_recording(record)
        assert np.ptp(felt.force) > 0.0
        np.testing.assert_allclose(felt.force, rendered.force(felt.position), atol=1e-6)


def test_a_certificate_that_does_not_fit_the_network_of_the_plan_moves_nothing(limited: Path) -> None:
    content = json.loads(limited.read_text(encoding="utf-8"))
    content["plan"]["network"] = None
    limited.write_text(json.dumps(content), encoding="utf-8")
    answer = control(limited, "--duration-s", 0.2)
    assert answer.returncode == 2
    assert "certificate.model is " in answer.stderr
    assert "changed after it was certified" in answer.stderr


def test_without_a_plan_the_default_coupling_is_told_unless_it_was_chosen(tmp_path: Path) -> None:
    path = model_by_hand().save(tmp_path / "unplanned.json")
    words = [path, "--duration-s", 0.1, "--lowest-rate-share", 0]
    assert "the model has no plan: rendered behind the default coupling" in control(*words).stderr
    assert "no plan" not in control(*words, "--structure", "massless").stderr


def test_a_certified_run_takes_rate_and_device_of_its_certificate_and_says_so(
    planned: Path, tmp_path: Path
) -> None:
    record = tmp_path / "felt.csv"
    answer = control(planned, "--duration-s", 0.6, "--record", record)
    assert answer.returncode == 0, answer.stderr
    assert "uncertified" not in answer.stderr
    assert "certified: certified" in metadata(record)


def test_another_rate_than_the_certificate_s_is_refused(planned: Path) -> None:
    answer = control(planned, "--rate-hz", 500)
    assert answer.returncode == 2
    assert "rate_hz is 500, but the certificate is for 1000 Hz" in answer.stderr


@pytest.mark.parametrize(
    "words", [["--structure", "implicit"], ["--slew-s", "0.1"], ["--tolerated-samples", "3"]]
)
def test_what_the_certificate_does_not_cover_is_rendered_uncertified(
    planned: Path, tmp_path: Path, words: list[str]
) -> None:
    record = tmp_path / "felt.csv"
    answer = control(
        planned, *words, "--duration-s", 0.6, "--record", record, "--lowest-rate-share", 0, "--rate-hz", 500
    )
    assert answer.returncode == 0, answer.stderr
    assert "uncertified: the options change the plan" in answer.stderr
    assert "certified: no: the options" in metadata(record)


def test_one_unsound_sample_ends_a_certified_run(planned: Path) -> None:
    words = ["--duration-s", 0.4, "--fault", "lost@0.1", "--json"]
    answer = control(planned, *words)
    assert answer.returncode == 1
    assert "zero force sent, device closed" in answer.stderr
    assert control(planned, "--uncertified", "--lowest-rate-share", 0, *words).returncode == 0


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"verdict": "stable (local), passivity not certified"}, "certificate.verdict"),
        ({"longest_period_s": 10.0}, "certificate.longest_period_s"),
        ({"model": "0" * 16}, "certificate.model"),
        ({"bounds": None}, "certificate.bounds"),
    ],
)
def test_a_certificate_that_was_tampered_with_moves_nothing(
    planned: Path, change: dict[str, Any], field: str
) -> None:
    answer = control(changed(planned, **change), "--uncertified")
    assert answer.returncode == 2
    assert f": {field} " in answer.stderr
