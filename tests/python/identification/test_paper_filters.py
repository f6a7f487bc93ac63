# SPDX-License-Identifier: Apache-2.0
"""The identification as published, for comparison: figures 11 and 13."""

import numpy as np
import pytest

from palpate import InputError, Recording, identify
from palpate._core.dynamics import environment_filters
from palpate.identification import IdentifyOptions, SearchOptions
from palpate.identification.data.rows import paper_target
from palpate.recording import sample_force, sample_recording


def spring(rate: float, *, mass: float = 0.0, damping: float = 0.0) -> Recording:
    """3 N*m/rad swept sinusoidally, with a mass and a damping."""
    t = np.arange(0.0, 10.0, 1e-3)
    x = 0.3 * np.sin(rate * t)
    force = 3.0 * x - mass * rate**2 * x + damping * 0.3 * rate * np.cos(rate * t)
    return Recording.from_arrays(x, force, time=t)


@pytest.mark.parametrize(
    ("filters", "mass", "damping"), [("paper-implicit", 0.02, 0.0), ("paper-explicit", 0.02, 0.5)]
)
def test_a_slow_motion_leaves_the_static_force(filters: str, mass: float, damping: float) -> None:
    """G I is within 5 % of 1 well below 100 rad/s; what is left of m and B_o is small."""
    recording = spring(4.0, mass=mass, damping=damping)
    options = IdentifyOptions(search=SearchOptions(filters=filters, assumed_mass=0.02, assumed_damping=0.5))
    target = paper_target(recording, options)[200:]
    wrong = np.abs(target - 3.0 * recording.position[200:]).max()
    assert wrong < 0.1 * np.abs(recording.force - 3.0 * recording.position).max() + 0.01


def test_the_target_is_the_force_less_the_filtered_motion() -> None:
    recording = spring(20.0)
    options = IdentifyOptions(
        search=SearchOptions(filters="paper-explicit", assumed_mass=0.01, assumed_damping=0.2)
    )
    pair = environment_filters("explicit")
    velocity = pair.g2.filter(recording.position)
    expected = recording.force - 0.01 * pair.g1.filter(velocity) - 0.2 * velocity
    np.testing.assert_allclose(paper_target(recording, options), expected, atol=1e-12)


def test_the_model_holds_the_assumed_mass_and_damping() -> None:
    recording = sample_recording(1, duration_s=5.0)
    model = identify(recording, search=SearchOptions(filters="paper-explicit"))
    assert (model.mass, model.damping) == (1e-3, 0.5)
    assert identify(recording, search=SearchOptions(filters="paper-implicit")).damping is None


def test_matched_identification_of_a_moving_object_is_closer_to_its_force() -> None:
    """Known truth: the paper's lag costs it, the matched route uses raw positions and forces."""
    recording = sample_recording(1, duration_s=20.0)
    x = np.linspace(-0.2, 0.469, 2001)
    truth = sample_force(x)
    errors = {
        filters: float(
            np.sqrt(
                np.mean((identify(recording, search=SearchOptions(filters=filters)).force(x) - truth) ** 2)
            )
        )
        for filters in ("matched", "paper-implicit", "paper-explicit")
    }
    assert errors["matched"] < 0.25 * errors["paper-implicit"] < 0.25 * errors["paper-explicit"]


def test_other_periods_than_the_papers_are_refused() -> None:
    x = np.linspace(0.0, 1.0, 100)
    with pytest.raises(InputError, match=r"filters need time"):
        identify(Recording.from_arrays(x, x), search=SearchOptions(filters="paper-implicit"))
    with pytest.raises(InputError, match=r"made for steps of 0.001 s; the recording's are from 0.01 to 0.01"):
        identify(
            Recording.from_arrays(x, x, time=0.01 * np.arange(100)),
            search=SearchOptions(filters="paper-explicit"),
        )
