# SPDX-License-Identifier: Apache-2.0
"""Plan: how a model is to be rendered."""

from __future__ import annotations

from dataclasses import dataclass

from .._core import DeviceProfile, Scheme
from ..errors import InputError
from ..model import Model


@dataclass(frozen=True)
class Plan:
    """A model, and the structure and numbers with which it is rendered.

    Nothing here is chosen or proved: a plan states what its author wants, and `certificate` is None until
    something has certified it for a device.

    Raises
    ------
    InputError
        The scheme does not fit the model; the message names the field and what would be right.
    """

    model: Model
    scheme: Scheme
    certificate: None = None
    refused: tuple[str, ...] = ()
    """Simpler structures that were refused, each with its reason."""

    def __post_init__(self) -> None:
        if self.model.units["force"] == "A":
            raise InputError(
                "the model's force is a motor current in A; identify it again with --torque-constant-Nm-per-A"
            )
        self._validate(None)

    @property
    def structure(self) -> str:
        """direct, massless, implicit or explicit."""
        return self.scheme.structure

    @property
    def solver(self) -> str | None:
        """How the load line is solved; None where there is nothing to solve."""
        return "newton" if self.structure in ("massless", "implicit") else None

    def check_for(self, device: DeviceProfile) -> None:
        """Refuse what is sure to diverge on this device.

        Raises
        ------
        InputError
            The explicit structure's slope limit is not above the model's steepest slope.
        """
        self._validate(device.period_s)

    def _validate(self, period_s: float | None) -> None:
        try:
            self.scheme.validate(self.model, period_s)
        except InputError:
            raise
        except ValueError as error:
            raise InputError(str(error)) from None
