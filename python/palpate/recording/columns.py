# SPDX-License-Identifier: Apache-2.0
"""Choice of position, force and time columns by five rules. A refusal names all problems and one cure."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ..errors import InputError, command_word, did_you_mean, listed, nearest_name, shortened
from .units import (
    FORCE_UNITS,
    POSITION_UNITS,
    TIME_UNITS,
    UNITS,
    Unit,
    split_name,
    stem_key,
    symbols_of,
    unit_of,
)


@dataclass(frozen=True)
class Role:
    """Role of a column in a recording (position, force or time), with its units and usual names."""

    name: str
    si_units: tuple[str, ...]
    preferred_stems: tuple[str, ...]
    """Column names (without unit) to prefer, in this order, if several columns could have the role."""
    example: str
    """Unit in the option that an error message suggests for a column of unknown unit."""
    words: tuple[str, ...]
    """Parts of column names by which an error message suggests one of the columns without a unit."""


POSITION = Role(
    "position",
    POSITION_UNITS,
    ("position", "displacement", "depth", "angle", "indentation", "tip_position", "height"),
    "mm",
    ("pos", "disp", "depth", "angle", "indent", "height", "travel", "stroke", "compr", "exten", "deflec"),
)
FORCE = Role(
    "force",
    FORCE_UNITS,
    ("force", "torque", "normal_force", "hold_current", "current"),
    "N",
    ("force", "torque", "load", "current", "moment"),
)
TIME = Role("time", TIME_UNITS, ("time", "timestamp", "t"), "s", ("time",))
ROLES = (POSITION, FORCE, TIME)

DIRECTION_NAMES = ("direction", "segment")
"""Names of columns that are read as the direction of the stroke if the caller names no such column."""


_UNLIKELY_STEMS = (*TIME.preferred_stems, *DIRECTION_NAMES, "unnamed", "index", "sample", "id")
"""Stems of column names that an error message suggests as position or force only after all other columns."""

_LIKELY_UNITS = {"angle": "rad", "torque": "Nm", "moment": "Nm", "current": "A"}
"""Unit that an error message suggests for a column without a unit, by a part of the column's name."""

LONGEST_CURE = 1000
"""Largest length of the options that an error message suggests [characters].

Longer options are left out of the message.
"""

_NUMBER_WORDS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


@dataclass(frozen=True)
class Column:
    """Name of a column and the unit in which its values are read. None: text or numbers without a unit."""

    name: str
    stem: str
    unit: Unit | None


@dataclass(frozen=True)
class Choice:
    """Columns chosen for position, force, time and direction, and sentences that state the reasons."""

    position: Column
    force: Column
    time: Column | None
    direction: str | None
    inputs: tuple[Column, ...]
    notes: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class _Request:
    """Columns and units that the caller states, or that an error message suggests."""

    roles: Mapping[str, str | None]
    direction: str | None
    inputs: tuple[str, ...]
    units: Mapping[str, str]


def choose_columns(
    file: str,
    names: Sequence[str],
    *,
    position: str | None = None,
    force: str | None = None,
    time: str | None = None,
    direction: str | None = None,
    inputs: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    unstated: Collection[str] = (),
    text: Collection[str] = (),
    steady: Collection[str] = (),
) -> Choice:
    """Chooses the columns of a recording by their names alone.

    The rules for position and force apply in this order: (1) A named column wins. (2) If one stem occurs in
    several units, the SI unit wins over a converted one, and both win over counts. (3) A single candidate is
    chosen. (4) The first stem of the role's list that only one candidate has is chosen. (5) The file is
    refused. The message names all problems and one set of options that solves them. Time follows the same
    rules, but is optional.

    Parameters
    ----------
    file : str
        The file's name, for the sentences.
    names : sequence of str
        The header.
    position, force, time, direction, inputs
        Columns named by the caller.
    units : mapping of str to str, optional
        Units of columns, by column name or by the role ("position", "force", "time"); wins over the name.
    unstated : collection of str
        Columns that the file declares to be in SI without the unit.
    text : collection of str
        Columns that are known to hold text; a cure does not name them.
    steady : collection of str
        Columns with one or two values at the start of the file; a cure names them last.

    Raises
    ------
    InputError
        A named column or unit does not exist, or no rule chooses.
    """
    roles = {"position": position, "force": force, "time": time}
    request = _Request(roles, direction, tuple(inputs), dict(units or {}))
    choice, problems = _attempt(names, request, unstated)
    if choice is not None:
        unitless_time = None if choice.time is not None else _time_without_unit(names, request, text)
        if unitless_time is None:
            return choice
        added = " ".join(_time_options(unitless_time))
        note = f"column {shortened(unitless_time)} has no unit and is not used; if it is in s, add: {added}"
        return replace(choice, notes=(*choice.notes, note))
    message = "; ".join(problems.values())
    if "no column" in message:
        message += f". The columns are {listed(names)}"
    raise InputError(f"{file}: {message}{_cure(names, request, unstated, text, steady, problems)}")


def _attempt(
    names: Sequence[str], request: _Request, unstated: Collection[str]
) -> tuple[Choice | None, dict[str, str]]:
    """Returns the chosen columns, or the reasons of the refusal, by role (position) or option."""
    problems: dict[str, str] = {}
    options = [
        (f"--{role}", name) for role, name in (*request.roles.items(), ("direction", request.direction))
    ]
    for option, name in (*options, *(("inputs", name) for name in request.inputs)):
        if name is not None and name not in names:
            wrong = f"there is no column {shortened(name)!r} for {option}"
            problems[option.strip("-")] = wrong + did_you_mean(name, names)
    columns = _with_units(names, request, problems)
    notes: list[str] = []
    chosen: dict[str, Column | None] = {}
    for role in ROLES:
        if role.name not in problems:
            chosen[role.name] = _choose(role, columns, request.roles[role.name], unstated, notes, problems)
    position_column, force_column = chosen.get("position"), chosen.get("force")
    if position_column is not None and force_column is not None and position_column.name == force_column.name:
        both = f"column {shortened(force_column.name)} cannot be both the position and the force"
        problems.setdefault("force", both)
    if problems or position_column is None or force_column is None:
        return None, problems
    notes += _unit_notes(each for each in chosen.values() if each is not None)
    direction = request.direction or next((name for name in DIRECTION_NAMES if name in names), None)
    return Choice(
        position=position_column,
        force=force_column,
        time=chosen["time"],
        direction=direction,
        inputs=tuple(next(column for column in columns if column.name == name) for name in request.inputs),
        notes=tuple(notes),
    ), {}


def _with_units(names: Sequence[str], request: _Request, problems: dict[str, str]) -> list[Column]:
    """Returns every column with the unit that the caller states, else with the unit in its name."""
    stated: dict[str, Unit] = {}
    for key, symbol in request.units.items():
        column = key if key in names else request.roles.get(key)
        unit = unit_of(symbol)
        if column is None and key in request.roles:
            problems[key] = f"--units {key}={symbol} also needs --{key} NAME, which names its column"
        elif column is None:
            problems[f"units {key}"] = (
                f"there is no column {shortened(key)!r} for --units; leave out this option"
            )
        elif unit is None:
            problems[f"units {key}"] = (
                f"--units {key}={symbol}: {shortened(symbol)!r} is not a unit; use one of {', '.join(UNITS)}"
            )
        else:
            stated[column] = unit
    columns = []
    for name in names:
        stem, unit = split_name(name)
        if name.endswith("_in") and f"{stem}_out" in names:
            stem, unit = name, None  # the ending "_in" means input, not inches
        columns.append(Column(name, stem, stated.get(name, unit)))
    return columns


def _unit_notes(columns: Iterable[Column]) -> list[str]:
    """Returns a sentence for each column that is read in another unit than that in its name."""
    return [
        f"{column.name} is read in {column.unit.symbol}, although its name states {named.symbol}"
        for column in columns
        if column.unit is not None
        and (named := split_name(column.name)[1]) is not None
        and named != column.unit
        and column.stem != column.name
    ]


def _choose(
    role: Role,
    columns: Sequence[Column],
    named: str | None,
    unstated: Collection[str],
    notes: list[str],
    problems: dict[str, str],
) -> Column | None:
    if named is not None:
        column = next(column for column in columns if column.name == named)
        if column.unit is not None or named not in unstated:
            _require_unit(role, column, problems)
        return column
    candidates = [column for column in columns if column.unit is not None and column.unit.si in role.si_units]
    if not candidates:
        if role is not TIME:
            problems[role.name] = f"no column name has a unit of {role.name} ({symbols_of(role.si_units)})"
        return None
    best = _best(candidates, notes)
    if len(best) == 1 and len(best[0]) == 1:
        return best[0][0]
    for stem in role.preferred_stems:
        alone = [group[0] for group in best if stem_key(group[0].stem) == stem and len(group) == 1]
        if alone:
            others = listed(column.name for column in candidates if stem_key(column.stem) != stem)
            notes.append(f"{alone[0].name} is preferred by its name to {others}")
            return alone[0]
    found = [column.name for group in best for column in group]
    count = len(found)
    problems[role.name] = (
        f"{_NUMBER_WORDS.get(count, count)} columns could be the {role.name} ({listed(found)})"
    )
    return None


def _best(candidates: Sequence[Column], notes: list[str]) -> list[list[Column]]:
    """Returns the candidate columns by stem; of names that differ only in the unit, those nearest to SI."""
    by_stem: dict[str, list[Column]] = {}
    for column in candidates:
        by_stem.setdefault(stem_key(column.stem), []).append(column)
    return [_prefer_si(same_stem, notes) for same_stem in by_stem.values()]


def _prefer_si(same_stem: list[Column], notes: list[str]) -> list[Column]:
    """Returns, of columns whose names differ only in the unit, those in SI, else those not in counts."""

    def distance_from_si(column: Column) -> int:
        assert column.unit is not None, "candidates have units"
        if column.unit.si == "count":
            return 2
        return 0 if column.unit.factor == 1.0 else 1

    nearest = min(map(distance_from_si, same_stem))
    kept = [column for column in same_stem if distance_from_si(column) == nearest]
    if len(kept) == 1 < len(same_stem):
        others = listed(column.name for column in same_stem if column is not kept[0])
        notes.append(f"{kept[0].name} is used in place of {others} (SI units are preferred)")
    return kept


def _require_unit(role: Role, column: Column, problems: dict[str, str]) -> None:
    allowed = symbols_of(role.si_units)
    if column.unit is None:
        problems[role.name] = f"column {shortened(column.name)} has no known unit ({allowed})"
    elif column.unit.si not in role.si_units:
        problems[role.name] = (
            f"column {shortened(column.name)} is in {column.unit.symbol}, "
            f"which is not a unit of {role.name} ({allowed})"
        )


def _cure(
    names: Sequence[str],
    request: _Request,
    unstated: Collection[str],
    text: Collection[str],
    steady: Collection[str],
    problems: Mapping[str, str],
) -> str:
    """Returns the options that make a refused file readable, after checking that they choose all columns."""
    no_cure = ". A recording needs two columns of numbers, a position and a force"
    roles, units, direction = dict(request.roles), dict(request.units), request.direction
    inputs = tuple(name for name in request.inputs if name in names)
    assumed: list[str] = []
    added: list[str] = []
    for key in list(units):
        if f"units {key}" in problems and (key in names or key in roles):
            units[key] = difflib.get_close_matches(units[key], UNITS, 1, 0.0)[0]
            added.append(f"--units {command_word(f'{key}={units[key]}')}")
        elif f"units {key}" in problems:
            del units[key]
    if "direction" in problems:
        direction = next(iter(difflib.get_close_matches(str(direction), names, 1, 0.0)), None)
        added.append(f"--direction {command_word(str(direction))}")
    columns = _with_units(names, replace(request, units=units), {})
    for role in (role for role in ROLES if role.name in problems):
        others = {name for other, name in roles.items() if other != role.name}
        named_column = roles[role.name]
        if (
            named_column in names
            and named_column not in others
            and f"column {named_column} has no known unit" in problems[role.name]
        ):
            suggestion: Column | None = next(column for column in columns if column.name == named_column)
        else:
            left_out = {*others, *text, *DIRECTION_NAMES}
            candidates = [each for each in columns if each.name not in left_out]
            misspelt = None if named_column is None else nearest_name(named_column, names)
            suggestion = next((each for each in candidates if each.name == misspelt), None)
            suggestion = suggestion or _suggested(role, candidates, steady)
        if suggestion is None:
            return no_cure
        if suggestion.name != named_column:
            added.append(f"--{role.name} {command_word(suggestion.name)}")
        roles[role.name] = suggestion.name
        if role.name not in units and (suggestion.unit is None or suggestion.unit.si not in role.si_units):
            stem = stem_key(suggestion.stem)
            unit = next((unit for word, unit in _LIKELY_UNITS.items() if word in stem), role.example)
            units[suggestion.name] = unit if UNITS[unit].si in role.si_units else role.example
            added.append(f"--units {command_word(f'{suggestion.name}={units[suggestion.name]}')}")
            assumed.append(f"{shortened(suggestion.name)} is in {units[suggestion.name]}")
    choice, _ = _attempt(names, _Request(roles, direction, inputs, units), unstated)
    if (
        choice is not None
        and choice.time is None
        and (unitless_time := _time_without_unit(names, request, text))
    ):
        added += _time_options(unitless_time)
        assumed.append(f"{shortened(unitless_time)} is in s")
    options = " ".join(added)
    if choice is None or not added or len(options) > LONGEST_CURE:
        return no_cure
    condition = f"If {' and '.join(assumed)}, " if assumed else "For example, "
    return f". {condition}add: {options}"


def _time_without_unit(names: Sequence[str], request: _Request, text: Collection[str]) -> str | None:
    """Returns a column that has the name of a time but no unit, and is therefore not used as time."""
    used = {*request.roles.values(), *request.inputs, *text}
    times = (name for name in names if stem_key(name) in TIME.preferred_stems and name not in used)
    return next(times, None)


def _time_options(name: str) -> list[str]:
    return [f"--time {command_word(name)}", f"--units {command_word(f'{name}=s')}"]


def _suggested(role: Role, columns: Sequence[Column], steady: Collection[str]) -> Column | None:
    """Returns the column that an error message suggests: one with a unit of the role, else the likeliest."""
    fitting = [column for column in columns if column.unit is not None and column.unit.si in role.si_units]
    if fitting:
        return _best(fitting, [])[0][0]
    words_of_other_roles = [word for other in ROLES if other is not role for word in other.words]

    def rank(column: Column) -> tuple[bool, ...]:
        stem = stem_key(column.stem)
        return (
            stem not in role.preferred_stems,
            stem in _UNLIKELY_STEMS,
            column.name in steady,
            not any(word in stem for word in role.words),
            any(word in stem for word in words_of_other_roles),
        )

    return min((column for column in columns if column.unit is None), key=rank, default=None)
