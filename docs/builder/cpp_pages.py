# SPDX-License-Identifier: Apache-2.0
"""Makes the pages of the C++ reference from the headers: one page for each folder of headers.

Doxygen writes XML, and this file writes directives of Sphinx's C++ domain. A public name of the namespace
without a comment is an error. A member without a comment has the meaning in the field table of its struct.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from textwrap import indent

ROOT = Path(__file__).parents[2]
XML = ROOT / "build" / "docs" / "doxygen" / "xml"
HEADERS = ROOT / "cpp" / "include"

Element = ElementTree.Element

_DIRECTIVES = {"class": "class", "struct": "struct", "concept": "concept", "enum": "enum-class"}
_FIELD = re.compile(r'Field\s*<\s*&\s*(\w+::\w+)\s*>\s*\{((?:\s*"(?:[^"\\]|\\.)*"\s*,?)+)')
_STATUS = re.compile(r'\{\s*"(\w+)",((?:\s*"(?:[^"\\]|\\.)*")+)')
_STRING = re.compile(r'"((?:[^"\\]|\\.)*)"')
_LONGEST_INITIALIZER = 40
"""Longest value of a member that is shown [characters]"""


def write_pages(folder: Path) -> list[str]:
    """Writes one page for each folder of headers; returns the documented names, such as `palpate::Direct`."""
    (ROOT / "build" / "docs").mkdir(parents=True, exist_ok=True)
    subprocess.run(["doxygen", "docs/Doxyfile"], cwd=ROOT, check=True)
    reference = Reference()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, headers in reference.headers().items():
        (folder / f"{name}.rst").write_text(reference.page(name, headers), encoding="utf-8")
    # One comment is enough for all overloads of a function.
    if undocumented := sorted(reference.names - reference.documented):
        raise SystemExit("these public C++ names need a comment: " + ", ".join(undocumented))
    return sorted(reference.names)


class Reference:
    """Documented names of the headers, by header."""

    def __init__(self) -> None:
        """Reads the XML files of Doxygen."""
        index = ElementTree.parse(XML / "index.xml").getroot()
        self._compounds: dict[str, Element] = {}
        self._meanings: dict[str, str] = {}
        self.names: set[str] = set()
        self.documented: set[str] = set()
        self._members: list[Element] = []
        for entry in index.iter("compound"):
            if entry.get("kind") in ("class", "struct", "concept", "namespace"):
                compound = ElementTree.parse(XML / f"{entry.get('refid')}.xml").find("compounddef")
                assert compound is not None
                if entry.get("kind") == "namespace":
                    self._members += list(compound.iter("memberdef"))
                else:
                    self._compounds[str(compound.get("id"))] = compound
        for member in self._members:
            for owner, strings in _FIELD.findall(_text(member.find("initializer"))):
                self._meanings[f"palpate::{owner}"] = _meaning(strings)
            if _name(member) == "status_texts":
                for word, strings in _STATUS.findall(_text(member.find("initializer"))):
                    self._meanings[f"palpate::Status::{word}"] = _meaning("," + strings)

    def headers(self) -> dict[str, dict[str, list[Element]]]:
        """Returns folder -> header -> its compounds and members in the order of the header."""
        every = self._compounds.values()
        nested = {inner.get("refid") for compound in every for inner in compound.iter("innerclass")}
        top = [each for key, each in self._compounds.items() if key not in nested]
        members = [each for each in self._members if not re.match(r"(fields|words)_of<", _name(each))]
        headers: dict[str, list[Element]] = defaultdict(list)
        for element in (*top, *members):
            headers[_location(element)[0]].append(element)
        folders: dict[str, dict[str, list[Element]]] = defaultdict(dict)
        for file, elements in sorted(headers.items()):
            parts = Path(file).parts
            # The two headers outside a folder belong to the page "palpate".
            elements.sort(key=lambda element: _location(element)[1])
            folders[parts[1] if len(parts) > 2 else "palpate"][file] = elements
        return dict(folders)

    def page(self, folder: str, headers: dict[str, list[Element]]) -> str:
        """Returns the page of a folder."""
        title = f"{folder}/" if folder != "palpate" else "status.hpp"
        text = _heading(title, "=")
        for header, elements in headers.items():
            text += _heading(Path(header).name, "-") if len(headers) > 1 else ""
            text += f"``#include <{header}>``\n\n"
            text += "".join(self._entry(element) for element in elements)
        return text

    def _entry(self, element: Element, inside: str = "") -> str:
        """Returns the directive of a compound or member with its documentation and its public members."""
        kind = str(element.get("kind"))
        name = _name(element)
        qualified = f"{inside}::{name}" if inside else (_text(element.find("qualifiedname")) or name)
        shown = name.removeprefix("palpate::") if not inside else name.rsplit("::", 1)[-1]
        qualified = qualified if qualified.startswith("palpate::") else f"palpate::{qualified}"
        documentation = _documentation(element) or _escaped(self._meanings.get(qualified, ""))
        if not inside:
            self.names.add(qualified)
            if documentation:
                self.documented.add(qualified)
        signature = _template(element) + self._signature(element, kind, shown if inside else qualified)
        body = documentation + "\n\n" if documentation else ""
        if kind == "concept":
            body += ".. code-block:: cpp\n\n" + indent(_concept(element), "   ") + "\n\n"
        if kind == "enum":
            for value in element.iter("enumvalue"):
                text = _documentation(value) or self._meanings.get(f"{qualified}::{_name(value)}", "")
                meaning = indent(text, "   ")
                body += f".. cpp:enumerator:: {_name(value)}\n\n{meaning}\n\n"
        for member in self._public_members(element):
            body += self._entry(member, qualified)
        directive = _DIRECTIVES.get(kind, {"variable": "var", "typedef": "type"}.get(kind, "function"))
        return f".. cpp:{directive}:: {signature}\n\n{indent(body, '   ')}"

    def _public_members(self, compound: Element) -> Iterator[Element]:
        """Yields the public nested classes and members of a class, without operators and destructors."""
        for inner in compound.findall("innerclass"):
            if inner.get("prot") == "public" and str(inner.get("refid")) in self._compounds:
                yield self._compounds[str(inner.get("refid"))]
        for section in compound.findall("sectiondef"):
            for member in section.findall("memberdef"):
                deleted = _text(member.find("argsstring")).endswith("delete")
                hidden = deleted or _name(member).startswith(("~", "operator"))
                if member.get("prot") == "public" and member.get("kind") != "friend" and not hidden:
                    yield member

    def _signature(self, element: Element, kind: str, name: str) -> str:
        """Returns the declaration without its template parameters."""
        if kind in ("class", "struct"):
            public = [base for base in element.findall("basecompoundref") if base.get("prot") == "public"]
            bases = [f"public {_text(base)}" for base in public]
            return name + (" : " + ", ".join(bases) if bases else "")
        if kind in ("concept", "enum"):
            return name
        declared = _text(element.find("type"))
        if kind == "typedef":
            return f"{name} = {declared}"
        if kind == "variable":
            initial = _text(element.find("initializer"))
            short = len(initial) <= _LONGEST_INITIALIZER and not re.search(r"[\[\n{]", initial)
            return f"{declared} {name}{_text(element.find('argsstring'))}" + (f" {initial}" if short else "")
        explicit = "explicit " if element.get("explicit") == "yes" else ""
        static = "static " if element.get("static") == "yes" else ""
        arguments = re.sub(r"\s*=\s*(default|0)$", "", _text(element.find("argsstring")))
        arguments = re.sub(r"(\d) '(\d{3})", r"\1'\2", arguments)  # Doxygen separates the digits of 50'000
        return f"{explicit}{static}{declared} {name}{arguments}".replace("  ", " ").strip()


def _heading(text: str, underline: str) -> str:
    return f"{text}\n{underline * len(text)}\n\n"


def _text(element: Element | None) -> str:
    return "".join(element.itertext()).strip() if element is not None else ""


def _name(element: Element) -> str:
    return _text(element.find("name")) or _text(element.find("compoundname"))


def _location(element: Element) -> tuple[str, int]:
    location = element.find("location")
    assert location is not None
    return str(location.get("file")), int(location.get("line", 0))


def _meaning(strings: str) -> str:
    """Returns the meaning of a field: the strings behind its name, which the compiler joins."""
    _, _, after = strings.partition(",")
    return "".join(_STRING.findall(after)).replace('\\"', '"')


def _template(element: Element) -> str:
    parameters = element.find("templateparamlist")
    if parameters is None or not len(parameters):
        return ""
    each = []
    for parameter in parameters:
        words = [_text(parameter.find(tag)) for tag in ("type", "declname")]
        value = _text(parameter.find("defval"))
        each.append(" ".join(word for word in words if word) + (f" = {value}" if value else ""))
    return f"template<{', '.join(each)}> "


def _concept(element: Element) -> str:
    """Returns the definition of a concept as in its header."""
    return re.sub(r"concept palpate::(\w+) =\s+", r"concept \1 = ", _text(element.find("initializer"))) + ";"


def _escaped(text: str) -> str:
    return re.sub(r"([\\*`|_])", r"\\\1", text)


def _documentation(element: Element) -> str:
    """Returns the comment of a name as reStructuredText."""
    kinds = ("briefdescription", "detaileddescription")
    parts = [_block(part) for kind in kinds for part in element.findall(kind)]
    return "\n\n".join(part for part in parts if part)


def _block(element: Element) -> str:
    """Returns paragraphs, lists and formulas of a comment as reStructuredText."""
    blocks: list[str] = []
    line = ""

    def end_line() -> None:
        nonlocal line
        if line.strip():
            blocks.append(" ".join(line.split()))
        line = ""

    for part in element:
        if part.tag != "para":
            continue
        line += _escaped(part.text or "")
        for child in part:
            if child.tag in ("verbatim", "preformatted"):
                end_line()
                blocks.append("::\n\n" + indent(_dedented("".join(child.itertext())), "   "))
            elif child.tag in ("itemizedlist", "orderedlist"):
                end_line()
                blocks.append("\n".join("* " + indent(_block(item), "  ").strip() for item in child))
            elif child.tag == "computeroutput":
                line += f"``{_text(child)}``"
            elif child.tag == "ndash":
                line += "–"
            else:
                line += _escaped("".join(child.itertext()))
            line += _escaped(child.tail or "")
        end_line()
    return "\n\n".join(blocks)


def _dedented(text: str) -> str:
    lines = text.rstrip().splitlines()
    return "\n".join(line.rstrip() for line in lines)


if __name__ == "__main__":
    print("\n".join(write_pages(ROOT / "docs" / "generated" / "cpp")))
