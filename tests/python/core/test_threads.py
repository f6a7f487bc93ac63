# SPDX-License-Identifier: Apache-2.0
"""Threads of Python: calculations that release the global lock give the same results at the same time."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from typing import Any

import numpy as np
import pytest

from any_input import SCALE
from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import Hand, plan, simulate, verify
from palpate.identification import IdentifyOptions, fit_environment
from palpate.recording.sample import sample_recording

THREADS = 4
ROUNDS = 2 if SCALE == 1 else 5


def evaluation() -> Any:
    """Returns forces of an array with models of this thread."""
    x = np.linspace(-0.2, 0.8, 20_000)
    return [model_by_hand().force(x), keyswitch_by_hand().force(x, direction=np.ones(len(x)))]


def rendering() -> Any:
    planned = plan(model_by_hand(), "bench-knob")
    assert planned.certificate is not None
    trace = simulate(planned, planned.certificate.device, Hand(), duration=0.5)
    return [trace.force, trace.position]


def fitting() -> Any:
    x = np.linspace(0.0, 1.0, 200)
    force = np.sin(6.0 * x) + np.random.default_rng(0).normal(0.0, 0.05, len(x))
    fitted = fit_environment(x[:, None], force, None, IdentifyOptions(max_wavelets=2))
    return [fitted.weight, fitted.alpha]


@pytest.mark.parametrize("work", [evaluation, rendering, fitting])
def test_threads_with_separate_objects_give_the_results_of_one_thread(work: Callable[[], Any]) -> None:
    alone, start = work(), Barrier(THREADS)

    def together() -> list[Any]:
        start.wait()
        return [work() for _ in range(ROUNDS)]

    with ThreadPoolExecutor(THREADS) as pool:
        futures = [pool.submit(together) for _ in range(THREADS)]
    for future in futures:
        for results in future.result():
            for result, expected in zip(results, alone, strict=True):
                assert np.array_equal(result, expected)


def test_threads_read_one_model_at_the_same_time() -> None:
    model, recording = model_by_hand(), sample_recording(seed=1)
    x = np.linspace(-0.2, 0.8, 20_000)
    alone, start = (model.force(x), verify(model, recording).nrmse), Barrier(THREADS)

    def together() -> list[tuple[Any, float]]:
        start.wait()
        return [(model.force(x), verify(model, recording).nrmse) for _ in range(ROUNDS)]

    with ThreadPoolExecutor(THREADS) as pool:
        futures = [pool.submit(together) for _ in range(THREADS)]
    for future in futures:
        for force, nrmse in future.result():
            assert np.array_equal(force, alone[0])
            assert nrmse == alone[1]
