// SPDX-License-Identifier: Apache-2.0
// MuJoCo plugin palpate.joint_force: passive force of a model file on a slide or hinge joint.

#include <mujoco/mujoco.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "joint_force.hpp"
#include "palpate/io/model_file.hpp"

namespace {

using palpate::JointMethod;
using palpate::JointStep;
using palpate::ModelOnJoint;

/// One plugin instance in one mjData.
struct Instance {
    int joint;
    ModelOnJoint model;
};

Instance& instance_in(const mjData* d, int instance) {
    return *reinterpret_cast<Instance*>(d->plugin_data[instance]);  // NOLINT(performance-no-int-to-ptr)
}

std::string setting(const mjModel* m, int instance, const char* name) {
    const char* value = mj_getPluginConfig(m, instance, name);
    return value == nullptr ? "" : value;
}

int joint_of(const mjModel* m, int instance) {
    return mj_name2id(m, mjOBJ_JOINT, setting(m, instance, "joint").c_str());
}

JointMethod method_of(const mjModel* m, int instance) {
    const std::string method = setting(m, instance, "method");
    if (method != "" && method != "implicit" && method != "energy-consistent") {
        throw std::invalid_argument("method is '" + method + "': must be energy-consistent or implicit");
    }
    return method == "implicit" ? JointMethod::Implicit : JointMethod::EnergyConsistent;
}

Instance load(const mjModel* m, int instance) {
    const std::string name = setting(m, instance, "joint");
    const int joint = joint_of(m, instance);
    if (joint < 0) {
        throw std::invalid_argument("joint is '" + name + "': must be the name of a joint");
    }
    const bool slides = m->jnt_type[joint] == mjJNT_SLIDE;
    if (!slides && m->jnt_type[joint] != mjJNT_HINGE) {
        throw std::invalid_argument("joint '" + name + "' must be a slide or hinge joint");
    }
    const std::string path = setting(m, instance, "model");
    const palpate::ModelFile file = palpate::load_model_file(path);
    const std::string position = slides ? "m" : "rad";
    const std::string force = slides ? "N" : "N*m";
    if ((file.position_unit != position && file.position_unit != "") ||
        (file.force_unit != force && file.force_unit != "")) {
        throw std::invalid_argument(path + ": the units are " + file.position_unit + " and " +
                                    file.force_unit + ", must be " + position + " and " + force +
                                    " for the joint '" + name + "'");
    }
    return {joint, ModelOnJoint{file.model, method_of(m, instance)}};
}

/// Calls `work`, and reports an exception as an error of MuJoCo. mju_error does not return, so the message is copied to
/// memory that needs no destructor.
template <class Work>
void report_errors(Work work) {
    thread_local std::array<char, 1000> message{};
    try {
        work();
        return;
    } catch (const std::exception& error) {
        std::snprintf(message.data(), message.size(), "palpate.joint_force: %s", error.what());
    }
    mju_error("%s", message.data());
}

int init(const mjModel* m, mjData* d, int instance) {
    report_errors([&] {
        d->plugin_data[instance] = reinterpret_cast<std::uintptr_t>(new Instance{load(m, instance)});
    });
    return 0;
}

void destroy(mjData* d, int instance) {
    delete &instance_in(d, instance);
    d->plugin_data[instance] = 0;
}

/// Sets the model at rest at the joint's position in the initial configuration.
void reset(const mjModel* m, mjtNum* plugin_state, void* /*plugin_data*/, int instance) {
    const int joint = joint_of(m, instance);
    if (joint >= 0) {
        ModelOnJoint::start(m->qpos0[m->jnt_qposadr[joint]], plugin_state);
    }
}

/// Returns the acceleration of all degrees of freedom by the forces that do not belong to this plugin, without those of
/// constraints. The array lies on MuJoCo's stack.
mjtNum* free_acceleration(const mjModel* m, mjData* d) {
    mjtNum* force = mj_stackAllocNum(d, m->nv);
    mjtNum* acceleration = mj_stackAllocNum(d, m->nv);
    // MuJoCo computes bias and actuators after the passive forces, so the arrays in mjData are those of the last step.
    mj_rne(m, d, 0, acceleration);
    if (m->nu > 0) {
        mj_fwdActuation(m, d);
    }
    for (int k = 0; k < m->nv; ++k) {
        force[k] = d->qfrc_passive[k] + d->qfrc_applied[k] + d->qfrc_actuator[k] - acceleration[k];
    }
    for (int body = 1; body < m->nbody; ++body) {
        const mjtNum* applied = d->xfrc_applied + 6 * body;
        if (!mju_isZero(applied, 6)) {
            mj_applyFT(m, d, applied, applied + 3, d->xipos + 3 * body, body, force);
        }
    }
    mj_solveM(m, d, acceleration, force, 1);
    return acceleration;
}

/// Returns the part h d of the joint's own damping d that the integrator treats implicitly [N*s^2/m].
double implicit_damping(const mjModel* m, int dof) {
    const bool explicit_euler =
        m->opt.integrator == mjINT_EULER && (m->opt.disableflags & mjDSBL_EULERDAMP) != 0;
    return explicit_euler ? 0.0 : m->opt.timestep * m->dof_damping[dof];
}

void compute(const mjModel* m, mjData* d, int instance, int /*capability*/) {
    if (m->opt.integrator == mjINT_RK4) {
        mju_error(
            "palpate.joint_force: the integrator is RK4: must be Euler, implicit, implicitfast or discrete");
    }
    Instance& on_joint = instance_in(d, instance);
    const int dof = m->jnt_dofadr[on_joint.joint];
    mj_markStack(d);
    const double acceleration = free_acceleration(m, d)[dof];
    mjtNum* response = mj_stackAllocNum(d, m->nv);
    mjtNum* unit_force = mj_stackAllocNum(d, m->nv);
    mju_zero(unit_force, m->nv);
    unit_force[dof] = 1.0;
    mj_solveM(m, d, response, unit_force, 1);
    const double mobility = response[dof];
    mj_freeStack(d);
    // Formula of Sherman and Morrison for the inverse of M + h d e e', the matrix of the integrator's step.
    const double share = 1.0 / (1.0 + implicit_damping(m, dof) * mobility);
    const mjtNum* stored = d->plugin_state + m->plugin_stateadr[instance];
    const double all = acceleration + ModelOnJoint::by_constraints(stored);
    const JointStep step{d->qpos[m->jnt_qposadr[on_joint.joint]], d->qvel[dof], share * all, share * mobility,
                         m->opt.timestep};
    d->qfrc_passive[dof] -= on_joint.model.force(step, stored);
}

void advance(const mjModel* m, mjData* d, int instance) {
    const Instance& on_joint = instance_in(d, instance);
    const int dof = m->jnt_dofadr[on_joint.joint];
    on_joint.model.advance(d->qpos[m->jnt_qposadr[on_joint.joint]], d->qacc[dof] - d->qacc_smooth[dof],
                           d->plugin_state + m->plugin_stateadr[instance]);
}

}  // namespace

mjPLUGIN_LIB_INIT(palpate) {
    static const std::array<const char*, 3> attributes{"model", "joint", "method"};
    mjpPlugin plugin;
    mjp_defaultPlugin(&plugin);
    plugin.name = "palpate.joint_force";
    plugin.nattribute = static_cast<int>(attributes.size());
    plugin.attributes = attributes.data();
    plugin.capabilityflags = mjPLUGIN_PASSIVE;
    plugin.nstate = [](const mjModel*, int) { return ModelOnJoint::states; };
    plugin.init = init;
    plugin.destroy = destroy;
    plugin.reset = reset;
    plugin.compute = compute;
    plugin.advance = advance;
    mjp_registerPlugin(&plugin);
}
