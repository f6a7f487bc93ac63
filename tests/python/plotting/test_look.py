# SPDX-License-Identifier: Apache-2.0
"""Labels, prefixes of units, and the number of points that a figure draws."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate import InputError, Recording
from palpate.plotting import plot
from palpate.plotting.look import MOST_POINTS, label, scale_for, strokes, thinned


@pytest.mark.parametrize("n", [1, 10, MOST_POINTS, MOST_POINTS + 1, 10 * MOST_POINTS + 7])
def test_number_of_drawn_points_is_limited(n: int) -> None:
    x, y = thinned(np.arange(n, dtype=float), np.arange(n, dtype=float))
    assert min(n, MOST_POINTS // 2) <= len(x) <= MOST_POINTS
    np.testing.assert_array_equal(x, y)


def test_pauses_belong_to_no_stroke() -> None:
    direction = np.array([1, 0, -1, 0], dtype=np.int8)
    by_name = dict(strokes(direction, 4))
    np.testing.assert_array_equal(by_name["press"], [True, False, False, False])
    np.testing.assert_array_equal(by_name["release"], [False, False, True, False])
    assert [name for name, _ in strokes(np.array([1, 0], dtype=np.int8), 2)] == [""]


def test_unknown_unit_is_not_drawn() -> None:
    assert label("force", "") == "force"


@pytest.mark.parametrize(
    ("unit", "largest", "shown", "factor"),
    [
        ("m", 0.0041, "mm", 1e3),
        ("m", 0.1, "m", 1.0),
        ("m", 0.0999, "mm", 1e3),
        ("m", 5e-5, "\u00b5m", 1e6),
        ("N", 0.5, "N", 1.0),
        ("N", 0.02, "mN", 1e3),
        ("N", 1000.0, "kN", 1e-3),
        ("N*m", 0.005, "mN*m", 1e3),
        ("rad", 0.47, "rad", 1.0),
        ("rad", 0.05, "mrad", 1e3),
        ("rad", 5000.0, "rad", 1.0),
        ("count", 5000.0, "count", 1.0),
        ("", 1e-5, "", 1.0),
        ("N", 0.0, "N", 1.0),
    ],
)
def test_the_prefix_of_a_unit_follows_the_largest_value(
    unit: str, largest: float, shown: str, factor: float
) -> None:
    for values in ([largest, 0.0], [-largest, np.nan]):
        scale = scale_for(unit, values)
        assert scale.unit == shown
        assert scale.factor == pytest.approx(factor)


def test_curves_on_the_same_axes_have_the_same_scale() -> None:
    axes = Figure().subplots()
    small = Recording.from_arrays([0.0, 0.01, 0.09], [0.0, 0.01, 0.09], units={"position": "m", "force": "N"})
    large = Recording.from_arrays([0.0, 0.1, 0.9], [0.0, 0.1, 0.9], units={"position": "m", "force": "N"})
    plot(small, axes)
    plot(large, axes)
    assert axes.get_xlabel() == "position [mm]"
    assert axes.get_ylabel() == "force [mN]"
    assert np.asarray(axes.lines[1].get_xdata())[-1] == 900.0
    torque = Recording.from_arrays(
        [0.0, 0.1, 0.9], [0.0, 0.1, 0.9], units={"position": "rad", "force": "N*m"}
    )
    with pytest.raises(InputError, match="ax already shows values in m, and these are in rad"):
        plot(torque, axes)
