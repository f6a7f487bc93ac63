# SPDX-License-Identifier: Apache-2.0
"""Force of position and velocity: planned, stored, rendered directly, and refused by other structures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from control_program import control, needs_program
from models_by_hand import model_by_hand
from palpate import DeviceProfile, InputError, Model, Plan, Scheme, load_model, plan, simulate
from palpate._core.rendering import structure_names
from palpate.cli.main import main
from palpate.planning import force_at, force_error, rig_for
from palpate.plotting import plot

KNOB = DeviceProfile(id="knob", coulomb_friction=0.02)
# Certificates for this knob allow periods up to 0.1 s, so that a busy machine keeps this limit.
PATIENT_KNOB = DeviceProfile(id="knob", inertia=0.05, viscous_damping=50.0, coulomb_friction=0.05)


def fluid_by_hand(**changes: Any) -> Model:
    """Returns a model: 5 x + 0.01 v plus a wavelet of position x (to 0.5 rad), velocity v (to 4 rad/s)."""
    return model_by_hand(
        **{
            "kind": "position_velocity",
            "inputs": ("position", "velocity"),
            "alpha": [[20.0, 0.5]],
            "beta": [[0.3, 1.0]],
            "weight": [0.03],
            "linear": [5.0, 0.01],
            "lower": [0.0, -4.0],
            "upper": [0.5, 4.0],
            **changes,
        }
    )


def test_force_of_velocity_is_certified_directly_with_bounds_of_both_slopes() -> None:
    model = fluid_by_hand()
    chosen = plan(model, KNOB)
    certificate = chosen.certificate
    assert certificate is not None
    assert (chosen.structure, certificate.verdict, chosen.refused) == ("direct", "certified", ())
    x, v = np.meshgrid(np.linspace(0.0, 0.5, 301), np.linspace(-4.0, 4.0, 301), indexing="ij")
    force = model.predict(np.column_stack([x.ravel(), v.ravel()])).reshape(x.shape)
    drag = np.abs(np.diff(force, axis=1)).max() / (8.0 / 300)
    assert drag <= certificate.bounds.drag <= 1.02 * drag
    resting = np.diff(force[:, 150]) / (0.5 / 300)
    assert certificate.bounds.slope_min <= resting.min()
    assert resting.max() <= certificate.bounds.slope_max <= 1.02 * resting.max()
    damping = certificate.inequalities[0]
    assert damping.right == pytest.approx(5e-4 * certificate.bounds.slope_max + certificate.bounds.drag)


def test_device_too_weak_for_the_velocity_slope_is_refused_with_its_need() -> None:
    weak = DeviceProfile(id="weak knob", viscous_damping=0.02, coulomb_friction=0.02)
    chosen = plan(fluid_by_hand(), weak)
    assert chosen.certificate is not None
    assert chosen.certificate.refused
    reasons = {sentence.split(": ", 1)[0]: sentence for sentence in chosen.refused}
    assert "b >= T M / 2 + B_v T / period needs" in reasons["direct"]
    assert "short by" in reasons["direct"]
    for name in ("direct, slope limited", "massless", "implicit", "energy-consistent", "explicit"):
        assert "only direct rendering of the identified model has known bounds" in reasons[name]


def test_device_that_no_realistic_property_helps_is_refused_with_the_inequality(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = fluid_by_hand(linear=[5.0, 100.0]).save(tmp_path / "joint.json")
    assert main(["plan", str(path), "--device", "bench-knob"]) == 1
    shown = " ".join(capsys.readouterr().out.split())
    assert "not renderable: no structure is proved stable on this device" in shown
    assert "b >= T M / 2 + B_v T / period needs 120" in shown
    assert "too steep" not in shown


@pytest.mark.parametrize(
    "requirement", [{"coupling": True}, {"coupling_stiffness": 50.0}, {"mass": 1e-3}, {"object_damping": 0.1}]
)
def test_force_of_velocity_with_coupling_or_mass_is_refused_in_one_sentence(
    requirement: dict[str, Any],
) -> None:
    with pytest.raises(InputError, match="it can only be rendered directly"):
        plan(fluid_by_hand(), KNOB, **requirement)


@pytest.mark.parametrize("structure", sorted(set(structure_names) - {"direct"}))
def test_force_of_velocity_is_refused_by_other_structures(structure: str) -> None:
    with pytest.raises(InputError, match=f"structure is {structure}, must be direct"):
        Plan(fluid_by_hand(), Scheme(structure=structure))


def test_other_second_inputs_are_not_taken_as_velocity() -> None:
    with pytest.raises(InputError, match="the network has 2 inputs, must have 1"):
        plan(fluid_by_hand(kind="general", inputs=("position", "load_N")), KNOB)


def test_plan_is_read_from_its_file_and_an_edited_bound_is_refused(tmp_path: Path) -> None:
    path = plan(fluid_by_hand(), KNOB).stored().save(tmp_path / "planned.json")
    again = Plan.of(load_model(path))
    again.check_for(KNOB)
    content = json.loads(path.read_text(encoding="utf-8"))
    content["certificate"]["bounds"]["drag"] *= 0.99
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"certificate\.bounds\.drag is .*must be at least"):
        load_model(path)
    # With the kind `general` the second input is not a velocity: the certificate is for another force.
    content["certificate"]["bounds"]["drag"] /= 0.99
    content["kind"] = "general"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"certificate\.model"):
        load_model(path)


def test_rendered_force_uses_the_last_difference_of_positions() -> None:
    model = fluid_by_hand()
    rig = rig_for(model)
    chosen = plan(model, KNOB)
    rendered = simulate(chosen, KNOB, rig.hand, 2.0)
    x = rendered.position[1:]
    v = np.diff(rendered.position) / KNOB.period_s
    inside = (x >= 0.0) & (x <= 0.5) & (np.abs(v) <= 4.0)
    expected = model.predict(np.column_stack([x, v])[inside])
    assert inside.mean() > 0.9
    assert np.abs(rendered.force[1:][inside] - expected).max() < 1e-9
    # Allowed force error: from half an encoder step of position, and one encoder step a tick of velocity.
    step = KNOB.encoder_step
    assert force_error(chosen, rendered).instant < 6.0 * step + 0.06 * step / KNOB.period_s


def test_force_of_velocity_along_a_motion_needs_the_period() -> None:
    with pytest.raises(InputError, match="period_s is None: must be given"):
        force_at(Plan(fluid_by_hand(), Scheme(structure="direct")), np.linspace(0.0, 0.1, 5))


def test_simulate_renders_a_force_of_velocity_without_a_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    fluid_by_hand().save("fluid.json")
    assert main(["simulate", "fluid.json", "--duration-s", "0.5", "--plot", "seen.png", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["structure"] == "direct"
    assert main(["simulate", "fluid.json", "--structure", "massless"]) == 2
    assert "only the direct structure can render a force of position and velocity" in capsys.readouterr().err


@needs_program
def test_control_program_renders_a_force_of_velocity_certified_and_uncertified(tmp_path: Path) -> None:
    path = plan(fluid_by_hand(), PATIENT_KNOB).stored().save(tmp_path / "planned.json")
    for words, expected in (([], "certified: certified"), (["--uncertified"], "certified: no")):
        record = tmp_path / f"felt{len(words)}.csv"
        answer = control(path, "--duration-s", 0.3, "--record", record, *words, "--json")
        assert answer.returncode == 0, answer.stderr
        assert expected in record.read_text(encoding="utf-8")


def test_a_plan_of_a_force_of_velocity_is_shown_and_drawn_at_rest() -> None:
    model = fluid_by_hand()
    chosen = plan(model, KNOB)
    position, identified, rendered = chosen.forces_at_rest()
    np.testing.assert_array_equal(identified, rendered)
    assert identified[0, 500] == model.predict([[position[500], 0.0]])[0]
    assert "<svg" in chosen._repr_html_()
    axes = Figure().subplots()
    assert plot(chosen, axes) is axes
