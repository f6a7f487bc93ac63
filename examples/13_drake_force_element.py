# SPDX-License-Identifier: Apache-2.0
"""
A force element in Drake
========================

A model becomes a force element of the simulator Drake, whose implicit integrators take steps of 5 ms on a key
switch of 3 g. Without Drake (``pip install drake``, 167 MB) this example draws only the force.
"""

import matplotlib.pyplot as plt

import palpate.plotting

try:
    import pydrake.all as drake
except ImportError:
    drake = None

# %%
# The tactile switch has a travel of 4 mm. Its force drops by 0.4 N after 1.8 mm and rises steeply at the end.
wavelets = {"alpha": [[2500.0], [5000.0]], "beta": [[0.0018], [0.00445]], "weight": [-0.25, 4.0]}
line = {"linear": [100.0], "bias": 0.4, "lower": [0.0], "upper": [0.004]}
switch = palpate.Model.from_network(units={"position": "m", "force": "N"}, **wavelets, **line)


# %%
# The force element presses a joint with 0.9 N against the force of the switch. The damping is 1 N·s/m.
class ForceElement(drake.VectorSystem if drake else object):
    def DoCalcVectorOutput(self, context, motion, state, force):
        force[:] = 0.9 - switch.force(motion[0])


def press(integrator, step):
    """Returns the positions (n,) [m] of the key in the first 50 ms."""
    builder = drake.DiagramBuilder()
    plant = builder.AddSystem(drake.MultibodyPlant(time_step=0.0))
    key = plant.AddRigidBody("key", drake.SpatialInertia.SolidSphereWithMass(0.003, 0.005))
    plant.AddJoint(drake.PrismaticJoint("key", plant.world_frame(), key.body_frame(), [1, 0, 0], damping=1.0))
    plant.Finalize()
    element = builder.AddSystem(ForceElement(2, 1, True))
    builder.Connect(plant.get_state_output_port(), element.get_input_port())
    builder.Connect(element.get_output_port(), plant.get_applied_generalized_force_input_port())
    motion = drake.LogVectorOutput(plant.get_state_output_port(), builder, step)
    simulator = drake.Simulator(builder.Build())
    fixed = {"integration_scheme": integrator, "max_step_size": step, "use_error_control": False}
    drake.ApplySimulatorConfig(drake.SimulatorConfig(**fixed), simulator)
    simulator.AdvanceTo(0.05)
    return motion.FindLog(simulator.get_context()).data()[0]


# %%
# The explicit method diverges with steps of 5 ms. The implicit methods are stable.
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
palpate.plotting.plot(switch, left)
right.set(xlabel="time [steps of 5 ms]", ylabel="position [mm]", ylim=(0.0, 6.0))
if drake:
    exact = press("runge_kutta3", 2e-5)[::250]
    for integrator in ("runge_kutta3", "implicit_euler", "radau3"):
        positions = press(integrator, 5e-3)
        error = 1e6 * ((positions - exact) ** 2).mean() ** 0.5
        print(f"{integrator}, steps of 5 ms: RMS error {error:.3g} µm")
        right.plot(1e3 * positions, "o-", markersize=3, label=integrator)
    right.plot(1e3 * exact, "k.", label="fine steps")
    right.legend()

# %%
# Result
# ------
# This element fails for a model with hysteresis: an integrator tries steps and repeats them, and the play
# operator may move only in accepted steps. Drake's Python binding computes the derivative by differences.
print(f"radau3 is within {error:.0f} µm, explicit steps diverge" if drake else "skipped: needs Drake")
plt.show()
