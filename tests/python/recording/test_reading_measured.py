# SPDX-License-Identifier: Apache-2.0
"""Every measured file is read without options, or with the options that the error message suggests."""

from functools import cache
from pathlib import Path
from typing import Any

import pytest

from conftest import measured_data, sampled
from palpate import InputError, Recording, read_recording
from small_files import options_in, refusal

# Sets whose files are read without an option. A file of any other set is read, or its refusal names options
# that work: a new set needs no change here.
READ_WITHOUT_OPTIONS = {
    "afm_indentation",
    "keyswitches",
    "magnet_attraction",
    "motor_cogging",
    "organ_probing",
    "rubber_domes",
    "silicone_compression",
    "switch_springs",
    "vhb4910_viscoelastic",
}

VOLTAGE_OPTIONS = {
    "position": "speed_out",
    "force": "input_V",
    "units": {"speed_out": "rad", "input_V": "Nm"},
}

# Measured file, or folder of files -> options of reading that choose position, force and their units.
OPTIONS: dict[str, dict[str, object]] = {
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
        "units": {"position": "rad", "force": "Nm"},
    },
    "sysid_benchmarks/cascaded_tanks.csv": {
        "position": "pump_voltage_V",
        "force": "level_sensor_V",
        "units": {"pump_voltage_V": "m", "level_sensor_V": "N"},
        "rows": (0, 1024),
    },
    "sysid_benchmarks/coupled_drives_prbs_amp0p5.csv": VOLTAGE_OPTIONS,
    "sysid_benchmarks/coupled_drives_prbs_amp1.csv": VOLTAGE_OPTIONS,
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

# This file in the folder of the recordings is a table of published values, not a recording.
TEXT_TABLE = "sysid_benchmarks/published_results.csv"

MOST_REFUSALS = 3
"""Largest number of times that one file is refused: for its header, then for rows that cannot be used."""


def some_of_each_set(files: list[str]) -> list[Any]:
    """Returns the files; `make test` reads the first one of each set, and every twelfth one."""
    first_of_each_set = {file.split("/")[0]: file for file in reversed(files)}
    return sampled(files, *first_of_each_set.values(), *files[::12])


def measured_files() -> list[str]:
    """Returns every CSV file of the measured data; without it one name, for which the tests skip."""
    folder = measured_data()
    if folder is None:
        return ["keyswitches", "teacher_functions"]
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*.csv"))


def options_of(file: str) -> dict[str, object]:
    return OPTIONS.get(file) or OPTIONS[file.split("/")[0]]


@cache
def read_directly(path: Path) -> Recording:
    """Returns the recording in a file, which the tests only read."""
    return read_recording(path)


@pytest.mark.parametrize("file", some_of_each_set([file for file in measured_files() if file != TEXT_TABLE]))
def test_a_measured_file_is_read_directly_or_with_the_cures_of_its_refusals(data: Path, file: str) -> None:
    options: dict[str, object] = {}
    recording, refusals = None, 0
    while recording is None and refusals < MOST_REFUSALS:
        try:
            path = data / file
            recording = read_recording(path, **options) if options else read_directly(path)  # type: ignore[arg-type]
        except InputError as refused:
            if str(refused).endswith("A recording needs two columns of numbers, a position and a force"):
                assert file.split("/")[0] in ("silverbox", "sysid_benchmarks")  # voltages and levels
                return
            options, refusals = options_in(str(refused), options), refusals + 1
    assert recording is not None
    assert len(recording) >= 100
    if file.split("/")[0] in READ_WITHOUT_OPTIONS or file == "sysid_benchmarks/emps_estimation_250hz.csv":
        assert refusals == 0


@pytest.mark.parametrize(
    "file",
    some_of_each_set([file for file in measured_files() if file.split("/")[0] in READ_WITHOUT_OPTIONS]),
)
def test_every_row_of_a_measured_file_is_read_in_si(data: Path, file: str) -> None:
    recording = read_directly(data / file)
    lines = (data / file).read_text(encoding="utf-8").splitlines()
    header = next(line for line in lines if "," in line)
    assert len(recording) == len(lines) - lines.index(header) - 1
    assert recording.units["position"] in ("rad", "m")
    assert recording.units["force"] == ("A" if file.startswith("motor_cogging") else "N")
    assert (recording.direction is not None) == file.startswith(
        ("keyswitches", "rubber_domes", "switch_springs", "afm_indentation")
    )
    assert (recording.time is not None) == header.startswith(("time_", "Time"))


def test_the_first_note_of_a_measured_file_reports_columns_and_dialect(data: Path) -> None:
    recording = read_recording(data / "silicone_compression" / "EF10_0T_A1.csv")
    assert recording.notes[0] == (
        "position is Compression (mm), force is Load (N), time is Time (s), there is no direction; "
        "read as: 7 lines before the header in line 8"
    )
    assert recording.metadata["Cylinder Diameter"] == "50mm"


WITH_OPTIONS = [file for file in measured_files() if {file, file.split("/")[0]} & {*OPTIONS}]


@pytest.mark.parametrize(
    "file",
    sampled(
        WITH_OPTIONS,
        *{file if file in OPTIONS else file.split("/")[0]: file for file in WITH_OPTIONS}.values(),
    ),
)
def test_a_measured_file_is_read_with_stated_columns(data: Path, file: str) -> None:
    assert len(read_recording(data / file, **options_of(file))) >= 200  # type: ignore[arg-type]


def test_a_table_of_text_is_refused(data: Path) -> None:
    sentence = refusal(data / TEXT_TABLE)
    assert sentence.endswith("A recording needs two columns of numbers, a position and a force")


def test_a_time_that_restarts_is_read_as_two_blocks_with_a_pause(data: Path) -> None:
    options = {
        name: value
        for name, value in options_of("sysid_benchmarks/cascaded_tanks.csv").items()
        if name != "rows"
    }
    recording = read_recording(data / "sysid_benchmarks/cascaded_tanks.csv", **options)  # type: ignore[arg-type]
    assert recording.time is not None
    assert recording.time[1024] - recording.time[1023] == recording.time[1023]
    assert any("begins again in line 1026" in note for note in recording.notes)
