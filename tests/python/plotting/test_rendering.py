# SPDX-License-Identifier: Apache-2.0
"""Figures of a rendering: recorded and rendered force, force errors of the structures, root locus."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate import Scheme
from palpate.plotting import draw_real_against_rendered, draw_structures
from palpate.plotting.rendering import root_locus


def test_recorded_is_dotted_and_rendered_is_solid() -> None:
    x = np.linspace(0.0, 1.0, 20)
    one = Figure().subplots()
    draw_real_against_rendered(
        one, (x, x), (x, 2 * x), {"position": "rad", "force": "N*m"}, title="driven by the motion"
    )
    recorded, rendered = one.lines
    assert (recorded.get_linestyle(), recorded.get_marker()) == ("None", ".")
    assert (rendered.get_linestyle(), rendered.get_marker()) == ("-", "None")
    np.testing.assert_array_equal(rendered.get_ydata(), 2 * x)
    assert one.get_title() == "driven by the motion"


def test_structures_are_drawn_from_top_to_bottom_with_both_errors() -> None:
    one = Figure().subplots()
    draw_structures(one, ["direct", "implicit, m = 0.001, B_o = 0"], [0.1, 0.2], [0.01, 0.15], "N")
    mean, end = one.lines
    np.testing.assert_array_equal(mean.get_xdata(), [0.1, 0.2])
    np.testing.assert_array_equal(end.get_xdata(), [0.01, 0.15])
    assert mean.get_markerfacecolor() != end.get_markerfacecolor()
    low, high = one.get_ylim()
    assert low > high, "the first structure must be at the top"
    assert one.get_xlabel() == "force error, RMS [N]"


def test_poles_are_those_of_the_step_and_leave_the_circle_at_the_certificate_limit() -> None:
    T = 1e-3
    scheme = Scheme(
        structure="explicit", coupling_stiffness=60.0, coupling_damping=0.01, mass=1e-3, object_damping=0.5
    )
    limit = (4.0 * 1e-3 - 2.0 * 0.51 * T) / T**2 - 60.0
    locus = root_locus(scheme, np.array([0.5 * limit, limit, 1.001 * limit]), T)
    reach = np.abs(locus.chosen).max(axis=1)
    assert reach[0] < 1.0
    assert reach[1] == pytest.approx(1.0, abs=1e-9)
    assert reach[2] > 1.0
    # The poles are the roots of z^2 + a z + b; their product b is 1 - T (B_o + B_c) / m.
    assert np.prod(locus.chosen[0]).real == pytest.approx(1.0 - T * 0.51 / 1e-3)
    # One computed slope is where two poles are equal, because the drawn line of the poles has a corner there.
    assert np.abs(np.diff(locus.poles[0], axis=-1)).min() < 1e-6
    # Handle at 0, total stiffness K: y_{k+1} = (1 + b) y_k - b y_{k-1} - T^2 K / m y_k.
    a, b = -np.sum(locus.chosen[0]).real, np.prod(locus.chosen[0]).real
    assert a == pytest.approx(T**2 / 1e-3 * (0.5 * limit + 60.0) - 1.0 - b)
