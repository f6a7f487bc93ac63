# SPDX-License-Identifier: Apache-2.0
"""Small models with chosen parameters, for tests."""

from typing import Any

import numpy as np

from palpate import Model
from palpate._core.model import Memory


def model_by_hand(**changes: Any) -> Model:
    """Returns a model f = 5 x + one wavelet, over 0 to 0.5 rad and at most 3 N*m, with changed fields."""
    arguments: dict[str, Any] = {
        "units": {"position": "rad", "force": "N*m"},
        "alpha": [[20.0]],
        "beta": [[0.3]],
        "weight": [0.1],
        "linear": [5.0],
        "lower": [0.0],
        "upper": [0.5],
    }
    return Model.from_network(**{**arguments, **changes})


def keyswitch_by_hand(**changes: Any) -> Model:
    """Returns a tactile switch of 4 mm travel whose press is 0.1 N above its release."""
    return model_by_hand(
        **{
            "units": {"position": "m", "force": "N"},
            "alpha": [[2000.0]],
            "beta": [[0.002]],
            "weight": [-0.2],
            "linear": [100.0],
            "bias": 0.3,
            "weight_hysteresis": [0.0],
            "linear_hysteresis": [0.0],
            "bias_hysteresis": 0.05,
            "upper": [0.004],
            "below": "free",
            **changes,
        }
    )


def relaxing_by_hand(**changes: Any) -> Model:
    """Returns a spring of 2 N/m at rest with one branch of 3 N/m that relaxes in 0.5 s, over 0 to 1 m."""
    memory = Memory(
        alpha=[], beta=[], weight=[], linear=0.0, bias=1.0, stiffness=[3.0], time_constant_s=[0.5]
    )
    arguments: dict[str, Any] = {
        "units": {"position": "m", "force": "N"},
        "alpha": np.zeros((0, 1)),
        "beta": np.zeros((0, 1)),
        "weight": [],
        "linear": [2.0],
        "lower": [0.0],
        "upper": [1.0],
        "memory": memory,
    }
    return Model.from_network(**{**arguments, **changes})
