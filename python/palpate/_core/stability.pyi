# SPDX-License-Identifier: Apache-2.0
"""
Certificates and the inequalities they consist of.
"""
from __future__ import annotations
import collections.abc
import palpate._core.device
import palpate._core.model
import palpate._core.rendering
import typing
__all__: list[str] = ['Certificate', 'ForceBounds', 'Inequality', 'passive_shift', 'certify', 'certify_bounds', 'device_difference', 'explicit_scheme', 'slope_behind_coupling', 'force_bounds', 'narrowest_play', 'renderable_slopes', 'steepest_stick', 'stiffest_coupling', 'usual_coupling_share']
class ForceBounds:
    """
    Proved bounds of a force over every position that can be reached, continuations included.
    
    With hysteresis, f = g + s h with a play of radius r, a path's slope is g' + s h', and h / r more while it sticks.
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
        The fields that are written to a file, by name; without optional ones that are not given.
        """
    @property
    def drag(self) -> float:
        """
        B_v = max |f(x, v) - f(x, 0)| / |v|; 0 of a force of position alone.
        """
    @property
    def hysteresis(self) -> bool:
        """
        True if the model has hysteresis.
        """
    @property
    def loss_max(self) -> float:
        """
        Largest h; 0 without hysteresis.
        """
    @property
    def loss_min(self) -> float:
        """
        Smallest h; 0 without hysteresis.
        """
    @property
    def loss_per_play(self) -> float:
        """
        max h/r
        """
    @property
    def mean_force(self) -> float:
        """
        Mean of a limited force that repeats over its period, beyond its loss.
        """
    @property
    def sliding(self) -> float:
        """
        max |f'|, or max(|g'| + |h'|); of all velocities.
        """
    @property
    def slope_max(self) -> float:
        """
        Of every path: max f', or max(g' + |h'| + h/r).
        """
    @property
    def slope_min(self) -> float:
        """
        Of every path: min f', or min(g' - |h'|).
        """
    @property
    def steepest(self) -> float:
        """
        L = max |f'|, or max(|g'| + |h'| + h/r).
        """
class Inequality:
    """
    One line of a certificate: left >= right, or left > right where it is strict.
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
        The fields that are written to a file, by name; without optional ones that are not given.
        """
    @property
    def formula(self) -> str:
        """
        In the symbols of docs/certificate.md.
        """
    @property
    def holds(self) -> bool:
        ...
    @property
    def id(self) -> str:
        """
        Stable name, compared when a certificate is checked; texts are not.
        """
    @property
    def left(self) -> float:
        """
        What there is.
        """
    @property
    def margin(self) -> float:
        """
        left - right
        """
    @property
    def name(self) -> str:
        """
        Subject in words.
        """
    @property
    def basis(self) -> str:
        """
        proved, linear (the linearised system only) or none (no bound is known beyond).
        """
    @property
    def right(self) -> float:
        """
        What is needed.
        """
    @property
    def source(self) -> str:
        """
        Where the proof stands.
        """
    @property
    def strict(self) -> bool:
        """
        True if both sides must differ.
        """
class Certificate:
    """
    What is proved of a model, rendered by a scheme, on a device.
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
        The fields that are written to a file, by name; without optional ones that are not given.
        """
    @property
    def bounds(self) -> ForceBounds:
        """
        Of the force that is rendered, compensation included.
        """
    @property
    def certified(self) -> bool:
        ...
    @property
    def device(self) -> palpate._core.device.DeviceProfile:
        """
        The device it holds for.
        """
    @property
    def fingerprint(self) -> str:
        """
        16 hexadecimal digits over every stored number and name before it.
        """
    @property
    def inequalities(self) -> list[Inequality]:
        """
        Every line with both its sides.
        """
    @property
    def longest_period_s(self) -> float:
        """
        Time between two samples up to which every inequality holds [s]; 0 where one does not.
        """
    @property
    def model(self) -> str:
        """
        Fingerprint of the model; empty where only bounds were certified.
        """
    @property
    def refused(self) -> bool:
        ...
    @property
    def scheme(self) -> palpate._core.rendering.Scheme:
        """
        How the model is rendered.
        """
    @property
    def verdict(self) -> str:
        """
        certified, stable-locally or refused.
        """
    @property
    def reason(self) -> str:
        """
        One sentence.
        """
def passive_shift(model: palpate._core.model.ForceModel, force_limit: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Shift of a force that repeats with which the limited force does not push on average; 0 for other
    models. Add it to the bias of the network.
    """
def certify(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> Certificate:
    """
    What is proved of a model rendered by a scheme on a device. A refusal is an answer, with its reason;
    ValueError where scheme or device is impossible.
    """
def certify_bounds(bounds: ForceBounds, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> Certificate:
    """
    The same for any force within bounds.
    """
def device_difference(certified: palpate._core.device.DeviceProfile, device: palpate._core.device.DeviceProfile) -> str:
    """
    The first field in which a device is not the certified one, as a sentence; empty where it is.
    """
def explicit_scheme(bounds: ForceBounds, device: palpate._core.device.DeviceProfile, **kwargs) -> palpate._core.rendering.Scheme:
    """
    Explicit structure with the stiffest coupling, then the least object damping, for which it is stable; the
    last one tried if none is. mass, damping, coupling_stiffness, coupling_damping and play_radius by
    keyword, None: chosen.
    """
def slope_behind_coupling(slope: typing.SupportsFloat | typing.SupportsIndex, coupling_stiffness: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    K_c k / (K_c + k): the slope that is felt through a coupling where the object's is k > -K_c.
    """
def force_bounds(model: palpate._core.model.ForceModel, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_limit: typing.SupportsFloat | typing.SupportsIndex = ...) -> ForceBounds:
    """
    Returns proved bounds of a model of one position, or of position and velocity, on a device with a
    force limit. A play_radius above 0 replaces the model's own.
    """
def narrowest_play(sliding: ForceBounds, device: palpate._core.device.DeviceProfile, least: typing.SupportsFloat | typing.SupportsIndex, most: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Narrowest play radius between `least` and `most` for which hysteresis is certified; infinite if none
    is. `sliding` bounds the model with a play so wide that sticking adds no slope.
    """
def renderable_slopes(device: palpate._core.device.DeviceProfile, stick: typing.SupportsFloat | typing.SupportsIndex = 0.0, *, rising: typing.SupportsFloat | typing.SupportsIndex = ..., falling: typing.SupportsFloat | typing.SupportsIndex = ...) -> tuple[float, float]:
    """
    (lowest, highest) slope that direct rendering is certified for; infinite where nothing limits it.
    
    First as steep a slope on both sides as is certified, but none steeper than `rising` and `falling`;
    then as steep a fall, and after it a rise, as is still certified. With hysteresis these are slopes
    while sliding, and a stick adds h / r = `stick`.
    """
def steepest_stick(device: palpate._core.device.DeviceProfile) -> float:
    """
    Slope h / r that leaves half of what the device holds to sliding.
    """
def stiffest_coupling(*, coupling_damping: typing.SupportsFloat | typing.SupportsIndex, falling: typing.SupportsFloat | typing.SupportsIndex, device: palpate._core.device.DeviceProfile, share: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> float:
    """
    Largest coupling stiffness K_c for which a share of the device's damping is enough; 0 if there is none.
    `damping` is B_c; `falling` the steepest fall of the object's force.
    """
usual_coupling_share: float = 0.95
