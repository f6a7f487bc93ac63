# SPDX-License-Identifier: Apache-2.0
"""Example 3: records, identifies and renders a switch, then records and identifies the rendered one.

python examples/03_there_and_back.py

03_there_and_back.cpp does the same in C++. Everything is simulated. The commands for a real switch and knob:

palpate record real.csv --device usb --probe --upper 0.3
palpate identify real.csv -o real.json
palpate-control real.json --device usb --uncertified --record rendered.csv
palpate identify rendered.csv -o again.json
palpate show real.json --beside again.json
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import palpate
from palpate.planning import force_at, rig_for
from palpate.verification import compare

folder = tempfile.TemporaryDirectory()
real_csv, rendered_csv = (Path(folder.name) / name for name in ("real.csv", "rendered.csv"))

# 1. Record the switch of example 2: press and release it four times, slowly, with a 16-bit encoder.
switch = palpate.load_model(Path(__file__).with_name("02_click.json"))
rig = rig_for(switch)
time = np.arange(8000) * rig.device.period_s
travel, step = switch.upper[0] - switch.lower[0], rig.device.encoder_step
motion = switch.lower[0] + travel * (0.5 - 0.5 * np.cos(np.pi * time))
position = step * np.floor(motion / step + 0.5)
direct_plan = palpate.Plan(switch, rig.scheme(switch, structure="direct"))
force = np.round(force_at(direct_plan, position), 4)  # the force transducer has steps of 0.1 mN*m
palpate.Recording.from_arrays(position, force, time, units={"position": "rad", "force": "N*m"}).write(
    real_csv
)

# 2. Identify a model from the recording.
real = palpate.identify(palpate.read_recording(real_csv))
strokes = "press and release differ" if real.hysteretic else "one stroke"
print(f"identified: {real.fit.n_wavelets} wavelets, {strokes}")

# 3. Render the model on a free knob that a hand moves through the domain. The coupling softens the click.
rig = rig_for(real)
rendered = palpate.simulate(palpate.Plan(real, rig.scheme(real)), rig.device, rig.hand, 8.0)
replace(rendered, force=np.round(rendered.force, 4)).write(rendered_csv)

# 4. Identify the recording of the rendered force.
second = palpate.identify(palpate.read_recording(rendered_csv))

# 5. Compare the real and the rendered force of each stroke.
for stroke in compare(real, second):
    difference, largest = np.max(np.abs(stroke.second - stroke.first)), np.max(np.abs(stroke.first))
    print(f"{stroke.name or 'both strokes'}: largest difference {difference:.3f} N*m of {largest:.2f} N*m")
folder.cleanup()
