# SPDX-License-Identifier: Apache-2.0
"""An identification uses one thread, also as the first work of a program."""

import os
import subprocess
import sys

PROGRAM = """
from palpate.identification.threads import one_thread
with one_thread():
    import numpy, scipy.linalg
    from threadpoolctl import threadpool_info
    libraries = [each for each in threadpool_info() if each["user_api"] == "blas"]
assert {each["num_threads"] for each in libraries} == {1}, libraries
"""


def test_every_matrix_library_is_limited_to_one_thread_in_a_new_program() -> None:
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    subprocess.run([sys.executable, "-c", PROGRAM], check=True, env=environment)
