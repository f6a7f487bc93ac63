# SPDX-License-Identifier: Apache-2.0
"""Models of every kind that can be exported, as headers of C, for the tests of the export."""

from pathlib import Path
from typing import Any

import numpy as np
from bench.portable.programs import FOLDER

from palpate import Model
from palpate._core.model import Memory, fingerprint
from palpate._core.portable import ExportedModel
from palpate._core.rendering import Scheme
from palpate.export import Exported
from palpate.export.c_header import header_text
from palpate.export.exported import units_of

RATE_HZ = 1000

MEMORY = Memory(
    alpha=[5.0],
    beta=[0.2],
    weight=[0.3],
    linear=-1.0,
    bias=1.0,
    stiffness=[3.0, 2.0],
    time_constant_s=[0.02, 1.0],
)

KINDS: dict[str, dict[str, Any]] = {
    "position": {},
    "predicted": {"scheme": {"predict": 3}},
    "hysteresis": {"hysteresis": True},
    "predicted_hysteresis": {"hysteresis": True, "scheme": {"predict": 5}},
    "massless": {"scheme": {"structure": "massless", "coupling_stiffness": 400.0, "coupling_damping": 0.3}},
    "compensated": {
        "scheme": {
            "structure": "massless", "coupling_stiffness": 400.0, "coupling_damping": 0.3, "compensated": True
        }
    },
    "free": {"model": {"below": "free", "above": "free"}, "scheme": {"predict": 1}},
    "periodic": {"model": {"period": 0.5, "linear": [0.0]}},
    "periodic_predicted_hysteresis": {
        "model": {"period": 0.5, "linear": [0.0]}, "hysteresis": True, "scheme": {"predict": 2}
    },
    "periodic_massless": {
        "model": {"period": 0.5, "linear": [0.0]},
        "scheme": {"structure": "massless", "coupling_stiffness": 600.0, "coupling_damping": 0.2},
    },
    "harmonics": {
        "model": {
            "period": 0.5, "linear": [0.0], "harmonics": 3,
            "alpha": [[30.0], [50.0], *[[4.0 * np.pi * order] for order in (1, 4, 13)]],
        }
    },
    "memory": {"model": {"memory": MEMORY}},
    "free_memory": {"model": {"memory": MEMORY, "below": "free"}},
}  # fmt: skip
"""Every combination of the parts of a header at least once: name -> changes of model and scheme."""


def random_model(seed: int, *, hysteresis: bool = False, **changes: Any) -> Model:
    """Returns a random model of five wavelets over 0 to 0.5 rad."""
    random = np.random.default_rng(seed)
    wavelets = 5
    weight = random.uniform(-0.5, 0.5, wavelets)
    arguments: dict[str, Any] = {
        "units": {"position": "rad", "force": "N*m"},
        "alpha": np.exp(random.uniform(1.0, 4.0, wavelets))[:, None].tolist(),
        "beta": random.uniform(0.0, 0.5, wavelets)[:, None].tolist(),
        "weight": weight.tolist(),
        "linear": [random.uniform(0.0, 8.0)],
        "bias": random.uniform(-0.2, 0.2),
        "lower": [0.0],
        "upper": [0.5],
    }
    if hysteresis:
        arguments |= {
            "weight_hysteresis": (0.05 * np.abs(weight)).tolist(),
            "linear_hysteresis": [0.0],
            "bias_hysteresis": 0.2,
            "play_radius": 0.01,
        }
    return Model.from_network(**(arguments | changes))


def tables_of(kind: str, *, precision: str = "single", seed: int = 1) -> tuple[Model, ExportedModel]:
    """Returns a random model of a kind, and its tables."""
    parts = KINDS[kind]
    model = random_model(seed, hysteresis=parts.get("hysteresis", False), **parts.get("model", {}))
    scheme = Scheme(**({"structure": "direct"} | parts.get("scheme", {})))
    return model, ExportedModel(
        model,
        scheme,
        encoder_step=0.5 / 20011.3,
        period_s=1.0 / RATE_HZ,
        force_limit=2.5,
        precision=precision,
    )


def header_of(model: Model, tables: ExportedModel, folder: Path, name: str = "knob") -> Path:
    """Writes the header of a model without certificate and returns its file."""
    exported = Exported(
        name, "knob.json", tables, tables.check(100), fingerprint(model), None, units_of(model)
    )
    path = folder / f"{name}.h"
    path.write_text(header_text(exported), encoding="utf-8")
    return path


def flags_of(header: Path) -> list[str]:
    """Returns the options for bench/portable/exported.c."""
    return [f'-DMODEL="{header.name}"', f"-DNAME={header.stem}"]


EXPORTED = FOLDER / "exported.c"
"""Program that runs an exported model over a random motion and prints a hash of all results."""
