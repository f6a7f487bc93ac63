# SPDX-License-Identifier: Apache-2.0
"""Which column is the position, which the force: five rules, and a sentence when they do not choose."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from ..errors import InputError
from .units import FORCE_UNITS, POSITION_UNITS, TIME_UNITS, UNITS, Unit, split_name, symbols_of


@dataclass(frozen=True)
class Role:
    """What a column can be chosen for."""

    name: str
    si_units: tuple[str, ...]
    preferred_stems: tuple[str, ...]
    """Stems that win, the first first, when several columns could take the role."""


POSITION = Role(
    "position",
    POSITION_UNITS,
    ("position", "displacement", "depth", "angle", "indentation", "tip_position", "height"),
)
FORCE = Role("force", FORCE_UNITS, ("force", "torque", "normal_force", "hold_current", "current"))
TIME = Role("time", TIME_UNITS, ("time", "timestamp", "t"))

DIRECTION_NAMES = ("direction", "segment")
"""Columns that are taken for the direction of the stroke when none is named."""


_NUMBER_WORDS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


@dataclass(frozen=True)
class Column:
    """A column with the unit it is read in (None: text or plain numbers)."""

    name: str
    stem: str
    unit: Unit | None


@dataclass(frozen=True)
class Choice:
    """The columns that were chosen, and why, in sentences."""

    position: Column
    force: Column
    time: Column | None
    direction: str | None
    inputs: tuple[Column, ...]
    notes: tuple[str, ...] = field(default=())


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
) -> Choice:
    """Choose the columns of a recording by their names alone.

    For position and force, in this order: (1) a named column wins; (2) where one stem stands in several
    units, the SI unit wins over a converted one, and both win over counts; (3) exactly one candidate is
    taken; (4) else the first stem of the role's list that is present; (5) else the file is refused, naming
    the candidates and the option. Time follows the same rules, but a file may have none.

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
        Columns that the file itself declares to be in SI without saying which unit.

    Raises
    ------
    InputError
        A named column or unit does not exist, or no rule chooses.
    """
    named = {"position": position, "force": force, "time": time}
    wanted = [(f"--{role}", name) for role, name in (*named.items(), ("direction", direction))]
    for option, value in (*wanted, *(("inputs", name) for name in inputs)):
        if value is not None and value not in names:
            raise InputError(
                f"{file} has no column {value!r} for {option}; its columns are {', '.join(names)}"
            )
    columns = _with_units(file, names, named, dict(units or {}))
    notes: list[str] = []
    the_position, the_force, the_time = (
        _choose(file, role, columns, named[role.name], unstated, notes) for role in (POSITION, FORCE, TIME)
    )
    if the_position is None:
        raise _nothing_found(file, POSITION, columns)
    if the_force is None:
        raise _nothing_found(file, FORCE, columns)
    if the_position.name == the_force.name:
        raise InputError(f"{file}: column {the_position.name} cannot be both the position and the force")
    if direction is None:
        direction = next((name for name in DIRECTION_NAMES if name in names), None)
    return Choice(
        position=the_position,
        force=the_force,
        time=the_time,
        direction=direction,
        inputs=tuple(next(column for column in columns if column.name == name) for name in inputs),
        notes=tuple(notes),
    )


def _with_units(
    file: str, names: Sequence[str], named: Mapping[str, str | None], units: dict[str, str]
) -> list[Column]:
    """Give every column the unit of its name, or the one the caller states."""
    stated: dict[str, str] = {}
    for key, symbol in units.items():
        column = key if key in names else named.get(key)
        if column is None and key in named:
            raise InputError(f"--units {key}={symbol} also needs --{key} NAME, which says what column it is")
        if column is None:
            raise InputError(f"{file} has no column {key!r} for --units; its columns are {', '.join(names)}")
        if symbol not in UNITS:
            raise InputError(f"--units {key}={symbol}: {symbol!r} is no unit; use one of {', '.join(UNITS)}")
        stated[column] = symbol
    columns = []
    for name in names:
        stem, unit = split_name(name)
        columns.append(Column(name, stem, UNITS[stated[name]] if name in stated else unit))
    return columns


def _choose(
    file: str,
    role: Role,
    columns: Sequence[Column],
    named: str | None,
    unstated: Collection[str],
    notes: list[str],
) -> Column | None:
    if named is not None:
        column = next(column for column in columns if column.name == named)
        if column.unit is not None or named not in unstated:
            _require_unit(file, role, column)
        return column
    candidates = [column for column in columns if column.unit is not None and column.unit.si in role.si_units]
    by_stem: dict[str, list[Column]] = {}
    for column in candidates:
        by_stem.setdefault(column.stem, []).append(column)
    best = [_prefer_si(same_stem, notes) for same_stem in by_stem.values()]
    if len(best) == 1 and len(best[0]) == 1:
        return best[0][0]
    for stem in role.preferred_stems:
        alone = [group[0] for group in best if group[0].stem == stem and len(group) == 1]
        if alone:
            others = ", ".join(column.name for column in candidates if column.stem != stem)
            notes.append(f"{alone[0].name} is preferred by its name to {others}")
            return alone[0]
    if not candidates:
        return None
    found = ", ".join(column.name for group in best for column in group)
    count = sum(map(len, best))
    raise InputError(
        f"{file}: {_NUMBER_WORDS.get(count, count)} columns could be the {role.name} ({found}); "
        f"choose with --{role.name} NAME"
    )


def _prefer_si(same_stem: list[Column], notes: list[str]) -> list[Column]:
    """Rule 2: among the columns of one stem keep those whose unit is nearest to SI."""

    def distance_from_si(column: Column) -> int:
        assert column.unit is not None, "candidates have units"
        if column.unit.si == "count":
            return 2
        return 0 if column.unit.factor == 1.0 else 1

    nearest = min(map(distance_from_si, same_stem))
    kept = [column for column in same_stem if distance_from_si(column) == nearest]
    if len(kept) == 1 < len(same_stem):
        others = ", ".join(column.name for column in same_stem if column is not kept[0])
        notes.append(f"{kept[0].name} is used in place of {others} (SI wins)")
    return kept


def _require_unit(file: str, role: Role, column: Column) -> None:
    allowed = symbols_of(role.si_units)
    if column.unit is None:
        raise InputError(
            f"{file}: column {column.name} has no known unit; "
            f"state it with --units {column.name}=UNIT (one of {allowed})"
        )
    if column.unit.si not in role.si_units:
        raise InputError(
            f"{file}: column {column.name} is in {column.unit.symbol}, which is no unit of {role.name} "
            f"({allowed}); choose another with --{role.name} NAME, or state its unit with --units"
        )


def _nothing_found(file: str, role: Role, columns: Sequence[Column]) -> InputError:
    names = ", ".join(column.name for column in columns)
    return InputError(
        f"{file}: no column name ends in a unit of {role.name} ({symbols_of(role.si_units)}) among {names}; "
        f"name one with --{role.name} NAME and state its unit with --units NAME=UNIT"
    )
