# SPDX-License-Identifier: Apache-2.0
"""
Limits at which each method fails.
"""
from __future__ import annotations
import typing
__all__: list[str] = ['failure_map', 'failure_map_names', 'guard_effects']
def failure_map(name: str, points: typing.SupportsInt | typing.SupportsIndex = 8) -> dict:
    """
    Where a method fails: boundaries measured in simulation, and what theory says of them.
    
    By name: along and limit (what the axes hold, with units) and lines, each with its name and the
    arrays (points,) at, measured (NaN: none failed) and theory (NaN: nothing is known);
    searched (up to how many times the theory, where none failed) and linear (the limit spans no decades).
    """
def guard_effects() -> list:
    """
    Every guard by itself: its cost where nothing is wrong, and what it makes of what is.
    
    By row: guard, cost (RMS change of the force over its RMS), wrong (what is wrong, and what of
    it is measured), without and with the guard.
    """
failure_map_names: tuple = ('explicit', 'damping', 'prediction', 'period', 'encoder', 'play', 'coupling', 'falling', 'limit', 'coupled-encoder', 'hand', 'solver', 'pole', 'guard')
