#include "magshell/solve/relaxation.h"

#include <algorithm>
#include <cmath>

#include "magshell/solve/modes.h"

namespace magshell {
namespace {

constexpr int iterations_a_step = 10, quick_iterations = 6;
constexpr double above_instability = 1.3;  // the rate, over the most negative eigenvalue's size
constexpr double rate_growth = 2.0, rate_decay = 4.0;
constexpr double smallest_step = 1e-12;  // of a rate, over the first one, before giving up

class Relaxation {
  public:
    Relaxation(Newton& newton, VectorXd& q, const Controls& controls)
        : newton_(newton), model_(newton.model()), q_(q), controls_(controls) {
        q_ += model_.reduction().prescribed_increment(q_, controls.motion);
        energy_ = model_.energy(q_, controls);
    }

    RelaxationReport run(int max_steps) {
        for (; report_.steps < max_steps; ++report_.steps) {
            if (!choose_rate()) return report_;
            while (!step()) {
                rate_ *= rate_growth;
                if (rate_ * smallest_step > first_rate_) {
                    report_.reason = "no step lowers the energy, however short";
                    return report_;
                }
            }
            if (stationary()) {
                report_.converged = true;
                return report_;
            }
        }
        report_.reason = "not at rest after " + std::to_string(max_steps) + " steps";
        return report_;
    }

  private:
    // From the Hessian at q: done, where Newton finishes from here; otherwise the rate of the next step.
    bool choose_rate() {
        const FactorReport factor = newton_.factorize_at(q_, controls_);
        if (!factor.succeeded) {
            report_.reason = factor.reason;
            return false;
        }
        const bool convex = factor.negative_pivots == 0;
        if (!convex || rate_ == 0.0) {
            const int count = static_cast<int>(std::min<Index>(factor.negative_pivots, 6)) + 1;
            const double lowest = modes_near_zero(newton_, count).front().eigenvalue;
            rate_ = above_instability * std::abs(lowest);
            if (first_rate_ == 0.0) first_rate_ = rate_;
        }
        if (convex && finish()) {
            report_.converged = true;
            return false;
        }
        return true;
    }

    bool finish() {
        VectorXd trial = q_;
        const NewtonReport report = newton_.solve(trial, controls_);
        if (!report.converged || !lowers(model_.energy(trial, controls_))) return false;
        report_.residual = report.residual;
        q_ = trial;
        return true;
    }

    bool step() {
        const VectorXd anchor = q_;
        VectorXd trial = q_;
        const NewtonReport report = newton_.solve(trial, controls_, {rate_, &anchor}, iterations_a_step);
        if (!report.converged) return false;
        const VectorXd moved = trial - anchor;
        const double energy = model_.energy(trial, controls_);
        if (!lowers(energy + 0.5 * rate_ * moved.dot(model_.metric().cwiseProduct(moved)))) return false;
        q_ = trial;
        energy_ = energy;
        if (report.iterations <= quick_iterations) rate_ /= rate_decay;
        return true;
    }

    bool stationary() {
        model_.evaluate(q_, controls_);
        report_.residual = newton_.relative_residual(q_, {});
        return report_.residual <= newton_.options().tolerance;
    }

    bool lowers(double energy) const { return energy <= energy_ + 1e-9 * std::abs(energy_); }

    Newton& newton_;
    Model& model_;
    VectorXd& q_;
    const Controls& controls_;
    RelaxationReport report_;
    double energy_, rate_ = 0.0, first_rate_ = 0.0;
};

}  // namespace

RelaxationReport relax(Newton& newton, VectorXd& q, const Controls& controls, int max_steps) {
    return Relaxation(newton, q, controls).run(max_steps);
}

}  // namespace magshell
