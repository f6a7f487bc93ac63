# SPDX-License-Identifier: Apache-2.0
"""The readers of model files in C++ and Python, and the schema, agree on mutated files."""

import importlib.util
import sys
from types import ModuleType

import pytest

from any_input import SCALE
from conftest import ROOT


def compare_readers() -> ModuleType:
    """Returns the module tests/fuzz/compare_readers.py."""
    path = ROOT / "tests" / "fuzz" / "compare_readers.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.full
def test_the_readers_agree_on_mutated_files() -> None:
    assert compare_readers().compare(2000 * SCALE, 1) == []
