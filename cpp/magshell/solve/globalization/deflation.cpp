#include "magshell/solve/globalization/deflation.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace magshell {
namespace {

// [-] Rms distance from a known equilibrium, over the extent, below which a solution is taken for the same one; see
// test_both_wells_of_a_bistable_beam.
constexpr double same_distance = 1e-5;
// [-] Largest displacement in one step, and in the last step before a search counts as converged, both over the extent; see
// test_saddles_are_found_with_include_unstable.
constexpr double longest_step = 0.25, last_step_tolerance = 1e-3;
// [-] Largest size of the factor between the deflated and the original Newton step; see test_both_wells_of_a_bistable_beam.
constexpr double max_step_factor = 10.0;
// [-] The search ends if less than this fraction of a deflated step leads to a state that has an energy; see
// test_far_beyond_its_first_instability_a_sheet_has_many.
constexpr double min_deflated_step = 1e-4;

// The deflation operator M(q) of the header, with |.| the root mean square over the area of the bodies.
class Deflation {
  public:
    Deflation(const Model& model, const KnownEquilibria& known)
        : known_(known.states), weights_(3.0 * model.metric() / model.metric().sum()), scale_(known.length) {}

    // Returns the number by which the Newton step from q is multiplied: 1 / (1 - d(ln M) . step), limited in size. It is negative, and the
    // deflated step points backwards, if the Newton step leads far towards a known equilibrium.
    double factor(const VectorXd& q, const VectorXd& step) const {
        double change = 0.0;  // d(ln M) . step
        for (const VectorXd& each : known_) {
            const VectorXd away = weights_.cwiseProduct(q - each);
            const double square = away.dot(q - each), scale = scale_ * scale_;
            if (square > 0.0) change -= 2.0 * scale * away.dot(step) / (square * (square + scale));
        }
        const double factor = 1.0 / (1.0 - change);
        return std::isfinite(factor) ? std::clamp(factor, -max_step_factor, max_step_factor)
                                     : max_step_factor;
    }

    // Returns true if a known equilibrium is at most this rms distance [m] away.
    bool is_known(const VectorXd& q, double length) const {
        for (const VectorXd& each : known_)
            if (std::sqrt(weights_.dot((q - each).cwiseAbs2())) <= length) return true;
        return false;
    }

  private:
    const std::vector<VectorXd>& known_;
    const VectorXd weights_;
    const double scale_;
};

}  // namespace

NewtonReport solve_away_from(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                             const KnownEquilibria& known, int max_iterations) {
    Model& model = newton.model();
    const Deflation deflation(model, known);
    const bool mixed = newton.options().mixed;
    NewtonReport report;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    if (std::string reason = model.invalid_state_reason(q); !reason.empty()) return fail(std::move(reason));
    double last_step = 0.0;
    newton.evaluate(q, load_parameters, {});
    for (;; ++report.iterations, newton.count_iteration()) {
        report.residual = newton.relative_residual(q, {});
        newton.watch(report.residual);
        if (!std::isfinite(report.residual)) return fail("the iteration diverged");
        if (report.residual <= newton.options().tolerance &&
            last_step <= last_step_tolerance * model.extent()) {
            report.converged = !deflation.is_known(q, same_distance * model.extent());
            if (!report.converged) report.reason = "the search converged to an equilibrium that is known";
            return report;
        }
        if (report.iterations == max_iterations)
            return fail("no convergence in " + std::to_string(max_iterations) + " iterations");
        Eigen::MatrixXd no_moves(q.size(), 0);
        report.factor = newton.factorize(q, load_parameters, mixed && report.iterations > 0, {}, no_moves);
        if (!report.factor.succeeded) return fail(report.factor.reason);
        VectorXd step = newton.solve_with_factor(-newton.gradient(q, {}));
        step *= deflation.factor(q, step);
        const double length = step.head(model.n_coordinates()).lpNorm<Eigen::Infinity>();
        if (length > longest_step * model.extent()) step *= longest_step * model.extent() / length;
        if (newton.apply_increment(q, step, min_deflated_step, report) < 0.0) return report;
        if (mixed) model.extrapolate(step);
        last_step = step.head(model.n_coordinates()).lpNorm<Eigen::Infinity>();
        newton.evaluate(q, load_parameters, {});
    }
}

}  // namespace magshell
