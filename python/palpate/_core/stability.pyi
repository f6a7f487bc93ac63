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
__all__: list[str] = ['Certificate', 'ForceBounds', 'Inequality', 'admittance_scheme', 'certify', 'certify_bounds', 'certify_with_account', 'device_difference', 'explicit_scheme', 'fast_motion_energy', 'force_bounds', 'inner_need', 'line_for', 'narrowest_play', 'passive_shift', 'renderable_slopes', 'slope_behind_coupling', 'steepest_stick', 'stiffest_coupling', 'stiffest_hand', 'stiffest_line_wall', 'usual_coupling_share', 'with_force_error']
class ForceBounds:
    """
    Proved bounds of a model's force and slope at all positions, inside and outside the domain.
    
    With hysteresis the force is f = g + s h: the mean force g of press and release, the hysteresis
    h and the direction state s. During a stroke the slope is g' + s h'; after a reversal h / r is
    added, with the play radius r.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, slope_min: typing.SupportsFloat | typing.SupportsIndex, slope_max: typing.SupportsFloat | typing.SupportsIndex, steepest: typing.SupportsFloat | typing.SupportsIndex, sliding: typing.SupportsFloat | typing.SupportsIndex, loss_min: typing.SupportsFloat | typing.SupportsIndex = 0.0, loss_max: typing.SupportsFloat | typing.SupportsIndex = 0.0, loss_per_play: typing.SupportsFloat | typing.SupportsIndex = 0.0, mean_force: typing.SupportsFloat | typing.SupportsIndex = 0.0, drag: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_error: typing.SupportsFloat | typing.SupportsIndex = 0.0, hysteresis: bool = False) -> None:
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
    def drag(self) -> float:
        """
        B_v = max |f(x, v) - f(x, 0)| / |v|; 0 for a force of position alone.
        """
    @property
    def force_error(self) -> float:
        """
        epsilon, largest difference of the rendered force from the force with these bounds [N]; 0 unless
        another program renders the model.
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
    One inequality of a certificate: left >= right, or left > right if `strict` is true.
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
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
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
    Inequalities and verdict for a model that a scheme renders on a device.
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
        Computes the certificate again from the model and returns it. Raises ValueError with the first field that differs.
        """
    def to_dict(self) -> dict:
        """
        Returns the fields that are written to a file, by name. Optional fields without a value are left out.
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
    def held_by_account(self) -> bool:
        ...
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
        certified, held-by-account, stable-locally or refused.
        """
def admittance_scheme(bounds: ForceBounds, structure: str, device: palpate._core.device.DeviceProfile, *, mass: typing.SupportsFloat | typing.SupportsIndex, object_damping: typing.SupportsFloat | typing.SupportsIndex, fixed_mass: typing.SupportsFloat | typing.SupportsIndex | None = None, fixed_damping: typing.SupportsFloat | typing.SupportsIndex | None = None, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> palpate._core.rendering.Scheme:
    """
    Returns the scheme with the least damping, and the least mass for it, with which a structure
    renders a force on an admittance display. Both are at least those of the model, `mass` and
    `object_damping`. A fixed value replaces the choice.
    """
def certify(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> Certificate:
    """
    Returns the certificate of a model that a scheme renders on a device. If stability is not
    proved, the certificate states the reason. Raises ValueError for an invalid scheme or device.
    """
def certify_bounds(bounds: ForceBounds, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> Certificate:
    """
    Returns the certificate of every force within the bounds, rendered by a scheme on a device.
    """
def certify_with_account(model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> Certificate:
    """
    Returns the certificate of a rendering that the energy account limits: in no motion does a hand
    take out more energy than the object can store. It is refused if the account cannot hold the
    largest force at rest. Raises ValueError for an invalid scheme or device.
    """
def device_difference(certified: palpate._core.device.DeviceProfile, device: palpate._core.device.DeviceProfile) -> str:
    """
    Returns a sentence about the first field in which a device profile differs from the certified profile;
    empty without a difference.
    """
def explicit_scheme(bounds: ForceBounds, device: palpate._core.device.DeviceProfile, **kwargs) -> palpate._core.rendering.Scheme:
    """
    Searches the explicit structure with the stiffest coupling, then the least object damping, for
    which the structure is stable, and returns its scheme. If none is stable, returns the last
    scheme that was tried. Keywords: mass, object_damping, coupling_stiffness, coupling_damping and
    play_radius; None: a default, or the result of the search.
    """
def fast_motion_energy(device: palpate._core.device.DeviceProfile) -> float:
    """
    Returns the largest energy that a hand can take out after a motion faster than the certified one,
    until the zero force of the guard acts [J]: (T + t_d) (F_max - f_c)^2 / 4 b.
    """
def force_bounds(model: palpate._core.model.ForceModel, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_limit: typing.SupportsFloat | typing.SupportsIndex = ...) -> ForceBounds:
    """
    Returns proved bounds of the force of a model of position, or of position and velocity, limited to
    force_limit. A play_radius above 0 replaces the play radius of the model.
    """
def inner_need(held_line: palpate._core.device.HeldLine, stiffness: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Returns the device damping that the loop of a controller needs for a line of this stiffness.
    """
def line_for(model: palpate._core.model.ForceModel, device: palpate._core.device.DeviceProfile, motion: typing.SupportsFloat | typing.SupportsIndex, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> palpate._core.rendering.HeldSlope:
    """
    Returns the line of the simplest rule that is certified for a model on a device, for motions up to
    `motion` in a period; if none is certified, the line that needs least.
    """
def narrowest_play(sliding: ForceBounds, device: palpate._core.device.DeviceProfile, least: typing.SupportsFloat | typing.SupportsIndex, most: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Returns the smallest play radius from `least` to `most` for which a hysteresis model is
    certified; infinity if there is none. `sliding` are bounds of the model's force with a play
    radius so large that a reversal adds no slope.
    """
def passive_shift(model: palpate._core.model.ForceModel, force_limit: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Returns the force to add to the bias of a periodic model, so that its force, limited to
    force_limit, gives no energy over a period [N or N*m]; 0 for other models.
    """
def renderable_slopes(device: palpate._core.device.DeviceProfile, stick: typing.SupportsFloat | typing.SupportsIndex = 0.0, *, rising: typing.SupportsFloat | typing.SupportsIndex = ..., falling: typing.SupportsFloat | typing.SupportsIndex = ...) -> tuple[float, float]:
    """
    Returns the (lowest, highest) slope of a model for which direct rendering on a device is
    certified; infinite if every slope is certified.
    
    First finds the largest k for which slopes from -k to k are certified, with at most `falling`
    and `rising`. Then finds the steepest falling slope, and after that the steepest rising slope.
    With hysteresis these are slopes during a stroke; after a reversal h / r = `stick` is added
    (hysteresis by play radius).
    """
def slope_behind_coupling(slope: typing.SupportsFloat | typing.SupportsIndex, coupling_stiffness: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Returns K_c k / (K_c + k), the slope that the device feels for an object of slope k > -K_c behind a coupling
    of stiffness K_c.
    """
def steepest_stick(device: palpate._core.device.DeviceProfile) -> float:
    """
    Returns the largest slope h / r (hysteresis by play radius) that is certified for a model
    whose strokes have slopes as large as h / r.
    """
def stiffest_coupling(*, coupling_damping: typing.SupportsFloat | typing.SupportsIndex, falling: typing.SupportsFloat | typing.SupportsIndex, device: palpate._core.device.DeviceProfile, share: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> float:
    """
    Returns the largest coupling stiffness K_c that is certified with only the given share of the
    device's damping; 0 if no stiffness is certified. `coupling_damping` is B_c; `falling` is the
    steepest falling slope of the object's force.
    """
def stiffest_hand(bounds: ForceBounds, scheme: palpate._core.rendering.Scheme, device: palpate._core.device.DeviceProfile) -> float:
    """
    Returns the largest stiffness of a hand for which a scheme is proved on an admittance display,
    with the other limits of the hand unchanged [N/m or N*m/rad]; 0 if none is.
    """
def stiffest_line_wall(device: palpate._core.device.DeviceProfile, width: typing.SupportsFloat | typing.SupportsIndex, motion: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
    """
    Returns the largest stiffness of a wall whose slope rises over `width`, f'(x) = K / (1 + exp(-x /
    width)), that a held line renders, certified for motions up to `motion` in a period. None: certified
    for every motion.
    """
def with_force_error(certificate: Certificate, force_error: typing.SupportsFloat | typing.SupportsIndex) -> Certificate:
    """
    Returns the certificate of the same rendering by another program, such as an exported model, whose
    force differs by at most `force_error`.
    """
usual_coupling_share: float = 0.95
