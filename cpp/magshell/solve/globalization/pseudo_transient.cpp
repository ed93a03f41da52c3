#include "magshell/solve/globalization/pseudo_transient.h"

#include <algorithm>
#include <cmath>

#include "magshell/solve/globalization/energy_descent.h"
#include "magshell/solve/globalization/energy_descent_base.h"

namespace magshell {
namespace {

// Newton iterations of a step, at most, and up to which the next step grows; see test_far_beyond_its_first_instability_a_sheet_has_many.
constexpr int max_step_iterations = 10, quick_step_iterations = 6;
// [-] Rate 1/dt over the size of the most negative eigenvalue; see test_strip_folds_onto_itself.
constexpr double transient_rate_factor = 1.3;
// [-] Increase of the rate after a rejected step, and its decrease after an easy one; see test_strip_folds_onto_itself.
constexpr double rate_growth = 2.0, rate_decay = 4.0;

class PseudoTransient : private EnergyDescent {
  public:
    PseudoTransient(Newton& newton, VectorXd& q, const LoadParameters& load_parameters)
        : EnergyDescent(newton, q, load_parameters) {}

    RelaxationReport run(int max_steps) {
        return run_loop(max_steps, [&] { return prepare(); }, [&] { return advance(); });
    }

  private:
    // Assesses q by its Hessian. Returns false if Newton finishes from here; otherwise sets the rate of the next step.
    bool prepare() {
        const FactorReport factor = newton_.factorize_at(q_, load_parameters_);
        if (!factor.succeeded)
            return continue_without_factor(factor,
                                           newton_.relative_residual(q_, {}) <= newton_.options().tolerance);
        const bool convex = factor.negative_pivots == 0;
        if (convex) report_.descent_direction.resize(0);
        if (!convex || rate_ == 0.0) {
            const bool at_rest = newton_.relative_residual(q_, {}) <= newton_.options().tolerance;
            Mode mode = most_unstable_mode(newton_, q_, load_parameters_, factor.negative_pivots);
            // The rate does not fall below the last one, which was needed a moment ago.
            rate_ = std::max(transient_rate_factor * std::abs(mode.eigenvalue), rate_);
            if (mode.eigenvalue < 0.0 && (at_rest || last_displacement_ < settled_))
                energy_ = leave_saddle(mode);
            if (mode.eigenvalue < 0.0) report_.descent_direction = std::move(mode.shape);
        }
        report_.converged = convex && finish();
        return !report_.converged;
    }

    bool finish() {
        return finish_with_newton([&](VectorXd& trial) { return newton_.solve(trial, load_parameters_); },
                                  [&](const NewtonReport&, const VectorXd& trial) {
                                      return lowers(model_.energy(trial, load_parameters_));
                                  });
    }

    bool advance() {
        while (!euler_step()) {
            rate_ *= rate_growth;
            if (!is_sensible(rate_)) return false;
        }
        return true;
    }

    bool euler_step() {
        const VectorXd proximal = q_;
        VectorXd trial = q_;
        const Model::AngleBranches angle_branches = model_.angle_branches();
        const VectorXd weights = rate_ * model_.metric();
        const NewtonReport report =
            newton_.solve(trial, load_parameters_,
                          {.proximal = {&weights, &proximal}, .max_iterations = max_step_iterations});
        const VectorXd moved = trial - proximal;
        const double energy = report.converged ? model_.energy(trial, load_parameters_) : 0.0;
        const double pull = 0.5 * moved.dot(weights.cwiseProduct(moved));
        if (!report.converged || !lowers(energy + pull) || crosses_obstacle(trial)) {
            model_.set_angle_branches(angle_branches);
            return false;
        }
        q_ = trial;
        energy_ = energy;
        last_displacement_ = length(moved);
        report_.last_displacement = last_displacement_;
        if (report.iterations <= quick_step_iterations) rate_ /= rate_decay;
        return true;
    }
};

}  // namespace

RelaxationReport relax(Newton& newton, VectorXd& q, const LoadParameters& load_parameters, int max_steps,
                       bool from_rest) {
    const Model& model = newton.model();
    RelaxationReport report;
    const Capabilities& has = model.capabilities();
    if (from_rest && !has.has_barrier && !has.has_unsymmetric_tangent) {
        report = descend_to_stable(newton, q, load_parameters, max_steps);
        if (report.converged || report.neutral || report.steps >= max_steps) return report;
    }
    const int steps = report.steps, saddles_escaped = report.saddles_escaped;
    report = PseudoTransient(newton, q, load_parameters).run(max_steps - steps);
    report.steps += steps;
    report.saddles_escaped += saddles_escaped;
    if (report.converged || !has.has_barrier || !model.capabilities().invalid_state_reason(q).empty())
        return report;
    // Contact may be the cause whatever the reason was, so the largest contact force is named.
    newton.evaluate(q, load_parameters, {});
    if (const std::string hardest = model.contacts().describe_largest_force(); !hardest.empty())
        report.reason += "; bodies touch: " + hardest;
    return report;
}

}  // namespace magshell
