# SPDX-License-Identifier: Apache-2.0
"""Models of joints are compared with other regressions on the same held-out rows."""

import numpy as np
import pytest
from bench.identification import joints

from palpate import Recording


def test_a_spring_with_damping_is_compared_on_held_out_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    methods = {name: joints.METHODS[name] for name in ("splines", "boosted trees")}
    monkeypatch.setattr(joints, "METHODS", methods)
    time = np.arange(1500) / 500.0
    position = 0.01 * (1.0 - np.cos(2.0 * np.pi * time * (1.0 + 0.3 * time)))
    noise = np.random.default_rng(0).normal(0.0, 0.01, len(time))
    force = 300.0 * position + 2.0 * np.gradient(position, time) + noise
    found = joints.errors_of(Recording.from_arrays(position, force, time=time))
    assert list(found) == ["palpate", *methods]
    level = 0.01 / float(np.std(force))
    assert 0.8 * level < found["palpate"] < 1.2 * level
    assert found["palpate"] < found["splines"] < 1.2 * level  # with the velocity
    assert found["splines"] < found["boosted trees"] < 0.2
