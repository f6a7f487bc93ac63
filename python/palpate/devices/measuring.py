# SPDX-License-Identifier: Apache-2.0
"""A real object measured on a device by the core's loop: what `record` and `check-device` stand on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from .._core.run import measure as measure_live
from ..errors import InputError
from ..model import Model

Progress = Callable[[int, float, float, int], None]
"""Is told, ten times a second, the ticks so far, the position, the object's force and the samples lost."""


def measure(device: str = "simulated", *, object: Model | None = None, **settings: Any) -> dict[str, Any]:
    """Let the loop run on a device that nobody renders on.

    Parameters
    ----------
    device : str
        ``simulated``, or ``usb[:SERIAL]``.
    object : Model, optional
        What is mounted on the simulated device.
    **settings
        As :func:`palpate._core.run.measure` takes them.

    Returns
    -------
    dict
        What was done, by name.

    Raises
    ------
    InputError
        Refused before anything moved: with the device, the reason and its cure.
    """
    if object is not None:
        if device != "simulated":
            raise InputError(f"an object is mounted on the simulated device only; {device} has its own")
        settings["position_unit"] = object.units["position"]
        settings["force_unit"] = object.units["force"]
        if object.units["force"] == "A":
            raise InputError("the object's force is a motor current in A; mount a model whose force is one")
        if object.dimension != 1:
            raise InputError(
                f"the object has {object.dimension} inputs: one of the position alone can be mounted"
            )
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
    duration_s: float = 10.0,
    rate_hz: float = 1000.0,
    transducer: bool = True,
    wait_s: float | None = None,
    lowest_rate_share: float | None = None,
    progress: Progress | None = None,
    **sweep: float | None,
) -> dict[str, Any]:
    """Record position and force of a real object.

    Without `probe` somebody moves the handle; with it the device draws the handle along slowly, to and
    fro, and turns round where the object holds `force_limit`. The force is that of the device's transducer;
    without one it is what the motor holds against the object, the friction of the device included, which
    needs the probe.

    Parameters
    ----------
    path : str or Path
        The recording; it grows as path.part, which is locked while it grows.
    force : bool
        Whether an existing recording is replaced; without, it is refused.
    device : str
        ``simulated``, or ``usb[:SERIAL]``.
    object : Model, optional
        What is mounted on the simulated device.
    probe : bool
        Whether the device moves the handle by itself.
    duration_s, rate_hz : float
        How long (inf: until Ctrl-C) [s], and how often [Hz].
    transducer : bool
        Whether the simulated device has one.
    wait_s : float, optional
        How long a packet of a USB device is waited for [s].
    lowest_rate_share : float, optional
        Of the rate: less for half a second ends a probe, 0: never; a hand's recording never ends by it.
    progress : callable, optional
        Is told ten times a second: ticks, position, force, samples lost.
    **sweep
        lower, upper [m or rad], speed [a second], stiffness, force_limit of the probe; None: as suits it.

    Returns
    -------
    dict
        What was done, by name: verdict ("good", "usable: ..." or "no: ..."), findings, recorded rows, rate,
        how it ended, ...

    Raises
    ------
    InputError
        Refused before anything moved.
    """
    if device == "simulated" and object is None:
        raise InputError("nothing is mounted on the simulated device; give it an object, a model file")
    if not probe and not transducer:
        raise InputError(
            "this device has no force transducer, and its motor shows nothing of a force while somebody else "
            "moves the handle: probe instead"
        )
    if not probe:
        lowest_rate_share = 0.0  # nothing makes force: a low rate is told, and no reason to stop
    if lowest_rate_share is not None:
        sweep["lowest_rate_share"] = lowest_rate_share
    return measure(
        device,
        object=object,
        record=str(path),
        force=force,
        probe=probe,
        duration_s=duration_s,
        rate_hz=rate_hz,
        transducer=transducer,
        wait_s=wait_s,
        progress=progress,
        **sweep,
    )
