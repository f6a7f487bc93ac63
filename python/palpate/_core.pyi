# SPDX-License-Identifier: Apache-2.0
"""
The C++ core of palpate: evaluation, filters, solvers, structures and simulation.
"""
from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import typing
__all__: list[str] = ['Bench', 'Certificate', 'DeviceProfile', 'EnvironmentFilters', 'ForceBounds', 'ForceModel', 'Hand', 'Inequality', 'LoopSettings', 'Scheme', 'Status', 'TransferFunction', 'balancing_shift', 'bench_for', 'certify', 'certify_bounds', 'device_difference', 'environment_filters', 'explicit_slope_limit', 'failure_map', 'failure_map_names', 'felt_slope', 'fingerprint', 'force_bounds', 'force_driven', 'force_error', 'guard_effects', 'longest_delay_s', 'measure', 'mexican_hat', 'mexican_hat_curvature', 'mexican_hat_integral', 'mexican_hat_jerk', 'mexican_hat_slope', 'most_prediction_taps', 'most_simulated_ticks', 'motion_driven', 'narrowest_play', 'paper_sample_time_s', 'play', 'render', 'renderable_slopes', 'simulate', 'slope_bounds', 'solver_name', 'status_meanings', 'steepest_stick', 'stiffest_coupling', 'structure_names', 'usual_telemetry_hz', 'value_bounds', 'wavelet_columns', 'wavelet_curvature_bound', 'wavelet_curvature_columns', 'wavelet_jacobian', 'wavelet_jerk_bound', 'wavelet_slope_bound', 'wavelet_slope_columns', 'wavelet_steps']
class Status:
    """
    Why a step ended as it did; the same words in C++ and in records.
    
    Members:
    
      Ok : the step is exact to its tolerance
    
      MaxIterations : the solver used all its evaluations; the position is its best one
    
      NotUnique : the load line meets the environment where it falls faster than the line rises
    
      NonFinite : an input or the environment was not a finite number; the force sent is zero
    
      Timeout : the device did not answer in time
    
      Lost : a sample of the device was lost or came twice
    
      Fault : the device reported a fault or is gone; the force sent is zero
    
      Limited : the force was clipped to the limit of the host or of the device
    
      Jump : the position moved farther in one sample than the device can; the force sent is zero
    
      Frozen : the position stood still at once out of full motion; the force sent is zero
    
      Ramp : the force is still on its way up from zero after the start
    
      Drained : the rendering had given all the energy it may; a force that gives more was scaled down
    
      Softened : the handle buzzed; all forces are scaled down from then on
    """
    Drained: typing.ClassVar[Status]
    Fault: typing.ClassVar[Status]
    Frozen: typing.ClassVar[Status]
    Jump: typing.ClassVar[Status]
    Limited: typing.ClassVar[Status]
    Lost: typing.ClassVar[Status]
    MaxIterations: typing.ClassVar[Status]
    NonFinite: typing.ClassVar[Status]
    NotUnique: typing.ClassVar[Status]
    Ok: typing.ClassVar[Status]
    Ramp: typing.ClassVar[Status]
    Softened: typing.ClassVar[Status]
    Timeout: typing.ClassVar[Status]
    __members__: typing.ClassVar[dict[str, Status]]
    @typing.overload
    def __eq__(self, other: Status) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: Status) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
class ForceModel:
    """
    A force identified over d inputs, with its domain and continuations.
    
    f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b (paper eq. 4); with hysteresis
    f(x, s) = g(x) + s h(x), h with weights of its own on the same wavelets.
    """
    def __init__(self, *, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], bias: typing.SupportsFloat | typing.SupportsIndex, weight_hysteresis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, linear_hysteresis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, bias_hysteresis: typing.SupportsFloat | typing.SupportsIndex | None = None, lower: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], upper: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], below: str = 'linear', above: str = 'linear', period: typing.SupportsFloat | typing.SupportsIndex | None = None, play_radius: typing.SupportsFloat | typing.SupportsIndex | None = None, of_velocity: bool = False) -> None:
        """
        alpha, beta (N, d); weight (N,); linear, lower, upper (d,). of_velocity: the second of two inputs is the velocity. ValueError names the field that is wrong.
        """
    @typing.overload
    def energy(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Stored energy [J] up to a constant; arguments as for force.
        """
    @typing.overload
    def energy(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same for an array of positions, of any shape.
        """
    def extrapolated(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
        """
        Whether a position lies outside the identified domain.
        """
    @typing.overload
    def force(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Force of the object against the tool [N or N*m]; a number in, a number out, an array in, an array out.
        
        A hysteresis model needs direction (+1 pressing, -1 releasing) or, where it has a play radius, play, the
        state of the play operator. Inputs that the model does not use are ignored; ValueError names one it misses.
        A position that is not finite gives NaN, in a number as in an array.
        """
    @typing.overload
    def force(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same for an array of positions, of any shape.
        """
    def loss_range(self) -> tuple[float, float]:
        """
        Proved (smallest, largest) h inside the domain; within 1 % of the largest.
        """
    def play(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], start: typing.SupportsFloat | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        State of the play operator along a motion (n,), started at rest unless told otherwise.
        """
    def predict(self, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Force at X (n, d), (n,); a hysteresis model takes the direction as one more column. A row with a
        value that is not finite gives NaN.
        """
    def require_slopes_within(self, least: typing.SupportsFloat | typing.SupportsIndex, largest: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        ValueError if stored slope bounds are narrower than the slopes of this model.
        """
    @typing.overload
    def slope(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Local stiffness df/dx; arguments as for force.
        """
    @typing.overload
    def slope(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same for an array of positions, of any shape.
        """
    def slope_range(self, play_radius: typing.SupportsFloat | typing.SupportsIndex | None = None) -> tuple[float, float]:
        """
        Proved (smallest, largest) slope inside the domain, sliding either way, within 1 % of the steepest.
        With a play radius also while a hysteresis model sticks, where h / r adds to it.
        """
    @property
    def above(self) -> str:
        ...
    @property
    def alpha(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def below(self) -> str:
        ...
    @property
    def beta(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def bias(self) -> float:
        ...
    @property
    def bias_hysteresis(self) -> float | None:
        ...
    @property
    def dimension(self) -> int:
        ...
    @property
    def hysteretic(self) -> bool:
        ...
    @property
    def linear(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def linear_hysteresis(self) -> numpy.typing.NDArray[numpy.float64] | None:
        ...
    @property
    def lower(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def n_wavelets(self) -> int:
        ...
    @property
    def of_velocity(self) -> bool:
        """
        Whether the second of two inputs is the velocity.
        """
    @property
    def period(self) -> float | None:
        ...
    @property
    def play_radius(self) -> float | None:
        ...
    @property
    def upper(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def weight(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def weight_hysteresis(self) -> numpy.typing.NDArray[numpy.float64] | None:
        ...
class TransferFunction:
    """
    H(z) = (b0 z^2 + b1 z + b2) / (z^2 + a1 z + a2) with its state.
    """
    def __init__(self, numerator: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], denominator: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> None:
        ...
    def at(self, z: complex | typing.SupportsComplex | typing.SupportsFloat | typing.SupportsIndex) -> complex:
        """
        H(z), for instance at z = exp(1j * omega * T).
        """
    def filter(self, input: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        The response to a signal (n,) from this state; the state itself is left as it is.
        """
    def poles(self) -> typing.Annotated[list[complex], "FixedSize(2)"]:
        ...
    def reset(self) -> None:
        """
        Back to rest.
        """
    def step(self, input: typing.SupportsFloat | typing.SupportsIndex) -> float:
        """
        The next output sample.
        """
    @property
    def denominator(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        ...
    @property
    def numerator(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        ...
class EnvironmentFilters:
    """
    Integrators I1, I2 and differentiators G1, G2 of the paper's figures 10 to 14.
    """
    @property
    def g1(self) -> TransferFunction:
        ...
    @property
    def g2(self) -> TransferFunction:
        ...
    @property
    def i1(self) -> TransferFunction:
        ...
    @property
    def i2(self) -> TransferFunction:
        ...
class DeviceProfile:
    """
    What is known of a haptic device of one degree of freedom; SI units, rotary or linear.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, id: str = 'simulated-knob', period_s: typing.SupportsFloat | typing.SupportsIndex = 0.001, inertia: typing.SupportsFloat | typing.SupportsIndex = 0.0002, viscous_damping: typing.SupportsFloat | typing.SupportsIndex = 0.06, coulomb_friction: typing.SupportsFloat | typing.SupportsIndex = 0.0, encoder_step: typing.SupportsFloat | typing.SupportsIndex = 9.587379924285257e-05, force_step: typing.SupportsFloat | typing.SupportsIndex = 0.0, delay_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_limit: typing.SupportsFloat | typing.SupportsIndex = 5.0, jitter_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, position_unit: str = 'rad') -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def coulomb_friction(self) -> float:
        """
        [N or N*m]
        """
    @property
    def delay_fraction(self) -> float:
        """
        tau: rest of the delay [samples].
        """
    @property
    def delay_s(self) -> float:
        """
        Time from a sample to the force that is computed from it [s].
        """
    @property
    def encoder_step(self) -> float:
        """
        [m or rad]; 0 = not quantised
        """
    @property
    def force_limit(self) -> float:
        """
        [N or N*m]
        """
    @property
    def force_step(self) -> float:
        """
        [N or N*m]; 0 = not quantised
        """
    @property
    def id(self) -> str:
        ...
    @property
    def inertia(self) -> float:
        """
        [kg or kg*m^2]
        """
    @property
    def jitter_s(self) -> float:
        """
        How much longer than period_s the time between two samples can get [s].
        """
    @property
    def late_samples(self) -> int:
        """
        Smallest number of whole samples that is not shorter than the delay.
        """
    @property
    def longest_period_s(self) -> float:
        """
        period_s + jitter_s: what a certificate has to hold for [s].
        """
    @property
    def period_s(self) -> float:
        """
        T, time between two samples [s].
        """
    @property
    def position_unit(self) -> str:
        """
        rad, and forces are in N*m; or m, and they are in N.
        """
    @property
    def viscous_damping(self) -> float:
        """
        [N*s/m or N*m*s/rad]
        """
    @property
    def whole_delay_samples(self) -> int:
        """
        n: number of whole samples in the delay.
        """
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
    @property
    def damping(self) -> float:
        """
        [N*s/m or N*m*s/rad]
        """
    @property
    def frequency_hz(self) -> float:
        """
        [Hz]
        """
    @property
    def lower(self) -> float:
        """
        [m or rad]
        """
    @property
    def stiffness(self) -> float:
        """
        [N/m or N*m/rad]
        """
    @property
    def upper(self) -> float:
        """
        [m or rad]
        """
class Scheme:
    """
    How a model is rendered: the structure and its numbers, SI units.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, structure: str = 'massless', coupling_stiffness: typing.SupportsFloat | typing.SupportsIndex = 100.0, coupling_damping: typing.SupportsFloat | typing.SupportsIndex = 0.02, mass: typing.SupportsFloat | typing.SupportsIndex = 0.001, damping: typing.SupportsFloat | typing.SupportsIndex = 0.5, compensated: bool = False, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, predict: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def steepest_slope(self, model: ForceModel) -> float:
        """
        Largest slope of the model that the structure meets, never below 0; h / r is part of it while a
        hysteresis model sticks.
        """
    def validate(self, model: ForceModel, period_s: typing.SupportsFloat | typing.SupportsIndex | None = None) -> None:
        """
        ValueError names the field, its value and what would be right for this model; with a period also
        what is sure to diverge at it.
        """
    @property
    def compensated(self) -> bool:
        ...
    @property
    def coupling_damping(self) -> float:
        ...
    @property
    def coupling_stiffness(self) -> float:
        ...
    @property
    def damping(self) -> float:
        ...
    @property
    def mass(self) -> float:
        ...
    @property
    def play_radius(self) -> float:
        ...
    @property
    def predict(self) -> int:
        """
        m: samples used to predict the position half a sample ahead; 0 = none.
        """
    @property
    def structure(self) -> str:
        ...
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
    @property
    def drag(self) -> float:
        """
        B_v = max |f(x, v) - f(x, 0)| / |v|.
        """
    @property
    def hysteresis(self) -> bool:
        ...
    @property
    def loss_max(self) -> float:
        """
        Largest h.
        """
    @property
    def loss_min(self) -> float:
        """
        Smallest h.
        """
    @property
    def loss_per_play(self) -> float:
        """
        max h / r
        """
    @property
    def mean_force(self) -> float:
        """
        How much a limited force that repeats pushes on average, beyond its loss.
        """
    @property
    def sliding(self) -> float:
        """
        max |f'|, or max(|g'| + |h'|).
        """
    @property
    def slope_max(self) -> float:
        """
        Of every path.
        """
    @property
    def slope_min(self) -> float:
        """
        Of every path.
        """
    @property
    def steepest(self) -> float:
        """
        L = max |f'|, or max(|g'| + |h'| + h / r).
        """
class Inequality:
    """
    One line of a certificate: left >= right, or left > right where it is strict.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, id: str, left: typing.SupportsFloat | typing.SupportsIndex, right: typing.SupportsFloat | typing.SupportsIndex, name: str = '', formula: str = '', rests_on: str = 'proved', source: str = '', strict: bool = False) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def formula(self) -> str:
        ...
    @property
    def holds(self) -> bool:
        ...
    @property
    def id(self) -> str:
        """
        Stable name; texts may change between releases.
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
        ...
    @property
    def rests_on(self) -> str:
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
        ...
    @property
    def strict(self) -> bool:
        ...
class Certificate:
    """
    What is proved of a model, rendered by a scheme, on a device.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, scheme: Scheme, device: DeviceProfile, model: str, bounds: ForceBounds, inequalities: collections.abc.Sequence[Inequality], verdict: str, longest_period_s: typing.SupportsFloat | typing.SupportsIndex, fingerprint: str, why: str = '') -> None:
        """
        A certificate as stored in a file. Use the result of `check`.
        """
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def check(self, model: ForceModel) -> Certificate:
        """
        Computes the certificate again and returns the result. ValueError names the first field that differs.
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
    def device(self) -> DeviceProfile:
        ...
    @property
    def fingerprint(self) -> str:
        """
        16 hexadecimal digits over every number and name of the certificate.
        """
    @property
    def inequalities(self) -> list[Inequality]:
        ...
    @property
    def longest_period_s(self) -> float:
        """
        Time between two samples up to which every inequality holds [s]; 0 where one does not.
        """
    @property
    def model(self) -> str:
        """
        Fingerprint of the model.
        """
    @property
    def refused(self) -> bool:
        ...
    @property
    def scheme(self) -> Scheme:
        ...
    @property
    def verdict(self) -> str:
        ...
    @property
    def why(self) -> str:
        """
        One sentence.
        """
class Bench:
    """
    A simulated device with a hand on it that suits a model, and the rendering's numbers in its scale.
    """
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, device: DeviceProfile, hand: Hand, length: typing.SupportsFloat | typing.SupportsIndex = 1.0, stiffness: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __repr__(self) -> str:
        ...
    def scheme(self, model: ForceModel, *, structure: str | None = None, compensated: bool | None = None, coupling_stiffness: typing.SupportsFloat | typing.SupportsIndex | None = None, coupling_damping: typing.SupportsFloat | typing.SupportsIndex | None = None, mass: typing.SupportsFloat | typing.SupportsIndex | None = None, damping: typing.SupportsFloat | typing.SupportsIndex | None = None, play_radius: typing.SupportsFloat | typing.SupportsIndex | None = None, predict: typing.SupportsInt | typing.SupportsIndex | None = None) -> Scheme:
        """
        What is given, in the model's own units; what is None follows the model in this bench's scale.
        """
    @property
    def device(self) -> DeviceProfile:
        ...
    @property
    def hand(self) -> Hand:
        ...
    @property
    def length(self) -> float:
        """
        Positions, over those of the default knob.
        """
    @property
    def stiffness(self) -> float:
        """
        Force per position, over that of the default knob.
        """
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
def balancing_shift(model: ForceModel, force_limit: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Shift of a force that repeats with which the limited force does not push on average; 0 for other
    models. Add it to the bias of the network.
    """
def bench_for(model: ForceModel, is_angle: bool, period_s: typing.SupportsFloat | typing.SupportsIndex = 0.001) -> Bench:
    """
    The bench on which a model of one position is tried. An angle is tried on the default knob;
    for any other unit it is the same knob as a scale model: lengths and forces are multiplied so
    that travel and largest force stand to the device as in the knob's own scene.
    """
def certify(model: ForceModel, scheme: Scheme, device: DeviceProfile) -> Certificate:
    """
    What is proved of a model rendered by a scheme on a device. A refusal is an answer, with its reason;
    ValueError where scheme or device is impossible.
    """
def certify_bounds(bounds: ForceBounds, scheme: Scheme, device: DeviceProfile) -> Certificate:
    """
    The same for any force within bounds.
    """
def device_difference(certified: DeviceProfile, device: DeviceProfile) -> str:
    """
    The first field in which a device is not the certified one, as a sentence; empty where it is.
    """
def environment_filters(pair: str, design: str = 'paper') -> EnvironmentFilters:
    """
    The paper's filters for T = 1 ms (its section 4.3): as published, or with unit gain at low frequency.
    """
def explicit_slope_limit(scheme: Scheme, period_s: typing.SupportsFloat | typing.SupportsIndex, *, coupled: bool = True) -> float:
    """
    Slope of the model below which the explicit structure is stable at a held device, or (not coupled)
    driven by a force: (4 m - 2 (B_o + B_c) T) / T^2 - K_c, with K_c = B_c = 0 when not coupled.
    """
def failure_map(name: str, points: typing.SupportsInt | typing.SupportsIndex = 8) -> dict:
    """
    Where a method fails: boundaries measured in simulation, and what theory says of them.
    
    By name: along and limit (what the axes hold, with units) and lines, each with its name and the
    arrays (points,) at, measured (NaN: none failed) and theory (NaN: nothing is known);
    searched (up to how many times the theory, where none failed) and linear (the limit spans no decades).
    """
def felt_slope(slope: typing.SupportsFloat | typing.SupportsIndex, coupling_stiffness: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    K_c k / (K_c + k): the slope that is felt through a coupling where the object's is k > -K_c.
    """
def fingerprint(model: ForceModel) -> str:
    """
    16 hexadecimal digits that change with every number of which the model's force is made.
    """
def force_bounds(model: ForceModel, play_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_limit: typing.SupportsFloat | typing.SupportsIndex = ...) -> ForceBounds:
    """
    Returns proved bounds of a model of one position, or of position and velocity, on a device with a
    force limit. A play_radius above 0 replaces the model's own.
    """
def force_driven(model: ForceModel, scheme: Scheme, force: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex, start_position: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> dict:
    """
    The motion that a recorded force (n,) gives the environment alone (paper figures 12 and 14).
    Arrays (n,) by name: force, environment_position, evaluations, status.
    """
def force_error(model: ForceModel, play_radius: typing.SupportsFloat | typing.SupportsIndex, *, start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], middle: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], end: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], applied: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], mean_applied: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex) -> dict:
    """
    RMS errors [N or N*m] of a simulated rendering against a model: at the end of the tick, at its
    sampling instant, of its mean over the tick, and of that below 50 Hz; and the work of the error [J].
    Arrays (n,) from simulate; play_radius 0 is the model's own.
    """
def guard_effects() -> list:
    """
    Every guard by itself: its cost where nothing is wrong, and what it makes of what is.
    
    By row: guard, cost (RMS change of the force over its RMS), wrong (what is wrong, and what of
    it is measured), without and with the guard.
    """
def longest_delay_s(period_s: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Longest delay of a profile [s]: 16 periods.
    """
def measure(device: str = 'simulated', *, object: ForceModel | None = None, transducer: bool = True, position_unit: str = 'rad', force_unit: str = 'N*m', probe: bool = False, lower: typing.SupportsFloat | typing.SupportsIndex | None = None, upper: typing.SupportsFloat | typing.SupportsIndex | None = None, speed: typing.SupportsFloat | typing.SupportsIndex | None = None, stiffness: typing.SupportsFloat | typing.SupportsIndex | None = None, force_limit: typing.SupportsFloat | typing.SupportsIndex | None = None, push: typing.SupportsFloat | typing.SupportsIndex | None = None, rate_hz: typing.SupportsFloat | typing.SupportsIndex = 1000.0, duration_s: typing.SupportsFloat | typing.SupportsIndex = 10.0, record: str = '', force: bool = False, keep: bool = False, priority: typing.SupportsInt | typing.SupportsIndex = 80, cpu: typing.SupportsInt | typing.SupportsIndex = -1, lowest_rate_share: typing.SupportsFloat | typing.SupportsIndex = 0.8, wait_s: typing.SupportsFloat | typing.SupportsIndex | None = None, progress: collections.abc.Callable | None = None, friction_share: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> dict:
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
def mexican_hat(u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    """
    The Mexican hat psi(u) = (u^2 - 1) exp(-u^2 / 2), element by element.
    """
def mexican_hat_curvature(u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    """
    psi''(u) = (u^4 - 6u^2 + 3) exp(-u^2 / 2).
    """
def mexican_hat_integral(u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    """
    An antiderivative of psi: -u exp(-u^2 / 2).
    """
def mexican_hat_jerk(u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    """
    psi'''(u) = (-u^5 + 10u^3 - 15u) exp(-u^2 / 2).
    """
def mexican_hat_slope(u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    """
    psi'(u) = (3u - u^3) exp(-u^2 / 2).
    """
def motion_driven(model: ForceModel, scheme: Scheme, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], period_s: typing.SupportsFloat | typing.SupportsIndex) -> dict:
    """
    The force that would have been rendered while a recorded motion (n,) moves the device.
    Arrays (n,) by name: force, environment_position, evaluations, status.
    """
def narrowest_play(sliding: ForceBounds, device: DeviceProfile, least: typing.SupportsFloat | typing.SupportsIndex, most: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Narrowest play radius between `least` and `most` for which hysteresis is certified; infinite if none
    is. `sliding` bounds the model with a play so wide that sticking adds no slope.
    """
def play(position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], radius: typing.SupportsFloat | typing.SupportsIndex, start: typing.SupportsFloat | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
    """
    State (n,) of the play operator of a radius along a motion (n,), started at rest unless told
    otherwise: play_k = min(x_k + r, max(x_k - r, play_{k-1})).
    """
def render(model: ForceModel, scheme: Scheme, *, position_unit: str = 'rad', force_unit: str = 'N*m', rate_hz: typing.SupportsFloat | typing.SupportsIndex = 1000.0, duration_s: typing.SupportsFloat | typing.SupportsIndex = 10.0, record: str = '', force: bool = False, model_name: str = '', telemetry_port: typing.SupportsInt | typing.SupportsIndex | None = None, telemetry_hz: typing.SupportsFloat | typing.SupportsIndex = 50.0, priority: typing.SupportsInt | typing.SupportsIndex = 80, cpu: typing.SupportsInt | typing.SupportsIndex = -1, lowest_rate_share: typing.SupportsFloat | typing.SupportsIndex = 0.8, progress: collections.abc.Callable | None = None) -> dict:
    """
    The model rendered in real time on a simulated device: the loop of palpate-control.
    
    Blocks for `duration_s` (inf: until Ctrl-C) without holding the interpreter. `record` names the
    recording, which grows as record.part; an existing one is refused, or replaced with `force`. A
    `telemetry_port` of this machine gets JSON lines over UDP.
    `progress(ticks, position, force, lost)` is called ten times a second.
    A rate below `lowest_rate_share` of `rate_hz` for half a second ends it, 0: never.
    Returns the summary by name; ValueError where it is refused before anything moves.
    """
def renderable_slopes(device: DeviceProfile, stick: typing.SupportsFloat | typing.SupportsIndex = 0.0, *, rising: typing.SupportsFloat | typing.SupportsIndex = ..., falling: typing.SupportsFloat | typing.SupportsIndex = ...) -> tuple[float, float]:
    """
    (lowest, highest) slope that direct rendering is certified for; infinite where nothing limits it.
    
    First as steep a slope on both sides as is certified, but none steeper than `rising` and `falling`;
    then as steep a fall, and after it a rise, as is still certified. With hysteresis these are slopes
    while sliding, and a stick adds h / r = `stick`.
    """
def simulate(model: ForceModel, scheme: Scheme, device: DeviceProfile, hand: Hand, duration_s: typing.SupportsFloat | typing.SupportsIndex, substeps: typing.SupportsInt | typing.SupportsIndex = 20, start_position: typing.SupportsFloat | typing.SupportsIndex = 0.0, progress: collections.abc.Callable | None = None) -> dict:
    """
    The model rendered on a simulated device held by a simulated hand, in virtual time.
    The handle starts at rest at start_position. Calls progress(ticks) about ten times a second. Ctrl-C
    ends it as in Python; ValueError for more than most_simulated_ticks.
    
    Arrays (n,) by name: time_s, position (measured), velocity, handle_start, handle_middle and
    handle_end (the true handle when sampled, and in the middle and at the end of the tick that holds the
    force), environment_position, force (commanded), applied (at the end of the tick), mean_applied (over
    the tick), evaluations, status, extrapolated.
    """
def slope_bounds(*, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.SupportsFloat | typing.SupportsIndex, bias: typing.SupportsFloat | typing.SupportsIndex, lower: typing.SupportsFloat | typing.SupportsIndex, upper: typing.SupportsFloat | typing.SupportsIndex, relative: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> tuple[float, float]:
    """
    Proved (smallest, largest) slope of a network of one input over [lower, upper], at most `relative`
    times max|f'| wider than the true range.
    """
def solver_name(model: ForceModel, scheme: Scheme, period_s: typing.SupportsFloat | typing.SupportsIndex) -> str | None:
    """
    How the load line is solved: 'table' where certified tables answer, at least in part, else 'newton';
    None where a structure has no load line.
    """
def steepest_stick(device: DeviceProfile) -> float:
    """
    Slope h / r that leaves half of what the device holds to sliding.
    """
def stiffest_coupling(*, damping: typing.SupportsFloat | typing.SupportsIndex, falling: typing.SupportsFloat | typing.SupportsIndex, device: DeviceProfile, share: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> float:
    """
    Largest coupling stiffness K_c for which a share of the device's damping is enough; 0 if there is none.
    `damping` is B_c; `falling` the steepest fall of the object's force.
    """
def value_bounds(*, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.SupportsFloat | typing.SupportsIndex, bias: typing.SupportsFloat | typing.SupportsIndex, lower: typing.SupportsFloat | typing.SupportsIndex, upper: typing.SupportsFloat | typing.SupportsIndex, relative: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> tuple[float, float]:
    """
    Proved (smallest, largest) value of a network of one input over [lower, upper], at most `relative`
    times max|f| wider than the true range.
    """
def wavelet_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    """
    psi(alpha_i o (x_k - beta_i)) of the radial Mexican hat: (n, N), column by column in memory.
    
    x is (n, d), alpha and beta are (N, d); (n,) and (N,) mean d = 1.
    """
def wavelet_curvature_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> list[numpy.typing.NDArray[numpy.float64]]:
    """
    Second derivatives of the wavelet columns along each input: a list of d arrays (n, N).
    """
def wavelet_jacobian(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.float64], list[numpy.typing.NDArray[numpy.float64]], list[numpy.typing.NDArray[numpy.float64]]]:
    """
    The wavelet columns and their derivatives by the dilations and the translations:
    (value, by_alpha, by_beta), value (n, N), the others lists of d arrays (n, N).
    """
def wavelet_slope_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    """
    d psi(alpha_i (x_k - beta_i)) / dx for one input: (n, N).
    """
def wavelet_steps(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    """
    Derivatives of the wavelet columns by steps without a unit, d log(alpha) and alpha d(beta):
    (n, 2 d N), ordered (quantity, input, wavelet), column by column in memory.
    """
__version__: str = '0.1.0'
failure_map_names: tuple = ('explicit', 'damping', 'prediction', 'period', 'encoder', 'play', 'coupling', 'falling', 'limit', 'coupled-encoder', 'hand', 'solver', 'pole', 'guard')
most_prediction_taps: int = 16
most_simulated_ticks: int = 3600000
paper_sample_time_s: float = 0.001
status_meanings: dict = {'Ok': 'the step is exact to its tolerance', 'MaxIterations': 'the solver used all its evaluations; the position is its best one', 'NotUnique': 'the load line meets the environment where it falls faster than the line rises', 'NonFinite': 'an input or the environment was not a finite number; the force sent is zero', 'Timeout': 'the device did not answer in time', 'Lost': 'a sample of the device was lost or came twice', 'Fault': 'the device reported a fault or is gone; the force sent is zero', 'Limited': 'the force was clipped to the limit of the host or of the device', 'Jump': 'the position moved farther in one sample than the device can; the force sent is zero', 'Frozen': 'the position stood still at once out of full motion; the force sent is zero', 'Ramp': 'the force is still on its way up from zero after the start', 'Drained': 'the rendering had given all the energy it may; a force that gives more was scaled down', 'Softened': 'the handle buzzed; all forces are scaled down from then on'}
structure_names: tuple = ('direct', 'massless', 'implicit', 'explicit', 'energy-consistent')
usual_telemetry_hz: float = 50.0
wavelet_curvature_bound: float = 3.0
wavelet_jerk_bound: float = 5.7831
wavelet_slope_bound: float = 1.3801190462
