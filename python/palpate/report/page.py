# SPDX-License-Identifier: Apache-2.0
"""Parts of a report page and its HTML. The template escapes every text that it receives."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..verdict import LEVELS, Finding, Verdict

if TYPE_CHECKING:
    from .charts import Chart

COLOURS = {
    "light": {
        "paper": "#ffffff",
        "ink": "#1c1f24",
        "soft": "#5b626d",
        "rule": "#d5d9df",
        "band": "#8d97a6",
        "first": "#1f6fb4",
        "second": "#b3530d",
        "alarm": "#b3261e",
        "good": "#1b6e3c",
    },
    "dark": {
        "paper": "#14171b",
        "ink": "#e8eaed",
        "soft": "#a3abb7",
        "rule": "#3a4049",
        "band": "#7b8594",
        "first": "#63aef0",
        "second": "#f0944a",
        "alarm": "#ff8a80",
        "good": "#6fce93",
    },
}
"""Colours of page and charts by their use; the charts take them by these names."""


@dataclass(frozen=True)
class Table:
    """Table with a header; on a narrow screen each row is a list of header and cell."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class KeyNumber:
    """One of the main numbers of a report."""

    value: str
    name: str
    meaning: str


@dataclass(frozen=True)
class Section:
    """Section of a report: an explanation for readers without special knowledge, and its content."""

    key: str
    title: str
    explanation: str
    sentences: Sequence[str] = ()
    charts: Sequence[Chart] = ()
    numbers: Sequence[KeyNumber] = ()
    verdict: Verdict | None = None
    """Verdict whose level and findings the section shows"""
    tables: Sequence[Table] = ()
    facts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    left_out: str = ""
    """Reason why the section has no content; empty if it has"""

    @property
    def findings(self) -> list[Finding]:
        """Findings of the verdict without repetitions, the most serious first."""
        found = () if self.verdict is None else dict.fromkeys(self.verdict.findings)
        return sorted(found, key=lambda finding: -LEVELS.index(finding.level))


_OPTION = re.compile(r"(?<!\S)--[a-zA-Z][\w-]*")
"""Option of the command line in a sentence"""


def bokeh(module: str) -> Any:
    """Imports a module of Bokeh, which draws the charts.

    Raises
    ------
    InputError
        Bokeh is not installed.
    """
    try:
        return import_module(f"bokeh.{module}")
    except ImportError:
        raise InputError("a report needs bokeh: install it with pip install 'palpate[report]'") from None


def html_of(title: str, subtitle: str, sections: Sequence[Section]) -> str:
    """Returns the page. It contains the chart library and fetches nothing."""
    embed = bokeh("embed")
    charts = [chart for section in sections for chart in section.charts]
    for number, chart in enumerate(charts, 1):
        chart.number = number
    items = [embed.json_item(chart.layout(), f"chart-{chart.number}") for chart in charts]
    text: str = (
        templates_in(Path(__file__).parent)
        .get_template("page.html")
        .render(
            title=title,
            subtitle=subtitle,
            sections=sections,
            colours=COLOURS,
            library=unescaped(chart_library()),
            data=script_json({"colours": COLOURS, "charts": items}),
        )
    )
    return text


def chart_library() -> str:
    """Returns the JavaScript that draws the charts."""
    inline = bokeh("resources").Resources(mode="inline", components=["bokeh"])
    return "\n".join(inline.js_raw)


def unescaped(text: str) -> Any:
    """Returns text that a template does not escape."""
    return import_module("jinja2").utils.markupsafe.Markup(text)


def templates_in(*folders: Path) -> Any:
    """Returns the Jinja environment of templates in these folders. It escapes every text."""
    jinja2 = import_module("jinja2")
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folders),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    escape = jinja2.utils.markupsafe.escape

    def unbroken(text: str) -> Any:
        """Returns text as HTML in which a line does not break inside an option such as --inputs."""
        return unescaped(_OPTION.sub(r'<span class="option">\g<0></span>', str(escape(text))))

    environment.filters["unbroken"] = unbroken
    return environment


def script_json(value: Any) -> Any:
    """Returns JSON that cannot end the script element that contains it."""
    text = json.dumps(value, separators=(",", ":"))
    return unescaped(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
