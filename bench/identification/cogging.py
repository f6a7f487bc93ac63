# SPDX-License-Identifier: Apache-2.0
"""Prints the ripple that a table against cogging leaves, for every controller, over simulated motors.

A draw is a motor with random poles and slots, friction, and a recording of one slow revolution in each
direction with noise of 2 % of the largest cogging torque. The ripple is the true cogging minus the torque
that the controller makes of its table, RMS, as a share of the RMS cogging.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

import palpate
from palpate.export.cogging import CONTROLLERS, TURN, table_of

Array = NDArray[np.float64]

NOISE = 0.02
"""Standard deviation of the noise as a share of the largest cogging torque [-]"""

ROWS = 4000
"""Rows of one revolution"""

COUNT = 1e-5
"""Torque of one unit of the command of an OpenFFBoard [N*m], an assumption"""

CONSTANT = 0.05
"""Torque constant for the moteus [N*m/A], an assumption"""


def motor(random: np.random.Generator) -> tuple[Array, Array, Array]:
    """Returns order, amplitude [N*m] and phase [rad] of the harmonics of a motor.

    Poles and slots that fit exactly make the least common multiple of both; their errors make the orders of
    the poles and of the slots.
    """
    poles, slots = [(14, 12), (20, 24), (22, 24), (28, 24), (42, 36)][random.integers(5)]
    order = np.array([poles, slots, 2 * slots, np.lcm(poles, slots)], dtype=np.float64)
    amplitude = 0.03 * random.uniform([0.1, 0.3, 0.05, 0.1], [0.5, 1.0, 0.3, 0.5])
    return order, amplitude, random.uniform(0.0, TURN, len(order))


def ripples(draw: int) -> dict[str, float]:
    """Returns the ripple of one motor for every controller [-]."""
    random = np.random.default_rng([41, draw])
    order, amplitude, phase = motor(random)

    def cogging(angle: Array) -> Array:
        return np.asarray(amplitude @ np.cos(np.outer(order, angle) - phase[:, None]))

    way = np.repeat([1.0, -1.0], ROWS)
    angle = np.concatenate([np.linspace(0.0, TURN, ROWS), np.linspace(TURN, 0.0, ROWS)])
    exact = cogging(angle)
    force = exact + 0.005 * way + random.normal(0.0, NOISE * np.abs(exact).max(), len(angle))
    recording = palpate.Recording.from_arrays(
        angle, force, direction=way, units={"position": "rad", "force": "N*m"}
    )
    model = palpate.identify(recording, period=TURN)
    at = random.uniform(0.0, TURN, 20_000)
    true = cogging(at)
    units = {"moteus": CONSTANT, "openffboard": COUNT}
    shares = {}
    for kind in CONTROLLERS:
        unit = units.get(kind, 1.0)
        left = true - unit * table_of(kind, model, unit).replayed(at)
        shares[kind] = float(np.sqrt(np.mean(left**2) / np.mean(true**2)))
    return shares


def main() -> None:
    """Prints the median and the range of the ripples over the draws."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=20)
    found = [ripples(draw) for draw in range(parser.parse_args().draws)]
    print(f"ripple left of the cogging, {len(found)} motors, noise {100 * NOISE:.0f} % of the largest torque")
    for kind in CONTROLLERS:
        share = 100.0 * np.array([each[kind] for each in found])
        print(f"  {kind:12} median {np.median(share):.2f} %, from {share.min():.2f} to {share.max():.2f} %")


if __name__ == "__main__":
    main()
