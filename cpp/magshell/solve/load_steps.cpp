#include "magshell/solve/load_steps.h"

#include <algorithm>

namespace magshell {
namespace {

constexpr double good_length = 0.25;  // as far as the first iteration of a step should lead
constexpr double tiny = 1e-9;         // a length

}  // namespace

double LoadSteps::next(double left) {
    constexpr double stretched = 1.3;  // rather than that little is left for another step
    step_ = std::min(step_, longest_);
    return stretched * step_ >= left && left <= longest_ ? left : std::min(step_, left);
}

void LoadSteps::succeeded(double step, const NewtonReport& report) {
    constexpr int quick_iterations = 8;  // a step that converged in so many is followed by a longer one
    constexpr double forgetting = 1.2;   // of a step that failed, with every one that did not
    constexpr double below_failure = 0.75;
    constexpr double most_times = 4.0, usual_times = 2.0;  // longer
    const double length = length_of(report);
    if (report.iterations <= quick_iterations) {
        const double times =
            wary_ ? std::clamp(good_length / std::max(length, tiny), usual_times, most_times) : usual_times;
        // What failed is too long in the controls, or where they move less by now, in how far it led.
        const double failed =
            length > tiny ? std::max(failed_step_, failed_length_ / length * step) : failed_step_;
        step_ = std::min(times * step, below_failure * failed);
    }
    failures_ = 0;
    failed_step_ *= forgetting;
    failed_length_ *= forgetting;
}

bool LoadSteps::failed(double step, const NewtonReport& report) {
    constexpr double lost_share = 0.25, usual_share = 0.5, least_share = 0.125;
    constexpr double not_shorter = 0.9, shortest_ever = 1e-6;
    // Steps that lead so little way and are so short, and fail one after another, are where a branch of states ends.
    constexpr double short_length = 0.05, short_step = 0.25;
    constexpr int enough = 2;
    failed_step_ = step;
    step_ = (report.lost ? lost_share : usual_share) * step;
    ++failures_;
    if (wary_) {
        const double before = failed_length_, length = failed_length_ = length_of(report);
        if (!insists_ && failures_ >= enough && length < short_length && step <= short_step) return false;
        // What moves as far in a shorter step is not moved by the controls.
        if (failures_ >= enough && length > not_shorter * before) return false;
        const double good_step = good_length / std::max(length, tiny) * step;
        // Of a way of many extents a small share may be a long step.
        if (!fixed_) smallest_ = std::max(std::min(smallest_, least_share * good_step), shortest_ever);
        if (length > 0.5 * good_length && step > smallest_)
            step_ = std::max(std::min(step_, good_step), smallest_);
    }
    return step_ >= smallest_;
}

}  // namespace magshell
