#include "magshell/solve/globalization/energy_descent_base.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

// [-] Displacement at which a descent has settled, over the extent; see test_a_compressed_strip_leaves_the_saddle.
constexpr double settled = 1e-4;
// [-] Largest rate, over the stiffness or the rate of the forces; larger ones allow no useful step. See test_blocked_contact_names_the_faces_in_the_way.
constexpr double max_rate_ratio = 1e4;
// [-] Displacement over the extent that defines the rate of the forces; see test_far_beyond_its_first_instability_a_sheet_has_many.
constexpr double forced_length = 0.05;

}  // namespace

EnergyDescent::EnergyDescent(Newton& newton, VectorXd& q, const LoadParameters& load_parameters)
    : newton_(newton),
      model_(newton.model()),
      q_(q),
      load_parameters_(load_parameters),
      settled_(settled * model_.extent()) {
    const VectorXd move = model_.dof_map().prescribed_increment(q_, load_parameters);
    if (model_.capabilities().has_barrier && model_.capabilities().max_step_length(q_, move) < 1.0)
        report_.reason = model_.capabilities().describe_blocked_step(q_, move);
    model_.dof_map().retract(q_, move);
    energy_ = model_.energy(q_, load_parameters);
    if (report_.reason.empty()) report_.reason = model_.capabilities().invalid_state_reason(q_);
}

bool EnergyDescent::continue_without_factor(const FactorReport& factor, bool at_rest) {
    rate_ = std::max(rate_, forced_rate());
    report_.reason = factor.reason;
    if (!at_rest) return rate_ > 0.0;
    report_.reason = "the equilibrium is neither stable nor unstable: its stiffness matrix is singular (" +
                     factor.reason + ")";
    report_.neutral = true;
    return false;
}

bool EnergyDescent::crosses_obstacle(const VectorXd& trial) {
    crossing_reason_ = model_.capabilities().crossing_reason(q_, load_parameters_, trial, load_parameters_);
    return !crossing_reason_.empty();
}

double EnergyDescent::forced_rate() const {
    const DofMap& dof_map = model_.dof_map();
    const VectorXd force = dof_map.vector(model_.residual().gradient),
                   area = dof_map.weights(model_.metric());
    double largest = 0.0;
    for (Index k = 0; k < dof_map.size(); ++k)
        if (area[k] > 0.0) largest = std::max(largest, std::abs(force[k]) / area[k]);
    return largest / (forced_length * model_.extent());
}

double EnergyDescent::largest_stiffness() const {
    const VectorXd stiffness = model_.diagonal();
    double largest = 0.0;
    for (Index k = 0; k < model_.n_coordinates(); ++k)
        if (model_.metric()[k] > 0.0)
            largest = std::max(largest, std::abs(stiffness[k]) / model_.metric()[k]);
    return largest;
}

bool EnergyDescent::is_sensible(double rate) const {
    return rate > 0.0 && rate <= max_rate_ratio * std::max(largest_stiffness(), forced_rate()) &&
           std::isfinite(rate);
}

double EnergyDescent::length(const VectorXd& p) const {
    return p.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
}

double EnergyDescent::leave_saddle(const Mode& mode) {
    // [-] difference of depths that decides; see test_a_pressed_beam_buckles_to_where_the_field_pushes_it
    constexpr double deeper_share = 1e-6;
    // [-] of an energy; see test_a_pressed_beam_buckles_to_where_the_field_pushes_it
    constexpr double round_off = 1e-12;
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
            if (model_.capabilities().has_barrier &&
                model_.capabilities().max_step_length(saddle, push) < 1.0)
                break;
            model_.dof_map().retract(trial, push);
            if (!model_.capabilities()
                     .crossing_reason(saddle, load_parameters_, trial, load_parameters_)
                     .empty())
                break;
            const double energy = model_.energy(trial, load_parameters_);
            // The first displacement may be too small to change the energy, but must be made.
            if (amplitude > settled_ && !(energy < side.energy)) break;
            side = {trial, energy};
        }
        return side;
    };
    ++report_.saddles_escaped;
    const Side one = down(1.0);
    // Contact ends every displacement early on both sides, so that depths cannot be compared.
    const Side other = model_.capabilities().has_barrier ? one : down(-1.0);
    const bool deeper =
        one.energy - other.energy > deeper_share * (energy_ - one.energy) + round_off * std::abs(energy_);
    q_ = deeper ? other.q : one.q;
    return deeper ? other.energy : one.energy;
}

}  // namespace magshell
