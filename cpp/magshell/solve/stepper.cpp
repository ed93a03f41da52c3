#include "magshell/solve/stepper.h"

#include <utility>

#include "magshell/solve/driven_end.h"
#include "magshell/solve/landing.h"

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
        v_hat += (dt_ * tableau_.a[i][j]) * rates[j].w;
    }
}

void StepAlgebra::finish_stage(const VectorXd& q, const VectorXd& x_hat, const VectorXd& v_hat,
                               Index coordinates, StageRates& rates) const {
    rates.v = VectorXd::Zero(q.size());
    rates.v.head(coordinates) = (q - x_hat).head(coordinates) / stage_time_;
    rates.w = (rates.v - v_hat) / stage_time_;
}

VectorXd StepAlgebra::target(const VectorXd& x_hat, const VectorXd& v_hat) const {
    return x_hat + velocity_share_.cwiseProduct(v_hat);
}

Stepper::Stepper(Newton& newton, const Tableau& tableau, Inertia inertia, const Viscosity& viscosity,
                 const ProjectiveOptions& projective)
    : newton_(newton), tableau_(tableau), inertia_(std::move(inertia)), viscosity_(viscosity) {
    if (projective.on) projective_ = std::make_unique<ProjectiveSolver>(newton, projective);
}

NewtonReport Stepper::solve(VectorXd& q, const Controls& controls, const Anchor& anchor) {
    Model& model = newton_.model();
    if (projective_) {
        const double scale = viscosity_.any() ? viscosity_.scale(anchor.motion->time) : 1.0;
        return projective_->solve(q, controls, anchor, scale);
    }
    const VectorXd predicted = q;
    const Model::Turns turns = model.turns();
    NewtonReport report = newton_.solve(q, controls, anchor);
    // Where bodies touched, Newton has searched already.
    const bool searched = model.has_body_contact() && report.touched;
    if (!report.converged && !searched && (model.has_contact() || newton_.options().mixed)) {
        q = predicted;
        model.set_turns(turns);
        report = model.has_contact() ? newton_.solve_damped(q, controls, anchor)
                                     : newton_.solve_plain(q, controls, anchor);
    }
    return report;
}

const Tableau& Stepper::tableau_from(const MotionState& state, bool dissipative) const {
    if (dissipative) return dissipative_;
    return tableau_.begins_explicitly && state.rates.empty() ? starter_ : tableau_;
}

const StepAlgebra& Stepper::algebra(double dt, const Tableau& tableau) {
    if (!algebra_ || algebra_->dt() != dt || algebra_->tableau().stages != tableau.stages ||
        algebra_->tableau().begins_explicitly != tableau.begins_explicitly)
        algebra_ = std::make_unique<StepAlgebra>(tableau, inertia_, dt);
    return *algebra_;
}

// What dampers feel follows from the motion: no state has to remember it.
std::vector<StageRates> first_rates(const Model& model, const Tableau& tableau, const MotionState& state) {
    if (!tableau.begins_explicitly) return {};
    std::vector<StageRates> rates = {state.rates};
    rates.front().joints.d = model.damper_rates(state.q, state.v);
    return rates;
}

StepRates::StepRates(const Model& model, const StepAlgebra& step, const SubstepRecord& substep)
    : x_hat(substep.stages.size()),
      v_hat(substep.stages.size()),
      all(first_rates(model, step.tableau(), substep.begin)) {
    for (int i = 0; i < static_cast<int>(substep.stages.size()); ++i) {
        step.start_of_stage(i, substep.begin, all, x_hat[i], v_hat[i]);
        step.finish_stage(substep.stages[i].q, x_hat[i], v_hat[i], model.n_coordinates(), all.emplace_back());
    }
}

bool Stepper::step(MotionState& state, double dt, bool dissipative, std::span<const Controls> controls,
                   SubstepRecord* kept, bool with_factors, std::string& reason) {
    const StepAlgebra& step = algebra(dt, tableau_from(state, dissipative));
    const Tableau& tableau = step.tableau();
    Model& model = newton_.model();
    const Index coordinates = model.n_coordinates();
    model.set_turns(state.turns);
    model.begin_step(state.q, controls.front());
    const ElasticAfterwards elastic_afterwards(model);
    const bool damped = !model.dampers().empty();
    if (viscosity_.any()) model.take(controls.front());
    const StrainSet at_begin = viscosity_.any() ? model.elastic().strains(state.q) : StrainSet(),
                    joints_at_begin = model.dampers().strains(state.q);
    std::vector<StageRates> rates = first_rates(model, tableau, state);
    std::vector<StageState> stages;
    VectorXd q = state.q, x_hat, v_hat;
    StrainSet e;
    VectorXd driving, held;
    for (int i = 0; i < tableau.stages; ++i) {
        step.start_of_stage(i, state, rates, x_hat, v_hat);
        model.take(controls[i + 1]);
        const VectorXd target = step.target(x_hat, v_hat);
        // As fast as until now; what has no velocity begins where it was.
        q.head(coordinates) = x_hat.head(coordinates) +
                              step.stage_time() * (i == 0 ? state.v : rates.back().v).head(coordinates);
        if (model.has_contact() && !projective_)
            if (const VectorXd move =
                    landing(model, q, controls[i + 1], step.weights(),
                            model.contact()->active_contacts(state.q.data(), controls.front()));
                move.size() > 0)
                model.reduction().advance(q, move);
        if (model.reduction().carries() || model.has_body_contact()) {
            VectorXd ahead = q - state.q;
            ahead.tail(q.size() - coordinates).setZero();
            const VectorXd others = q.tail(q.size() - coordinates);
            q = state.q;
            // Well short of what is in the way, if anything is: very near it, a barrier is too steep to begin at.
            if (model.has_body_contact()) {
                const double share = model.share_of_step(q, ahead);
                if (share < 1.0) ahead *= 0.25 * share;
            }
            model.reduction().advance(q, ahead);
            q.tail(others.size()) = others;
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
        const StageMotion motion{&x_hat, &v_hat, step.stage_time()};
        const Anchor anchor{&step.weights(), &target, &motion};
        const NewtonReport report = solve(q, controls[i + 1], anchor);
        if (!report.converged) {
            reason = model.not_finite(q, controls[i + 1]);
            if (reason.empty()) reason = report.reason;
            model.set_turns(state.turns);
            return false;
        }
        // The stage's whole residual, evaluated at q last: it vanishes but for what supports hold.
        if (i + 1 == tableau.stages && model.reduction().holds())
            held =
                model.reduction().held(model.residual().gradient + step.weights().cwiseProduct(q - target));
        StageRates& now = rates.emplace_back();
        step.finish_stage(q, x_hat, v_hat, coordinates, now);
        if (i + 1 == tableau.stages && model.reduction().drives())
            driving = DrivenEnd(newton_, inertia_, state, dt, q, controls[i + 1], anchor, now)
                          .driving(controls[i + 1]);
        if (viscosity_.any()) {
            viscous.finish(viscosity_, T, model.elastic().strains(q), now.elastic);
            e = std::move(viscous.e);
        }
        if (damped) joints.finish(damper_law, T, model.dampers().strains(q), now.joints);
        if (kept) {
            const bool factorized = with_factors && report.iterations > 0;
            stages.push_back({q, model.turns(), factorized ? newton_.release_factor() : nullptr});
        }
    }
    reason = model.blocked(state.q, controls.front(), q, controls.back());
    if (!reason.empty()) {
        model.set_turns(state.turns);
        return false;
    }
    MotionState end{std::move(q), rates.back().v,     model.turns(),  std::move(e),
                    {},           std::move(driving), std::move(held)};
    if (model.reduction().drives()) {
        end.v_before = state.v;
        end.dt_before = dt;
    }
    if (tableau_.begins_explicitly) end.rates = std::move(rates.back());
    std::swap(state, end);
    if (kept) *kept = {std::move(end), std::move(stages)};
    return true;
}

}  // namespace magshell
