# SPDX-License-Identifier: Apache-2.0
"""
Profiles of devices, and the packets of USB devices.
"""
from __future__ import annotations
import typing
__all__: list[str] = ['AdmittanceDisplay', 'DeviceProfile', 'HeldLine', 'OnDevice', 'UsbRequest', 'decode_info', 'decode_model', 'longest_watchdog_ms', 'on_device', 'shortest_watchdog_ms', 'usb_cause', 'usb_interface', 'usb_interface_kind', 'usb_largest_packet', 'usb_product', 'usb_timeout_ms', 'usb_to_device', 'usb_to_host', 'usb_vendor', 'wheel_has_springs']
class OnDevice:
    """
    Timing of a model that runs on the motor controller of a device, in SI units.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    @typing.overload
    def __init__(self, *, delay_periods: typing.SupportsFloat | typing.SupportsIndex = 1.0, delay_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, jitter_s: typing.SupportsFloat | typing.SupportsIndex = 1e-06, highest_rate_hz: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        ...
    @typing.overload
    def __init__(self, fields: dict) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    @property
    def delay_periods(self) -> float:
        """
        Time from a sample to the force computed from it, in periods of the controller [-].
        """
    @property
    def delay_s(self) -> float:
        """
        Delay in addition to delay_periods, for example of the current control and of a filter [s].
        """
    @property
    def highest_rate_hz(self) -> float | None:
        """
        Highest rate of the controller [Hz]; absent: not known.
        """
    @property
    def jitter_s(self) -> float:
        """
        Largest time between two samples, minus the period [s].
        """
class AdmittanceDisplay:
    """
    Hand, handle and position servo of a device that measures the force and moves to a commanded
    position, in SI units. A certificate holds for every hand within the stated limits.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    @typing.overload
    def __init__(self, *, hand_stiffness: typing.SupportsFloat | typing.SupportsIndex = 0.0, hand_damping: typing.SupportsFloat | typing.SupportsIndex = 0.0, hand_mass: typing.SupportsFloat | typing.SupportsIndex = 0.0, handle_mass: typing.SupportsFloat | typing.SupportsIndex = 0.0, servo_bandwidth_hz: typing.SupportsFloat | typing.SupportsIndex | None = None, servo_damping: typing.SupportsFloat | typing.SupportsIndex | None = None, rate_limit: typing.SupportsFloat | typing.SupportsIndex | None = None, position_step: typing.SupportsFloat | typing.SupportsIndex = 0.0, feed_forward_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, drive_stiffness: typing.SupportsFloat | typing.SupportsIndex | None = None, drive_damping: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        ...
    @typing.overload
    def __init__(self, fields: dict) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    @property
    def drive_damping(self) -> float | None:
        """
        Damping of the position control of a motor drive [N*m*s/rad]; a moteus uses its own servo.pid_position.kd. Absent: none.
        """
    @property
    def drive_stiffness(self) -> float | None:
        """
        Stiffness of the position control of a motor drive, which each command states [N*m/rad]; absent: the servo has its own.
        """
    @property
    def feed_forward_s(self) -> float:
        """
        Time by which the command is ahead of the object's motion, to compensate the servo's lag [s].
        """
    @property
    def hand_damping(self) -> float:
        """
        b_h, largest damping of the hand or foot [N*s/m or N*m*s/rad].
        """
    @property
    def hand_mass(self) -> float:
        """
        Largest mass of the hand or foot that moves with the handle [kg or kg*m^2].
        """
    @property
    def hand_stiffness(self) -> float:
        """
        k_h, largest stiffness of the hand or foot [N/m or N*m/rad].
        """
    @property
    def handle_mass(self) -> float:
        """
        Mass between the force sensor and the hand [kg or kg*m^2].
        """
    @property
    def position_step(self) -> float:
        """
        Smallest change of the position command, such as one step of a stepper motor [m or rad]; 0 = not quantised.
        """
    @property
    def rate_limit(self) -> float | None:
        """
        Largest speed of the position command [m/s or rad/s]; absent: none.
        """
    @property
    def servo_bandwidth_hz(self) -> float | None:
        """
        Natural frequency of the position servo [Hz]; of a servo of first order, its corner frequency. Absent: the servo moves at once.
        """
    @property
    def servo_damping(self) -> float | None:
        """
        Damping ratio of a position servo of second order [-]; absent: first order.
        """
class HeldLine:
    """
    Loop of a motor controller that holds a line between two commands, in SI units.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    @typing.overload
    def __init__(self, *, period_s: typing.SupportsFloat | typing.SupportsIndex = 5e-05, delay_s: typing.SupportsFloat | typing.SupportsIndex = 5e-05, encoder_step: typing.SupportsFloat | typing.SupportsIndex = 0.0, stiffness_step: typing.SupportsFloat | typing.SupportsIndex = 0.0, position_step: typing.SupportsFloat | typing.SupportsIndex = 0.0, largest_stiffness: typing.SupportsFloat | typing.SupportsIndex | None = None, limits_force: bool = True, watchdog_s: typing.SupportsFloat | typing.SupportsIndex | None = None, largest_center: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        ...
    @typing.overload
    def __init__(self, fields: dict) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    @property
    def delay_s(self) -> float:
        """
        Time from a sample of the controller to its force, lag of the current control included [s].
        """
    @property
    def encoder_step(self) -> float:
        """
        Smallest change of position that the controller reads [m or rad]; 0 = not quantised.
        """
    @property
    def largest_center(self) -> float | None:
        """
        Largest distance from 0 of the position at which a line has zero force, for a controller that takes a spring about a center, such as a wheel [m or rad]; absent: a command states force and position.
        """
    @property
    def largest_stiffness(self) -> float | None:
        """
        Largest stiffness that a command can have [N/m or N*m/rad]; absent: any.
        """
    @property
    def limits_force(self) -> bool:
        """
        True if the controller limits the force of the line to the force limit of the profile.
        """
    @property
    def period_s(self) -> float:
        """
        Time between two samples of the controller [s].
        """
    @property
    def position_step(self) -> float:
        """
        Smallest change of the commanded position [m or rad]; 0 = not quantised.
        """
    @property
    def stiffness_step(self) -> float:
        """
        Smallest change of the commanded stiffness [N/m or N*m/rad]; 0 = not quantised.
        """
    @property
    def watchdog_s(self) -> float | None:
        """
        Time after the last command at which the controller makes zero force [s]; absent: never.
        """
class DeviceProfile:
    """
    Properties of a haptic device of one degree of freedom, in SI units; a knob (rad) or a straight handle (m).
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, id: str = 'simulated-knob', position_unit: str = 'rad', period_s: typing.SupportsFloat | typing.SupportsIndex = 0.001, inertia: typing.SupportsFloat | typing.SupportsIndex = 0.0002, viscous_damping: typing.SupportsFloat | typing.SupportsIndex = 0.06, coulomb_friction: typing.SupportsFloat | typing.SupportsIndex = 0.0, encoder_step: typing.SupportsFloat | typing.SupportsIndex = 9.587379924285257e-05, force_step: typing.SupportsFloat | typing.SupportsIndex = 0.0, delay_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_limit: typing.SupportsFloat | typing.SupportsIndex = 5.0, jitter_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, renderer: str | None = None, on_device: OnDevice | None = None, admittance: AdmittanceDisplay | None = None, held_line: HeldLine | None = None) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    @property
    def admittance(self) -> AdmittanceDisplay | None:
        """
        Hand, handle and position servo of an admittance display, which measures the force and moves to a position; absent: the device measures its position and applies a force.
        """
    @property
    def coulomb_friction(self) -> float:
        """
        f_c, Coulomb friction of the handle without control [N or N*m]; not more than the true value.
        """
    @property
    def delay_s(self) -> float:
        """
        t_d, time from a sample to the force that is computed from it [s]; 0 to 16 periods.
        """
    @property
    def encoder_step(self) -> float:
        """
        Delta, smallest change of position that the encoder reports [m or rad]; 0 = not quantised.
        """
    @property
    def force_limit(self) -> float:
        """
        Largest force of the device [N or N*m].
        """
    @property
    def force_step(self) -> float:
        """
        Delta_F, smallest change of the commanded force [N or N*m]; 0 = not quantised.
        """
    @property
    def held_line(self) -> HeldLine | None:
        """
        Loop of a controller that holds a line between two commands; absent: it holds a force.
        """
    @property
    def id(self) -> str:
        """
        Name; a certificate holds for the device with this name and these numbers.
        """
    @property
    def inertia(self) -> float:
        """
        Inertia of handle and motor together [kg or kg*m^2].
        """
    @property
    def jitter_s(self) -> float:
        """
        Largest time between two samples, minus the period T [s].
        """
    @property
    def late_samples(self) -> int:
        """
        Delay in periods, rounded up to a whole number.
        """
    @property
    def longest_period_s(self) -> float:
        """
        period_s + jitter_s, the longest time between two samples [s].
        """
    @property
    def on_device(self) -> OnDevice | None:
        """
        Timing of a model that runs on the motor controller; absent: the defaults of OnDevice.
        """
    @property
    def period_s(self) -> float:
        """
        T, time between two samples [s].
        """
    @property
    def position_unit(self) -> str:
        """
        "rad", with forces in N*m, or "m", with forces in N.
        """
    @property
    def renderer(self) -> str | None:
        """
        "device" if the model runs on the motor controller, with the period, delay and jitter above; absent if it runs on the host.
        """
    @property
    def viscous_damping(self) -> float:
        """
        b, viscous damping of the handle without control [N*s/m or N*m*s/rad]; not more than the true value.
        """
class UsbRequest:
    """
    Numbers of the control requests to a USB device (field bRequest of a control transfer).
    
    Members:
    
      GetInfo
    
      Enable
    
      Zero
    
      Watchdog
    
      Clear
    
      GetModel
    
      Renderer
    """
    Clear: typing.ClassVar[UsbRequest]
    Enable: typing.ClassVar[UsbRequest]
    GetInfo: typing.ClassVar[UsbRequest]
    GetModel: typing.ClassVar[UsbRequest]
    Renderer: typing.ClassVar[UsbRequest]
    Watchdog: typing.ClassVar[UsbRequest]
    Zero: typing.ClassVar[UsbRequest]
    __members__: typing.ClassVar[dict[str, UsbRequest]]
    @typing.overload
    def __eq__(self, other: UsbRequest) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: UsbRequest) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
def decode_info(data: bytes) -> dict:
    """
    Returns the properties in a USB device's answer to the request GET_INFO, by name. Raises
    InputError with the wrong field.
    
    firmware, counts_per_rev, encoder_step [rad], max_torque [N*m], rate_hz, watchdog_ms,
    transducer, measures_velocity, uid.
    """
def decode_model(data: bytes) -> dict:
    """
    Returns the model in a USB device's answer to the request GET_MODEL, by name. Raises
    InputError with the wrong field.
    
    fingerprint and certificate (16 hexadecimal digits each), rate_hz (certified), is_rendered
    (now, by the device).
    """
def on_device(profile: DeviceProfile, rate_hz: typing.SupportsFloat | typing.SupportsIndex) -> DeviceProfile:
    """
    Returns the profile of a device whose motor controller runs the model rate_hz times a second. Raises ValueError
    if the controller does not reach this rate, or if its delay is longer than 16 periods.
    """
def usb_cause(code: typing.SupportsInt | typing.SupportsIndex) -> str:
    """
    Returns cause and cure for an error code of libusb; empty for a code without a text.
    """
def wheel_has_springs(descriptor: bytes) -> bool | None:
    """
    Returns whether a force-feedback wheel with this report descriptor has springs; None if the
    descriptor lacks a report that the adapter needs.
    """
longest_watchdog_ms: int = 1000
shortest_watchdog_ms: int = 2
usb_interface: int = 0
usb_interface_kind: tuple = (255, 1, 1)
usb_largest_packet: int = 64
usb_product: int = 1
usb_timeout_ms: int = 500
usb_to_device: int = 65
usb_to_host: int = 193
usb_vendor: int = 4617
