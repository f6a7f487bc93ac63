# SPDX-License-Identifier: Apache-2.0
"""Settings of tests with generated inputs (Hypothesis), and the check of an error message."""

import os
from typing import Any

from hypothesis import HealthCheck, settings

from palpate.errors import escaped

SCALE = int(os.environ.get("PALPATE_TEST_SCALE", "1"))


def cases(count: int) -> Any:
    """Returns the settings of a test with this number of inputs; the long run has more of them, at random."""
    return settings(
        max_examples=count * SCALE,
        derandomize=SCALE == 1,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        print_blob=True,
    )


def is_one_sentence(text: str) -> bool:
    """Returns True if a message is one line without control characters, and not longer than a page."""
    return escaped(text) == text and 0 < len(text) < 4000
