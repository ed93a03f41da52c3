#include "magshell/solve/relaxing.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

constexpr double settled = 1e-4;  // of the extent
constexpr double rigid =
    1e4;  // a rate this many times the stiffness, or the forces', allows no step to speak of

}  // namespace

Relaxing::Relaxing(Newton& newton, VectorXd& q, const Controls& controls)
    : newton_(newton),
      model_(newton.model()),
      q_(q),
      controls_(controls),
      settled_(settled * model_.extent()) {
    const VectorXd move = model_.reduction().prescribed_increment(q_, controls);
    if (model_.has_body_contact() && model_.largest_share(q_, move) < 1.0)
        report_.reason = model_.stuck(q_, move);
    model_.reduction().advance(q_, move);
    energy_ = model_.energy(q_, controls);
    if (report_.reason.empty()) report_.reason = model_.refusal(q_);
}

bool Relaxing::goes_on_without(const FactorReport& factor, bool at_rest) {
    rate_ = std::max(rate_, forced_rate());
    report_.reason = factor.reason;
    if (!at_rest) return rate_ > 0.0;
    report_.reason = "the equilibrium is neutral: its Hessian is singular (" + factor.reason + ")";
    report_.neutral = true;
    return false;
}

bool Relaxing::crosses(const VectorXd& trial) {
    in_the_way_ = model_.blocked(q_, controls_, trial, controls_);
    return !in_the_way_.empty();
}

double Relaxing::forced_rate() const {
    const Reduction& reduction = model_.reduction();
    const VectorXd force = reduction.vector(model_.residual().gradient),
                   area = reduction.weights(model_.metric());
    double largest = 0.0;
    for (Index k = 0; k < reduction.size(); ++k)
        if (area[k] > 0.0) largest = std::max(largest, std::abs(force[k]) / area[k]);
    return largest / (0.05 * model_.extent());
}

double Relaxing::largest_stiffness() const {
    const VectorXd stiffness = model_.diagonal();
    double largest = 0.0;
    for (Index k = 0; k < model_.n_coordinates(); ++k)
        if (model_.metric()[k] > 0.0)
            largest = std::max(largest, std::abs(stiffness[k]) / model_.metric()[k]);
    return largest;
}

bool Relaxing::is_sensible(double rate) const {
    return rate > 0.0 && rate <= rigid * std::max(largest_stiffness(), forced_rate()) && std::isfinite(rate);
}

double Relaxing::length(const VectorXd& p) const {
    return p.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
}

double Relaxing::leave_saddle(const Mode& mode) {
    constexpr double told = 1e-6;        // by which share one side has to be deeper
    constexpr double round_off = 1e-12;  // of an energy
    const VectorXd saddle = q_;
    struct Side {
        VectorXd q;
        double energy;
    };
    const auto down = [&](double sign) {
        Side side{saddle, energy_};
        for (double amplitude = settled_; amplitude < model_.extent(); amplitude *= 2.0) {
            VectorXd trial = saddle;
            const VectorXd push = sign * amplitude * mode.shape;
            if (model_.has_body_contact() && model_.largest_share(saddle, push) < 1.0) break;
            model_.reduction().advance(trial, push);
            if (!model_.blocked(saddle, controls_, trial, controls_).empty()) break;
            const double energy = model_.energy(trial, controls_);
            // The first push may be too small for the energy to tell, but must be made.
            if (amplitude > settled_ && !(energy < side.energy)) break;
            side = {trial, energy};
        }
        return side;
    };
    ++report_.saddles_left;
    const Side one = down(1.0);
    // What touches ends every push early, on either side: there depths tell little.
    const Side other = model_.has_body_contact() ? one : down(-1.0);
    const bool deeper =
        one.energy - other.energy > told * (energy_ - one.energy) + round_off * std::abs(energy_);
    q_ = deeper ? other.q : one.q;
    return deeper ? other.energy : one.energy;
}

}  // namespace magshell
