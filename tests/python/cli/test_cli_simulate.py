# SPDX-License-Identifier: Apache-2.0
"""Tests of the commands palpate simulate and palpate demo."""

import json
import re
import signal
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from models_by_hand import keyswitch_by_hand, model_by_hand, relaxing_by_hand
from palpate import Recording, _core, load_model, read_recording, simulate
from palpate._core.rendering import Scheme
from palpate._core.simulation import Hand
from palpate.cli import demo as demo_module
from palpate.cli.main import main
from palpate.planning import DeviceProfile, example_profiles

JSON_FIELDS = ["verdict", "structure", "duration_s", "ticks", "force_error_end", "force_error_instant"]
JSON_FIELDS += [
    "force_error_mean",
    "force_error_band",
    "force_error_work",
    "force_error_share",
    "extrapolated",
    "status",
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    model_by_hand().save("m.json")
    return tmp_path


def test_the_rendered_recording_is_written_and_its_errors_are_printed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["simulate", "m.json", "--structure", "direct", "--duration-s", "0.5"]
    assert main([*arguments, "-o", "r.csv", "--plot", "r.png"]) == 0
    captured = capsys.readouterr()
    assert captured.err.startswith("read m.json: ")
    assert "simulated" in captured.err
    for name in ("end of tick", "mean of a tick", "below 50 Hz", "sampled"):
        assert f"force error, {name}" in captured.out
    assert "\nwritten                      r.csv, 500 rows\n" in captured.out
    assert "wrote r.png\n" in captured.err
    assert len(read_recording("r.csv")) == 500
    assert Path("r.png").read_bytes().startswith(b"\x89PNG")


def test_a_held_hand_feels_the_relaxation_of_a_memory(folder: Path) -> None:
    relaxing_by_hand().save("soft.json")
    assert main(["simulate", "soft.json", "--hold-at", "0.5", "-o", "held.csv"]) == 0
    held = read_recording("held.csv")
    assert held.force[100] > 1.7 * held.force[-1]
    assert held.force[-1] == pytest.approx(1.0, rel=0.01)
    assert held.position[-1] == pytest.approx(0.5, rel=0.01)


def test_a_held_position_outside_the_domain_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "m.json", "--hold-at", "0.7"]) == 2
    assert "the held position is 0.7: must be from 0 to 0.5, the domain" in capsys.readouterr().err


def test_json_names_the_structure_and_its_errors(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "m.json", "--structure", "implicit", "--json"]) in (0, 1)
    result = json.loads(capsys.readouterr().out)
    assert list(result) == JSON_FIELDS
    assert result["structure"] == "implicit"
    assert result["ticks"] == 4000
    assert result["status"] == {"Ok": 4000}


def test_the_settings_of_the_scheme_are_options(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    errors = []
    for stiffness in ("50", "500"):
        assert main(["simulate", "m.json", "--coupling-stiffness", stiffness, "--json"]) in (0, 1)
        errors.append(json.loads(capsys.readouterr().out)["force_error_end"])
    assert errors[0] > 5 * errors[1], "a stiffer coupling has a smaller force error"


def test_predict_alone_renders_directly_with_less_force_error(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = []
    for arguments in (["--structure", "direct"], ["--predict", "2"]):
        assert main(["simulate", "m.json", *arguments, "--json"]) == 0
        results.append(json.loads(capsys.readouterr().out))
    direct, predicted = results
    assert predicted["structure"] == "direct"
    assert direct["force_error_mean"] > 3 * predicted["force_error_mean"]
    assert direct["force_error_band"] > 4 * predicted["force_error_band"]
    assert direct["force_error_work"] < 0.0
    assert abs(predicted["force_error_work"]) < 0.1 * abs(direct["force_error_work"])


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--coupling-stiffness", "-3"], "coupling_stiffness is -3"),
        (["--coupling-stiffness", "nan"], "coupling_stiffness is nan"),
        (["--duration-s", "0"], "duration_s is 0"),
        (["--duration-s", "inf"], "duration_s is inf"),
        (["--structure", "explicit", "--mass", "0"], "mass is 0"),
        (["--structure", "explicit", "--coupling-stiffness", "3000"], "diverges"),
        (["--structure", "direct", "--compensated"], "compensated is set for the direct structure"),
        (["--compensated", "--coupling-stiffness", "5"], "coupling_stiffness is 5"),
        (["-o", "nowhere/r.csv"], "there is no folder nowhere"),
        (["-o", "m.json"], "is also an input"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_usage_of_simulate_is_reported_in_one_sentence(
    arguments: list[str], sentence: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "m.json", *arguments]) == 2
    captured = capsys.readouterr()
    assert sentence in captured.err.splitlines()[-1]
    assert captured.out == ""
    assert [path.name for path in folder.iterdir()] == ["m.json"]


def test_a_model_in_ampere_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model_by_hand(units={"position": "rad", "force": "A"}).save("a.json")
    assert main(["simulate", "a.json", "--json"]) == 2
    assert "--torque-constant-Nm-per-A" in json.loads(capsys.readouterr().out)["error"]


def test_a_diverged_rendering_exits_with_code_1(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No known plan passes the checks and then diverges, so the test makes the rendering diverge."""

    def diverging_simulate(*arguments: Any) -> Recording:
        recording = simulate(*arguments)
        status = recording.columns["status"].copy()
        status[-7:] = "NonFinite"
        return replace(recording, columns={**recording.columns, "status": status})

    monkeypatch.setattr("palpate.cli.simulate.render", diverging_simulate)
    assert main(["simulate", "m.json", "-o", "r.csv"]) == 1
    verdict, reason, *_ = capsys.readouterr().out.splitlines()
    assert verdict == "verdict: no"
    assert "diverged: 7 of 4000 ticks" in reason
    assert not Path("r.csv").exists()


def test_an_existing_recording_is_refused_and_replaced_with_force(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("r.csv").write_text("precious", encoding="utf-8")
    arguments = ["simulate", "m.json", "--structure", "direct", "--duration-s", "0.5", "-o", "r.csv"]
    assert main(arguments) == 2
    assert "r.csv exists already; choose another name, or replace it with --force" in capsys.readouterr().err
    assert Path("r.csv").read_text(encoding="utf-8") == "precious"
    assert main([*arguments, "--force"]) == 0
    assert len(read_recording("r.csv")) == 500


def test_the_verdict_follows_the_share_of_the_force_error(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    levels = {}
    for stiffness in ("10", "100", "3000"):
        code = main(["simulate", "m.json", "--coupling-stiffness", stiffness, "--json"])
        result = json.loads(capsys.readouterr().out)
        level = result["verdict"].partition(":")[0]
        levels[stiffness] = level, code
        share = result["force_error_share"]
        assert level == ("no" if share > 0.1 else "usable" if share > 0.02 else "good"), share
        assert code == (1 if level == "no" else 0)
        if level != "good":
            assert (
                f"the RMS force error in motion is {100 * share:.3g} % of the object's force range"
                in result["verdict"]
            )
    assert levels["10"] == ("no", 1)
    assert levels["100"] == ("usable", 0)
    assert levels["3000"] == ("good", 0)
    assert main(["simulate", "m.json", "--coupling-stiffness", "10"]) == 1
    assert capsys.readouterr().out.splitlines()[0] == "verdict: no"


@pytest.mark.parametrize(
    ("duration", "sentence"),
    [
        ("1e9", "duration_s is 1e+09, which is 1e+12 periods of 0.001 s: must be at most 3600000 periods"),
        ("3600.001", "which is 3600001 periods of 0.001 s: must be at most 3600000 periods"),
        ("1e300", "duration_s is 1e+300, which is 1e+303 periods"),
        ("1.7e308", "which is inf periods"),
        ("inf", "duration_s is inf, which is inf periods"),
        ("nan", "duration_s is nan, must be at least one period"),
        ("-1", "duration_s is -1, must be at least one period"),
        ("1e-9", "duration_s is 1e-09, must be at least one period"),
    ],
)
def test_a_simulated_time_out_of_range_is_refused_before_the_work(
    duration: str, sentence: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "m.json", "--duration-s", duration]) == 2
    assert sentence in capsys.readouterr().err.splitlines()[-1]


class _AlarmError(Exception):
    pass


def _raise_alarm(_number: int, _frame: Any) -> None:
    raise _AlarmError


def test_a_signal_ends_a_long_simulation_within_200_ms_of_processor_time() -> None:
    model = model_by_hand()
    scheme, device, hand = Scheme(), DeviceProfile(), Hand()
    previous_handler = signal.signal(signal.SIGPROF, _raise_alarm)
    try:
        due_s = time.process_time() + 0.3
        signal.setitimer(signal.ITIMER_PROF, 0.3)
        with pytest.raises(_AlarmError):
            _core.simulation.simulate(model, scheme, device, hand, 3600.0)
        assert time.process_time() - due_s < 0.2
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, previous_handler)


@pytest.mark.parametrize("simulation_name", ["motion_driven", "force_driven"])
def test_a_signal_ends_a_long_closed_loop(simulation_name: str) -> None:
    model, scheme = model_by_hand(), Scheme(structure="implicit")
    previous_handler = signal.signal(signal.SIGALRM, _raise_alarm)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(_AlarmError):
            getattr(_core.simulation, simulation_name)(model, scheme, np.zeros(20_000_000), 1e-3)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous_handler)


def test_progress_is_called_during_the_simulation() -> None:
    ticks: list[int] = []

    def report(tick: int) -> None:
        ticks.append(tick)
        if len(ticks) == 3:
            raise _AlarmError

    scheme = Scheme(structure="implicit")
    with pytest.raises(_AlarmError):
        _core.simulation.simulate(model_by_hand(), scheme, DeviceProfile(), Hand(), 3600.0, progress=report)
    assert 0 == ticks[0] < ticks[1] < ticks[2] < 3_600_000


@pytest.mark.parametrize("substeps", [0, -1, 1001, 2**31 - 1])
def test_substeps_outside_their_bounds_are_refused(substeps: int) -> None:
    with pytest.raises(ValueError, match=rf"substeps is {substeps}, must be 1 to 1000"):
        _core.simulation.simulate(
            model_by_hand(),
            Scheme(),
            DeviceProfile(),
            Hand(),
            0.1,
            substeps,
        )


def test_a_model_with_hysteresis_is_rendered_with_a_play_radius(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keyswitch_by_hand().save("k.json")
    assert main(["simulate", "k.json", "--structure", "direct", "--json", "--plot", "k.png"]) == 0
    assert json.loads(capsys.readouterr().out)["force_error_end"] < 0.01


@pytest.fixture(scope="module")
def demo_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str, str]:
    """Runs the demo once; returns its folder, standard output and standard error."""
    from click.testing import CliRunner

    folder = tmp_path_factory.mktemp("a name with spaces") / "demo"
    result = CliRunner().invoke(demo_module.demo, ["-o", str(folder)], catch_exceptions=False)
    assert result.exit_code == 0
    return folder, result.stdout, result.stderr


def test_the_demo_names_every_file_it_writes(demo_run: tuple[Path, str, str]) -> None:
    folder, output, _ = demo_run
    written = {str(path) for path in folder.iterdir()}
    named = {line.partition(": ")[0] for line in output.splitlines() if line.startswith(str(folder))}
    assert named == written
    assert len([path for path in written if path.endswith(".png")]) == 3


def test_the_demo_labels_all_its_data_as_simulated(demo_run: tuple[Path, str, str]) -> None:
    folder, _, messages = demo_run
    assert messages.splitlines()[0].startswith("all data of this demo is simulated")
    for name in ("sample-1.csv", "sample-2.csv"):
        assert any(
            "simulated" in f"{key} {value}" for key, value in read_recording(folder / name).metadata.items()
        )


def test_the_demo_renders_every_structure(demo_run: tuple[Path, str, str]) -> None:
    _, output, _ = demo_run
    rows = re.findall(
        r"^((?:direct|massless|implicit|explicit).*?)\s{2,}([\d.e-]+)((?:\s+[\d.e-]+){3})$",
        output,
        re.MULTILINE,
    )
    assert [name for name, _, _ in rows] == [
        "direct, predict 4", "direct", "massless, compensated", "massless",
        "implicit, m = 0.001, B_o = 0", "implicit, m = 0.001, B_o = 0.5", "explicit, m = 0.001, B_o = 0.5",
    ]  # fmt: skip
    mean_errors = [float(mean) for _, mean, _ in rows]
    assert 2.0 * mean_errors[0] < mean_errors[1] < mean_errors[3] < mean_errors[5]
    assert mean_errors[2] == pytest.approx(mean_errors[1], rel=0.1)


def test_the_error_of_the_demo_model_on_the_fresh_recording_is_the_noise(
    demo_run: tuple[Path, str, str],
) -> None:
    from palpate import verify

    folder, output, _ = demo_run
    model = load_model(folder / "model.json")
    verification = verify(model, read_recording(folder / "sample-2.csv"))
    assert verification.fresh
    assert model.n_wavelets <= 10
    assert verification.rmse < 1.1 * 0.02, "noise of the sample: 0.02 N*m"
    assert re.search(rf"^wavelets +{model.n_wavelets}$", output, re.MULTILINE)


def test_the_demo_refuses_a_folder_that_cannot_be_created_before_the_work(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for target in ("nowhere/demo", "m.json", "m.json/demo", "/proc/demo", "/proc"):
        assert main(["demo", "-o", target]) == 2
        error = capsys.readouterr().err
        assert re.match(f"error: {target}(/model.json)? (cannot be written: |is a file, )", error)
        assert error.count("\n") == 1


def test_every_device_is_simulated_without_a_certificate(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, (file, _) in example_profiles().items():
        device = DeviceProfile.load(file)
        if device.position_unit != "rad":
            continue
        arguments = ["simulate", "m.json", "--device", name, "--duration-s", "0.5", "-o", f"{name}.csv"]
        assert main([*arguments, "--json"]) in (0, 1), name
        result = json.loads(capsys.readouterr().out)
        assert f"nothing is proved on {device.id}: this is one simulated motion" in result["verdict"]
        assert result["structure"] == "direct"
        assert result["ticks"] == round(0.5 / device.period_s), name


def test_a_plan_keeps_its_certificate_on_its_own_device_only(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", "m.json", "--device", "bench-knob", "-o", "p.json"]) == 0
    capsys.readouterr()
    for name, is_other in (("bench-knob", False), ("smartknob", True)):
        main(["simulate", "p.json", "--device", name, "--json"])
        assert ("nothing is proved" in json.loads(capsys.readouterr().out)["verdict"]) is is_other


def test_a_device_in_another_unit_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "m.json", "--device", "touch"]) == 2
    assert "position_unit of the device touch is m: must be rad" in capsys.readouterr().err


def test_the_positions_that_the_hand_reached_are_printed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "m.json", "--structure", "direct"]) == 0
    shown = re.search(r"handle +\S+ to \S+ rad, (\S+) % of the domain\n", capsys.readouterr().out)
    assert shown
    assert float(shown[1]) > 95.0
