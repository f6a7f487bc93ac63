# SPDX-License-Identifier: Apache-2.0
"""Tests of plans that the energy account holds: choice, numbers, simulation, file and command line."""

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from conftest import sampled
from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import DeviceProfile, InputError, Model, Plan, load_model, plan, simulate
from palpate._core.simulation import account_use
from palpate.cli.main import main
from palpate.planning import example_profiles, hand_for

COIL = DeviceProfile.load(example_profiles()["voice-coil"][0])


def coil(**changes: float) -> DeviceProfile:
    return DeviceProfile(**{**COIL.to_dict(), **changes})


def wall(stiffness: float) -> Model:
    """Returns a key of 4 mm that ends in a wall over its last half millimetre."""
    return keyswitch_by_hand(
        alpha=[[2000.0], [4000.0]],
        beta=[[0.002], [0.0042]],
        weight=[-0.2, 0.4e-3 * stiffness],
        weight_hysteresis=None,
        linear_hysteresis=None,
        bias_hysteresis=None,
    )


@cache
def held_plan() -> Plan:
    """Returns a plan that the energy account holds, which the tests only read."""
    return plan(wall(3000.0), coil(viscous_damping=0.5))


@cache
def proved_plan() -> Plan:
    return plan(wall(2500.0), COIL)


def test_a_proved_plan_with_an_accepted_error_stays_proved() -> None:
    chosen = proved_plan()
    assert chosen.certificate is not None
    assert chosen.certificate.verdict == "certified"
    assert chosen.account is None


def test_the_account_holds_a_model_whose_proved_force_error_is_not_accepted() -> None:
    weak = coil(viscous_damping=0.5)
    proved = plan(wall(3000.0), weak, energy_account=False)
    held = held_plan()
    assert proved.certificate is not None
    assert held.certificate is not None
    assert held.account is not None
    assert proved.certificate.certified
    assert proved.verdict.level == "no"
    assert held.certificate.verdict == "held-by-account"
    assert held.verdict.level == "usable"
    assert held.force_error.share < 0.5 * proved.force_error.share
    assert 1.0 < held.proved_ratio <= 4.0 * 1.02
    assert held.account.share < 0.01
    assert "direct, slope limited: the largest force error at rest is " in str(held.verdict)
    rows = held.summary()
    assert rows["certificate"] == "held by the energy account, samples up to 1.1 ms apart"
    assert rows["energy account"].startswith(f"a hand takes at most {1e3 * held.account.energy:.3g} mJ")
    again = plan(wall(3000.0), weak, accept_force_error=proved.force_error.share)
    assert again.certificate is not None
    assert again.certificate.certified, "the caller accepts the error of the proved plan"


@pytest.mark.parametrize("damping", sampled([0.1, 0.5, 1.0, 2.0], 0.5, 1.0))
def test_the_largest_ratio_with_which_the_account_seldom_acts_is_chosen(damping: float) -> None:
    device = coil(viscous_damping=damping)
    chosen = plan(wall(6000.0), device)
    if not chosen.held_by_account:
        return
    steeper = plan(wall(6000.0), coil(viscous_damping=4.0 * damping), energy_account=False)
    if chosen.limited is not None and chosen.proved_ratio < 3.0:
        assert account_use(steeper.rendered, steeper.scheme, device).share >= 0.01
    assert account_use(chosen.rendered, chosen.scheme, device).share < 0.01


@pytest.mark.parametrize(
    ("device", "reason"),
    [
        (coil(viscous_damping=0.0), "the device can render no slope"),
        (coil(viscous_damping=0.1, coulomb_friction=1e-3, inertia=0.5), "of the ticks of simulated presses"),
    ],
)
def test_a_device_that_the_account_cannot_hold_is_refused_with_the_reason(
    device: DeviceProfile, reason: str
) -> None:
    chosen = plan(wall(20000.0), device)
    assert not chosen.held_by_account
    refused = [line for line in chosen.refused if line.startswith("direct, held by the energy account: ")]
    assert len(refused) == 1
    assert reason in refused[0]


def test_a_program_on_a_motor_controller_has_no_account() -> None:
    refused = plan(wall(20000.0), coil(viscous_damping=0.01), on_device=2000.0).refused
    assert any("motor controller has no energy account" in line for line in refused)


def test_presses_at_every_speed_and_rests_with_tremor_are_simulated() -> None:
    held = held_plan()
    assert held.account is not None
    assert len(held.account.shares) == 6, "four presses and two rests"
    assert held.account.force_error <= 0.01 * np.ptp(held.forces_at_rest()[1])


def test_a_held_plan_is_simulated_with_its_account() -> None:
    held = held_plan()
    assert held.certificate is not None
    plain = Plan(held.model, held.scheme, None, (), held.limited)
    sent = {}
    for name, each in (("held", held), ("plain", plain)):
        weak = coil(viscous_damping=0.5)
        sent[name] = simulate(each, weak, hand_for(each, weak), 0.5).force
    assert np.array_equal(sent["held"], sent["plain"]), "ordinary motion is not changed"


def test_a_held_plan_is_stored_and_checked_when_it_is_read(tmp_path: Path) -> None:
    held = held_plan()
    file = held.stored().save(tmp_path / "held.json")
    read = Plan.of(load_model(file))
    assert read.held_by_account
    assert read.account is not None
    assert held.account is not None
    assert read.account.to_dict() == held.account.to_dict()
    content = json.loads(file.read_text(encoding="utf-8"))
    content["certificate"]["verdict"] = "certified"
    file.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match='verdict is "certified": must be "refused"'):
        load_model(file)


def test_the_output_states_word_energy_speed_ratio_share_and_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    wall(3000.0).save("m.json")
    coil(viscous_damping=0.5).save("weak.toml")
    assert main(["plan", "m.json", "--device", "weak.toml", "-o", "held.json"]) == 0
    text = capsys.readouterr().out
    for part in (
        "certificate     held by the energy account",
        "energy account  a hand takes at most ",
        " mJ, in motions up to 0.8 m/s",
        "slopes          up to ",
        "account acts    in at most 0 % of the ticks of simulated presses",
        "held by the energy account, passivity is not proved (direct, slope",
    ):
        assert part in text
    assert main(["plan", "m.json", "--device", "weak.toml", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["word"] == "held by the energy account"
    account = found["energy_account"]
    assert set(account) == {"energy", "largest_speed", "share", "force_error", "shares", "proved_ratio"}
    assert main(["simulate", "held.json", "--json"]) == 0
    assert main(["export", "held.json", "--c", "-o", "held.h"]) == 2, "an exported program has no account"
    assert main(["plan", "m.json", "--device", "weak.toml", "--no-energy-account"]) == 1


def test_a_refused_plan_names_the_smallest_force_with_which_a_finger_oscillates() -> None:
    refused = plan(wall(20000.0), coil(viscous_damping=0.0, coulomb_friction=0.0))
    assert refused.certificate is not None
    assert refused.certificate.refused
    found = re.search(
        r"not renderable: no structure is proved stable on this device, and with ([\d.]+) % of the force a "
        r"finger of 10 g that rests at (\S+) m oscillates by (\S+) m at (\S+) Hz in simulation",
        str(refused.verdict),
    )
    assert found
    assert float(found[1]) in (12.5, 25.0, 50.0)
    assert 0.0 <= float(found[2]) <= 0.005
    assert float(found[4]) > 20.0


def test_words_of_a_plan() -> None:
    assert proved_plan().summary()["certificate"].startswith("proved")
    assert held_plan().summary()["certificate"].startswith("held by the energy account")
    stable = plan(model_by_hand(), DeviceProfile(coulomb_friction=0.005), mass=1e-3)
    assert stable.summary()["certificate"].startswith("stable near rest, nothing proved")
