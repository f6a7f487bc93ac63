# SPDX-License-Identifier: Apache-2.0
"""A recording as a DataFrame that is read back exactly, as a figure, and as HTML."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate import Recording, read_recording
from palpate.plotting import plot
from palpate.recording.sample import sample_recording

N = 40
X = np.linspace(0.0, 0.00317, N)
F = 1.0 / 3.0 + 100.0 * X


def recordings() -> dict[str, Recording]:
    units = {"position": "m", "force": "N"}
    with_columns: dict[str, Any] = {"lateral_m": np.sqrt(X), "grip": X**2}
    whole = Recording.from_arrays(
        X,
        F,
        np.arange(N) * 0.1,
        np.resize([1, 0, -1], N),
        inputs=with_columns,
        units=units,
        metadata={"hand": "left", "simulated": "yes"},
    )
    from_file = Recording.from_frame(
        whole.to_frame().assign(operator="A", residual_N=np.cbrt(X)), inputs=["grip"]
    )
    return {
        "everything": whole,
        "further columns": from_file,
        "units unstated": Recording.from_arrays(X, F),
        "torque": sample_recording(1, 0.1),
        "current": Recording.from_arrays(X, F, units={"position": "rad", "force": "A"}),
    }


def assert_equal(one: Recording, other: Recording) -> None:
    for name in ("position", "force", "time", "direction", "inputs"):
        values, expected = getattr(one, name), getattr(other, name)
        assert (values is None) == (expected is None), name
        if expected is not None:
            assert values.dtype == expected.dtype
            np.testing.assert_array_equal(values, expected)
    for name in ("input_names", "metadata", "units"):
        assert getattr(one, name) == getattr(other, name), name
    assert list(one.columns) == list(other.columns)
    for name, cells in one.columns.items():
        np.testing.assert_array_equal(cells, other.columns[name])


@pytest.mark.parametrize("name", recordings())
def test_a_frame_is_read_back_exactly(name: str) -> None:
    recording = recordings()[name]
    assert_equal(Recording.from_frame(recording.to_frame()), recording)


@pytest.mark.parametrize("name", ["torque", "current"])
def test_a_frame_written_by_pandas_is_read_back_exactly(name: str, tmp_path: Path) -> None:
    recording = recordings()[name]
    recording.to_frame().to_csv(tmp_path / "a.csv", index=False)
    read = read_recording(tmp_path / "a.csv")
    np.testing.assert_array_equal(read.position, recording.position)
    np.testing.assert_array_equal(read.force, recording.force)
    assert read.units == recording.units


def test_the_columns_of_a_frame_name_their_units() -> None:
    frame = recordings()["everything"].to_frame()
    assert list(frame.columns) == ["time_s", "position_m", "force_N", "direction", "lateral_m", "grip"]
    frame["force_N"] = 0.0
    assert list(recordings()["torque"].to_frame().columns) == ["time_s", "position_rad", "force_Nm"]


def test_a_frame_does_not_share_memory_with_its_recording() -> None:
    recording = sample_recording(1, 0.1)
    frame = recording.to_frame()
    frame.loc[0, "force_Nm"] = 99.0
    assert recording.force[0] != 99.0


def test_plot_draws_on_the_given_axes_with_units() -> None:
    given = Figure().subplots()
    axes = plot(recordings()["everything"], given)
    assert axes is given
    assert axes.get_xlabel() == "position [mm]"
    assert axes.get_ylabel() == "force [N]"
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["simulated, press", "simulated, release"]


def test_html_begins_with_the_verdict_and_escapes_text() -> None:
    recording = Recording.from_arrays(X, F, metadata={"<b>hand</b>": "<script>alert(1)</script>"})
    html = recording._repr_html_()
    assert html.index("verdict") < html.index("rows")
    assert "<script" not in html
    assert "<b>hand" not in html
    assert "&lt;script&gt;" in html


def test_the_verdict_of_a_recording_names_its_defects() -> None:
    assert sample_recording(1, 5.0).verdict.level == "good"
    stroke = np.concatenate([np.linspace(0.0, 4.0, 300), np.linspace(4.0, 0.0, 300)])
    clipped = Recording.from_arrays(
        stroke, np.minimum(stroke, 2.0), units={"position": "rad", "force": "N*m"}
    )
    assert clipped.verdict.level == "usable"
    assert clipped.verdict.reasons[0] in clipped._repr_html_().replace("&#x27;", "'")
