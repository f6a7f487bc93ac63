# SPDX-License-Identifier: Apache-2.0
"""Options of the page: those that a sentence advises, those that replace each other, and the commands."""

import pytest

from palpate.app.state import Entry, Option, commands_of, text_of
from palpate.cli.app import CommandLine

IDENTIFY = CommandLine.identify


@pytest.mark.parametrize(
    ("sentence", "cures"),
    [
        ("The force may be delayed: try --force-late-s 0.025.", [(("--force-late-s", "0.025"),)]),
        ("if a sign is reversed, give --negate force or --negate position; else record again",
         [(("--negate", "force"),), (("--negate", "position"),)]),
        ("add: --position travel --units travel=mm", [(("--position", "travel"), ("--units", "travel=mm"))]),
        ("add: --position 'Weg 1' --units 'Weg 1=mm'",
         [(("--position", "Weg 1"), ("--units", "Weg 1=mm"))]),
        ("for a latch or a stored spring, --no-hysteresis-nonnegative",
         [(("--no-hysteresis-nonnegative",),)]),
        ("if the comma is the decimal mark, add: --decimal ','", [(("--decimal", ","),)]),
        ("mount the object without backlash, or give --force-late-s SECONDS, the delay of the force", []),
        ("Give --zero START:STOP, the rows without contact", []),
        ("name its column with --time NAME", []),
        ("render with --structure direct, or write -o OUT.json", []),
        ("a force that falls by 12 % --", []),
    ],
)  # fmt: skip
def test_the_options_with_values_that_a_sentence_advises_are_found(
    sentence: str, cures: list[tuple[Option, ...]]
) -> None:
    assert IDENTIFY.cures(sentence) == cures


@pytest.mark.parametrize(
    ("before", "option", "after"),
    [
        ([("--period", "1deg")], ("--period", "2deg"), [("--period", "2deg")]),
        ([("--rows", "0:5")], ("--leave-out", "1:2"), [("--rows", "0:5"), ("--leave-out", "1:2")]),
        ([("--leave-out", "1:2")], ("--leave-out", "3:4"), [("--leave-out", "1:2"), ("--leave-out", "3:4")]),
        ([("--leave-out", "1:2")], ("--leave-out", "1:2"), [("--leave-out", "1:2")]),
        ([("--units", "a=mm")], ("--units", "a=m"), [("--units", "a=m")]),
        ([("--units", "a=mm")], ("--units", "b=N"), [("--units", "a=mm"), ("--units", "b=N")]),
        ([("--monotone",)], ("--no-monotone",), [("--no-monotone",)]),
    ],
)  # fmt: skip
def test_an_option_replaces_the_same_one_unless_it_can_be_repeated(
    before: list[Option], option: Option, after: list[Option]
) -> None:
    assert list(IDENTIFY.with_option(before, option)) == after


@pytest.mark.parametrize("flag", ["-o", "--output", "--plot", "--object", "--scheduler", "--jobs", "--help"])
def test_the_page_cannot_set_options_that_name_files_or_other_machines(flag: str) -> None:
    assert flag not in IDENTIFY
    assert flag not in CommandLine.plan


def test_the_commands_contain_the_options_and_the_changed_profile() -> None:
    options = (("--period", "15deg"), ("--leave-out", "1:2"))
    entry = Entry("my knob.csv", options, device="bench-knob", changes=(("viscous_damping", 0.1),))
    assert [text_of(each) for each in commands_of(entry, CommandLine.reading, proved=True)] == [
        "palpate identify 'my knob.csv' --period 15deg --leave-out 1:2 -o 'my knob.json'",
        "palpate plan 'my knob.json' --device 'my knob-bench-knob.toml' -o 'my knob.json'",
        "palpate report 'my knob.json' 'my knob.csv' --leave-out 1:2 -o 'my knob.html'",
        "palpate export 'my knob.json' --c -o 'my knob.h'",
    ]
