# SPDX-License-Identifier: Apache-2.0
"""Wavelet networks: basis, least squares, refinement and constraints."""
