# SPDX-License-Identifier: Apache-2.0
"""Files of many instruments are read, or refused with options that, copied as printed, read them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import instruments
from palpate import InputError, Recording, read_recording
from small_files import options_in

INSTRUMENTS = list(instruments.TEXT)

READ_WITHOUT_OPTIONS = len(INSTRUMENTS) - 12
"""Least number of instruments whose files need no option."""


def read_with_printed_options(path: Path) -> tuple[Recording, int]:
    """Reads a file, at the first refusal with the printed options; returns the number of refusals."""
    try:
        return read_recording(path), 0
    except InputError as refused:
        return read_recording(path, **options_in(str(refused))), 1  # type: ignore[arg-type]


@pytest.mark.parametrize("instrument", INSTRUMENTS, ids=lambda each: each.__name__)
def test_a_file_of_an_instrument_is_read_directly_or_with_the_printed_options(
    tmp_path: Path, instrument: Callable[[instruments.Press], str]
) -> None:
    recording, _ = read_with_printed_options(instruments.write(instrument, tmp_path))
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


def test_most_instruments_need_no_option(tmp_path: Path) -> None:
    refused = [each.__name__ for each in INSTRUMENTS if needs_options(instruments.write(each, tmp_path))]
    assert len(refused) <= len(INSTRUMENTS) - READ_WITHOUT_OPTIONS, refused


def needs_options(path: Path) -> bool:
    return read_with_printed_options(path)[1] > 0
