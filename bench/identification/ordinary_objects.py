# SPDX-License-Identifier: Apache-2.0
"""Provides twenty objects that are often measured, each with its exact force law and random parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import expit

from palpate._core.model import play, stretches

Array = NDArray[np.float64]

TURNING_SHARE = 0.002
"""Play radius in which the friction of an object reverses [share of the travel]"""

SOFTENING_WITHIN = 0.1
"""Distance from the deepest position over which a softened object becomes as stiff as new [share of the
travel]"""


def bend(u: Array, at: float, width: float) -> Array:
    """Returns a smooth ramp: 0 below `at`, slope 1 above."""
    return np.asarray(width * np.logaddexp(0.0, (u - at) / width))


def bowed(bow: float) -> Callable[[Array, Array], Array]:
    """Returns the shape of a spring without hysteresis that stiffens by `bow`."""
    return lambda u, s: u + bow * u**2


@dataclass(frozen=True, kw_only=True)
class Object:
    """Object with a known force: shape(u, s) times `scale`, plus relaxing and viscous forces.

    u is the position as a share of the travel; s is the direction state, +1 press, -1 release.
    """

    name: str
    shape: Callable[[Array, Array], Array]
    """(n,) force [scale] at shares of the travel (n,) and direction states (n,)"""
    travel: float
    """[m or rad]"""
    scale: float
    """[N or N*m]"""
    rotary: bool = False
    lower: float = 0.0
    """Smallest position of a stroke [share of the travel]; the largest one is 1"""
    leaves: bool = True
    """True if the object only pushes, so that the tool leaves it at position 0"""
    hysteretic: bool = True
    damping: float = 0.0
    """Viscous force at one travel a second [scale]"""
    branch: tuple[float, float] | None = None
    """Relaxing share of the force, and its time constant [s]"""
    period: float | None = None
    """[share of the travel]"""
    turning: float = TURNING_SHARE
    """Play radius [share of the travel]"""
    jerk: float = 0.0
    """Amplitude of a force that differs between strokes of the same object, such as stick-slip [scale]"""
    inertia: float = 0.0
    """Force at an acceleration of one travel per squared second [scale]; `force` is that without it"""
    softening: float = 0.0
    """Share of the force that the first press over a position removes from the later ones (Mullins)"""
    strongest: int = 1
    """Number of waves in a period of the strongest wave of a periodic force"""

    @property
    def units(self) -> dict[str, str]:
        return {"position": "rad", "force": "N*m"} if self.rotary else {"position": "m", "force": "N"}

    @property
    def classes(self) -> dict[str, bool]:
        """Model classes of the object: name -> True if the object has it."""
        return {
            "hysteresis": self.hysteretic,
            "velocity": self.damping > 0.0,
            "memory": self.branch is not None,
            "period": self.period is not None,
            "mass": self.inertia > 0.0,
        }

    def state(self, x: Array) -> Array:
        """Returns the direction state (n,) along the positions (n,) of a motion."""
        radius = self.turning * self.travel
        return np.asarray((x - play(x, radius)) / radius)

    def share_left(self, x: Array) -> Array:
        """Returns the share (n,) of the force that is left along the positions (n,) of a motion."""
        above = (np.maximum.accumulate(x) - x) / (SOFTENING_WITHIN * self.travel)
        return np.asarray(1.0 - self.softening * (1.0 - np.exp(-above)))

    def force(self, time: Array, x: Array, s: Array, velocity: Array) -> Array:
        """Returns the force (n,) along a motion that starts from rest.

        Parameters
        ----------
        time : (n,)
            [s]
        x : (n,)
            [m or rad]
        s : (n,)
            Direction states.
        velocity : (n,)
            [m/s or rad/s]
        """
        u = x / self.travel
        pressed = np.maximum(u, 0.0) if self.leaves else u
        force = self.shape(pressed, s)
        if self.branch is not None:
            share, tau = self.branch
            if self.leaves:
                force = left_pad(time, force, share, tau)
            else:
                force = force + share * stretches(time, force[:, None], np.array([tau]))[:, 0, 0]
        force = force + self.damping * velocity / self.travel
        if self.leaves:
            force = np.where(u > 0.0, np.maximum(force, 0.0), 0.0)
        return np.asarray(self.scale * force)


def left_pad(time: Array, force: Array, share: float, tau: float) -> Array:
    """Returns the force (n,) of a relaxing object that the tool can leave, from the force at rest (n,) at the
    position of the tool. Without contact the free surface follows slowly, and the tool meets it there again.
    """
    contact, surface, stretch = np.zeros(len(force)), float(force[0]), 0.0
    for k, step in enumerate(np.diff(time), start=1):
        kept = np.exp(-step / tau)
        stretched = kept * stretch + tau / step * (1.0 - kept) * (force[k] - surface)
        contact[k] = max(force[k] + share * stretched, 0.0)
        if contact[k] > 0.0:
            surface, stretch = float(force[k]), stretched
        else:  # the surface has no force: it is at rest where the branch balances the force at rest
            stretch -= (surface + share * stretch) / (1.0 + share)
            stretch *= np.exp(-step / (tau * (1.0 + share)))
            surface = -share * stretch
    return contact


def _small(random: Generator) -> tuple[float, float]:
    """Returns travel [m] and force [N] of an object for a finger."""
    return random.uniform(2e-3, 6e-3), 10.0 ** random.uniform(-0.3, 0.7)


def push_button(random: Generator) -> Object:
    travel, scale = _small(random)
    up, gap, width = random.uniform(0.35, 0.5), random.uniform(0.04, 0.12), random.uniform(0.012, 0.03)
    drop, slope, loop = random.uniform(0.3, 0.6), random.uniform(0.4, 0.9), random.uniform(0.03, 0.1)
    stop, stiff = random.uniform(0.86, 0.92), random.uniform(10.0, 30.0)

    def shape(u: Array, s: Array) -> Array:
        preload, click = 1.0 - np.exp(-u / 0.02), up - gap * (1.0 - s) / 2.0
        snap = 0.4 * np.exp(-(((u - click + 0.07) / 0.08) ** 2)) - expit((u - click) / width)
        return (0.6 + loop * s) * preload + slope * u + drop * snap + stiff * bend(u, stop, 0.004)

    return Object(name="push button", shape=shape, travel=travel, scale=scale)


def rubber_dome(random: Generator) -> Object:
    travel, scale = _small(random)
    rise, at, width = random.uniform(0.08, 0.2), random.uniform(0.4, 0.55), random.uniform(0.05, 0.1)
    drop, loss, stiff = random.uniform(0.3, 0.6), random.uniform(0.05, 0.15), random.uniform(5.0, 12.0)

    def shape(u: Array, s: Array) -> Array:
        dome = np.tanh(u / rise) - drop * expit((u - at) / width) + stiff * bend(u, 0.88, 0.015)
        return dome * (1.0 + loss * s)

    return Object(name="rubber dome", shape=shape, travel=travel, scale=scale)


def knob(random: Generator) -> Object:
    detents, second, friction = random.uniform(4.0, 10.0), random.uniform(0.0, 0.3), random.uniform(0.1, 0.4)

    def shape(u: Array, s: Array) -> Array:
        phase = 2.0 * np.pi * detents * u
        return np.asarray(np.sin(phase) + second * np.sin(2.0 * phase) + friction * s)

    return Object(
        name="knob",
        shape=shape,
        travel=2.0 * np.pi / 24.0 * detents,
        scale=10.0 ** random.uniform(-2.5, -1.5),
        rotary=True,
        leaves=False,
        period=1.0 / detents,
    )


def latching_switch(random: Generator) -> Object:
    travel, scale = _small(random)
    latch, width, kept = random.uniform(0.5, 0.65), random.uniform(0.012, 0.03), random.uniform(0.2, 0.4)

    def shape(u: Array, s: Array) -> Array:
        spring = 0.3 * (1.0 - np.exp(-u / 0.03)) + u
        held = 1.0 - (1.0 - kept) * expit((u - latch + 0.2) / width)
        press = spring + 0.4 * np.exp(-(((u - latch) / 0.05) ** 2))
        stop = 15.0 * bend(u, 0.93, 0.005)
        return np.asarray(0.5 * (1.0 + s) * press + 0.5 * (1.0 - s) * 0.95 * spring * held + stop)

    return Object(name="latching switch", shape=shape, travel=travel, scale=scale)


def spring(random: Generator) -> Object:
    travel, shape = random.uniform(5e-3, 3e-2), bowed(random.uniform(-0.2, 0.4))
    return Object(
        name="spring", shape=shape, travel=travel, scale=10.0 ** random.uniform(0.0, 1.5), hysteretic=False
    )


def spring_with_wall(random: Generator) -> Object:
    wall, stiff, width = random.uniform(0.6, 0.85), random.uniform(8.0, 30.0), random.uniform(0.003, 0.02)

    def shape(u: Array, s: Array) -> Array:
        return u + stiff * bend(u, wall, width)

    return Object(
        name="spring with wall",
        shape=shape,
        travel=random.uniform(5e-3, 2e-2),
        scale=10.0 ** random.uniform(0.0, 1.0),
        hysteretic=False,
    )


def tissue(random: Generator) -> Object:
    return Object(
        name="tissue",
        shape=bowed(random.uniform(0.5, 2.0)),
        travel=random.uniform(3e-3, 1e-2),
        scale=10.0 ** random.uniform(-1.0, 0.5),
        hysteretic=False,
        branch=(random.uniform(0.4, 1.0), 10.0 ** random.uniform(-0.5, 0.5)),
    )


def foam(random: Generator) -> Object:
    plateau, power, loss = random.uniform(0.05, 0.15), random.uniform(3.0, 8.0), random.uniform(0.1, 0.3)

    def shape(u: Array, s: Array) -> Array:
        return (0.4 * np.tanh(u / plateau) + 0.2 * u + u**power) * (1.0 + loss * s)

    return Object(
        name="foam",
        shape=shape,
        travel=random.uniform(1e-2, 4e-2),
        scale=10.0 ** random.uniform(0.5, 2.0),
        turning=0.02,
    )


def magnet(random: Generator) -> Object:
    gap, power = random.uniform(0.15, 0.5), random.uniform(2.0, 4.0)
    sign = random.choice([-1.0, 1.0])

    def shape(u: Array, s: Array) -> Array:
        return np.asarray(sign * (gap / (1.0 + gap - u)) ** power)

    return Object(
        name="magnet",
        shape=shape,
        travel=random.uniform(5e-3, 3e-2),
        scale=10.0 ** random.uniform(0.0, 1.5),
        leaves=False,
        hysteretic=False,
    )


def damper(random: Generator) -> Object:
    slope = random.uniform(0.0, 0.3)

    def shape(u: Array, s: Array) -> Array:
        return slope * u

    return Object(
        name="damper",
        shape=shape,
        travel=random.uniform(1e-2, 5e-2),
        scale=10.0 ** random.uniform(0.0, 1.5),
        leaves=False,
        hysteretic=False,
        damping=random.uniform(0.5, 2.0),
    )


def play_without_load(random: Generator) -> Object:
    gap, friction, slope = random.uniform(0.02, 0.06), random.uniform(0.1, 0.4), random.uniform(0.2, 1.0)

    def shape(u: Array, s: Array) -> Array:
        return np.asarray(slope * (u - 0.5) + friction * s**5)  # nearly 0 while the play is crossed

    return Object(
        name="play without load",
        shape=shape,
        travel=random.uniform(0.3, 1.0),
        scale=10.0 ** random.uniform(-2.0, 0.0),
        rotary=True,
        leaves=False,
        turning=gap,
    )


def gimbal_spring(random: Generator) -> Object:
    bow, friction = random.uniform(0.0, 0.5), random.uniform(0.03, 0.1)

    def shape(u: Array, s: Array) -> Array:
        return np.asarray(u + bow * u**3 + friction * s)

    return Object(
        name="gimbal spring",
        shape=shape,
        travel=random.uniform(0.2, 0.5),
        scale=10.0 ** random.uniform(-2.0, -0.5),
        rotary=True,
        lower=-1.0,
        leaves=False,
    )


def motor_cogging(random: Generator) -> Object:
    periods = random.uniform(2.5, 6.0)
    sizes, phases = random.uniform(0.1, 0.5, 2), random.uniform(0.0, 2.0 * np.pi, 3)

    def shape(u: Array, s: Array) -> Array:
        phase = 2.0 * np.pi * periods * u
        further = (a * np.sin(k * phase + p) for k, a, p in zip((2, 3), sizes, phases[1:], strict=True))
        return np.asarray(np.sin(phase + phases[0]) + sum(further))

    return Object(
        name="motor cogging",
        shape=shape,
        travel=periods * 2.0 * np.pi / 14.0,
        scale=10.0 ** random.uniform(-2.5, -1.0),
        rotary=True,
        leaves=False,
        hysteretic=False,
        period=1.0 / periods,
    )


def pedal(random: Generator) -> Object:
    peak, width, drop = random.uniform(0.3, 0.5), random.uniform(0.05, 0.15), random.uniform(0.1, 0.4)
    loss = random.uniform(0.08, 0.2)

    def shape(u: Array, s: Array) -> Array:
        lever = 0.2 * np.tanh(u / 0.03) + u - drop * expit((u - peak) / width) + drop * expit(-peak / width)
        return lever * (1.0 + loss * s)

    return Object(
        name="pedal", shape=shape, travel=random.uniform(0.05, 0.15), scale=random.uniform(50.0, 300.0)
    )


def slip_stick_pair(random: Generator) -> Object:
    slope = random.uniform(0.0, 0.3)

    def shape(u: Array, s: Array) -> Array:
        return np.asarray(s + slope * u)

    return Object(
        name="slip-stick pair",
        shape=shape,
        travel=random.uniform(5e-3, 5e-2),
        scale=10.0 ** random.uniform(-1.0, 1.0),
        leaves=False,
        turning=0.01,
        jerk=random.uniform(0.05, 0.2),
    )


def _with_stop(random: Generator, name: str, travel: float, scale: float, *, rotary: bool) -> Object:
    """Returns a spring with some friction that ends in a hard stop, at which the tool turns."""
    stop, stiff, loop = random.uniform(0.94, 0.985), random.uniform(20.0, 60.0), random.uniform(0.03, 0.1)

    def shape(u: Array, s: Array) -> Array:
        return u + (0.1 + loop * s) * -np.expm1(-u / 0.02) + stiff * bend(u, stop, 0.001)

    return Object(name=name, shape=shape, travel=travel, scale=scale, rotary=rotary, leaves=not rotary)


def slider_with_stop(random: Generator) -> Object:
    return _with_stop(random, "slider with stop", *_small(random), rotary=False)


def lever_with_stop(random: Generator) -> Object:
    travel, scale = random.uniform(0.3, 4.0), 10.0 ** random.uniform(-2.0, 0.0)
    return _with_stop(random, "lever with stop", travel, scale, rotary=True)


def heavy_lever(random: Generator) -> Object:
    """Returns a spring with a rotary inertia: its force at 3 Hz is 5 to 50 % of that of the spring."""
    bow, share = random.uniform(0.0, 0.5), random.uniform(0.05, 0.5)

    def shape(u: Array, s: Array) -> Array:
        return u + bow * u**3

    return Object(
        name="heavy lever",
        shape=shape,
        travel=random.uniform(0.2, 0.5),
        scale=10.0 ** random.uniform(-2.0, 0.0),
        rotary=True,
        lower=-1.0,
        leaves=False,
        hysteretic=False,
        inertia=share / (2.0 * np.pi * 3.0) ** 2,
    )


def cogging_revolution(random: Generator) -> Object:
    """Returns cogging over one to two revolutions, whose strongest wave is not the lowest."""
    low, strongest = int(random.integers(1, 3)), int(random.integers(3, 7))
    turns, phases = random.uniform(1.2, 2.2), random.uniform(0.0, 2.0 * np.pi, 3)
    sizes = random.uniform(0.2, 0.6), 1.0, random.uniform(0.1, 0.4)

    def shape(u: Array, s: Array) -> Array:
        phase = 2.0 * np.pi * low * turns * u
        waves = zip((1, strongest, 2 * strongest), sizes, phases, strict=True)
        return np.asarray(sum(size * np.sin(k * phase + p) for k, size, p in waves))

    return Object(
        name="cogging revolution",
        shape=shape,
        travel=turns * 2.0 * np.pi,
        scale=10.0 ** random.uniform(-2.5, -1.0),
        rotary=True,
        leaves=False,
        hysteretic=False,
        period=1.0 / (low * turns),
        strongest=strongest,
    )


def elastomer(random: Generator) -> Object:
    bow, loss = random.uniform(0.3, 1.5), random.uniform(0.03, 0.12)

    def shape(u: Array, s: Array) -> Array:
        return np.asarray((u + bow * u**2) * (1.0 + loss * s))

    return Object(
        name="elastomer",
        shape=shape,
        travel=random.uniform(3e-3, 2e-2),
        scale=10.0 ** random.uniform(0.5, 2.0),
        turning=0.02,
        softening=random.uniform(0.1, 0.4),
    )


OBJECTS: tuple[Callable[[Generator], Object], ...] = (
    push_button,
    rubber_dome,
    knob,
    latching_switch,
    spring,
    spring_with_wall,
    tissue,
    foam,
    magnet,
    damper,
    play_without_load,
    gimbal_spring,
    motor_cogging,
    pedal,
    slip_stick_pair,
)
"""Functions that return an object with random parameters"""

ADDED_OBJECTS = (slider_with_stop, lever_with_stop, heavy_lever, cogging_revolution, elastomer)
"""Further objects, which follow in the list of pairs"""
