# SPDX-License-Identifier: Apache-2.0
"""
A force element in Drake
========================

A model becomes a force element of the simulator Drake: a system whose input is the position of a joint and
whose output is the force on this joint. Drake's implicit integrators then take steps of 5 ms on a key switch
of 3 g. Without Drake (``pip install drake``, 167 MB) this example draws only the force.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate

try:
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
    from pydrake.systems.framework import DiagramBuilder, LeafSystem
    from pydrake.systems.primitives import LogVectorOutput
except ImportError:
    LeafSystem = object
    print("skipped: needs Drake, pip install drake")

# %%
# The tactile switch has a travel of 4 mm. Its force drops by 0.4 N after 1.8 mm and rises steeply at the end.
wavelets = {"alpha": [[2500.0], [5000.0]], "beta": [[0.0018], [0.00445]], "weight": [-0.25, 4.0]}
line = {"linear": [100.0], "bias": 0.4, "lower": [0.0], "upper": [0.004]}
switch = palpate.Model.from_network(units={"position": "m", "force": "N"}, **wavelets, **line)


# %%
# The force element reads position and velocity of the joint, and returns the force of the switch.
class ForceElement(LeafSystem):
    """Applies the force of a model to a joint."""

    def __init__(self, model):
        super().__init__()
        motion = self.DeclareVectorInputPort("position_and_velocity", 2)

        def compute(context, force):
            force.SetAtIndex(0, -model.force(motion.Eval(context)[0]))

        self.DeclareVectorOutputPort("force", 1, compute)


# %%
# The key has a damping of 1 N·s/m. A constant force of 0.9 N presses it for 50 ms.
def press(integrator, step, duration=0.05):
    """Returns times (n,) [s] and positions (n,) [m] of the key."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(time_step=0.0))
    key = plant.AddRigidBody("key", SpatialInertia.SolidSphereWithMass(0.003, 0.005))
    plant.AddJoint(PrismaticJoint("key", plant.world_frame(), key.body_frame(), [0, 0, -1], damping=1.0))
    plant.gravity_field().set_gravity_vector([0, 0, -0.9 / 0.003])
    plant.Finalize()
    element = builder.AddSystem(ForceElement(switch))
    builder.Connect(plant.get_state_output_port(), element.get_input_port())
    builder.Connect(element.get_output_port(), plant.get_applied_generalized_force_input_port())
    motion = LogVectorOutput(plant.get_state_output_port(), builder, step)
    simulator = Simulator(builder.Build())
    fixed = SimulatorConfig(integration_scheme=integrator, max_step_size=step, use_error_control=False)
    ApplySimulatorConfig(fixed, simulator)
    simulator.AdvanceTo(duration)
    log = motion.FindLog(simulator.get_context())
    return log.sample_times(), log.data()[0]


# %%
# The explicit method diverges with steps of 5 ms. The implicit methods are stable.
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")
depth = np.linspace(0.0, 0.0042, 400)
left.plot(1e3 * depth, switch.force(depth), "k")
left.set(xlabel="position [mm]", ylabel="force [N]")
right.set(xlabel="time [ms]", ylabel="position [mm]", ylim=(0.0, 6.0))
errors = {}
if LeafSystem is not object:
    fine_times, fine = press("runge_kutta3", 2e-5)
    right.plot(1e3 * fine_times, 1e3 * fine, "0.6", linewidth=3, label="fine steps")
    for integrator in ("runge_kutta3", "implicit_euler", "radau3"):
        times, positions = press(integrator, 5e-3)
        errors[integrator] = 1e6 * np.sqrt(np.mean((positions - fine[::250]) ** 2))
        print(f"{integrator}, steps of 5 ms: RMS error {errors[integrator]:.3g} µm")
        right.plot(1e3 * times, 1e3 * positions, "o-", markersize=3, label=integrator)
    right.legend()

# %%
# Result
# ------
# This element fails for a model with hysteresis: an integrator tries steps and repeats them, and the play
# operator may move only in accepted steps. Drake's Python binding computes the derivative by differences.
if errors:
    print(f"radau3 is within {errors['radau3']:.0f} µm, explicit steps diverge")
plt.show()
