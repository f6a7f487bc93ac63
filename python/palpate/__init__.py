# SPDX-License-Identifier: Apache-2.0
"""Identifies a model of force over position from recordings, and renders it on a haptic device.

    model = palpate.identify("press.csv")  # or a DataFrame, or arrays of position and force
    print(model)
    print(palpate.verify(model, "fresh.csv").nrmse)
    model.save("press.json")

Names are loaded at their first use, so that the command line starts fast.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._core import __version__
    from .errors import InputError
    from .identification import IdentifyOptions, SearchOptions, frame_bounds
    from .identification.identify import identify
    from .identification.identify_files import identify_files
    from .identification.regressor import WaveletNetworkRegressor
    from .model import Model, load_model
    from .planning import DeviceProfile, Hand, Plan, Scheme, simulate
    from .planning.search import plan
    from .recording import Recording, read_recording
    from .verdict import Finding, Verdict
    from .verification import Verification, verify

_MODULE_OF = {
    name: module
    for module, names in {
        "_core": ("__version__",),
        "errors": ("InputError",),
        "verdict": ("Finding", "Verdict"),
        "recording": ("Recording", "read_recording"),
        "model": ("Model", "load_model"),
        "identification": ("IdentifyOptions", "SearchOptions", "frame_bounds", "identify"),
        "identification.identify_files": ("identify_files",),
        "identification.regressor": ("WaveletNetworkRegressor",),
        "verification": ("Verification", "verify"),
        "planning": ("DeviceProfile", "Hand", "Plan", "Scheme", "simulate"),
        "planning.search": ("plan",),
    }.items()
    for name in names
}
"""Submodule that defines each public name of the package, by name."""

__all__ = [
    "DeviceProfile",
    "Finding",
    "Hand",
    "IdentifyOptions",
    "InputError",
    "Model",
    "Plan",
    "Recording",
    "Scheme",
    "SearchOptions",
    "Verdict",
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
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'palpate' has no attribute {name!r}")
    try:
        module = import_module(f".{_MODULE_OF[name]}", __name__)
    except ModuleNotFoundError as missing:
        if missing.name == "palpate._core":
            raise ImportError(
                "palpate._core is not built: run `pip install .` or `make test` first"
            ) from missing
        raise
    return getattr(module, name)


def _has_scikit_learn() -> bool:
    try:
        return find_spec("sklearn") is not None
    except (ImportError, ValueError):
        return False


if not _has_scikit_learn():
    # The class needs scikit-learn, which is not installed: `from palpate import *` and help() leave it out.
    __all__.remove("WaveletNetworkRegressor")


def __dir__() -> list[str]:
    return sorted(__all__)
