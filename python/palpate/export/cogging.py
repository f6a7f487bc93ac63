# SPDX-License-Identifier: Apache-2.0
"""Writes the cogging torque of a motor as the table that its controller adds to every command.

The force f(x) of a model is the torque that turns the motor slowly, so the table adds +f(x). With hysteresis
f is the mean of both directions; half the difference is friction, which a table over the angle cannot hold.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._typing import Float1D
from ..errors import InputError
from ..model import Model
from ..model.model import COMPENSATION_KEY
from ..planning import friction_of
from ..verdict import GOOD
from .exported import require_carried, units_of
from .request import Request, Written

TURN = 2.0 * math.pi
"""One revolution [rad]"""

POSITIONS = 36_000
"""Number of angles of a revolution at which a table is compared with the model, every 0.01 degrees."""

MOTEUS_ENTRIES = 1024
"""Entries of motor.cogging_dq_comp, whole numbers from -127 to 127."""

ODRIVE_ENTRIES = 3600
"""Entries of cogging_map of the ODrive firmware 0.5, one for each 0.1 degrees."""

OPENFFBOARD_HARMONICS = 20
"""Harmonics that the anticogging of the OpenFFBoard sums."""


@dataclass(frozen=True)
class Table:
    """Table of one controller: its text, and the torque that the controller makes of it."""

    text: str
    size: str
    """What the table contains, for display"""
    replayed: Callable[[Float1D], Float1D]
    """Returns the added torque at angles of the encoder [units of the controller]"""
    least_ripple: float | None = None
    """Least RMS ripple that any table of this controller leaves [units of the controller]; None: no such
    bound is known"""


@dataclass(frozen=True)
class Controller:
    """Controller with a table against cogging."""

    unit: str
    """Unit of the table; "" for that of the model"""
    table: Callable[[Callable[[Float1D], Float1D]], Table]
    """Makes the table of a torque over the angle of the encoder [units of the controller over rad]"""


def _angles(count: int) -> Float1D:
    """Returns this number of angles at equal distances over a revolution [rad]."""
    return np.arange(count, dtype=np.float64) * (TURN / count)


def _moteus(torque: Callable[[Float1D], Float1D]) -> Table:
    """Returns the settings of a moteus: current = scale comp[i], linear between the entries.

    Source: `ISR_DoPositionCommon` of mjbots/moteus, fw/bldc_servo_control.h.
    """
    best = _straight_lines(torque)
    scale = float(np.float32(np.abs(best).max() / 127.0))
    entries = np.rint(best / scale)
    lines = [f"conf set motor.cogging_dq_scale {scale:.9g}"]
    lines += [f"conf set motor.cogging_dq_comp.{index} {entry:.0f}" for index, entry in enumerate(entries)]

    def replayed(angle: Float1D) -> Float1D:
        place = np.mod(angle / TURN, 1.0) * MOTEUS_ENTRIES
        line = np.interp(place, np.arange(MOTEUS_ENTRIES + 1), np.append(entries, entries[0]))
        return np.asarray(scale * line)

    return Table(
        "\n".join([*lines, "conf write", ""]), f"{MOTEUS_ENTRIES} entries, scale {scale:.4g} A", replayed
    )


def _straight_lines(torque: Callable[[Float1D], Float1D]) -> Float1D:
    """Returns the entries whose straight lines have the least squared error over a revolution.

    At order k the lines between samples of the torque are too low by sinc^2(k / entries). The normal
    equations of the hat functions are circulant, so that a Fourier transform solves them.
    """
    parts = 16
    samples = torque(_angles(MOTEUS_ENTRIES * parts))
    offset = np.arange(1 - parts, parts)
    hat = 1.0 - np.abs(offset) / parts
    first = parts * np.arange(MOTEUS_ENTRIES)
    right = hat @ samples[np.mod(first + offset[:, None], len(samples))]
    own, neighbour = float(hat @ hat), float(hat[: parts - 1] @ hat[parts:])
    order = np.arange(MOTEUS_ENTRIES // 2 + 1)
    left = own + 2.0 * neighbour * np.cos(TURN * order / MOTEUS_ENTRIES)
    return np.fft.irfft(np.fft.rfft(right) / left, MOTEUS_ENTRIES)


def _odrive(torque: Callable[[Float1D], Float1D]) -> Table:
    """Returns the 3600 torques of an ODrive, one a line. The controller holds an entry up to the next one.

    Each entry is the mean of the torque while it is held, which leaves the least RMS ripple. Source:
    `Controller::update` of odriverobotics/ODrive, Firmware/MotorControl/controller.cpp, version 0.5. The
    firmware rounds the position towards zero, so that below zero an entry is held up to the one before.
    """
    entries = _held_means(torque, ODRIVE_ENTRIES).astype(np.float32)

    def replayed(angle: Float1D) -> Float1D:
        place = np.fix(angle / TURN * ODRIVE_ENTRIES).astype(np.int64)
        return entries[np.mod(place, ODRIVE_ENTRIES)].astype(np.float64)

    return Table(
        "".join(f"{entry:.9g}\n" for entry in entries),
        f"{ODRIVE_ENTRIES} entries, for positions >= 0",
        replayed,
        least_ripple=least_held_ripple(torque, ODRIVE_ENTRIES),
    )


def _held_means(torque: Callable[[Float1D], Float1D], entries: int) -> Float1D:
    """Returns the mean torque from each of these angles to the next one, by Gauss's rule with 4 points."""
    point, weight = np.polynomial.legendre.leggauss(4)
    width = TURN / entries
    at = _angles(entries)[:, None] + width * 0.5 * (1.0 + point)
    return np.asarray(torque(at.ravel()).reshape(at.shape) @ weight / 2.0)


def least_held_ripple(torque: Callable[[Float1D], Float1D], entries: int) -> float:
    """Returns the least RMS ripple that a table leaves whose entries are held over equal angles.

    The RMS of the torque T of order k with the amplitude a_k is a_k / sqrt(2), that of its means over 1 / N
    of a revolution sinc(k / N) times as large: R^2 = sum a_k^2 (1 - sinc^2(k / N)) / 2, with sinc x =
    sin(pi x) / (pi x). Orders from N / 2 on can leave less, because several of them share the entries.
    """
    samples = 1 << 14
    share = np.abs(np.fft.rfft(torque(_angles(samples)))[1 : samples // 2]) ** 2 / samples**2
    order = np.arange(1, samples // 2)
    return math.sqrt(2.0 * float(share @ (1.0 - np.sinc(order / entries) ** 2)))


def _openffboard(torque: Callable[[Float1D], Float1D]) -> Table:
    """Returns the 20 largest harmonics of an OpenFFBoard: sum of amplitude sin(order angle + phase).

    Source: `TMC4671::turn` of the OpenFFBoard firmware with anticogging; it rounds the sum towards zero.
    """
    samples = 1 << 13  # resolves orders up to 4096
    terms = 2.0 / samples * np.fft.rfft(torque(_angles(samples)))[1 : samples // 2]
    order = np.sort(np.argsort(-np.abs(terms), kind="stable")[:OPENFFBOARD_HARMONICS]) + 1
    amplitude = np.abs(terms[order - 1]).astype(np.float32)
    phase = np.angle(1j * terms[order - 1]).astype(np.float32)
    rows = [f"{k},{a:.9g},{p:.9g}" for k, a, p in zip(order, amplitude, phase, strict=True)]

    def replayed(angle: Float1D) -> Float1D:
        waves = [a * np.sin(k * angle + p) for k, a, p in zip(order, amplitude, phase, strict=True)]
        return np.asarray(np.trunc(np.sum(waves, axis=0)))

    return Table("\n".join(["order,amplitude,phase_rad", *rows, ""]), f"{len(order)} harmonics", replayed)


def _plain(torque: Callable[[Float1D], Float1D]) -> Table:
    """Returns a CSV table of angle and torque every 0.1 degrees, linear between the rows."""
    angle = _angles(ODRIVE_ENTRIES)
    entries = torque(angle)
    rows = [f"{x:.17g},{y:.17g}" for x, y in zip(angle, entries, strict=True)]

    def replayed(at: Float1D) -> Float1D:
        return np.asarray(np.interp(at, angle, entries, period=TURN))

    return Table("\n".join(["angle_rad,torque", *rows, ""]), f"{ODRIVE_ENTRIES} rows", replayed)


CONTROLLERS = {
    "moteus": Controller("A", _moteus),
    "openffboard": Controller("count", _openffboard),
    "odrive": Controller("N*m", _odrive),
    "table": Controller("", _plain),
}
"""Kinds of tables, the choices of `--cogging` in `export/request.py`."""


def torque_of_turn(model: Model, encoder_zero: float = 0.0) -> Callable[[Float1D], Float1D]:
    """Returns the torque of a motor over the angle of its encoder [rad], the mean of both directions.

    Parameters
    ----------
    model : Model
        Cogging of a motor, identified with a period.
    encoder_zero : float
        Position of the model at which the encoder of the controller is at zero [rad].

    Raises
    ------
    InputError
        The model has no period, a revolution is not a multiple of it, the position is not an angle, or the
        force depends on other quantities.
    """
    require_carried(model, "a table cannot")
    if COMPENSATION_KEY in model.notes:
        raise InputError(
            "the model is a compensation already, and its table would add the cogging: export the identified "
            f"model with --scale {model.notes[COMPENSATION_KEY]:g}"
        )
    if units_of(model)[0] != "rad":
        raise InputError(
            f"the position is in {model.units['position']}: cogging needs an angle, so record it in rad or "
            "deg"
        )
    if model.period is None:
        raise InputError(
            "the model has no period, so its force does not repeat after a revolution: identify it with "
            "--period 360deg"
        )
    turns = TURN / model.period
    if round(turns) < 1 or abs(turns - round(turns)) > 1e-6 * turns:
        raise InputError(
            f"the period is {math.degrees(model.period):.6g} deg: a revolution of 360 deg must be a whole "
            "number of periods, so identify the model with --period 360deg"
        )
    side = 0.0 if model.hysteretic else None
    # Whole periods in place of the stated one, so that the last period ends with the revolution.
    stretch = model.period * round(turns) / TURN
    return lambda angle: np.asarray(model.force(stretch * angle + encoder_zero, direction=side))


def table_of(
    kind: str, model: Model, unit_force: float = 1.0, encoder_zero: float = 0.0, scale: float = 1.0
) -> Table:
    """Returns the table of a controller against the cogging of a model.

    Parameters
    ----------
    kind : str
        Key of `CONTROLLERS`.
    model : Model
        Cogging of a motor, identified with a period.
    unit_force : float
        Force of the model for one unit of the table.
    encoder_zero : float
        Position of the model at which the encoder of the controller is at zero [rad].
    scale : float
        Share of the cogging that the table cancels.

    Raises
    ------
    InputError
        The model is not that of a motor (see `torque_of_turn`), or its torque is zero at every angle.
    """
    torque = torque_of_turn(model, encoder_zero)
    if not np.any(torque(_angles(POSITIONS))):
        raise InputError("the torque of the model is zero at every angle: there is no cogging to compensate")
    return CONTROLLERS[kind].table(lambda angle: scale * torque(angle) / unit_force)


def write(request: Request) -> Written:
    """Writes the table of a controller, and returns its largest difference from the model."""
    model, kind = request.model, str(request.cogging)
    unit = CONTROLLERS[kind].unit
    torque_of = torque_of_turn(model, request.encoder_zero)
    if not math.isfinite(request.encoder_zero):
        raise InputError(f"--encoder-zero is {request.encoder_zero:g}: must be a finite number")
    if not 0.0 < request.scale <= 1.0:
        raise InputError(f"--scale is {request.scale:g}: must be above 0 and at most 1")
    unit_force = _unit_force(model, unit, request)
    table = table_of(kind, model, unit_force, request.encoder_zero, request.scale)
    angle = _angles(POSITIONS) + 0.5 * TURN / POSITIONS  # a held entry is compared over its whole angle
    torque = torque_of(angle)
    cogging = torque - (torque.mean() if kind == "openffboard" else 0.0)
    added = unit_force * table.replayed(angle)
    error, left = added - request.scale * cogging, added - cogging
    largest, rms = float(np.abs(error).max()), float(np.sqrt(np.mean(left**2)))
    peak, friction = float(np.abs(torque).max()), friction_of(model)
    request.write_text(table.text)
    force = model.units["force"]
    numbers = {
        "table": f"{request.output}: {kind}, {table.size}",
        "largest torque": f"{peak:.4g} {force}",
        "error of table": f"up to {largest:.3g} {force}, {100.0 * largest / peak:.2g} % of that torque",
        **_ripple_text(rms, unit_force, table, float(np.sqrt(np.mean(torque**2))), request.scale, force),
        **({"friction": f"{friction:.4g} {force}, not in the table"} if model.hysteretic else {}),
    }
    record = {"kind": kind, "unit_force": unit_force, "largest_torque": peak, "largest_error": largest}
    held = table.least_ripple is not None and request.scale == 1.0
    least = unit_force * table.least_ripple if held and table.least_ripple is not None else None
    return Written(
        GOOD, numbers, record | {"rms_ripple": rms, "least_rms_ripple": least, "friction": friction}
    )


def _ripple_text(
    rms: float, unit_force: float, table: Table, cogging: float, scale: float, force: str
) -> dict[str, str]:
    """Returns the ripple that the table leaves, and the least ripple of its controller, for display."""
    text = f"{rms:.3g} {force} RMS, {100.0 * rms / cogging:.2g} % of the cogging"
    if table.least_ripple is not None and scale == 1.0:
        least = unit_force * table.least_ripple
        text += (
            f"; no table of {ODRIVE_ENTRIES} held entries leaves less than {100.0 * least / cogging:.2g} %"
        )
    return {"ripple left": text}


def _unit_force(model: Model, unit: str, request: Request) -> float:
    """Returns the force of the model for one unit of the table."""
    given, force = request.unit_force, model.units["force"]
    if given is None:
        if unit in ("", force):
            return 1.0
        raise InputError(
            f"the table is in {unit} and the force of the model in {force}: state the force of one {unit} in "
            f"{force} with --unit-force"
        )
    if not (math.isfinite(given) and given > 0.0):
        raise InputError(f"--unit-force is {given:g}: must be a finite number > 0")
    return given
