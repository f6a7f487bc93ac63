# SPDX-License-Identifier: Apache-2.0
"""From a recorded force over position to a force that is rendered.

    recording = palpate.read_recording("press.csv")
    model = palpate.identify(recording)
    print(palpate.verify(model, palpate.read_recording("fresh.csv")).nrmse)
    model.save("press.json")

Names are loaded when they are first used, so that the command line answers at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._core import Hand, Scheme, __version__
    from .errors import InputError
    from .identification import IdentifyOptions, frame_bounds
    from .identification.identify import identify
    from .identification.identify_files import identify_files
    from .identification.regressor import WaveletNetworkRegressor
    from .model import Model, load_model
    from .planning import DeviceProfile, Plan, simulate
    from .planning.ladder import plan
    from .recording import Recording, read_recording
    from .verification import Verification, verify

_HOME = {
    "DeviceProfile": "planning",
    "Hand": "_core",
    "Scheme": "_core",
    "__version__": "_core",
    "InputError": "errors",
    "IdentifyOptions": "identification",
    "frame_bounds": "identification",
    "identify": "identification",
    "identify_files": "identification.identify_files",
    "Model": "model",
    "load_model": "model",
    "Plan": "planning",
    "plan": "planning.ladder",
    "simulate": "planning",
    "Recording": "recording",
    "read_recording": "recording",
    "Verification": "verification",
    "verify": "verification",
    "WaveletNetworkRegressor": "identification.regressor",
}
"""Where each public name lives."""

__all__ = [
    "DeviceProfile",
    "Hand",
    "IdentifyOptions",
    "InputError",
    "Model",
    "Plan",
    "Recording",
    "Scheme",
    "Verification",
    "WaveletNetworkRegressor",
    "__version__",
    "frame_bounds",
    "identify",
    "identify_files",
    "load_model",
    "plan",
    "read_recording",
    "simulate",
    "verify",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'palpate' has no attribute {name!r}")
    try:
        home = import_module(f".{_HOME[name]}", __name__)
    except ModuleNotFoundError as missing:
        if missing.name == "palpate._core":
            raise ImportError(
                "palpate._core is not built: run `pip install .` or `make test` first"
            ) from missing
        raise
    return getattr(home, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
