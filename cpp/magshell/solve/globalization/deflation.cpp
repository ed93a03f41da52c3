#include "magshell/solve/globalization/deflation.h"

#include <algorithm>
#include <cmath>

#include "magshell/solve/newton/newton_iteration.h"

namespace magshell {
namespace {

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
        constexpr double most = large_factor * large_factor;  // see test_both_wells_of_a_bistable_beam
        const double factor = 1.0 / (1.0 - change);
        return std::isfinite(factor) ? std::clamp(factor, -most, most) : most;
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

// Newton's method with deflated steps.
class DeflatedSteps final : public NewtonIteration {
  public:
    DeflatedSteps(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                  const KnownEquilibria& known, int max_iterations)
        : NewtonIteration(newton, q, load_parameters, no_proximal_, max_iterations),
          deflation_(newton.model(), known) {}

  private:
    bool is_done() override {
        if (report_.residual > newton_.options().tolerance || last_step_ > settled_step * model_.extent())
            return false;
        report_.converged = !deflation_.is_known(q_, settled_part * model_.extent());
        if (!report_.converged) fail("the search converged to an equilibrium that is known");
        return true;
    }

    bool step() override {
        const bool mixed = newton_.options().mixed;
        Eigen::MatrixXd no_moves(q_.size(), 0);
        report_.factor =
            newton_.factorize(q_, load_parameters_, mixed && report_.iterations > 0, proximal_, no_moves);
        if (!report_.factor.succeeded) return fail(report_.factor.reason);
        VectorXd step = newton_.solve_with_factor(-newton_.gradient(q_, proximal_));
        step *= deflation_.factor(q_, step);
        const double longest = good_part * model_.extent();
        if (const double length = largest_displacement(model_, step); length > longest)
            step *= longest / length;
        if (newton_.apply_increment(q_, step, settled_part, report_) < 0.0) return false;
        if (mixed) model_.extrapolate(step);
        last_step_ = largest_displacement(model_, step);
        evaluate();
        return true;
    }

    const ProximalTerm no_proximal_;
    const Deflation deflation_;
    double last_step_ = 0.0;  // [m]
};

}  // namespace

NewtonReport solve_away_from(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                             const KnownEquilibria& known, int max_iterations) {
    return DeflatedSteps(newton, q, load_parameters, known, max_iterations).run();
}

}  // namespace magshell
