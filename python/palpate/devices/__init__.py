# SPDX-License-Identifier: Apache-2.0
"""Devices: which there are, what is set before a run, whether one is fit, how an object is recorded."""

from .check import Check, check_device, judge, with_pushes
from .errors import DeviceError
from .finding import Finding
from .measuring import measure, record
from .push import Push, push_response
from .udev import install_rule
from .usb import Found, UsbSetup, find_devices, open_usb
from .wire import DeviceInfo, decode_info

__all__ = [
    "Check",
    "DeviceError",
    "DeviceInfo",
    "Finding",
    "Found",
    "Push",
    "UsbSetup",
    "check_device",
    "decode_info",
    "find_devices",
    "install_rule",
    "judge",
    "measure",
    "open_usb",
    "push_response",
    "record",
    "with_pushes",
]
