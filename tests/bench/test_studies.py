# SPDX-License-Identifier: Apache-2.0
"""Functions of all studies."""

from pathlib import Path

import pytest
from bench import studies


@pytest.mark.parametrize(("scale", "preset"), [(1.0, "release"), (0.01, "dev")])
def test_a_short_run_uses_the_programs_of_the_tests_and_a_missing_program_is_named(
    scale: float, preset: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(studies, "SCALE", scale)
    monkeypatch.setattr(studies, "ROOT", tmp_path)
    with pytest.raises(SystemExit, match=f"does not exist: cmake --build --preset {preset} --target rivals"):
        studies.program("rivals")
    program = tmp_path / "build" / preset / "bench" / "rivals"
    program.parent.mkdir(parents=True)
    program.touch()
    assert studies.program("rivals") == program
