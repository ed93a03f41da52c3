#include "magshell/solve/stepper.h"

#include <utility>

namespace magshell {

StepAlgebra::StepAlgebra(const Tableau& tableau, const Inertia& inertia, double dt)
    : tableau_(tableau), dt_(dt), stage_time_(tableau.diagonal() * dt) {
    const VectorXd by_acceleration = inertia.mass / (stage_time_ * stage_time_);
    weights_ = by_acceleration + inertia.damping / stage_time_;
    velocity_share_ =
        (weights_.array() > 0.0).select(stage_time_ * by_acceleration.array() / weights_.array(), 0.0);
}

void StepAlgebra::start_of_stage(int i, const MotionState& begin, const std::vector<VectorXd>& v,
                                 const std::vector<VectorXd>& w, VectorXd& x_hat, VectorXd& v_hat) const {
    x_hat = begin.q;
    v_hat = begin.v;
    for (int j = 0; j < i; ++j) {
        x_hat += (dt_ * tableau_.a[i][j]) * v[j];
        v_hat += (dt_ * tableau_.a[i][j]) * w[j];
    }
}

VectorXd StepAlgebra::target(const VectorXd& x_hat, const VectorXd& v_hat) const {
    return x_hat + velocity_share_.cwiseProduct(v_hat);
}

Stepper::Stepper(Newton& newton, const Tableau& tableau, Inertia inertia, const Viscosity& viscosity)
    : newton_(newton), tableau_(tableau), inertia_(std::move(inertia)), viscosity_(viscosity) {}

const StepAlgebra& Stepper::algebra(double dt) {
    if (!algebra_ || algebra_->dt() != dt) algebra_ = std::make_unique<StepAlgebra>(tableau_, inertia_, dt);
    return *algebra_;
}

bool Stepper::step(MotionState& state, double dt, std::span<const Controls> at, std::vector<StageState>* kept,
                   bool with_factors, std::string& reason) {
    const StepAlgebra& step = algebra(dt);
    Model& model = newton_.model();
    const Index coordinates = 3 * model.sheet().n_vertices();
    model.set_memory(state.memory);
    const ElasticAfterwards elastic_afterwards(model);
    const SheetStrains at_begin = viscosity_.any() ? model.strains(state.q) : SheetStrains();
    std::vector<ViscousStage> viscous;
    std::vector<VectorXd> v, w;
    std::vector<StageState> stages;
    VectorXd q = state.q, x_hat, v_hat;
    for (int i = 0; i < tableau_.stages; ++i) {
        step.start_of_stage(i, state, v, w, x_hat, v_hat);
        const VectorXd target = step.target(x_hat, v_hat);
        // As fast as until now; what has no velocity begins where it was.
        q.head(coordinates) =
            x_hat.head(coordinates) + step.stage_time() * (i == 0 ? state.v : v.back()).head(coordinates);
        if (viscosity_.any()) {
            viscous.push_back(
                ViscousStage(viscosity_, step.stage_time(), dt, tableau_.a[i], viscous, at_begin, state.e));
            model.set_history(viscosity_.scale(step.stage_time()), &viscous.back().shift);
        }
        const NewtonReport report = newton_.solve(q, at[i], {&step.weights(), &target});
        if (!report.converged) {
            reason = model.not_finite(q, at[i]);
            if (reason.empty()) reason = report.reason;
            model.set_memory(state.memory);
            return false;
        }
        v.emplace_back(VectorXd::Zero(q.size()));
        v.back().head(coordinates) = (q - x_hat).head(coordinates) / step.stage_time();
        w.emplace_back((v.back() - v_hat) / step.stage_time());
        if (viscosity_.any()) viscous.back().finish(viscosity_, step.stage_time(), model.strains(q));
        const SheetStrains e = viscosity_.maxwell() ? viscous.back().e : SheetStrains();
        if (kept) stages.push_back({q, model.memory(), with_factors ? newton_.release_factor() : nullptr, e});
    }
    state = {std::move(q), std::move(v.back()), model.memory(),
             viscosity_.maxwell() ? std::move(viscous.back().e) : SheetStrains()};
    if (kept) *kept = std::move(stages);
    return true;
}

}  // namespace magshell
