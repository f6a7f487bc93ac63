# SPDX-License-Identifier: Apache-2.0
"""Report: one self-contained HTML page about a model, its verification and its plan."""

from .report import Report, report_of, write_report
from .subject import Subject

__all__ = ["Report", "Subject", "report_of", "write_report"]
