# SPDX-License-Identifier: Apache-2.0
"""Draws docs/figures/app.png: the page of `palpate app` with the model of a simulated button.

Needs Chromium.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "browser"))

from chromium import chromium  # noqa: E402

WIDTH, HEIGHT = 900, 985
"""Size of the picture [px]"""


def write_button(file: Path) -> None:
    """Writes the recording of a simulated button: two presses with a hold, noise of 0.3 gf."""
    time = np.arange(0.0, 20.0, 0.01)
    travel = np.interp(time % 10.0, [0.0, 4.0, 5.0, 9.0, 10.0], [0.0, 4.0, 4.0, 0.0, 0.0])
    side = np.where(time % 10.0 < 5.0, 1.0, -1.0)
    bump = 16.0 * np.exp(-(((travel - 1.5) / 0.4) ** 2))
    stop = 120.0 * 0.06 * np.logaddexp(0.0, (travel - 3.6) / 0.06)
    load = 28.0 * (1.0 - np.exp(-travel / 0.15)) + 5.0 * travel + bump + stop + side * (2.0 + 0.1 * bump)
    load += np.random.default_rng(1).normal(0.0, 0.3, len(time))
    columns = np.column_stack([time, travel, load])
    np.savetxt(file, columns, "%.4f", ",", header="time_s,travel_mm,force_gf", comments="")


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        button = Path(name) / "button.csv"
        write_button(button)
        command = [sys.executable, "-m", "palpate", "app", str(button), "--no-browser", "--json"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as app:
            assert app.stdout is not None
            address = json.loads(app.stdout.readline())["address"]
            with chromium(Path(name) / "profile") as page:
                page.size(WIDTH, HEIGHT)
                page.call("Page.navigate", url=address)
                page.wait("document.getElementById('identify') !== null && !document.body.ariaBusy")
                page.click("#identify")
                page.wait("document.getElementById('chart-model') !== null && !document.body.ariaBusy")
                page.run("document.querySelector('[aria-labelledby=title-model]').scrollIntoView()")
                page.screenshot(ROOT / "docs" / "figures" / "app.png")
            app.terminate()


if __name__ == "__main__":
    main()
