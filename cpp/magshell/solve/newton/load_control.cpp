#include "magshell/solve/newton/load_control.h"

#include <algorithm>

#include "magshell/solve/newton/newton_iteration.h"

namespace magshell {
namespace {

// [-] Displacement of the first iteration that a step aims at, over the extent; see test_a_thin_strip_rolled_up.
constexpr double good_length = 0.25;
// [-] Factor by which steps grow and shrink as a rule; its square where the last iteration says that more is needed, and its cube
// between the smallest step and a good one. See test_a_thin_strip_rolled_up.
constexpr double step_factor = 2.0;

}  // namespace

double LoadStepController::propose(double left) {
    // [-] Stretch of a step that ends the path rather than leaving a short rest; see test_a_thin_strip_rolled_up.
    constexpr double max_stretch = 1.3;
    step_ = std::min(step_, longest_);
    return max_stretch * step_ >= left && left <= longest_ ? left : std::min(step_, left);
}

void LoadStepController::accept(double step, const NewtonReport& report) {
    // [-] Growth of the failed step with every success, so that it is forgotten; see test_a_field_from_behind.
    constexpr double failed_step_growth = 1.2;
    // [-] Largest step, over the one that failed; see test_a_field_from_behind.
    constexpr double below_failed_step = 0.75;
    const double length = length_of(report);
    // The step that failed bounds the next one, or if the scene now moves less per unit of load, the length that failed.
    const double failed =
        length > negligible_length ? std::max(failed_step_, failed_length_ / length * step) : failed_step_;
    const double times = stop_on_instability_ ? std::clamp(good_length / std::max(length, negligible_length),
                                                           step_factor, step_factor * step_factor)
                                              : step_factor;
    step_ = std::min(times * step, below_failed_step * failed);
    failed_step_ *= failed_step_growth;
    failed_length_ *= failed_step_growth;
}

bool LoadStepController::is_short(const NewtonReport& report) const {
    // [-] over the extent; see test_a_semi_cylinder_pulled_and_pushed
    constexpr double short_length = 0.05;
    return length_of(report) < short_length;
}

bool LoadStepController::reject(double step, const NewtonReport& report) {
    // [-] Smallest step in any case, of the load path; see test_a_thin_strip_rolled_up.
    constexpr double shortest_step = 1e-6;
    failed_step_ = step;
    step_ = step / (report.diverged ? step_factor * step_factor : step_factor);
    if (stop_on_instability_) {
        const double length = failed_length_ = length_of(report);
        const double good_step = good_length / std::max(length, negligible_length) * step;
        // On a load path that moves the scene by many extents, even a small fraction may be a long step.
        constexpr double least = step_factor * step_factor * step_factor;
        if (!fixed_) smallest_ = std::max(std::min(smallest_, good_step / least), shortest_step);
        if (length > 0.5 * good_length && step > smallest_)
            step_ = std::max(std::min(step_, good_step), smallest_);
    }
    return step_ >= smallest_;
}

void LoadPredictor::record(const VectorXd& from, const VectorXd& tangent, double step) {
    if (tangent.size() == 0) return reset();
    before_ = from;
    rate_ = tangent / step;
    step_ = step;
}

// The cubic through `here` at s = 0 is here + rate s + b s^2 + c s^3; its value and slope at s = -h are those of the state before.
VectorXd LoadPredictor::correction(const VectorXd& here, const VectorXd& tangent, double step) const {
    // [-] Largest correction, over the tangent: beyond it the series does not converge. See test_a_thin_strip_rolled_up.
    constexpr double max_correction = 0.5;
    if (before_.size() == 0) return {};
    const double h = step_;
    const VectorXd rate = tangent / step, value = (before_ - here + h * rate) / (h * h),
                   slope = (rate_ - rate) / h, c_h = slope + 2.0 * value;
    VectorXd more = step * step * (value + (1.0 + step / h) * c_h);
    const auto length = [&](const VectorXd& p) { return p.head(coordinates_).lpNorm<Eigen::Infinity>(); };
    if (!(length(more) <= max_correction * length(tangent))) more.resize(0);
    return more;
}

}  // namespace magshell
