# SPDX-License-Identifier: Apache-2.0
"""
Structures between a model and a device.
"""
from __future__ import annotations
import palpate._core.model
import typing
__all__: list[str] = ['Scheme', 'compensated_share', 'default_play_radius', 'explicit_slope_limit', 'fewest_encoder_steps_in_play', 'most_prediction_taps', 'solver_name', 'structure_names']
class Scheme:
    """
    How a model is rendered: the structure and its numbers, SI units.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, structure: str = 'massless', coupling_stiffness: typing.SupportsFloat | typing.SupportsIndex = 100.0, coupling_damping: typing.SupportsFloat | typing.SupportsIndex = 0.02, mass: typing.SupportsFloat | typing.SupportsIndex = 0.001, object_damping: typing.SupportsFloat | typing.SupportsIndex = 0.5, compensated: bool = False, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, predict: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def steepest_slope(self, model: palpate._core.model.ForceModel) -> float:
        """
        Largest slope of the model that the structure meets, never below 0; h / r is part of it while a
        hysteresis model sticks.
        """
    def to_dict(self) -> dict:
        """
        The fields that are written to a file, by name; without optional ones that are not given.
        """
    def validate(self, model: palpate._core.model.ForceModel, period_s: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        """
        ValueError names the field, its value and what would be right for this model; with a period also
        what is sure to diverge at it.
        """
    @property
    def compensated(self) -> bool:
        """
        The coupling's spring is taken out of the model beforehand.
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
    def object_damping(self) -> float:
        """
        B_o, damping of the object [N*s/m or N*m*s/rad].
        """
    @property
    def has_coupling(self) -> bool:
        """
        True if the object stands behind a virtual coupling.
        """
    @property
    def has_mass(self) -> bool:
        """
        True if the object has mass and damping.
        """
    @property
    def mass(self) -> float:
        """
        m, mass of the object [kg or kg*m^2].
        """
    @property
    def play_radius(self) -> float:
        """
        r of a hysteresis model [m or rad]; 0 = the model's own.
        """
    @property
    def predict(self) -> int:
        """
        m: samples used to predict the position half a sample ahead, 0 to 16; 0 = none.
        """
    @property
    def structure(self) -> str:
        """
        How the model is connected to the device.
        """
def default_play_radius(model: palpate._core.model.ForceModel, encoder_step: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Play radius of a model that leaves it to the rendering, else 0.
    """
def explicit_slope_limit(scheme: Scheme, period_s: typing.SupportsFloat | typing.SupportsIndex, *, coupled: bool = True) -> float:
    """
    Slope of the model below which the explicit structure is stable at a held device, or (not coupled)
    driven by a force.
    """
def solver_name(model: palpate._core.model.ForceModel, scheme: Scheme, period_s: typing.SupportsFloat | typing.SupportsIndex) -> str | None:
    """
    How the load line is solved: 'table' where certified tables answer, at least in part, else 'newton';
    None where a structure has no load line.
    """
compensated_share: float = 0.9
fewest_encoder_steps_in_play: float = 4.0
most_prediction_taps: int = 16
structure_names: tuple = ('direct', 'massless', 'implicit', 'explicit', 'energy-consistent')
