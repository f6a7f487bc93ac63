# SPDX-License-Identifier: Apache-2.0
"""USB devices and wheels: search, setup, check, and recording of an object."""

from .check import Check, check_device, judge, judge_servo, with_pushes
from .measuring import measure, record
from .observations import Observation
from .pushes import Push, push_response
from .servo import ServoEstimate, chirp, identify_servo, measure_servo
from .usb import DeviceError, Found, UsbSetup, find_devices, install_rule, open_usb
from .wheels import Wheel, find_wheels

__all__ = [
    "Check",
    "DeviceError",
    "Found",
    "Observation",
    "Push",
    "ServoEstimate",
    "UsbSetup",
    "Wheel",
    "check_device",
    "chirp",
    "find_devices",
    "find_wheels",
    "identify_servo",
    "install_rule",
    "judge",
    "judge_servo",
    "measure",
    "measure_servo",
    "open_usb",
    "push_response",
    "record",
    "with_pushes",
]
