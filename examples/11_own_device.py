# SPDX-License-Identifier: Apache-2.0
"""
Own device in C++
=================

A device is any class with ``open``, ``exchange`` and ``close``. ``11_own_device.cpp`` contains one in 25
lines, a pendulum with a motor, and renders virtual springs on it. This page compiles and runs that program.
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

# %%
# .. literalinclude:: /../examples/11_own_device.cpp
#    :language: c++
#
# The headers need no library besides the standard one.
try:
    here = Path(__file__).resolve().parent
except NameError:  # a notebook has no file name
    here = Path.cwd()
compiler = shutil.which("c++") or "c++"
with tempfile.TemporaryDirectory() as folder:
    program, table = Path(folder) / "pendulum", Path(folder) / "motion.csv"
    headers = here.parent / "cpp" / "include"
    subprocess.run(
        [compiler, "-std=c++20", "-I", headers, here / "11_own_device.cpp", "-o", program], check=True
    )
    print(subprocess.run([program, table], check=True, capture_output=True, text=True).stdout, end="")
    motion = pd.read_csv(table)

# %%
# The spring adds to gravity, so the pendulum swings faster.
figure, axes = plt.subplots(layout="constrained")
for stiffness, rows in motion[motion["time_s"] < 3.0].groupby("stiffness"):
    axes.plot(rows["time_s"], rows["angle_rad"], label=f"spring {stiffness} N·m/rad")
axes.set(xlabel="time [s]", ylabel="angle [rad]")
axes.legend(loc="upper right")

# %%
# Result
# ------
# The printed frequencies agree with the theory of small swings. Without damping this device fails to be
# passive: the held force is half a sample late, so the swing grows slowly. See
# :doc:`09_certificate_and_device`.
plt.show()
