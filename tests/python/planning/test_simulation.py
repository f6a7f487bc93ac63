# SPDX-License-Identifier: Apache-2.0
"""Rendering of a model on a test rig: plans, hands, force errors, and refusals."""

from typing import Any

import numpy as np
import pytest

from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import (
    DeviceProfile,
    Hand,
    InputError,
    Model,
    Plan,
    Recording,
    Scheme,
    _core,
    plan,
    read_recording,
    simulate,
)
from palpate.planning import (
    compare_structures,
    explicit_slope_limit,
    force_at,
    force_error,
    hand_for,
    judge,
    rig_for,
)
from palpate.planning.device_profile import find_profile
from palpate.planning.simulation import covered_text


def rendered(model: Model, duration: float = 4.0, **scheme: Any) -> tuple[Plan, Recording]:
    rig = rig_for(model)
    plan = Plan(model, rig.scheme(model, **scheme))
    return plan, simulate(plan, rig.device, rig.hand, duration)


def test_a_plan_claims_no_certificate() -> None:
    plan = Plan(model_by_hand(), Scheme())
    assert plan.certificate is None
    assert plan.refused == ()


@pytest.mark.parametrize(
    ("structure", "solver"),
    [("direct", None), ("massless", "table"), ("implicit", "table"), ("explicit", None)],
)
def test_a_plan_names_its_structure_and_its_solver(structure: str, solver: str | None) -> None:
    plan = Plan(model_by_hand(), Scheme(structure=structure))
    assert (plan.structure, plan.solver) == (structure, solver)


def test_a_plan_does_not_claim_a_table_that_cannot_be_certified() -> None:
    # At positions near 1e6 rad, the rounding of positions exceeds the allowed error of a force table.
    far = model_by_hand(beta=[[1e6 + 0.3]], lower=[1e6], upper=[1e6 + 0.5])
    assert Plan(far, Scheme(structure="massless")).solver == "newton"


def test_narrow_wavelet_increases_the_table_by_its_width_only() -> None:
    needle = model_by_hand(alpha=[[1e9]])
    assert Plan(needle, Scheme(structure="massless")).solver == "table"


def test_a_scheme_that_does_not_fit_the_model_is_refused_by_its_field() -> None:
    with pytest.raises(InputError, match=r"^coupling_stiffness is -1, must be > 0$"):
        Plan(model_by_hand(), Scheme(coupling_stiffness=-1.0))


def test_a_force_in_ampere_is_not_rendered() -> None:
    with pytest.raises(InputError, match="--torque-constant-Nm-per-A"):
        Plan(model_by_hand(units={"position": "rad", "force": "A"}), Scheme())


def test_the_explicit_limit_is_the_paper_scene_s() -> None:
    # Largest stable slope without a coupling: (4 m - 2 B_o T) / T^2 = 3000 (m = 0.001, B_o = 0.5, T = 1 ms).
    scheme = Scheme(structure="explicit", mass=0.001, object_damping=0.5)
    assert explicit_slope_limit(scheme, 1e-3, coupled=False) == pytest.approx(3000.0, rel=1e-12)
    assert explicit_slope_limit(scheme, 1e-3) == pytest.approx(3000.0 - 40.0 - 100.0, rel=1e-12)


def test_an_explicit_plan_beyond_its_slope_limit_is_refused_with_both_numbers() -> None:
    model = model_by_hand()
    plan = Plan(model, Scheme(structure="explicit", coupling_stiffness=3000.0))
    with pytest.raises(InputError, match=r"diverges: .* slope is 7.* must be below -40; "):
        simulate(plan, DeviceProfile(), Hand(), 0.1)


@pytest.mark.parametrize("structure", _core.rendering.structure_names)
@pytest.mark.parametrize(
    "model",
    [model_by_hand(), keyswitch_by_hand(), model_by_hand(lower=[-0.2])],
    ids=["knob", "keyswitch", "both sides of 0"],
)
def test_a_hand_leads_the_handle_through_the_domain_and_not_beyond(model: Model, structure: str) -> None:
    """The handle starts at position 0 for any domain, so the first second is not checked."""
    _, recording = rendered(model, structure=structure)
    lower, upper = float(model.lower[0]), float(model.upper[0])
    travel = upper - lower
    settled = recording.position[1000:]
    assert lower - 0.01 * travel < settled.min() < lower + 0.1 * travel
    assert upper - 0.35 * travel < settled.max() < upper + 0.01 * travel


@pytest.mark.parametrize("structure", _core.rendering.structure_names)
def test_sweep_requires_no_force_above_the_device_limit(structure: str) -> None:
    stiff = model_by_hand(linear=[40.0])
    _, recording = rendered(stiff, structure=structure)
    assert set(recording.columns["status"]) == {"Ok"}
    assert 0.5 * DeviceProfile().force_limit < np.abs(recording.force).max() < DeviceProfile().force_limit


def test_rig_for_another_unit_is_the_scaled_knob() -> None:
    """The same object in metres and newtons, or in radians and newton metres, has the same relative error."""
    scale_length, scale_force = 0.008, 0.2
    rotary = model_by_hand(below="free")
    linear = model_by_hand(
        units={"position": "m", "force": "N"},
        alpha=[[20.0 / scale_length]],
        beta=[[0.3 * scale_length]],
        weight=[0.1 * scale_force],
        linear=[5.0 * scale_force / scale_length],
        upper=[0.5 * scale_length],
        below="free",
    )
    plan, recording = rendered(linear, structure="implicit")
    relative = force_error(plan, recording).end / np.abs(recording.force).max()
    plan, recording = rendered(rotary, structure="implicit")
    # Not equal: this model does not reach the force limit of the knob, but that of the scale model.
    assert relative == pytest.approx(
        force_error(plan, recording).end / np.abs(recording.force).max(), rel=0.5
    )
    assert rig_for(linear).device.encoder_step == pytest.approx(DeviceProfile().encoder_step * scale_length)


def test_rendering_is_a_recording_marked_as_simulated(tmp_path: Any) -> None:
    _, recording = rendered(model_by_hand(), 0.5)
    assert "simulated" in recording.metadata
    again = read_recording(recording.write(tmp_path / "rendered.csv"))
    np.testing.assert_array_equal(again.position, recording.position)
    np.testing.assert_array_equal(again.force, recording.force)
    assert again.time is not None
    assert again.metadata["simulated"] == recording.metadata["simulated"]
    assert dict(again.units) == {"position": "rad", "force": "N*m"}
    assert set(again.columns["status"]) == {"Ok"}


def test_recorded_force_is_that_of_the_device() -> None:
    model = model_by_hand()
    plan = Plan(model, Scheme(structure="direct"))
    coarse = DeviceProfile(force_step=0.5)
    recording = simulate(plan, coarse, rig_for(model).hand, 1.0)
    assert set(recording.force % 0.5) == {0.0}
    assert not set(recording.columns["commanded_Nm"] % 0.5) <= {0.0}


def test_force_error_at_the_instant_is_the_encoder_s_alone_for_direct_rendering() -> None:
    plan, recording = rendered(model_by_hand(), structure="direct")
    error = force_error(plan, recording)
    steepest, step = plan.model.slope_range()[1], DeviceProfile().encoder_step
    assert 0.0 < error.instant < 0.5 * steepest * step
    assert error.end > error.instant


def test_force_error_is_the_rms_of_force_minus_the_model_at_the_handle() -> None:
    plan, recording = rendered(model_by_hand(), structure="implicit")
    expected = np.sqrt(
        np.mean((recording.force - plan.model.force(recording.columns["handle_end_rad"])) ** 2)
    )
    assert force_error(plan, recording).end == pytest.approx(expected, rel=1e-12)


def test_force_along_a_motion_follows_the_play_of_a_hysteresis_model() -> None:
    model = keyswitch_by_hand()
    plan = Plan(model, rig_for(model).scheme(model))
    motion = np.concatenate([np.linspace(0.0, 0.004, 500), np.linspace(0.004, 0.0, 500)])
    force = force_at(plan, motion)
    np.testing.assert_allclose(force[250], model.force(motion[250], direction=1.0), rtol=1e-12)
    np.testing.assert_allclose(force[750], model.force(motion[750], direction=-1.0), rtol=1e-12)


def test_play_radius_is_chosen_only_if_the_model_has_none() -> None:
    for model, radius in (
        (model_by_hand(), 0.0),
        (keyswitch_by_hand(play_radius=1e-4), 0.0),
        (keyswitch_by_hand(), 4e-5),  # 1 % of the travel, many encoder steps
    ):
        assert rig_for(model).scheme(model).play_radius == pytest.approx(radius)
    assert rig_for(model).scheme(model, play_radius=1e-3).play_radius == 1e-3


def test_structures_are_ordered_by_force_error() -> None:
    """Force errors: compensated equals direct, then uncompensated coupling, and most with object damping."""
    model = model_by_hand(linear=[8.0])
    rows = compare_structures(model, rig_for(model), 4.0)
    assert [row.scheme.structure for row in rows] == [
        "direct", "direct", "massless", "massless", "implicit", "implicit", "explicit",
    ]  # fmt: skip
    assert [row.refused for row in rows] == [None] * 7
    predicted, direct, compensated, massless, undamped, damped, explicit = (
        row.error.end for row in rows if row.error
    )
    assert predicted == pytest.approx(0.5 * direct, rel=0.1)
    assert compensated == pytest.approx(direct, rel=0.05)
    assert 3 * direct < massless < 1.1 * undamped < damped
    assert explicit == pytest.approx(damped, rel=0.02)


def test_compensation_of_a_slope_beyond_the_coupling_is_refused_with_its_reason() -> None:
    model = model_by_hand(linear=[95.0], upper=[0.05])
    row = compare_structures(model, rig_for(model), 0.1)[2]
    assert row.recording is None
    assert row.error is None
    assert row.refused is not None
    assert "coupling_stiffness is 100" in row.refused
    assert row.name == "massless, compensated"


def test_invalid_duration_raises_input_error() -> None:
    plan = Plan(model_by_hand(), Scheme())
    with pytest.raises(InputError, match="duration"):
        simulate(plan, DeviceProfile(), Hand(), -1.0)


@pytest.mark.parametrize(
    "device",
    [
        DeviceProfile(coulomb_friction=0.02),
        DeviceProfile(coulomb_friction=0.5, viscous_damping=0.1),
        DeviceProfile(coulomb_friction=0.02, viscous_damping=5e-3),
    ],
    ids=["bench", "friction", "limited network"],
)
def test_the_hand_for_a_plan_covers_the_domain(device: DeviceProfile) -> None:
    chosen = plan(model_by_hand(), device, accept_force_error=1.0)
    rendered = simulate(chosen, device, hand_for(chosen, device), 4.0)
    lower, upper = float(chosen.model.lower[0]), float(chosen.model.upper[0])
    tolerance = 0.025 * (upper - lower)
    assert rendered.position.min() == pytest.approx(lower, abs=tolerance)
    assert rendered.position.max() == pytest.approx(upper, abs=tolerance)
    assert covered_text(chosen, device, rendered).endswith(" % of the domain")


def test_the_hand_stops_where_the_device_does_not_hold_the_force() -> None:
    model = model_by_hand(weight=[0.0], linear=[10.0])
    weak = DeviceProfile(coulomb_friction=0.02, force_limit=2.0)
    chosen = plan(model, weak)
    rendered = simulate(chosen, weak, hand_for(chosen, weak), 4.0)
    assert 0.7 * 2.0 < rendered.force.max() < 2.0
    text = covered_text(chosen, weak, rendered)
    assert text.endswith("the hand presses with at most 80 % of the force limit of 2 N*m")


def test_the_first_pull_of_the_hand_stays_inside_the_domain_of_a_stiff_object_with_hysteresis() -> None:
    """The handle starts at 0, in the middle of the domain of an object that is pressed and pulled."""
    model = model_by_hand(
        weight=[0.0], linear=[18.0], lower=[-0.17], upper=[0.2], play_radius=0.012,
        weight_hysteresis=[0.0], linear_hysteresis=[0.0], bias_hysteresis=0.45,
    )  # fmt: skip
    device = find_profile("bench-knob")
    chosen = plan(model, device)
    rendered = simulate(chosen, device, hand_for(chosen, device), 4.0)
    assert rendered.columns["extrapolated"].mean() < 0.005
    assert np.ptp(rendered.position) > 0.9 * (0.2 + 0.17)
    assert not judge(chosen, rendered, force_error(chosen, rendered)).findings


def test_a_hand_that_the_device_cannot_hold_needs_a_stronger_device_and_not_more_time() -> None:
    """A wall of 40 N*m/rad needs 20 N*m at 0.5 rad, and the hand stops at 80 % of 1 N*m."""
    weak = DeviceProfile(coulomb_friction=0.02, force_limit=1.0)
    by_hand = Plan(model_by_hand(weight=[0.0], linear=[40.0]), Scheme(structure="direct"))
    rendered = simulate(by_hand, weak, hand_for(by_hand, weak), 4.0)
    (sentence,) = judge(by_hand, rendered, force_error(by_hand, rendered), weak).reasons
    assert sentence.endswith(
        "are needed: the hand presses with at most 80 % of the force limit of 1 N*m, so use a device of at "
        "least 25 N*m"
    )
    strong = DeviceProfile(coulomb_friction=0.02, force_limit=30.0)
    short = simulate(by_hand, strong, hand_for(by_hand, strong), 0.1)
    (sentence,) = judge(by_hand, short, force_error(by_hand, short), strong).reasons
    assert sentence.endswith("are needed: simulate a longer time")
