# SPDX-License-Identifier: Apache-2.0
"""Rows of recordings, made ready for a fit."""
