# SPDX-License-Identifier: Apache-2.0
"""
Models as tables for programs in C.
"""
from __future__ import annotations
import numpy
import numpy.typing
import palpate._core.device
import palpate._core.model
import palpate._core.rendering
import typing
__all__: list[str] = ['CellGrid', 'CellTable', 'EdgeLine', 'ExportCheck', 'ExportedLag', 'ExportedLine', 'ExportedMemory', 'ExportedModel', 'profile_checksum']
class CellGrid:
    """
    Positions of the cells of an exported table.
    """
    def width(self, k: typing.SupportsInt | typing.SupportsIndex) -> float:
        """
        Returns the width of a cell of a coarse cell split into 2^k.
        """
    @property
    def bits(self) -> int:
        """
        Number of the coarse cells as a power of two.
        """
    @property
    def coarse_width(self) -> float:
        ...
    @property
    def first_count(self) -> int:
        ...
    @property
    def last_count(self) -> int:
        ...
    @property
    def lower(self) -> float:
        ...
    @property
    def origin(self) -> int:
        """
        Count with the phase 0.
        """
    @property
    def periodic(self) -> bool:
        ...
    @property
    def phase_lower(self) -> int:
        ...
    @property
    def phase_per_count(self) -> float:
        ...
    @property
    def phase_start(self) -> int:
        ...
    @property
    def phase_step(self) -> int:
        ...
    @property
    def phase_upper(self) -> int:
        ...
    @property
    def shift(self) -> int:
        ...
    @property
    def start(self) -> float:
        """
        Position of the start of the first coarse cell.
        """
    @property
    def upper(self) -> float:
        ...
class CellTable:
    """
    Exported curves as polynomials of degree 5 in cells.
    """
    @property
    def bytes(self) -> int:
        """
        Size of coefficients and splits [bytes].
        """
    @property
    def cells(self) -> int:
        ...
    @property
    def coefficients(self) -> numpy.ndarray:
        """
        Coefficients (cells, 6 for each curve), the lowest power first.
        """
    @property
    def grid(self) -> CellGrid:
        ...
    @property
    def integrals(self) -> numpy.ndarray:
        """
        First and second antiderivative (cells, 2 for each curve) at the centres of the cells.
        """
    @property
    def split_bytes(self) -> int:
        ...
    @property
    def splits(self) -> numpy.typing.NDArray[numpy.uint32]:
        """
        First cell and, in the lowest four bits, k of each coarse cell, which has 2^k cells.
        """
class ExportedLine:
    """
    Straight line of an exported curve outside the domain.
    """
    @property
    def gain(self) -> float:
        ...
    @property
    def offset(self) -> float:
        ...
    @property
    def reach(self) -> float:
        ...
    @property
    def slope(self) -> float:
        ...
    @property
    def value(self) -> float:
        ...
class ExportedLag:
    """
    Numbers of the massless structure.
    """
    @property
    def compliance(self) -> float:
        ...
    @property
    def memory(self) -> float:
        ...
class ExportedMemory:
    """
    Branches of a model with memory. The ratio is in units of force.
    """
    @property
    def contact(self) -> int:
        """
        Sign of the force against which the branches do not pull; 0: none.
        """
    @property
    def kept(self) -> list[float]:
        """
        Share of a stretch that is left after a period at rest.
        """
    @property
    def largest_stretch(self) -> list[float]:
        ...
    @property
    def stiffness(self) -> list[float]:
        ...
    @property
    def sudden(self) -> float:
        """
        Stiffness for a motion within one period.
        """
class EdgeLine:
    """
    End of the domain, with force, slope and antiderivatives of the line beyond it.
    """
    @property
    def double_integral(self) -> float:
        ...
    @property
    def edge(self) -> float:
        ...
    @property
    def integral(self) -> float:
        ...
    @property
    def reach(self) -> float:
        ...
    @property
    def slope(self) -> float:
        ...
    @property
    def value(self) -> float:
        ...
class ExportCheck:
    """
    Largest differences between an exported model and the core, divided by their bounds.
    """
    @property
    def energy(self) -> float:
        ...
    @property
    def force(self) -> float:
        ...
    @property
    def passed(self) -> bool:
        """
        True if every difference is within its bound.
        """
    @property
    def places(self) -> int:
        """
        Number of counts that were compared.
        """
    @property
    def slope(self) -> float:
        ...
    @property
    def step(self) -> float:
        ...
class ExportedModel:
    """
    A model and its structure as tables and numbers for a program in C.
    """
    def __init__(self, model: palpate._core.model.ForceModel, scheme: palpate._core.rendering.Scheme, *, encoder_step: typing.SupportsFloat | typing.SupportsIndex, period_s: typing.SupportsFloat | typing.SupportsIndex = 0.0, force_limit: typing.SupportsFloat | typing.SupportsIndex = ..., precision: str = 'single') -> None:
        """
        Makes the tables, with proved errors. Raises ValueError with the reason for a model or structure
        that cannot be exported. `period_s` is needed for the structure massless only.
        """
    def check(self, random_counts: typing.SupportsInt | typing.SupportsIndex = 2000, seed: typing.SupportsInt | typing.SupportsIndex = 1) -> ExportCheck:
        """
        Compares the tables with the core at all cell borders, at random counts and over a random motion.
        """
    def samples(self, counts: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Returns force, slope and energy (3, n) at the counts (n,) with the arithmetic of the header.
        After each count the play operator is moved to it.
        """
    def steps(self, counts: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Returns the forces (n,) of the structure over a motion (n,), with the arithmetic of the header.
        """
    @property
    def edges(self) -> list[tuple[EdgeLine, EdgeLine]]:
        """
        Ends (below, above) of the domain for each curve of the force law.
        """
    @property
    def encoder_step(self) -> float:
        ...
    @property
    def energy_error(self) -> float:
        ...
    @property
    def force_error(self) -> float:
        ...
    @property
    def force_limit(self) -> float:
        ...
    @property
    def hysteretic(self) -> bool:
        ...
    @property
    def lag(self) -> ExportedLag:
        ...
    @property
    def largest_force(self) -> float:
        ...
    @property
    def largest_slope(self) -> float:
        ...
    @property
    def law(self) -> CellTable:
        """
        Table of the force law.
        """
    @property
    def lines(self) -> list[typing.Annotated[list[ExportedLine], "FixedSize(2)"]]:
        """
        Lines (below, above) of each curve of the force law.
        """
    @property
    def massless(self) -> bool:
        ...
    @property
    def memory(self) -> ExportedMemory | None:
        """
        Branches; None without memory.
        """
    @property
    def outside_share(self) -> float:
        ...
    @property
    def periodic(self) -> bool:
        ...
    @property
    def play_radius(self) -> float:
        ...
    @property
    def rendering_error(self) -> float:
        """
        Friction that the certificate of an exported model needs in addition [N or N*m]; infinity if no bound of the errors is known.
        """
    @property
    def response(self) -> CellTable | None:
        """
        Table of the force on the load line; None without a load line.
        """
    @property
    def response_lines(self) -> typing.Annotated[list[ExportedLine], "FixedSize(2)"]:
        ...
    @property
    def scheme(self) -> palpate._core.rendering.Scheme:
        ...
    @property
    def single(self) -> bool:
        ...
    @property
    def slope_error(self) -> float:
        ...
    @property
    def step_error(self) -> float:
        ...
    @property
    def step_error_lasts(self) -> bool:
        """
        True if the error of a step does not grow with the number of steps.
        """
def profile_checksum(device: palpate._core.device.DeviceProfile) -> int:
    """
    Returns 32 bits that change with every number and name of a device profile.
    """
