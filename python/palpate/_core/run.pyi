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
__all__: list[str] = ['LoopSettings', 'measure', 'render', 'smallest_domain_share', 'tolerated_change', 'usual_telemetry_hz']
class LoopSettings:
    """
    Default rate, duration and limits of a session.
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
    
    A hand moves the handle; with `probe` the device moves it slowly between `lower` and `upper`; with
    `push` it gives short pushes of that force to either side. Options by keyword, None for the
    default: device (simulated or usb[:SERIAL]), wait_s, rate_hz, duration_s (inf: until Ctrl-C),
    record, force, priority, cpu, lowest_rate_share, probe, lower, upper, speed, stiffness, force_limit,
    push, keep, transducer, friction_share (Coulomb friction of the simulated device over its force
    limit). Calls progress(ticks, position, force, lost) ten times a second.
    
    Returns the summary by name; with `keep` it holds the ticks. InputError where it is refused before
    anything moves.
    """
def render(model: palpate._core.model.ForceModel, plan: palpate._core.rendering.Scheme | None = None, *, limited: palpate._core.model.ForceModel | None = None, certificate: palpate._core.stability.Certificate | None = None, position_unit: str = 'rad', force_unit: str = 'N*m', model_name: str = '', progress: collections.abc.Callable | None = None, **kwargs) -> dict:
    """
    Renders a model in real time on a device: the loop of palpate-control.
    
    `plan`, `limited` and `certificate` are those of the model; without a plan the scheme is the default
    one. Options by keyword, None for the default: device (simulated, usb[:SERIAL] or
    inverse3[:AXIS[@PORT]]), uncertified, wait_s, rate_hz, duration_s (inf: until Ctrl-C), record,
    force, telemetry_port, telemetry_hz, priority, cpu, lowest_rate_share, force_limit, faults, and the
    fields of a scheme. `record` names the recording, which grows as record.part; an existing one is
    refused, or replaced with `force`. Calls progress(ticks, position, force, lost) ten times a second.
    
    Returns the summary by name, its lines for a person under `lines`. InputError where it is refused
    before anything moves.
    """
smallest_domain_share: float = 0.1
tolerated_change: float = 0.01
usual_telemetry_hz: float = 50.0
