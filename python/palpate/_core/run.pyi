# SPDX-License-Identifier: Apache-2.0
"""
Rendering and measuring in real time.
"""
from __future__ import annotations
import collections.abc
import palpate._core.model
import palpate._core.rendering
import palpate._core.stability
import typing
__all__: list[str] = ['LoopSettings', 'device_help', 'device_waits', 'measure', 'measured_device_help', 'render', 'transports', 'usual_telemetry_hz']
class LoopSettings:
    """
    Default rate, duration and least rate of a run.
    """
    def __init__(self) -> None:
        ...
    @property
    def duration_s(self) -> float:
        ...
    @property
    def lowest_rate_share(self) -> float:
        ...
    @property
    def rate_hz(self) -> float:
        ...
def measure(*, object: palpate._core.model.ForceModel | None = None, position_unit: str = 'rad', force_unit: str = 'N*m', progress: collections.abc.Callable | None = None, **kwargs) -> dict:
    """
    Measures a real object in real time; on the simulated device the model `object` is mounted.
    
    A hand moves the handle. With `probe` the device moves it slowly between `lower` and `upper`. With
    `push` the device gives short pushes of up to this force to either side. Options are keywords,
    None for the default:
    
    - device (see `transports`), wait_s.
    - rate_hz, duration_s (inf: until Ctrl-C), lowest_rate_share, priority, cpu.
    - probe, lower, upper, speed, stiffness, force_limit, push.
    - record, force, keep.
    - transducer, friction_share (Coulomb friction of the simulated device / its force limit).
    - device_renders: a USB device renders its own model, and its force is recorded.
    
    Calls progress(ticks, position, force, lost) ten times a second.
    
    Returns the values of the summary by name; with `keep` the columns of all ticks are under `kept`.
    Raises InputError if the measurement is refused, before the device moves.
    """
def render(model: palpate._core.model.ForceModel, plan: palpate._core.rendering.Scheme | None = None, *, limited: palpate._core.model.ForceModel | None = None, certificate: palpate._core.stability.Certificate | None = None, position_unit: str = 'rad', force_unit: str = 'N*m', model_name: str = '', findings: collections.abc.Sequence[str] = [], progress: collections.abc.Callable | None = None, **kwargs) -> dict:
    """
    Renders a model in real time on a device: the loop of palpate-control.
    
    `plan`, `limited` and `certificate` are read from the model file; `limited` is the model that the plan
    renders instead. `findings` are the defects of the model, which the verdict repeats. Without a plan
    the default scheme is used. Options are keywords, None for the default:
    
    - device (see `transports`), wait_s, uncertified, faults.
    - rate_hz, duration_s (inf: until Ctrl-C), lowest_rate_share, priority, cpu.
    - force_limit and the fields of a scheme.
    - record, force, telemetry_port, telemetry_hz.
    
    `record` is the name of the recording, which is written as record.part and renamed at the end. If the
    recording exists, it is replaced with `force`, otherwise the call is refused. Calls
    progress(ticks, position, force, lost) ten times a second.
    
    Returns the values of the summary by name, and the text of the summary under `lines`. Raises InputError
    if the rendering is refused, before the device moves.
    """
device_help: str = 'simulated, usb[:SERIAL], mit:BUS:NUMBER:KIND, moteus:BUS:NUMBER:KP, wheel:NODE:DEGREES:TORQUE[:STIFFNESS] or inverse3[:AXIS[@PORT]]; an MIT-mode drive of this KIND, such as damiao-4310, with a CAN NUMBER on a BUS such as can0; a moteus whose servo.pid_position.kp is KP in N*m/rev; a force-feedback wheel (USB class PID) on a NODE such as /dev/hidraw0: DEGREES from end to end, TORQUE in N*m of its full force, STIFFNESS in N*m/rad of its full spring; AXIS is x, y, z (default), -x, -y or -z, PORT that of its service'
device_waits: str = 'usb 5, mit 2, moteus 2, wheel 1, inverse3 20'
measured_device_help: str = 'simulated, usb[:SERIAL], mit:BUS:NUMBER:KIND, moteus:BUS:NUMBER:KP or wheel:NODE:DEGREES:TORQUE[:STIFFNESS]; an MIT-mode drive of this KIND, such as damiao-4310, with a CAN NUMBER on a BUS such as can0; a moteus whose servo.pid_position.kp is KP in N*m/rev; a force-feedback wheel (USB class PID) on a NODE such as /dev/hidraw0: DEGREES from end to end, TORQUE in N*m of its full force, STIFFNESS in N*m/rad of its full spring'
transports: tuple = (('simulated', 'simulated', ''), ('usb', 'usb[:SERIAL]', ''), ('mit', 'mit:BUS:NUMBER:KIND', 'an MIT-mode drive of this KIND, such as damiao-4310, with a CAN NUMBER on a BUS such as can0'), ('moteus', 'moteus:BUS:NUMBER:KP', 'a moteus whose servo.pid_position.kp is KP in N*m/rev'), ('wheel', 'wheel:NODE:DEGREES:TORQUE[:STIFFNESS]', 'a force-feedback wheel (USB class PID) on a NODE such as /dev/hidraw0: DEGREES from end to end, TORQUE in N*m of its full force, STIFFNESS in N*m/rad of its full spring'), ('inverse3', 'inverse3[:AXIS[@PORT]]', 'AXIS is x, y, z (default), -x, -y or -z, PORT that of its service'))
usual_telemetry_hz: float = 50.0
