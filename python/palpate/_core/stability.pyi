# SPDX-License-Identifier: Apache-2.0
"""
Certificates and their inequalities.
"""
from __future__ import annotations
import collections.abc
import palpate._core.device
import palpate._core.model
import palpate._core.rendering
import typing
__all__: list[str] = ['Certificate', 'ForceBounds', 'Inequality', 'certify', 'certify_bounds', 'device_difference', 'explicit_scheme', 'force_bounds', 'narrowest_play', 'passive_shift', 'renderable_slopes', 'slope_behind_coupling', 'steepest_stick', 'stiffest_coupling', 'usual_coupling_share']
class ForceBounds:
    """
    Proved bounds of a force over all positions, continuations included.
    
    With hysteresis, f = g + s h with a play of radius r, the slope of a path is g' + s h'. While it
    sticks, h / r is added.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, slope_min: typing.SupportsFloat | typing.SupportsIndex, slope_max: typing.SupportsFloat | typing.SupportsIndex, steepest: typing.SupportsFloat | typing.SupportsIndex, sliding: typing.SupportsFloat | typing.SupportsIndex, loss_min: typing.SupportsFloat | typing.SupportsIndex = 0.0, loss_max: typing.SupportsFloat | typing.SupportsIndex = 0.0, loss_per_play: typing.SupportsFloat | typing.SupportsIndex = 0.0, mean_force: typing.SupportsFloat | typing.SupportsIndex = 0.0, drag: typing.SupportsFloat | typing.SupportsIndex = 0.0, hysteresis: bool = False) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name, without optional ones that are not set.
        """
    @property
    def drag(self) -> float:
        """
        B_v = max |f(x, v) - f(x, 0)| / |v|; 0 for a force of position alone.
        """
    @property
    def hysteresis(self) -> bool:
        """
        True if the model has hysteresis.
        """
    @property
    def loss_max(self) -> float:
        """
        Largest hysteresis h [N]; 0 for a force without hysteresis.
        """
    @property
    def loss_min(self) -> float:
        """
        Smallest hysteresis h [N]; 0 for a force without hysteresis.
        """
    @property
    def loss_per_play(self) -> float:
        """
        Largest slope h/r that the play operator adds, max h/r [N/m].
        """
    @property
    def mean_force(self) -> float:
        """
        Mean of a limited periodic force above its hysteresis [N]; 0: passive.
        """
    @property
    def sliding(self) -> float:
        """
        max |f'|, or max(|g'| + |h'|), over all velocities.
        """
    @property
    def slope_max(self) -> float:
        """
        Largest slope of the force [N/m]: max f', or max(g' + |h'| + h/r).
        """
    @property
    def slope_min(self) -> float:
        """
        Smallest slope of the force [N/m]: min f', or min(g' - |h'|).
        """
    @property
    def steepest(self) -> float:
        """
        Steepest slope [N/m]: L = max |f'|, or max(|g'| + |h'| + h/r).
        """
class Inequality:
    """
    One line of a certificate: left >= right, or left > right if it is strict.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, id: str, left: typing.SupportsFloat | typing.SupportsIndex, right: typing.SupportsFloat | typing.SupportsIndex, name: str = '', formula: str = '', basis: str = 'proved', source: str = '', strict: bool = False) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name, without optional ones that are not set.
        """
    @property
    def basis(self) -> str:
        """
        proved, linear (the linearised system only) or none (no bound is known).
        """
    @property
    def formula(self) -> str:
        """
        Formula in the symbols of docs/certificate.md.
        """
    @property
    def holds(self) -> bool:
        ...
    @property
    def id(self) -> str:
        """
        Name that never changes. A check of a certificate compares it, not the texts.
        """
    @property
    def left(self) -> float:
        """
        Left side of the inequality: the available value.
        """
    @property
    def margin(self) -> float:
        """
        left - right
        """
    @property
    def name(self) -> str:
        """
        Subject of the inequality in words.
        """
    @property
    def right(self) -> float:
        """
        Right side of the inequality: the required value.
        """
    @property
    def source(self) -> str:
        """
        Source of the proof.
        """
    @property
    def strict(self) -> bool:
        """
        True if the left side must be larger than the right side.
        """
class Certificate:
    """
    Proved properties of a model that a scheme renders on a device.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, model: str, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile, bounds: ForceBounds, inequalities: collections.abc.Sequence[Inequality], verdict: str, longest_period_s: typing.SupportsFloat | typing.SupportsIndex, fingerprint: str, reason: str = '') -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def check(self, model: palpate._core.model.ForceModel) -> Certificate:
        """
        Computes the certificate again and returns the result. ValueError names the first field that differs.
        """
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name, without optional ones that are not set.
        """
    @property
    def bounds(self) -> ForceBounds:
        """
        Bounds of the rendered force, compensation included.
        """
    @property
    def certified(self) -> bool:
        ...
    @property
    def device(self) -> palpate._core.device.DeviceProfile:
        """
        Device for which the certificate holds.
        """
    @property
    def fingerprint(self) -> str:
        """
        16 hexadecimal digits computed from all other stored fields.
        """
    @property
    def inequalities(self) -> list[Inequality]:
        """
        All inequalities with both sides.
        """
    @property
    def longest_period_s(self) -> float:
        """
        Longest time between two samples for which every inequality holds [s]; 0 if one does not hold.
        """
    @property
    def model(self) -> str:
        """
        Fingerprint of the model; empty if only bounds were certified.
        """
    @property
    def reason(self) -> str:
        """
        Reason for the verdict, one sentence.
        """
    @property
    def refused(self) -> bool:
        ...
    @property
    def scheme(self) -> palpate._core.rendering.Scheme:
        """
        Structure that renders the model, with its numbers.
        """
    @property
    def verdict(self) -> str:
        """
        certified, stable-locally or refused.
        """
def certify(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> Certificate:
    """
    Certifies a model that a scheme renders on a device. A refusal is a result with a reason; an
    impossible scheme or device raises ValueError.
    """
def certify_bounds(bounds: ForceBounds, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> Certificate:
    """
    Certifies any force within bounds.
    """
def device_difference(certified: palpate._core.device.DeviceProfile, device: palpate._core.device.DeviceProfile) -> str:
    """
    Returns a sentence about the first field in which a device differs from the certified one; empty
    without a difference.
    """
def explicit_scheme(bounds: ForceBounds, device: palpate._core.device.DeviceProfile, **kwargs) -> palpate._core.rendering.Scheme:
    """
    Returns the explicit structure with the stiffest coupling, then the least object damping, for which
    it is stable; otherwise the last one tried. Keywords: mass, object_damping, coupling_stiffness,
    coupling_damping and play_radius; None: chosen by the search.
    """
def force_bounds(model: palpate._core.model.ForceModel, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_limit: typing.SupportsFloat | typing.SupportsIndex = ...) -> ForceBounds:
    """
    Returns proved bounds of a model of one position, or of position and velocity, on a device with a
    force limit. A play_radius above 0 replaces the model's own.
    """
def narrowest_play(sliding: ForceBounds, device: palpate._core.device.DeviceProfile, least: typing.SupportsFloat | typing.SupportsIndex, most: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Returns the narrowest play radius from `least` to `most` for which hysteresis is certified;
    infinite without one. `sliding` are bounds of the model with a play so wide that sticking adds
    no slope.
    """
def passive_shift(model: palpate._core.model.ForceModel, force_limit: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Returns the shift of a periodic force for which the mean of the limited force is not active; 0
    for other models. Add it to the bias of the network.
    """
def renderable_slopes(device: palpate._core.device.DeviceProfile, stick: typing.SupportsFloat | typing.SupportsIndex = 0.0, *, rising: typing.SupportsFloat | typing.SupportsIndex = ..., falling: typing.SupportsFloat | typing.SupportsIndex = ...) -> tuple[float, float]:
    """
    Returns the (lowest, highest) slope for which direct rendering is certified; infinite without a
    limit.
    
    First finds the largest k for which slopes of -k and k are certified together, limited to `falling`
    and `rising`. Then finds the largest falling slope, and after that the largest rising one. With
    hysteresis these are slopes while sliding; sticking adds h / r = `stick`.
    """
def slope_behind_coupling(slope: typing.SupportsFloat | typing.SupportsIndex, coupling_stiffness: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Returns K_c k / (K_c + k), the slope of an object of slope k > -K_c behind a coupling.
    """
def steepest_stick(device: palpate._core.device.DeviceProfile) -> float:
    """
    Returns the slope h / r that leaves half of the device's largest slope for sliding.
    """
def stiffest_coupling(*, coupling_damping: typing.SupportsFloat | typing.SupportsIndex, falling: typing.SupportsFloat | typing.SupportsIndex, device: palpate._core.device.DeviceProfile, share: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> float:
    """
    Returns the largest coupling stiffness K_c for which a share of the device's damping is sufficient; 0
    if no stiffness is certified. `coupling_damping` is B_c; `falling` is the steepest falling slope of
    the object's force.
    """
usual_coupling_share: float = 0.95
