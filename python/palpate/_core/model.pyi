# SPDX-License-Identifier: Apache-2.0
"""
Force laws and their proved bounds.
"""
from __future__ import annotations
import numpy
import numpy.typing
import typing
__all__: list[str] = ['ForceModel', 'Memory', 'derivative_bounds', 'fingerprint', 'most_wavelets', 'play', 'slope_bounds', 'stretches', 'wavelet_columns', 'wavelet_curvature_columns', 'wavelet_jacobian', 'wavelet_slope_columns', 'wavelet_steps']
class Memory:
    """
    Memory of an object that relaxes or slips: J springs of stiffness k_j in series with a dashpot and
    a slider (branches).
    
    f = g(x) + p(x) sum_j k_j e_j, de_j/dt = p(x) dx/dt - e_j / tau_j, |e_j| <= Y_j. The ratio p is a
    network of one input with the wavelets alpha, beta, weight, the slope `linear` and the constant
    `bias`.
    """
    def __init__(self, *, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.SupportsFloat | typing.SupportsIndex, bias: typing.SupportsFloat | typing.SupportsIndex, stiffness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], time_constant_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], yield_stretch: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> None:
        """
        Makes the memory; without `yield_stretch` no branch slips. The model that gets it checks the
        values.
        """
    @property
    def alpha(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def beta(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def bias(self) -> float:
        ...
    @property
    def linear(self) -> float:
        ...
    @property
    def stiffness(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Stiffness k_j of each branch [N/m or N*m/rad].
        """
    @property
    def time_constant_s(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Time constant tau_j of each branch, infinite if it does not relax [s].
        """
    @property
    def weight(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def yield_stretch(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Stretch Y_j at which each branch slips, infinite if it does not [m or rad].
        """
class ForceModel:
    """
    A force law of d inputs x, with its domain and the continuation of the force outside the
    domain.
    
    f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b (paper eq. 4). With hysteresis the force
    is f(x, s) = g(x) + s h(x), with the mean force g of press and release, the direction state s
    from -1 to 1, and the hysteresis h, which has separate weights for the same wavelets.
    """
    def __init__(self, *, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], bias: typing.SupportsFloat | typing.SupportsIndex, weight_hysteresis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, linear_hysteresis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, bias_hysteresis: typing.SupportsFloat | typing.SupportsIndex | None = None, lower: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], upper: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], below: str = 'linear', above: str = 'linear', period: typing.SupportsFloat | typing.SupportsIndex | None = None, play_radius: typing.SupportsFloat | typing.SupportsIndex | None = None, of_velocity: bool = False, memory: Memory | None = None, position_unit: str = '', force_unit: str = '', harmonics: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        Makes the model of N wavelets and d inputs: alpha, beta (N, d); weight (N,); linear, lower,
        upper (d,). of_velocity is true if the second of two inputs is the velocity. With a memory, the
        network is the force at rest. The units do not change the numbers; empty: not stated. The last
        `harmonics` wavelets of a periodic force are w cos(alpha (x - beta)). Raises ValueError with the
        wrong field.
        """
    @typing.overload
    def energy(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Returns the stored energy, up to a constant [J]; the arguments are those of force(). With
        `direction` the play operator is at position - direction * play_radius. If the model has no play
        radius, the result is the energy of the mean force of press and release.
        """
    @typing.overload
    def energy(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same method for an array of positions of any shape; returns an array of this shape.
        """
    def extrapolated(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
        """
        Returns True for a position outside the domain of the model.
        """
    @typing.overload
    def force(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Returns the force of the object against the tool [N or N*m]: a number for one position, an
        array for an array of positions.
        
        A hysteresis model needs `direction` (+1 pressing, -1 releasing) or, if it has a play radius,
        `play`, the state of the play operator. Arguments that the model does not use do not change the
        force, but direction and play must have one value for each position or one for all. Raises
        ValueError with the name of a missing argument. A position that is not finite gives NaN.
        """
    @typing.overload
    def force(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same method for an array of positions of any shape; returns an array of this shape.
        """
    def force_over_time(self, time: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """
        Returns the force (n,) of a model with memory along a recorded motion that starts at rest:
        positions (n,) at increasing times (n,) [s]. The second result (n,) is below 1 where the
        stretches were reduced, because the tool left the object.
        """
    def play(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], start: typing.SupportsFloat | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Returns the states (n,) of the model's play operator along the positions of a motion (n,). Without
        `start` the first state is the first position.
        """
    def predict(self, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Returns the force (n,) for the n rows of inputs X (n, d). A hysteresis model takes the
        direction as one more column. A row with a value that is not finite gives NaN.
        """
    @typing.overload
    def slope(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Returns the slope df/dx of the force [N/m or N*m/rad]; the arguments are those of force().
        """
    @typing.overload
    def slope(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same method for an array of positions of any shape; returns an array of this shape.
        """
    def slope_range(self, play_radius: typing.SupportsFloat | typing.SupportsIndex | None = None) -> tuple[float, float]:
        """
        Returns proved bounds (smallest, largest) of the slope of the force inside the domain, in press
        and in release. Without hysteresis they are wider than the true range by at most 1 % of the
        steepest slope. With a play radius r they include the slope h / r (hysteresis h), with which
        the force of a hysteresis model changes after a reversal.
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
    def force_unit(self) -> str:
        """
        Unit of the force, N*m, N or A; empty: not stated.
        """
    @property
    def harmonics(self) -> int:
        """
        Number of last wavelets that are harmonics of the period, w cos(alpha (x - beta)).
        """
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
    def memory(self) -> Memory | None:
        """
        Memory of the model; None for a force without memory.
        """
    @property
    def n_wavelets(self) -> int:
        ...
    @property
    def of_position(self) -> bool:
        """
        True if velocity and time do not change the force. Couplings, prediction, admittance displays
        and most exports need such a model; all others are rendered directly.
        """
    @property
    def of_velocity(self) -> bool:
        """
        True if the model has two inputs, of which the second is the velocity.
        """
    @property
    def period(self) -> float | None:
        ...
    @property
    def play_radius(self) -> float | None:
        ...
    @property
    def position_unit(self) -> str:
        """
        Unit of the position, rad, m or count; empty: not stated.
        """
    @property
    def upper(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def weight(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def weight_hysteresis(self) -> numpy.typing.NDArray[numpy.float64] | None:
        ...
def derivative_bounds(*, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.SupportsFloat | typing.SupportsIndex, bias: typing.SupportsFloat | typing.SupportsIndex, lower: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], upper: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], order: typing.SupportsInt | typing.SupportsIndex, harmonics: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns proved upper bounds (k,) of the absolute derivative of a network of one input,
    for orders up to 9, in k intervals of positions from lower (k,) to upper (k,). The last
    `harmonics` wavelets are harmonics of the period 1.
    """
def fingerprint(model: ForceModel) -> str:
    """
    Returns a fingerprint of a model: 16 hexadecimal digits, computed from its units and all numbers that determine the force.
    """
def play(position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], radius: typing.SupportsFloat | typing.SupportsIndex, start: typing.SupportsFloat | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns the states (n,) of a play operator of radius r along the positions x of a motion (n,):
    play_k = min(x_k + r, max(x_k - r, play_{k-1})). Without `start` the first state is the first
    position.
    """
def slope_bounds(*, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.SupportsFloat | typing.SupportsIndex, bias: typing.SupportsFloat | typing.SupportsIndex, lower: typing.SupportsFloat | typing.SupportsIndex, upper: typing.SupportsFloat | typing.SupportsIndex, relative: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> tuple[float, float]:
    """
    Returns proved bounds (smallest, largest) of the slope f' of a network of one input from lower
    to upper. They are wider than the true range by at most `relative` times the largest |f'|.
    """
def stretches(time: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], coordinate: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], time_constant_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], factor: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns the stretches (n, m, J) of branches with the J time constants along m recorded
    coordinates (n, m) at increasing times (n,), from rest: e <- factor (kept e + share du).
    `factor` (n,) reduces the stretches at each row; by default 1.
    """
def wavelet_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], harmonics: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns the values psi(alpha_i o (x_k - beta_i)) of N wavelets (radial Mexican hats) at n samples: (n, N),
    column by column in memory.
    
    x is (n, d), alpha and beta are (N, d); (n,) and (N,) mean d = 1. The last `harmonics` columns are
    cos(alpha_i (x_k - beta_i)), for d = 1.
    """
def wavelet_curvature_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> list[numpy.typing.NDArray[numpy.float64]]:
    """
    Returns the second derivatives of the wavelets' values by each input: a list of d arrays (n, N).
    """
def wavelet_jacobian(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.float64], list[numpy.typing.NDArray[numpy.float64]], list[numpy.typing.NDArray[numpy.float64]]]:
    """
    Returns the values of the wavelets (n, N), and their derivatives by the dilations alpha and by the
    translations beta, each as a list of d arrays (n, N): (value, by_alpha, by_beta).
    """
def wavelet_slope_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], harmonics: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns the derivatives d psi(alpha_i (x_k - beta_i)) / dx of wavelets of one input: (n, N). The
    last `harmonics` columns are those of cosines.
    """
def wavelet_steps(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], used: typing.Annotated[numpy.typing.ArrayLike, numpy.bool]) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns the derivatives of the wavelets' values by changes without a unit: d log(alpha) of the
    dilations and alpha d(beta) of the translations. They are those of the M inputs of wavelets which
    `used` (N, d) marks with True: (n, 2 M), columns ordered by quantity, input, wavelet.
    """
most_wavelets: int = 1000
