# SPDX-License-Identifier: Apache-2.0
"""Story 1: a detent under the finger, rendered five ways. The same story is told in 01_detent.cpp.

python examples/01_detent.py
"""

import palpate
from palpate.planning import force_error

# 1. The object: a soft spring of 2 N*m/rad with a detent at 0.2 rad. Usually a recording gives it, by
#    palpate.identify; here one wavelet is written down by hand.
detent = palpate.Model.from_network(
    units={"position": "rad", "force": "N*m"},
    alpha=[[30.0]],
    beta=[[0.2]],
    weight=[-0.3],
    linear=[2.0],
    lower=[0.0],
    upper=[0.5],
)

# 2. The device and the hand: a knob with a 16-bit encoder at 1 kHz, swept through the detent. Simulated.
device, hand = palpate.DeviceProfile(), palpate.Hand()

# 3. The structures, from the simplest to the one of the paper.
schemes = {
    "direct": palpate.Scheme(structure="direct"),
    "massless, compensated": palpate.Scheme(structure="massless", compensated=True, coupling_damping=0.005),
    "massless": palpate.Scheme(structure="massless"),
    "implicit": palpate.Scheme(structure="implicit"),
    "explicit": palpate.Scheme(structure="explicit"),
}

# 4. Render each for four seconds, and ask how far the force is from the object's at the handle.
for name, scheme in schemes.items():
    plan = palpate.Plan(detent, scheme)
    error = force_error(plan, palpate.simulate(plan, device, hand, 4.0))
    print(f"{name:<22} force error {error.end:.5f} N*m RMS")
