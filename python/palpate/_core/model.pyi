# SPDX-License-Identifier: Apache-2.0
"""
Force laws and their proved bounds.
"""
from __future__ import annotations
import numpy
import numpy.typing
import typing
__all__: list[str] = ['ForceModel', 'derivative_bounds', 'fingerprint', 'play', 'slope_bounds', 'wavelet_columns', 'wavelet_curvature_columns', 'wavelet_jacobian', 'wavelet_slope_columns', 'wavelet_steps']
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
    def play(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], start: typing.SupportsFloat | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        State of the play operator along a motion (n,), started at rest unless told otherwise.
        """
    def predict(self, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Force at X (n, d), (n,); a hysteresis model takes the direction as one more column. A row with a
        value that is not finite gives NaN.
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
def derivative_bounds(*, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.SupportsFloat | typing.SupportsIndex, bias: typing.SupportsFloat | typing.SupportsIndex, lower: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], upper: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], order: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
    """
    Proved bounds (k,) of |f^(order)| of a network of one input, up to the ninth, over the cells
    [lower, upper], each (k,).
    """
def fingerprint(model: ForceModel) -> str:
    """
    16 hexadecimal digits that change with every number of which the model's force is made.
    """
def play(position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], radius: typing.SupportsFloat | typing.SupportsIndex, start: typing.SupportsFloat | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
    """
    State (n,) of the play operator of a radius along a motion (n,), started at rest unless told
    otherwise: play_k = min(x_k + r, max(x_k - r, play_{k-1})).
    """
def slope_bounds(*, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.SupportsFloat | typing.SupportsIndex, bias: typing.SupportsFloat | typing.SupportsIndex, lower: typing.SupportsFloat | typing.SupportsIndex, upper: typing.SupportsFloat | typing.SupportsIndex, relative: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> tuple[float, float]:
    """
    Proved (smallest, largest) slope of a network of one input over [lower, upper], at most `relative`
    times max|f'| wider than the true range.
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
