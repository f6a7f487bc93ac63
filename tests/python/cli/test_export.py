# SPDX-License-Identifier: Apache-2.0
"""Tests palpate export: formats, refusals, exit codes and outputs."""

import json
import re
import shlex
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import palpate
from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import DeviceProfile, Model, Scheme
from palpate._core.rendering import default_play_radius
from palpate._core.stability import certify
from palpate.cli.main import main
from palpate.export import exported
from palpate.model import model_file
from palpate.planning import Plan


@pytest.fixture
def planned(tmp_path: Path) -> Path:
    """Returns the file of a model that is certified for the bench knob."""
    model = model_by_hand(alpha=[[5.0]], weight=[0.02], linear=[1.0])
    plan = palpate.plan(model, "bench-knob")
    assert plan.certificate.certified
    return plan.stored().save(tmp_path / "knob.json")


def exported_json(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, object]:
    code = main([*map(str, arguments), "--json"])
    result = json.loads(capsys.readouterr().out)
    return result | {"code": code}


def macro(header: str, name: str) -> float:
    """Returns the number of a macro."""
    found = re.search(rf"#define {name} (\S+)f ", header)
    assert found is not None
    return float(found[1])


def test_c_header_states_rate_profile_and_errors_of_a_certified_model(
    planned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    header = tmp_path / "my-knob.h"
    result = exported_json(capsys, "export", planned, "--c", "-o", header)
    assert result["code"] == 0
    assert result["verdict"] == "good"
    assert result["certified"] is True
    assert result["force_error_share"] <= 1e-6  # type: ignore[operator]
    assert result["slope_error_share"] <= 3e-5  # type: ignore[operator]
    text = header.read_text(encoding="utf-8")
    assert f"PALPATE_PROFILE != {result['profile']:#010x}" in text
    assert "PALPATE_RATE_HZ != 1000" in text
    assert f"#define my_knob_FINGERPRINT UINT64_C(0x{result['fingerprint']})" in text
    assert palpate.load_model(planned).certificate["fingerprint"] in text
    assert "NAME" not in text
    assert "//@" not in text


def test_first_line_is_the_verdict(planned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(planned), "--c", "-o", str(tmp_path / "knob.h")]) == 0
    assert capsys.readouterr().out.startswith("verdict: good\n")


def test_model_without_certificate_is_refused_with_the_cure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand().save(tmp_path / "m.json")
    assert main(["export", str(model), "--c", "-o", str(tmp_path / "m.h")]) == 2
    sentence = capsys.readouterr().err
    assert "palpate plan" in sentence
    assert "--uncertified" in sentence
    assert not (tmp_path / "m.h").exists()


def test_suggested_command_quotes_the_file_name_like_a_shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    name = "Anna's $(knob); 2.json"
    model_by_hand().save(name)
    assert main(["export", name, "--c", "-o", "m.h"]) == 2
    command = capsys.readouterr().err.split("certify it with ")[1].split(", or export")[0]
    assert shlex.split(command) == ["palpate", "plan", name, "--device", "PROFILE", "-o", name]


def test_the_prefix_of_the_macros_is_refused_as_the_name_of_a_model(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand().save(tmp_path / "m.json")
    options = ["--uncertified", "--encoder-step", "1e-4", "--force-limit", "1", "--name", "PALPATE"]
    assert main(["export", str(model), "--c", *options, "-o", str(tmp_path / "m.h")]) == 2
    assert "the name is 'PALPATE': must be an identifier of C and no reserved word" in capsys.readouterr().err


def test_uncertified_header_says_so_and_compares_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand().save(tmp_path / "m.json")
    header = tmp_path / "m.h"
    options = ["--uncertified", "--encoder-step", 1e-4, "--force-limit", 1.5]
    result = exported_json(capsys, "export", model, "--c", *options, "-o", header)
    assert result["code"] == 0
    assert str(result["verdict"]).startswith("usable: the program has no certificate")
    assert (result["force_limit"], result["needed_friction"]) == (1.5, 0.0)
    text = header.read_text(encoding="utf-8")
    assert "No certificate" in text
    assert "Force limit: 1.5 N*m." in text
    assert (macro(text, "m_FORCE_LIMIT"), macro(text, "m_NEEDED_FRICTION")) == (1.5, 0.0)
    assert "PALPATE_RATE_HZ" not in text
    assert main(["export", str(model), "--c", *map(str, options), "-o", str(header)]) == 0
    assert "force limit  1.5 N*m" in capsys.readouterr().out


def test_every_header_limits_its_force(
    planned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    header = tmp_path / "knob.h"
    model = model_by_hand().save(tmp_path / "m.json")
    for options, sentence in (
        ([str(model), "--uncertified", "--encoder-step", "1e-4"], "state the largest force of the device"),
        ([str(model), "--uncertified", "--encoder-step", "1e-4", "--force-limit", "0"], "must be a finite"),
        ([str(model), "--uncertified", "--encoder-step", "1e-4", "--force-limit", "inf"], "must be a finite"),
        ([str(planned), "--force-limit", "9"], "the force limit of bench-knob is 5: leave it out"),
    ):
        assert main(["export", *options, "--c", "-o", str(header)]) == 2
        assert sentence in capsys.readouterr().err
        assert not header.exists()
    assert main(["export", str(planned), "--c", "-o", str(header)]) == 0
    assert macro(header.read_text(encoding="utf-8"), "knob_FORCE_LIMIT") == 5.0


MODELS = Path(__file__).parents[2] / "models" / "good"


def test_the_force_error_of_the_plan_is_written_with_that_of_the_program(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, header = MODELS / "plan_network_hysteresis.json", tmp_path / "limited.h"
    error = Plan.of(palpate.load_model(model)).force_error
    result = exported_json(capsys, "export", model, "--c", "-o", header)
    assert result["plan_force_error"] == asdict(error)
    assert "3.55 % of the force range" in str(result["verdict"])
    text = "0.0547 N at 0.367 m, 3.55 % of the range; RMS 0.0497 N"
    assert text in " ".join(header.read_text(encoding="utf-8").replace(" * ", " ").split())
    identified, rendered = palpate.load_model(model), Plan.of(palpate.load_model(model)).rendered
    change = max(
        abs(rendered.force(error.at, direction=side) - identified.force(error.at, direction=side))
        for side in (1.0, -1.0)
    )
    assert change == pytest.approx(error.largest)


def test_a_plan_with_the_verdict_no_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, header = MODELS / "certificate_stable.json", tmp_path / "soft.h"
    assert main(["export", str(model), "--c", "--uncertified", "-o", str(header)]) == 2
    refusal = capsys.readouterr().err
    assert "the verdict of the plan is no: the largest force error at rest is 0.586 N*m" in refusal
    assert "Plan the model for another device, or give --accept-model" in refusal
    assert not header.exists()


def test_hysteresis_without_a_play_radius_is_exported_with_the_default_of_simulate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, header = MODELS / "hysteresis.json", tmp_path / "loop.h"
    arguments = ["--uncertified", "--encoder-step", "1e-4", "--force-limit", "5"]
    assert main(["export", str(model), "--c", "-o", str(header), *arguments]) == 0
    radius = default_play_radius(palpate.load_model(model), 1e-4)
    assert f"play radius  {radius:.4g} m\n" in capsys.readouterr().out
    assert f"#define loop_PLAY_RADIUS {radius:g} " in header.read_text(encoding="utf-8")


def friction_at_its_bound(model: Model, reserve: float, **changes: Any) -> DeviceProfile:
    """Returns a device with the friction that the certificate of a model needs, plus a reserve [N*m]."""
    knob = {"id": "knob", "encoder_step": 2.0 * np.pi / 2**20, "viscous_damping": 0.5, "force_limit": 2.6}
    strong = DeviceProfile(**(knob | {"coulomb_friction": 1.0} | changes))
    certificate = certify(model, Scheme(structure="direct"), strong)
    needed = next(line.right for line in certificate.inequalities if line.id == "friction-steps")
    return DeviceProfile(**strong.to_dict() | {"coulomb_friction": needed + reserve})


def test_program_whose_rounding_breaks_the_certificate_is_refused_with_the_cure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, header = model_by_hand(), tmp_path / "knob.h"
    path = tmp_path / "knob.json"

    def export(device: DeviceProfile, *options: str) -> int:
        chosen = palpate.plan(model, device, predict="off")
        assert (chosen.structure, chosen.limited, chosen.certificate.certified) == ("direct", None, True)
        chosen.stored().save(path)
        header.unlink(missing_ok=True)
        return main(["export", str(path), "--c", "-o", str(header), *options])

    exact = friction_at_its_bound(model, 1e-8)
    assert export(exact) == 2
    sentence = capsys.readouterr().err.splitlines()[-1]
    assert "the certificate does not hold for the program in single precision" in sentence
    assert "errors of the force are up to epsilon = 5.59e-06: " in sentence
    assert "f_c >= L Delta / 2 + Delta_F / 2 + epsilon needs " in sentence
    assert sentence.endswith("; export it with --precision double")
    assert not header.exists()
    assert export(exact, "--precision", "double") == 0
    assert "for the errors of the program" in " ".join(capsys.readouterr().out.split())

    assert export(exact, "--uncertified") == 0
    assert capsys.readouterr().out.startswith("verdict: usable\n  the program has no certificate")
    text = header.read_text(encoding="utf-8")
    assert "No certificate" in text
    assert "#define knob_CERTIFICATE_FINGERPRINT UINT64_C(0x0)" in text

    assert export(friction_at_its_bound(model, 1e-16)) == 2
    sentence = capsys.readouterr().err.splitlines()[-1]
    assert "plan the model for a device with a coulomb_friction of at least " in sentence
    enough = DeviceProfile(**exact.to_dict() | {"coulomb_friction": float(sentence.rsplit(" ", 1)[1])})
    assert export(enough) == 0
    capsys.readouterr()
    numbers = exported_json(capsys, "export", path, "--c", "-o", header)
    assert numbers["needed_friction"] <= enough.coulomb_friction  # type: ignore[operator]
    text = header.read_text(encoding="utf-8")
    assert (
        f"Device friction: {enough.coulomb_friction:.4g} >= needed {numbers['needed_friction']:.4g}" in text
    )
    defined = macro(text, "knob_NEEDED_FRICTION")
    assert numbers["needed_friction"] <= defined <= 1.00001 * enough.coulomb_friction  # type: ignore[operator]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--uncertified", "--force-limit"),
        ("--uncertified --force-limit 1", "--encoder-step"),
        ("--uncertified --encoder-step 0.2 --force-limit 1", "an eighth of the model's domain"),
        ("--uncertified --encoder-step 1e-4 --force-limit 1 --name 2fast", "identifier of C"),
        ("--uncertified --encoder-step 1e-4 --force-limit 1 --name for", "identifier of C"),
    ],
)
def test_impossible_export_is_refused_in_one_sentence(
    options: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand().save(tmp_path / "m.json")
    assert main(["export", str(model), "--c", "-o", str(tmp_path / "m.h"), *options.split()]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert words in error
    assert not (tmp_path / "m.h").exists()


def test_encoder_step_of_a_certified_device_cannot_be_changed(
    planned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["export", str(planned), "--c", "--encoder-step", "1e-3", "-o", str(tmp_path / "m.h")]
    assert main(command) == 2
    assert "leave it out" in capsys.readouterr().err


def test_format_is_required(planned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(planned), "-o", str(tmp_path / "m.h")]) == 2
    assert "one of --c, --fmu, --table, --schema, --mcap" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "unused"),
    [
        ("m.json --fmu --encoder-step 1e-4", "--encoder-step"),
        ("m.json --fmu --force-limit 1", "--force-limit"),
        ("m.json --fmu --precision single", "--precision"),
        ("m.json --fmu --uncertified", "--uncertified"),
        ("m.json --table --name knob", "--name"),
        ("m.json --table --position x", "--position"),
        ("m.json --schema", "m.json"),
        ("m.json --mcap --force-limit 1", "--force-limit"),
        ("m.json --c --invalid refuse", "--invalid"),
    ],
)
def test_a_parameter_that_the_format_does_not_use_is_refused(
    arguments: str,
    unused: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    model_by_hand().save("m.json")
    assert main(["export", *arguments.split(), "-o", "out"]) == 2
    kind = arguments.removeprefix("m.json ").split()[0]
    message = f"error: {unused} is given, but {kind} does not use it: leave it out\n"
    assert capsys.readouterr().err == message
    assert not Path("out").exists()


def test_failed_comparison_writes_nothing_and_exits_with_code_1(
    planned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Failed:
        passed = False
        places, force, slope, energy, step = 10, 2.5, 0.0, 0.0, 0.0

    made = exported.Exported.of
    monkeypatch.setattr(exported.Exported, "of", lambda request: replace(made(request), check=Failed()))
    header = tmp_path / "knob.h"
    assert main(["export", str(planned), "--c", "-o", str(header)]) == 1
    assert "2.5 times the proved bound; nothing was written" in " ".join(capsys.readouterr().out.split())
    assert not header.exists()


@pytest.mark.parametrize(
    ("position", "force", "energy"),
    [("count", "N", "N*count"), ("count", "N*m", "N*m*count"), ("rad", "A", "A*rad")],
)
def test_table_curve_and_header_state_the_units_of_the_model(
    position: str, force: str, energy: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand(units={"position": position, "force": force}).save(tmp_path / "m.json")
    out = tmp_path / "out"
    assert main(["export", str(model), "--table", "-o", str(out)]) == 0
    assert out.read_text().splitlines()[0] == (
        f"position_{position},force_{force},slope_{force}/{position},energy_{energy}"
    )
    assert main(["export", str(model), "--knots", "3", "-o", str(out)]) == 0
    assert out.read_text().splitlines()[0] == f"travel_percent,position_{position},force_{force}"
    if force != "A":
        options = ["--uncertified", "--encoder-step", "1e-4", "--force-limit", "1"]
        assert main(["export", str(model), "--c", *options, "-o", str(out)]) == 0
        header = out.read_text()
        assert f"position in {position}, force in {force}." in header
        assert f"[{force}/{position}]" in header
        assert re.search(rf"energy up to \S+ {re.escape(energy)}\n", header)


@pytest.mark.parametrize(
    ("position", "force", "cure"),
    [
        ("count", "N", "--units NAME=mm/35 for 35 steps a mm"),
        ("count", "N*m", "--units NAME=rev/4096 for 4096 steps a turn"),
        ("rad", "N", "multiply the recorded force by its lever arm"),
        ("rad", "A", "--torque-constant-Nm-per-A"),
    ],
)
def test_fmu_is_refused_in_other_units_than_those_of_mechanics(
    position: str, force: str, cure: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand(units={"position": position, "force": force}).save(tmp_path / "m.json")
    assert main(["export", str(model), "--fmu", "-o", str(tmp_path / "m.fmu")]) == 2
    assert cure in capsys.readouterr().err
    assert not (tmp_path / "m.fmu").exists()


@pytest.mark.parametrize("kind", ["--table", "--fmu", "--knots 3", "--c --uncertified"])
@pytest.mark.parametrize(
    ("name", "value", "unit"), [("damping", 1.5, "N*m*s/rad"), ("mass", 0.002, "kg*m^2")]
)
def test_a_format_refuses_a_part_of_the_force_that_it_does_not_contain(
    kind: str, name: str, value: float, unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = model_by_hand(**{name: value}).save(tmp_path / "m.json")
    assert main(["export", str(model), *kind.split(), "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert f"a {name} of {value:g} {unit}, which " in error
    assert error.endswith("contain: identify the model with --inputs position\n")
    assert not (tmp_path / "out").exists()


def test_table_has_the_forces_of_the_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = keyswitch_by_hand(play_radius=5e-5)
    path = model.save(tmp_path / "key.json")
    assert main(["export", str(path), "--table", "-o", str(tmp_path / "key.csv")]) == 0
    table = pd.read_csv(tmp_path / "key.csv")
    assert list(table.columns) == [
        "position_m",
        "press_force_N",
        "press_slope_N/m",
        "release_force_N",
        "release_slope_N/m",
        "energy_J",
    ]
    x = table["position_m"].to_numpy()
    np.testing.assert_array_equal(table["press_force_N"], model.force(x, direction=1.0))
    assert x[0] == model.lower[0]
    assert x[-1] == model.upper[0]


def test_schema_needs_no_model(tmp_path: Path) -> None:
    assert main(["export", "--schema", "-o", str(tmp_path / "schema.json")]) == 0
    stored = Path(model_file.__file__).with_name("model.schema.json").read_text(encoding="utf-8")
    assert (tmp_path / "schema.json").read_text(encoding="utf-8") == stored


def test_model_is_required_for_a_header(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--c", "-o", str(tmp_path / "m.h")]) == 2
    assert "no model is given" in capsys.readouterr().err


def test_a_recording_is_exported_as_mcap_which_the_mcap_reader_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    reader = pytest.importorskip("mcap.reader")
    monkeypatch.chdir(tmp_path)
    rows = "\n".join(f"{k / 1000},{k / 10},{k / 5}" for k in range(20))
    Path("press.csv").write_text(f"time_s,depth_mm,force_N\n{rows}\n")
    assert main(["export", "press.csv", "--mcap", "-o", "press.mcap", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert (printed["format"], printed["rows"], printed["verdict"]) == ("mcap", 20, "good")
    with Path("press.mcap").open("rb") as stream:
        messages = [
            (message.log_time, json.loads(message.data))
            for _, _, message in reader.make_reader(stream).iter_messages()
        ]
    assert messages[3] == (3_000_000, {"time_s": 0.003, "position_m": 0.3e-3, "force_N": 0.6})
    before = Path("press.mcap").read_bytes()
    for words, sentence in (
        (["press.csv", "--mcap", "-o", "press.mcap"], "press.mcap exists already"),
        (["press.csv", "--mcap", "-o", "press.bin"], "its name must end in .mcap"),
        (["--mcap", "-o", "other.mcap"], "no recording is given"),
    ):
        assert main(["export", *words]) == 2
        assert sentence in capsys.readouterr().err
    assert Path("press.mcap").read_bytes() == before


def test_a_flight_record_is_exported_as_mcap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mcap.reader")
    monkeypatch.chdir(tmp_path)
    model_by_hand().save("m.json")
    assert main(["simulate", "m.json", "--structure", "direct", "--duration-s", "0.1", "-o", "felt.csv"]) in (
        0,
        1,
    )
    assert main(["export", "felt.csv", "--mcap", "-o", "felt.mcap"]) == 0
    csv, mcap = (palpate.read_recording(name) for name in ("felt.csv", "felt.mcap"))
    np.testing.assert_array_equal(mcap.position, csv.position)
    np.testing.assert_array_equal(mcap.force, csv.force)
    assert list(mcap.columns) == list(csv.columns)
