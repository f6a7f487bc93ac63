# SPDX-License-Identifier: Apache-2.0
"""
Structures between a model and a device.
"""
from __future__ import annotations
import palpate._core.device
import palpate._core.model
import typing
__all__: list[str] = ['HeldSlope', 'Scheme', 'cells_in_motion', 'compensated_share', 'default_play_radius', 'display_lag_s', 'explicit_slope_limit', 'fewest_encoder_steps_in_play', 'most_prediction_taps', 'most_slope_cells', 'solver_name', 'structure_names', 'virtual_friction']
class HeldSlope:
    """
    Rule for the slope of a line that a tangent holds, in SI units.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    @typing.overload
    def __init__(self, *, rule: str = 'raised', slope: typing.SupportsFloat | typing.SupportsIndex = 0.0, lift: typing.SupportsFloat | typing.SupportsIndex = 0.0, motion: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
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
    def lift(self) -> float:
        """
        Difference of the line's slope from that of the force (raised) [N/m or N*m/rad].
        """
    @property
    def motion(self) -> float | None:
        """
        w, largest motion of the handle in one period [m or rad]; absent: any motion. A larger motion ends a certified run.
        """
    @property
    def rule(self) -> str:
        """
        Rule for the slope: steepest, raised or constant.
        """
    @property
    def slope(self) -> float:
        """
        Largest slope of the line (steepest), or its slope (constant) [N/m or N*m/rad].
        """
class Scheme:
    """
    Structure that renders a model, with the numbers of the structure in SI units.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, structure: str = 'massless', coupling_stiffness: typing.SupportsFloat | typing.SupportsIndex = 100.0, coupling_damping: typing.SupportsFloat | typing.SupportsIndex = 0.02, mass: typing.SupportsFloat | typing.SupportsIndex = 0.001, object_damping: typing.SupportsFloat | typing.SupportsIndex = 0.5, compensated: bool = False, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, predict: typing.SupportsInt | typing.SupportsIndex = 0, line: HeldSlope | None = None) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def steepest_slope(self, model: palpate._core.model.ForceModel) -> float:
        """
        Returns the largest slope of the rendered force, at least 0 [N/m or N*m/rad]. For a
        hysteresis model it includes h / r (hysteresis by play radius), the slope that is added
        after a reversal.
        """
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
        """
    def validate(self, model: palpate._core.model.ForceModel, period_s: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        """
        Checks that the scheme can render a model. Raises ValueError with the wrong field, its
        value and its bound. With period_s also raises ValueError if the scheme diverges at this
        period.
        """
    @property
    def compensated(self) -> bool:
        """
        True if the model is made stiffer, so that model and coupling in series give the recorded force.
        """
    @property
    def coupling_damping(self) -> float:
        """
        B_c, damping of the coupling [N*s/m or N*m*s/rad].
        """
    @property
    def coupling_stiffness(self) -> float:
        """
        K_c, stiffness of the coupling [N/m or N*m/rad].
        """
    @property
    def has_coupling(self) -> bool:
        """
        True if the structure has a virtual coupling between device and object.
        """
    @property
    def has_mass(self) -> bool:
        """
        True if the virtual object of the structure has mass and damping.
        """
    @property
    def line(self) -> HeldSlope | None:
        """
        Slope of the line that a tangent holds; absent: the slope of the force, at least 0.
        """
    @property
    def mass(self) -> float:
        """
        m, mass of the object [kg or kg*m^2].
        """
    @property
    def object_damping(self) -> float:
        """
        B_o, damping of the object [N*s/m or N*m*s/rad].
        """
    @property
    def play_radius(self) -> float:
        """
        Play radius r of a hysteresis model [m or rad]; 0 = the play radius of the model.
        """
    @property
    def predict(self) -> int:
        """
        m, number of past samples that predict the position half a period ahead, 0 to 16; 0 = no prediction.
        """
    @property
    def structure(self) -> str:
        """
        Connection of the model to the device.
        """
def default_play_radius(model: palpate._core.model.ForceModel, encoder_step: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Returns the default play radius for a hysteresis model that does not define one; otherwise 0.
    """
def display_lag_s(device: palpate._core.device.DeviceProfile) -> float:
    """
    Returns the time by which the handle of an admittance display follows the virtual object in slow
    motion [s]: delay and lag of the servo, less the feed-forward. A hand feels the slope of the
    object times this time as damping, in addition to the damping of the object.
    """
def explicit_slope_limit(scheme: Scheme, period_s: typing.SupportsFloat | typing.SupportsIndex, *, coupled: bool = True) -> float:
    """
    Returns the slope limit of a model: below it the explicit structure is stable while the device
    is held still, or, with coupled=False, while a force drives the object without coupling.
    """
def solver_name(model: palpate._core.model.ForceModel, scheme: Scheme, period_s: typing.SupportsFloat | typing.SupportsIndex) -> str | None:
    """
    Returns the method that solves the load line of a scheme: 'table' if a table of solutions is
    used for at least a part of the positions, otherwise 'newton'; None for a structure without a
    load line.
    """
def virtual_friction(device: palpate._core.device.DeviceProfile) -> float:
    """
    Returns the Coulomb friction of the virtual object that makes the steps of command and force
    sensor of an admittance display harmless [N or N*m].
    """
cells_in_motion: int = 16
compensated_share: float = 0.9
fewest_encoder_steps_in_play: float = 4.0
most_prediction_taps: int = 16
most_slope_cells: int = 65536
structure_names: tuple = ('direct', 'massless', 'implicit', 'explicit', 'energy-consistent', 'tangent')
