#include "magshell/force/drag.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "magshell/core/errors.h"

namespace magshell {

AttackCurve::AttackCurve(std::vector<double> knots, std::vector<Cubic> cubics)
    : knots_(std::move(knots)), cubics_(std::move(cubics)) {
    if (cubics_.empty() || knots_.size() != cubics_.size() + 1) {
        throw InvalidInput(std::to_string(cubics_.size()) + " cubics do not fit between " +
                           std::to_string(knots_.size()) + " knots");
    }
    if (std::adjacent_find(knots_.begin(), knots_.end(), std::greater_equal<>()) != knots_.end()) {
        throw InvalidInput("the angles of attack of a drag or thrust table must ascend");
    }
}

AttackCurve::Sample AttackCurve::interpolated(double sine, double cosine) const {
    const double angle = std::atan2(sine, cosine);
    const auto next = std::upper_bound(knots_.begin() + 1, knots_.end() - 1, angle);
    const std::ptrdiff_t interval = next - knots_.begin() - 1;
    const auto& [a, b, c, d] = cubics_[interval];
    const double t = angle - knots_[interval];
    return {((a * t + b) * t + c) * t + d, (3.0 * a * t + 2.0 * b) * t + c};
}

}  // namespace magshell
