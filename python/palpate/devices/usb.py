# SPDX-License-Identifier: Apache-2.0
"""USB devices over pyusb: which there are, what they say of themselves, and what is set before a run.

The stream of samples needs both directions at once, which pyusb cannot do: it is the core's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType, TracebackType
from typing import Any

from ..errors import InputError
from . import wire
from .errors import DeviceError, device_error

_TIMEOUT_MS = 500


def _pyusb() -> ModuleType:
    try:
        import usb.core as core
    except ModuleNotFoundError:
        raise DeviceError("USB devices need pyusb: pip install 'palpate[usb]'") from None
    return core  # type: ignore[no-any-return]


class UsbSetup:
    """One USB device while it is set up. Use it as a context manager: it is let go at the end.

    Parameters
    ----------
    handle : usb.core.Device
        As pyusb found it.

    Raises
    ------
    DeviceError
        From every method: the device, what was being done, the reason and the likely cure.
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
        """How a person knows it."""
        known = " ".join(part for part in (self.product, self.serial) if part)
        return f"{known} ({self.place})" if known else self.place

    def identify(self) -> wire.DeviceInfo:
        """Ask the device who it is: strings and GET_INFO, decoded strictly."""
        info = wire.decode_info(
            bytes(self._request(wire.Request.GET_INFO, "asking who it is", wire.LARGEST_PACKET))
        )
        for field, index in (("product", self._handle.iProduct), ("serial", self._handle.iSerialNumber)):
            setattr(self, field, self._string(index))
        return info

    def zero(self) -> None:
        """Make the present position 0."""
        self._request(wire.Request.ZERO, "zeroing its encoder")

    def set_watchdog(self, milliseconds: int) -> None:
        """Set how long the device makes force without a command, 2 to 1000 ms."""
        if not wire.SHORTEST_WATCHDOG_MS <= milliseconds <= wire.LONGEST_WATCHDOG_MS:
            raise InputError(f"watchdog is {milliseconds} ms, must be 2 to 1000")
        self._request(wire.Request.WATCHDOG, "setting its watchdog", value=milliseconds)

    def enable(self) -> None:
        """Let it make force; it starts at none."""
        self._request(wire.Request.ENABLE, "enabling its force", value=1)

    def disable(self) -> None:
        """No force any longer."""
        self._request(wire.Request.ENABLE, "disabling its force", value=0)

    def clear(self) -> None:
        """Clear its faults; after an emergency stop this comes before `enable`."""
        self._request(wire.Request.CLEAR, "clearing its faults")

    def close(self) -> None:
        """Let the device go."""
        import usb.util

        usb.util.dispose_resources(self._handle)

    def _request(self, request: wire.Request, doing: str, size: int = 0, *, value: int = 0) -> bytes:
        core = _pyusb()
        try:
            answer = self._handle.ctrl_transfer(
                wire.TO_HOST if size else wire.TO_DEVICE,
                int(request),
                value,
                wire.INTERFACE,
                size or None,
                timeout=_TIMEOUT_MS,
            )
        except (core.USBError, NotImplementedError) as error:
            raise device_error(self.name, doing, error) from None
        return bytes(answer) if size else b""

    def _string(self, index: int) -> str:
        import usb.util

        core = _pyusb()
        try:
            text = usb.util.get_string(self._handle, index) or "" if index else ""
        except (core.USBError, ValueError):  # a device without names is as good
            return ""
        return "".join(" " if letter < " " or letter == "\x7f" else letter for letter in text).strip(" ")


@dataclass(frozen=True)
class Found:
    """A device on the bus: its identity, or what keeps it from telling."""

    place: str
    product: str
    serial: str
    info: wire.DeviceInfo | None
    problem: str = ""


def _candidates() -> Iterator[UsbSetup]:
    core = _pyusb()
    try:
        handles = sorted(
            core.find(find_all=True, idVendor=wire.VENDOR, idProduct=wire.PRODUCT),
            key=lambda handle: (handle.bus, handle.address),
        )
    except core.NoBackendError:
        raise DeviceError("USB devices need libusb-1.0: apt-get install libusb-1.0-0") from None
    for handle in handles:
        kinds = {
            (face.bInterfaceClass, face.bInterfaceSubClass, face.bInterfaceProtocol)
            for configuration in handle
            for face in configuration
            if face.bInterfaceNumber == wire.INTERFACE
        }
        if wire.INTERFACE_KIND in kinds:
            yield UsbSetup(handle)


def find_devices() -> list[Found]:
    """Every haptic USB device, the unusable ones with their reason.

    Raises
    ------
    DeviceError
        pyusb or libusb is missing.
    """
    found = []
    for device in _candidates():
        info, problem = None, ""
        with device:
            try:
                info = device.identify()
            except (DeviceError, InputError) as error:
                problem = str(error)
        found.append(Found(device.place, device.product, device.serial, info, problem))
    return found


def open_usb(serial: str = "") -> UsbSetup:
    """Open the only device, or the one with a serial number, to set it up.

    Parameters
    ----------
    serial : str
        Empty: there must be exactly one device.

    Raises
    ------
    DeviceError
        There is none, there are several, or it cannot be used: with the reason.
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
    raise DeviceError(f"no haptic USB device{wanted} is plugged in; `palpate devices` lists what there is")
