# SPDX-License-Identifier: Apache-2.0
"""Device profiles, candidate structures, certificates in model files, and the command palpate plan."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import DeviceProfile, InputError, Model, Plan, Scheme, load_model, plan
from palpate.cli.main import main
from palpate.identification.network.constraints import slope_limited
from palpate.planning import example_profiles, profile_file
from palpate.planning.candidates import CANDIDATES

KNOB = DeviceProfile(id="knob", coulomb_friction=0.005, jitter_s=1e-4)
WEAK = DeviceProfile(id="weak knob", viscous_damping=0.003, coulomb_friction=0.005)
SMOOTH = DeviceProfile(id="smooth knob", encoder_step=0.0)


def slide(viscous_damping: float) -> DeviceProfile:
    """Returns the profile of a device with a straight handle, for key switches."""
    return DeviceProfile(
        id="slide",
        position_unit="m",
        inertia=0.05,
        viscous_damping=viscous_damping,
        coulomb_friction=0.2,
        encoder_step=1e-6,
        force_limit=20.0,
    )


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    model_by_hand().save("m.json")
    KNOB.save("knob.toml")
    WEAK.save("weak.toml")
    return tmp_path


@pytest.mark.parametrize("name", example_profiles())
def test_every_example_loads_by_name_and_states_its_sources(name: str) -> None:
    file, sources = example_profiles()[name]
    assert DeviceProfile.load(file).id == name
    assert profile_file(name) == file
    text = " ".join(sources)
    assert "not published" in text or "EVERY NUMBER IS AN ASSUMPTION" in text


def test_all_wrong_fields_of_a_profile_are_reported_at_once(tmp_path: Path) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(
        'id = "a"\nposition_unit = "m"\ncolour = 1\nperiod_s = "x"\ninertia = -1.0\ndelay_s = 0.5\n'
    )
    with pytest.raises(InputError) as caught:
        DeviceProfile.load(file)
    reported = str(caught.value)
    for part in (
        "colour is not a key",
        'period_s is "x": must be a number',
        "inertia is -1.0: must be > 0",
        "force_limit is missing",
        "jitter_s is missing",
    ):
        assert part in reported
    assert "delay_s" not in reported


def test_a_profile_is_read_as_it_was_written(tmp_path: Path) -> None:
    again = DeviceProfile.load(KNOB.save(tmp_path / "knob.toml"))
    assert again.to_dict() == KNOB.to_dict()


@pytest.mark.parametrize(
    ("field", "value", "sentence"),
    [
        ("period_s", "-1e-3", "period_s is -0.001"),
        ("period_s", "nan", "period_s is nan"),
        ("inertia", "0.0", "inertia is 0"),
        ("viscous_damping", "-0.1", "viscous_damping is -0.1"),
        ("coulomb_friction", "inf", "coulomb_friction is inf"),
        ("encoder_step", "-1e-6", "encoder_step is -1e-06"),
        ("force_step", '"fine"', 'force_step is "fine": must be a number'),
        ("delay_s", "-1e-4", "delay_s is -0.0001: must be >= 0"),
        ("delay_s", "0.017", "delay_s is 0.017, must be 0 to 16 periods"),
        ("force_limit", "0", "force_limit is 0"),
        ("position_unit", '"deg"', 'position_unit is "deg": must be'),
        ("colour", "1", "colour is not a key of this format"),
        ("inertia", None, "inertia is missing"),
        ("id", None, "id is missing"),
    ],
)
def test_impossible_device_value_is_refused_with_file_and_field(
    tmp_path: Path, field: str, value: str | None, sentence: str
) -> None:
    path = KNOB.save(tmp_path / "knob.toml")
    kept = [line for line in path.read_text("utf-8").splitlines() if not line.startswith(f"{field} =")]
    path.write_text("\n".join([*kept, *([] if value is None else [f"{field} = {value}"])]), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        DeviceProfile.load(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert sentence in str(refused.value)


def test_plan_takes_the_simplest_certified_structure() -> None:
    chosen = plan(model_by_hand(), KNOB)
    assert (chosen.structure, chosen.refused, chosen.limited) == ("direct", (), None)
    assert (chosen.force_error.largest, str(chosen.verdict)) == (0.0, "good")
    assert chosen.certificate is not None
    assert chosen.certificate.certified


@pytest.mark.parametrize(
    ("damping", "samples"), [(1.0, 1), (0.049, 2), (0.036, 4), (0.030, 8), (0.0278, 16), (0.027, 0)]
)
def test_prediction_takes_fewest_samples_certified_for_a_late_tick(damping: float, samples: int) -> None:
    """Damping for slope 40: 0.0400, 0.0303, 0.0255, 0.0231, 0.0218 for 1 to 16 samples; late: 1.25 times."""
    device = DeviceProfile(viscous_damping=damping, coulomb_friction=0.02)
    model = model_by_hand(weight=[0.0], linear=[40.0])
    chosen = plan(model, device)
    assert chosen.scheme.predict == samples
    assert chosen.certificate is not None
    assert chosen.certificate.certified
    assert chosen.certificate.longest_period_s >= 1.25 * device.period_s
    assert plan(model, device, predict="off").scheme.predict == 0


def test_prediction_changes_neither_network_nor_certificate() -> None:
    model = model_by_hand(weight=[0.0], linear=[40.0])
    for damping in (0.0201, 0.021, 0.023):
        chosen = plan(model, DeviceProfile(viscous_damping=damping, coulomb_friction=0.02))
        assert (chosen.limited, chosen.refused, chosen.scheme.predict) == (None, (), 0)
        assert chosen.certificate is not None
        assert chosen.certificate.certified


def test_late_device_gets_a_prediction_if_only_that_is_certified() -> None:
    """With one sample delay, slope 40 needs a damping of 0.060 without prediction, 0.052 with one sample."""
    model = model_by_hand(weight=[0.0], linear=[40.0])
    device = DeviceProfile(viscous_damping=0.055, coulomb_friction=0.02, delay_s=1e-3, force_limit=20.0)
    chosen = plan(model, device)
    assert (chosen.limited, chosen.scheme.predict, str(chosen.verdict)) == (None, 1, "good")
    without = plan(model, device, predict="off")
    assert without.limited is not None


def test_requested_prediction_is_used_or_refused() -> None:
    model = model_by_hand(weight=[0.0], linear=[40.0])
    assert plan(model, DeviceProfile(coulomb_friction=0.02), predict=16).scheme.predict == 16
    weak = plan(model, DeviceProfile(viscous_damping=0.03, coulomb_friction=0.02), predict=1)
    assert weak.verdict.level == "no"
    assert weak.scheme.predict == 1
    assert "b >= T B(M, s_, m) needs 0.04" in weak.refused[0]
    assert weak.needs.startswith("needs device damping b >= 0.04")
    for wrong in ("on", -1, 17, 2.0, True):
        with pytest.raises(InputError, match="predict is"):
            plan(model, KNOB, predict=wrong)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="predict is 4: must be 0"):
        plan(model, KNOB, predict=4, coupling=True)


def test_a_prediction_of_a_model_with_hysteresis_keeps_its_play_radius() -> None:
    model = keyswitch_by_hand(play_radius=1e-4)
    firm = slide(viscous_damping=20.0)
    chosen = plan(model, firm)
    assert chosen.scheme.predict == 1
    assert chosen.certificate is not None
    assert chosen.certificate.certified
    assert plan(model, firm, predict=0).certificate != chosen.certificate


def test_verb_takes_stores_and_prints_prediction_samples(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model_by_hand(weight=[0.0], linear=[20.0], upper=[0.2]).save("soft.json")
    for predict, samples in (("auto", 1), ("off", 0), ("4", 4)):
        assert main(["plan", "soft.json", "--device", "knob.toml", "--predict", predict, "-o", "p.json"]) == 0
        shown = capsys.readouterr().out
        assert (f"direct, predict {samples}" in shown) == (samples > 0)
        assert Plan.of(load_model("p.json")).scheme.predict == samples
    assert main(["plan", "soft.json", "--device", "knob.toml", "--predict", "some"]) == 2
    assert "give 0 to 16, auto or off" in capsys.readouterr().err


def test_weak_device_gets_a_limited_slope_and_the_force_error_is_reported() -> None:
    model = model_by_hand()
    chosen = plan(model, WEAK)
    assert chosen.structure == "direct"
    assert chosen.certificate is not None
    assert chosen.certificate.certified
    assert chosen.limited is not None
    assert chosen.refused[0].startswith("direct: viscous damping against hold and delay: ")
    assert "short by" in chosen.refused[0]
    limit = 2.0 * WEAK.viscous_damping / WEAK.period_s
    x = np.linspace(0.0, 0.5, 5001)
    assert np.gradient(model.force(x), x).max() > limit
    rendered = chosen.rendered.force(x)
    assert np.gradient(rendered, x).max() <= limit * (1.0 + 1e-9)
    assert np.abs(rendered - model.force(x)).max() <= chosen.force_error.largest * 1.001


def test_force_error_is_zero_if_slopes_are_within_the_limit() -> None:
    model = model_by_hand()
    rendered = plan(model, WEAK).rendered
    x = np.linspace(0.0, 0.5, 2001)
    steep = np.gradient(model.force(x), x) > 2.0 * WEAK.viscous_damping / WEAK.period_s
    away = np.abs(x[:, None] - x[steep]).min(axis=1) > 0.06
    assert away.any()
    assert np.abs(rendered.force(x) - model.force(x))[away].max() < 2e-4 * np.ptp(model.force(x))


def test_steep_contact_of_a_switch_is_limited_only_at_the_contact() -> None:
    """Press and release start with the same force at the end of the domain: a decrease of the hysteresis h
    below the domain would be too steep."""
    model = keyswitch_by_hand(beta=[[0.0]], weight=[0.3], bias=0.33, bias_hysteresis=0.02)
    weak = slide(viscous_damping=0.35)
    chosen = plan(model, weak, energy_account=False)
    assert chosen.certificate is not None
    assert chosen.certificate.certified
    x = np.linspace(0.0, 0.004, 1001)
    stick = chosen.certificate.bounds.loss_per_play
    alone = np.ones(x.size, dtype=bool)
    departure = np.zeros(x.size)
    for side in (1.0, -1.0):
        force = model.force(x, direction=side)
        nearest = slope_limited(x, force, -np.inf, 2.0 * weak.viscous_damping / weak.period_s - stick)
        alone &= np.abs(nearest - force) < 1e-6
        departure = np.maximum(departure, np.abs(chosen.rendered.force(x, direction=side) - force))
    alone = np.convolve(~alone, np.ones(61), mode="same") < 0.5  # kinks are rounded
    assert 0.5 < alone.mean() < 0.9
    assert departure[alone].max() < 1e-3 * np.ptp(model.force(x, direction=1.0))


def test_hysteresis_is_rendered_with_a_certified_play_radius() -> None:
    chosen = plan(keyswitch_by_hand(), slide(viscous_damping=6.0))
    assert chosen.structure == "direct"
    assert chosen.certificate is not None
    assert chosen.certificate.certified
    assert 4e-6 <= chosen.scheme.play_radius <= 4e-4
    assert chosen.certificate.inequalities[0].id == "loss-nonnegative"


def test_coupling_is_used_only_if_required_and_its_spring_is_subtracted() -> None:
    chosen = plan(model_by_hand(), SMOOTH, coupling_stiffness=100.0)
    assert (chosen.structure, chosen.scheme.compensated) == ("massless", True)
    assert chosen.refused[0] == "direct: a coupling is required, and this structure has no coupling"


def test_object_with_mass_is_implicit_without_encoder_steps_and_else_stable_only() -> None:
    assert plan(model_by_hand(), SMOOTH, mass=1e-3).structure == "implicit"
    chosen = plan(model_by_hand(), KNOB, mass=1e-3)
    assert chosen.structure == "explicit"
    assert chosen.certificate is not None
    assert chosen.certificate.verdict == "stable-locally"
    reasons = {sentence.split(": ", 1)[0]: sentence for sentence in chosen.refused}
    assert list(reasons) == [name for name in CANDIDATES if name not in ("tangent", "explicit")]
    assert "no bound is known" in reasons["implicit"]


def test_a_falling_object_with_mass_is_stepped_energy_consistently_because_of_the_force_limit() -> None:
    falling = model_by_hand(weight=[0.3])
    chosen = plan(falling, SMOOTH, mass=1e-3)
    assert chosen.structure == "energy-consistent"
    reasons = {sentence.split(": ", 1)[0]: sentence for sentence in chosen.refused}
    assert "use the energy-consistent structure" in reasons["implicit"]
    damped = plan(falling, SMOOTH, mass=1e-3, object_damping=0.01)
    assert damped.structure == "implicit", "2 B_o / T = 20 is above its steepest fall"


def test_the_coupling_is_softer_on_a_late_device_and_still_certified() -> None:
    stiffness = []
    for delay_s in (0.0, 0.5e-3, 2e-3):
        chosen = plan(model_by_hand(), DeviceProfile(id="late", encoder_step=0.0, delay_s=delay_s), mass=1e-3)
        assert chosen.structure == "implicit"
        stiffness.append(chosen.scheme.coupling_stiffness)
    assert stiffness == sorted(stiffness, reverse=True)
    assert stiffness[-1] < 0.3 * stiffness[0]


def test_a_plan_is_stored_and_holds_for_its_device_alone(tmp_path: Path) -> None:
    path = plan(model_by_hand(), KNOB).stored().save(tmp_path / "planned.json")
    again = Plan.of(load_model(path))
    again.check_for(KNOB)
    slower = DeviceProfile(id="knob", coulomb_friction=0.005, jitter_s=1e-4, period_s=2e-3)
    for other, field in ((slower, "period_s"), (WEAK, "weak knob")):
        with pytest.raises(InputError, match=field):
            again.check_for(other)


def test_an_edited_model_is_refused_when_it_is_read(tmp_path: Path) -> None:
    path = plan(model_by_hand(), KNOB).stored().save(tmp_path / "planned.json")
    content = json.loads(path.read_text(encoding="utf-8"))
    content["network"]["weight"][0] *= 1.0 + 1e-15
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"certificate\.model is .*its units or its certificate was changed"):
        load_model(path)
    assert load_model(path, with_plan=False).plan is None


def test_planned_rendering_is_stable_with_hands_on_its_device() -> None:
    """With a hand, the plan for a weak device is stable in simulation; direct rendering oscillates."""
    from palpate import Hand, simulate
    from palpate.planning import force_error

    model = model_by_hand(linear=[60.0], weight=[0.0])
    weak = DeviceProfile(id="weak", viscous_damping=0.01, coulomb_friction=0.02)
    hand = Hand(stiffness=15.0, damping=0.0, lower=0.02, upper=0.1)
    chosen = plan(model, weak)
    undisturbed = simulate(chosen, weak, hand, 2.0)
    shaking = simulate(Plan(model, Scheme(structure="direct")), weak, hand, 2.0)
    jerks = [float(np.abs(np.diff(each.position, 2))[-1000:].max()) for each in (undisturbed, shaking)]
    assert jerks[0] < 3.0 * weak.encoder_step
    assert jerks[1] > 100.0 * weak.encoder_step
    as_limited = replace(chosen, model=chosen.rendered, limited=None)
    assert force_error(as_limited, undisturbed).end < 0.01


def test_the_verb_writes_the_plan_into_the_model(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "m.json", "--device", "knob.toml", "-o", "m.json", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    stored = json.loads((here / "m.json").read_text(encoding="utf-8"))
    assert printed["structure"] == "direct"
    assert printed["verdict"] == "good"
    assert printed["force_error_share"] == 0.0
    assert printed["written"] == "m.json"
    assert (printed["plan"], printed["certificate"]) == (stored["plan"], stored["certificate"])
    assert printed["slope_behind_coupling"] == printed["steepest_slope"]
    for stored_line, line in zip(
        printed["certificate"]["inequalities"], printed["inequalities"], strict=True
    ):
        assert stored_line == {name: line[name] for name in ("id", "left", "right")}
        assert line["margin"] == line["left"] - line["right"]
        assert line["holds"] == (line["left"] >= line["right"])
    assert Plan.of(load_model("m.json")).certificate is not None


def test_a_model_with_a_plan_is_simulated_as_planned_on_its_device(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", "m.json", "--device", "weak.toml", "-o", "planned.json"]) == 0
    for words, structure in (([], "direct"), (["--structure", "implicit"], "implicit")):
        capsys.readouterr()
        assert main(["simulate", "planned.json", "--duration-s", "0.2", "--json", *words]) == 0
        printed = capsys.readouterr()
        assert json.loads(printed.out)["structure"] == structure
        assert ("weak knob" in printed.err) == (structure == "direct")


def test_force_error_of_a_soft_coupling_is_reported(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "m.json", "--device", "knob.toml", "--mass", "1e-3", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    stiffness = printed["plan"]["coupling"]["stiffness"]
    assert 1.0 / printed["slope_behind_coupling"] == pytest.approx(
        1.0 / printed["steepest_slope"] + 1.0 / stiffness
    )
    assert main(["plan", "m.json", "--device", "knob.toml", "--mass", "1e-3"]) == 0
    shown = capsys.readouterr().out
    assert f"slopes up to {printed['steepest_slope']:.4g} are felt as up to " in shown
    assert shown.split("are felt as up to ")[1].split("\n")[0].endswith(" N*m/rad")


@pytest.mark.parametrize(
    ("model", "arguments"),
    [
        (model_by_hand(), ["--device", "knob.toml"]),
        (model_by_hand(), ["--device", "weak.toml"]),
        (model_by_hand(), ["--device", "knob.toml", "--mass", "1e-3"]),
        (model_by_hand(linear=[0.1], weight=[0.01]), ["--device", "knob.toml", "--coupling-damping", "0.01"]),
        (keyswitch_by_hand(), ["--device", "touch"]),
    ],
)
def test_plan_output_fits_80_columns(
    here: Path, capsys: pytest.CaptureFixture[str], model: Model, arguments: list[str]
) -> None:
    model.save("m.json")
    assert main(["plan", "m.json", *arguments, "--accept-force-error", "2"]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    for word in ("structure", "verdict", "force error", "certificate"):
        assert word in text
    assert main(["plan", "m.json", *arguments, "--accept-force-error", "2", "--verbose"]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    assert "margin" in text


def test_unsuitable_device_is_refused_and_no_file_is_written(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    DeviceProfile(id="ice", viscous_damping=0.0).save("ice.toml")
    assert main(["plan", "m.json", "--device", "ice.toml", "-o", "planned.json", "--verbose"]) == 1
    refusal = " ".join(capsys.readouterr().out.split())
    assert refusal.startswith(
        "verdict: no not renderable: no structure is proved stable on this device, and a finger of 10 g that "
        "rests at "
    )
    assert "in simulation. The object needs device damping b >= " in refusal
    assert "short by" in refusal
    assert not Path("planned.json").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--device", "nothing.toml"], "there is no file nothing.toml"),
        (["--device", "touch"], "position_unit of the device touch is m: must be rad"),
        (["--device", "m.json"], "m.json is not TOML"),
        ([], "Missing option '--device'"),
        (["--device", "knob.toml", "-o", "knob.toml"], "knob.toml is not a model file"),
        (["--device", "knob.toml", "--plot", "locus.txt"], "locus.txt is not a figure file"),
        (["--device", "knob.toml", "--coupling-stiffness", "-1"], "coupling_stiffness is -1"),
    ],
)
def test_wrong_usage_is_refused_in_one_sentence(
    here: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], sentence: str
) -> None:
    assert main(["plan", "m.json", *arguments]) == 2
    printed = capsys.readouterr().err
    assert sentence in printed
    assert len([line for line in printed.splitlines() if line.startswith("error: ")]) == 1


def test_the_examples_are_listed_with_their_sources(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "--examples"]) == 0
    text = capsys.readouterr().out
    for name, (file, _) in example_profiles().items():
        assert f"{name}  {file}\n" in text
    assert "data sheet" not in text
    assert main(["plan", "--examples", "--verbose"]) == 0
    assert "data sheet" in capsys.readouterr().out


def test_the_locus_is_drawn(here: Path) -> None:
    assert main(["plan", "m.json", "--device", "knob.toml", "--mass", "1e-3", "--plot", "locus.png"]) == 0
    assert Path("locus.png").read_bytes().startswith(b"\x89PNG")


def test_the_settings_of_a_plan_have_units() -> None:
    scheme = Scheme(
        structure="implicit", coupling_stiffness=70.0, coupling_damping=0.1, mass=1e-3, object_damping=0.5
    )
    rotary = Plan(model_by_hand(), scheme).settings()
    assert rotary["coupling"] == "K_c = 70 N*m/rad, B_c = 0.1 N*m*s/rad"
    assert rotary["object"] == "mass 0.001 kg*m^2, damping 0.5 N*m*s/rad"
    linear = Plan(keyswitch_by_hand(), Scheme(structure="direct", play_radius=1e-4)).settings()
    assert linear["play radius"].startswith("0.0001 m: after a reversal the force changes over 0.0002 m")
    for samples, text in ((1, "the previous sample"), (4, "the previous 4 samples")):
        ahead = Plan(model_by_hand(), Scheme(structure="direct", predict=samples)).settings()
        assert ahead["prediction"] == f"half a sample ahead, from {text}"


def test_a_refused_structure_names_units() -> None:
    refused = plan(model_by_hand(), DeviceProfile(viscous_damping=0.0), mass=1e-3).refused
    assert any("device damping is 0 N*m*s/rad: too small" in each for each in refused)
    assert any("a mass of 0.001 kg*m^2" in each for each in refused)
