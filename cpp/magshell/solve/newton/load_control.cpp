#include "magshell/solve/newton/load_control.h"

#include <algorithm>

#include "magshell/solve/newton/newton_iteration.h"

namespace magshell {
double LoadStepController::propose(double left) {
    step_ = std::min(step_, longest_);
    // A rest of the path that would be short joins the step before it.
    const bool ends = left - step_ <= good_part * step_ && left <= longest_;
    return ends ? left : std::min(step_, left);
}

void LoadStepController::accept(double step, const NewtonReport& report) {
    // [-] Growth of the failed step with every success, so that it is forgotten; see test_a_field_from_behind.
    constexpr double failed_step_growth = 1.2;
    const double length = length_of(report);
    // The step that failed bounds the next one, or if the scene now moves less per unit of load, the length that failed.
    const double failed =
        length > negligible_length ? std::max(failed_step_, failed_length_ / length * step) : failed_step_;
    const double times = stop_on_instability_ ? std::clamp(good_part / std::max(length, negligible_length),
                                                           step_factor, large_factor)
                                              : step_factor;
    step_ = std::min(times * step, (1.0 - good_part) * failed);
    failed_step_ *= failed_step_growth;
    failed_length_ *= failed_step_growth;
}

bool LoadStepController::is_short(const NewtonReport& report) const {
    return length_of(report) < good_part * good_part;
}

bool LoadStepController::reject(double step, const NewtonReport& report) {
    failed_step_ = step;
    step_ = step / (report.diverged ? large_factor : step_factor);
    if (stop_on_instability_) {
        const double length = failed_length_ = length_of(report);
        const double good_step = good_part / std::max(length, negligible_length) * step;
        // On a load path that moves the scene by many extents, even a small fraction may be a long step.
        if (!fixed_) smallest_ = std::max(std::min(smallest_, small_part * good_step), hidden_part);
        if (length > progress_part * good_part && step > smallest_)
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
    if (before_.size() == 0) return {};
    const double h = step_;
    const VectorXd rate = tangent / step, value = (before_ - here + h * rate) / (h * h),
                   slope = (rate_ - rate) / h, c_h = slope + 2.0 * value;
    VectorXd more = step * step * (value + (1.0 + step / h) * c_h);
    const auto length = [&](const VectorXd& p) { return p.head(coordinates_).lpNorm<Eigen::Infinity>(); };
    // Beyond that the series does not converge.
    if (!(length(more) <= progress_part * length(tangent))) more.resize(0);
    return more;
}

}  // namespace magshell
