# SPDX-License-Identifier: Apache-2.0
"""Choice of position, force and time columns by five rules. A refusal names all problems and one cure."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ..errors import InputError, command_word, did_you_mean, listed, nearest_name, shortened
from .looks import NO_LOOK, Look
from .rows import direction_of
from .units import (
    CLOCK,
    FORCE_UNITS,
    POSITION_UNITS,
    TIME_UNITS,
    UNITS,
    Unit,
    parse_name,
    quantity_of,
    stem_key,
    unit_of,
)


@dataclass(frozen=True)
class Role:
    """Role of a column in a recording (position, force or time), with its units and usual names."""

    name: str
    si_units: tuple[str, ...]
    preferred_stems: tuple[str, ...]
    """Column names (without unit) to prefer, in this order, if several columns could have the role."""
    examples: str
    """Some of its units, for messages"""


POSITION = Role(
    "position",
    POSITION_UNITS,
    ("position", "displacement", "depth", "angle", "indentation", "tip_position", "height"),
    "mm, in or deg",
)
FORCE = Role(
    "force", FORCE_UNITS, ("force", "torque", "normal_force", "hold_current", "current"), "N, gf or N*m"
)
TIME = Role("time", TIME_UNITS, ("time", "timestamp", "t"), "s or ms")
ROLES = (POSITION, FORCE, TIME)

LAWS = (("m", "N"), ("rad", "N*m"))
"""SI units of position and force between which an object has a law. A count or a current can be
either."""

OF_BOTH_STROKES = "of press and release"
"""End of a problem with a table that has press and release side by side"""

DIRECTION_NAMES = ("direction", "segment", "richtung", "sens", "stroke")
"""Names of columns, in lower case, that can state the direction of the stroke in another way than by words
that palpate knows."""

_NOT_MEASURED = re.compile(
    r"(^|_)(cmd|command(ed)?|target|set|setpoint|desired|ref|reference|demand|soll|filt(ered)?|peak|max|mean|avg)"
    r"(_|$)"
)
"""Words of a column that holds what a controller requires, or a value of several rows, such as a filtered and
therefore late copy or the largest one so far, not what was measured."""

_EPOCH_S = (946_684_800.0, 4_102_444_800.0)
"""Seconds from 1970 to 2000 and to 2100. Times since 1970 between both have only one plausible unit."""

_USUAL_UNITS = {"m": ("mm", "m", "um"), "rad": ("rad", "deg"), "N*m": ("Nm",)}
"""Units that a message suggests, by the SI unit."""

_USUAL_TRAVELS = {"m": (1e-4, 0.5), "rad": (0.0, 4.0 * math.pi)}
"""Travels by which a message chooses among the usual units."""

UNIT_TO_FILL_IN = "UNIT"
"""Word in a suggested option that the user replaces: palpate never guesses a unit against a column name."""

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
    stated: str = ""
    """Text in the place of a unit in the name that is not read as one"""
    look: Look = NO_LOOK

    @property
    def named(self) -> set[str] | None:
        """SI units of the quantity that the name states, or None."""
        return quantity_of(self.stem)


@dataclass(frozen=True)
class Choice:
    """Columns chosen for position, force, time and direction, and sentences that state the reasons."""

    position: Column
    force: Column
    time: Column | None
    direction: str | None
    inputs: tuple[Column, ...]
    notes: tuple[str, ...] = field(default=())
    unread_time: str = ""
    """Sentence on a column of times that is not read, with the cure; empty if there is none"""


@dataclass(frozen=True)
class _Request:
    """Columns and units that the caller states, or that an error message suggests."""

    roles: Mapping[str, str | None]
    direction: str | None
    inputs: tuple[str, ...]
    units: Mapping[str, str]
    looks: Mapping[str, Look]


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
    looks: Mapping[str, Look] | None = None,
) -> Choice:
    """Chooses the columns of a recording by their names and units.

    The rules for position and force apply in this order: (1) A named column wins. (2) Columns between whose
    units no object has a law are left out. (3) If one stem occurs in several units, the SI unit wins over a
    converted one, and both win over counts. (4) A single candidate is chosen. (5) The first stem of the
    role's list that only one candidate has is chosen. (6) The file is refused. The message names all problems
    and one set of options that solves them. Time follows the same rules, but is optional.

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
    looks : mapping of str to Look, optional
        First rows of the columns.

    Raises
    ------
    InputError
        A named column or unit does not exist, or no rule chooses.
    """
    roles = {"position": position, "force": force, "time": time}
    request = _Request(roles, direction, tuple(inputs), dict(units or {}), dict(looks or {}))
    choice, problems = _attempt(names, request, unstated)
    if choice is None:
        message = "; ".join(problems.values())
        if "no column" in message:
            message += f". The columns are {listed(names)}"
        raise InputError(f"{file}: {message}{_cure(names, request, unstated, problems)}")
    if choice.time is not None or (time_column := _unread_time(names, request)) is None:
        return choice
    reason = f"holds {time_column.look.example!r}" if time_column.look.text else "has no known unit"
    cure = _time_options(time_column)
    condition = "if it is in s, add" if not time_column.stated else f"replace {UNIT_TO_FILL_IN} and add"
    return replace(
        choice,
        unread_time=f"column {shortened(time_column.name)} {reason} and is not read as time, so damping and "
        "memory are not tested" + ("" if time_column.look.text else f"; {condition}: {' '.join(cure)}"),
    )


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
    lawful = _lawful(columns, request.roles)
    for role in ROLES:
        if role.name not in problems:
            chosen[role.name] = _choose(role, lawful, request.roles[role.name], unstated, notes, problems)
    position_column, force_column = chosen.get("position"), chosen.get("force")
    if position_column is not None and force_column is not None and position_column.name == force_column.name:
        both = f"column {shortened(force_column.name)} cannot be both the position and the force"
        problems.setdefault("force", both)
    elif (
        position_column is not None
        and force_column is not None
        and not _is_law(position_column, force_column)
    ):
        problems["law"] = (
            f"{shortened(position_column.name)} and {shortened(force_column.name)}: a force needs a position "
            "in m or mm, and a torque an angle; multiply the force by its lever arm, or use other columns"
        )
    if problems or position_column is None or force_column is None:
        return None, problems
    notes += _unit_notes(each for each in chosen.values() if each is not None)
    direction = request.direction or _direction(columns, notes)
    return Choice(
        position=position_column,
        force=force_column,
        time=chosen["time"],
        direction=direction,
        inputs=tuple(next(column for column in columns if column.name == name) for name in request.inputs),
        notes=tuple(notes),
    ), {}


def _direction(columns: Sequence[Column], notes: list[str]) -> str | None:
    """Returns the column of the direction: one called so, or one whose words state both directions.

    Where nothing is known of the cells, as in a frame, the name alone decides.
    """
    for column in columns:
        name, look = column.name.lower(), column.look
        has_both = {1, -1} <= look.directions and (look.text or name in DIRECTION_NAMES)
        may_hold = not look.seen or (look.directions and (look.text or name == "direction"))
        if has_both or column.name == "direction" or (may_hold and name in DIRECTION_NAMES[:2]):
            return column.name
    for column in columns:
        if column.look.example and column.name.lower() in DIRECTION_NAMES:
            notes.append(
                f"{column.name} holds {column.look.example!r} and is not read; if it is a direction of the "
                "stroke, replace its words by press and release"
            )
    return None


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
        look = request.looks.get(name, NO_LOOK)
        parts = parse_name(name)
        unit = stated.get(name) or (CLOCK if look.clock else parts.unit or _epoch_unit(parts.stem, look))
        if name.endswith("_in") and name not in stated and f"{parts.stem}_out" in names:
            parts, unit = replace(parts, stem=name), None  # the ending "_in" means input, not inches
        columns.append(Column(name, parts.stem, unit, parts.stated, look))
    if any(each.unit is not None and each.unit.si in FORCE_UNITS for each in columns):
        return columns
    return [replace(each, unit=each.unit or _weight(each)) for each in columns]


def _weight(column: Column) -> Unit | None:
    """Returns the unit of the weight if a column shows the mass on a scale: it is in the place of a unit, and
    no other column has a unit of force; else None."""
    unit = unit_of(column.stated) if column.named is None else None
    return unit if unit is not None and unit.si == "N" else None


def _epoch_unit(stem: str, look: Look) -> Unit | None:
    """Returns the unit of a column of times since 1970 whose name states none; None for other columns."""
    first, last = _EPOCH_S
    if "s" in (quantity_of(stem) or ()):
        for symbol in ("s", "ms", "us", "ns"):
            factor = UNITS[symbol].factor
            if first <= look.least * factor and look.largest * factor <= last:
                return UNITS[symbol]
    return None


def _lawful(columns: Sequence[Column], roles: Mapping[str, str | None]) -> list[Column]:
    """Returns the columns without those that have no law with any candidate of the other role.

    Columns that the caller names stay.
    """
    named = set(roles.values())
    of_role = {
        role: [each for each in columns if each.name == roles[role.name]]
        or [each for each in columns if each.unit is not None and each.unit.si in role.si_units]
        for role in (POSITION, FORCE)
    }
    pairs = [(one, other) for one in of_role[POSITION] for other in of_role[FORCE] if _is_law(one, other)]
    if not pairs:
        return list(columns)
    pairs = [pair for pair in pairs if _units_of(*pair) in LAWS] or pairs
    candidates = {each.name for role in of_role.values() for each in role}
    kept = {each.name for pair in pairs for each in pair} | named
    return [each for each in columns if each.name in kept or each.name not in candidates]


def _is_law(position: Column, force: Column) -> bool:
    """Returns False if no object has a law between the units of two columns; True if one is not known."""
    of_position, of_force = _units_of(position, force)
    return of_position in ("", "count") or of_force in ("", "A") or (of_position, of_force) in LAWS


def _units_of(position: Column, force: Column) -> tuple[str, str]:
    return position.unit.si if position.unit else "", force.unit.si if force.unit else ""


def _unit_notes(columns: Iterable[Column]) -> list[str]:
    """Returns a sentence for each column that is read in another unit than its name states literally."""
    notes = []
    for column in columns:
        named, read = parse_name(column.name).unit, column.unit
        if read is None or (named is None and not column.stated):
            continue
        if named is not None and named != read:
            notes.append(f"{column.name} is read in {read.symbol}, although its name states {named.symbol}")
        elif read.symbol not in column.name.replace("·", "*") and read.si == "N":
            notes.append(f"{column.name} is read in {read.symbol}")
    return notes


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
    if role is TIME:
        numbers = [each for each in candidates if each.unit is not CLOCK]
        candidates = numbers or [each for each in candidates if not each.look.steady]
    if not candidates:
        if role is not TIME:
            problems[role.name] = f"no column name has a unit of {role.name} such as {role.examples}"
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
    if [_way(name) for name in found] in ([1, -1], [-1, 1]):
        problems[role.name] = f"{listed(found)} are the {role.name} {OF_BOTH_STROKES}"
        return None
    problems[role.name] = (
        f"{_NUMBER_WORDS.get(count, count)} columns could be the {role.name} ({listed(found)})"
    )
    return None


def _way(name: str) -> int | None:
    """Returns the direction that one word of a name states; None without such a word."""
    return next(filter(None, map(direction_of, re.findall(r"[^\W\d_]+", name))), None)


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
    if column.unit is None:
        problems[role.name] = f"column {shortened(column.name)} has no known unit such as {role.examples}"
    elif column.unit.si not in role.si_units:
        problems[role.name] = (
            f"column {shortened(column.name)} is in {column.unit.symbol}, "
            f"which is not a unit of {role.name} such as {role.examples}"
        )


def _cure(
    names: Sequence[str], request: _Request, unstated: Collection[str], problems: Mapping[str, str]
) -> str:
    """Returns the options that make a refused file readable, after checking that they choose all columns.

    A unit is assumed only for a column whose name states none. Where a name states something that is not a
    unit of the role, the user fills in the unit.
    """
    if any(text.endswith(OF_BOTH_STROKES) for text in problems.values()):
        return (
            ". Write the rows of the release below those of the press, with the words press and release in a "
            "column direction"
        )
    no_cure = ". A recording needs two columns of numbers, a position and a force"
    roles, units, direction = dict(request.roles), dict(request.units), request.direction
    inputs = tuple(name for name in request.inputs if name in names)
    assumed: list[str] = []
    added: list[str] = []
    if any(f"units {key}" in problems and key in names for key in units):
        return ""  # the user names a unit that is not known, and the message lists the known ones
    units = {key: unit for key, unit in units.items() if f"units {key}" not in problems}
    if "direction" in problems:
        direction = next(iter(difflib.get_close_matches(str(direction), names, 1, 0.0)), None)
        added.append(f"--direction {command_word(str(direction))}")
    columns = _with_units(names, replace(request, units=units), {})
    fill_in = False
    for role in (role for role in ROLES if role.name in problems):
        others = {name for other, name in roles.items() if other != role.name}
        named_column = roles[role.name]
        candidates = [
            each
            for each in columns
            if each.name not in others
            and each.name.lower() not in DIRECTION_NAMES[:2]
            and (not each.look.text or each.unit is CLOCK)
        ]
        wanted = None if named_column is None else nearest_name(named_column, names)
        suggestion = next((each for each in candidates if each.name in (named_column, wanted)), None)
        if suggestion is None or (named_column in names and "known unit" not in problems[role.name]):
            suggestion = _suggested(role, candidates)
        if suggestion is None:
            return no_cure
        if suggestion.name != named_column:
            added.append(f"--{role.name} {command_word(suggestion.name)}")
        roles[role.name] = suggestion.name
        if role.name not in units and (suggestion.unit is None or suggestion.unit.si not in role.si_units):
            with_unit = {each.name: each.unit.si for each in columns if each.unit is not None}
            chosen = [si for name, si in with_unit.items() if name in roles.values()]
            chosen += [UNITS[each].si for each in units.values()]
            unit = _likely_unit(role, suggestion, chosen, with_unit.values())
            units[suggestion.name] = unit
            is_unknown = bool(suggestion.stated) and not _states_unit_of(role, suggestion)
            shown = UNIT_TO_FILL_IN if is_unknown else unit
            fill_in = fill_in or is_unknown
            added.append(f"--units {command_word(f'{suggestion.name}={shown}')}")
            if not suggestion.stated:
                assumed.append(f"{shortened(suggestion.name)} is in {unit}")
    request = _Request(roles, direction, inputs, units, request.looks)
    choice, _ = _attempt(names, request, unstated)
    time_column = None if choice is None or choice.time is not None else _unread_time(names, request)
    if time_column is not None and not time_column.look.text and not time_column.stated:
        added += _time_options(time_column)
        assumed.append(f"{shortened(time_column.name)} is in s")
    options = " ".join(added)
    if choice is None or not added or len(options) > LONGEST_CURE:
        return "" if "law" in problems else no_cure
    condition = f"If {' and '.join(assumed)}, add" if assumed else "For example, add"
    if fill_in:
        condition += f", with the unit in place of {UNIT_TO_FILL_IN}"
    return f". {condition}: {options}"


def _likely_unit(role: Role, column: Column, *known: Collection[str]) -> str:
    """Returns the unit that a message suggests for a column whose name states no unit.

    `known` holds the SI units of the chosen columns, then those of all columns.
    """
    named, travel = column.named, column.look.largest - column.look.least
    possible = [si for si in role.si_units if named is None or si in named] or list(role.si_units)
    for text in (column.stated, re.split(r"[_\s]", column.name)[-1]):
        if (unit := unit_of(text)) is not None and unit.si in possible and unit.symbol.startswith(text):
            return unit.symbol
    likely = next(
        (si for units in known for si in possible if any({si, other} in map(set, LAWS) for other in units)),
        possible[0],
    )
    units = _USUAL_UNITS.get(likely, (likely,))
    low, high = _USUAL_TRAVELS.get(likely, (0.0, math.inf))
    return next((unit for unit in units if low <= travel * UNITS[unit].factor <= high), units[0])


def _unread_time(names: Sequence[str], request: _Request) -> Column | None:
    """Returns a column that is probably a time but has no known unit, and is therefore not used as time.

    Its name is that of a time, or names no quantity while its values rise in every row by more than a count.
    """
    used = {*request.roles.values(), *request.inputs}
    columns = _with_units(names, request, {})
    unread = [
        each for each in columns if each.unit is None and each.name not in used and not each.look.steady
    ]
    rising = (each for each in unread if each.named is None and each.look.rises and not each.look.counter)
    return next((each for each in unread if "s" in (each.named or ())), next(rising, None))


def _time_options(column: Column) -> list[str]:
    unit = UNIT_TO_FILL_IN if column.stated else "s"
    return [f"--time {command_word(column.name)}", f"--units {command_word(f'{column.name}={unit}')}"]


def _states_unit_of(role: Role, column: Column) -> bool:
    """Returns True if the text in the place of a unit is one of the role."""
    unit = unit_of(column.stated)
    return unit is not None and unit.si in role.si_units


def _suggested(role: Role, columns: Sequence[Column]) -> Column | None:
    """Returns the column that an error message suggests: one with a unit of the role, else the likeliest.

    Columns that name another quantity, or state a unit of one, are never suggested.
    """

    def rank(column: Column) -> tuple[bool, ...]:
        return (
            not (column.unit is not None and column.unit.si in role.si_units),
            column.look.steady,
            column.look.counter,
            _NOT_MEASURED.search(stem_key(re.sub("(?<=[a-z])(?=[A-Z])", "_", column.stem))) is not None,
            column.named is None,
        )

    fitting = [
        column
        for column in columns
        if (
            column.unit.si in role.si_units
            if column.unit is not None
            else unit_of(column.stated) is None or _states_unit_of(role, column)
        )
        and (column.named is None or column.named & set(role.si_units))
    ]
    return min(fitting, key=rank, default=None)
