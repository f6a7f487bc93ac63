# SPDX-License-Identifier: Apache-2.0
"""The code of the pages in docs/ runs, other commands have existing options, and links lead to files."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

from palpate import _core
from palpate.cli.main import palpate

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs" / "builder"))

import once  # noqa: E402
import page_code  # noqa: E402

PROGRAM = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))
PAGES = {str(page.relative_to(ROOT)): page.read_text(encoding="utf-8") for page in page_code.pages()}
TEXTS = {"README.md": (ROOT / "README.md").read_text(encoding="utf-8"), **PAGES}
BLOCKS = {name: list(page_code.blocks(text)) for name, text in PAGES.items()}

NOT_RUN = {
    "docs/how-to/cluster.md": 1,  # a cluster
    "docs/how-to/firmware.md": 2,  # a device
    "docs/how-to/pedal.md": 2,  # real time, a part of a program
    "docs/how-to/motor.md": 3,  # CAN hardware, a wheel
    "docs/how-to/real-time.md": 3,  # system administration, a quiet computer
    "docs/how-to/simulator.md": 4,  # MuJoCo, FMPy
    "docs/identification.md": 1,  # an hour
    "docs/rendering.md": 1,  # a device
}
"""Number of blocks of each page that are marked as not run"""


@pytest.mark.parametrize(
    "name", [name for name, found in BLOCKS.items() if any(not block.not_run for block in found)]
)
@pytest.mark.docs
def test_code_of_a_page_runs(name: str) -> None:
    if "palpate-control" in PAGES[name] and not PROGRAM.exists():
        pytest.skip("needs palpate-control, run make control")
    outputs = page_code.run_once(ROOT / name)
    assert len(outputs) == len(BLOCKS[name])
    made = re.findall(r"\]\((?:\.\./)+build/docs/pages/([^)]+)\)", PAGES[name])
    folder = Path(name).relative_to("docs").with_suffix("")
    own = [Path(each).relative_to(folder) for each in made if Path(each).is_relative_to(folder)]
    assert [each for each in own if not (page_code.folder_of(ROOT / name) / each).is_file()] == []


def test_blocks_that_are_not_run_are_counted() -> None:
    counts = {name: sum(bool(block.not_run) for block in found) for name, found in BLOCKS.items()}
    assert {name: count for name, count in counts.items() if count} == NOT_RUN


def test_every_block_of_code_names_a_known_language() -> None:
    known = {"python", "sh", "cpp", "text", "{toctree}"}
    languages = {word for text in PAGES.values() for word in re.findall(r"^```(\S+)", text, re.MULTILINE)}
    assert languages <= known
    assert sum(len(found) for found in BLOCKS.values()) > 30


def test_a_failing_block_is_reported_with_page_and_line(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# Title\n\n```python\nx = 1\n```\n\n```sh\nexit 3\n```\n", encoding="utf-8")
    with pytest.raises(SystemExit, match=r"page\.md: the block at line 7 failed"):
        page_code.run_page(page, tmp_path / "folder")


BUSY = """
```sh
python tests/python/mit_drive.py bus.sock > drive.txt 2>&1 &
drive=$!
trap "kill -KILL $drive" EXIT
while [ ! -S bus.sock ]; do sleep 0.1; done
kill -STOP $drive
(sleep 1; kill -CONT $drive) &
palpate-control tests/models/good/spring.json --device mit:./bus.sock:1:damiao-4310 --uncertified \\
    --duration-s 0.1 --frozen-s 0
```
"""
"""The emulated drive does not run for a second, as on a busy machine."""


@pytest.mark.skipif(not PROGRAM.exists(), reason="needs palpate-control, run make control")
def test_an_emulated_drive_answers_a_block_in_virtual_time_however_busy_the_machine_is(
    tmp_path: Path,
) -> None:
    page = tmp_path / "page.md"
    page.write_text(BUSY, encoding="utf-8")
    with pytest.raises(SystemExit, match="does not answer"):
        page_code.run_page(page, tmp_path / "real")
    page.write_text(f"<!-- virtual time: busy -->{BUSY}", encoding="utf-8")
    (output,) = page_code.run_page(page, tmp_path / "virtual")
    assert "100 ticks" in output


def test_code_runs_again_only_after_a_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, runs = tmp_path / "result.json", []

    def result_of(code: str) -> list[str]:
        outputs: list[str] = once.kept(file, code, lambda: runs.append(code) or [code, "output"])
        return outputs

    assert [result_of("a"), result_of("a"), result_of("b")] == [["a", "output"]] * 2 + [["b", "output"]]
    assert runs == ["a", "b"]
    monkeypatch.setattr(once, "programs", lambda: "another version of palpate")
    assert result_of("b") == ["b", "output"]
    assert runs == ["a", "b", "b"]


def test_a_change_of_a_source_or_of_the_module_makes_kept_results_invalid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {str(file) for file in once.files()}
    for used in (
        page_code.__file__,
        _core.__file__,
        ROOT / "python" / "palpate" / "cli" / "main.py",
        ROOT / "cpp" / "firmware" / "palpate_device.c",
        ROOT / "tests" / "usb" / "run_emulated.py",
    ):
        assert str(used) in files
    source = tmp_path / "source.py"
    monkeypatch.setattr(once, "files", lambda: [source])
    digests = []
    for text in ("x = 1", "x = 2", "x = 1"):
        source.write_text(text, encoding="utf-8")
        digests.append(once.programs.__wrapped__())
    assert digests[0] == digests[2] != digests[1]


def test_a_block_whose_programs_are_missing_is_not_run(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    for program, output in (("bash", "found\n"), ("bash no-such-program", "")):
        page.write_text(f"<!-- needs: {program} -->\n```sh\necho found\n```\n", encoding="utf-8")
        assert page_code.run_page(page, tmp_path / "folder") == [output]


def test_outputs_are_shown_behind_their_blocks() -> None:
    source = ["```python\nprint(1)\n```\ntext\n```sh\ntrue\n```\nend\n"]
    page_code.show_outputs("page", source, {"page": ["1\n", ""]})
    assert source[0] == "```python\nprint(1)\n```\n\n```text\n1\n```\ntext\n```sh\ntrue\n```\nend\n"


def commands_not_run() -> list[str]:
    """Returns the commands that no test runs: they need hardware or are part of a sentence."""
    blocks = [block for found in BLOCKS.values() for block in found if block.not_run]
    lines = [line for block in blocks for line in block.code.replace("\\\n", " ").splitlines()]
    inline = [
        found for text in TEXTS.values() for found in re.findall(r"`(palpate(?:-control)? [^`]+)`", text)
    ]
    return [line for line in lines + inline if line.startswith("palpate")]


@pytest.mark.parametrize("line", [line for line in commands_not_run() if line.startswith("palpate ")])
def test_every_option_of_a_command_that_is_not_run_exists(line: str) -> None:
    verb, *arguments = shlex.split(line, comments=True)[1:]
    command = palpate.get_command(click.Context(palpate), verb)
    assert command is not None
    options = {name for parameter in command.params for name in parameter.opts}
    options |= {"--help", "--version"}
    assert {word for word in arguments if word.startswith("-")} <= options


@pytest.mark.skipif(not PROGRAM.exists(), reason="needs palpate-control, run make control")
def test_every_option_of_palpate_control_in_the_pages_exists() -> None:
    help_text = subprocess.run([PROGRAM, "--help"], capture_output=True, text=True, check=True).stdout
    lines = [line for line in commands_not_run() if line.startswith("palpate-control ")]
    assert lines
    words = {word for line in lines for word in shlex.split(line, comments=True) if word.startswith("--")}
    assert {word for word in words if word not in help_text} == set()


@pytest.mark.parametrize("name", TEXTS)
def test_linked_files_exist(name: str) -> None:
    text = re.sub(r"^```.*?^```$", "", TEXTS[name], flags=re.DOTALL | re.MULTILINE)
    targets = re.findall(r"\]\((?!https?://|#|/)([^)#]+)", text)
    # The build makes pictures of the examples, figures and the pages of the references.
    made = re.compile(r"(?:\.\./)*(?:build/docs/|generated/)|gallery/|\.\./generated/")
    targets = [target for target in targets if not made.match(target)]
    assert [target for target in targets if not ((ROOT / name).parent / target).exists()] == []


@pytest.mark.parametrize("name", TEXTS)
def test_links_to_other_sites_are_complete_addresses(name: str) -> None:
    for target in re.findall(r"\]\((https?:[^)]*)\)", TEXTS[name]):
        assert re.fullmatch(r"https://[\w.-]+\.[a-z]{2,}(?:/[\w./#%~+-]*)?", target), target
