# SPDX-License-Identifier: Apache-2.0
"""USB devices over pyusb: search, identity, setup, and udev rule.

The core reads the stream of samples, because pyusb cannot transfer in both directions at once.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any

from .._core import device as core
from .._core.device import UsbRequest
from ..errors import InputError, command_word, escaped
from ..recording.files import replacing


class DeviceError(Exception):
    """Failure of a device: one sentence with the device's name, the reason and the likely cure."""


def device_error(device: str, action: str, error: Any) -> DeviceError:
    """Returns the `DeviceError` for an error of pyusb during an action on `device`."""
    cause = core.usb_cause(getattr(error, "backend_error_code", None) or 0)
    reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return DeviceError(f"{device}, {action}: {cause or f'{reason}; plug it in again'}")


def _pyusb() -> ModuleType:
    try:
        import usb.core
    except ModuleNotFoundError:
        raise DeviceError("USB devices need pyusb: pip install 'palpate[usb]'") from None
    return usb.core  # type: ignore[no-any-return]


def _bundled_libusb() -> Any:
    """Returns the pyusb backend for the libusb that a wheel contains; None without such a library."""
    bundled = sorted(Path(str(files("palpate"))).parent.glob("palpate.libs/libusb-1*"))
    if not bundled:
        return None
    from usb.backend import libusb1

    return libusb1.get_backend(find_library=lambda name: str(bundled[0]))


class UsbSetup:
    """Sets up one USB device. As a context manager it releases the device at the end.

    Parameters
    ----------
    handle : usb.core.Device
        Handle from pyusb.

    Raises
    ------
    DeviceError
        Raised by every request to the device; names the device, the action, the reason and the likely cure.
    """

    def __init__(self, handle: Any) -> None:
        self._handle = handle
        self.place = f"USB bus {handle.bus} address {handle.address}"
        self.serial = ""
        self.product = ""

    def __enter__(self) -> UsbSetup:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"UsbSetup({self.name!r})"

    @property
    def name(self) -> str:
        """Product name, serial number and bus address of the device."""
        known = " ".join(part for part in (self.product, self.serial) if part)
        return f"{known} ({self.place})" if known else self.place

    def identify(self) -> dict[str, Any]:
        """Reads the names and the identity of the device: see :func:`palpate._core.device.decode_info`."""
        answer = self._request(UsbRequest.GetInfo, "reading its identity", core.usb_largest_packet)
        info = core.decode_info(answer)
        self.product = self._string(self._handle.iProduct)
        self.serial = self._string(self._handle.iSerialNumber)
        return info

    def model(self) -> dict[str, Any] | None:
        """Reads the model that the device can render: see :func:`palpate._core.device.decode_model`.

        Returns None if the device has no model, or a firmware without this request.
        """
        try:
            return core.decode_model(
                self._request(UsbRequest.GetModel, "reading its model", core.usb_largest_packet)
            )
        except DeviceError:
            return None

    def zero(self) -> None:
        """Sets the zero of the device's position to the present position of the handle."""
        self._request(UsbRequest.Zero, "zeroing its encoder")

    def set_watchdog(self, milliseconds: int) -> None:
        """Sets the time for which the device holds its force without a command, 2 to 1000 ms."""
        if not core.shortest_watchdog_ms <= milliseconds <= core.longest_watchdog_ms:
            raise InputError(f"watchdog is {milliseconds} ms, must be 2 to 1000")
        self._request(UsbRequest.Watchdog, "setting its watchdog", value=milliseconds)

    def enable(self) -> None:
        """Enables the device's motor force, which starts at 0."""
        self._request(UsbRequest.Enable, "enabling its force", value=1)

    def disable(self) -> None:
        """Disables the device's motor force."""
        self._request(UsbRequest.Enable, "disabling its force", value=0)

    def clear(self) -> None:
        """Clears the faults that the device has stored; required before `enable` after an emergency stop."""
        self._request(UsbRequest.Clear, "clearing its faults")

    def close(self) -> None:
        """Releases the device."""
        import usb.util

        usb.util.dispose_resources(self._handle)

    def _request(self, request: UsbRequest, action: str, size: int = 0, *, value: int = 0) -> bytes:
        pyusb = _pyusb()
        try:
            answer = self._handle.ctrl_transfer(
                core.usb_to_host if size else core.usb_to_device,
                int(request),
                value,
                core.usb_interface,
                size or None,
                timeout=core.usb_timeout_ms,
            )
        except (pyusb.USBError, NotImplementedError) as error:
            raise device_error(self.name, action, error) from None
        return bytes(answer) if size else b""

    def _string(self, index: int) -> str:
        """Returns a string descriptor without control characters, escaped; empty if the device has none."""
        import usb.util

        try:
            text = usb.util.get_string(self._handle, index) or "" if index else ""
        except (_pyusb().USBError, ValueError):
            return ""
        return escaped(
            "".join(" " if letter < " " or letter == "\x7f" else letter for letter in text).strip(" ")
        )


@dataclass(frozen=True)
class Found:
    """USB device on the bus: its identity, or the reason why it cannot be used."""

    place: str
    product: str
    serial: str
    info: dict[str, Any] | None
    problem: str = ""
    model: dict[str, Any] | None = None
    """Model that the device can render itself: its fingerprint, that of its certificate, certified rate_hz,
    is_rendered"""


def _candidates() -> Iterator[UsbSetup]:
    pyusb = _pyusb()
    try:
        handles = sorted(
            pyusb.find(
                find_all=True,
                backend=_bundled_libusb(),
                idVendor=core.usb_vendor,
                idProduct=core.usb_product,
            ),
            key=lambda handle: (handle.bus, handle.address),
        )
    except pyusb.NoBackendError:
        raise DeviceError("USB devices need libusb-1.0: apt-get install libusb-1.0-0") from None
    for handle in handles:
        kinds = {
            (interface.bInterfaceClass, interface.bInterfaceSubClass, interface.bInterfaceProtocol)
            for configuration in handle
            for interface in configuration
            if interface.bInterfaceNumber == core.usb_interface
        }
        if core.usb_interface_kind in kinds:
            yield UsbSetup(handle)


def find_devices() -> list[Found]:
    """Finds every haptic USB device; a device that cannot be used is returned with the reason.

    Raises
    ------
    DeviceError
        pyusb or libusb is missing.
    """
    found = []
    for device in _candidates():
        info, problem, model = None, "", None
        with device:
            try:
                info = device.identify()
                model = device.model()
            except (DeviceError, InputError) as error:
                problem = str(error)
        found.append(Found(device.place, device.product, device.serial, info, problem, model))
    return found


def open_usb(serial: str = "") -> UsbSetup:
    """Opens the only connected USB device, or the one with the given serial number, to set it up.

    Parameters
    ----------
    serial : str
        Empty: there must be exactly one device.

    Raises
    ------
    DeviceError
        There is no device, there are several, or it cannot be used. The message gives the reason.
    """
    usable: list[UsbSetup] = []
    problems: list[str] = []
    for device in _candidates():
        try:
            device.identify()
        except (DeviceError, InputError) as error:
            device.close()
            problems.append(str(error))
            continue
        if serial in ("", device.serial):
            usable.append(device)
        else:
            device.close()
    if len(usable) == 1:
        return usable[0]
    for device in usable:
        device.close()
    if usable:
        names = ", ".join(device.serial or device.place for device in usable)
        raise DeviceError(f"there are {len(usable)} USB devices ({names}); choose with usb:SERIAL")
    if problems:
        raise DeviceError("; ".join(problems))
    wanted = f" with serial number {serial}" if serial else ""
    raise DeviceError(
        f"no haptic USB device{wanted} is plugged in; `palpate devices` lists the connected devices"
    )


RULE = "60-palpate.rules"
FOLDER = Path("/etc/udev/rules.d")

_RELOAD = (("udevadm", "control", "--reload-rules"), ("udevadm", "trigger", "--subsystem-match=usb"))


def install_rule(report: Callable[[str], None], *, folder: Path = FOLDER) -> None:
    """Writes the udev rule, which gives users access to the device, and makes udev read it.

    Parameters
    ----------
    report : callable
        Called with a sentence for each step.
    folder : Path
        Folder of the udev rules of this machine.

    Raises
    ------
    DeviceError
        The folder is missing or not writable. The message states the reason.
    """
    target = folder / RULE
    if not folder.is_dir():
        raise DeviceError(
            f"this machine has no folder {folder}: udev, which gives users access to devices, is "
            "not installed"
        )
    if not os.access(folder, os.W_OK):
        command_text = f"sudo {command_word(sys.executable)} -m palpate devices --install-udev-rule"
        raise DeviceError(f"writing {target} needs root; run: {command_text}")
    text = files(__package__).joinpath(RULE).read_text(encoding="utf-8")
    with replacing(target) as temporary:
        temporary.write_text(text, encoding="utf-8")
    report(f"wrote {target}:")
    report(text.splitlines()[-1])
    for command in _RELOAD:
        if shutil.which(command[0]) is None:
            report(f"{command[0]} is not installed: plug the device in again, or restart the machine")
            return
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            report(f"{' '.join(command)}: {done.stderr.strip() or 'failed'}; restart the machine instead")
            return
        report(f"ran {' '.join(command)}")
    report("plug the device in again")
