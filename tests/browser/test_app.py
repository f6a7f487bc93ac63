# SPDX-License-Identifier: Apache-2.0
"""palpate app in headless Chromium: a dropped file to a C header, corrections, undo, reload, keyboard."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chromium import MOST_TRIES, PROGRAM, Page, chromium
from palpate.cli.main import main
from palpate.recording.sample import sample_recording
from test_report_page import TEXT_BEYOND_THE_WINDOW

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="needs chromium: apt-get install chromium")

ROOT = Path(__file__).parents[2]

CONTROL = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))

needs_control = pytest.mark.skipif(not CONTROL.exists(), reason="needs palpate-control, run make control")

WIDTHS = {"phone": 390, "desk": 1280}
"""Width of the window [px]"""

HEIGHT = 900

FIGURE_WITH_HANDLES = """
window.all = (view) => [view, ...(view.child_views ?? []).flatMap(all)];
window.handles = (view) => (view.model.renderers ?? []).find((each) => each.name === "handles");
window.figure = [...Bokeh.index.roots].flatMap(all).find(handles);
null;
"""
"""Script that finds the chart whose handles the mouse drags"""

PLACE_OF_THE_PEAK = """
(({ left, top }, { x, y }, { x_scale: across, y_scale: down }) =>
  [left + across.compute(x[0]), top + down.compute(y[0])])
(figure.el.getBoundingClientRect(), handles(figure).data_source.data, figure.frame)
"""
"""Expression for the place of the first handle in the window [px]"""


class App:
    """The page of a running palpate app."""

    def __init__(self, page: Page, address: str, downloads: Path) -> None:
        self.page, self.address, self.downloads = page, address, downloads

    def open(self) -> None:
        """Loads the page."""
        self.page.call("Page.navigate", url=self.address)
        self.page.wait("Number(document.documentElement.dataset.shown ?? 0) > 0")

    def after(self, work: Any, *given: Any) -> None:
        """Does some work and waits until the page shows its result."""
        shown = self.page.run("Number(document.documentElement.dataset.shown)")
        work(*given)
        self.page.wait(f"Number(document.documentElement.dataset.shown) > {shown} && !document.body.ariaBusy")

    def click(self, selector: str) -> None:
        """Clicks an element and waits until the page shows the result."""
        self.after(self.page.click, selector)

    def text(self, part: str) -> str:
        """Returns the text of a part of the page."""
        return str(self.page.run(f"document.getElementById('part-{part}').textContent"))

    def commands(self) -> list[str]:
        """Returns the command lines that the page shows."""
        return str(self.page.run("document.getElementById('commands').textContent")).strip().splitlines()

    def download(self, kind: str, name: str) -> bytes:
        """Downloads a file and returns its content."""
        self.page.click(f"[data-download={kind}]")
        for _ in range(MOST_TRIES):
            if (file := self.downloads / name).exists():
                return file.read_bytes()
            message = self.text("message")
            time.sleep(0.05)
        raise AssertionError(message)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with chromium(tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Writes a simulated recording and returns its file."""
    file = tmp_path_factory.mktemp("recordings") / "knob.csv"
    sample_recording(seed=1, duration_s=1.5).write(file)
    return file


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Starts the program and yields the address of its page."""
    command = [sys.executable, "-m", "palpate", "app", "--no-browser", "--json"]
    found = {"PATH": f"{CONTROL.parent}{os.pathsep}{os.environ['PATH']}"}
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **streams, text=True, env={**os.environ, **found}) as process:
        try:
            assert process.stdout is not None
            yield json.loads(process.stdout.readline())["address"]
        finally:
            process.terminate()
            _, messages = process.communicate()
    assert process.returncode == 0, messages
    assert messages.splitlines()[-1] == "The app has ended."


@pytest.fixture
def app(address: str, browser: Page, tmp_path: Path) -> Iterator[App]:
    """Yields the page without a recording. It must cause no error and no request to another address."""
    browser.size(WIDTHS["desk"], HEIGHT)
    browser.media(dark=False)
    browser.downloads_to(tmp_path)
    browser.problems.clear()
    browser.requests.clear()
    found = App(browser, address, tmp_path)
    found.open()
    while browser.run("document.querySelector('[data-action=forget]') !== null"):
        found.click("[data-action=forget]")
    yield found
    assert browser.problems == []
    assert [each for each in browser.requests if not each.startswith((address, "data:", "blob:"))] == []
    browser.call("Page.navigate", url="about:blank")


def test_a_dropped_file_becomes_the_files_of_the_shown_commands(
    app: App, recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    app.after(app.page.drop, recording)
    app.click("#identify")
    assert "good" in app.text("model")
    app.after(app.page.choose, "device", "bench-knob")
    assert "good" in app.text("plan")
    made = {name: app.download(kind, name) for kind, name in (("model", "knob.json"), ("header", "knob.h"))}
    assert b"palpate" in app.download("report", "knob.html")
    commands = app.commands()
    permissions = ["clipboardReadWrite", "clipboardSanitizedWrite"]
    app.page.call("Browser.grantPermissions", permissions=permissions)
    app.page.click("#copy")
    app.page.wait("document.getElementById('status').textContent === 'Copied'")
    assert app.page.run("navigator.clipboard.readText()").splitlines() == commands
    folder = tmp_path / "commands"
    folder.mkdir()
    (folder / recording.name).write_bytes(recording.read_bytes())
    monkeypatch.chdir(folder)
    for command in commands:
        assert main(command.split()[1:]) == 0, command
    for name, content in made.items():
        assert (folder / name).read_bytes() == content, name
    assert (folder / "knob.html").exists()


@pytest.mark.full
def test_a_dragged_stretch_is_left_out_and_undo_brings_it_back(app: App, recording: Path) -> None:
    app.after(app.page.drop, recording)
    app.page.run("document.getElementById('chart-course').scrollIntoView({block: 'center'})")
    left, top, right, _ = app.page.box("chart-course")
    app.page.drag((left + 0.4 * (right - left), top + 60), (left + 0.6 * (right - left), top + 60))
    app.page.wait("document.getElementById('course-to').value !== ''")
    app.click("[data-action=mark-course]")
    assert "--leave-out" in app.commands()[0]
    assert "left out" in app.text("reading")
    app.after(lambda: app.page.press("z", control=True))
    assert "--leave-out" not in app.commands()[0]
    assert app.page.run("document.getElementById('undo').disabled") is False


@pytest.mark.full
def test_a_refused_file_is_read_after_a_click_on_its_cure(app: App, tmp_path: Path) -> None:
    position = np.linspace(0.0, 4.0, 200)
    rows = "\n".join(f"{x:.4f},{2.0 * x:.4f}" for x in [*position, *position[::-1]])
    (tmp_path / "bare.csv").write_text(f"travel,load\n{rows}\n", encoding="utf-8")
    app.after(app.page.drop, tmp_path / "bare.csv")
    assert "no" in app.text("reading")
    app.click("#part-reading .cure")
    assert "--units" in app.commands()[0]
    assert "400 rows" in app.text("reading")


@pytest.mark.full
def test_a_reloaded_page_shows_the_same_recording_and_model(app: App, recording: Path) -> None:
    app.page.size(WIDTHS["phone"], HEIGHT, phone=True)
    app.after(app.page.drop, recording)
    app.click("#identify")
    before = app.text("model"), app.commands()
    app.open()
    assert (app.text("model"), app.commands()) == before


@pytest.mark.full
def test_the_keyboard_alone_identifies_and_changes_the_device(app: App, recording: Path) -> None:
    app.after(app.page.drop, recording)

    def focus(element: str) -> None:
        for _ in range(60):
            app.page.press("Tab")
            if app.page.run("document.activeElement.id") == element:
                return
        raise AssertionError(f"Tab does not reach {element}")

    focus("identify")
    app.after(app.page.press, "Enter")
    focus("device")
    app.after(app.page.press, "ArrowDown")
    focus("slider-viscous_damping")
    app.after(app.page.press, "ArrowRight")
    assert "--device knob-bench-knob.toml" in app.commands()[1]
    assert app.page.run("document.activeElement.id") == "slider-viscous_damping"


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.full
def test_the_page_fits_the_window_and_every_control_has_a_name(width: str, app: App, recording: Path) -> None:
    app.page.size(WIDTHS[width], HEIGHT, phone=width == "phone")
    app.after(app.page.drop, recording)
    app.click("#identify")
    app.after(app.page.choose, "device", "bench-knob")
    assert app.page.run("document.documentElement.scrollWidth") == WIDTHS[width]
    assert app.page.run(TEXT_BEYOND_THE_WINDOW) == []
    nodes = app.page.call("Accessibility.getFullAXTree")["nodes"]
    controls = ("button", "combobox", "textbox", "slider", "link")
    unnamed = [
        each["nodeId"]
        for each in nodes
        if not each["ignored"] and each["role"]["value"] in controls and not each.get("name", {}).get("value")
    ]
    assert unnamed == []
    small = app.page.run(
        "[...document.querySelectorAll('button, select')].map(e => e.getBoundingClientRect())"
        ".filter(b => b.height && b.height < 44).length"
    )
    assert small == 0


@pytest.mark.full
def test_a_simulated_rendering_moves_the_cursor(app: App, recording: Path) -> None:
    app.after(app.page.drop, recording)
    app.click("#identify")
    app.after(app.page.choose, "device", "bench-knob")
    app.click("#simulate")
    assert "good" in app.text("feel")
    app.page.run(
        "(e => { e.value = 0.4; e.dispatchEvent(new Event('input', {bubbles: true})); })"
        "(document.getElementById('moment'))"
    )
    before = app.page.run("document.getElementById('readout').textContent")
    assert "rad" in before
    app.page.click("#play")
    app.page.wait(f"document.getElementById('readout').textContent !== {before!r}")


@needs_control
def test_stop_ends_a_started_device_with_zero_force(app: App, recording: Path) -> None:
    app.after(app.page.drop, recording)
    app.click("#identify")
    app.after(app.page.choose, "device", "bench-knob")
    assert "5 N·m" in app.text("feel")
    app.click("#start")
    ended = "document.getElementById('part-feel').textContent.includes('Last run')"
    # On a busy machine a guard of palpate-control may end the run before.
    app.page.wait(f"document.getElementById('readout').textContent.includes('force') || {ended}")
    app.page.click("#stop")
    app.page.wait(ended)
    assert "zero force sent and confirmed" in app.text("feel")
    assert app.download("felt", "knob-felt.csv").startswith(b"#")


@needs_control
@pytest.mark.full
def test_the_page_shows_a_run_that_ended_between_two_requests(app: App, recording: Path) -> None:
    app.after(app.page.drop, recording)
    app.click("#identify")
    app.after(app.page.choose, "device", "bench-knob")
    app.page.run("document.getElementById('connection').add(new Option('usb:missing'))")
    app.page.choose("connection", "usb:missing")  # there is none with this number, so the run ends at once
    app.page.click("#start")
    app.page.wait("document.getElementById('part-feel').textContent.includes('Last run')")
    assert app.page.run("!document.getElementById('start').disabled")


@pytest.mark.full
def test_a_dragged_peak_makes_an_edited_object_that_is_compared_with_the_first(
    app: App, tmp_path: Path
) -> None:
    x = np.linspace(0.0, 4.0, 200)
    force = np.interp(x, [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.5, 0.2, 0.3, 2.0])
    rows = "\n".join(f"{a:.4f},{b:.5f}" for a, b in zip(x, force, strict=True))
    (tmp_path / "switch.csv").write_text(f"travel_mm,force_N\n{rows}\n", encoding="utf-8")
    app.after(app.page.drop, tmp_path / "switch.csv")
    app.click("#identify")
    app.page.run("document.getElementById('chart-edit').scrollIntoView({block: 'center'})")
    app.page.run(FIGURE_WITH_HANDLES)
    place = app.page.run(PLACE_OF_THE_PEAK)
    before = float(app.page.run("document.getElementById('edit-peak-force').value"))
    app.page.drag((place[0], place[1]), (place[0], place[1] - 30.0))
    app.page.wait(f"document.getElementById('edit-peak-force').value > {before + 0.05}")
    app.click("#make-edited")
    assert "Edited" in app.text("edit")
    assert "switch-edited.csv" in app.text("objects")
    assert "switch.csv" in app.text("compare")
    assert app.commands()[0] == "palpate identify switch-edited.csv -o switch-edited.json"
    assert app.download("recording", "switch-edited.csv").startswith(b"# edited: peak force")


@pytest.mark.full
def test_one_marked_repeat_is_the_period(app: App, tmp_path: Path) -> None:
    angle = np.linspace(0.0, 40.0, 400)
    rows = "\n".join(f"{a:.4f},{np.sin(np.radians(36.0 * a)):.5f}" for a in angle)
    (tmp_path / "detents.csv").write_text(f"angle_deg,torque_mNm\n{rows}\n", encoding="utf-8")
    app.after(app.page.drop, tmp_path / "detents.csv")
    app.page.run("document.getElementById('correct-curve').open = true")
    for end, value in (("from", "5"), ("to", "15")):
        app.page.run(f"document.getElementById('curve-{end}').focus()")
        app.page.type(value)
    app.click("[data-action=mark-curve]")
    assert app.commands()[0] == "palpate identify detents.csv --period 10deg -o detents.json"
    app.click("#identify")
    assert "10 deg" in app.text("model")


@pytest.mark.full
def test_columns_and_units_are_choices(app: App, tmp_path: Path) -> None:
    rows = "\n".join(f"{0.01 * k:.3f},{0.02 * k:.3f},{k}" for k in range(100))
    (tmp_path / "two.csv").write_text(f"travel_mm,other_mm,load\n{rows}\n", encoding="utf-8")
    app.after(app.page.drop, tmp_path / "two.csv")
    for element, value in (("column-position", "other_mm"), ("column-force", "load"), ("unit-force", "gf")):
        app.after(app.page.choose, element, value)
    command = "palpate identify two.csv --position other_mm --force load --units load=gf -o two.json"
    assert app.commands()[0] == command
    assert "100 rows" in app.text("reading")


@pytest.mark.full
def test_a_finger_scrolls_the_page_over_the_charts(app: App, recording: Path) -> None:
    app.after(app.page.drop, recording)
    app.page.call("Emulation.setTouchEmulationEnabled", enabled=True)
    app.open()
    tools = "Bokeh.documents.flatMap((each) => [...each.roots()[0].references()])"
    chosen = f"{tools}.filter((each) => each.type === 'BoxSelectTool').map((each) => each.active)"
    active = app.page.run(chosen)
    app.page.call("Emulation.setTouchEmulationEnabled", enabled=False)
    assert active
    assert not any(active)
