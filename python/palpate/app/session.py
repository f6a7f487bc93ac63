# SPDX-License-Identifier: Apache-2.0
"""Session of the page: its state with undo, the actions that change it, and the results computed from it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Protocol

import click
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..export.c_header import write as write_c_header
from ..export.request import Request
from ..model import Model
from ..planning import DeviceProfile, Plan, profile_file
from ..recording import Recording
from ..recording.files import free_name
from ..recording.formats import open_table
from ..report import Subject, report_of
from ..report.of_comparison import Compared
from ..report.subject import Rendering
from ..verification.metrics import compare
from .charts import Axes, course_axis, one_curve
from .designer import HYSTERESIS, Curves, editable, edited, recording_of, write_recording
from .live import PROGRAM, RUN_S, Live
from .state import Entry, Option, OptionTable, State, changed, with_change

CACHED = 64
"""Number of models, plans and charts that are kept, so that undo shows the earlier ones at once"""

RECORDINGS_CACHED = 8
"""Number of recordings that are kept; they can be large"""


class StoppedError(Exception):
    """The user stopped an identification. It has no result, so nothing is kept of it."""


class CommandLine(Protocol):
    """The verbs of the command line: their options, and their work for these options."""

    reading: OptionTable
    identify: OptionTable
    plan: OptionTable
    progress: str

    def stop_identification(self) -> None:
        """Makes a running identification raise `StoppedError`."""

    def read(self, file: str, options: Sequence[Option]) -> Recording:
        """Reads a recording as `palpate identify` does."""

    def model_of(self, recording: Recording, file: str, options: Sequence[Option]) -> Model:
        """Identifies a model as `palpate identify` does."""

    def plan_of(self, model: Model, file: str, device: DeviceProfile, options: Sequence[Option]) -> Plan:
        """Plans a model as `palpate plan` does."""


@dataclass(frozen=True)
class Refusal:
    """Sentence with which some work was refused."""

    sentence: str


@dataclass(frozen=True)
class File:
    """A file that the page downloads."""

    name: str
    content: bytes


def sentence_of(error: Exception) -> str:
    """Returns the sentence of an error that is meant for the user."""
    text = error.format_message() if isinstance(error, click.ClickException) else str(error)
    return " ".join(text.split())


def tried(work: Callable[[], Any]) -> Any:
    """Returns the result of some work, or the refusal with its sentence."""
    try:
        return work()
    except (ValueError, click.ClickException, OSError) as error:
        return Refusal(sentence_of(error))


class Session:
    """State of the page with its history. Results follow from the state alone and are cached.

    Parameters
    ----------
    folder : Path
        Folder of the recordings and profiles; it must be the current folder, so that results name them as a
        command in their folder does.
    command_line : CommandLine
    """

    def __init__(self, folder: Path, command_line: CommandLine) -> None:
        self.folder = folder
        self.command_line = command_line
        self.lock = threading.Lock()
        self.live = Live()
        self._history = [State()]
        self._read = lru_cache(RECORDINGS_CACHED)(lambda *key: tried(lambda: command_line.read(*key)))
        self._identified = lru_cache(CACHED)(self._identify)
        self._planned = lru_cache(CACHED)(self._plan)
        self._rendered = lru_cache(CACHED)(self._render)
        self._compared = lru_cache(RECORDINGS_CACHED)(self._compare)
        self.column_names = lru_cache(CACHED)(self._column_names)

    @property
    def state(self) -> State:
        """Present state."""
        return self._history[-1]

    @property
    def can_undo(self) -> bool:
        """True if there is an earlier state."""
        return len(self._history) > 1

    def undo(self) -> None:
        """Returns to the previous state."""
        if self.can_undo:
            self._history.pop()

    def become(self, state: State) -> None:
        """Adds a state to the history, unless it is the present one."""
        if state != self.state:
            self._history.append(state)

    @property
    def entry(self) -> Entry:
        """The recording that is shown.

        Raises
        ------
        InputError
            There is none.
        """
        if self.state.entry is None:
            raise InputError("there is no recording yet: drop a file on the page")
        return self.state.entry

    def change(self, **fields: Any) -> None:
        """Changes fields of the recording that is shown."""
        self.become(self.state.with_entry(replace(self.entry, **fields)))

    def add_file(self, name: str, content: bytes) -> None:
        """Stores a file in the folder and shows it; a profile becomes the device.

        A file with a name that is in use gets a number, unless its content is the same.
        """
        plain = Path(name.replace("\\", "/")).name.lstrip(".-") or "recording.csv"
        path = self.folder / plain
        if path.exists() and path.read_bytes() != content:
            taken = {each.name for each in self.folder.iterdir()}
            plain = free_name(path.stem, path.suffix, taken)
            path = self.folder / plain
        path.write_bytes(content)
        if path.suffix.lower() == ".toml":
            try:
                DeviceProfile.load(plain)
            except InputError:
                path.unlink()
                raise
            self.change(device=plain, changes=(), plan_options=())
        else:
            known = {each.file: each for each in self.state.entries}
            self.become(self.state.with_entry(known.get(plain, Entry(plain))))

    def recording(self, entry: Entry) -> Recording | Refusal:
        """Returns the recording of an entry with the options that read it."""
        found: Recording | Refusal = self._read(entry.file, self._reading(entry))
        return found

    def whole(self, entry: Entry) -> Recording | Refusal:
        """Returns the recording of an entry with all rows of its file, also those that the user left out."""
        kept = tuple(each for each in self._reading(entry) if each[0] not in ("--rows", "--leave-out"))
        found: Recording | Refusal = self._read(entry.file, kept)
        return found

    def _reading(self, entry: Entry) -> tuple[Option, ...]:
        return tuple(each for each in entry.options if each[0] in self.command_line.reading)

    def used(self, entry: Entry, whole: Recording) -> NDArray[np.bool_]:
        """Returns True (n,) for the rows of a whole recording that the user has not left out."""
        used = np.ones(len(whole), dtype=np.bool_)
        for flag, *values in entry.options:
            if flag in ("--rows", "--leave-out"):
                start, _, stop = values[0].partition(":")
                inside = np.zeros_like(used)
                inside[int(start or 0) : int(stop or len(used))] = True
                used &= inside if flag == "--rows" else ~inside
        return used

    def model(self, entry: Entry) -> Model | Refusal | None:
        """Returns the model of an entry; None if it is not wanted."""
        return self._identified(entry.file, entry.options) if entry.identified else None

    def _identify(self, file: str, options: tuple[Option, ...]) -> Model | Refusal:
        entry = Entry(file, options)
        recording = self.recording(entry)
        if isinstance(recording, Refusal):
            return recording
        found: Model | Refusal = tried(lambda: self.command_line.model_of(recording, file, options))
        return found

    def device(self, entry: Entry) -> DeviceProfile:
        """Returns the device profile of an entry with the fields that the user changed.

        Raises
        ------
        InputError
            A field has an impossible value.
        """
        profile = DeviceProfile.load(profile_file(entry.device))
        if not entry.changes:
            return profile
        fields = {**profile.to_dict(), **dict(entry.changes), "id": Path(entry.profile).stem}
        try:
            return DeviceProfile(**fields)
        except (ValueError, TypeError) as error:
            raise InputError(str(error)) from None

    def plan(self, entry: Entry) -> Plan | Refusal | None:
        """Returns the plan of an entry; None without a model or a device."""
        if not entry.identified or not entry.device:
            return None
        return self._planned(entry)

    def _plan(self, entry: Entry) -> Plan | Refusal:
        model = self.model(entry)
        if not isinstance(model, Model):
            return model or Refusal("there is no model")
        found: Plan | Refusal = tried(
            lambda: self.command_line.plan_of(
                model, f"{entry.stem}.json", self.device(entry), entry.plan_options
            )
        )
        return found

    def rendering(self, entry: Entry) -> Rendering | Refusal | None:
        """Returns the plan rendered on a simulated device with a simulated hand; None if it is not wanted."""
        return self._rendered(entry) if entry.played and isinstance(self.plan(entry), Plan) else None

    def _render(self, entry: Entry) -> Rendering | Refusal:
        plan, recording = self.plan(entry), self.recording(entry)
        assert isinstance(plan, Plan)
        assert isinstance(recording, Recording)
        found = replace(Subject.of(plan.model), plan=plan).rendering
        return Refusal(found) if isinstance(found, str) else found

    def start(self, device: str) -> None:
        """Starts a device with the model that is shown; palpate-control checks the certificate.

        Raises
        ------
        InputError
            There is no plan, the program is not installed, or a device is running.
        """
        entry = self.entry
        if not isinstance(self.plan(entry), Plan):
            raise InputError("there is no plan yet: choose a device profile")
        if device.startswith("-"):
            raise InputError(f"device is {device!r}: must be the name of a device")
        self.saved_model(entry)
        self.live.start(self.live_command(entry, device))

    @staticmethod
    def live_command(entry: Entry, device: str) -> list[str]:
        """Returns the command that renders the model of an entry on a device."""
        record = ["--record", f"{entry.stem}-felt.csv", "--force"]
        return [PROGRAM, f"{entry.stem}.json", "--device", device, "--duration-s", f"{RUN_S:g}", *record]

    def compared(self, entry: Entry) -> Compared | Refusal | None:
        """Returns the rows of the recording compared with the model; None without both."""
        return self._compared(Entry(entry.file, entry.options, entry.identified))

    def _compare(self, entry: Entry) -> Compared | Refusal | None:
        model, recording = self.model(entry), self.recording(entry)
        if not isinstance(model, Model) or not isinstance(recording, Recording):
            return None
        found: Compared | Refusal = tried(lambda: Compared.of(Subject.of(model).compared_with(recording)))
        return found

    def curves(self, file: str) -> Curves | None:
        """Returns the curves of the object of a recording; None if it has no model with curves."""
        for entry in self.state.entries:
            if entry.file == file and isinstance(model := self.model(entry), Model) and one_curve(model):
                return Curves.of(model)
        return None

    def similar(self, entry: Entry) -> list[tuple[str, float, float]]:
        """Returns the other objects that can be compared, the most similar first.

        Each has its name, the largest difference of the force [JND], and the share of the travel on which a
        hand feels the difference.
        """
        model, found = self.model(entry), list[tuple[str, float, float]]()
        if not isinstance(model, Model):
            return []
        for each in self.state.entries:
            other = self.model(each)
            if each.file != entry.file and isinstance(other, Model):
                strokes = tried(partial(compare, model, other))
                if not isinstance(strokes, Refusal):
                    share = max(stroke.noticed_share for stroke in strokes)
                    found.append((each.file, max(stroke.worst for stroke in strokes), share))
        return sorted(found, key=lambda each: (each[2], each[1]))

    def _column_names(self, entry: Entry) -> list[str]:
        """Returns the columns of the file, in order, also if the recording is refused."""
        recording = self.recording(entry)
        try:
            return list(open_table(self.folder / entry.file).names)
        except (InputError, OSError):
            if isinstance(recording, Refusal):
                return []
            return [*recording.source.columns.values(), *recording.columns]

    def saved_model(self, entry: Entry) -> Path:
        """Writes the model of an entry, with its plan if that may be stored, and returns its file.

        Raises
        ------
        InputError
            There is no model, or the plan was refused.
        """
        model, plan = self.model(entry), self.plan(entry)
        if not isinstance(model, Model):
            raise InputError(model.sentence if model else "there is no model yet: identify one")
        target = self.folder / f"{entry.stem}.json"
        if isinstance(plan, Refusal):
            raise InputError(plan.sentence)
        (model if plan is None else plan.stored()).save(target)
        return target

    def exported(self, kind: str) -> File:
        """Returns a file that the page downloads: model, report, header, profile or recording.

        Raises
        ------
        InputError
            The file cannot be made; the message names the reason and the cure.
        """
        entry = self.entry
        if kind == "profile":
            target = self.folder / entry.profile
            self.device(entry).save(target)
        elif kind in ("recording", "felt"):
            target = self.folder / (entry.file if kind == "recording" else f"{entry.stem}-felt.csv")
        else:
            target = self.saved_model(entry)
            if kind == "report":
                recording = self.recording(entry)
                assert isinstance(recording, Recording)
                subject = Subject.of(Path(target.name)).compared_with(recording)
                target = report_of(subject).write(self.folder / f"{entry.stem}.html")
            elif kind == "header":
                model_file, target = Path(target.name), Path(f"{entry.stem}.h")
                plan = self.plan(entry)
                uncertified = isinstance(plan, Plan) and not plan.is_proved
                written = write_c_header(Request(target, model_file, uncertified=uncertified))
                if written.verdict.level == "no":
                    raise InputError(written.verdict.reasons[0])
        return File(target.name, target.read_bytes())

    def act(self, action: str, given: Mapping[str, Any]) -> None:
        """Changes the state by an action of the page, with the values of its form.

        Raises
        ------
        InputError
            There is no such action, or a value cannot be used.
        """
        if action not in ACTIONS:
            raise InputError(f"there is no action {action!r}")
        ACTIONS[action](self, given)

    def set_options(self, options: Sequence[Option]) -> None:
        """Adds options of `palpate identify`, or of `palpate plan` if only that has them."""
        entry = self.entry
        for option in options:
            if option[0] in self.command_line.identify:
                entry = replace(entry, options=self.command_line.identify.with_option(entry.options, option))
            elif option[0] in self.command_line.plan:
                chosen = self.command_line.plan.with_option(entry.plan_options, option)
                entry = replace(entry, plan_options=chosen)
            else:
                raise InputError(f"{option[0]} is not an option of palpate identify or palpate plan")
        self.become(self.state.with_entry(entry))


def _cure(session: Session, given: Mapping[str, Any]) -> None:
    """Applies the options that a sentence advises."""
    words = [str(each) for each in given["words"]]
    for table in (session.command_line.identify, session.command_line.plan):
        options = table.parsed(words)
        if options and [word for each in options for word in each] == words:
            session.set_options(options)
            return
    raise InputError(f"{' '.join(words)} is not an option of palpate identify or palpate plan")


def _remove(session: Session, given: Mapping[str, Any]) -> None:
    """Removes one option."""
    option = tuple(str(each) for each in given["words"])
    entry = session.entry
    session.change(options=changed(entry.options, option), plan_options=changed(entry.plan_options, option))


def _columns(session: Session, given: Mapping[str, Any]) -> None:
    """Takes the columns and units that the user chose; an empty value leaves the choice to the program."""
    flags = ("--position", "--force", "--time", "--direction", "--units")
    options = tuple(each for each in session.entry.options if each[0] not in flags)
    table = session.command_line.identify
    for role in ("position", "force", "time", "direction"):
        if column := str(given.get(role, "")):
            options = table.with_option(options, (f"--{role}", column))
    for role in ("position", "force", "time"):
        unit, column = str(given.get(f"{role}_unit", "")), str(given.get(f"{role}_column", ""))
        if unit and (name := str(given.get(role, "")) or column):
            options = table.with_option(options, ("--units", f"{name}={unit}"))
    session.change(options=options)


def _number(given: Mapping[str, Any], name: str, what: str) -> float:
    text = str(given.get(name, "")).strip().replace(",", ".")
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{what} is {text!r}: must be a number; drag over the picture or type it")
    return value


def _mark_course(session: Session, given: Mapping[str, Any]) -> None:
    """Marks rows between two places on the course of the recording: use only, leave out, or zero force."""
    whole = session.whole(session.entry)
    if isinstance(whole, Refusal):
        raise InputError(whole.sentence)
    if len(whole) != whole.source.file_rows:
        raise InputError(
            f"{session.entry.file} has {whole.source.file_rows - len(whole)} rows that cannot be used, so "
            "its rows cannot be marked: correct the file"
        )
    _, at = course_axis(whole)
    ends = sorted((_number(given, "from", "from"), _number(given, "to", "to")))
    first, last = int(np.searchsorted(at, ends[0])), int(np.searchsorted(at, ends[1], side="right"))
    if first >= last:
        raise InputError(
            f"there is no row from {ends[0]:g} to {ends[1]:g}: the recording is from {at[0]:g} to {at[-1]:g}"
        )
    session.set_options([(f"--{given['kind']}", f"{first}:{last}")])


def _mark_curve(session: Session, given: Mapping[str, Any]) -> None:
    """Marks a place or an interval of positions: one period, or the contact at which the force is zero."""
    recording = session.recording(session.entry)
    if isinstance(recording, Refusal):
        raise InputError(recording.sentence)
    unit = Axes.of(recording).unit("position")
    first = _number(given, "from", "from")
    if given["kind"] == "period":
        length = abs(_number(given, "to", "to") - first)
        session.set_options([("--period", f"{length:.6g}{unit.symbol}")])
    else:
        session.set_options([("--fixed-force", repr(first * unit.factor), "0")])


def _device(session: Session, given: Mapping[str, Any]) -> None:
    """Chooses a device profile; its changed fields are those of the file again."""
    name = str(given["device"])
    if name:
        DeviceProfile.load(profile_file(name))
    session.change(device=name, changes=(), plan_options=(), played=False)


def _change_device(session: Session, given: Mapping[str, Any]) -> None:
    """Changes one field of the device profile."""
    field, value = str(given["field"]), _number(given, "value", str(given["field"]))
    if field == "rate_hz" and value > 0.0:
        field, value = "period_s", 1.0 / value
    changed_entry = with_change(replace(session.entry, played=False), {field: value})
    session.device(changed_entry)
    session.become(session.state.with_entry(changed_entry))


def _edit(session: Session, given: Mapping[str, Any]) -> None:
    """Makes an edited object from the numbers of the form, as a recording that is shown and identified."""
    entry, model, recording = session.entry, session.model(session.entry), session.recording(session.entry)
    if not isinstance(model, Model) or isinstance(recording, Refusal):
        raise InputError("there is no model to edit yet: identify one")
    curves = Curves.of(model)
    now = curves.numbers()
    wanted, changes = dict[str, float](), list[str]()
    for name in editable(curves):
        unit = Axes.of(recording).unit(now[name][1])
        before, after = unit.text(now[name][0]), f"{_number(given, name, name):.4g} {unit.shown}".rstrip()
        if after != before:
            wanted[name] = _number(given, name, name) * unit.factor
            changes.append(f"{name} {after} in place of {before}")
    if given.get(HYSTERESIS):
        wanted[HYSTERESIS] = _number(given, HYSTERESIS, HYSTERESIS) / 100.0
        if wanted[HYSTERESIS] != 1.0:
            changes.append(f"hysteresis {100.0 * wanted[HYSTERESIS]:g} % of the former one")
    if not changes:
        raise InputError("no number was changed: change one, then make the edited object")
    result = edited(curves, wanted)
    name = free_name(f"{entry.stem}-edited", ".csv", {each.name for each in session.folder.iterdir()})
    units = {role: recording.file_unit(role) for role in ("position", "force")}
    write_recording(recording_of(result, model, ", ".join(changes)), units, session.folder / name)
    options = () if model.period is None else (("--period", repr(float(np.ptp(result.position)))),)
    made = Entry(
        name, options, identified=True, device=entry.device, changes=entry.changes, origin=entry.file
    )
    session.become(session.state.with_entry(made))


def _show(session: Session, given: Mapping[str, Any]) -> None:
    """Shows another recording."""
    for number, each in enumerate(session.state.entries):
        if each.file == given["file"]:
            session.become(replace(session.state, current=number))


ACTIONS: dict[str, Callable[[Session, Mapping[str, Any]], None]] = {
    "refresh": lambda session, given: None,
    "undo": lambda session, given: session.undo(),
    "show": _show,
    "forget": lambda session, given: session.become(session.state.without(str(given["file"]))),
    "columns": _columns,
    "cure": _cure,
    "remove": _remove,
    "mark-course": _mark_course,
    "mark-curve": _mark_curve,
    "identify": lambda session, given: session.change(identified=True),
    "device": _device,
    "change-device": _change_device,
    "edit": _edit,
    "play": lambda session, given: session.change(played=True),
}
"""Actions of the page by name"""
