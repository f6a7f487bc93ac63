# SPDX-License-Identifier: Apache-2.0
"""Variants of a recording from other programs give the same arrays and the same model."""

import contextlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import palpate
from conftest import measured_data, sampled
from palpate import InputError, Recording, read_recording
from palpate.recording import sample_recording
from palpate.recording.units import unit_of
from small_files import options_in

VARIANTS = 200
IDENTIFIED_VARIANTS = 6
MOST_ROWS = 300

MEASURED = (
    "keyswitches/tactile__cherry_mx_brown.csv",
    "rubber_domes/topre_r1_45g__run1.csv",
    "switch_springs/linear_housing_tx_xl_65g.csv",
    "silicone_compression/EF10_0T_A1.csv",
    "magnet_attraction/magnet_cylinder_quarter_inch_attract_25C.csv",
    "vhb4910_viscoelastic/loadunload_rate_0d03_1d5_1.csv",
)

NOTATIONS = {
    "underscore": "{stem}_{unit}",
    "square": "{stem} [{unit}]",
    "round": "{stem} ({unit})",
    "tight": "{stem}({unit})",
    "slash": "{stem} / {unit}",
    "comma": "{stem}, {unit}",
    "line": "{stem}",
    "none": "{stem}",
}

POSITION_UNITS = {"m": ("m", "mm", "um", "µm", "cm", "in"), "rad": ("rad", "deg", "°")}
FORCE_UNITS = {"N": ("N", "mN", "kN", "gf", "lbf", "ozf"), "N*m": ("Nm", "mNm", "N·m", "N*mm", "N.cm")}


@cache
def sources() -> list[Recording]:
    """Returns clean recordings of a few hundred rows: measured ones, or the built-in sample."""
    folder = measured_data()
    found = (
        []
        if folder is None
        else [read_recording(folder / name) for name in MEASURED if (folder / name).is_file()]
    )
    found.append(sample_recording(1, 4.0))
    return [thinned(recording) for recording in found]


def thinned(recording: Recording) -> Recording:
    rows = slice(None, None, -(-len(recording) // MOST_ROWS))
    return Recording.from_arrays(
        recording.position[rows],
        recording.force[rows],
        None if recording.time is None else recording.time[rows],
        None if recording.direction is None else recording.direction[rows],
        units=recording.units,
    )


@dataclass(frozen=True)
class Variant:
    """Text of a file, and the recording that must result from reading the file."""

    data: bytes
    clean: Recording
    dialect_parts: tuple[str, ...]
    """Parts that the first note of the recording must contain"""


def variant(clean: Recording, random: np.random.Generator) -> Variant:
    """Returns a recording written as text with a random separator, decimal mark, header and units."""

    def pick(*choices: str) -> str:
        return str(random.choice(np.array(choices)))

    def happens(share: float) -> bool:
        return bool(random.random() < share)

    separator = pick(",", ";", "\t")
    decimal = "," if happens(0.5) and (separator != "," or happens(0.3)) else "."
    notation = pick(*NOTATIONS)
    encoding = pick("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1")
    rad = clean.units["position"] == "rad"
    stems = (
        ("Angle", "Torque")
        if rad
        else (pick("Displacement", "position", "Tip position"), pick("Force", "Load"))
    )
    usual = ("rad", "Nm") if rad else ("mm", "N")
    units = [
        usual[k] if notation == "none" or happens(0.4) else pick(*table[clean.units[role]])
        for k, (role, table) in enumerate((("position", POSITION_UNITS), ("force", FORCE_UNITS)))
    ]
    columns: list[tuple[str, str, list[str]]] = []
    for stem, unit, values in zip(stems, units, (clean.position, clean.force), strict=True):
        known = unit_of(unit)
        assert known is not None
        columns.append((stem, unit, [repr(value) for value in (values / known.factor).tolist()]))
    time, direction = clean.time, clean.direction
    if time is not None and happens(0.6):
        unit, factor = ("ms", 1e-3) if happens(0.5) and notation != "none" else ("s", 1.0)
        columns.append(("Time", unit, [repr(value) for value in (time / factor).tolist()]))
    else:
        time = None
    if direction is not None and happens(0.6):
        words = {1: pick("press", "loading", "+1"), -1: pick("release", "unload", "-1"), 0: "hold"}
        columns.append(("direction", "", [words[int(value)] for value in direction]))
    else:
        direction = None
    if happens(0.3):
        columns.append(("Strain", "-" if notation == "line" else "%", ["0.5"] * len(clean)))
    columns = [columns[k] for k in random.permutation(len(columns))]
    names = [NOTATIONS[notation].format(stem=stem, unit=unit) if unit else stem for stem, unit, _ in columns]
    header = [names, *([[unit for _, unit, _ in columns]] if notation == "line" else [])]
    cells = [[cell.replace(".", decimal) for cell in values] for _, _, values in columns]
    rows = [list(row) for row in zip(*cells, strict=True)]
    if happens(0.25):
        header = [["", *row] for row in header]
        rows = [[str(k), *row] for k, row in enumerate(rows)]
    if happens(0.1):
        header, rows = [[*row, ""] for row in header], [[*row, ""] for row in rows]
    lines = [separator.join(quoted(cell, separator) for cell in row) for row in (*header, *rows)]
    preamble = {
        "none": [],
        "comments": ["# device: bench 3", "#", "# Prüfer: Ö"],
        "text": ["Compression test;", "Speed (mm/min): 10;", "Load cell: 1kN; ä", ""],
        "pairs": [f"Operator{separator}Müller", f"Sample{separator}7", ""],
    }[kind := pick("none", "comments", "text", "pairs")]
    line_end = pick("\n", "\r\n")
    text = line_end.join([*preamble, *lines]) + pick("", line_end)
    dialect_parts = ("units in line",) if notation == "line" else ()
    if kind in ("text", "pairs"):
        dialect_parts += ("before the header",)
    if decimal == ",":
        dialect_parts += ("decimal comma",)
    if separator != ",":
        dialect_parts += ("separated by",)
    latin = encoding == "latin-1" and not text.isascii()
    dialect_parts += ("Latin-1",) if latin else ("UTF-16",) if encoding.startswith("utf-16") else ()
    used = Recording.from_arrays(clean.position, clean.force, time, direction, units=clean.units)
    return Variant(text.encode(encoding), used, dialect_parts)


def quoted(cell: str, separator: str) -> str:
    return f'"{cell}"' if separator in cell else cell


def read(path: Path) -> Recording:
    """Reads a file. If it is refused, reads it again with the options that the error message suggests."""
    with contextlib.suppress(InputError):
        recording = read_recording(path)
        unitless = [note for note in recording.notes if "has no unit and is not used" in note]
        return read_recording(path, **options_in(unitless[0])) if unitless else recording  # type: ignore[arg-type]
    with pytest.raises(InputError) as refused:
        read_recording(path)
    return read_recording(path, **options_in(str(refused.value)))  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", sampled(range(VARIANTS), *range(IDENTIFIED_VARIANTS, VARIANTS, 11)))
def test_a_variant_is_read_as_the_clean_recording(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    all_sources = sources()
    found = variant(all_sources[seed % len(all_sources)], random)
    path = tmp_path / "press.csv"
    path.write_bytes(found.data)
    recording = read(path)
    clean = found.clean
    np.testing.assert_allclose(recording.position, clean.position, rtol=1e-13, atol=0.0)
    np.testing.assert_allclose(recording.force, clean.force, rtol=1e-13, atol=0.0)
    assert recording.units == clean.units
    assert (recording.time is None) == (clean.time is None)
    if recording.time is not None and clean.time is not None:
        np.testing.assert_allclose(recording.time, clean.time, rtol=1e-13, atol=0.0)
    assert (recording.direction is None) == (clean.direction is None)
    if recording.direction is not None and clean.direction is not None:
        np.testing.assert_array_equal(recording.direction, clean.direction)
    for part in found.dialect_parts:
        assert part in recording.notes[0]
    if seed < IDENTIFIED_VARIANTS:
        same_model(palpate.identify(recording), palpate.identify(clean), clean)


def same_model(model: palpate.Model, expected: palpate.Model, clean: Recording) -> None:
    assert model.fit.model_class == expected.fit.model_class
    assert model.fit.nrmse == pytest.approx(expected.fit.nrmse, rel=0.01)
    x = np.linspace(clean.position.min(), clean.position.max(), 50)
    sides: tuple[float | None, ...] = (1.0, -1.0) if model.fit.model_class == "hysteresis" else (None,)
    for side in sides:
        direction = None if side is None else np.full(len(x), side)
        difference = model.force(x, direction=direction) - expected.force(x, direction=direction)
        assert np.abs(difference).max() < 0.01 * np.ptp(clean.force)


@pytest.mark.parametrize("seed", sampled(range(8), 0, 1, 2))
def test_a_recording_with_thousands_separators_is_the_clean_recording(tmp_path: Path, seed: int) -> None:
    clean = sources()[seed % len(sources())]
    separator, mark, decimal = [(";", ".", ","), ("\t", ",", "."), (";", "'", "."), (",", ",", ".")][seed % 4]
    force = clean.force * 1e5
    position = clean.position * 1e3
    names = ("Angle [rad]", "Torque [Nm]")

    def written(value: float) -> str:
        return f"{value:,.6f}".replace(",", "\0").replace(".", decimal).replace("\0", mark)

    rows = [
        separator.join(quoted(written(value), separator) for value in row)
        for row in zip(position.tolist(), force.tolist(), strict=True)
    ]
    path = tmp_path / "press.csv"
    path.write_text("\n".join([separator.join(names), *rows]), encoding="utf-8")
    recording = read_recording(path)
    np.testing.assert_allclose(recording.force, force, atol=1e-6)
    np.testing.assert_allclose(recording.position, position, atol=1e-6)
