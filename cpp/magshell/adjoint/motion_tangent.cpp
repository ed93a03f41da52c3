#include "magshell/adjoint/motion_tangent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "magshell/adjoint/motor_force_tangent.h"
#include "magshell/core/errors.h"
#include "magshell/solve/motion/edge_rotations.h"

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
          derivatives_(model_, values, input.varying, along),
          solver_(newton, input, along, derivatives_),
          motors_(newton, input, along, derivatives_, solver_) {}

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
        if (start.rates.momentum_rate.size() > 0) tangent_.rates.momentum_rate = VectorXd::Zero(q.size());
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
        solver_.begin_substep();
        derivatives_.set_history(nullptr, nullptr);
        const LoadParameters begin = input_.load_parameters_at(step, part.begin),
                             begin_tangent = load_tangent(step, part.begin);
        derivatives_.set(0.0, begin);
        model_.set_angle_branches(record.begin.angle_branches);
        const StepRates at(model_, algebra, stepper_.free_bodies(), record,
                           stage_load_parameters(input_, tableau, step, part));
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

        const VectorXd momentum_tangent = derivatives_.fluid_momentum(
            record.begin.q, record.begin.v, tangent_.q, tangent_.v, begin, begin_tangent);
        VectorXd q_tangent, motor_forces;
        for (int i = 0; i < n; ++i) {
            VectorXd x_hat_tangent = tangent_.q, v_hat_tangent = tangent_.v, p_hat_tangent = momentum_tangent;
            for (std::size_t j = 0; j < tangents.size(); ++j) {
                const double a = tableau.a[i][j];
                x_hat_tangent += a * (dt * tangents[j].v + dt_tangent * at.all[j].v);
                v_hat_tangent += a * (dt * tangents[j].acceleration + dt_tangent * at.all[j].acceleration);
                if (p_hat_tangent.size() > 0)
                    p_hat_tangent +=
                        a * (dt * tangents[j].momentum_rate + dt_tangent * at.all[j].momentum_rate);
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
                                     at.p_hat[i],
                                     from_vertices,
                                     v_hat_tangent,
                                     p_hat_tangent,
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
            const StageMotion motion{&at.x_hat[i], &at.p_hat[i], T};
            const ProximalTerm proximal{&algebra.weights(), &target, &motion};
            derivatives_.set_stage(stage);
            strains.set_history(i);
            joints.set_history(i);
            derivatives_.set_history(strains.shift(), joints.shift());
            const ForceTangent forces = derivatives_.forces(stage, q, tableau.implicit_contact);
            newton_.evaluate(q, stage.load_parameters, proximal);
            const VectorXd residual = forces.gradient + solver_.inertia(stage, v, w) +
                                      strains.forces(q, size) + joints.forces(q, size);
            const PrescribedTangent change = derivatives_.prescribed(stage, q, newton_.gradient(q, proximal));
            q_tangent = solver_.solve(q, stage.load_parameters, proximal, change, residual,
                                      solver_.nearby_factor(record, i, stage.load_parameters));
            StageRates& now = tangents.emplace_back();
            now.v = VectorXd::Zero(size);
            now.v.head(coordinates) = (q_tangent - x_hat_tangent - T_tangent * v).head(coordinates) / T;
            now.acceleration = (now.v - v_hat_tangent - T_tangent * w) / T;
            if (tableau.implicit_contact) {
                now.c = solver_.contact_acceleration(stage, q, q_tangent, forces.contact,
                                                     record.stages[i].contact);
                now.acceleration -= stage.contact_factor * now.c;
            }
            if (p_hat_tangent.size() > 0)
                now.momentum_rate = (derivatives_.fluid_momentum(q, v, q_tangent, now.v,
                                                                 stage.load_parameters, stage.tangent) -
                                     p_hat_tangent - T_tangent * at.all[first + i].momentum_rate) /
                                    T;
            if (!strains.idle())
                strains.finish(model_.elastic().strains(q),
                               derivatives_.strains(model_.elastic(), q, q_tangent, stage.load_parameters,
                                                    stage.tangent));
            if (!joints.idle())
                joints.finish(model_.dampers().strains(q),
                              derivatives_.strains(model_.dampers(), q, q_tangent, stage.load_parameters,
                                                   stage.tangent));
            if (i + 1 == n && wants_motor_forces && model_.dof_map().has_motors())
                motor_forces = motors_.at_end(algebra, at, stage, q, proximal, tangent_.v, now, dt_tangent,
                                              strains, joints);
        }
        StageRates last = std::move(tangents.back());
        if (at.flight.any())
            finish_flight(algebra, dt_tangent, record.begin, record.stages.back().q, at.all.back(), last,
                          q_tangent);
        if (model_.dof_map().has_motors()) motors_.end_substep(tangent_.v, dt_tangent);
        tangent_.q = std::move(q_tangent);
        tangent_.v = last.v;
        if (!strains.idle()) {
            tangent_.e = strains.e_tangent();
            last.elastic = strains.rates_tangent();
        }
        tangent_.rates = std::move(last);
        return motor_forces;
    }

    Newton& newton_;
    Model& model_;
    const MotionInput& input_;
    const MotionInputTangent& along_;
    Stepper stepper_;
    MotionDerivatives derivatives_;
    StageTangentSolver solver_;
    MotorForceTangent motors_;
    const Viscosity no_change_{0.0, {}, 0.0};
    MotionState tangent_;  // of the current state
    std::vector<MotionTangent::State> states_;
    DirectionalDerivative start_derivative_, flight_derivative_, flight_end_derivative_;
    double progress_ = 0.0;
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
