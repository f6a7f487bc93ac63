# SPDX-License-Identifier: Apache-2.0
"""Computes the stiffest certified spring of every example device, from the host and on its motor controller.

    python bench/plans/on_device_stiffness.py --to docs

The spring is rendered directly without prediction. Two bounds limit its stiffness: damping against hold
and delay, and friction against encoder and force steps. The study computes each bound with the other one
removed, at 1 kHz from the host and at 10 and 40 kHz on the controller, with three delays of the controller.

Writes FOLDER/figures/on-device.png and on-device.json, and the tables of FOLDER/certificate.md if that page
exists. Takes a few seconds.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import count, fill_tables, markdown_table, write_json

from palpate._core.device import DeviceProfile, on_device
from palpate._core.stability import renderable_slopes
from palpate.cli.figures import figure_file
from palpate.cli.printing import number
from palpate.planning import OnDevice, example_profiles
from palpate.planning.device_profile import DeviceProfile as ProfileFile
from palpate.plotting.look import grid

RATES_HZ = (10e3, 40e3)
"""Rates of the controller in the tables [Hz]"""

DRAWN_RATES_HZ = (1e3, 1e5)
"""Smallest and largest rate in the figure [Hz]"""

DRAWN_POINTS = 31
"""Number of drawn rates of each curve [-]"""

AMPLE_DAMPING = 1e6
"""Damping at which only friction limits the stiffness [N*m*s/rad or N*s/m]"""

NO_DELAY = OnDevice(delay_periods=0.0, jitter_s=0.0)
"""Timing of an ideal controller: the force follows the sample at once, in exact intervals"""


@dataclass(frozen=True)
class Stiffness:
    """Stiffest certified spring [N*m/rad or N/m]."""

    damping: float
    """Limit by device damping against hold and delay"""
    friction: float
    """Limit by Coulomb friction against encoder and force steps"""
    certified: float
    """Certified stiffness with both limits"""


@dataclass(frozen=True)
class Row:
    """Certified stiffness of one example device: from the host, and on the controller by rate."""

    device: str
    unit: str
    host: Stiffness
    ideal: dict[float, Stiffness]
    """By rate, with a controller without delay"""
    usual: dict[float, Stiffness]
    """By rate, with the default timing of a controller: one period of delay"""
    own: dict[float, Stiffness]
    """By rate, with the timing in the profile; without rates that the profile refuses"""


def stiffness(device: DeviceProfile) -> Stiffness:
    """Returns the stiffest springs that are certified on a device, for each limit and for both."""
    exact = changed(device, encoder_step=0.0, force_step=0.0)
    damped = changed(device, viscous_damping=AMPLE_DAMPING)
    return Stiffness(*(renderable_slopes(each, falling=0.0)[1] for each in (exact, damped, device)))


def changed(device: DeviceProfile, **fields: Any) -> DeviceProfile:
    return DeviceProfile(**device.to_dict() | fields)


def by_rate(device: DeviceProfile, rates_hz: Sequence[float]) -> dict[float, Stiffness]:
    """Returns the stiffness on the controller by rate, without rates that the profile refuses."""
    found = {}
    for rate_hz in rates_hz:
        try:
            found[rate_hz] = stiffness(on_device(device, rate_hz))
        except ValueError:
            continue
    return found


def measure() -> list[Row]:
    """Returns the stiffness of every example device."""
    rows = []
    for file, _ in example_profiles().values():
        device = ProfileFile.load(file)
        if device.admittance is not None:  # it renders no force over its position
            continue
        rows.append(
            Row(
                device.id,
                "N·m/rad" if device.position_unit == "rad" else "N/m",
                stiffness(device),
                by_rate(changed(device, on_device=NO_DELAY), RATES_HZ),
                by_rate(changed(device, on_device=OnDevice()), RATES_HZ),
                by_rate(device, highest_rates(device)),
            )
        )
    return rows


def highest_rates(device: DeviceProfile) -> tuple[float, ...]:
    """Returns the rates of the tables, or the highest rate of the controller if it is lower."""
    timing = device.on_device
    if timing is None:
        return RATES_HZ
    highest = math.inf if timing.highest_rate_hz is None else timing.highest_rate_hz
    if timing.delay_s > 0.0:  # a certificate allows a delay of 16 periods
        highest = min(highest, math.floor((16.0 - timing.delay_periods) / timing.delay_s))
    return tuple(sorted({min(rate_hz, highest) for rate_hz in RATES_HZ}))


def times(after: Stiffness | None, host: Stiffness) -> str:
    """Returns the certified stiffness with its ratio to that from the host: "200 (×20)"."""
    return "" if after is None else f"{number(after.certified)} (×{after.certified / host.certified:.3g})"


def tables(rows: Sequence[Row]) -> dict[str, str]:
    """Returns the tables of the documentation page; a key is the name in the mark before the table."""
    slow, fast = RATES_HZ
    ideal = [
        (
            row.device,
            row.unit,
            number(row.host.damping),
            number(row.ideal[slow].damping),
            number(row.ideal[fast].damping),
            number(row.host.friction),
            times(row.ideal[slow], row.host),
            times(row.ideal[fast], row.host),
            times(row.usual[slow], row.host),
            times(row.usual[fast], row.host),
        )
        for row in rows
    ]
    own = [
        (
            row.device,
            row.unit,
            number(row.host.certified),
            f"{1e-3 * rate_hz:.3g} kHz",
            number(found.damping),
            number(found.friction),
            times(found, row.host),
        )
        for row in rows
        for rate_hz, found in row.own.items()
    ]
    return {
        "on-device-rates": markdown_table(
            (
                "device",
                "unit",
                "damping, host 1 kHz",
                "10 kHz",
                "40 kHz",
                "friction, any rate",
                "both, 10 kHz",
                "40 kHz",
                "with a period of delay, 10 kHz",
                "40 kHz",
            ),
            ideal,
            text_columns=(0, 1),
        ),
        "on-device-profiles": markdown_table(
            ("device", "unit", "host", "controller", "damping", "friction", "both"), own, text_columns=(0, 1)
        ),
    }


def draw(axes: Axes, device: DeviceProfile) -> None:
    """Draws the certified stiffness of one device over the rate of its controller, with both limits."""
    low, high = np.log10(DRAWN_RATES_HZ)
    rates_hz = np.logspace(low, high, max(count(DRAWN_POINTS), 5))
    usual = by_rate(changed(device, on_device=OnDevice()), rates_hz.tolist())
    ideal = by_rate(changed(device, on_device=NO_DELAY), rates_hz.tolist())
    x = 1e-3 * np.array(list(usual))
    axes.plot(x, [each.friction for each in usual.values()], ":", color="black", label="friction limit")
    axes.plot(
        x, [each.damping for each in ideal.values()], "--", color="0.6", label="damping limit, no delay"
    )
    axes.plot(
        x,
        [each.damping for each in usual.values()],
        "--",
        color="black",
        label="damping limit, one period late",
    )
    axes.plot(
        x, [each.certified for each in usual.values()], color="black", label="certified, one period late"
    )
    axes.plot(1.0, stiffness(device).certified, "o", color="black", markersize=4, label="host, 1 kHz")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(0.85, 1e-3 * DRAWN_RATES_HZ[1])
    axes.set_title(device.id, fontsize="small")
    grid(axes)


def picture(path: Path, devices: Sequence[DeviceProfile]) -> None:
    """Draws one diagram for each device."""
    columns = 2
    rows = -(-len(devices) // columns)
    with figure_file(path, height_inches=1.9 * rows + 0.6, rows=(1.0,) * rows, columns=columns) as all_axes:
        for axes, device in zip(all_axes, devices, strict=False):
            draw(axes, device)
            axes.set_ylabel(f"stiffness [{'N·m/rad' if device.position_unit == 'rad' else 'N/m'}]")
            axes.set_xlabel("rate [kHz]")
        for axes in all_axes[len(devices) :]:
            axes.remove()
        handles, labels = all_axes[0].get_legend_handles_labels()
        all_axes[0].figure.legend(handles, labels, frameon=False, loc="outside lower center", ncols=2)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--to", type=Path, required=True)
    options = parser.parse_args()
    rows = measure()
    page_tables = tables(rows)
    print("\n".join(page_tables.values()))
    figures = options.to / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    write_json(figures / "on-device.json", [as_json(row) for row in rows])
    drawn = ("bench-knob", "touch", "moteus-r4", "odrive-v3")
    picture(figures / "on-device.png", [ProfileFile.load(example_profiles()[name][0]) for name in drawn])
    fill_tables(options.to / "certificate.md", page_tables)
    return 0


def as_json(row: Row) -> dict[str, Any]:
    """Returns the numbers of a row for a JSON file."""
    rates = {
        name: {f"{rate_hz:g}": vars(found) for rate_hz, found in getattr(row, name).items()}
        for name in ("ideal", "usual", "own")
    }
    return {"device": row.device, "unit": row.unit, "host": vars(row.host), **rates}


if __name__ == "__main__":
    sys.exit(main())
