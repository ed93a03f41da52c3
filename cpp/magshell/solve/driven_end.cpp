#include "magshell/solve/driven_end.h"

#include <limits>

namespace magshell {

DrivenEnd::DrivenEnd(Newton& newton, const Inertia& inertia, const MotionState& begin, double dt,
                     const VectorXd& q, const Controls& controls, const Anchor& anchor,
                     const StageRates& last)
    : newton_(newton), anchor_(anchor), q_(q), target_(*anchor.target) {
    Model& model = newton_.model();
    if (begin.dt_before == 0.0) {
        newton_.evaluate(q_, controls, anchor_);
        return;
    }
    const double r = dt / begin.dt_before;
    share_last_ = (1.0 + 2.0 * r) / (1.0 + r) / dt;
    share_begin_ = -(1.0 + r) / dt;
    share_before_ = r * r / (1.0 + r) / dt;
    change_ = share_last_ * last.v + share_begin_ * begin.v + share_before_ * begin.v_before - last.w;
    const VectorXd pull = inertia.mass.cwiseProduct(change_);
    target_ -= (anchor.weights->array() != 0.0).select(pull.array() / anchor.weights->array(), 0.0).matrix();
    const Model::Turns turns = model.turns();
    found_ = find(controls);
    model.set_turns(turns);
}

// So near the solution that steps with a factorization from nearby will do, as a rule.
bool DrivenEnd::find(const Controls& controls) {
    constexpr int most_steps = 4;
    Model& model = newton_.model();
    const Anchor anchor = this->anchor();
    const VectorXd from = q_;
    const Model::Turns turns = model.turns();
    newton_.evaluate(q_, controls, anchor);
    for (int k = 0; k <= most_steps; ++k) {
        if (newton_.relative_residual(q_, anchor) <= newton_.options().tolerance) return true;
        const std::shared_ptr<Factor> nearby = newton_.factor();
        if (k == most_steps || !nearby || nearby->pattern() != model.reduction().pattern()) break;
        VectorXd step = -newton_.gradient(q_, anchor);
        if (!newton_.solve_nearby(q_, controls, anchor, *nearby, step).converged) break;
        model.reduction().advance(q_, step);
        newton_.evaluate(q_, controls, anchor);
    }
    q_ = from;
    model.set_turns(turns);
    return newton_.solve(q_, controls, anchor).converged;
}

// Where stiffness is large, positions do not hold what is left of the residual: it is taken out to first order.
VectorXd DrivenEnd::driving(const Controls& controls) {
    Model& model = newton_.model();
    VectorXd force = newton_.gradient(q_, anchor());
    if (!found_)
        return VectorXd::Constant(model.reduction().driving(force).size(),
                                  std::numeric_limits<double>::quiet_NaN());
    VectorXd left = force, pull(q_.size());
    const std::shared_ptr<Factor> nearby = newton_.factor();
    if (nearby && nearby->pattern() == model.reduction().pattern() &&
        newton_.solve_nearby(q_, controls, anchor(), *nearby, left).converged) {
        model.multiply(left, pull);
        model.remainder().add_product(left, true, pull);
        force -= pull + anchor_.weights->cwiseProduct(left);
    }
    return model.reduction().driving(force);
}

}  // namespace magshell
