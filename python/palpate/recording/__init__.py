# SPDX-License-Identifier: Apache-2.0
"""Recordings of force over position: reading, checks, conversion to SI, and writing."""

from .conversion import Source
from .reading import read_recording
from .recording import Recording
from .sample import sample_force, sample_recording

__all__ = ["Recording", "Source", "read_recording", "sample_force", "sample_recording"]
