#include "magshell/solve/motion/motion_balance.h"

#include <algorithm>
#include <utility>

#include "magshell/scene/term_forces.h"
#include "magshell/solve/globalization/obstacle_sides.h"

namespace magshell {
namespace {

using BalanceRows = MotionBalance::Rows;

// [-] Step of the central difference of an energy with respect to the parameters that vary in time, as a fraction of their
// change in a time step; see test_work_of_a_moving_magnet.
constexpr double difference = 1e-3;

// The derivatives, times the length of a step, of the polynomial through its parameters, at the times of its beginning (0) and of its
// stages (i + 1): row by row the weights of these parameters.
Eigen::MatrixXd polynomial_derivatives(const Tableau& tableau) {
    const int n = tableau.stages + 1;
    VectorXd at = VectorXd::Zero(n);
    for (int i = 0; i < tableau.stages; ++i) at[i + 1] = tableau.time(i);
    Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(n, n);
    for (int j = 0; j < n; ++j)
        for (int m = 0; m < n; ++m)
            for (int left_out = 0; left_out < n; ++left_out) {
                if (left_out == m) continue;
                double product = 1.0 / (at[m] - at[left_out]);
                for (int k = 0; k < n; ++k)
                    if (k != m && k != left_out) product *= (at[j] - at[k]) / (at[m] - at[k]);
                weights(j, m) += product;
            }
    return weights;
}

class Accountant {
  public:
    Accountant(Model& model, const MotionInput& input, Newton& newton)
        : model_(model),
          input_(input),
          stepper_(newton, input.tableau, input.inertia, input.viscosity, input.projective),
          terms_(model) {
        sums_ = BalanceRows::Zero(terms_.rows() + MotionBalance::further_forces, 7);
        driven_ = VectorXd::Zero(terms_.energies());
        is_rigid_ = terms_.nodes_of_rigid_parts();
    }

    Stepper& stepper() { return stepper_; }

    /// Returns the sums so far, and the energies at this state.
    MotionBalance::State state(const MotionState& at, const LoadParameters& load_parameters);
    /// Adds the work and the impulses of a step from record.begin to `end`.
    void add(const StepAlgebra& step, const SubstepRecord& record, const MotionState& end,
             std::span<const LoadParameters> load_parameters);

  private:
    // The rates of all sums in one state, in columns: power, force (3), moment (3). reactions: what supports, joints and motors add to the other
    // forces, on all dofs.
    struct Rates {
        BalanceRows forces;
        VectorXd reactions;
    };
    // A state within a step; x_hat and v_hat are those of a stage of this duration.
    struct Instant {
        const VectorXd& q;
        const Model::AngleBranches& angle_branches;
        const LoadParameters& load_parameters;
        const VectorXd &v, &acceleration, &momentum_rate;
        StageMotion motion;
    };

    Index further(MotionBalance::FurtherForce kind) const { return terms_.rows() + kind; }
    void set_state(const VectorXd& q, const Model::AngleBranches& angle_branches,
                   const LoadParameters& load_parameters) {
        model_.set_angle_branches(angle_branches);
        model_.parameters().set_time_varying(load_parameters);
        model_.linearize(q);
    }
    // Adds a force on all dofs to a row, for nodes at q that move with v.
    void add_force(const VectorXd& force, const VectorXd& q, const VectorXd& v, Index row,
                   BalanceRows& to) const;
    // Returns the motions of all nodes in three translations and three rotations about the axes; directions only rotate.
    std::array<VectorXd, 6> rigid_motions(const VectorXd& q) const;
    // Returns the parts of a motion that constraints prescribe: on nodes of rigid bodies, and on all others.
    std::pair<VectorXd, VectorXd> prescribed_parts(const VectorXd& motion) const;
    // Adds the reactions of supports and of joints, and what is left over. Masses that supports move count in add().
    void add_reactions(const VectorXd& reactions, const VectorXd& inertial, const VectorXd& q,
                       const VectorXd& v, BalanceRows& to) const;
    // Evaluates all forces but those of implicit contact. elastic, joints: the rates of the strains at this state.
    Rates rates(const Instant& at, bool implicit_contact, const StrainRates& elastic,
                const StrainRates& joints);
    // Evaluates implicit contact at the end of a step.
    Rates contact_rates(const Instant& at, const VectorXd& mean_velocity, const VectorXd& by_contact);
    void add_viscous(const Instant& at, const StrainRates& elastic, const StrainRates& joints, Rates& to);
    // Adds the momentum of the fluid, whose momentum and energy count as the scene's: the force that only moves energy between
    // body and fluid does no work, and v x p is a part of the moment of a node.
    void add_fluid(const Instant& at, Rates& to);
    // Adds the work of parameters that change by `change` on the energies, without or with only implicit contact, and that of
    // the motors and directions that follow them.
    void add_driven(const VectorXd& q, const VectorXd& v, const Model::AngleBranches& angle_branches,
                    const LoadParameters& load_parameters, const LoadParameters& change,
                    const VectorXd& reactions, bool contact, bool others);
    // Adds the strain rates of one kind to those of a step.
    void add_strain_rates(const StepAlgebra& step, const SubstepRecord& record,
                          std::span<const LoadParameters> load_parameters, const Viscosity& law,
                          ViscousTerms& terms, ViscousStage::Kind kind, const MaxwellStrains& e,
                          std::vector<StageRates>& all);
    // Kinetic energy [J] and angular momentum [N m s] of the masses that supports hold.
    Eigen::Vector4d held_inertia(const VectorXd& q, const VectorXd& v) const;

    Model& model_;
    const MotionInput& input_;
    Stepper stepper_;
    const TermForces terms_;
    std::vector<char> is_rigid_;
    BalanceRows sums_;
    VectorXd driven_;
    Rates
        last_;  // at the end of the last step, with which a method that begins explicitly goes on; empty before
};

void Accountant::add_force(const VectorXd& force, const VectorXd& q, const VectorXd& v, Index row,
                           BalanceRows& to) const {
    const Index vertices = model_.nodes().n_vertices(), nodes = model_.nodes().n_nodes();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), moment = sum;
    for (Index node = 0; node < nodes; ++node) {
        const Eigen::Vector3d of_node = force.segment<3>(3 * node), place = q.segment<3>(3 * node);
        if (node < vertices) sum += of_node;
        moment += place.cross(of_node);
    }
    to(row, 0) += force.head(3 * nodes).dot(v.head(3 * nodes));
    to.row(row).segment<3>(1) += sum;
    to.row(row).segment<3>(4) += moment;
}

std::array<VectorXd, 6> Accountant::rigid_motions(const VectorXd& q) const {
    std::array<VectorXd, 6> motions;
    for (VectorXd& each : motions) each = VectorXd::Zero(q.size());
    const Index vertices = model_.nodes().n_vertices(), nodes = model_.nodes().n_nodes();
    for (Index node = 0; node < nodes; ++node)
        for (int axis = 0; axis < 3; ++axis) {
            if (node < vertices) motions[axis][3 * node + axis] = 1.0;
            motions[3 + axis].segment<3>(3 * node) =
                Eigen::Vector3d::Unit(axis).cross(Eigen::Vector3d(q.segment<3>(3 * node)));
        }
    return motions;
}

std::pair<VectorXd, VectorXd> Accountant::prescribed_parts(const VectorXd& motion) const {
    const VectorXd part = motion - model_.dof_map().project(motion);
    std::pair<VectorXd, VectorXd> parts{VectorXd::Zero(part.size()), VectorXd::Zero(part.size())};
    for (Index node = 0; node < model_.nodes().n_nodes(); ++node)
        (is_rigid_[node] ? parts.first : parts.second).segment<3>(3 * node) = part.segment<3>(3 * node);
    return parts;
}

void Accountant::add_reactions(const VectorXd& reactions, const VectorXd& inertial, const VectorXd& q,
                               const VectorXd& v, BalanceRows& to) const {
    const Index supports = further(MotionBalance::supports), joints = further(MotionBalance::joints),
                left = further(MotionBalance::left_over);
    const bool constrained = model_.dof_map().has_supports() || model_.dof_map().has_reduced_coordinates();
    const std::array<VectorXd, 6> motions = rigid_motions(q);
    const auto add_all = [&](const VectorXd& motion, int column) {
        const double all = reactions.dot(motion);
        if (!constrained) {
            to(left, column) += all;
            return;
        }
        const auto [on_rigid, on_others] = prescribed_parts(motion);
        const double of_joints = reactions.dot(on_rigid), of_supports = reactions.dot(on_others);
        to(supports, column) += of_supports;
        to(left, column) += all - of_joints - of_supports;
        if (column > 0) to(joints, column) += of_joints;
    };
    for (int k = 0; k < 6; ++k) add_all(motions[k], 1 + k);
    add_all(v, 0);
    if (inertial.size() == 0 || !model_.dof_map().has_supports()) return;
    // The part of each node's motion along the directions in which it is held.
    std::array<VectorXd, 3> along;
    for (int axis = 0; axis < 3; ++axis) along[axis] = prescribed_parts(motions[axis]).second;
    const auto held_power = [&](const VectorXd& motion) {
        double power = 0.0;
        for (int axis = 0; axis < 3; ++axis)
            for (Index node = 0; node < model_.nodes().n_vertices(); ++node)
                power += motion[3 * node + axis] *
                         inertial.segment<3>(3 * node).dot(along[axis].segment<3>(3 * node));
        return power;
    };
    to(supports, 0) -= held_power(v);
    for (int axis = 0; axis < 3; ++axis) to(supports, 4 + axis) -= held_power(motions[3 + axis]);
}

Eigen::Vector4d Accountant::held_inertia(const VectorXd& q, const VectorXd& v) const {
    Eigen::Vector4d found = Eigen::Vector4d::Zero();
    if (!model_.dof_map().has_supports()) return found;
    const std::array<VectorXd, 6> motions = rigid_motions(q);
    for (int axis = 0; axis < 3; ++axis) {
        const VectorXd along = prescribed_parts(motions[axis]).second;
        for (Index node = 0; node < model_.nodes().n_vertices(); ++node) {
            const Eigen::Vector3d momentum =
                input_.inertia.mass.segment<3>(3 * node).cwiseProduct(v.segment<3>(3 * node));
            const double held = momentum.dot(along.segment<3>(3 * node));
            found[0] += 0.5 * held * v[3 * node + axis];
            for (int about = 0; about < 3; ++about)
                found[1 + about] += held * motions[3 + about][3 * node + axis];
        }
    }
    return found;
}

void Accountant::add_viscous(const Instant& at, const StrainRates& elastic, const StrainRates& joints,
                             Rates& to) {
    const Viscosity& law = input_.viscosity;
    if (law.any()) {
        ViscousTerms& terms = model_.elastic();
        StrainSet sum = terms.zeros();
        if (law.stiffness_damping != 0.0) {
            const StrainSet stress = terms.stresses(elastic.d);
            to.forces(further(MotionBalance::stiffness_damping), 0) -=
                law.stiffness_damping * stress.dot(elastic.d);
            sum.add(law.stiffness_damping, stress);
        }
        for (std::size_t k = 0; k < law.branches.size(); ++k) {
            // With e' = (d - e)/tau, the stress of the branch is that of tau e'.
            const StrainSet stress = terms.stresses(elastic.e[k].times(law.branches[k].time));
            to.forces(further(MotionBalance::maxwell), 0) -=
                law.branches[k].modulus * stress.dot(elastic.e[k]);
            sum.add(law.branches[k].modulus, stress);
        }
        to.reactions += terms.forces(sum, at.q.size());
    }
    if (model_.capabilities().has_own_viscosity) {
        ViscousTerms& terms = model_.dampers();
        const StrainSet stress = terms.stresses(joints.d);
        const VectorXd force = terms.forces(stress, at.q.size());
        to.reactions += force;
        const Index row = further(MotionBalance::dampers);
        add_force(-force, at.q, VectorXd::Zero(at.q.size()), row, to.forces);
        to.forces(row, 0) -= stress.dot(joints.d);
    }
}

void Accountant::add_fluid(const Instant& at, Rates& to) {
    if (at.momentum_rate.size() == 0) return;
    to.reactions += at.momentum_rate;
    const VectorXd momentum = model_.fluid_momentum(at.q, at.v);
    VectorXd by_q = VectorXd::Zero(at.q.size());
    model_.fluid_energy(at.q, at.v, &by_q);
    const Index row = terms_.fluid_term();
    to.forces(row, 0) -= by_q.dot(at.v);
    for (Index node = 0; node < model_.nodes().n_vertices(); ++node)
        to.forces.row(row).tail<3>() +=
            Eigen::Vector3d(at.v.segment<3>(3 * node)).cross(Eigen::Vector3d(momentum.segment<3>(3 * node)));
}

Accountant::Rates Accountant::rates(const Instant& at, bool implicit_contact, const StrainRates& elastic,
                                    const StrainRates& joints) {
    const VectorXd inertial = input_.inertia.mass.cwiseProduct(at.acceleration);
    const VectorXd damped = input_.inertia.damping.cwiseProduct(at.v);
    Rates found{BalanceRows::Zero(sums_.rows(), 7), inertial + damped};
    set_state(at.q, at.angle_branches, at.load_parameters);
    add_force(-damped, at.q, at.v, further(MotionBalance::damping), found.forces);
    terms_.each(at.q, at.load_parameters, at.motion, [&](Index row, const VectorXd& gradient) {
        if (implicit_contact && terms_.is_contact(row)) return;
        add_force(-gradient, at.q, at.v, row, found.forces);
        found.reactions += gradient;
    });
    add_fluid(at, found);
    add_viscous(at, elastic, joints, found);
    add_reactions(found.reactions, inertial, at.q, at.v, found.forces);
    return found;
}

Accountant::Rates Accountant::contact_rates(const Instant& at, const VectorXd& mean_velocity,
                                            const VectorXd& by_contact) {
    Rates found{BalanceRows::Zero(sums_.rows(), 7), input_.inertia.mass.cwiseProduct(by_contact)};
    set_state(at.q, at.angle_branches, at.load_parameters);
    terms_.each(at.q, at.load_parameters, at.motion, [&](Index row, const VectorXd& gradient) {
        if (!terms_.is_contact(row)) return;
        add_force(-gradient, at.q, mean_velocity, row, found.forces);
        found.reactions += gradient;
    });
    add_reactions(found.reactions, {}, at.q, mean_velocity, found.forces);
    return found;
}

void Accountant::add_driven(const VectorXd& q, const VectorXd& v, const Model::AngleBranches& angle_branches,
                            const LoadParameters& load_parameters, const LoadParameters& change,
                            const VectorXd& reactions, bool contact, bool others) {
    if (change.isZero(0.0)) return;
    model_.set_angle_branches(angle_branches);
    const auto energies = [&](double factor) {
        const LoadParameters there = load_parameters + factor * change;
        model_.parameters().set_time_varying(there);
        return terms_.energies_at(q, there,
                                  [&](Index row) { return terms_.is_contact(row) ? contact : others; });
    };
    driven_ += (energies(difference) - energies(-difference)) / (2.0 * difference);
    if (others && model_.may_have_fluid_momentum()) {
        // The energy of the fluid, v . p - T, changes at fixed q and p by - dT.
        const auto kinetic = [&](double factor) {
            model_.parameters().set_time_varying(load_parameters + factor * change);
            return v.dot(model_.fluid_momentum(q, v)) - model_.fluid_energy(q, v);
        };
        sums_(terms_.fluid_term(), 0) -= (kinetic(difference) - kinetic(-difference)) / (2.0 * difference);
    }
    model_.parameters().set_time_varying(load_parameters);
    if (!model_.dof_map().has_prescribed_motion()) return;
    model_.linearize(q);
    const VectorXd moved = model_.parameters().prescribed_rate(q, load_parameters, change);
    model_.parameters().set_time_varying(load_parameters);
    model_.linearize(q);
    const Index vertices = model_.nodes().n_vertices();
    for (Index node = 0; node < model_.nodes().n_nodes(); ++node) {
        const double work = reactions.segment<3>(3 * node).dot(moved.segment<3>(3 * node));
        if (is_rigid_[node])
            sums_(further(MotionBalance::motors), 0) += work;
        else if (node >= vertices)
            sums_(further(MotionBalance::supports), 0) += work;
    }
}

void Accountant::add_strain_rates(const StepAlgebra& step, const SubstepRecord& record,
                                  std::span<const LoadParameters> load_parameters, const Viscosity& law,
                                  ViscousTerms& terms, ViscousStage::Kind kind, const MaxwellStrains& e,
                                  std::vector<StageRates>& all) {
    const Tableau& tableau = step.tableau();
    model_.set_angle_branches(record.begin.angle_branches);
    model_.parameters().set_time_varying(load_parameters.front());
    const StrainSet at_begin = terms.strains(record.begin.q);
    std::vector<StageRates> before;
    if (tableau.begins_explicitly) before.push_back(all.front());
    for (int i = 0; i < tableau.stages; ++i) {
        model_.set_angle_branches(record.stages[i].angle_branches);
        model_.parameters().set_time_varying(load_parameters[i + 1]);
        ViscousStage stage(law, step.stage_time(), step.dt(), tableau.a[i], before, kind, at_begin, e);
        StageRates& now = all[before.size()];
        stage.finish(law, step.stage_time(), terms.strains(record.stages[i].q), now.*kind);
        before.push_back(now);
    }
}

void Accountant::add(const StepAlgebra& step, const SubstepRecord& record, const MotionState& end,
                     std::span<const LoadParameters> load_parameters) {
    const Tableau& tableau = step.tableau();
    const int first = tableau.begins_explicitly ? 1 : 0, n = tableau.stages;
    const MotionState& begin = record.begin;
    StepRates at(model_, step, stepper_.free_bodies(), record, load_parameters);
    if (input_.viscosity.any())
        add_strain_rates(step, record, load_parameters, input_.viscosity, model_.elastic(),
                         &StageRates::elastic, begin.e, at.all);
    if (model_.capabilities().has_own_viscosity)
        add_strain_rates(step, record, load_parameters, damper_law, model_.dampers(), &StageRates::joints, {},
                         at.all);
    set_state(begin.q, begin.angle_branches, load_parameters.front());
    const Eigen::Vector4d held_before = held_inertia(begin.q, begin.v);
    model_.begin_step(begin.q, load_parameters.front());
    const Eigen::MatrixXd derivatives = polynomial_derivatives(tableau);
    const auto change_at = [&](int point) {
        LoadParameters change = LoadParameters::Zero(load_parameters.front().size());
        for (int m = 0; m <= n; ++m) change += derivatives(point, m) * load_parameters[m];
        return change;
    };
    for (int j = 0; j < first + n; ++j) {
        const bool begins = j < first;
        const int point = begins ? 0 : j - first + 1;  // the entry of load_parameters
        const double weight = tableau.a[n - 1][j];
        const VectorXd& q = begins ? begin.q : record.stages[point - 1].q;
        const Model::AngleBranches& branches =
            begins ? begin.angle_branches : record.stages[point - 1].angle_branches;
        const VectorXd &v = at.all[j].v, &acceleration = at.all[j].acceleration;
        // Free bodies begin with other rates than those at the end of the step before, which are of no use then
        // (FreeFlight::finish).
        const bool is_known = begins && last_.reactions.size() > 0 && stepper_.free_bodies().empty();
        if (!is_known) {
            const double T = step.stage_time();
            const VectorXd x_hat = begins ? VectorXd(q - T * v) : at.x_hat[point - 1],
                           p_hat = begins ? VectorXd(VectorXd::Zero(q.size())) : at.p_hat[point - 1];
            last_ = rates({q,
                           branches,
                           load_parameters[point],
                           v,
                           acceleration,
                           at.all[j].momentum_rate,
                           {&x_hat, &p_hat, T}},
                          tableau.implicit_contact, at.all[j].elastic, at.all[j].joints);
        }
        sums_ += (step.dt() * weight) * last_.forces;
        add_driven(q, v, branches, load_parameters[point], weight * change_at(point), last_.reactions,
                   !tableau.implicit_contact, true);
    }
    if (tableau.implicit_contact) {
        const double T = step.stage_time();
        const StageState& stage = record.stages.back();
        const VectorXd mean = 0.5 * (begin.v + at.all.back().v);
        const Rates found = contact_rates({stage.q,
                                           stage.angle_branches,
                                           load_parameters.back(),
                                           at.all.back().v,
                                           at.all.back().acceleration,
                                           at.all.back().momentum_rate,
                                           {&at.x_hat.back(), &at.p_hat.back(), T}},
                                          mean, stage.contact);
        sums_ += step.dt() * found.forces;
        add_driven(stage.q, mean, stage.angle_branches, load_parameters.back(),
                   load_parameters.back() - load_parameters.front(), found.reactions, true, false);
    }
    model_.linearize(end.q);
    const Eigen::Vector4d held = held_inertia(end.q, end.v) - held_before;
    sums_(further(MotionBalance::supports), 0) += held[0];
    sums_.row(further(MotionBalance::supports)).tail<3>() += held.tail<3>();
}

MotionBalance::State Accountant::state(const MotionState& at, const LoadParameters& load_parameters) {
    MotionBalance::State found;
    found.forces = sums_;
    found.driven = driven_;
    set_state(at.q, at.angle_branches, load_parameters);
    const std::size_t branches = input_.viscosity.branches.size();
    found.energies = VectorXd::Zero(terms_.energies() + static_cast<Index>(branches));
    Index row = 0;
    for (const auto& [name, energy] : model_.energies(at.q, load_parameters)) found.energies[row++] = energy;
    if (branches > 0 && !at.e.empty()) {
        const StrainSet strains = model_.elastic().strains(at.q);
        for (std::size_t k = 0; k < branches; ++k) {
            StrainSet stretched = strains;
            stretched.add(-1.0, at.e[k]);
            found.energies[row++] = 0.5 * input_.viscosity.branches[k].modulus *
                                    model_.elastic().stresses(stretched).dot(stretched);
        }
    }
    VectorXd momentum = input_.inertia.mass.cwiseProduct(at.v);
    found.kinetic = 0.5 * at.v.dot(momentum) + model_.fluid_energy(at.q, at.v);
    if (model_.may_have_fluid_momentum()) momentum += model_.fluid_momentum(at.q, at.v);
    for (Index node = 0; node < model_.nodes().n_vertices(); ++node) {
        const Eigen::Vector3d of_node = momentum.segment<3>(3 * node), place = at.q.segment<3>(3 * node);
        found.momenta.head<3>() += of_node;
        found.momenta.tail<3>() += place.cross(of_node);
    }
    return found;
}

}  // namespace

MotionBalance motion_balance(Model& model, const MotionInput& input,
                             const std::map<Index, Substeps>& substeps, Index steps_done,
                             const MotionWatch& watch) {
    model.contacts().forget();
    const ScopedTimeVarying varying(model.parameters(), input.varying);
    const ScopedWatch while_watching(model, input.watched);
    double done = 0.0;
    Newton newton(model, input.newton, [&](double residual) {
        if (watch) watch(done, residual);
    });
    Accountant accountant(model, input, newton);
    MotionState state = start_of_motion(model, input);
    MotionBalance balance;
    balance.states.push_back(accountant.state(state, input.load_parameters_at(0, 0.0)));
    balance.last = state.q;
    for (Index step = 0; step < steps_done; ++step) {
        done = static_cast<double>(step) / static_cast<double>(steps_done);
        const Substeps parts = substeps_of(substeps, step);
        for (const Substep& part : parts) {
            std::vector<SubstepRecord> records;
            repeat_step(accountant.stepper(), input, step, {part}, state, &records);
            const Tableau& tableau =
                accountant.stepper().tableau_from(records.front().begin, part.dissipative);
            const double dt = part.fraction() * input.time_steps[step];
            accountant.add(accountant.stepper().algebra(dt, tableau), records.front(), state,
                           stage_load_parameters(input, tableau, step, part));
        }
        if (input.recorded_after(step + 1) >= 0)
            balance.states.push_back(accountant.state(state, input.load_parameters_at(step, 1.0)));
    }
    balance.last = state.q;
    return balance;
}

}  // namespace magshell
