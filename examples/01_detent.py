# SPDX-License-Identifier: Apache-2.0
"""Example 1: renders a detent with five structures. 01_detent.cpp does the same in C++.

python examples/01_detent.py
"""

import palpate
from palpate.planning import force_error

# 1. Define the object: a soft spring of 2 N*m/rad with a detent at 0.2 rad. Here the network has one wavelet;
#    usually palpate.identify computes the model from a recording.
detent = palpate.Model.from_network(
    units={"position": "rad", "force": "N*m"},
    alpha=[[30.0]],
    beta=[[0.2]],
    weight=[-0.3],
    linear=[2.0],
    lower=[0.0],
    upper=[0.5],
)

# 2. Choose a simulated device and hand: a knob with a 16-bit encoder at 1 kHz, moved through the detent.
device, hand = palpate.DeviceProfile(), palpate.Hand()

# 3. List the structures, from direct rendering to the explicit one, which the paper uses.
schemes = {
    "direct": palpate.Scheme(structure="direct"),
    "massless, compensated": palpate.Scheme(structure="massless", compensated=True, coupling_damping=0.005),
    "massless": palpate.Scheme(structure="massless"),
    "implicit": palpate.Scheme(structure="implicit"),
    "explicit": palpate.Scheme(structure="explicit"),
}

# 4. Render the object with each structure for four seconds and print the force error at the handle.
for name, scheme in schemes.items():
    plan = palpate.Plan(detent, scheme)
    error = force_error(plan, palpate.simulate(plan, device, hand, 4.0))
    print(f"{name:<22} force error {error.end:.5f} N*m RMS")
