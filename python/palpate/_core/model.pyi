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
    f(x, s) = g(x) + s h(x), where h has separate weights for the same wavelets.
    """
    def __init__(self, *, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], bias: typing.SupportsFloat | typing.SupportsIndex, weight_hysteresis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, linear_hysteresis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, bias_hysteresis: typing.SupportsFloat | typing.SupportsIndex | None = None, lower: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], upper: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], below: str = 'linear', above: str = 'linear', period: typing.SupportsFloat | typing.SupportsIndex | None = None, play_radius: typing.SupportsFloat | typing.SupportsIndex | None = None, of_velocity: bool = False) -> None:
        """
        alpha, beta (N, d); weight (N,); linear, lower, upper (d,). of_velocity: the second of two inputs is the velocity. ValueError names the wrong field.
        """
    @typing.overload
    def energy(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Returns the stored energy [J] up to a constant; arguments as for force.
        """
    @typing.overload
    def energy(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same for an array of positions, of any shape.
        """
    def extrapolated(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
        """
        Returns True if a position lies outside the identified domain.
        """
    @typing.overload
    def force(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Returns the force of the object against the tool [N or N*m]: a number for a number, an array for an
        array.
        
        A hysteresis model needs `direction` (+1 pressing, -1 releasing) or, if it has a play radius, `play`,
        the state of the play operator. Inputs that the model does not use are ignored; ValueError names a
        missing one.
        A position that is not finite gives NaN.
        """
    @typing.overload
    def force(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same for an array of positions, of any shape.
        """
    def play(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], start: typing.SupportsFloat | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Returns the state of the play operator along a motion (n,). Without `start` it begins at rest.
        """
    def predict(self, X: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Returns the force (n,) at X (n, d). A hysteresis model takes the direction as one more column. A row
        with a value that is not finite gives NaN.
        """
    @typing.overload
    def slope(self, position: float, *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.SupportsFloat | typing.SupportsIndex | None = None, play: typing.SupportsFloat | typing.SupportsIndex | None = None) -> float:
        """
        Returns the local stiffness df/dx; arguments as for force.
        """
    @typing.overload
    def slope(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, velocity: typing.Any = None, acceleration: typing.Any = None, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, play: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same for an array of positions, of any shape.
        """
    def slope_range(self, play_radius: typing.SupportsFloat | typing.SupportsIndex | None = None) -> tuple[float, float]:
        """
        Returns the proved (smallest, largest) slope inside the domain while sliding in either direction,
        within 1 % of the steepest. With a play radius it also holds while a hysteresis model sticks, which
        adds h / r.
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
        True if the second of two inputs is the velocity.
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
    Returns proved bounds (k,) of |f^(order)| of a network of one input, for orders up to 9, over the
    cells [lower, upper], each (k,).
    """
def fingerprint(model: ForceModel) -> str:
    """
    Returns 16 hexadecimal digits that change with every number of the model's force.
    """
def play(position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], radius: typing.SupportsFloat | typing.SupportsIndex, start: typing.SupportsFloat | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns the state (n,) of the play operator of a radius along a motion (n,):
    play_k = min(x_k + r, max(x_k - r, play_{k-1})). Without `start` it begins at rest.
    """
def slope_bounds(*, alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], linear: typing.SupportsFloat | typing.SupportsIndex, bias: typing.SupportsFloat | typing.SupportsIndex, lower: typing.SupportsFloat | typing.SupportsIndex, upper: typing.SupportsFloat | typing.SupportsIndex, relative: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> tuple[float, float]:
    """
    Returns the proved (smallest, largest) slope of a network of one input over [lower, upper], at most
    `relative` times max|f'| wider than the true range.
    """
def wavelet_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns psi(alpha_i o (x_k - beta_i)) of the radial Mexican hat: (n, N), column by column in memory.
    
    x is (n, d), alpha and beta are (N, d); (n,) and (N,) mean d = 1.
    """
def wavelet_curvature_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> list[numpy.typing.NDArray[numpy.float64]]:
    """
    Returns the second derivatives of the wavelet columns along each input: a list of d arrays (n, N).
    """
def wavelet_jacobian(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.float64], list[numpy.typing.NDArray[numpy.float64]], list[numpy.typing.NDArray[numpy.float64]]]:
    """
    Returns the wavelet columns and their derivatives by the dilations and the translations:
    (value, by_alpha, by_beta), value (n, N), the others lists of d arrays (n, N).
    """
def wavelet_slope_columns(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns d psi(alpha_i (x_k - beta_i)) / dx for one input: (n, N).
    """
def wavelet_steps(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], alpha: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], beta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    """
    Returns the derivatives of the wavelet columns by steps without a unit, d log(alpha) and alpha d(beta):
    (n, 2 d N), ordered (quantity, input, wavelet), column by column in memory.
    """
