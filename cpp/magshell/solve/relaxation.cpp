#include "magshell/solve/relaxation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/solve/modes.h"
#include "magshell/term/body_contact_term.h"

namespace magshell {
namespace {

constexpr int iterations_a_step = 10, quick_iterations = 6;
constexpr double above_instability = 1.3;  // the rate, over the most negative eigenvalue's size
constexpr double rate_growth = 2.0, rate_decay = 4.0;
constexpr double settled = 1e-4;  // of the extent: a step that moves less has come to rest, or to a saddle
constexpr double rigid =
    1e4;  // a rate this many times the stiffness, or the forces', allows no step to speak of

class Relaxation {
  public:
    Relaxation(Newton& newton, VectorXd& q, const Controls& controls)
        : newton_(newton), model_(newton.model()), q_(q), controls_(controls) {
        const VectorXd move = model_.reduction().prescribed_increment(q_, controls);
        if (model_.has_body_contact() && model_.largest_share(q_, move) < 1.0)
            report_.reason = model_.stuck(q_, move);
        model_.reduction().advance(q_, move);
        energy_ = model_.energy(q_, controls);
    }

    RelaxationReport run(int max_steps) {
        if (report_.reason.empty()) report_.reason = model_.refusal(q_);
        if (!report_.reason.empty()) return report_;
        for (; report_.steps < max_steps; ++report_.steps) {
            if (!prepare()) return report_;
            while (!step()) {
                rate_ *= rate_growth;
                // Asked so that numbers beyond all bounds, and a rate of zero, which no doubling changes, end it too.
                if (!(rate_ > 0.0 && rate_ <= rigid * std::max(largest_stiffness(), forced_rate()) &&
                      std::isfinite(rate_))) {
                    report_.reason = "no step lowers the energy, however short";
                    return report_;
                }
            }
        }
        report_.reason = "not at rest after " + std::to_string(max_steps) + " steps";
        return report_;
    }

  private:
    // From the Hessian at q: done, where Newton finishes from here; otherwise the rate of the next step.
    bool prepare() {
        const FactorReport factor = newton_.factorize_at(q_, controls_);
        if (!factor.succeeded) {  // as of a sheet that can still turn freely: the forces say how fast it may
            rate_ = std::max(rate_, forced_rate());
            report_.reason = factor.reason;
            if (newton_.relative_residual(q_, {}) > newton_.options().tolerance) return rate_ > 0.0;
            report_.reason = "the equilibrium is neutral: its Hessian is singular";
            return false;
        }
        const bool convex = factor.negative_pivots == 0;
        if (convex) report_.falling.resize(0);
        if (!convex || rate_ == 0.0) {
            const bool at_rest = newton_.relative_residual(q_, {}) <= newton_.options().tolerance;
            Mode mode = most_unstable_mode(newton_, q_, controls_, factor.negative_pivots);
            // Not far below a rate that was needed a moment ago.
            rate_ = std::max(above_instability * std::abs(mode.eigenvalue), rate_);
            if (mode.eigenvalue < 0.0 && (at_rest || last_move_ < settled * model_.extent()))
                leave_saddle(mode);
            if (mode.eigenvalue < 0.0) report_.falling = std::move(mode.shape);
        }
        report_.converged = convex && finish();
        return !report_.converged;
    }

    // With this rate the forces move a sheet that only the anchor holds by a twentieth of its extent.
    double forced_rate() const {
        const Reduction& reduction = model_.reduction();
        const VectorXd force = reduction.vector(model_.residual().gradient),
                       area = reduction.weights(model_.metric());
        double largest = 0.0;
        for (Index k = 0; k < reduction.size(); ++k)
            if (area[k] > 0.0) largest = std::max(largest, std::abs(force[k]) / area[k]);
        return largest / (0.05 * model_.extent());
    }

    // Of the last assembled Hessian, per area: a rate like it holds every vertex where it is.
    double largest_stiffness() const {
        const VectorXd stiffness = model_.diagonal();
        double largest = 0.0;
        for (Index k = 0; k < model_.n_coordinates(); ++k)
            if (model_.metric()[k] > 0.0)
                largest = std::max(largest, std::abs(stiffness[k]) / model_.metric()[k]);
        return largest;
    }

    void leave_saddle(const Mode& mode) {
        const VectorXd saddle = q_;
        ++report_.saddles_left;
        for (double amplitude = settled * model_.extent(); amplitude < model_.extent(); amplitude *= 2.0) {
            VectorXd trial = saddle;
            const VectorXd push = amplitude * mode.shape;
            if (model_.has_body_contact() && model_.largest_share(saddle, push) < 1.0) break;
            model_.reduction().advance(trial, push);
            const double energy = model_.energy(trial, controls_);
            // The first push may be too small for the energy to tell, but must be made.
            if (amplitude > settled * model_.extent() && !(energy < energy_)) break;
            energy_ = energy;
            q_ = trial;
        }
    }

    bool finish() {
        VectorXd trial = q_;
        const Model::Turns turns = model_.turns();
        const NewtonReport report = newton_.solve(trial, controls_);
        if (!report.converged || !lowers(model_.energy(trial, controls_))) {
            model_.set_turns(turns);
            return false;
        }
        report_.residual = report.residual;
        q_ = trial;
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
        if (!report.converged || !lowers(energy + pull)) {
            model_.set_turns(turns);
            return false;
        }
        q_ = trial;
        energy_ = energy;
        last_move_ = moved.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
        report_.last_move = last_move_;
        if (report.iterations <= quick_iterations) rate_ /= rate_decay;
        return true;
    }

    bool lowers(double energy) const { return energy <= energy_ + 1e-12 * std::abs(energy_); }

    Newton& newton_;
    Model& model_;
    VectorXd& q_;
    const Controls& controls_;
    RelaxationReport report_;
    double energy_, rate_ = 0.0;
    double last_move_ = std::numeric_limits<double>::infinity();
};

}  // namespace

RelaxationReport relax(Newton& newton, VectorXd& q, const Controls& controls, int max_steps) {
    RelaxationReport report = Relaxation(newton, q, controls).run(max_steps);
    const Model& model = newton.model();
    if (report.converged || !model.has_body_contact() || !model.refusal(q).empty()) return report;
    // Whatever the reason, what touches may be what is in the way.
    newton.evaluate(q, controls, {});
    if (const std::string hardest = model.body_contact()->hardest(); !hardest.empty())
        report.reason += "; bodies touch: " + hardest;
    return report;
}

}  // namespace magshell
