# SPDX-License-Identifier: Apache-2.0
"""Functions of all studies."""

import re
from pathlib import Path

import pytest
from bench import studies

ROOT = Path(__file__).parents[2]


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


def test_the_sample_of_every_change_has_a_study_of_each_folder() -> None:
    script = (ROOT / "tools" / "bench.sh").read_text(encoding="utf-8")
    (programs,) = re.findall(r"^ *sample=\((\w.*)\)$", script, re.MULTILINE)
    sources = [ROOT / "bench" / study for study in re.findall(r"^\+ (\S+)", script, re.MULTILINE)]
    for name in programs.split():
        sources += (ROOT / "bench").glob(f"*/{name}.cpp")
    folders = {path.name for path in (ROOT / "bench").iterdir() if any(path.glob("*.cpp"))}
    assert "solvers" in folders
    # The studies of the simulators and of exported models need other programs.
    assert {source.parent.name for source in sources if source.is_file()} >= folders | {
        "identification",
        "plans",
    }
