# SPDX-License-Identifier: Apache-2.0
"""Parts of the page as HTML, and its charts, for the present state of a session."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..model import Model
from ..planning import DeviceProfile, Plan, example_profiles, mechanical_units, profile_file
from ..recording import Recording
from ..recording.units import FORCE_UNITS, POSITION_UNITS, TIME_UNITS, UNITS
from ..report import page as report_page
from ..report.charts import Chart
from ..report.of_comparison import Compared
from ..report.page import COLOURS, bokeh, chart_library, templates_in
from ..report.subject import Rendering, Subject
from ..verdict import Verdict
from .charts import (
    Axes,
    course,
    course_axis,
    cursor,
    design,
    differences,
    frames,
    is_dynamic,
    lost,
    modelled,
    recorded,
    together,
)
from .designer import editable
from .live import RUN_S, connections
from .session import CACHED, Refusal, Session
from .state import Entry, OptionTable, commands_of, text_of

SLIDER_FACTOR = 30.0
"""A slider reaches from the value of the profile divided by this factor to the value times it [-]."""

KINDS = {
    "position": "is the same for press and release",
    "hysteresis": "differs between press and release",
    "memory": "relaxes while the object is held",
    "position_velocity": "depends on the speed",
    "general": "depends on several columns",
}
"""What the force does, by the kind of a model"""

ROLES = {"position": POSITION_UNITS, "force": FORCE_UNITS, "time": TIME_UNITS, "direction": ()}
"""Roles of columns that the user can choose, with the SI units of each"""

TEMPLATES = (Path(__file__).parent, Path(report_page.__file__).parent)
"""Folders of the templates; the style and the colours are those of a report"""


@dataclass(frozen=True)
class Slider:
    """Slider for one property of the device."""

    field: str
    name: str
    unit: str
    value: float
    """Value in `unit`"""
    base: float
    """Value of the profile, in the middle of the slider"""

    @property
    def place(self) -> float:
        """Place of the slider, from -1 to 1."""
        return math.log(self.value / self.base) / math.log(self.factor)

    @property
    def factor(self) -> float:
        """Ratio of the value at the end of the slider to that in the middle."""
        return SLIDER_FACTOR


class View:
    """Makes the answer to each request of the page: changed parts as HTML, changed charts as JSON."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self._templates = templates_in(*TEMPLATES)
        self._parts = self._templates.get_template("parts.html").module
        self._chart = lru_cache(CACHED)(self._chart_of)
        self._identified_parts = lru_cache(CACHED)(self._parts_without_device)

    def page(self) -> str:
        """Returns the page without its parts, which it requests."""
        text: str = self._templates.get_template("app.html").render(colours=COLOURS)
        return text

    def style(self) -> str:
        """Returns the style sheet."""
        text: str = self._templates.get_template("app.css").render(colours=COLOURS)
        return text

    def script(self) -> str:
        """Returns the scripts of the page."""
        paint = (TEMPLATES[1] / "paint.js").read_text(encoding="utf-8")
        return f"{paint}\n{(TEMPLATES[0] / 'app.js').read_text(encoding='utf-8')}"

    def library(self) -> str:
        """Returns the script that draws the charts."""
        return chart_library()

    def answer(self, known: Collection[str], message: str = "") -> dict[str, Any]:
        """Returns all parts and charts; a chart whose key is in `known` is left out, because the page has it.

        `message` is a refusal of the last action.
        """
        entry = self.session.state.entry
        parts: dict[str, str] = {
            "message": self._render("message", message, self._cures(message, entry)) if message else "",
            "history": self._render("history", self.session.can_undo),
            "objects": self._render("objects", self.session.state),
        }
        charts: dict[str, Any] = {}
        if entry is not None:
            without_device = Entry(
                entry.file, entry.options, entry.identified, plan_options=entry.plan_options
            )
            parts |= self._identified_parts(without_device)
            parts |= {
                **self._device_parts(entry),
                "feel": self._feel_part(entry),
                "edit": self._edit_part(entry),
                "compare": self._compare_part(entry),
                "export": self._export_part(entry),
            }
            charts = self._charts(entry, known)
        return {"parts": parts, "charts": charts, "colours": COLOURS}

    def _render(self, name: str, *values: Any) -> str:
        return str(getattr(self._parts, name)(*values))

    def _cures(self, sentence: str, entry: Entry | None) -> list[dict[str, Any]]:
        """Returns the buttons for the options that a sentence advises."""
        if entry is None:
            return []
        line = self.session.command_line
        tables: list[OptionTable] = [line.identify, line.plan]
        found = {}
        for table in tables:
            for options in table.cures(sentence):
                words = [word for option in options for word in option]
                found[tuple(words)] = {
                    "words": words,
                    "text": ", ".join(" ".join(option).replace("-", " ").strip() for option in options),
                }
        return list(found.values())

    def _judged(self, verdict: Verdict, entry: Entry) -> dict[str, Any]:
        """Returns a verdict for a template: its level, and each reason with its cures."""
        reasons = [(each, self._cures(each, entry)) for each in verdict.reasons]
        return {"level": verdict.level, "reasons": reasons}

    def _refused(self, refusal: Refusal, entry: Entry) -> dict[str, Any]:
        return {"level": "no", "reasons": [(refusal.sentence, self._cures(refusal.sentence, entry))]}

    def _parts_without_device(self, entry: Entry) -> dict[str, str]:
        return {**self._recording_parts(entry), "model": self._model_part(entry)}

    def _recording_parts(self, entry: Entry) -> dict[str, str]:
        recording = self.session.recording(entry)
        corrections = self._render("corrections", [*entry.options, *entry.plan_options])
        columns = self._columns_part(entry, recording)
        if isinstance(recording, Refusal):
            reading = self._render("reading", "", self._refused(recording, entry), ())
            return {"reading": reading, "columns": columns, "corrections": corrections}
        judged = self._judged(recording.verdict, entry)
        return {
            "reading": self._render("reading", f"{len(recording)} rows", judged, recording.notes),
            "columns": columns,
            "marks-curve": self._render("marks_curve", Axes.of(recording).unit("position").shown),
            "marks-course": self._render("marks_course", course_axis(recording)[0]),
            "corrections": corrections,
        }

    def _columns_part(self, entry: Entry, recording: Recording | Refusal) -> str:
        """Returns the choices of columns and units; the first choice of each is what the program found."""
        found: Mapping[str, str] = {}
        symbols = {}
        if isinstance(recording, Recording):
            found = recording.source.columns
            symbols = {role: unit.shown for role, unit in recording.file_units.items()}
        chosen = {each[0]: each[1] for each in entry.options if len(each) == 2}
        stated = dict(each[1].rpartition("=")[::2] for each in entry.options if each[0] == "--units")
        roles = []
        for role, units in ROLES.items():
            column = chosen.get(f"--{role}", "")
            roles.append(
                {
                    "role": role,
                    "found": found.get(role, ""),
                    "column": column,
                    "symbol": symbols.get(role, ""),
                    "unit": stated.get(column or found.get(role, ""), ""),
                    "units": [name for name, each in UNITS.items() if each.si in units],
                }
            )
        is_open = isinstance(recording, Refusal)
        return self._render("columns", self.session.column_names(entry), roles, is_open)

    def _model_part(self, entry: Entry) -> str:
        model, recording = self.session.model(entry), self.session.recording(entry)
        if model is None or isinstance(recording, Refusal):
            return self._render("no_model", isinstance(recording, Refusal))
        if isinstance(model, Refusal):
            return self._render("model", self._refused(model, entry), "", {}, [])
        compared = self.session.compared(entry)
        notes = [*model.notes["rows"], *model.notes["identification"]]
        if not isinstance(compared, Compared):
            reason = "" if compared is None else compared.sentence
            return self._render("model", self._judged(model.verdict, entry), reason, {}, notes)
        noticed = differences(compared)
        worst = int(np.argmax(np.abs(noticed)))
        position, force = map(Axes.of(recording).unit, ("position", "force"))
        place = (
            f"The largest difference is {abs(noticed[worst]):.2g} just noticeable differences, at "
            f"{position.text(float(compared.position[worst]))}: recorded "
            f"{force.text(float(compared.force[worst]))}, model "
            f"{force.text(float(compared.found.force[worst]))}."
        )
        numbers = {
            "the force": KINDS[model.kind],
            "a hand feels no difference": f"{compared.found.within_jnd:.0%} of the rows",
            "error": f"RMS {force.text(compared.found.rmse)}",
            "size": f"{model.terms}, {model.n_parameters} parameters",
        }
        if model.period is not None:
            numbers["repeats every"] = position.text(model.period)
        return self._render("model", self._judged(model.verdict, entry), place, numbers, notes)

    def _device_parts(self, entry: Entry) -> dict[str, str]:
        model = self.session.model(entry)
        if not isinstance(model, Model):
            return {"device": "", "plan": ""}
        unit = model.units["position"]
        names = [
            name
            for name, (file, _) in example_profiles().items()
            if unit in ("", DeviceProfile.load(file).position_unit)
        ]
        names += sorted(each.name for each in self.session.folder.glob("*.toml"))
        sliders = self._sliders(entry) if entry.device else []
        device = self._render("device", names, entry, sliders)
        found = self.session.plan(entry)
        if found is None:
            return {"device": device, "plan": ""}
        if isinstance(found, Refusal):
            return {"device": device, "plan": self._render("plan", self._refused(found, entry), {})}
        judged = self._judged(model.verdict + found.verdict, entry)
        return {"device": device, "plan": self._render("plan", judged, found.summary() | found.settings())}

    def _sliders(self, entry: Entry) -> list[Slider]:
        profile, device = DeviceProfile.load(profile_file(entry.device)), self.session.device(entry)
        unit = profile.position_unit
        _, damping, _ = mechanical_units(unit)
        found = [
            Slider("viscous_damping", "Damping", damping, device.viscous_damping, profile.viscous_damping),
            Slider("rate_hz", "Rate", "Hz", 1.0 / device.period_s, 1.0 / profile.period_s),
            Slider("encoder_step", "Encoder step", unit, device.encoder_step, profile.encoder_step),
        ]
        return [each for each in found if each.base > 0.0]

    def _edit_part(self, entry: Entry) -> str:
        curves, before = self.session.curves(entry.file), self.session.curves(entry.origin)
        recording = self.session.recording(entry)
        if curves is None or isinstance(recording, Refusal):
            return ""
        units = {role: Axes.of(recording).unit(role) for role in ("position", "force")}

        def text(number: tuple[float, str]) -> str:
            value, kind = number
            if kind in units:
                return units[kind].text(value)
            return f"{1e3 * value:.4g} mJ" if kind == "work" else f"{value:.0%}"

        now = curves.numbers()
        earlier = {} if before is None else before.numbers()
        rows = [
            (name, text(earlier[name]) if name in earlier else "", text(value)) for name, value in now.items()
        ]
        fields = []
        for name in editable(curves):
            unit = units[now[name][1]]
            fields.append((name, f"{now[name][0] / unit.factor:.4g}", unit.shown))
        has_loop = not np.array_equal(curves.press, curves.release)
        model = self.session.model(entry)
        left_out = isinstance(model, Model) and is_dynamic(model)
        changes = recording.metadata.get("edited", "")
        return self._render("edit", rows, before is not None, fields, has_loop, changes, left_out)

    def _compare_part(self, entry: Entry) -> str:
        found = self.session.similar(entry)
        rows = [(name, f"{largest:.2g}", f"{share:.0%}") for name, largest, share in found]
        return self._render("compare", entry.file, rows) if rows else ""

    def _feel_part(self, entry: Entry) -> str:
        plan, rendering = self.session.plan(entry), self.session.rendering(entry)
        if not isinstance(plan, Plan) or plan.verdict.level == "no" or plan.certificate is None:
            return ""
        unit = plan.model.units["force"].replace("*", "·")
        limit = f"{plan.certificate.device.force_limit:.4g} {unit}"
        judged = None
        if isinstance(rendering, Rendering):
            judged = self._judged(rendering.verdict, entry)
        elif rendering is not None:
            judged = self._refused(rendering, entry)
        live = self.session.live
        names = connections()
        command = text_of(self.session.live_command(entry, names[-1]))
        recorded = (self.session.folder / f"{entry.stem}-felt.csv").exists()
        limit += f", and a run ends after {RUN_S / 60.0:g} minutes"
        return self._render("feel", judged, names, limit, live.is_running, live.ended, command, recorded)

    def ticked(self) -> dict[str, Any]:
        """Returns the newest tick of a running device in the units of the page, and how it ended."""
        live, entry = self.session.live, self.session.state.entry
        tick, recording = live.latest(), None if entry is None else self.session.recording(entry)
        found: dict[str, Any] = {
            "progress": self.session.command_line.progress,
            "running": live.is_running,
            "ended": live.ended,
            "endings": live.endings,
        }
        if tick and isinstance(recording, Recording):
            axes = Axes.of(recording)
            position, force = (
                next(value for name, value in tick.items() if name.startswith(f"{start}_"))
                for start in ("position", "applied")
            )
            assert entry is not None
            plan = self.session.plan(entry)
            if isinstance(plan, Plan):
                position = Subject.of(plan.model).folded(position)
            found["at"] = [axes.x.factor * float(position), axes.y.factor * force]
        return found

    def _export_part(self, entry: Entry) -> str:
        if isinstance(self.session.recording(entry), Refusal):
            return ""
        has_model = isinstance(self.session.model(entry), Model)
        plan = self.session.plan(entry)
        proved = plan.is_proved if isinstance(plan, Plan) and plan.verdict.level != "no" else None
        reading = self.session.command_line.reading
        commands = [text_of(each) for each in commands_of(entry, reading, proved=proved)]
        return self._render("export", entry, has_model, proved, commands)

    def _charts(self, entry: Entry, known: Collection[str]) -> dict[str, Any]:
        recording, model = self.session.recording(entry), self.session.model(entry)
        plan = self.session.plan(entry)
        reading = tuple(each for each in entry.options if each[0] in self.session.command_line.reading)
        keys: dict[str, tuple[Any, ...] | None] = dict.fromkeys(CHARTS)
        if isinstance(recording, Recording):
            keys |= {"curve": (entry.file, reading), "course": (entry.file, reading)}
        if isinstance(model, Model) and isinstance(self.session.compared(entry), Compared):
            keys["model"] = (entry.file, entry.options)
        if isinstance(plan, Plan):
            keys["plan"] = (entry,)
            if entry.played or self.session.live.is_running:
                keys["feel"] = (entry,)
        if self.session.curves(entry.file) is not None:
            shown = [each for each in self.session.state.entries if each.identified]
            all_models = tuple((each.file, each.options) for each in shown)
            keys["edit"] = (entry.file, entry.origin, all_models)
            if self.session.similar(entry):
                keys["compare"] = (entry.file, all_models)
        answer = {}
        for name, key in keys.items():
            text = "" if key is None else f"{name} {key}"
            if text in known or key is None:
                answer[name] = {"key": text}
            else:
                answer[name] = {"key": text, **json.loads(self._chart(name, entry, text))}
        return answer

    def _chart_of(self, name: str, entry: Entry, key: str) -> str:
        """Returns the HTML around a chart and its content for the library, as JSON."""
        chart = CHARTS[name](self.session, entry)
        item = bokeh("embed").json_item(chart.layout(), f"chart-{name}")
        answer = {"item": item, "html": self._render("figure", name, chart), "select": name in SELECTED}
        recording, rendering = self.session.recording(entry), self.session.rendering(entry)
        if name == "feel" and isinstance(recording, Recording):
            axes = Axes.of(recording)
            answer["units"] = [axes.x.unit, axes.y.unit]
            if isinstance(rendering, Rendering) and isinstance(plan := self.session.plan(entry), Plan):
                answer["frames"] = frames(rendering.recording, Subject.of(plan.model), axes)
        return json.dumps(answer)


SELECTED = ("curve", "course")
"""Charts on which the mouse selects an interval"""


def _curve(session: Session, entry: Entry) -> Chart:
    return recorded(session.recording(entry))  # type: ignore[arg-type]


def _course(session: Session, entry: Entry) -> Chart:
    whole = session.whole(entry)
    assert isinstance(whole, Recording)
    return course(whole, session.used(entry, whole))


def _model(session: Session, entry: Entry) -> Chart:
    compared = session.compared(entry)
    assert isinstance(compared, Compared)
    return modelled(compared)


def _edit(session: Session, entry: Entry) -> Chart:
    curves, recording = session.curves(entry.file), session.recording(entry)
    assert curves is not None
    assert isinstance(recording, Recording)
    return design(curves, session.curves(entry.origin), recording)


def _compare(session: Session, entry: Entry) -> Chart:
    names = [entry.file, *(name for name, *_ in session.similar(entry))]
    models = {each.file: session.model(each) for each in session.state.entries}
    recording = session.recording(entry)
    assert isinstance(recording, Recording)
    return together([(name, found) for name in names if isinstance(found := models[name], Model)], recording)


def _feel(session: Session, entry: Entry) -> Chart:
    plan, recording = session.plan(entry), session.recording(entry)
    assert isinstance(plan, Plan)
    assert isinstance(recording, Recording)
    return cursor(plan, recording)


def _plan(session: Session, entry: Entry) -> Chart:
    plan, recording = session.plan(entry), session.recording(entry)
    assert isinstance(plan, Plan)
    assert isinstance(recording, Recording)
    return lost(plan, recording)


CHARTS: dict[str, Callable[[Session, Entry], Chart]] = {
    "curve": _curve,
    "course": _course,
    "model": _model,
    "plan": _plan,
    "feel": _feel,
    "edit": _edit,
    "compare": _compare,
}
"""Charts of the page by name"""
