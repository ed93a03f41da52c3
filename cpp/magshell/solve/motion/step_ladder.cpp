#include "magshell/solve/motion/step_ladder.h"

#include <algorithm>

namespace magshell {
namespace {

// [-] A step is doubled if twice its length is expected to have less than this part of the tolerance; see
// test_ladder_keeps_its_steps_where_a_mass_bounces.
constexpr double doubling_margin = 0.5;

}  // namespace

StepLadder::StepLadder(double tolerance, int order, int deepest)
    : tolerance_(tolerance), growth_(static_cast<double>(std::int64_t{2} << order)), deepest_(deepest) {}

bool StepLadder::accept(double error) {
    const bool ends_interval = ++place_ == (std::int64_t{1} << level_);
    if (ends_interval) place_ = 0;
    if (level_ > 0 && place_ % 2 == 0 && error * growth_ < doubling_margin * tolerance_) {
        --level_;
        place_ /= 2;
    }
    return ends_interval;
}

bool StepLadder::reject(double error) {
    if (level_ == deepest_) return false;
    const int levels = std::min(error > growth_ * tolerance_ ? 2 : 1, deepest_ - level_);
    level_ += levels;
    place_ <<= levels;
    return true;
}

}  // namespace magshell
