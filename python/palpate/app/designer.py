# SPDX-License-Identifier: Apache-2.0
"""Numbers with which designers describe a switch, and a force curve that is changed by these numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy

from .._typing import Float1D
from ..errors import InputError
from ..frames import pd
from ..model import Model
from ..model.model_display import force_curves
from ..recording import Recording
from ..recording.units import Unit
from ..verdict import force_jnd
from ..verification.metrics import force_floor

POSITIONS = 801
"""Number of positions of an edited curve in each stroke"""


@dataclass(frozen=True)
class Curves:
    """Press and release force of an object over its travel, in SI."""

    position: Float1D
    """(n,) [m or rad], increasing"""
    press: Float1D
    """(n,) [N or N*m]"""
    release: Float1D
    """(n,) equal to `press` if the object has no hysteresis"""

    @classmethod
    def of(cls, model: Model) -> Curves:
        """Returns the curves of a model whose force depends on position and stroke alone."""
        position, forces = force_curves(model, POSITIONS)
        press, *release = forces.values()
        return cls(position, press, release[0] if release else press)

    @cached_property
    def click(self) -> tuple[int, int] | None:
        """Indices of peak and contact: the first fall of the press force that a hand feels, or None."""
        return _fall(self.press)

    @cached_property
    def stop(self) -> int:
        """Index at which the press force exceeds its peak again, behind the contact; else the last one."""
        if self.click is None:
            return len(self.press) - 1
        peak, contact = self.click
        beyond = np.flatnonzero(self.press[contact:] > self.press[peak])
        return contact + int(beyond[0]) if len(beyond) else len(self.press) - 1

    def numbers(self) -> dict[str, tuple[float, str]]:
        """Returns the designer's numbers in SI by name, with their kinds: force, position, work, share."""
        x, press = self.position, self.press
        found = {"largest force": (float(press.max()), "force"), "travel": (float(np.ptp(x)), "position")}
        if self.click is not None:
            peak, contact = self.click
            found = {
                "peak force": (float(press[peak]), "force"),
                "peak position": (float(x[peak]), "position"),
                "contact force": (float(press[contact]), "force"),
                "snap ratio": (float((press[peak] - press[contact]) / press[peak]), "share"),
                "click travel": (float(x[contact] - x[peak]), "position"),
                **found,
            }
            back = _fall(self.release)
            if back is not None:
                found["release point"] = (float(x[back[0]]), "position")
            if self.stop < len(x) - 1:
                found["stop position"] = (float(x[self.stop]), "position")
        work = float(scipy.integrate.trapezoid(press, x))
        lost = float(scipy.integrate.trapezoid(press - self.release, x))
        return {**found, "work": (work, "work"), "lost work": (lost, "work")}


def _fall(force: Float1D) -> tuple[int, int] | None:
    """Returns the indices of start and end of the first fall of a force over its positions that a hand feels.

    Force and fall are at least just noticeable. The fall ends where the force is least before it exceeds its
    start. None without such a fall.
    """
    highest, floor = np.maximum.accumulate(force), force_floor(force)
    noticed = (highest > floor) & (highest - force > force_jnd(highest, floor))
    if not noticed.any():
        return None
    start = int(np.argmax(force[: int(np.argmax(noticed)) + 1]))
    higher = np.flatnonzero(force[start:] > force[start])
    stop = start + int(higher[0]) if len(higher) else len(force)
    return start, start + int(np.argmin(force[start:stop]))


WITH_CLICK = ("peak force", "peak position", "contact force", "click travel", "stop position", "travel")
WITHOUT_CLICK = ("largest force", "travel")
"""Numbers that can be edited"""

HYSTERESIS = "hysteresis"
"""Edited number: factor of the hysteresis [-]"""


def editable(curves: Curves) -> list[str]:
    """Returns the names of the numbers that can be edited."""
    names = WITHOUT_CLICK if curves.click is None else WITH_CLICK
    return [name for name in names if name in curves.numbers()]


def edited(curves: Curves, wanted: Mapping[str, float]) -> Curves:
    """Returns curves whose numbers have the wanted values in SI; the other numbers stay.

    Between peak, contact and stop, positions are stretched linearly. Up to the peak the press force is
    scaled. Behind it its change is interpolated linearly; at the stop it is that of the peak. The hysteresis
    is scaled.

    Raises
    ------
    InputError
        A number is not one of the curves, or the positions would not increase.
    """
    now = {name: value for name, (value, _) in curves.numbers().items()} | {HYSTERESIS: 1.0}
    for name in wanted:
        if name not in (*editable(curves), HYSTERESIS):
            raise InputError(f"{name} cannot be edited: choose one of {', '.join(editable(curves))}")
    want = {**now, **wanted}
    if want[HYSTERESIS] < 0.0:
        raise InputError(f"hysteresis is {want[HYSTERESIS]:g}: must be at least 0 times the present one")
    x = curves.position
    press, loop = curves.press, (curves.press - curves.release) * want[HYSTERESIS]
    end = want["travel"] + x[0]
    if curves.click is None:
        old, new = [x[0], x[-1]], [x[0], end]
        press = press * (want["largest force"] / now["largest force"])
    else:
        peak, contact = curves.click
        old = [x[0], x[peak], x[contact]]
        new = [x[0], want["peak position"], want["peak position"] + want["click travel"]]
        if "stop position" in now:
            moved = want["stop position"] - now["stop position"]
            old, new = [*old, x[curves.stop], x[-1]], [*new, want["stop position"], end + moved]
        else:
            old, new = [*old, x[-1]], [*new, end]
        ratio = want["peak force"] / now["peak force"]
        higher = [want[name] - now[name] for name in ("peak force", "contact force", "peak force")]
        offset = np.interp(x, old[1 : len(old) - 1], higher[: len(old) - 2])
        press = np.where(x <= x[peak], press * ratio, press + offset)
    if not (np.diff(new) > 0.0).all():
        raise InputError(
            "peak, contact, stop and end would not follow each other: choose a shorter click travel, or a "
            "longer travel"
        )
    return Curves(np.interp(x, old, new), press, press - loop)


def write_recording(recording: Recording, units: Mapping[str, Unit], path: Path) -> None:
    """Writes an edited recording in the units of "position" and "force" of the file that was edited."""
    if not all(unit.symbol for unit in units.values()):
        recording.write(path)
        return
    columns = {
        f"{role} [{unit.symbol}]": getattr(recording, role) / unit.factor for role, unit in units.items()
    }
    if recording.direction is not None:
        columns["direction"] = recording.direction
    rows = pd.DataFrame(columns).to_csv(index=False)
    path.write_text(f"# edited: {recording.metadata['edited']}\n{rows}", encoding="utf-8")


def recording_of(curves: Curves, model: Model, changes: str) -> Recording:
    """Returns edited curves as a recording, which is marked as edited."""
    one_curve = np.array_equal(curves.press, curves.release)
    strokes = [(curves.position, curves.press, 1)]
    if not one_curve:
        strokes.append((curves.position[::-1], curves.release[::-1], -1))
    position, force = (np.concatenate([each[k] for each in strokes]) for k in (0, 1))
    direction = np.concatenate([np.full(len(each[0]), each[2]) for each in strokes])
    files = ", ".join(model.data.files) or "arrays"
    return Recording.from_arrays(
        position,
        force,
        direction=None if one_curve else direction,
        units={role: model.units[role] for role in ("position", "force")},
        metadata={"edited": f"{changes}; from the model of {files}"},
    )
