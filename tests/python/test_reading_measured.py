# SPDX-License-Identifier: Apache-2.0
"""Every file of the measured data: which resolve without a hint, and what the others ask for."""

from pathlib import Path

import pytest

from conftest import measured_data
from palpate import read_recording
from small_files import refusal

RESOLVES = {
    "afm_indentation",
    "keyswitches",
    "magnet_attraction",
    "motor_cogging",
    "organ_probing",
    "rubber_domes",
    "switch_springs",
    "vhb4910_viscoelastic",
}

VOLTS = {"position": "speed_out", "force": "input_V", "units": {"speed_out": "rad", "input_V": "Nm"}}

# File or set -> options that the refusals ask for, one after the other.
HINTS: dict[str, dict[str, object]] = {
    "davinci_grip": {"position": "back_angle_rad", "force": "back_torque_Nm"},
    "palpation_continuous": {"position": "pos_z_mm", "force": "force_z_N"},
    "silverbox": {
        "position": "output_V2_V",
        "force": "input_V1_V",
        "units": {"input_V1_V": "N", "output_V2_V": "m"},
    },
    "sysid_benchmarks/ball_and_beam.csv": {
        "position": "beam_angle",
        "force": "ball_position",
        "units": {"position": "rad", "force": "N"},
    },
    "sysid_benchmarks/cascaded_tanks.csv": {
        "position": "pump_voltage_V",
        "force": "level_sensor_V",
        "units": {"pump_voltage_V": "m", "level_sensor_V": "N"},
        "rows": (0, 1024),
    },
    "sysid_benchmarks/coupled_drives_prbs_amp0p5.csv": VOLTS,
    "sysid_benchmarks/coupled_drives_prbs_amp1.csv": VOLTS,
    "sysid_benchmarks/emps_validation_pulses_250hz.csv": {"force": "motor_force_N"},
    "sysid_benchmarks/f16_sysidentpy_subset_16384.csv": {
        "position": "x1",
        "force": "y",
        "units": {"x1": "m", "y": "N"},
    },
    "sysid_benchmarks/flexible_robot_arm.csv": {
        "position": "acceleration",
        "force": "reaction_torque",
        "units": {"acceleration": "rad", "reaction_torque": "Nm"},
    },
    "teacher_functions/zhang_benveniste_1d_test1001.csv": {
        "position": "x",
        "force": "y",
        "units": {"x": "rad", "y": "Nm"},
    },
    "teacher_functions/zhang_benveniste_1d_train200.csv": {
        "position": "x",
        "force": "y",
        "units": {"x": "rad", "y": "Nm"},
    },
    "teacher_functions": {
        "position": "x1",
        "force": "y",
        "inputs": ("x2",),
        "units": {"x1": "rad", "y": "Nm"},
    },
}

# A table of published figures beside the recordings: text, and no recording.
NO_RECORDING = "sysid_benchmarks/published_results.csv"


def measured_files() -> list[str]:
    """Every CSV file of the measured data; without it one name, for which the tests skip."""
    folder = measured_data()
    if folder is None:
        return ["keyswitches", "teacher_functions"]
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*.csv"))


def resolves(file: str) -> bool:
    return file.split("/")[0] in RESOLVES or file == "sysid_benchmarks/emps_estimation_250hz.csv"


def hint_for(file: str) -> dict[str, object]:
    return HINTS.get(file) or HINTS[file.split("/")[0]]


@pytest.mark.parametrize("file", [file for file in measured_files() if resolves(file)])
def test_a_measured_file_resolves_without_a_hint(data: Path, file: str) -> None:
    recording = read_recording(data / file)
    header, *lines = (data / file).read_text(encoding="utf-8").splitlines()
    assert len(recording) == len(lines)
    assert recording.units["position"] in ("rad", "m")
    assert recording.units["force"] == ("A" if file.startswith("motor_cogging") else "N")
    assert (recording.direction is not None) == file.startswith(
        ("keyswitches", "rubber_domes", "switch_springs", "afm_indentation")
    )
    assert (recording.time is not None) == ("time_" in header)


@pytest.mark.parametrize("file", [f for f in measured_files() if not resolves(f) and f != NO_RECORDING])
def test_an_ambiguous_measured_file_names_each_option_and_works_with_them(data: Path, file: str) -> None:
    hint = hint_for(file)
    given: dict[str, object] = {}
    for role in ("position", "force"):
        if role in hint:
            assert f"--{role} NAME" in refusal(data / file, **given)
            given[role] = hint[role]
            if "units" in hint:
                assert f"--units {hint[role]}=UNIT" in refusal(data / file, **given)
                units: dict[str, str] = dict(hint["units"])  # type: ignore[call-overload]
                symbol = units.get(str(hint[role])) or units[role]
                given["units"] = {**given.get("units", {}), str(hint[role]): symbol}  # type: ignore[dict-item]
    recording = read_recording(data / file, **hint)  # type: ignore[arg-type]
    assert len(recording) >= 200


def test_a_table_of_text_is_not_taken_for_a_recording(data: Path) -> None:
    assert "--position NAME" in refusal(data / NO_RECORDING)


def test_time_that_starts_again_is_refused_with_its_line(data: Path) -> None:
    hint = {
        name: value
        for name, value in hint_for("sysid_benchmarks/cascaded_tanks.csv").items()
        if name != "rows"
    }
    sentence = refusal(data / "sysid_benchmarks/cascaded_tanks.csv", **hint)
    assert sentence.startswith("cascaded_tanks.csv, line 1026: column time_s holds '0', no later than")
