# SPDX-License-Identifier: Apache-2.0
"""Files of many instruments and headers are read, or refused with printed options that read them."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import instruments
from palpate import InputError, Recording, read_recording
from small_files import options_in

INSTRUMENTS = list(instruments.TEXT)

READ_WITHOUT_OPTIONS = len(INSTRUMENTS) - 12
"""Least number of instruments whose files need no option."""


@cache
def file_of(instrument: Callable[[instruments.Press], str]) -> tuple[Recording, int]:
    """Returns the recording in a file of an instrument and the number of refusals; the tests only read it."""
    with TemporaryDirectory() as folder:
        return read_with_printed_options(instruments.write(instrument, Path(folder)))


def read_with_printed_options(path: Path) -> tuple[Recording, int]:
    """Reads a file, at the first refusal with the printed options; returns the number of refusals."""
    try:
        return read_recording(path), 0
    except InputError as refused:
        return read_recording(path, **options_in(str(refused))), 1  # type: ignore[arg-type]


@pytest.mark.parametrize("instrument", INSTRUMENTS, ids=lambda each: each.__name__)
def test_a_file_of_an_instrument_is_read_directly_or_with_the_printed_options(
    instrument: Callable[[instruments.Press], str],
) -> None:
    recording, _ = file_of(instrument)
    press = instruments.press()
    kept = np.ones(len(press.time_s), dtype=bool)
    if instrument is instruments.unread_cells:
        kept[[3, 70]] = False
    to_position, to_force = 1e-3, 1.0
    if instrument is instruments.torque_tester:
        to_position, to_force = np.pi / 180.0, 4.4482216152605 / 16 * 0.0254
    if instrument is instruments.serial_log:
        to_position = 1e3  # steps of the motor
    np.testing.assert_allclose(
        recording.position, press.position_mm[kept] * to_position, atol=1e-6 * to_position
    )
    np.testing.assert_allclose(recording.force, press.force_N[kept] * to_force, atol=2e-6 * to_force)
    assert (recording.time is None) == (instrument in instruments.WITHOUT_TIME)
    if recording.time is not None:
        np.testing.assert_allclose(recording.time - recording.time[0], press.time_s[kept], atol=1e-6)


def test_most_instruments_need_no_option() -> None:
    refused = [each.__name__ for each in INSTRUMENTS if file_of(each)[1] > 0]
    assert len(refused) <= len(INSTRUMENTS) - READ_WITHOUT_OPTIONS, refused


# Header: the cells of each column (x position, f force, t time, k row number, c a constant, w work, v half
# the force), and the units of position in mm and force in N; None: no column is right.
HEADERS: dict[str, tuple[str, float, float] | None] = {
    "Weg in mm;Kraft in N": ("xf", 1.0, 1.0),
    "Weg in mm;Kraft in N;Zeit in s": ("xft", 1.0, 1.0),
    "Position_mm;Load_A;Load_B": ("xfv", 1.0, 1.0),
    "N;Position_mm;Force": ("kxf", 1.0, 1.0),
    "Cycle N;Position (mm);Force": ("cxf", 1.0, 1.0),
    "sample_N;x_mm;force_gf": ("kxf", 1.0, 9.80665e-3),
    "count;pos;force_N": ("kxf", 1.0, 1.0),
    "counts;travel;force_N": ("kxf", 1.0, 1.0),
    "row_count;travel;force_N": ("kxf", 1.0, 1.0),
    "cycle count;position;load_N": ("cxf", 1.0, 1.0),
    "adc_in;pos;force_N": ("kxf", 1.0, 1.0),
    "Data in;Travel;Load N": ("kxf", 1.0, 1.0),
    "m;x;F_N": ("kxf", 1.0, 1.0),
    "test_m;x_mm;F_N": ("cxf", 1.0, 1.0),
    "Length (m);Extension (mm);Load (N)": ("cxf", 1.0, 1.0),
    "Width (mm);Extension (mm);Load (N)": ("cxf", 1.0, 1.0),
    "Temp A;pos_mm;F_N": ("cxf", 1.0, 1.0),
    "I_A;pos_mm;F_N": ("vxf", 1.0, 1.0),
    "step;pos_mm;setpoint_N;measured_N": ("kxvf", 1.0, 1.0),
    "target_force_N;pos_mm;force_N": ("cxf", 1.0, 1.0),
    "Time (s);Position (mm);Velocity (mm/s);Force (N)": ("txcf", 1.0, 1.0),
    "Position(mm);Force(N);Stiffness(N/mm);Energy(N*mm)": ("xfvw", 1.0, 1.0),
    "Displacement [mm];Force [N];Work [Nm]": ("xfw", 1.0, 1.0),
    "Strain [mm/mm];Stress [N/mm2];Extension [mm];Load [N]": ("xvxf", 1.0, 1.0),
    "Temps [s];Course [mm];Force [daN]": ("txf", 1.0, 10.0),
    "Time_s;Time_ms;x_mm;F_N": ("ttxf", 1.0, 1.0),
    "Index;Time(s);Travel;Force(g)": ("ktxf", 1.0, 9.80665e-3),
    "Distance mm;Force kg": ("xf", 1.0, 9.80665),
    "X (microns);Force (gf)": ("xf", 1e-3, 9.80665e-3),
    "depth_nm;load_uN;amp_nm": ("xfc", 1e-6, 1e-6),
    "Travel (inch);Load (lbs)": ("xf", 25.4, 4.4482216152605),
    'Travel (");Load (oz)': ("xf", 25.4, 4.4482216152605 / 16),
    "Travel (mils);Load (LBF)": ("xf", 25.4e-3, 4.4482216152605),
    "t;F;x": ("tfx", 1.0, 1.0),
    "force_N;pressure_kPa": None,
    "Force [N];Stress [MPa]": None,
    "angle_deg;force_N": None,
    "Position (mm);Voltage (V)": None,
    "Position (pixel);Force (N)": None,
}


@pytest.mark.parametrize("header", HEADERS)
def test_a_header_gives_the_right_columns_directly_or_with_the_printed_options(
    tmp_path: Path, header: str
) -> None:
    press = instruments.press()
    right = HEADERS[header]
    cells = {
        "x": press.position_mm,
        "f": press.force_N,
        "t": press.time_s,
        "k": press.number,
        "c": np.full(len(press.number), 5.0),
        "w": press.position_mm * press.force_N,
        "v": press.force_N / 2,
    }
    path = tmp_path / "press.csv"
    columns = [cells[each] for each in (right[0] if right else "xf")]
    path.write_text(header + "\n" + instruments.table(*columns, separator=";"))
    if right is None:
        with pytest.raises(InputError) as refused:
            read_recording(path)
        assert "add" not in str(refused.value).split(": ", 1)[1]
        return
    recording, _ = read_with_printed_options(path)
    _, to_mm, to_newton = right
    np.testing.assert_allclose(recording.position, 1e-3 * to_mm * press.position_mm, atol=1e-9 * to_mm)
    np.testing.assert_allclose(recording.force, to_newton * press.force_N, atol=2e-6 * to_newton)
