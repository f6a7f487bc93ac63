# SPDX-License-Identifier: Apache-2.0
"""Reports in headless Chromium: no error, no request, charts at both widths in light and dark, on paper."""

import io
from collections.abc import Iterator
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

import palpate
from chromium import PROGRAM, Page, chromium
from palpate.recording.sample import sample_recording
from palpate.report import write_report

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="needs chromium: apt-get install chromium")

WIDTHS = {"phone": 390, "desk": 1280}
"""Width of the window [px]"""

HEIGHT = 900

CHARTS = 7
"""Number of charts of a planned model of one position"""

MODELS = "[...Bokeh.documents[0].roots()[0].references()]"
"""Expression for the parts of the first chart"""

TEXT_BEYOND_THE_WINDOW = """
(() => {
  const wide = [...document.querySelectorAll("body *")].filter((each) => {
    const box = each.getBoundingClientRect();
    return box.width && box.right > document.documentElement.clientWidth + 1;
  });
  return wide.map((each) => `${each.tagName} ${each.className} ${each.getBoundingClientRect().right}`);
})()
"""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Writes the report of the simulated sample with a plan, and returns its file."""
    folder = tmp_path_factory.mktemp("report")
    model = palpate.identify(sample_recording(seed=1, duration_s=10.0))
    planned = palpate.plan(model, "bench-knob").stored()
    write_report(planned, sample_recording(seed=2, duration_s=10.0), to=folder / "report.html")
    return folder / "report.html"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with chromium(tmp_path_factory.mktemp("profile")) as found:
        yield found


def picture(data: bytes) -> np.ndarray:
    """Returns a screenshot as (height, width, 3) numbers from 0 to 1."""
    return np.asarray(matplotlib.image.imread(io.BytesIO(data), format="png"))[..., :3]


@pytest.mark.parametrize("dark", [False, pytest.param(True, marks=pytest.mark.full)], ids=["light", "dark"])
@pytest.mark.parametrize("width", ["desk", pytest.param("phone", marks=pytest.mark.full)])
def test_the_page_draws_all_charts_without_error_and_request(
    width: str, dark: bool, page: Page, report: Path, tmp_path: Path
) -> None:
    page.problems.clear()
    page.requests.clear()
    page.media(dark=dark)
    page.size(WIDTHS[width], HEIGHT, phone=width == "phone")
    page.open(report)
    assert page.problems == []
    assert {request.split(":")[0] for request in page.requests} <= {"file", "data"}
    sizes = page.run(
        "[...document.querySelectorAll('.chart')].map(e => [e.clientWidth, e.firstElementChild.clientHeight])"
    )
    assert len(sizes) == CHARTS
    assert all(across > 300 and down > 180 for across, down in sizes)
    assert page.run("document.documentElement.scrollWidth") == WIDTHS[width]
    assert page.run(TEXT_BEYOND_THE_WINDOW) == []
    shown = picture(page.screenshot(tmp_path / "top.png"))
    assert shown.shape[1] == WIDTHS[width]
    assert (shown.mean() < 0.3) == dark


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.full
def test_every_chart_shows_its_data(width: str, page: Page, report: Path, tmp_path: Path) -> None:
    page.media(dark=False)
    page.size(WIDTHS[width], HEIGHT, phone=width == "phone")
    page.open(report)
    for number in range(1, CHARTS + 1):
        page.run(f"document.getElementById('chart-{number}').scrollIntoView()")
        _, top, _, bottom = page.box(f"chart-{number}")
        shown = picture(page.screenshot(tmp_path / f"{number}.png"))[int(top) : int(bottom)]
        coloured = np.ptp(shown, axis=2) > 0.2
        dark = shown.max(axis=2) < 0.3
        assert coloured.mean() > 0.0002, f"chart {number} has no coloured data"
        assert dark.any(), f"chart {number} has no text"


@pytest.mark.full
def test_texts_are_at_least_12_pixels_high_on_a_phone(page: Page, report: Path) -> None:
    page.size(WIDTHS["phone"], HEIGHT, phone=True)
    page.open(report)
    least = page.run(
        "Math.min(...[...document.querySelectorAll('main *')].filter(e => e.childNodes.length && "
        "e.textContent.trim()).map(e => parseFloat(getComputedStyle(e).fontSize)))"
    )
    assert least >= 12.0


@pytest.mark.full
def test_the_colours_follow_the_scheme_while_the_page_is_open(page: Page, report: Path) -> None:
    page.media(dark=False)
    page.open(report)
    label = f"{MODELS}.find(e => e.type === 'LinearAxis').axis_label_text_color"
    light = page.run(label)
    page.media(dark=True)
    page.wait(f"{label} !== '{light}'")


@pytest.mark.full
def test_a_mouse_zooms_by_dragging_and_the_lower_panel_follows(page: Page, report: Path) -> None:
    page.media(dark=False)
    page.size(WIDTHS["desk"], HEIGHT)
    page.open(report)
    page.run("document.getElementById('chart-1').scrollIntoView()")
    left, top, _, _ = page.box("chart-1")
    ranges = f"{MODELS}.filter(e => e.type === 'Figure').map(e => e.x_range.start)"
    before = page.run(ranges)
    page.drag((left + 200, top + 120), (left + 400, top + 250))
    page.wait(f"{ranges}[0] > {before[0]}")
    after = page.run(ranges)
    assert after[0] == after[1]


@pytest.mark.full
def test_a_finger_scrolls_the_page_over_a_chart(page: Page, report: Path) -> None:
    page.size(WIDTHS["phone"], HEIGHT, phone=True)
    page.call("Emulation.setTouchEmulationEnabled", enabled=True)
    page.open(report)
    assert set(page.run(f"{MODELS}.filter(e => e.type === 'BoxZoomTool').map(e => e.active)")) == {False}
    page.call("Emulation.setTouchEmulationEnabled", enabled=False)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.full
def test_the_printed_page_has_dark_text_and_charts_on_white(
    dark: bool, page: Page, report: Path, tmp_path: Path
) -> None:
    page.media(dark=dark)
    page.size(WIDTHS["desk"], HEIGHT)
    page.open(report)
    pdf = page.print(tmp_path / "report.pdf")
    assert pdf.startswith(b"%PDF")
    assert 4 <= pdf.count(b"/Type /Page\n") <= 15
    page.media(dark=dark, paper=True)
    page.run("document.getElementById('chart-1').scrollIntoView()")
    _, top, _, bottom = page.box("chart-1")
    shown = picture(page.screenshot(tmp_path / "print.png"))[int(top) : int(bottom)]
    assert shown.mean() > 0.8
    assert shown.min() < 0.2


def test_without_scripts_texts_and_tables_are_complete(page: Page, report: Path) -> None:
    page.call("Emulation.setScriptExecutionDisabled", value=True)
    page.call("Page.navigate", url=report.resolve().as_uri())
    page.wait("document.readyState === 'complete'")
    text = page.run("document.body.innerText")
    page.call("Emulation.setScriptExecutionDisabled", value=False)
    for word in ("Verdict", "The charts need JavaScript", "Proof of stability", "SHA-256"):
        assert word in text
