# SPDX-License-Identifier: Apache-2.0
"""Force error of a plan: share of the force, verdict, device property that causes it, model file."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from conftest import sampled
from models_by_hand import keyswitch_by_hand, model_by_hand, relaxing_by_hand
from palpate import (
    DeviceProfile,
    InputError,
    Model,
    Plan,
    Recording,
    Scheme,
    identify,
    load_model,
    plan,
    read_recording,
    verify,
)
from palpate._core.model import fingerprint
from palpate.cli.main import main
from palpate.planning import OnDevice, example_profiles
from palpate.planning.device_profile import find_profile
from palpate.plotting import plot
from test_plan import SMOOTH, WEAK, slide


@pytest.fixture(scope="session")
def press(data: Path) -> Recording:
    return read_recording(data / "keyswitches" / "clicky__cherry_mx_blue.csv")


@pytest.fixture(scope="session")
def switch(press: Recording) -> Model:
    return identify(press)


@pytest.fixture(scope="session")
def few_rows(press: Recording) -> Recording:
    """Returns every twelfth row of the measured key switch, which has the same steep click."""
    assert press.direction is not None
    return Recording.from_arrays(
        press.position[::12], press.force[::12], direction=press.direction[::12], units=press.units
    )


@pytest.fixture(scope="session")
def steep_switch(few_rows: Recording) -> Model:
    return identify(few_rows)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    model_by_hand().save("m.json")
    WEAK.save("weak.toml")
    return tmp_path


def changed(device: DeviceProfile, **fields: Any) -> DeviceProfile:
    return DeviceProfile(**device.to_dict() | fields)


def network(path: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8"))["network"]
    return content


def test_plan_with_large_force_error_is_refused_and_the_model_file_is_unchanged(
    here: Path, capsys: pytest.CaptureFixture[str], steep_switch: Model
) -> None:
    steep_switch.save("k.json")
    before = Path("k.json").read_bytes()
    assert main(["plan", "k.json", "--device", "phantom-premium-1.0", "-o", "k.json", "--json"]) == 1
    printed = json.loads(capsys.readouterr().out)
    assert printed["verdict"].startswith("no: the largest force error at rest is 1.2")
    assert printed["force_error_share"] > 0.9
    assert printed["written"] is None
    assert Path("k.json").read_bytes() == before


def test_accepted_plan_does_not_change_the_identified_network(
    here: Path, capsys: pytest.CaptureFixture[str], steep_switch: Model, few_rows: Recording
) -> None:
    steep_switch.save("k.json")
    words = ["--device", "phantom-premium-1.0", "--accept-force-error", "0.985", "--json"]
    identified = network("k.json")
    assert main(["plan", "k.json", *words, "-o", "k.json"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["verdict"].startswith("usable: ")
    assert first["verdict"].endswith(" % is accepted")
    assert network("k.json") == identified
    again = load_model("k.json")
    assert verify(again, few_rows).nrmse == verify(steep_switch, few_rows).nrmse
    assert main(["plan", "k.json", *words, "-o", "twice.json"]) == 0
    second = json.loads(capsys.readouterr().out)
    assert {**second, "seconds": 0, "written": ""} == {**first, "seconds": 0, "written": ""}
    assert Path("twice.json").read_bytes() == Path("k.json").read_bytes()
    assert main(["show", "k.json"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert f"{steep_switch.n_wavelets} wavelets" in shown
    for words in ("direct, with a limited network", "phantom-premium-1.0", "is accepted"):
        assert words in shown


@pytest.mark.parametrize(("force_limit", "level"), [(2.6, "good"), (2.4, "usable"), (1.25, "no")])
def test_the_force_error_contains_the_force_above_the_limit_of_the_device(
    force_limit: float, level: str
) -> None:
    """A spring of 5 N*m/rad needs 2.5 N*m at 0.5 rad."""
    device = DeviceProfile(coulomb_friction=0.02, force_limit=force_limit)
    chosen = plan(model_by_hand(weight=[0.0]), device)
    missing = max(0.0, 2.5 - force_limit)
    assert chosen.verdict.level == level
    assert chosen.force_error.largest == pytest.approx(missing)
    assert chosen.force_error.share == pytest.approx(missing / 2.5)
    assert chosen.forces_at_rest()[2].max() == pytest.approx(min(2.5, force_limit))
    cure = (
        f"The device gives at most {force_limit:g} N*m: use a device with a force limit of at least 2.5 N*m"
    )
    assert (cure in str(chosen.verdict)) == (missing > 0.0)
    assert not chosen.needs


@pytest.mark.parametrize("kind", ["of velocity", "memory"])
def test_the_force_limit_counts_for_a_force_that_depends_on_motion(kind: str) -> None:
    model = relaxing_by_hand(linear=[20.0])
    if kind == "of velocity":
        model = Model.from_network(
            kind="position_velocity",
            inputs=("position", "velocity"),
            units={"position": "m", "force": "N"},
            alpha=np.zeros((0, 2)),
            beta=np.zeros((0, 2)),
            weight=[],
            linear=[20.0, 0.01],
            lower=[0.0, -1.0],
            upper=[1.0, 1.0],
        )
    chosen = plan(model, changed(find_profile("voice-coil"), force_limit=15.0))
    assert chosen.force_error.largest == pytest.approx(5.0, rel=0.01)
    assert "use a device with a force limit of at least 20 N" in str(chosen.verdict)


def test_simulate_compares_with_the_identified_force_and_renders_the_limited_one(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--device", "weak.toml", "--accept-force-error", "1", "-o", "m.json"]
    assert main(["plan", "m.json", *words]) == 0
    chosen = Plan.of(load_model("m.json"))
    capsys.readouterr()
    assert main(["simulate", "m.json", "--json"]) == 0
    error = json.loads(capsys.readouterr().out)["force_error_end"]
    assert 0.5 * chosen.force_error.rms < error < 2.0 * chosen.force_error.largest


def test_the_certificate_is_for_the_rendered_network() -> None:
    stored = plan(model_by_hand(), WEAK, accept_force_error=1.0).stored()
    assert stored.certificate is not None
    assert stored.certificate["model"] == fingerprint(stored.planned) != fingerprint(stored)


def test_a_changed_network_of_the_plan_is_refused_when_the_file_is_read(tmp_path: Path) -> None:
    path = plan(model_by_hand(), WEAK, accept_force_error=1.0).stored().save(tmp_path / "planned.json")
    content = json.loads(path.read_text(encoding="utf-8"))
    content["plan"]["network"]["bias"] += 1e-12
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"certificate\.model is .*its units or its certificate was changed"):
        load_model(path)


@pytest.mark.parametrize(
    ("device", "damping_b"),
    sampled([("touch", 2.0), ("touch-x", 2.0), ("phantom-premium-1.0", 0.5)], ("touch", 2.0)),
)
@pytest.mark.full
def test_the_named_device_property_is_enough_and_1_percent_less_is_not(
    switch: Model, device: str, damping_b: float
) -> None:
    # The damping is much larger than that of the example, so that the advised device is realistic.
    weak = changed(DeviceProfile.load(example_profiles()[device][0]), viscous_damping=damping_b)
    sentence = plan(switch, weak).needs
    damping = re.search(r"b >= (\S+) N\*s/m \(has (\S+)\)", sentence)
    friction = re.search(r"f_c >= (\S+) N \(has", sentence)
    rate = re.search(r"a rate of (\S+) Hz", sentence)
    step = re.search(r"an encoder step of (\S+) m", sentence)
    assert damping
    assert friction
    assert rate
    assert step
    period_s = 1.0 / float(rate[1])
    share = period_s / weak.period_s
    faster = {"period_s": period_s, "jitter_s": share * weak.jitter_s, "delay_s": share * weak.delay_s}
    strong = {"viscous_damping": float(damping[1]), "coulomb_friction": float(friction[1])}
    for fields in (strong, {**faster, "encoder_step": float(step[1])}):
        chosen = plan(switch, changed(weak, **fields))
        assert (chosen.structure, chosen.limited, str(chosen.verdict)) == ("direct", None, "good")
    for name in strong:
        less = plan(switch, changed(weak, **{**strong, name: 0.99 * strong[name]}))
        assert less.limited is not None


def test_a_device_that_no_realistic_rate_helps_gets_a_bound_and_a_scale_instead_of_a_rate() -> None:
    weak = DeviceProfile.load(example_profiles()["phantom-premium-1.0"][0])
    model = keyswitch_by_hand()
    chosen = plan(model, weak)
    sentence = str(chosen.verdict)
    assert "a rate of" not in sentence
    assert "--accept-force-error" not in sentence, "nearly the whole force would be missing"
    slopes = re.search(
        r"is too steep for this device: its slope is up to (\S+) N/m at (\S+) m(?: of the (\w+))?, and the "
        r"device renders (\S+) N/m at 1000 Hz",
        sentence,
    )
    assert slopes
    assert float(slopes[1]) > 10.0 * float(slopes[4])
    x = float(slopes[2]) + np.array([-1e-6, 1e-6])
    side = {"press": 1.0, "release": -1.0}.get(str(slopes[3]))
    assert np.diff(model.force(x, direction=side))[0] / 2e-6 == pytest.approx(float(slopes[1]), rel=0.05)
    limit = re.search(r"Even at 60000 Hz, .*, it needs device damping b >= (\S+) N\*s/m", sentence)
    assert limit
    scale = re.search(
        r"the slope is (\S+) times smaller: position times (\S+) and force times (\S+) give", sentence
    )
    assert scale
    x = np.linspace(float(model.lower[0]), float(model.upper[0]), 400)
    there_and_back = np.concatenate([x, x[::-1]])
    side = np.repeat([1.0, -1.0], 400)
    for enough, level in ((1.1, "good"), (0.25, "no")):
        force = model.force(there_and_back, direction=side) * float(scale[3]) / enough
        scaled = identify(
            Recording.from_arrays(
                there_and_back * float(scale[2]), force, direction=side, units={"position": "m", "force": "N"}
            )
        )
        assert plan(scaled, weak, energy_account=False).verdict.level == level


def test_a_steep_fall_is_stated_with_the_place_of_the_fall() -> None:
    """A pull that ends near 3 mm is steeper than the rise at the start of the travel."""
    weak = DeviceProfile.load(example_profiles()["phantom-premium-1.0"][0])
    model = keyswitch_by_hand(weight=[-4.0], beta=[[0.0028]], linear=[-8000.0], below="linear")
    sentence = str(plan(model, weak).verdict)
    slopes = re.search(
        r"its slope is down to (-\S+) N/m at (\S+) m of the press, and the device renders (-\S+) N/m",
        sentence,
    )
    assert slopes, sentence
    x = float(slopes[2]) + np.array([-1e-6, 1e-6])
    assert np.diff(model.force(x, direction=1.0))[0] / 2e-6 == pytest.approx(float(slopes[1]), rel=0.05)


def test_a_rate_is_advised_with_the_place_where_it_can_run() -> None:
    model = model_by_hand(weight=[0.0], linear=[40.0])
    knob = DeviceProfile(viscous_damping=2e-3, coulomb_friction=0.05)
    assert re.search(r"or a rate of 10\d00 Hz, which only motor controllers reach", plan(model, knob).needs)
    strong = DeviceProfile(viscous_damping=1e-2, coulomb_friction=0.05)
    assert re.search(r"or a rate of 20\d0 Hz$", plan(model, strong).needs)


@pytest.mark.parametrize("delay_s", [1e-5, 2e-3])
def test_a_profile_with_a_motor_controller_is_advised_to_run_the_model_there(delay_s: float) -> None:
    model = model_by_hand(weight=[0.0], linear=[20.0])
    timing = OnDevice(highest_rate_hz=40e3, delay_s=delay_s)
    knob = DeviceProfile(
        viscous_damping=1e-2, coulomb_friction=0.05, delay_s=2e-3, force_limit=10.0, on_device=timing
    )
    sentence = str(plan(model, knob).verdict)
    advised = re.search(r"--on-device (\S+)\)", sentence)
    if delay_s > 1e-3:
        assert advised is None, "a delay of 2 ms needs more damping at any rate"
        return
    assert advised
    assert str(plan(model, knob, on_device=float(advised[1])).verdict) == "good"
    assert plan(model, knob, on_device=0.7 * float(advised[1])).verdict.level != "good"


def test_friction_and_encoder_are_named_where_they_are_the_limit() -> None:
    coarse = DeviceProfile(id="coarse", coulomb_friction=1e-3, encoder_step=1e-3)
    chosen = plan(model_by_hand(), coarse, energy_account=False)
    assert chosen.verdict.level == "no"
    assert "needs device friction f_c >= 0.00" in chosen.needs
    assert " b >= " not in chosen.needs
    step = re.search(r"an encoder step of (\S+) rad", chosen.needs)
    assert step
    finer = plan(model_by_hand(), changed(coarse, encoder_step=float(step[1])))
    assert str(finer.verdict) == "good"


@pytest.mark.parametrize("structure", ["massless", "implicit", "explicit", "energy-consistent"])
@pytest.mark.parametrize("stiffness", [5.0, 50.0, 500.0])
def test_the_softness_of_a_coupling_is_a_force_error(structure: str, stiffness: float) -> None:
    model = model_by_hand()
    scheme = Scheme(structure=structure, coupling_stiffness=stiffness, mass=1e-3, object_damping=0.1)
    # position of the virtual object; the position of the handle is larger by the deflection of the coupling
    x = np.linspace(0.0, 0.6, 200_001)
    handle = x + model.force(x) / stiffness
    inside = handle <= 0.5
    error = np.abs(model.force(x) - model.force(handle))[inside].max()
    force = model.force(np.linspace(0.0, 0.5, 2001))
    found = Plan(model, scheme).force_error
    assert found.largest == pytest.approx(error, rel=1e-3)
    assert found.share == pytest.approx(error / np.ptp(force), rel=1e-3)


def test_the_softness_counts_on_both_strokes_of_a_hysteresis_model() -> None:
    model = keyswitch_by_hand()
    found = Plan(model, Scheme(coupling_stiffness=500.0, play_radius=1e-4)).force_error
    worst = 0.0
    for side in (1.0, -1.0):
        x = np.linspace(-0.001, 0.004, 100_001)
        handle = x + model.force(x, direction=side) / 500.0
        inside = (handle >= 0.0) & (handle <= 0.004)
        gap = model.force(x, direction=side) - model.force(handle, direction=side)
        worst = max(worst, float(np.abs(gap)[inside].max()))
    assert found.largest == pytest.approx(worst, rel=0.01)


def test_a_compensated_coupling_has_no_force_error_and_a_soft_one_is_refused() -> None:
    taken_out = plan(model_by_hand(), SMOOTH, coupling_stiffness=100.0)
    assert taken_out.scheme.compensated
    assert taken_out.force_error.share == 0.0
    soft = plan(keyswitch_by_hand(), slide(6.0), coupling_stiffness=100.0)
    assert soft.force_error.share > 0.1
    assert soft.verdict.level == "no"


def test_an_error_of_a_few_percent_is_usable_and_below_the_noticeable_good() -> None:
    model = model_by_hand()
    steepest = model.slope_range()[1]
    levels = {}
    for share in (0.97, 0.999, 1.01):
        device = DeviceProfile(id="knob", viscous_damping=0.5e-3 * share * steepest, coulomb_friction=0.005)
        chosen = plan(model, device)
        levels[share] = (chosen.verdict.level, chosen.force_error.share)
    assert levels[1.01] == ("good", 0.0)
    for level, error in levels.values():
        assert level == ("good" if error <= 0.01 else "usable")


def test_plan_with_large_force_error_is_stored_only_if_accepted() -> None:
    chosen = plan(keyswitch_by_hand(), "touch", energy_account=False)
    assert chosen.verdict.level == "no"
    with pytest.raises(InputError, match=r"a plan with verdict no is not stored: the largest force error"):
        chosen.stored()
    largest = chosen.force_error.share
    again = plan(keyswitch_by_hand(), "touch", accept_force_error=largest, energy_account=False)
    assert again.verdict.level == "usable"
    assert Plan.of(again.stored()).verdict == again.verdict


def test_a_plan_that_is_stable_only_is_usable() -> None:
    chosen = plan(model_by_hand(), DeviceProfile(id="knob", coulomb_friction=0.005), mass=1e-3)
    assert chosen.structure == "explicit"
    assert chosen.verdict.level == "usable"
    assert "passivity is not certified" in str(chosen.verdict)


def test_plan_that_is_stable_only_reports_the_needed_friction() -> None:
    chosen = plan(model_by_hand(), DeviceProfile(id="smooth bearing"))
    assert chosen.structure == "explicit"
    friction = re.search(r"needs device friction f_c >= (\S+) N\*m \(has 0\)", str(chosen.verdict))
    assert friction
    again = plan(model_by_hand(), DeviceProfile(id="bearing", coulomb_friction=float(friction[1])))
    assert (again.structure, str(again.verdict)) == ("direct", "good")


def test_the_verdict_comes_first_and_the_file_that_is_written_or_not_is_named(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keyswitch_by_hand().save("k.json")
    for words, code, level, written in (
        (["m.json", "--device", "bench-knob"], 0, "good", "nothing; -o OUT.json writes model and plan"),
        (["m.json", "--device", "bench-knob", "-o", "p.json"], 0, "good", "p.json"),
        (["k.json", "--device", "touch", "-o", "q.json"], 1, "no", "nothing, because the verdict is no"),
    ):
        assert main(["plan", *words]) == code
        lines = capsys.readouterr().out.splitlines()
        assert lines[0] == f"verdict: {level}"
        assert (
            re.sub(" +", " ", next(line for line in lines if line.startswith("written")))
            == f"written {written}"
        )
        passed = [
            line for line in lines if line.startswith(("certificate", "energy account", "account acts"))
        ]
        assert bool(passed) == (level != "no")
    assert Path("p.json").exists()
    assert not Path("q.json").exists()


def test_the_examples_are_one_json_object(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--examples", "--json"], ["--json", "--examples"]):
        assert main(["plan", *words]) == 0
        printed = json.loads(capsys.readouterr().out)
        assert list(printed) == list(example_profiles())
        assert Path(printed["touch"]["file"]).name == "touch.toml"
        assert printed["touch"]["sources"]


def test_a_device_is_taken_by_object_name_and_path(tmp_path: Path) -> None:
    model = model_by_hand(units={"position": "m", "force": "N"})
    file = example_profiles()["touch"][0]
    named = plan(model, "touch", accept_force_error=1.0)
    assert named.certificate is not None
    for device in (DeviceProfile.load(file), file, str(file)):
        other = plan(model, device, accept_force_error=1.0)
        assert other.certificate is not None
        assert other.certificate.device.to_dict() == named.certificate.device.to_dict()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"device": 3}, "device is a int: must be a DeviceProfile, the path of its TOML file, or one of"),
        ({"device": "tuoch"}, "device is 'tuoch': must be the path of an existing TOML file, or one of the"),
        ({"device": Path("none.toml")}, "there is no file none.toml"),
        ({"model": "press.json"}, "it must be a Model: make one with palpate.identify or palpate.load_model"),
        ({"model": None}, "model is None; it must be a Model: make one with palpate.identify"),
        ({"mass": "heavy"}, "mass is 'heavy': must be a number"),
        ({"accept_force_error": None}, "accept_force_error is None: must be a number"),
        ({"accept_force_error": -0.1}, "accept_force_error is -0.1: must be a finite number >= 0"),
        ({"play_radius": float("nan")}, "play_radius is nan: must be a finite number >= 0"),
    ],
)
def test_a_wrong_argument_of_plan_is_named(arguments: dict[str, Any], sentence: str) -> None:
    given = {"model": keyswitch_by_hand(), "device": "touch", **arguments}
    with pytest.raises(InputError, match=re.escape(sentence)):
        plan(**given)


def test_a_plan_by_hand_that_is_soft_can_be_stored_when_its_error_is_accepted() -> None:
    soft = Plan(model_by_hand(), Scheme(coupling_stiffness=2.0))
    with pytest.raises(InputError, match="a plan with verdict no is not stored"):
        soft.stored()
    assert replace(soft, accept_force_error=1.0).stored().plan is not None


def test_plot_of_a_plan_draws_identified_and_rendered_force_at_rest() -> None:
    model = model_by_hand()
    soft = Plan(model, Scheme(structure="massless", coupling_stiffness=20.0))
    axes = Figure().subplots()
    assert plot(soft, axes) is axes
    identified, rendered = (np.asarray(line.get_ydata()) for line in axes.lines)
    assert np.abs(rendered - identified).max() == pytest.approx(soft.force_error.largest, rel=1e-12)
    assert axes.get_ylabel() == "force [N·m]"
    strokes = Figure().subplots()
    plot(Plan(keyswitch_by_hand(), Scheme(structure="direct", play_radius=1e-5)), strokes)
    names = [str(line.get_label()) for line in strokes.lines]
    assert names == [
        "identified, press",
        "identified, release",
        "felt at rest: direct, press",
        "felt at rest: direct, release",
    ]
    np.testing.assert_array_equal(strokes.lines[0].get_ydata(), strokes.lines[2].get_ydata())


def test_a_plan_names_the_steepest_slope_with_the_rows_on_it() -> None:
    x, dx = np.linspace(0.0, 0.004, 800, retstep=True)
    force = 0.5 + 100.0 * x + 1.0 / (1.0 + np.exp(-(x - 0.003) / 1e-4))
    noise = np.random.default_rng(3).normal(0.0, 1e-3, len(x))
    model = identify(Recording.from_arrays(x, force + noise, units={"position": "m", "force": "N"}))
    text = plan(model, slide(50.0)).summary()["steepest slope"]
    found = re.fullmatch(r"(\S+) N/m at (\S+) m, known from (\d+) rows", text)
    assert found
    slope = np.gradient(force, dx)
    assert float(found[1]) == pytest.approx(slope.max(), rel=0.05)
    assert float(found[2]) == pytest.approx(0.003, abs=2e-5)
    assert int(found[3]) == pytest.approx(np.count_nonzero(slope > 0.5 * slope.max()), abs=5)


def test_a_plan_names_the_steepest_fall() -> None:
    falls = plan(keyswitch_by_hand(play_radius=1e-5), find_profile("voice-coil")).summary()["steepest fall"]
    assert re.fullmatch(r"-\S+ N/m at \S+ m of the (press|release)", falls)


def test_the_least_play_radius_is_advised_and_sufficient() -> None:
    model = keyswitch_by_hand(play_radius=1e-5)
    coil = find_profile("voice-coil")
    advised = re.search(r"give --play-radius (\S+), and after", str(plan(model, coil).verdict))
    assert advised
    radius = float(advised[1])
    proved = plan(model, coil, play_radius=radius)
    assert (proved.structure, proved.limited, proved.verdict.level) == ("direct", None, "good")
    assert f"after a reversal the force changes over {2.0 * radius:.4g} m" in proved.settings()["play radius"]
    assert plan(model, coil, play_radius=0.95 * radius).limited is not None
