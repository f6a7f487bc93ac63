# SPDX-License-Identifier: Apache-2.0
"""Writes a model as one C header: tables, force law and structure, with its error bounds and its certificate.

The functions are those of model_template.h; this module adds the numbers. The template computes like
`ExportedForce` in cpp/include/palpate/portable/exported_force.hpp: the same operations on the same numbers in
the same order.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.resources import files

import numpy as np

from .._core.portable import CellTable, ExportedLine, ExportedMemory
from .exported import Exported
from .request import Request, Written
from .template import filled

EXPORT_VERSION = 1
"""Version of the functions and macros of the header."""

Literal = Callable[[float], str]
"""Writes a number as a literal of C."""

_WHOLE_COUNTS = 0.01
"""Largest difference of the counts of a revolution from a whole number."""

_WIDTH = 118
"""Largest width of a line of the header [characters]."""


def write(request: Request) -> Written:
    """Writes the C header of a model and returns its sizes and errors."""
    exported = Exported.of(request)
    text = header_text(exported)
    if exported.verdict.level != "no":
        request.write_text(text)
    model = exported.model
    tables = [model.law, *([] if model.response is None else [model.response])]
    return Written(
        exported.verdict,
        {
            "header": f"{request.output}: {exported.name}_step, {exported.name}_force and others",
            **exported.summary(),
            "tables": ", ".join(f"{table.cells} cells, {table.bytes} bytes" for table in tables),
            **exported.definitions(),
        },
        {
            **exported.record(),
            "bytes": sum(table.bytes for table in tables),
            "cells": [table.cells for table in tables],
        },
    )


def header_text(exported: Exported) -> str:
    """Returns the text of the C header of a model."""
    model = exported.model
    predicted = model.scheme.predict > 0
    between = predicted or model.massless
    template = files(__package__).joinpath("model_template.h").read_text(encoding="utf-8")
    parts = {
        "certified": exported.has_certificate,
        "single": model.single,
        "periodic": model.periodic,
        "hysteretic": model.hysteretic,
        "memory": model.memory is not None,
        "direct": not between and model.memory is None,
        "predicted": predicted,
        "massless": model.massless,
        "between": between and model.single,
        "stateless": not (between or model.hysteretic or model.memory is not None),
        "limited": not np.isinf(model.force_limit),
        "law_between": predicted,
        "response_between": True,
        "law_positions": True,
        "response_positions": not model.single,
    }
    tables = ["law", "response"] if model.massless else ["law"]
    numbers = _Numbers(exported)
    texts = {"constants": "\n".join(numbers.constants()), "tables": "\n".join(numbers.tables())}
    words = {
        "NAME": exported.name,
        " STRUCTURE ": f" {exported.structure} ",
        " RATE_HZ": f" {exported.rate_hz}",
        " PROFILE": f" {exported.profile:#010x}",
        " DEVICE": "" if exported.device is None else f" {_plain(exported.device.id)}",
    }
    text = filled(template, parts, {"tables": tables}, {name: f"//@ {name}" for name in texts})
    # One pass before the texts are inserted, so that no word in the name of a model or device is replaced
    text = re.sub("|".join(words), lambda found: words[found[0]], text)
    text = filled(text, {}, {}, texts)
    guard = f"{exported.name}_H"
    licence, _, text = text.partition("\n")
    opening = f"{licence}\n{_comment(exported.description())}#ifndef {guard}\n#define {guard}\n\n"
    return f"{opening}{text}\n#endif /* {guard} */\n"


class _Numbers:
    """Constants and tables of a header. In the methods NAME represents the name of the model."""

    def __init__(self, exported: Exported) -> None:
        self.exported = exported
        self.model = exported.model
        self.single = exported.model.single

    def constants(self) -> Iterator[str]:
        """Yields the constants that do not belong to a table."""
        yield from self.named(self.general())
        yield from self.certificate()
        yield from self.named(self.structure())

    def tables(self) -> Iterator[str]:
        """Yields the tables with their constants."""
        yield from self.named(self.all_tables())

    def named(self, lines: Iterable[str]) -> Iterator[str]:
        """Yields lines with the name of the model."""
        return (line.replace("NAME", self.exported.name) for line in lines)

    def all_tables(self) -> Iterator[str]:
        curves = self.model.lines
        yield from self.table("law", self.model.law, [line for pair in curves for line in pair])
        yield from self.of_energy()
        if self.model.response is not None:
            yield from self.table("response", self.model.response, list(self.model.response_lines))

    def general(self) -> Iterator[str]:
        model, exported = self.model, self.exported
        force, position, slope = exported.force_unit, exported.position_unit, exported.slope_unit
        yield _define("EXPORT_VERSION", EXPORT_VERSION, "version of these functions and macros")
        yield _define("RATE_HZ", exported.rate_hz, "certified ticks for each second; 0: no certificate")
        yield _define("FINGERPRINT", f"UINT64_C(0x{exported.fingerprint})", "of the model")
        certificate = exported.certificate
        digits = certificate.fingerprint if exported.has_certificate and certificate else "0"
        yield _define(
            "CERTIFICATE_FINGERPRINT", f"UINT64_C(0x{digits})", "of the certificate; 0: no certificate"
        )
        yield _define("PROFILE", f"UINT32_C({exported.profile:#010x})", "of the device; 0: no certificate")
        yield _define("STEP", _double(model.encoder_step), f"position for each count [{position}]")
        yield _define("COUNTS_PER_REV", f"UINT32_C({self.counts_per_rev()})", "0: no whole number")
        yield _define("FORCE_ERROR", self.bound(model.force_error), f"largest error of the force [{force}]")
        yield _define("SLOPE_ERROR", self.bound(model.slope_error), f"largest error of the slope [{slope}]")
        yield _define("STEP_ERROR", self.bound(model.step_error), f"largest error of a step [{force}]")
        needed = self.bound(exported.needed_friction)
        yield _define("NEEDED_FRICTION", needed, f"of the device, by the certificate [{force}]; 0: none")
        if not np.isinf(model.force_limit):
            yield _define("FORCE_LIMIT", self.real(model.force_limit), f"of the device [{force}]")
        yield ""

    def counts_per_rev(self) -> int:
        """Counts of the encoder for a revolution; 0 if they are not a whole number."""
        counts = 2.0 * np.pi / self.model.encoder_step
        is_whole = abs(counts - round(counts)) < _WHOLE_COUNTS and round(counts) < 2**32
        return round(counts) if is_whole and self.exported.position_unit == "rad" else 0

    def certificate(self) -> Iterator[str]:
        lines = textwrap.wrap(_plain(self.exported.certificate_text), 100)
        yield "/* The certificate as a text. */"
        yield f"#define {self.exported.name}_CERTIFICATE \\"
        yield " \\\n".join(f'    "{line}{" " if line is not lines[-1] else ""}"' for line in lines)
        yield ""

    def structure(self) -> Iterator[str]:
        model, position = self.model, self.exported.position_unit
        if model.hysteretic:
            yield _define("PLAY_RADIUS", _double(model.play_radius), f"play radius [{position}]")
            yield _define("PER_RADIUS", self.real(1.0 / model.play_radius))
            if self.single:
                per_count = self.real(model.encoder_step / model.play_radius)
                yield _define("PER_PLAY", per_count, "change of the direction state for each count")
        if taps := model.scheme.predict:
            yield _define("TAPS", f"{taps}u", "past positions of the prediction")
            yield _define("PARTS", f"{taps * (taps + 1)}")
            yield _define("PER_PART", self.real(1.0 / (taps * (taps + 1))))
        if model.memory is not None:
            yield from self.branches(model.memory)
        if model.massless:
            yield _define("MEMORY", self.real(model.lag.memory), "part of the lag that is kept for each tick")
            unit = "counts" if self.single else position
            text = f"lag for each force [{unit}/{self.exported.force_unit}]"
            yield _define("COMPLIANCE", self.real(model.lag.compliance), text)

    def branches(self, memory: ExportedMemory) -> Iterator[str]:
        """Yields the numbers of the branches. Their coordinate has a unit in which the ratio is a force."""
        yield _define("BRANCHES", len(memory.stiffness), "springs in series with a dashpot and a slider")
        yield _define("CONTACT", memory.contact, "sign of a force that the branches do not reverse; 0: none")
        yield _define("MOST_FORCE", _double(self.model.force_limit), f"[{self.exported.force_unit}]")
        yield "/* Stiffness, share of a stretch left after a tick at rest, largest stretch of each branch. */"
        values_of: dict[str, Sequence[float]] = {
            "stiffness": memory.stiffness,
            "kept": memory.kept,
            "most_stretch": memory.largest_stretch,
        }
        for name, values in values_of.items():
            yield f"static const double NAME_{name}[NAME_BRANCHES] = {{{', '.join(map(_double, values))}}};"
        yield ""

    def table(self, name: str, table: CellTable, lines: Sequence[ExportedLine]) -> Iterator[str]:
        """Yields the constants and arrays of a table."""
        grid = table.grid
        yield _define(f"{name}_BITS", grid.bits, f"2^{grid.bits} coarse cells")
        if self.single:
            yield from self.phases(name, table, lines)
        if name == "law" or not self.single:
            yield from self.positions(name, table)
        kind = "uint16_t" if table.split_bytes == 2 else "uint32_t"
        yield "\n/* First cell of each coarse cell, times 16, plus k: the coarse cell has 2^k cells. */"
        yield f"static const {kind} NAME_{name}_splits[{len(table.splits)}] = {{"
        yield f"{_filled(map(str, table.splits.tolist()))}\n}};\n"
        curves = "force"
        if name == "law" and self.model.hysteretic:
            curves = "mean force and of the hysteresis"
        elif name == "law" and self.model.memory is not None:
            curves = "force at rest and of the ratio"
        yield f"/* Polynomial coefficients of the {curves} in each cell, the lowest power first. */"
        yield from self.rows(f"NAME_real NAME_{name}_cells", table.coefficients, self.real)
        if name == "law":
            most = max(int(split) & 15 for split in table.splits)
            widths = [self.real(1.0 / grid.width(k)) for k in range(most + 1)]
            yield "/* 1 / width of a cell, by k. */"
            yield f"static const NAME_real NAME_law_per_width[{most + 1}] = {{\n{_filled(widths)}\n}};\n"
        if not grid.periodic:
            numbers = [(line.value, line.gain, line.slope, line.reach) for line in lines]
            yield "/* Straight lines below and above the domain: force, its change for each unit of distance,"
            yield "   slope, distance from which the force is zero. */"
            yield from self.rows(f"NAME_real NAME_{name}_lines", numbers, self.real)

    def phases(self, name: str, table: CellTable, lines: Sequence[ExportedLine]) -> Iterator[str]:
        """Yields the constants of places that are counts."""
        grid = table.grid
        yield _define(f"{name}_PER_COUNT", self.real(grid.phase_per_count), "phase for each count")
        if grid.periodic:
            yield _define(f"{name}_PHASE_STEP", f"UINT64_C({grid.phase_step})", "2^64 / counts of a period")
            yield _define(f"{name}_PHASE_START", f"UINT64_C({grid.phase_start})", "phase of count 0")
            return
        middle = grid.first_count + (grid.last_count - grid.first_count) // 2
        yield _define(f"{name}_FIRST", f"({grid.first_count})", "first count of the domain")
        yield _define(f"{name}_MIDDLE", f"({middle})")
        yield _define(f"{name}_LAST", f"({grid.last_count})", "last count of the domain")
        yield _define(f"{name}_ORIGIN", f"({grid.origin})", "count with the phase 0")
        yield _define(f"{name}_SHIFT", grid.shift)
        yield _define(
            f"{name}_OFFSET_BELOW", self.real(lines[0].offset), "distance of FIRST from the domain's end"
        )
        yield _define(
            f"{name}_OFFSET_ABOVE", self.real(lines[1].offset), "distance of LAST from the domain's end"
        )
        yield _define(f"{name}_PHASE_LOWER", f"{grid.phase_lower}u", "phases of both ends of the domain")
        yield _define(f"{name}_PHASE_UPPER", f"{grid.phase_upper}u")

    def positions(self, name: str, table: CellTable) -> Iterator[str]:
        """Yields the constants of places that are positions."""
        grid = table.grid
        unit = self.exported.position_unit
        yield _define(f"{name}_LOWER", _double(grid.lower), f"lowest position of the domain [{unit}]")
        yield _define(f"{name}_UPPER", _double(grid.upper), f"highest position of the domain [{unit}]")
        if grid.periodic:
            yield _define(f"{name}_PER_PERIOD", _double(1.0 / (grid.upper - grid.lower)))
        yield _define(f"{name}_START", _double(grid.start), "start of the first coarse cell")
        yield _define(f"{name}_COARSE", f"{len(table.splits)}u", "number of coarse cells")
        yield _define(f"{name}_COARSE_WIDTH", _double(grid.coarse_width))
        yield _define(f"{name}_PER_COARSE", _double(1.0 / grid.coarse_width))

    def of_energy(self) -> Iterator[str]:
        """Yields the numbers of the stored energy; they take no memory unless a program uses the energy."""
        yield "/* First and second antiderivative of each curve at the centres of the cells. */"
        yield from self.rows("double NAME_law_integrals", self.model.law.integrals, _double)
        ends = [end for pair in self.model.edges for end in pair]
        numbers = [(e.edge, e.value, e.slope, e.integral, e.double_integral, e.reach) for e in ends]
        yield "/* Ends of the domain for each curve: position, force, slope beyond it, antiderivatives,"
        yield "   distance from which the force is zero. */"
        yield from self.rows("double NAME_law_ends", numbers, _double)

    def rows(self, name: str, numbers: Iterable[Iterable[float]], literal: Literal) -> Iterator[str]:
        """Yields a constant array of two dimensions."""
        rows = [list(row) for row in numbers]
        yield f"static const {name}[{len(rows)}][{len(rows[0])}] = {{"
        for row in rows:
            text = "{" + ", ".join(map(literal, row)) + "},"
            yield textwrap.fill(text, _WIDTH, initial_indent="    ", subsequent_indent="     ")
        yield "};\n"

    def bound(self, value: float) -> str:
        """Returns a literal that is not below the bound of an error."""
        return self.real(value * (1.0 + 2.0**-20))

    def real(self, value: float) -> str:
        """Returns a number as a literal of the header's number type."""
        return _float(value) if self.single else _double(value)


def _float(value: float) -> str:
    if np.isinf(value):
        return "FLT_MAX"
    return np.format_float_scientific(np.float32(value) + np.float32(0.0), trim="0") + "f"


def _double(value: float) -> str:
    text = repr(float(value) + 0.0)  # -0.0 becomes 0.0
    return "DBL_MAX" if np.isinf(value) else text if "." in text or "e" in text else f"{text}.0"


def _define(name: str, value: object, comment: str = "") -> str:
    line = f"#define NAME_{name} {value}"
    return f"{line} /* {comment} */" if comment else line


def _filled(numbers: Iterable[str]) -> str:
    return textwrap.fill(", ".join(numbers), _WIDTH, initial_indent="    ", subsequent_indent="    ")


def _plain(text: str) -> str:
    """Returns a text that is safe in a string and in a comment of C: ASCII without the ends and starts of
    strings, comments and trigraphs."""
    shown = text.encode("ascii", "replace").decode()
    shown = "".join(c if c.isprintable() and c not in '\\"' else "?" for c in shown)
    return re.sub(r"(?<=\*)(?=/)|(?<=/)(?=[*/])|(?<=\?)(?=\?)", " ", shown)


def _comment(paragraphs: Sequence[str]) -> str:
    """Returns paragraphs as one comment of C, with wrapped lines."""
    lines: list[str] = []
    for paragraph in paragraphs:
        lines += [" *"] if lines else []
        for line in paragraph.splitlines():
            lines += textwrap.wrap(
                _plain(line), _WIDTH, initial_indent=" * ", subsequent_indent=" *   ", drop_whitespace=False
            )
    return "\n".join(["/*", *(line.rstrip() for line in lines), " */", ""])
