# SPDX-License-Identifier: Apache-2.0
"""Certificates of candidate structures: wheels above the force limit, slopes with delay, couplings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from conftest import sampled
from models_by_hand import model_by_hand
from palpate import DeviceProfile, InputError, Model, Scheme, plan
from palpate._core.rendering import compensated_share
from palpate._core.stability import certify, force_bounds, passive_shift
from palpate.planning import profile_file
from palpate.planning.limited_network import limit_slopes, renderable_slopes
from palpate.planning.plan import static_force_error

TURN = 2.0 * math.pi
BENCH_KNOB = DeviceProfile.load(profile_file("bench-knob"))


def wheel() -> Model:
    """Returns the model of a wheel with one torque peak of about 8 N*m and a mean torque of zero."""
    model = model_by_hand(
        alpha=[[8.0], [0.6], [0.6]],
        beta=[[2.0], [4.5], [1.2]],
        weight=[13.0, 1.0, 1.5],
        linear=[0.0],
        upper=[TURN],
        period=TURN,
    )
    return model.with_network(bias=model.bias + passive_shift(model, math.inf))


def given_in_a_turn(model: Model, force_limit: float) -> float:
    """Returns the energy of one slow revolution of the wheel: the limited force summed over fine steps
    [J]."""
    x = TURN * (np.arange(100_000) + 0.5) / 100_000
    return float(abs(np.clip(model.force(x), -force_limit, force_limit).mean()) * TURN)


def test_periodic_model_above_the_force_limit_is_not_certified_unchanged() -> None:
    model = wheel()
    strong = DeviceProfile(id="strong", viscous_damping=10.0, coulomb_friction=0.02, force_limit=100.0)
    assert certify(model, Scheme(structure="direct"), strong).certified
    limited = DeviceProfile(id="limited", viscous_damping=10.0, coulomb_friction=0.02, force_limit=5.0)
    assert given_in_a_turn(model, 5.0) > 0.2
    refused = certify(model, Scheme(structure="direct"), limited)
    assert refused.refused
    assert [line.id for line in refused.inequalities if not line.holds] == ["friction-steps"]


def test_the_plan_balances_the_limited_force() -> None:
    chosen = plan(wheel(), BENCH_KNOB, accept_force_error=1.0)
    assert chosen.certificate is not None
    assert chosen.certificate.certified
    assert chosen.certificate.bounds.mean_force == 0.0
    assert given_in_a_turn(chosen.rendered, BENCH_KNOB.force_limit) < 1e-6


def test_the_slopes_of_harmonics_are_limited_and_the_plan_keeps_them() -> None:
    waves = [[2.0 * np.pi * order / 0.5] for order in (1, 5, 12)]
    model = model_by_hand(
        alpha=waves,
        beta=[[0.0], [0.03], [0.2]],
        weight=[0.5, 0.2, 0.1],
        linear=[0.0],
        period=0.5,
        harmonics=3,
    )
    whole = force_bounds(model, math.inf).slope_max
    limited = limit_slopes(model, -0.6 * whole, 0.6 * whole)
    assert limited is not None
    assert limited.harmonics == 3
    assert force_bounds(limited, math.inf).slope_max <= 0.6 * whole
    chosen = plan(model, BENCH_KNOB)
    assert chosen.certificate is not None
    assert chosen.certificate.certified
    assert Model.from_dict(chosen.model.to_dict()).planned.harmonics == 3


def bump(alpha: float, weight: float) -> Model:
    return model_by_hand(alpha=[[alpha]], weight=[weight])


@pytest.mark.parametrize(
    "model", [bump(20.0, 0.5), bump(20.0, -0.5), bump(40.0, -0.2)], ids=["rises", "falls", "falls-narrow"]
)
@pytest.mark.parametrize("delay", sampled([0.25, 1.0, 2.0], 1.0))
def test_with_delay_the_force_error_is_not_larger_than_with_equal_slopes(model: Model, delay: float) -> None:
    device = DeviceProfile(
        id="late", viscous_damping=0.01, coulomb_friction=0.01, encoder_step=1e-4, delay_s=delay * 1e-3
    )
    held = device.viscous_damping / device.longest_period_s
    # required device damping: b >= T M / 2 + n T M with force slopes from -M to M and a delay of n samples
    equal = held / (0.5 + device.late_samples)
    scheme = Scheme(structure="direct")
    before = limit_slopes(model, -equal, equal)
    now = limit_slopes(model, *renderable_slopes(device, model=model))
    assert before is not None
    assert now is not None
    assert certify(now, scheme, device).certified
    errors = [static_force_error(model, limited, scheme).rms for limited in (before, now)]
    assert errors[1] <= 1.001 * errors[0]


def test_without_delay_a_fall_is_limited_by_friction_alone() -> None:
    device = DeviceProfile(id="knob", viscous_damping=0.01, coulomb_friction=0.01, encoder_step=1e-4)
    low, high = renderable_slopes(device)
    assert low == pytest.approx(-200.0, rel=1e-4)
    assert high == pytest.approx(20.0, rel=1e-4)
    assert renderable_slopes(DeviceProfile(id="smooth", encoder_step=0.0))[0] == -math.inf


def softest_coupling(slope: float) -> float:
    """Returns the smallest coupling stiffness that compensates a model of this steepest slope."""
    stiffness = slope / compensated_share
    while compensated_share * stiffness >= slope:
        stiffness = math.nextafter(stiffness, 0.0)
    return math.nextafter(stiffness, math.inf)


def random_slopes(seed: int, **changes: Any) -> Model:
    """Returns a random model of one to eight wavelets, whose slope changes over the domain."""
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 9))
    return model_by_hand(
        **{
            "alpha": np.exp(random.uniform(1.0, 3.9, count))[:, None].tolist(),
            "beta": random.uniform(0.0, 0.5, count)[:, None].tolist(),
            "weight": random.uniform(-0.5, 0.5, count).tolist(),
            "linear": [random.uniform(0.0, 40.0)],
            **changes,
        }
    )


@pytest.mark.parametrize("seed", sampled(range(25), *range(3)))
def test_a_required_coupling_is_planned_at_its_bound_and_one_ulp_below(seed: int) -> None:
    strong = DeviceProfile(id="strong", viscous_damping=2.0, coulomb_friction=0.5)
    # The force of every second model pushes out of the domain, so that its continuation is the steepest part
    model = random_slopes(seed, **({"bias": 40.0} if seed % 2 else {}))
    stiffness = softest_coupling(force_bounds(model).slope_max)
    softer = math.nextafter(stiffness, 0.0)
    exact = plan(model, strong, coupling_stiffness=stiffness)
    assert (exact.structure, exact.limited) == ("massless", None)
    Scheme(structure="massless", coupling_stiffness=stiffness, compensated=True).validate(model)
    with pytest.raises(InputError, match="to compensate a model"):
        Scheme(structure="massless", coupling_stiffness=softer, compensated=True).validate(model)
    for below in (softer, 0.999 * stiffness, 0.99 * stiffness, 0.9 * stiffness):
        limited = plan(model, strong, coupling_stiffness=below)
        assert limited.limited is not None or limited.structure != "massless"
