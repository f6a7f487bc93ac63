# SPDX-License-Identifier: Apache-2.0
"""
Rendering and measuring in real time.
"""
from __future__ import annotations
import collections.abc
import palpate._core.model
import palpate._core.rendering
import typing
__all__: list[str] = ['LoopSettings', 'measure', 'render', 'usual_telemetry_hz']
class LoopSettings:
    """
    When a rendering ticks, and when it ends: the defaults.
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
def measure(device: str = 'simulated', *, object: palpate._core.model.ForceModel | None = None, transducer: bool = True, position_unit: str = 'rad', force_unit: str = 'N*m', probe: bool = False, lower: typing.SupportsFloat | typing.SupportsIndex | None = None, upper: typing.SupportsFloat | typing.SupportsIndex | None = None, speed: typing.SupportsFloat | typing.SupportsIndex | None = None, stiffness: typing.SupportsFloat | typing.SupportsIndex | None = None, force_limit: typing.SupportsFloat | typing.SupportsIndex | None = None, push: typing.SupportsFloat | typing.SupportsIndex | None = None, rate_hz: typing.SupportsFloat | typing.SupportsIndex = 1000.0, duration_s: typing.SupportsFloat | typing.SupportsIndex = 10.0, record: str = '', force: bool = False, keep: bool = False, priority: typing.SupportsInt | typing.SupportsIndex = 80, cpu: typing.SupportsInt | typing.SupportsIndex = -1, lowest_rate_share: typing.SupportsFloat | typing.SupportsIndex = 0.8, wait_s: typing.SupportsFloat | typing.SupportsIndex | None = None, progress: collections.abc.Callable | None = None, friction_share: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> dict:
    """
    A real object measured in real time; on the simulated device the model `object` is mounted.
    
    A hand moves the handle; with `probe` the device itself does, slowly between `lower` and `upper`;
    with `push` it gives short pushes of that force to either side. Blocks for `duration_s` (inf: until
    Ctrl-C) without holding the interpreter; `progress(ticks, position, force, lost)` is called ten times a
    second. A packet of a USB device is waited for `wait_s`. `record` names the recording, which grows as
    record.part; an existing one is refused, or replaced with `force`. With `keep` the summary, returned
    by name, holds the ticks. `friction_share` is the Coulomb friction of the simulated device, over its force
    limit. ValueError where it is refused before anything moves.
    """
def render(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, *, position_unit: str = 'rad', force_unit: str = 'N*m', rate_hz: typing.SupportsFloat | typing.SupportsIndex = 1000.0, duration_s: typing.SupportsFloat | typing.SupportsIndex = 10.0, record: str = '', force: bool = False, model_name: str = '', telemetry_port: typing.SupportsInt | typing.SupportsIndex | None = None, telemetry_hz: typing.SupportsFloat | typing.SupportsIndex = 50.0, priority: typing.SupportsInt | typing.SupportsIndex = 80, cpu: typing.SupportsInt | typing.SupportsIndex = -1, lowest_rate_share: typing.SupportsFloat | typing.SupportsIndex = 0.8, progress: collections.abc.Callable | None = None) -> dict:
    """
    The model rendered in real time on a simulated device: the loop of palpate-control.
    
    Blocks for `duration_s` (inf: until Ctrl-C) without holding the interpreter. `record` names the
    recording, which grows as record.part; an existing one is refused, or replaced with `force`. A
    `telemetry_port` of this machine gets JSON lines over UDP.
    `progress(ticks, position, force, lost)` is called ten times a second.
    A rate below `lowest_rate_share` of `rate_hz` for half a second ends it, 0: never.
    Returns the summary by name; ValueError where it is refused before anything moves.
    """
usual_telemetry_hz: float = 50.0
