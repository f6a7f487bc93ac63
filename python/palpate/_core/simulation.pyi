# SPDX-License-Identifier: Apache-2.0
"""
Rendering in virtual time on a simulated device.
"""
from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import palpate._core.device
import palpate._core.model
import palpate._core.rendering
import typing
__all__: list[str] = ['Hand', 'TestRig', 'force_driven', 'force_error', 'motion_driven', 'rig_for', 'simulate']
class Hand:
    """
    A simulated hand: a spring to a point sweeping between lower and upper, a damper to ground.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, stiffness: typing.SupportsFloat | typing.SupportsIndex = 15.0, damping: typing.SupportsFloat | typing.SupportsIndex = 0.05, lower: typing.SupportsFloat | typing.SupportsIndex = 0.02, upper: typing.SupportsFloat | typing.SupportsIndex = 0.47, frequency_hz: typing.SupportsFloat | typing.SupportsIndex = 0.5) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def to_dict(self) -> dict:
        """
        The fields that are written to a file, by name; without optional ones that are not given.
        """
    @property
    def damping(self) -> float:
        """
        [N*s/m or N*m*s/rad]
        """
    @property
    def frequency_hz(self) -> float:
        """
        Sweeps a second [Hz].
        """
    @property
    def lower(self) -> float:
        """
        Least target [m or rad].
        """
    @property
    def stiffness(self) -> float:
        """
        [N/m or N*m/rad]
        """
    @property
    def upper(self) -> float:
        """
        Largest target [m or rad].
        """
class TestRig:
    """
    Simulated device and hand scaled to a model.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, device: palpate._core.device.DeviceProfile, hand: Hand, length: typing.SupportsFloat | typing.SupportsIndex = 1.0, force: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def scheme(self, model: palpate._core.model.ForceModel, **kwargs) -> palpate._core.rendering.Scheme:
        """
        Returns the scheme with the given fields of Scheme, in the model's units. None: the default at the model's scale.
        """
    def to_dict(self) -> dict:
        """
        The fields that are written to a file, by name; without optional ones that are not given.
        """
    @property
    def device(self) -> palpate._core.device.DeviceProfile:
        ...
    @property
    def force(self) -> float:
        """
        Forces, relative to those of the default knob.
        """
    @property
    def hand(self) -> Hand:
        ...
    @property
    def length(self) -> float:
        """
        Positions, relative to those of the default knob.
        """
def force_driven(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, force: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex, start_position: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> dict:
    """
    The motion that a recorded force (n,) gives the environment alone (paper figures 12 and 14).
    Arrays (n,) by name: force, environment_position, evaluations, status.
    """
def force_error(model: palpate._core.model.ForceModel, play_radius: typing.SupportsFloat | typing.SupportsIndex, *, start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], middle: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], end: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], applied: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], mean_applied: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex) -> dict:
    """
    RMS errors [N or N*m] of a simulated rendering against a model: at the end of the tick, at its
    sampling instant, of its mean over the tick, and of that below 50 Hz; and the work of the error [J].
    Arrays (n,) from simulate; play_radius 0 is the model's own.
    """
def motion_driven(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex) -> dict:
    """
    The force that would have been rendered while a recorded motion (n,) moves the device.
    Arrays (n,) by name: force, environment_position, evaluations, status.
    """
def rig_for(model: palpate._core.model.ForceModel, is_angle: bool, period_s: typing.SupportsFloat | typing.SupportsIndex = 0.001) -> TestRig:
    """
    Returns the test rig for a model of position, or of position and velocity. An angle is rendered on
    the default knob; for any other unit its lengths and forces are scaled to the travel and the largest
    force of the model.
    """
def simulate(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile, hand: Hand, duration_s: typing.SupportsFloat | typing.SupportsIndex, substeps: typing.SupportsInt | typing.SupportsIndex = 20, start_position: typing.SupportsFloat | typing.SupportsIndex = 0.0, progress: collections.abc.Callable | None = None) -> dict:
    """
    The model rendered on a simulated device held by a simulated hand, in virtual time.
    The handle starts at rest at start_position. Calls progress(ticks) about ten times a second. Ctrl-C
    ends it as in Python; ValueError for more than 3 600 000 ticks.
    
    Arrays (n,) by name: time_s, position (measured), velocity, handle_start, handle_middle and
    handle_end (the true handle when sampled, and in the middle and at the end of the tick that holds the
    force), environment_position, force (commanded), applied (at the end of the tick), mean_applied (over
    the tick), evaluations, status, extrapolated.
    """
