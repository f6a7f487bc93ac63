# SPDX-License-Identifier: Apache-2.0
"""HTML of a result: well-formed, escaped, without colours and scripts, small."""

import re
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest

from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import DeviceProfile, Plan, Scheme, plan, verify
from palpate.html_table import MOST_POINTS, Curve, html_table
from palpate.recording.sample import sample_recording
from palpate.verdict import Verdict, no

LARGEST_BYTES = 30_000
"""Largest size of the HTML of a result [bytes]"""


def results() -> dict[str, object]:
    recording = sample_recording(1, 2.0)
    model = model_by_hand()
    return {
        "recording": recording,
        "model": model,
        "keyswitch": keyswitch_by_hand(),
        "verification": verify(model, recording),
        "plan": plan(model, DeviceProfile()),
        "plan by hand": Plan(keyswitch_by_hand(), Scheme(structure="massless", play_radius=1e-5)),
    }


@pytest.mark.parametrize("name", results())
def test_html_of_a_result_is_well_formed_small_and_begins_with_its_verdict(name: str) -> None:
    html = results()[name]._repr_html_()  # type: ignore[attr-defined]
    tree = ElementTree.fromstring(html)
    cells = [("".join(row[0].itertext()), "".join(row[1].itertext())) for row in tree.iter("tr")]
    assert cells[0][0] == "verdict"
    assert cells[0][1] in ("good", "usable", "no")
    assert len(html) < LARGEST_BYTES
    colours = set(re.findall(r"(?:color|stroke|fill)[:=]\"?([\w#]+)", html))
    assert colours <= {"inherit", "currentColor", "none"}


def test_all_text_is_escaped() -> None:
    evil = '<img src=x onerror="alert(1)">&'
    html = html_table(evil, Verdict((no(evil),)), {evil: evil})
    assert "<img" not in html
    assert "".join(ElementTree.fromstring(html).itertext()).count(evil) == 4


def test_a_long_curve_is_drawn_with_few_points() -> None:
    x = np.linspace(0.0, 1.0, 100_000)
    for look in ("line", "dots"):
        html = html_table("t", None, {}, [Curve(x, x**2, look)])
        assert len(re.findall(r"[ML]", html.partition("<path")[2])) <= MOST_POINTS + 1


def test_a_constant_force_and_a_single_point_are_drawn() -> None:
    for curve in (Curve(np.arange(3.0), np.ones(3)), Curve(np.ones(1), np.ones(1))):
        assert "nan" not in html_table("t", None, {}, [curve])


def test_results_load_matplotlib_only_to_draw() -> None:
    code = (
        "import sys; from palpate import Recording, identify, verify\n"
        "recording = Recording.from_arrays(range(20), range(20)); model = identify(recording)\n"
        "found = verify(model, recording); found.to_frame()\n"
        "recording._repr_html_(), model._repr_html_(), found._repr_html_()\n"
        "sys.exit('matplotlib' in sys.modules or 'palpate.plotting' in sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
