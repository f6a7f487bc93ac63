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
__all__: list[str] = ['AccountUse', 'Hand', 'RestingOscillation', 'TestRig', 'account_use', 'display_motion', 'force_driven', 'force_error', 'motion_driven', 'resting_oscillation', 'rig_for', 'simulate', 'smallest_domain_share', 'tolerated_change']
class Hand:
    """
    Simulated hand: a spring to a target that moves between lower and upper, and
    a damper between handle and ground.
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
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    @property
    def damping(self) -> float:
        """
        Damping between handle and ground [N*s/m or N*m*s/rad].
        """
    @property
    def frequency_hz(self) -> float:
        """
        Frequency of the target's motion from lower to upper and back [Hz].
        """
    @property
    def lower(self) -> float:
        """
        Smallest position of the spring's target [m or rad].
        """
    @property
    def stiffness(self) -> float:
        """
        Stiffness of the spring between target and handle [N/m or N*m/rad].
        """
    @property
    def upper(self) -> float:
        """
        Largest position of the spring's target [m or rad].
        """
class TestRig:
    """
    Simulated device and hand, scaled to a model.
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
        Returns a scheme with the given fields of Scheme, in the model's units. Other fields, and fields
        with the value None, have the default, multiplied by the scale of the model.
        """
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    @property
    def device(self) -> palpate._core.device.DeviceProfile:
        ...
    @property
    def force(self) -> float:
        """
        Factor of forces, relative to those of the default knob [-].
        """
    @property
    def hand(self) -> Hand:
        ...
    @property
    def length(self) -> float:
        """
        Factor of positions, relative to those of the default knob [-].
        """
class AccountUse:
    """
    Effect of the energy account on simulated presses and rests, and the numbers of its limit.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, energy: typing.SupportsFloat | typing.SupportsIndex, largest_speed: typing.SupportsFloat | typing.SupportsIndex, share: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_error: typing.SupportsFloat | typing.SupportsIndex = 0.0, shares: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = []) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    @property
    def energy(self) -> float:
        """
        E0, largest energy that a hand can take out [J].
        """
    @property
    def force_error(self) -> float:
        """
        Largest RMS, over all motions, of the change of the force by the account [N or N*m].
        """
    @property
    def largest_speed(self) -> float:
        """
        Speed above which a reading ends the run [m/s or rad/s].
        """
    @property
    def share(self) -> float:
        """
        Largest share, over all motions, of the ticks inside the domain in which the account limits the force [-].
        """
    @property
    def shares(self) -> list[float]:
        """
        The share of each press, then of the rest at the largest force and of that at the steepest slope [-].
        """
class RestingOscillation:
    """
    Oscillation of a handle on which a finger rests, in simulation.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, position: typing.SupportsFloat | typing.SupportsIndex, amplitude: typing.SupportsFloat | typing.SupportsIndex, frequency_hz: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    @property
    def amplitude(self) -> float:
        """
        Half the distance between its reversals; 0: it comes to rest [m or rad].
        """
    @property
    def frequency_hz(self) -> float:
        """
        Frequency of the oscillation [Hz].
        """
    @property
    def position(self) -> float:
        """
        Mean position of the handle [m or rad].
        """
def account_use(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> AccountUse:
    """
    Presses and holds a model in simulation while the energy account limits its force. The finger
    presses at 10, 30, 100 and 300 mm/s, or turns a knob of 40 mm diameter at the same speed; speeds
    above the largest speed are left out. It rests with a tremor of 10 Hz where the force is largest
    and where its slope is steepest.
    """
def display_motion(device: palpate._core.device.DeviceProfile, command: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], start: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns the positions (n,) of the handle of an admittance display, each at the end of the period
    after a position command (n,). The handle starts at rest at start.
    """
def force_driven(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, force: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex, start_position: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> dict:
    """
    Returns the motion of the virtual object, without device and coupling, when a recorded force
    (n,) drives the object (paper figures 12 and 14). Arrays (n,) by name: force,
    environment_position, evaluations, status.
    """
def force_error(model: palpate._core.model.ForceModel, play_radius: typing.SupportsFloat | typing.SupportsIndex, *, start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], middle: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], end: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], applied: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], mean_applied: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex) -> dict:
    """
    Returns errors of the force of a simulated rendering, compared with a model, by name. RMS
    errors [N or N*m]: `end`, at the end of each tick; `instant`, at the time of the sample;
    `mean`, mean error over a tick; `band`, mean error below 50 Hz. `work` is the work of the error
    [J]. The arrays (n,) are those of simulate(); play_radius 0 means the play radius of the model.
    """
def motion_driven(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex) -> dict:
    """
    Returns the force that a scheme renders while the device follows a recorded motion (n,).
    Arrays (n,) by name: force, environment_position, evaluations, status.
    """
def resting_oscillation(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> RestingOscillation:
    """
    Returns the largest limit cycle of a handle on which a finger of 10 g rests, at the largest force
    and at the steepest slope of a model, with no guard but the force limit.
    """
def rig_for(model: palpate._core.model.ForceModel, is_angle: bool, period_s: typing.SupportsFloat | typing.SupportsIndex = 0.001) -> TestRig:
    """
    Returns the test rig for a model of position, or of position and velocity. With is_angle
    (positions in rad) the device is the default knob. For any other unit, its lengths and forces
    are scaled to the travel and the largest force of the model. The hand moves the handle through
    the domain of the model.
    """
def simulate(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile, hand: Hand, duration_s: typing.SupportsFloat | typing.SupportsIndex, substeps: typing.SupportsInt | typing.SupportsIndex = 20, start_position: typing.SupportsFloat | typing.SupportsIndex = 0.0, energy_account: bool = False, progress: collections.abc.Callable | None = None) -> dict:
    """
    Renders a model on a simulated device with a simulated hand, in simulated time.
    
    The handle starts at rest at start_position. With energy_account the energy account limits the
    force, as in a rendering that it holds. Calls progress(ticks) about ten times a second.
    Ctrl-C raises KeyboardInterrupt. Raises ValueError for more than 3 600 000 ticks.
    
    Returns arrays (n,) by name:
    
    - time_s, position (measured), velocity, environment_position.
    - handle_start, handle_middle, handle_end: true positions of the handle when it is sampled, and in
      the middle and at the end of the tick that holds the force.
    - force (commanded), applied (at the end of the tick), mean_applied (over the tick).
    - evaluations, status, extrapolated.
    """
smallest_domain_share: float = 0.1
tolerated_change: float = 0.01
