# SPDX-License-Identifier: Apache-2.0
"""USB devices: search, setup, check, and recording of an object."""

from .check import Check, check_device, judge, with_pushes
from .measuring import measure, record
from .observations import Observation
from .pushes import Push, push_response
from .usb import DeviceError, Found, UsbSetup, find_devices, install_rule, open_usb

__all__ = [
    "Check",
    "DeviceError",
    "Found",
    "Observation",
    "Push",
    "UsbSetup",
    "check_device",
    "find_devices",
    "install_rule",
    "judge",
    "measure",
    "open_usb",
    "push_response",
    "record",
    "with_pushes",
]
