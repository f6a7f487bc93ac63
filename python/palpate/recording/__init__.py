# SPDX-License-Identifier: Apache-2.0
"""Obtain data: recordings of force over position, read, checked, converted to SI, and written."""

from .conversion import Source
from .reading import read_recording
from .recording import Recording
from .sample import sample_force, sample_recording

__all__ = ["Recording", "Source", "read_recording", "sample_force", "sample_recording"]
