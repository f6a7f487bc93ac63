# SPDX-License-Identifier: Apache-2.0
"""Files of the instruments that record springs, switches and tissue, written from their structure.

All contain the same press and release, in the units, names, separators and extra lines of each instrument.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Column: TypeAlias = Sequence[str] | NDArray[np.float64]

ROWS = 120
"""Rows of the recording: half a press, half a release."""


@dataclass(frozen=True)
class Press:
    """The recording that every file contains."""

    time_s: NDArray[np.float64]
    position_mm: NDArray[np.float64]
    force_N: NDArray[np.float64]  # noqa: N815

    @property
    def number(self) -> NDArray[np.float64]:
        return np.arange(1.0, len(self.time_s) + 1)


def press() -> Press:
    """Returns a press and a release of a stiffening spring with some hysteresis."""
    there = np.linspace(0.0, 4.0, ROWS // 2)
    position = np.r_[there, there[::-1]]
    side = np.r_[np.full(ROWS // 2, 0.2), np.full(ROWS // 2, -0.2)]
    return Press(0.01 * np.arange(ROWS), position, 2.0 * position + 0.3 * np.sin(3.0 * position) + side + 0.3)


def table(
    *columns: Column, separator: str = ",", decimal: str = ".", digits: int = 6, quote: str = ""
) -> str:
    """Returns rows of cells; numbers have this number of significant digits after the point."""

    def cell(value: str | float) -> str:
        text = value if isinstance(value, str) else f"{value:.{digits}f}".replace(".", decimal)
        return f"{quote}{text}{quote}"

    return "".join(separator.join(map(cell, row)) + "\n" for row in zip(*columns, strict=True))


def lines(*texts: str) -> str:
    return "".join(text + "\n" for text in texts)


def clock(pattern: str, time_s: Iterable[float]) -> list[str]:
    """Returns clock times with milliseconds, in a pattern of `strftime` where %L are the milliseconds."""
    start = datetime(2025, 11, 14, 23, 59, 59, 700_000)
    times = [start + timedelta(seconds=float(t)) for t in time_s]
    return [each.strftime(pattern).replace("%L", f"{each.microsecond // 1000:03d}") for each in times]


def bluehill(p: Press) -> str:
    return lines('"Specimen label","Button 7"', '"Width","5.00","mm"', "", '"Time","Extension","Load"') + (
        '"(s)","(mm)","(N)"\n' + table(p.time_s, p.position_mm, p.force_N, quote='"')
    )


def testxpert_tra(p: Press) -> str:
    return lines('"Prüfzeit";"Standardweg";"Standardkraft"', '"s";"mm";"N"') + table(
        p.time_s, p.position_mm, p.force_N, separator=";", decimal=","
    )


def trapezium(p: Press) -> str:
    return lines('"Name","1 _ 1"', '"Time","Stroke","Force"', '"sec","mm","N"') + table(
        p.time_s, p.position_mm, p.force_N, quote='"'
    )


def trapezium_japanese(p: Press) -> str:
    return lines('"時間","変位","試験力"', '"sec","mm","N"') + table(p.time_s, p.position_mm, p.force_N)


def walter_bai(p: Press) -> str:
    return lines("Walter+Bai AG", "Prüfung: Feder", "", "Zeit [s]\tWeg [mm]\tKraft [kN]") + table(
        p.time_s, p.position_mm, p.force_N * 1e-3, separator="\t", decimal=",", digits=9
    )


def mts(p: Press) -> str:
    header = lines("MTS793|BTW|ENU|1|0|/|:|1|1|A", "Data Acquisition: timed", "")
    names = lines("Axial Displacement\tAxial Force\tTime", "mm\tkN\tSec")
    return header + names + table(p.position_mm, p.force_N * 1e-3, p.time_s, separator="\t", digits=9)


def mach_1(p: Press) -> str:
    header = lines("<Mach-1 File>", "<INFO>", "Date:\t14-11-2025", "<END INFO>", "<DATA>")
    names = lines("Time, s\tPosition (z), mm\tFz, gf")
    return header + names + table(p.time_s, p.position_mm, p.force_N / 9.80665e-3, separator="\t", digits=7)


def mach_1_with_end(p: Press) -> str:
    return mach_1(p) + "<END DATA>\n"


def hysitron(p: Press) -> str:
    header = lines(f"Number of Points  = {ROWS}", "", "Depth (nm)\tLoad (µN)\tTime (s)\tDepth (V)\tLoad (V)")
    volts = p.position_mm * 0.1
    return header + table(p.position_mm * 1e6, p.force_N * 1e6, p.time_s, volts, volts, separator="\t")


def softmech(p: Press) -> str:
    return lines("#SoftMech export", "#tip radius: 2.5", "#Z [nm];F [nN]") + table(
        p.position_mm * 1e6, p.force_N * 1e9, separator=";"
    )


def jpk(p: Press) -> str:
    header = lines("# xPosition: 0.0", "# columns: height vDeflection", "# units: m N", "#")
    return header + table(p.position_mm * 1e-3, p.force_N, separator=" ", digits=9)


def texture_analyser(p: Press) -> str:
    return lines("Force,Distance,Time", "g,mm,sec") + table(
        p.force_N / 9.80665e-3, p.position_mm, p.time_s, digits=7
    )


def labview_measurement(p: Press) -> str:
    header = lines("LabVIEW Measurement\t", "Separator\tTab", "***End_of_Header***\t", "\t")
    channels = lines(
        "Channels\t2\t\t", "***End_of_Header***\t\t\t", "X_Value\tPosition (mm)\tForce (N)\tComment"
    )
    return header + channels + table(p.time_s, p.position_mm, p.force_N, [""] * ROWS, separator="\t")


def serial_log(p: Press) -> str:
    return "millis,steps,grams\n" + table(
        p.time_s * 1e3, p.position_mm * 1e3, p.force_N / 9.80665e-3, digits=7
    )


def rosbag(p: Press) -> str:
    since_1970 = [f"{1_673_419_984_000_000_000 + round(t * 1e9)}" for t in p.time_s]
    zero = np.zeros(ROWS)
    names = "rosbagTimestamp,header.seq,pose.position.z,wrench.force.x,wrench.force.z\n"
    return names + table(since_1970, p.number, p.position_mm * 1e-3, zero, p.force_N, digits=9)


def load_cell_logger(p: Press) -> str:
    times = clock("%d.%m.%Y %H:%M:%S,%L", p.time_s)
    return "Datum;Weg in mm;Kraft in N\n" + table(times, p.position_mm, p.force_N, separator=";", decimal=",")


def time_of_day_logger(p: Press) -> str:
    return "Date,Time,Load (kg),Travel (mm)\n" + table(
        clock("%m/%d/%Y", p.time_s),
        clock("%H:%M:%S.%L", p.time_s),
        p.force_N / 9.80665,
        p.position_mm,
        digits=7,
    )


def iso_logger(p: Press) -> str:
    return "timestamp,z_mm,F_N\n" + table(clock("%Y-%m-%dT%H:%M:%S.%LZ", p.time_s), p.position_mm, p.force_N)


def mark_10(p: Press) -> str:
    return lines("Reading,Load [lbF],Travel [in],Time [sec.]") + table(
        p.number, p.force_N / 4.4482216152605, p.position_mm / 25.4, p.time_s, digits=9
    )


def imada(p: Press) -> str:
    header = lines("Model,ZTA-50N", "Serial,1234", "Sampling Rate,100 Hz", "")
    return header + "No.,Force(N),Displacement(mm)\n" + table(p.number, p.force_N, p.position_mm)


def horizon(p: Press) -> str:
    return "Position(mm),Force(N),Time(s)\n" + table(p.position_mm, p.force_N, p.time_s)


def torque_tester(p: Press) -> str:
    """Writes the press as torque over angle: 1 mm is 1 degree, 1 N is 1 oz-in."""
    return "Angle (degrees),Torque (oz-in)\n" + table(p.position_mm, p.force_N)


def french(p: Press) -> str:
    return "Temps (s);Déplacement (mm);Force (daN)\n" + table(
        p.time_s, p.position_mm, p.force_N * 0.1, separator=";", decimal=",", digits=7
    )


def italian(p: Press) -> str:
    return "Tempo [s];Spostamento [mm];Forza [N]\n" + table(
        p.time_s, p.position_mm, p.force_N, separator=";", decimal=","
    )


def origin(p: Press) -> str:
    return lines("Time\tDisplacement\tForce", "s\tmm\tN", "\tstage\tload cell") + table(
        p.time_s, p.position_mm, p.force_N, separator="\t"
    )


def origin_without_comments(p: Press) -> str:
    return lines("Time\tDisplacement\tForce", "s\tmm\tN") + table(
        p.time_s, p.position_mm, p.force_N, separator="\t"
    )


def savetxt(p: Press) -> str:
    return "# time_s position_mm force_N\n" + table(p.time_s, p.position_mm, p.force_N, separator=" ")


def columns_comment(p: Press) -> str:
    return "#Columns: time (s), position (mm), force (N)\n" + table(p.time_s, p.position_mm, p.force_N)


def matlab_writematrix(p: Press) -> str:
    return table(p.time_s, p.position_mm, p.force_N)


def two_columns(p: Press) -> str:
    return table(p.position_mm, p.force_N, separator="\t")


def aligned_columns(p: Press) -> str:
    return "".join(f"{x:12.6f}{f:14.6f}\n" for x, f in zip(p.position_mm, p.force_N, strict=True))


def short_names(p: Press) -> str:
    return "t,F,x\n" + table(p.time_s, p.force_N, p.position_mm)


def no_units(p: Press) -> str:
    return "Index,Travel,Load\n" + table(p.number, p.position_mm, p.force_N)


def setpoint_first(p: Press) -> str:
    return "cmd_mm,actual_mm,force_N\n" + table(np.round(p.position_mm, 1), p.position_mm, p.force_N)


def force_gauge_with_stress(p: Press) -> str:
    names = "Strain [%],Stress [MPa],Extension [mm],Load [N],Work [Nm]\n"
    return names + table(
        p.position_mm / 50, p.force_N / 20, p.position_mm, p.force_N, p.force_N * p.position_mm
    )


def settings_in_the_header(p: Press) -> str:
    return "Displacement (um),Force (gf),,Press,1680,Release,1660\n" + table(
        p.position_mm * 1e3, p.force_N / 9.80665e-3, digits=7
    )


def grouped_german(p: Press) -> str:
    def cell(value: float) -> str:
        return f"{value:,.4f}".replace(",", " ").replace(".", ",").replace(" ", ".")

    return "Weg [µm];Kraft [mN]\n" + "".join(
        f"{cell(x)};{cell(f)}\n" for x, f in zip(p.position_mm * 1e3, p.force_N * 1e3, strict=True)
    )


def grouped_whole_numbers(p: Press) -> str:
    return "Travel (nm);Force (uN)\n" + "".join(
        f"{x:,.0f};{f:,.0f}\n" for x, f in zip(p.position_mm * 1e6, p.force_N * 1e6, strict=True)
    )


def counter_and_travel(p: Press) -> str:
    return "row_count,travel,force_N\n" + table(p.number, p.position_mm, p.force_N)


def channels_with_letters(p: Press) -> str:
    return "Position_mm,Load_A,Load_B\n" + table(p.position_mm, p.force_N, p.force_N * 0.9)


def one_axis_of_three(p: Press) -> str:
    zero = np.zeros(ROWS)
    return "x_mm,y_mm,z_mm,fx_N,fy_N,fz_N\n" + table(zero, zero, p.position_mm, zero, zero, p.force_N)


def unread_cells(p: Press) -> str:
    force = [f"{f:.6f}" for f in p.force_N]
    force[3] = force[70] = "null"
    return "time_s,position_mm,force_N\n" + table(p.time_s, p.position_mm, force)


TEXT: dict[Callable[[Press], str], str] = {
    bluehill: "utf-8-sig",
    testxpert_tra: "latin-1",
    trapezium: "utf-8",
    trapezium_japanese: "utf-8",
    walter_bai: "latin-1",
    mts: "utf-8",
    mach_1: "utf-8",
    mach_1_with_end: "utf-8",
    hysitron: "latin-1",
    softmech: "utf-8",
    jpk: "utf-8",
    texture_analyser: "utf-8",
    labview_measurement: "utf-8",
    serial_log: "utf-8",
    rosbag: "utf-8",
    load_cell_logger: "utf-8",
    time_of_day_logger: "utf-8",
    iso_logger: "utf-8",
    mark_10: "utf-8",
    imada: "utf-8",
    horizon: "utf-16",
    torque_tester: "utf-8",
    french: "latin-1",
    italian: "utf-8",
    origin: "utf-8",
    origin_without_comments: "utf-8",
    savetxt: "utf-8",
    columns_comment: "utf-8",
    matlab_writematrix: "utf-8",
    two_columns: "utf-8",
    aligned_columns: "utf-8",
    short_names: "utf-8",
    no_units: "utf-8",
    setpoint_first: "utf-8",
    force_gauge_with_stress: "utf-8",
    settings_in_the_header: "utf-8",
    grouped_german: "utf-8",
    grouped_whole_numbers: "utf-8",
    counter_and_travel: "utf-8",
    channels_with_letters: "utf-8",
    one_axis_of_three: "utf-8",
    unread_cells: "utf-8",
}
"""Text files: writer of the content, and encoding."""

WITHOUT_TIME = {
    *(
        softmech,
        jpk,
        labview_measurement,
        imada,
        torque_tester,
        two_columns,
        aligned_columns,
        no_units,
        setpoint_first,
    ),
    *(force_gauge_with_stress, settings_in_the_header, grouped_german, grouped_whole_numbers),
    *(counter_and_travel, channels_with_letters, one_axis_of_three),
}
"""Files that contain no time."""


def write(instrument: Callable[[Press], str], folder: Path) -> Path:
    """Writes the file of a text instrument."""
    path = folder / f"{instrument.__name__}.csv"
    path.write_bytes(instrument(press()).encode(TEXT[instrument]))
    return path
