#include "magshell/solve/motion/stepper.h"

#include <utility>

#include "magshell/solve/motion/contact_predictor.h"
#include "magshell/solve/motion/motor_reactions.h"
#include "magshell/solve/motion/stage_descent.h"
#include "magshell/solve/motion/step_error.h"

namespace magshell {

StepAlgebra::StepAlgebra(const Tableau& tableau, const Inertia& inertia, double dt)
    : tableau_(tableau), dt_(dt), stage_time_(tableau.diagonal * dt) {
    const VectorXd by_acceleration = inertia.mass / (stage_time_ * stage_time_);
    weights_ = by_acceleration + inertia.damping / stage_time_;
    velocity_share_ =
        (weights_.array() != 0.0).select(stage_time_ * by_acceleration.array() / weights_.array(), 0.0);
}

void StepAlgebra::start_of_stage(int i, const MotionState& begin, const std::vector<StageRates>& rates,
                                 VectorXd& x_hat, VectorXd& v_hat) const {
    x_hat = begin.q;
    v_hat = begin.v;
    for (std::size_t j = 0; j < rates.size(); ++j) {
        x_hat += (dt_ * tableau_.a[i][j]) * rates[j].v;
        v_hat += (dt_ * tableau_.a[i][j]) * rates[j].acceleration;
    }
}

VectorXd StepAlgebra::start_of_momentum(int i, const VectorXd& momentum,
                                        const std::vector<StageRates>& rates) const {
    VectorXd p_hat = momentum;
    for (std::size_t j = 0; j < rates.size(); ++j)
        if (p_hat.size() > 0) p_hat += (dt_ * tableau_.a[i][j]) * rates[j].momentum_rate;
    return p_hat;
}

void StepAlgebra::finish_stage(int i, const VectorXd& q, const VectorXd& x_hat, const VectorXd& v_hat,
                               Index coordinates, StageRates& rates) const {
    rates.v = VectorXd::Zero(q.size());
    rates.v.head(coordinates) = (q - x_hat).head(coordinates) / stage_time_;
    rates.acceleration = stage_acceleration(rates, v_hat);
    if (rates.c.size() > 0) rates.acceleration -= tableau_.contact_factor(i) * rates.c;
}

VectorXd StepAlgebra::target(const VectorXd& x_hat, const VectorXd& v_hat) const {
    return x_hat + velocity_share_.cwiseProduct(v_hat);
}

Stepper::Stepper(Newton& newton, const Tableau& tableau, Inertia inertia, const Viscosity& viscosity,
                 const ProjectiveOptions& projective)
    : newton_(newton),
      tableau_(tableau),
      inertia_(std::move(inertia)),
      free_bodies_(magshell::free_bodies(newton.model().dof_map(), inertia_.mass)),
      viscosity_(viscosity) {
    starter_.implicit_contact = dissipative_.implicit_contact = tableau.implicit_contact;
    if (projective.on) projective_ = std::make_unique<ProjectiveSolver>(newton, projective);
}

NewtonReport Stepper::solve(VectorXd& q, const MotionState& begin, const LoadParameters& load_parameters,
                            const ProximalTerm& proximal, const FactorReport* factor) {
    Model& model = newton_.model();
    if (projective_) {
        const double scale = viscosity_.any() ? viscosity_.scale(proximal.motion->time) : 1.0;
        return projective_->solve(q, load_parameters, proximal, scale);
    }
    const VectorXd predicted = q;
    const Model::AngleBranches angle_branches = model.angle_branches();
    const Capabilities& has = model.capabilities();
    NewtonPolicy policy{.proximal = proximal, .defers_count = true, .factor = factor};
    if (has.has_stiffness_jumps)
        policy.landing = [&](const VectorXd& there, const VectorXd& step) {
            return predict_contact(model, there, load_parameters, *proximal.weights,
                                   model.contacts().predicted_points(step));
        };
    NewtonReport report = newton_.solve(q, load_parameters, policy);
    if (std::exchange(policy.factor, nullptr) && !report.converged) {
        q = predicted;
        model.set_angle_branches(angle_branches);
        report = newton_.solve(q, load_parameters, policy);
    }
    // After contact between bodies, Newton has used its line search already.
    const bool searched = has.has_barrier && report.had_contact;
    if (report.converged || searched || !(has.has_stiffness_jumps || newton_.options().mixed)) return report;
    q = predicted;
    model.set_angle_branches(angle_branches);
    policy.mixed = policy.search_at_barrier = false;
    if (has.has_stiffness_jumps) {
        // The prediction may lie in another valley: the descent begins where its energy is lower.
        const auto energy = [&](const VectorXd& there) {
            const VectorXd away = there - *proximal.target;
            return model.energy(there, load_parameters) +
                   0.5 * away.dot(proximal.weights->cwiseProduct(away));
        };
        const double ahead = energy(predicted);
        model.set_angle_branches(begin.angle_branches);
        if (ahead <= energy(begin.q))
            model.set_angle_branches(angle_branches);
        else
            q = begin.q;
        policy.defers_count = false;
        return descend_in_rounds(newton_, q, load_parameters, policy);
    }
    return newton_.solve(q, load_parameters, policy);
}

const Tableau& Stepper::tableau_from(const MotionState& state, bool dissipative) const {
    if (dissipative) return dissipative_;
    const bool known = !state.rates.empty() && (!tableau_.implicit_contact || state.rates.c.size() > 0) &&
                       (state.rates.momentum_rate.size() > 0 || !newton_.model().may_have_fluid_momentum());
    return tableau_.begins_explicitly && !known ? starter_ : tableau_;
}

const StepAlgebra& Stepper::algebra(double dt, const Tableau& tableau) {
    if (!algebra_ || algebra_->dt() != dt || algebra_->tableau().stages != tableau.stages ||
        algebra_->tableau().begins_explicitly != tableau.begins_explicitly)
        algebra_ = std::make_unique<StepAlgebra>(tableau, inertia_, dt);
    return *algebra_;
}

// The strain rates of joint dampers follow from the velocities, so the state does not store them.
std::vector<StageRates> first_rates(const Model& model, const Tableau& tableau, const MotionState& state) {
    if (!tableau.begins_explicitly) return {};
    std::vector<StageRates> rates = {state.rates};
    rates.front().joints.d = model.damper_rates(state.q, state.v);
    return rates;
}

StepRates::StepRates(Model& model, const StepAlgebra& step, const std::vector<FreeBody>& free_bodies,
                     const SubstepRecord& substep, std::span<const LoadParameters> load_parameters)
    : flight(free_bodies, step.tableau(), step.dt(), substep.begin.q, substep.begin.v),
      x_hat(substep.stages.size()),
      v_hat(substep.stages.size()),
      p_hat(substep.stages.size()),
      all(first_rates(model, step.tableau(), substep.begin)) {
    const bool carries = model.may_have_fluid_momentum();
    VectorXd momentum;
    if (carries) {
        model.parameters().set_time_varying(load_parameters.front());
        momentum = model.fluid_momentum(substep.begin.q, substep.begin.v);
    }
    for (int i = 0; i < static_cast<int>(substep.stages.size()); ++i) {
        const VectorXd& q = substep.stages[i].q;
        step.start_of_stage(i, substep.begin, all, x_hat[i], v_hat[i]);
        flight.add_defect(i, x_hat[i], v_hat[i]);
        p_hat[i] = step.start_of_momentum(i, momentum, all);
        StageRates& now = all.emplace_back();
        now.c = substep.stages[i].contact;
        step.finish_stage(i, q, x_hat[i], v_hat[i], model.n_coordinates(), now);
        if (!carries) continue;
        model.parameters().set_time_varying(load_parameters[i + 1]);
        now.momentum_rate = (model.fluid_momentum(q, now.v) - p_hat[i]) / step.stage_time();
    }
    if (carries) model.parameters().set_time_varying(load_parameters.front());
}

// The stages of a step have the same inertia and nearly the same stiffness. So a factorization that served a whole stage serves the next one
// too, except where contact, which need not act in both, changes the stiffness more.
bool Stepper::serves_again(const NewtonReport& last, int factorizations, bool in_contact, const VectorXd& q,
                           const LoadParameters& load_parameters) const {
    Model& model = newton_.model();
    return !projective_ && factorizations <= 1 && last.factor.succeeded && newton_.factor() &&
           newton_.factor()->pattern() == model.dof_map().pattern() && !in_contact &&
           !model.contacts().acts(q, load_parameters);
}

bool Stepper::step(MotionState& state, double dt, bool dissipative,
                   std::span<const LoadParameters> load_parameters, SubstepRecord* kept, bool with_factors,
                   std::string& reason) {
    const StepAlgebra& step = algebra(dt, tableau_from(state, dissipative));
    const Tableau& tableau = step.tableau();
    Model& model = newton_.model();
    const Index coordinates = model.n_coordinates();
    const bool carries = model.may_have_fluid_momentum();
    if (carries) model.parameters().set_time_varying(load_parameters.front());
    const VectorXd momentum = model.fluid_momentum(state.q, state.v);
    model.set_angle_branches(state.angle_branches);
    // The bits of a step depend on the state at its beginning only: the couplings of earlier steps would change the order of elimination.
    // See test_bodies_that_rub_go_on.
    model.contacts().forget();
    model.begin_step(state.q, load_parameters.front());
    const ScopedStrainHistory elastic_afterwards(model);
    const ScopedContactFactor usual_contact_afterwards(model);
    const bool damped = model.capabilities().has_own_viscosity;
    if (viscosity_.any()) model.parameters().set_time_varying(load_parameters.front());
    const StrainSet at_begin = viscosity_.any() ? model.elastic().strains(state.q) : StrainSet(),
                    joints_at_begin = model.dampers().strains(state.q);
    const FreeFlight flight(free_bodies_, tableau, dt, state.q, state.v);
    std::vector<StageRates> rates = first_rates(model, tableau, state);
    std::vector<StageState> stages;
    VectorXd q = state.q, x_hat, v_hat;
    MaxwellStrains e;
    VectorXd motor_forces, held;
    NewtonReport report;  // of the last stage
    int factorizations = 0;
    bool in_contact = false;
    for (int i = 0; i < tableau.stages; ++i) {
        step.start_of_stage(i, state, rates, x_hat, v_hat);
        flight.add_defect(i, x_hat, v_hat);
        const VectorXd p_hat = step.start_of_momentum(i, momentum, rates);
        const double contact_factor = tableau.contact_factor(i);
        model.contacts().set_factor(contact_factor);
        model.parameters().set_time_varying(load_parameters[i + 1]);
        const VectorXd target = step.target(x_hat, v_hat);
        // Predicts constant velocity, that of free bodies as in free flight; dofs without velocity begin where they were.
        q.head(coordinates) = x_hat.head(coordinates) +
                              step.stage_time() * (i == 0 ? state.v : rates.back().v).head(coordinates);
        flight.add_velocity_change(i, step.stage_time(), q);
        if (model.capabilities().has_stiffness_jumps && !projective_)
            if (const VectorXd move =
                    predict_contact(model, q, load_parameters[i + 1], step.weights(),
                                    model.contacts().obstacle_points(state.q, load_parameters.front()));
                move.size() > 0)
                model.dof_map().retract(q, move);
        if (model.dof_map().has_reduced_coordinates() || model.capabilities().has_barrier) {
            const VectorXd predicted = q;
            VectorXd ahead = q - state.q;
            ahead.tail(q.size() - coordinates).setZero();
            const VectorXd others = q.tail(q.size() - coordinates);
            q = state.q;
            // The prediction ends well before a contact, as the barrier is too steep close to it. [-] see test_ball_falls_onto_a_sheet_and_never_through
            constexpr double before_contact = 0.25;
            double alpha = 1.0;
            if (model.capabilities().has_barrier) {
                alpha = model.capabilities().admissible_step_length(q, ahead);
                if (alpha < 1.0) ahead *= before_contact * alpha;
            }
            model.dof_map().retract(q, ahead);
            q.tail(others.size()) = others;
            if (alpha == 1.0) flight.make_rigid(predicted, q);
        }
        const double T = step.stage_time();
        ViscousStage viscous, joints;
        if (viscosity_.any()) {
            viscous =
                ViscousStage(viscosity_, T, dt, tableau.a[i], rates, &StageRates::elastic, at_begin, state.e);
            model.elastic().set_history(viscosity_.scale(T), &viscous.shift);
        }
        if (damped) {
            joints = ViscousStage(damper_law, T, dt, tableau.a[i], rates, &StageRates::joints,
                                  joints_at_begin, {});
            model.dampers().set_history(damper_law.scale(T), &joints.shift);
        }
        const StageMotion motion{&x_hat, &p_hat, step.stage_time()};
        const ProximalTerm proximal{&step.weights(), &target, &motion};
        const bool reused =
            i > 0 && serves_again(report, factorizations, in_contact, q, load_parameters[i + 1]);
        const FactorReport last = report.factor;
        factorizations = newton_.factorizations();
        report = solve(q, state, load_parameters[i + 1], proximal, reused ? &last : nullptr);
        factorizations = newton_.factorizations() - factorizations;
        if (!report.converged) {
            reason = model.not_finite(q, load_parameters[i + 1]);
            if (reason.empty()) reason = report.reason;
            model.set_angle_branches(state.angle_branches);
            return false;
        }
        in_contact = i + 1 < tableau.stages && model.contacts().acts(q, load_parameters[i + 1]);
        StageRates& now = rates.emplace_back();
        VectorXd reactions;  // of supports, only because implicit contact is scaled by the factor
        if (tableau.implicit_contact) {
            const VectorXd force = model.contact_forces(q, load_parameters[i + 1]) / contact_factor;
            now.c = model.dof_map().acceleration(inertia_.mass, force);
            reactions = (contact_factor - 1.0) * (force - inertia_.mass.cwiseProduct(now.c));
        }
        // At the solution the residual of the stage, evaluated last, vanishes except for the support forces.
        if (i + 1 == tableau.stages && model.dof_map().has_supports()) {
            held = model.residual().gradient + step.weights().cwiseProduct(q - target);
            if (tableau.implicit_contact) held += reactions;
            held = model.dof_map().along_supports(held);
        }
        step.finish_stage(i, q, x_hat, v_hat, coordinates, now);
        if (carries) now.momentum_rate = (model.fluid_momentum(q, now.v) - p_hat) / step.stage_time();
        if (i + 1 == tableau.stages && model.dof_map().has_motors())
            motor_forces = MotorReactions(newton_, inertia_, state, step, q, load_parameters[i + 1], proximal,
                                          v_hat, now)
                               .motor_forces(load_parameters[i + 1]);
        if (viscosity_.any()) {
            viscous.finish(viscosity_, T, model.elastic().strains(q), now.elastic);
            e = std::move(viscous.e);
        }
        if (damped) joints.finish(damper_law, T, model.dampers().strains(q), now.joints);
        if (kept) {
            const bool factorized = with_factors && report.iterations > 0;
            stages.push_back({q, model.angle_branches(), factorized ? newton_.factor() : nullptr, now.c});
        }
    }
    reason =
        model.capabilities().crossing_reason(state.q, load_parameters.front(), q, load_parameters.back());
    if (!reason.empty()) {
        model.set_angle_branches(state.angle_branches);
        return false;
    }
    error_ = step_error(model, step, flight, state.v, rates);
    flight.finish(q, rates.back());
    MotionState end{std::move(q), rates.back().v,          model.angle_branches(), std::move(e),
                    {},           std::move(motor_forces), std::move(held)};
    if (model.dof_map().has_motors()) {
        end.v_before = state.v;
        end.dt_before = dt;
    }
    if (tableau_.begins_explicitly) end.rates = std::move(rates.back());
    std::swap(state, end);
    if (kept) *kept = {std::move(end), std::move(stages)};
    return true;
}

}  // namespace magshell
