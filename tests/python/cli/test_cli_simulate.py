# SPDX-License-Identifier: Apache-2.0
"""palpate simulate and palpate demo."""

import json
import re
import signal
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import Recording, _core, load_model, read_recording, simulate
from palpate._core.device import DeviceProfile
from palpate._core.rendering import Scheme
from palpate._core.simulation import Hand
from palpate.cli import demo as demo_module
from palpate.cli.main import main

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
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    model_by_hand().save("m.json")
    return tmp_path


def test_what_was_rendered_is_written_and_measured(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "m.json", "--structure", "direct", "--duration-s", "0.5"]
    assert main([*arguments, "-o", "r.csv", "--plot", "r.png"]) == 0
    shown = capsys.readouterr()
    assert shown.err.startswith("read m.json: ")
    assert "simulated" in shown.err
    for name in ("end of tick", "mean of a tick", "below 50 Hz", "sampled"):
        assert f"force error, {name}" in shown.out
    assert len(read_recording("r.csv")) == 500
    assert Path("r.png").read_bytes().startswith(b"\x89PNG")


def test_json_names_the_structure_and_its_errors(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "m.json", "--structure", "implicit", "--json"]) in (0, 1)
    result = json.loads(capsys.readouterr().out)
    assert list(result) == JSON_FIELDS
    assert result["structure"] == "implicit"
    assert result["ticks"] == 4000
    assert result["status"] == {"Ok": 4000}


def test_the_numbers_of_the_scheme_are_options(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    errors = []
    for stiffness in ("50", "500"):
        assert main(["simulate", "m.json", "--coupling-stiffness", stiffness, "--json"]) in (0, 1)
        errors.append(json.loads(capsys.readouterr().out)["force_error_end"])
    assert errors[0] > 5 * errors[1], "a stiffer coupling loses less"


def test_predict_alone_renders_directly_with_less_force_error(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = []
    for arguments in (["--structure", "direct"], ["--predict", "2"]):
        assert main(["simulate", "m.json", *arguments, "--json"]) == 0
        results.append(json.loads(capsys.readouterr().out))
    plain, predicted = results
    assert predicted["structure"] == "direct"
    assert plain["force_error_mean"] > 3 * predicted["force_error_mean"]
    assert plain["force_error_band"] > 4 * predicted["force_error_band"]
    assert plain["force_error_work"] < 0.0
    assert abs(predicted["force_error_work"]) < 0.1 * abs(plain["force_error_work"])


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
        (["-o", "m.json"], "is an input as well"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_usage_is_one_sentence(
    arguments: list[str], sentence: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "m.json", *arguments]) == 2
    shown = capsys.readouterr()
    assert sentence in shown.err.splitlines()[-1]
    assert shown.out == ""
    assert [path.name for path in here.iterdir()] == ["m.json"]


def test_a_current_is_not_rendered(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model_by_hand(units={"position": "rad", "force": "A"}).save("a.json")
    assert main(["simulate", "a.json", "--json"]) == 2
    assert "--torque-constant-Nm-per-A" in json.loads(capsys.readouterr().out)["error"]


def test_a_rendering_that_ran_away_is_a_failure_of_the_work(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No known plan passes the checks and diverges; the verdict must not depend on that."""

    def run_away(*arguments: Any) -> Recording:
        recording = simulate(*arguments)
        status = recording.columns["status"].copy()
        status[-7:] = "NonFinite"
        return replace(recording, columns={**recording.columns, "status": status})

    monkeypatch.setattr("palpate.cli.simulate.render", run_away)
    assert main(["simulate", "m.json", "-o", "r.csv"]) == 1
    verdict, reason, *_ = capsys.readouterr().out.splitlines()
    assert verdict == "verdict: no"
    assert "ran away: 7 of 4000 ticks" in reason
    assert not Path("r.csv").exists()


def test_an_existing_recording_is_refused_and_replaced_with_force(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("r.csv").write_text("precious", encoding="utf-8")
    words = ["simulate", "m.json", "--structure", "direct", "--duration-s", "0.5", "-o", "r.csv"]
    assert main(words) == 2
    assert "r.csv exists already; choose another name, or replace it with --force" in capsys.readouterr().err
    assert Path("r.csv").read_text(encoding="utf-8") == "precious"
    assert main([*words, "--force"]) == 0
    assert len(read_recording("r.csv")) == 500


def test_the_verdict_follows_the_share_of_the_force_error(
    here: Path, capsys: pytest.CaptureFixture[str]
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
            assert f"the force error is {100 * share:.3g} % of the object's force range" in result["verdict"]
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
def test_a_simulated_time_without_bound_is_refused_at_once(
    duration: str, sentence: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "m.json", "--duration-s", duration]) == 2
    assert sentence in capsys.readouterr().err.splitlines()[-1]


class _RangError(Exception):
    pass


def _ring(_number: int, _frame: Any) -> None:
    raise _RangError


def test_a_signal_ends_a_long_simulation_within_a_fifth_of_a_second() -> None:
    """Takes the fastest of three attempts, because the test machine may be busy."""
    model = model_by_hand()
    scheme, device, hand = Scheme(), DeviceProfile(), Hand()
    late = []
    before = signal.signal(signal.SIGALRM, _ring)
    try:
        for _ in range(3):
            due = time.monotonic() + 0.3
            signal.setitimer(signal.ITIMER_REAL, 0.3)
            with pytest.raises(_RangError):
                _core.simulation.simulate(model, scheme, device, hand, 3600.0)
            late.append(time.monotonic() - due)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert min(late) < 0.2, late


@pytest.mark.parametrize("view", ["motion_driven", "force_driven"])
def test_a_signal_ends_a_long_closed_loop(view: str) -> None:
    model, scheme = model_by_hand(), Scheme(structure="implicit")
    before = signal.signal(signal.SIGALRM, _ring)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(_RangError):
            getattr(_core.simulation, view)(model, scheme, np.zeros(20_000_000), 1e-3)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def test_progress_is_called_and_other_threads_go_on() -> None:
    ticks: list[int] = []
    _core.simulation.simulate(
        model_by_hand(),
        Scheme(structure="implicit"),
        DeviceProfile(),
        Hand(),
        3000.0,  # longer than the time between two calls on a fast machine
        progress=ticks.append,
    )
    assert ticks[0] == 0
    assert ticks == sorted(ticks)
    assert len(ticks) > 1


@pytest.mark.parametrize("substeps", [0, -1, 1001, 2**31 - 1])
def test_substeps_have_a_bound(substeps: int) -> None:
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
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keyswitch_by_hand().save("k.json")
    assert main(["simulate", "k.json", "--structure", "direct", "--json", "--plot", "k.png"]) == 0
    assert json.loads(capsys.readouterr().out)["force_error_end"] < 0.01


@pytest.fixture(scope="module")
def demonstrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str, str]:
    """Runs the demo once; returns its folder, standard output and standard error."""
    from click.testing import CliRunner

    folder = tmp_path_factory.mktemp("a name with spaces") / "demo"
    result = CliRunner().invoke(demo_module.demo, ["-o", str(folder)], catch_exceptions=False)
    assert result.exit_code == 0
    return folder, result.stdout, result.stderr


def test_the_demo_names_every_file_it_writes(demonstrated: tuple[Path, str, str]) -> None:
    folder, out, _ = demonstrated
    written = {str(path) for path in folder.iterdir()}
    named = {line.partition(": ")[0] for line in out.splitlines() if line.startswith(str(folder))}
    assert named == written
    assert len([path for path in written if path.endswith(".png")]) == 3


def test_the_demo_calls_everything_simulated(demonstrated: tuple[Path, str, str]) -> None:
    folder, _, err = demonstrated
    assert err.splitlines()[0].startswith("everything in this demo is simulated")
    for name in ("sample-1.csv", "sample-2.csv"):
        assert any(
            "simulated" in f"{key} {value}" for key, value in read_recording(folder / name).metadata.items()
        )


def test_the_demo_renders_every_structure(demonstrated: tuple[Path, str, str]) -> None:
    _, out, _ = demonstrated
    rows = re.findall(
        r"^((?:direct|massless|implicit|explicit).*?)\s{2,}([\d.e-]+)((?:\s+[\d.e-]+){3})$", out, re.MULTILINE
    )
    assert [name for name, _, _ in rows] == [
        "direct, predict 4", "direct", "massless, compensated", "massless",
        "implicit, m = 0.001, B_o = 0", "implicit, m = 0.001, B_o = 0.5", "explicit, m = 0.001, B_o = 0.5",
    ]  # fmt: skip
    felt = [float(mean) for _, mean, _ in rows]
    assert 2.0 * felt[0] < felt[1] < felt[3] < felt[5]
    assert felt[2] == pytest.approx(felt[1], rel=0.1)


def test_the_demo_s_model_explains_the_fresh_recording_to_its_noise(
    demonstrated: tuple[Path, str, str],
) -> None:
    from palpate import verify

    folder, out, _ = demonstrated
    model = load_model(folder / "model.json")
    verification = verify(model, read_recording(folder / "sample-2.csv"))
    assert verification.fresh
    assert model.n_wavelets <= 10
    assert verification.rmse < 1.1 * 0.02, "noise of the sample: 0.02 N*m"
    assert re.search(rf"^wavelets +{model.n_wavelets}$", out, re.MULTILINE)


def test_the_demo_refuses_a_folder_that_cannot_be_before_it_works(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for target in ("nowhere/demo", "m.json", "m.json/demo", "/proc/demo", "/proc"):
        assert main(["demo", "-o", target]) == 2
        error = capsys.readouterr().err
        assert re.match(f"error: {target}(/model.json)? (cannot be written: |is a file, )", error)
        assert error.count("\n") == 1
