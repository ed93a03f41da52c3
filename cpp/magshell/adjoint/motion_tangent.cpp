#include "magshell/adjoint/motion_tangent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "magshell/adjoint/motion_derivatives.h"
#include "magshell/adjoint/viscous_tangent.h"
#include "magshell/core/errors.h"
#include "magshell/solve/motion/edge_rotations.h"
#include "magshell/solve/motion/motor_reactions.h"
#include "magshell/solve/newton/unsymmetric.h"

namespace magshell {
namespace {

// RAII guard that restores the values of the scene.
class ScopedValues {
  public:
    ScopedValues(ModelParameters& parameters, const VectorXd& values)
        : parameters_(parameters), values_(values) {}
    ScopedValues(const ScopedValues&) = delete;
    ScopedValues& operator=(const ScopedValues&) = delete;
    ~ScopedValues() { parameters_.set_values(values_); }

  private:
    ModelParameters& parameters_;
    const VectorXd& values_;
};

// Carries the tangent of the state from step to step.
class ForwardSweep {
  public:
    ForwardSweep(Newton& newton, const MotionInput& input, const VectorXd& values,
                 const MotionInputTangent& along)
        : newton_(newton),
          model_(newton.model()),
          input_(input),
          along_(along),
          stepper_(newton, input.tableau, input.inertia, input.viscosity, input.projective),
          derivatives_(model_, values, input.varying, along) {}

    // Computes the tangent of the start and records it.
    void begin(const MotionState& start) {
        find_start(start);
        record(0, {});
    }

    // Computes the tangent after a step from that before it.
    void follow(Index step, const Substeps& substeps, const std::vector<SubstepRecord>& records) {
        progress_ = static_cast<double>(step) / static_cast<double>(input_.steps());
        const bool recorded = input_.recorded_after(step + 1) >= 0;
        VectorXd motor_forces;
        for (std::size_t k = 0; k < substeps.size(); ++k)
            motor_forces = take(step, substeps[k], records[k], recorded && k + 1 == substeps.size());
        record(step + 1, std::move(motor_forces));
    }

    MotionTangent run(const MotionResult& motion) {
        begin(motion.start);
        const Index stored = motion.steps_done - static_cast<Index>(motion.steps.size());
        MotionState state = motion.start;
        for (Index step = 0; step < motion.steps_done; ++step) {
            const Substeps substeps = substeps_of(motion.substeps, step);
            std::vector<SubstepRecord> repeated;
            if (step < stored) repeat_step(stepper_, input_, step, substeps, state, &repeated);
            follow(step, substeps, step < stored ? repeated : motion.steps[step - stored]);
        }
        return finish(motion);
    }

    // Returns the tangents of all recorded states of the motion that ends here.
    MotionTangent finish(const MotionResult& motion) {
        for (MotionTangent::State& state : states_)
            if (state.motor_forces.size() == 0)
                state.motor_forces = VectorXd::Zero(motion.last.motor_forces.size());
        return {std::move(states_), newton_.factorizations()};
    }

    // Sets the values of the scene again, after a difference that failed.
    void restore_values() { derivatives_.set(0.0, input_.load_parameters_at(0, 0.0)); }

    double progress() const { return progress_; }

  private:
    LoadParameters load_tangent(Index step, double fraction) const {
        const auto [first, weight] = input_.between(step, fraction);
        return interpolate(along_.load_parameters[first], along_.load_parameters[first + 1], weight);
    }

    void record(Index steps, VectorXd motor_forces) {
        if (input_.recorded_after(steps) < 0) return;
        states_.push_back({tangent_.q, tangent_.v, std::move(motor_forces)});
    }

    // Computes the tangent of the start. The motion makes the given start consistent with joints and rigid bodies, chooses edge rotations in
    // equilibrium and Maxwell branches without stress; all three depend on the inputs.
    void find_start(const MotionState& start) {
        const DofMap& dof_map = model_.dof_map();
        const VectorXd &q = start.q, &v = start.v;
        const LoadParameters load_parameters = input_.load_parameters_at(0, 0.0),
                             tangent = load_tangent(0, 0.0);
        tangent_.q = along_.positions;
        tangent_.v = along_.velocities;
        if (dof_map.has_reduced_coordinates() &&
            (derivatives_.values_change() || !tangent_.q.isZero(0.0) || !tangent_.v.isZero(0.0))) {
            const Index n = q.size();
            const auto made_consistent = [&](double t) {
                const Model& there = derivatives_.set(t, load_parameters);
                VectorXd moved = q + t * along_.positions, moving = v + t * along_.velocities;
                there.dof_map().project_state(moved, &moving);
                return joined({moved, moving});
            };
            const std::array<Index, 1> ends{n};
            const VectorXd both =
                start_derivative_.of(made_consistent, ends,
                                     derivatives_.step_along({{along_.length, largest(tangent_.q)},
                                                              {largest(v), largest(tangent_.v)}}),
                                     std::array{model_.extent(), largest(v)}, "the start");
            derivatives_.set(0.0, load_parameters);
            tangent_.q = both.head(n);
            tangent_.v = both.tail(n);
        }
        model_.set_angle_branches(input_.start.angle_branches);
        derivatives_.set(0.0, load_parameters);
        if (!input_.rotations_given) {
            const EdgeRotationEquilibrium rotations(model_, q, load_parameters);
            VectorXd forces(q.size());
            model_.multiply(tangent_.q, forces);
            tangent_.q +=
                rotations.adjoint(forces + derivatives_.energy_gradient(q, load_parameters, tangent));
        }
        const bool branches = input_.viscosity.maxwell(), explicit_first = input_.tableau.begins_explicitly;
        if (branches && input_.start.e.empty()) {
            model_.evaluate(q, load_parameters);
            tangent_.e.assign(
                input_.viscosity.branches.size(),
                derivatives_.strains(model_.elastic(), q, tangent_.q, load_parameters, tangent));
        } else if (branches) {
            tangent_.e.assign(input_.viscosity.branches.size(), model_.elastic().zeros());
        }
        if (!explicit_first) return;
        tangent_.rates.acceleration = VectorXd::Zero(q.size());
        if (start.rates.c.size() > 0) tangent_.rates.c = VectorXd::Zero(q.size());
        tangent_.rates.elastic.d = model_.elastic().zeros();
        tangent_.rates.elastic.e.assign(input_.viscosity.branches.size(), model_.elastic().zeros());
    }

    FreeFlight flight_at(double t, const Tableau& tableau, double dt, double dt_tangent,
                         const MotionState& begin, std::vector<FreeBody>& bodies) {
        bodies = free_bodies(derivatives_.reshaped_at(t).dof_map(), input_.inertia.mass + t * along_.mass);
        return FreeFlight(bodies, tableau, dt + t * dt_tangent, begin.q + t * tangent_.q,
                          begin.v + t * tangent_.v);
    }

    double step_of_flight(double dt, double dt_tangent, const MotionState& begin) const {
        return derivatives_.step_along({{along_.length, largest(tangent_.q)},
                                        {largest(begin.v), largest(tangent_.v)},
                                        {dt, std::abs(dt_tangent)}});
    }

    // Returns the derivatives of the terms that free flight adds to the predictions of all stages (FreeFlight::add_defect).
    VectorXd flight_tangent(const StepAlgebra& algebra, double dt_tangent, const MotionState& begin) {
        const int n = algebra.tableau().stages;
        const Index size = model_.size();
        std::vector<Index> ends;
        for (int k = 1; k < 2 * n; ++k) ends.push_back(k * size);
        const std::vector<double> noise(2 * n, model_.extent() + largest(begin.v));
        return flight_derivative_.of(
            [&](double t) {
                std::vector<FreeBody> bodies;
                const FreeFlight flight =
                    flight_at(t, algebra.tableau(), algebra.dt(), dt_tangent, begin, bodies);
                VectorXd added(2 * n * size);
                for (int i = 0; i < n; ++i) {
                    VectorXd x = VectorXd::Zero(size), v = x;
                    flight.add_defect(i, x, v);
                    added.segment(2 * i * size, size) = x;
                    added.segment((2 * i + 1) * size, size) = v;
                }
                return added;
            },
            ends, step_of_flight(algebra.dt(), dt_tangent, begin), noise, "a free flight");
    }

    // Replaces the tangent of the rates at the end of a step by that after FreeFlight::finish.
    void finish_flight(const StepAlgebra& algebra, double dt_tangent, const MotionState& begin,
                       const VectorXd& q, const StageRates& last, StageRates& tangent,
                       const VectorXd& q_tangent) {
        const Index size = model_.size();
        const std::array<Index, 1> ends{size};
        const VectorXd both = flight_end_derivative_.of(
            [&](double t) {
                std::vector<FreeBody> bodies;
                const FreeFlight flight =
                    flight_at(t, algebra.tableau(), algebra.dt(), dt_tangent, begin, bodies);
                StageRates rates;
                rates.v = last.v + t * tangent.v;
                rates.acceleration = last.acceleration + t * tangent.acceleration;
                flight.finish(q + t * q_tangent, rates);
                return joined({rates.v, rates.acceleration});
            },
            ends, step_of_flight(algebra.dt(), dt_tangent, begin),
            std::array{largest(last.v), largest(last.v) / algebra.dt()}, "the end of a free flight");
        tangent.v = both.head(size);
        tangent.acceleration = both.tail(size);
    }

    // Returns (H + W) times a change of the state evaluated last.
    VectorXd product(const VectorXd& change, const VectorXd& weights) const {
        VectorXd forces(change.size());
        model_.multiply(change, forces);
        model_.nonsymmetric_tangent().add_product(change, false, forces);
        return forces + weights.cwiseProduct(change);
    }

    // Returns the change of the state that cancels a change of the residual of a stage, given the change of the prescribed motion. The
    // model must have been evaluated last at q. nearby: a factorization made near q, or nullptr.
    VectorXd solve(const VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                   const PrescribedTangent& change, VectorXd residual, const Factor* nearby) {
        newton_.watch(0.0);
        const DofMap& dof_map = model_.dof_map();
        VectorXd moved = change.motion();
        if (moved.size() == 0) moved = VectorXd::Zero(q.size());
        if (!moved.isZero(0.0)) {
            model_.assemble(q, load_parameters, false);
            model_.assemble_forces(load_parameters);
            VectorXd pull = product(moved, *proximal.weights);
            if (change.by_motors.size() > 0)
                dof_map.add_motor_increment_forces(newton_.gradient(q, proximal), change.by_motors, pull);
            residual += pull;
        }
        VectorXd reduced = -dof_map.vector(residual);
        if (change.reduced_residual.size() > 0) reduced -= change.reduced_residual;
        if (reduced.isZero(0.0)) return moved;
        const bool symmetric =
            !model_.capabilities().has_unsymmetric_tangent && !model_.capabilities().has_velocity_forces;
        if (nearby && symmetric && change.reduced_residual.size() == 0) {
            VectorXd solution = -residual;
            if (newton_.solve_gmres_adjoint(q, load_parameters, proximal, *nearby, solution).converged)
                return moved + solution;
        }
        Eigen::MatrixXd no_moves(q.size(), 0);
        const FactorReport factor = newton_.factorize(q, load_parameters, false, proximal, no_moves);
        if (!factor.succeeded)
            throw InvalidInput("the tangent of a time step cannot be computed: " + factor.reason);
        factorized_here_ = true;
        if (newton_.is_unsymmetric()) {
            const GmresReport report =
                solve_unsymmetric(model_, *newton_.factor(), false, to_round_off, reduced);
            if (!report.converged)
                throw InvalidInput(
                    "a linear solve of the tangent of a time step did not converge: its relative residual "
                    "is " +
                    std::to_string(report.residual));
        } else {
            newton_.factor()->solve_approximately(reduced, to_round_off.tolerance);
        }
        return moved + dof_map.expand(reduced);
    }

    // Returns a factorization that was made near stage i: that of its last Newton iteration, or that of the stage before, whose inertia is
    // the same and whose stiffness is nearly so without contact; nullptr if there is none.
    const Factor* nearby_factor(const SubstepRecord& record, int i, const LoadParameters& load_parameters) {
        const StageState& stage = record.stages[i];
        if (stage.factor) return stage.factor.get();
        const bool serves = i > 0 && factorized_here_ && !model_.contacts().acts(stage.q, load_parameters);
        return serves ? newton_.factor().get() : nullptr;
    }

    // Returns the derivative of the inertial and damping forces M w + Gamma v at a fixed state q, with v = (q - x^)/T, w = (v - v^)/T and the
    // time T = a dt of the stage.
    VectorXd inertia_tangent(const StageTangent& stage, const VectorXd& v, const VectorXd& w) const {
        const Inertia& inertia = input_.inertia;
        const VectorXd v_tangent = -(stage.x_hat_tangent + stage.T_tangent * v) / stage.T;
        const VectorXd w_tangent = (v_tangent - stage.v_hat_tangent - stage.T_tangent * w) / stage.T;
        return along_.mass.cwiseProduct(w) + inertia.mass.cwiseProduct(w_tangent) +
               along_.damping.cwiseProduct(v) + inertia.damping.cwiseProduct(v_tangent);
    }

    // Returns the derivative of the acceleration by contact, c = J (J^T M J)^-1 J^T f, of a stage that moves by q_tangent.
    VectorXd contact_tangent(const StageTangent& stage, const VectorXd& q, const VectorXd& q_tangent,
                             const VectorXd& by_inputs, const VectorXd& c) {
        const DofMap& dof_map = model_.dof_map();
        const VectorXd& mass = input_.inertia.mass;
        const VectorXd force = model_.contact_forces(q, stage.load_parameters) / stage.contact_factor;
        model_.multiply_contact_transposed(q, stage.load_parameters, q_tangent);  // assembles contact alone
        const VectorXd pull = product(q_tangent, VectorXd::Zero(q.size()));
        const VectorXd force_tangent = (by_inputs - pull) / stage.contact_factor;
        VectorXd found = dof_map.acceleration(mass, force_tangent - along_.mass.cwiseProduct(c));
        if (!dof_map.has_reduced_coordinates()) return found;
        found += rotation_derivative_.of(
            [&](double t) {
                Model& there = derivatives_.set(t, stage.load_parameters + t * stage.tangent);
                there.linearize(q + t * q_tangent);
                return there.dof_map().acceleration(mass, force);
            },
            derivatives_.step_along({{along_.length, largest(q_tangent)}}), 0.0,
            "the acceleration by contact");
        derivatives_.set(0.0, stage.load_parameters);
        model_.linearize(q);
        return found;
    }

    // Computes the tangent after a substep from that before it. Returns the tangent of the motor forces at its end if it is wanted.
    VectorXd take(Index step, const Substep& part, const SubstepRecord& record, bool wants_motor_forces) {
        const double fraction = part.fraction(), dt_tangent = fraction * along_.time_steps[step];
        const StepAlgebra algebra = stepper_.algebra(fraction * input_.time_steps[step],
                                                     stepper_.tableau_from(record.begin, part.dissipative));
        const Tableau& tableau = algebra.tableau();
        const int n = tableau.stages, first = tableau.begins_explicitly ? 1 : 0;
        const double dt = algebra.dt(), T = algebra.stage_time(), T_tangent = tableau.diagonal * dt_tangent;
        const Index size = model_.size(), coordinates = model_.n_coordinates();
        const ScopedStrainHistory elastic_afterwards(model_);
        const ScopedContactFactor usual_contact_afterwards(model_);
        factorized_here_ = false;
        derivatives_.set_history(nullptr, nullptr);
        const LoadParameters begin = input_.load_parameters_at(step, part.begin),
                             begin_tangent = load_tangent(step, part.begin);
        derivatives_.set(0.0, begin);
        model_.set_angle_branches(record.begin.angle_branches);
        const StepRates at(model_, algebra, stepper_.free_bodies(), record);
        const VectorXd flight =
            at.flight.any() ? flight_tangent(algebra, dt_tangent, record.begin) : VectorXd();

        std::vector<StageRates> tangents;
        if (first) {
            tangents.push_back(tangent_.rates);
            tangents.front().v = tangent_.v;
            tangents.front().joints.d =
                derivatives_.damper_rates(record.begin, tangent_.q, tangent_.v, begin, begin_tangent);
        }
        ViscousTangent strains(model_.elastic(), input_.viscosity, along_.viscosity, &StageRates::elastic),
            joints(model_.dampers(), damper_law, no_change_, &StageRates::joints);
        model_.evaluate(record.begin.q, begin);
        if (!strains.idle())
            strains.begin(
                algebra, dt_tangent, model_.elastic().strains(record.begin.q),
                derivatives_.strains(model_.elastic(), record.begin.q, tangent_.q, begin, begin_tangent),
                record.begin.e, tangent_.e, first ? &at.all.front() : nullptr,
                first ? &tangents.front() : nullptr);
        if (!joints.idle())
            joints.begin(
                algebra, dt_tangent, model_.dampers().strains(record.begin.q),
                derivatives_.strains(model_.dampers(), record.begin.q, tangent_.q, begin, begin_tangent), {},
                {}, first ? &at.all.front() : nullptr, first ? &tangents.front() : nullptr);

        VectorXd q_tangent, motor_forces;
        for (int i = 0; i < n; ++i) {
            VectorXd x_hat_tangent = tangent_.q, v_hat_tangent = tangent_.v;
            for (std::size_t j = 0; j < tangents.size(); ++j) {
                const double a = tableau.a[i][j];
                x_hat_tangent += a * (dt * tangents[j].v + dt_tangent * at.all[j].v);
                v_hat_tangent += a * (dt * tangents[j].acceleration + dt_tangent * at.all[j].acceleration);
            }
            if (flight.size() > 0) {
                x_hat_tangent += flight.segment(2 * i * size, size);
                v_hat_tangent += flight.segment((2 * i + 1) * size, size);
            }
            // Dofs without velocity are not predicted.
            VectorXd from_vertices = VectorXd::Zero(size);
            from_vertices.head(coordinates) = x_hat_tangent.head(coordinates);
            const double place = part.begin + tableau.time(i) * fraction;
            const StageTangent stage{record,
                                     at.x_hat[i],
                                     at.v_hat[i],
                                     from_vertices,
                                     v_hat_tangent,
                                     record.stages[i].angle_branches,
                                     T,
                                     T_tangent,
                                     tableau.contact_factor(i),
                                     input_.load_parameters_at(step, place),
                                     load_tangent(step, place),
                                     begin,
                                     begin_tangent,
                                     tangent_.q};
            const VectorXd& q = record.stages[i].q;
            const VectorXd& v = at.all[first + i].v;
            const VectorXd w = algebra.stage_acceleration(at.all[first + i], at.v_hat[i]);
            const VectorXd target = algebra.target(at.x_hat[i], at.v_hat[i]);
            const StageMotion motion{&at.x_hat[i], &at.v_hat[i], T};
            const ProximalTerm proximal{&algebra.weights(), &target, &motion};
            derivatives_.set_stage(stage);
            strains.set_history(i);
            joints.set_history(i);
            derivatives_.set_history(strains.shift(), joints.shift());
            const ForceTangent forces = derivatives_.forces(stage, q, tableau.implicit_contact);
            newton_.evaluate(q, stage.load_parameters, proximal);
            const VectorXd residual = forces.gradient + inertia_tangent(stage, v, w) +
                                      strains.forces(q, size) + joints.forces(q, size);
            const PrescribedTangent change = derivatives_.prescribed(stage, q, newton_.gradient(q, proximal));
            q_tangent = solve(q, stage.load_parameters, proximal, change, residual,
                              nearby_factor(record, i, stage.load_parameters));
            StageRates& now = tangents.emplace_back();
            now.v = VectorXd::Zero(size);
            now.v.head(coordinates) = (q_tangent - x_hat_tangent - T_tangent * v).head(coordinates) / T;
            now.acceleration = (now.v - v_hat_tangent - T_tangent * w) / T;
            if (tableau.implicit_contact) {
                now.c = contact_tangent(stage, q, q_tangent, forces.contact, record.stages[i].contact);
                now.acceleration -= stage.contact_factor * now.c;
            }
            if (!strains.idle())
                strains.finish(model_.elastic().strains(q),
                               derivatives_.strains(model_.elastic(), q, q_tangent, stage.load_parameters,
                                                    stage.tangent));
            if (!joints.idle())
                joints.finish(model_.dampers().strains(q),
                              derivatives_.strains(model_.dampers(), q, q_tangent, stage.load_parameters,
                                                   stage.tangent));
            if (i + 1 == n && wants_motor_forces && model_.dof_map().has_motors())
                motor_forces = motor_tangent(algebra, at, stage, q, proximal, v_hat_tangent, now, dt_tangent,
                                             strains, joints);
        }
        StageRates last = std::move(tangents.back());
        if (at.flight.any())
            finish_flight(algebra, dt_tangent, record.begin, record.stages.back().q, at.all.back(), last,
                          q_tangent);
        if (model_.dof_map().has_motors()) {
            v_before_ = tangent_.v;
            dt_before_tangent_ = dt_tangent;
        }
        tangent_.q = std::move(q_tangent);
        tangent_.v = last.v;
        if (!strains.idle()) {
            tangent_.e = strains.e_tangent();
            last.elastic = strains.rates_tangent();
        }
        tangent_.rates = std::move(last);
        return motor_forces;
    }

    // Returns the tangent of the motor forces at the end of a substep (solve/motion/motor_reactions.h).
    VectorXd motor_tangent(const StepAlgebra& algebra, const StepRates& at, const StageTangent& last,
                           const VectorXd& q_last, const ProximalTerm& there, const VectorXd& v_hat_tangent,
                           const StageRates& rates_tangent, double dt_tangent, const ViscousTangent& strains,
                           const ViscousTangent& joints) {
        const DofMap& dof_map = model_.dof_map();
        const Index coordinates = model_.n_coordinates();
        StageTangent stage = last;
        stage.contact_factor = 1.0;
        const MotionState& begin = stage.record.begin;
        derivatives_.set_stage(stage);
        const VectorXd& v_hat = stage.v_hat;
        const MotorReactions end(newton_, input_.inertia, begin, algebra, q_last, stage.load_parameters,
                                 there, v_hat, at.all.back());
        if (!end.converged())
            throw InvalidInput(
                "the motor forces have no tangent in a step in which they could not be computed (NaN)");
        const ProximalTerm proximal = end.proximal();
        const VectorXd& q = end.q();
        const ForceTangent forces = derivatives_.forces(stage, q, false);
        newton_.evaluate(q, stage.load_parameters, proximal);
        VectorXd v = VectorXd::Zero(q.size());
        v.head(coordinates) = (q - stage.x_hat).head(coordinates) / stage.T;
        VectorXd residual = forces.gradient + inertia_tangent(stage, v, (v - v_hat) / stage.T) +
                            strains.forces(q, q.size()) + joints.forces(q, q.size());
        if (end.acceleration_change().size() > 0) {
            residual += along_.mass.cwiseProduct(end.acceleration_change());
            VectorXd change = VectorXd::Zero(q.size());
            if (end.is_first_step()) {
                change = end.contact_weight() * rates_tangent.c;
            } else {
                // The acceleration is homogeneous of degree -1 in the lengths of this substep and the one before.
                const VectorXd w = algebra.stage_acceleration(at.all.back(), v_hat);
                const VectorXd by_dt =
                    -(end.acceleration_change() + w + begin.dt_before * end.change_by_dt_before()) /
                    algebra.dt();
                change = end.weight_last() * rates_tangent.v + end.weight_begin() * tangent_.v +
                         end.weight_before() * v_before_ + dt_tangent * by_dt +
                         dt_before_tangent_ * end.change_by_dt_before() -
                         (rates_tangent.v - v_hat_tangent - stage.T_tangent * w) / stage.T;
            }
            residual += input_.inertia.mass.cwiseProduct(change);
        }
        const VectorXd gradient = newton_.gradient(q, proximal);
        const PrescribedTangent change = derivatives_.prescribed(stage, q, gradient);
        const VectorXd q_tangent = solve(q, stage.load_parameters, proximal, change, residual, nullptr);
        // Assembles again, because the factorization has rotated the blocks of rotated nodes.
        newton_.evaluate(q, stage.load_parameters, proximal);
        model_.assemble(q, stage.load_parameters, false);
        model_.assemble_forces(stage.load_parameters);
        VectorXd found = dof_map.motor_forces(residual + product(q_tangent, *proximal.weights));
        found += motor_derivative_.of(
            [&](double t) {
                Model& there = derivatives_.set(t, stage.load_parameters + t * stage.tangent);
                there.linearize(q + t * q_tangent);
                return there.dof_map().motor_forces(gradient);
            },
            derivatives_.step_along({{along_.length, largest(q_tangent)}}), 0.0, "the force of a motor");
        derivatives_.set(0.0, stage.load_parameters);
        model_.linearize(q);
        return found;
    }

    Newton& newton_;
    Model& model_;
    const MotionInput& input_;
    const MotionInputTangent& along_;
    Stepper stepper_;
    MotionDerivatives derivatives_;
    const Viscosity no_change_{0.0, {}, 0.0};
    MotionState tangent_;  // of the current state
    VectorXd v_before_;    // as MotionState::v_before
    double dt_before_tangent_ = 0.0;
    std::vector<MotionTangent::State> states_;
    DirectionalDerivative start_derivative_, flight_derivative_, flight_end_derivative_, rotation_derivative_,
        motor_derivative_;
    double progress_ = 0.0;
    bool factorized_here_ = false;  // whether the factorization of newton_ is of this substep
};

// Computes the tangent beside a motion, until that is impossible; the motion itself continues.
class TangentFollower final : public MotionFollower {
  public:
    TangentFollower(ForwardSweep& forward, std::string& refusal) : forward_(forward), refusal_(refusal) {}

    void begin(const MotionState& start) override {
        attempt([&] { forward_.begin(start); });
    }
    void follow(Index step, const Substeps& substeps, const std::vector<SubstepRecord>& records) override {
        attempt([&] { forward_.follow(step, substeps, records); });
    }

  private:
    template <class Part>
    void attempt(const Part& part) {
        if (!refusal_.empty()) return;
        try {
            part();
        } catch (const InvalidInput& error) {
            refusal_ = error.what();
            forward_.restore_values();
        }
    }

    ForwardSweep& forward_;
    std::string& refusal_;
};

}  // namespace

MotionTangent motion_jvp(Model& model, const MotionInput& input, const MotionResult& motion,
                         const VectorXd& values, const MotionInputTangent& along, const MotionWatch& watch) {
    if (motion.keep == AdjointStorage::nothing)
        throw InvalidInput("the motion has no stored states: it was computed without gradients");
    const ScopedValues values_afterwards(model.parameters(), values);
    const ScopedTimeVarying varying(model.parameters(), input.varying);
    const ForwardSweep* running = nullptr;
    Newton newton(model, input.newton, [&](double residual) {
        if (watch) watch(running ? running->progress() : 0.0, residual);
    });
    ForwardSweep forward(newton, input, values, along);
    running = &forward;
    return forward.run(motion);
}

MotionWithTangent simulate_with_tangent(Model& model, const MotionInput& input,
                                        const AdjointStorageOptions& keep, const VectorXd& values,
                                        const MotionInputTangent& along, const MotionWatch& watch) {
    const ScopedValues values_afterwards(model.parameters(), values);
    const ForwardSweep* running = nullptr;
    Newton newton(model, input.newton, [&](double residual) {
        if (watch) watch(running ? running->progress() : 0.0, residual);
    });
    ForwardSweep forward(newton, input, values, along);
    running = &forward;
    MotionWithTangent found;
    TangentFollower following(forward, found.refusal);
    found.motion = simulate(model, input, keep, watch, &following);
    if (found.refusal.empty() && found.motion.outcome == Outcome::converged)
        found.tangent = forward.finish(found.motion);
    return found;
}

}  // namespace magshell
