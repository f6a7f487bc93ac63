# SPDX-License-Identifier: Apache-2.0
"""Band: the range of force in which a further recording of the object is expected."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._typing import Float1D

BAND_LEVEL = 0.95
"""Share of the rows of a further recording that a band is expected to contain [-]."""


@dataclass(frozen=True)
class Band:
    """Band about the force of a model, from the differences between several recordings.

    It contains 95 % of the rows of a further recording, in the mean over many such recordings. The rows of
    one recording differ from the model in a similar way, so that a single recording can have fewer rows in
    the band, or all of them. Between the positions the logarithm of the half width is linear; beyond the
    first and the last position the half width is constant.
    """

    position: Float1D
    """(k,) positions, increasing [m or rad]"""
    repeat: Float1D | None
    """(k,) half width for a further recording of the same object [N or N*m], about the force of the model;
    with several objects about the mean force of that object. None if no object has two recordings"""
    object: Float1D | None
    """(k,) half width for a recording of a further object of this kind [N or N*m]; None for one object"""
    recordings: int
    """Number of recordings"""
    objects: int
    """Number of objects"""
    unseen_error: float
    """RMS force error on a recording that was left out of the fit, or on an object that was left out if there
    are several [N or N*m]"""
    coverage: float | None
    """Share of the rows of the recordings, or objects, that were left out one at a time, which lie in the
    band of the others [-]; None for two of them"""

    @property
    def outer(self) -> Float1D:
        """(k,) half width about the force of the model: `object` if there are several objects, else
        `repeat`."""
        found = self.repeat if self.object is None else self.object
        assert found is not None
        return found

    def half_width(self, position: Float1D) -> Float1D:
        """Returns the half width of the band about the force of the model at positions (n,)."""
        return self._between(position, self.outer)

    def repeat_half_width(self, position: Float1D) -> Float1D | None:
        """Returns the half width (n,) for a further recording of the same object; None if unknown."""
        return None if self.repeat is None else self._between(position, self.repeat)

    def _between(self, position: Float1D, half: Float1D) -> Float1D:
        return np.asarray(np.exp(np.interp(position, self.position, np.log(half))))

    @property
    def left_out(self) -> str:
        """Name of the part of the data that the check leaves out: recording or object."""
        return "recording" if self.object is None else "object"

    def scaled(self, factor: float) -> Band:
        """Returns the band of the forces multiplied by a factor."""
        repeat, of_objects = (None if half is None else factor * half for half in (self.repeat, self.object))
        return Band(
            self.position,
            repeat,
            of_objects,
            self.recordings,
            self.objects,
            factor * self.unseen_error,
            self.coverage,
        )

    def record(self) -> dict[str, Any]:
        """Returns the band for a model file."""
        return {
            "position": self.position.tolist(),
            "repeat": None if self.repeat is None else self.repeat.tolist(),
            "object": None if self.object is None else self.object.tolist(),
            "recordings": self.recordings,
            "objects": self.objects,
            "unseen_error": self.unseen_error,
            "coverage": self.coverage,
        }

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Band:
        """Returns the band of a model file."""
        arrays = {
            name: None if record[name] is None else np.array(record[name], dtype=np.float64)
            for name in ("position", "repeat", "object")
        }
        return cls(**{**record, **arrays})
