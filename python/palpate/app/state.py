# SPDX-License-Identifier: Apache-2.0
"""State of the page: what the user chose, as the options of the command line. Everything else is computed."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import click

from ..errors import command_word

Option = tuple[str, ...]
"""An option of a verb and its values, as words of a command line: ("--period", "15deg")"""


def words_of(options: Iterable[Option]) -> list[str]:
    """Returns the options as words of a command line."""
    return [word for option in options for word in option]


@dataclass(frozen=True)
class Entry:
    """A recording, and everything that the user chose for it."""

    file: str
    """Name of the recording in the folder of the session"""
    options: tuple[Option, ...] = ()
    """Options of `palpate identify`"""
    identified: bool = False
    """True if a model is wanted; it then follows every correction"""
    device: str = ""
    """Profile of the device: the name of an example or a TOML file; empty: none is chosen"""
    changes: tuple[tuple[str, float], ...] = ()
    """Fields of the profile that the user changed, with their values [SI]"""
    plan_options: tuple[Option, ...] = ()
    """Options of `palpate plan`"""

    origin: str = ""
    """Recording whose model was edited to make this one; empty if it was not edited"""
    played: bool = False
    """True if the rendering on a simulated device is wanted"""

    @property
    def stem(self) -> str:
        """Name of the recording without its ending; the files that are made from it have this name."""
        return Path(self.file).stem

    @property
    def profile(self) -> str:
        """Profile of the device as the commands name it: a separate file if the user changed a field."""
        return f"{self.stem}-{Path(self.device).stem}.toml" if self.changes else self.device


@dataclass(frozen=True)
class State:
    """Recordings of the page, and the one that is shown."""

    entries: tuple[Entry, ...] = ()
    current: int = 0

    @property
    def entry(self) -> Entry | None:
        """The recording that is shown; None without recordings."""
        return self.entries[self.current] if self.entries else None

    def with_entry(self, entry: Entry) -> State:
        """Returns the state with this entry shown; it replaces the one of the same file, if there is one."""
        files = [each.file for each in self.entries]
        if entry.file not in files:
            return State((*self.entries, entry), len(files))
        current = files.index(entry.file)
        return State((*self.entries[:current], entry, *self.entries[current + 1 :]), current)

    def without(self, file: str) -> State:
        """Returns the state without the recording of this name."""
        kept = tuple(each for each in self.entries if each.file != file)
        return State(kept, min(self.current, max(len(kept) - 1, 0)))


class OptionTable:
    """Options of a verb that the page may set, as its command defines them.

    Parameters
    ----------
    command : click.Command
    names : iterable of str
        Parameters of the command that the page may set. None of them names a file.
    """

    def __init__(self, command: click.Command, names: Iterable[str]) -> None:
        wanted = set(names)
        self._by_flag: dict[str, click.Option] = {}
        for each in command.params:
            if isinstance(each, click.Option) and each.name in wanted:
                self._by_flag |= dict.fromkeys((*each.opts, *each.secondary_opts), each)

    def __contains__(self, flag: str) -> bool:
        return flag in self._by_flag

    def _size(self, flag: str) -> int:
        option = self._by_flag[flag]
        return 0 if option.is_flag else option.nargs

    def parsed(self, words: Sequence[str]) -> list[Option]:
        """Returns the options at the start of words; ends at the first word that belongs to none of them."""
        found, at = list[Option](), 0
        while at < len(words) and words[at] in self._by_flag:
            end = at + 1 + self._size(words[at])
            if end > len(words):
                break
            found.append(tuple(words[at:end]))
            at = end
        return found

    def with_option(self, options: Sequence[Option], option: Option) -> tuple[Option, ...]:
        """Returns options with another one. It replaces the same option unless that can be repeated."""
        given = self._by_flag[option[0]]
        kept = [each for each in options if each != option]
        if not given.multiple:
            kept = [each for each in kept if self._by_flag[each[0]] is not given]
        elif option[0] == "--units":
            key = option[1].rpartition("=")[0]
            kept = [each for each in kept if each[0] != "--units" or each[1].rpartition("=")[0] != key]
        return (*kept, option)

    def cures(self, sentence: str) -> list[tuple[Option, ...]]:
        """Returns the options with values that a sentence advises; those that follow each other are one cure.

        An option whose value is a placeholder (``START:STOP``) is left out, because only the user knows the
        value.
        """
        found: list[tuple[Option, ...]] = []
        at = 0
        while (start := _FLAG.search(sentence, at)) is not None:
            options = self.parsed(_words(sentence[start.start() :]))
            complete = [each for each in options if not any(map(_PLACEHOLDER.fullmatch, each[1:]))]
            if options and complete == options and tuple(options) not in found:
                found.append(tuple(options))
            at = start.end()
            for flag in [each[0] for each in options[1:]]:
                at = sentence.index(flag, at) + len(flag)
        return found


_FLAG = re.compile(r"(?<!\S)--[a-zA-Z][\w-]*")
_PLACEHOLDER = re.compile(r"[A-Z]{4,}(:[A-Z]+|=[A-Z]+)?|")
_ENDING = ".,;:)"
"""Marks that end an option in a sentence"""


def _words(text: str) -> list[str]:
    """Returns the words of a command in a sentence, up to the end of its clause."""
    words = []
    try:
        split = shlex.split(text)
    except ValueError:
        split = text.split()
    for word in split:
        words.append(word if word in ("--decimal", ".", ",") else word.rstrip(_ENDING))
        if words[-1] != word:
            break
    return words


def commands_of(entry: Entry, reading: OptionTable, *, proved: bool | None) -> list[list[str]]:
    """Returns the command lines that make the files of an entry in the folder of its recording.

    `reading` are the options that read a recording; the report needs them too. `proved` is True if the plan
    has a certificate, and None without a plan that can be exported.
    """
    model, page, header = (f"{entry.stem}.{suffix}" for suffix in ("json", "html", "h"))
    commands = [["palpate", "identify", entry.file, *words_of(entry.options), "-o", model]]
    if entry.device:
        planned = ["--device", entry.profile, *words_of(entry.plan_options)]
        commands.append(["palpate", "plan", model, *planned, "-o", model])
    read_with = words_of(each for each in entry.options if each[0] in reading)
    commands.append(["palpate", "report", model, entry.file, *read_with, "-o", page])
    if proved is not None:
        uncertified = [] if proved else ["--uncertified"]
        commands.append(["palpate", "export", model, "--c", *uncertified, "-o", header])
    return commands


def text_of(command: Sequence[str]) -> str:
    """Returns a command line as a shell reads it."""
    return " ".join(map(command_word, command))


def changed(options: Sequence[Option], removed: Option) -> tuple[Option, ...]:
    """Returns options without one of them."""
    return tuple(each for each in options if each != removed)


def with_change(entry: Entry, values: Mapping[str, float]) -> Entry:
    """Returns an entry whose device profile has these values in its changed fields."""
    return replace(entry, changes=tuple(sorted({**dict(entry.changes), **values}.items())))
