#include "magshell/solve/relaxation.h"

#include <algorithm>
#include <cmath>

#include "magshell/solve/downhill.h"
#include "magshell/solve/relaxing.h"
#include "magshell/term/body_contact_term.h"

namespace magshell {
namespace {

constexpr int iterations_a_step = 10, quick_iterations = 6;
constexpr double damped_above_instability = 1.3;  // the rate, over the most negative eigenvalue's size
constexpr double rate_growth = 2.0, rate_decay = 4.0;

class Flow : private Relaxing {
  public:
    Flow(Newton& newton, VectorXd& q, const Controls& controls) : Relaxing(newton, q, controls) {}

    RelaxationReport run(int max_steps) {
        return go(max_steps, [&] { return prepare(); }, [&] { return advance(); });
    }

  private:
    // From the Hessian at q: done, where Newton finishes from here; otherwise the rate of the next step.
    bool prepare() {
        const FactorReport factor = newton_.factorize_at(q_, controls_);
        if (!factor.succeeded)
            return goes_on_without(factor, newton_.relative_residual(q_, {}) <= newton_.options().tolerance);
        const bool convex = factor.negative_pivots == 0;
        if (convex) report_.falling.resize(0);
        if (!convex || rate_ == 0.0) {
            const bool at_rest = newton_.relative_residual(q_, {}) <= newton_.options().tolerance;
            Mode mode = most_unstable_mode(newton_, q_, controls_, factor.negative_pivots);
            // Not far below a rate that was needed a moment ago.
            rate_ = std::max(damped_above_instability * std::abs(mode.eigenvalue), rate_);
            if (mode.eigenvalue < 0.0 && (at_rest || last_move_ < settled_)) energy_ = leave_saddle(mode);
            if (mode.eigenvalue < 0.0) report_.falling = std::move(mode.shape);
        }
        report_.converged = convex && finish();
        return !report_.converged;
    }

    bool finish() {
        return ends_by([&](VectorXd& trial) { return newton_.solve(trial, controls_); },
                       [&](const NewtonReport&, const VectorXd& trial) {
                           return lowers(model_.energy(trial, controls_));
                       });
    }

    bool advance() {
        while (!step()) {
            rate_ *= rate_growth;
            if (!is_sensible(rate_)) return false;
        }
        return true;
    }

    bool step() {
        const VectorXd anchor = q_;
        VectorXd trial = q_;
        const Model::Turns turns = model_.turns();
        const VectorXd weights = rate_ * model_.metric();
        const NewtonReport report = newton_.solve(trial, controls_, {&weights, &anchor}, iterations_a_step);
        const VectorXd moved = trial - anchor;
        const double energy = report.converged ? model_.energy(trial, controls_) : 0.0;
        const double pull = 0.5 * moved.dot(weights.cwiseProduct(moved));
        if (!report.converged || !lowers(energy + pull) || crosses(trial)) {
            model_.set_turns(turns);
            return false;
        }
        q_ = trial;
        energy_ = energy;
        last_move_ = length(moved);
        report_.last_move = last_move_;
        if (report.iterations <= quick_iterations) rate_ /= rate_decay;
        return true;
    }
};

}  // namespace

RelaxationReport relax(Newton& newton, VectorXd& q, const Controls& controls, int max_steps, bool from_rest) {
    const Model& model = newton.model();
    RelaxationReport report;
    if (from_rest && !model.has_body_contact() && !model.follows()) {
        report = go_downhill(newton, q, controls, max_steps);
        if (report.converged || report.neutral || report.steps >= max_steps) return report;
    }
    const int steps = report.steps, saddles_left = report.saddles_left;
    report = Flow(newton, q, controls).run(max_steps - steps);
    report.steps += steps;
    report.saddles_left += saddles_left;
    if (report.converged || !model.has_body_contact() || !model.refusal(q).empty()) return report;
    // Whatever the reason, what touches may be what is in the way.
    newton.evaluate(q, controls, {});
    if (const std::string hardest = model.body_contact()->hardest(); !hardest.empty())
        report.reason += "; bodies touch: " + hardest;
    return report;
}

}  // namespace magshell
