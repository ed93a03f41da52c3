#include "magshell/solve/deflation.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace magshell {
namespace {

constexpr double same = 1e-5;          // of the extent: so near to a known one it is that one
constexpr double longest_step = 0.25;  // of the extent
constexpr double largest_factor = 10.0;

class Deflation {
  public:
    Deflation(const Model& model, const Known& known)
        : known_(known.states), weights_(3.0 * model.metric() / model.metric().sum()), scale_(known.reach) {}

    // What to multiply the Newton step from q by.
    double factor(const VectorXd& q, const VectorXd& step) const {
        double change = 0.0;  // d(ln M) . step
        for (const VectorXd& each : known_) {
            const VectorXd away = weights_.cwiseProduct(q - each);
            const double square = away.dot(q - each), scale = scale_ * scale_;
            if (square > 0.0) change -= 2.0 * scale * away.dot(step) / (square * (square + scale));
        }
        const double factor = 1.0 / (1.0 - change);
        return std::isfinite(factor) ? std::clamp(factor, -largest_factor, largest_factor) : largest_factor;
    }

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

NewtonReport solve_away_from(Newton& newton, VectorXd& q, const Controls& controls, const Known& known,
                             int max_iterations) {
    Model& model = newton.model();
    const Deflation deflation(model, known);
    const bool mixed = newton.options().mixed;
    NewtonReport report;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    if (std::string reason = model.refusal(q); !reason.empty()) return fail(std::move(reason));
    double last_step = 0.0;
    newton.evaluate(q, controls, {});
    for (;; ++report.iterations, newton.count_iteration()) {
        report.residual = newton.relative_residual(q, {});
        newton.watch(report.residual);
        if (!std::isfinite(report.residual)) return fail("the iteration diverged");
        if (report.residual <= newton.options().tolerance && last_step <= 1e-3 * model.extent()) {
            report.converged = !deflation.is_known(q, same * model.extent());
            if (!report.converged) report.reason = "the equilibrium is known";
            return report;
        }
        if (report.iterations == max_iterations)
            return fail("no convergence in " + std::to_string(max_iterations) + " iterations");
        Eigen::MatrixXd no_moves(q.size(), 0);
        report.factor = newton.factorize(q, controls, mixed && report.iterations > 0, {}, no_moves);
        if (!report.factor.succeeded) return fail(report.factor.reason);
        VectorXd step = newton.solve_with_factor(-newton.gradient(q, {}));
        step *= deflation.factor(q, step);
        const double length = step.head(model.n_coordinates()).lpNorm<Eigen::Infinity>();
        if (length > longest_step * model.extent()) step *= longest_step * model.extent() / length;
        if (newton.advance(q, step, 1e-4, report) < 0.0) return report;
        if (mixed) model.extrapolate(step);
        last_step = step.head(model.n_coordinates()).lpNorm<Eigen::Infinity>();
        newton.evaluate(q, controls, {});
    }
}

}  // namespace magshell
