# SPDX-License-Identifier: Apache-2.0
"""Measurements on a device with the loop of the core, for `record` and `check-device`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..model import Model
from ..system import require_live_control

Progress = Callable[[int, float, float, int], None]
"""Function that is called ten times a second with number of ticks, position, force, number of lost samples"""


def measure(device: str = "simulated", *, object: Model | None = None, **settings: Any) -> dict[str, Any]:
    """Runs the loop on a device without rendering.

    Parameters
    ----------
    device : str
        Name of the device, in one of the forms that ``palpate devices`` lists.
    object : Model, optional
        The object mounted on the simulated device.
    **settings
        Arguments of :func:`palpate._core.run.measure`.

    Returns
    -------
    dict
        Numbers and words of the summary, by name.

    Raises
    ------
    InputError
        The measurement was refused before any motion; the message states the device, the reason and the cure.
    """
    require_live_control("a measurement on a device")
    from .._core.run import measure as measure_live

    if object is not None:
        if device != "simulated":
            raise InputError(f"object needs device simulated; {device} has a real object: leave out object")
        settings["position_unit"] = object.units["position"]
        settings["force_unit"] = object.units["force"]
        if object.units["force"] == "A":
            raise InputError("the object's force is a motor current in A; it must be in N or N*m")
        if object.dimension != 1:
            raise InputError(f"the object has {object.dimension} inputs; it must have 1, the position")
    try:
        return measure_live(device=device, object=object, **settings)
    except InputError:
        raise
    except ValueError as error:
        raise InputError(str(error)) from None


def record(
    path: str | Path,
    *,
    device: str = "simulated",
    object: Model | None = None,
    force: bool = False,
    probe: bool = False,
    device_renders: bool = False,
    duration_s: float = 10.0,
    rate_hz: float = 1000.0,
    transducer: bool = True,
    wait_s: float | None = None,
    lowest_rate_share: float | None = None,
    progress: Progress | None = None,
    **sweep: float | None,
) -> dict[str, Any]:
    """Records position and force of a real object.

    Without `probe` the user moves the handle. With `device_renders` a USB device renders its own model, and
    the recording contains the force of the motor. With `probe` the device moves the handle slowly to and fro,
    and reverses if the force reaches `force_limit`. The force is that of the device's transducer. Without a
    transducer it is the force of the motor, which includes the friction of the device and needs the probe.

    Parameters
    ----------
    path : str or Path
        File of the recording. Until the recording is complete, the file is called path.part and is locked.
    force : bool
        True: an existing recording is replaced. False: it is refused.
    device : str
        Name of the device, in one of the forms that ``palpate devices`` lists.
    object : Model, optional
        The object mounted on the simulated device.
    probe : bool
        True: the device moves the handle.
    device_renders : bool
        True: the USB device renders the model of its firmware.
    duration_s, rate_hz : float
        Duration (inf: until Ctrl-C) [s] and sampling rate [Hz].
    transducer : bool
        True if the simulated device has a force transducer.
    wait_s : float, optional
        Longest wait for a packet of a USB device [s].
    lowest_rate_share : float, optional
        A rate below this share of `rate_hz` for half a second ends a probe; 0: never. A recording by hand
        continues.
    progress : callable, optional
        Called ten times a second with ticks, position, force and samples lost.
    **sweep
        lower, upper [m or rad], speed [m/s or rad/s], stiffness and force_limit of the probe; None: chosen.

    Returns
    -------
    dict
        The summary, by name: verdict ("good", "usable: ..." or "no: ..."), findings, recorded rows, rate,
        reason of the end, ...

    Raises
    ------
    InputError
        The recording was refused before any motion.
    """
    if not probe:
        lowest_rate_share = 0.0  # without `probe` a low loop rate is only reported; the recording goes on
    if lowest_rate_share is not None:
        sweep["lowest_rate_share"] = lowest_rate_share
    return measure(
        device,
        object=object,
        record=str(path),
        force=force,
        probe=probe,
        device_renders=device_renders,
        duration_s=duration_s,
        rate_hz=rate_hz,
        transducer=transducer,
        wait_s=wait_s,
        progress=progress,
        **sweep,
    )
