#include "magshell/solve/relaxation.h"

#include <cmath>

namespace magshell {
namespace {

// Newton without an anchor, taken only if it starts where the Hessian is positive definite and ends lower.
bool finish(Newton& newton, VectorXd& q, const Controls& controls, double energy, double& residual) {
    const FactorReport factor = newton.factorize_at(q, controls);
    if (!factor.succeeded || factor.negative_pivots > 0) return false;
    VectorXd trial = q;
    const NewtonReport report = newton.solve(trial, controls);
    residual = report.residual;
    if (!report.converged) return false;
    const double slack = 1e-9 * (std::abs(energy) + 1e-300);
    if (newton.model().energy(trial, controls) > energy + slack) return false;
    const FactorReport at_solution = newton.factorize_at(trial, controls);
    if (!at_solution.succeeded || at_solution.negative_pivots > 0) return false;
    q = trial;
    return true;
}

}  // namespace

RelaxationReport relax(Newton& newton, VectorXd& q, const Controls& controls, double rate, int max_steps) {
    constexpr int iterations_a_step = 10, quick = 5;
    constexpr double growth = 4.0, largest_rate_factor = 1e12;
    RelaxationReport report;
    const Model& model = newton.model();
    const double first_rate = rate;
    q += model.reduction().prescribed_increment(q, controls.motion);
    double energy = model.energy(q, controls);
    for (; report.steps < max_steps; ++report.steps) {
        const VectorXd anchor = q;
        VectorXd trial = q;
        const NewtonReport step = newton.solve(trial, controls, {rate, &anchor}, iterations_a_step);
        const double trial_energy = step.converged ? model.energy(trial, controls) : 0.0;
        const VectorXd moved = trial - anchor;
        const double pull = 0.5 * rate * moved.dot(model.metric().cwiseProduct(moved));
        if (!step.converged || !(trial_energy + pull <= energy + 1e-12 * std::abs(energy))) {
            rate *= growth;
            if (rate > largest_rate_factor * first_rate) {
                report.reason = "no step lowers the energy, however short";
                return report;
            }
            continue;
        }
        q = trial;
        energy = trial_energy;
        report.residual = step.residual;
        if (finish(newton, q, controls, energy, report.residual)) {
            report.converged = true;
            return report;
        }
        rate /= step.iterations <= quick ? growth : 1.0;
    }
    report.reason = "not at rest after " + std::to_string(max_steps) + " steps";
    return report;
}

}  // namespace magshell
