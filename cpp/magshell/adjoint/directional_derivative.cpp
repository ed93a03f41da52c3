#include "magshell/adjoint/directional_derivative.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

// [-] Errors of a block over its largest entry: one that is small enough, and the largest one; and the ratio of a step to the one tried
// before. See test_tangents_of_motions_agree_with_gradients_in_every_kind.
constexpr double enough = 1e-11, largest_error = 1e-6, ratio = 10.0;
// Steps that are tried; see test_tangents_of_motions_agree_with_gradients_in_every_kind.
constexpr int most_attempts = 6;
// [-] Round-off of a difference over that of its largest number: usually, and at most if larger numbers cancel. See
// test_tangents_of_motions_agree_with_gradients_in_every_kind.
constexpr double beyond = 4.0, accumulated = 256.0;
// 4^2 - 1^2, of the slopes of a cubic at four steps and at one; see test_tangents_of_motions_agree_with_differences.
constexpr double of_cubic = 15.0;

// [-] Central differences of eighth and of sixth order, at 1, 2, 3 and 4 steps: coefficients of the textbook.
constexpr std::array<double, 4> eighth{4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
constexpr std::array<double, 4> sixth{3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0, 0.0};

double size_of(const VectorXd& vector) {
    return vector.size() > 0 ? vector.lpNorm<Eigen::Infinity>() : 0.0;
}

// The central differences of a function at multiples of a step, each computed when it is first needed.
class Slopes {
  public:
    Slopes(const DirectionalDerivative::Function& function, double step, int& evaluations)
        : function_(function), step_(step), evaluations_(evaluations) {}

    const VectorXd& at(int multiple) {
        VectorXd& slope = slopes_[multiple - 1];
        if (slope.size() == 0) {
            const double t = multiple * step_;
            const VectorXd there = function_(t), back = function_(-t);
            evaluations_ += 2;
            slope = (there - back) / (2.0 * t);
            const VectorXd size = there.cwiseAbs().cwiseMax(back.cwiseAbs());
            largest = largest.size() == 0 ? size : VectorXd(largest.cwiseMax(size));
        }
        return slope;
    }
    VectorXd weighted(const std::array<double, 4>& order) {
        VectorXd sum = 2.0 * order[0] * at(1);
        for (int m = 2; m <= 4; ++m)
            if (order[m - 1] != 0.0) sum += 2.0 * m * order[m - 1] * at(m);
        return sum;
    }

    VectorXd largest;  // of the values, entry by entry

  private:
    const DirectionalDerivative::Function& function_;
    double step_;
    int& evaluations_;
    std::array<VectorXd, 4> slopes_;
};

}  // namespace

DirectionalDerivative::Attempt DirectionalDerivative::attempt(const Function& function,
                                                              std::span<const Index> ends, double step,
                                                              std::span<const double> noise) {
    Slopes slopes(function, step, evaluations_);
    const auto compared = [&](const VectorXd& one, const VectorXd& other) {
        Attempt found{one, 0.0, false, false};
        const Index n = one.size();
        Index begin = 0;
        for (std::size_t k = 0; k <= ends.size(); ++k) {
            const Index end = k < ends.size() ? ends[k] : n, count = end - begin;
            if (count == 0) continue;
            const double size = one.segment(begin, count).lpNorm<Eigen::Infinity>();
            const double apart = (one - other).segment(begin, count).lpNorm<Eigen::Infinity>();
            const double largest = slopes.largest.segment(begin, count).lpNorm<Eigen::Infinity>();
            const double rounding = std::numeric_limits<double>::epsilon() / step;
            begin = end;
            if (size == 0.0 && apart == 0.0) continue;
            const double error = std::max(apart, rounding * largest) / size;
            found.truncated |= !(apart <= beyond * rounding * largest) && !(apart <= enough * size);
            found.jumps |= !(apart <= accumulated * rounding * std::max(largest, noise[k])) &&
                           !(apart <= largest_error * size);
            found.error =
                error >= 0.0 ? std::max(found.error, error) : std::numeric_limits<double>::infinity();
        }
        return found;
    };
    Attempt linear = compared(slopes.at(4), slopes.at(1));
    if (!linear.truncated) return linear;
    // Slopes of a cubic at m steps are a + b m^2, as those of forces by the thickness of a sheet.
    const VectorXd growth = (slopes.at(4) - slopes.at(1)) / of_cubic;
    Attempt cubic = compared(slopes.at(1) - growth + 4.0 * growth, slopes.at(2));
    if (!cubic.truncated) {
        cubic.derivative = slopes.at(1) - growth;
        return cubic;
    }
    return compared(slopes.weighted(eighth), slopes.weighted(sixth));
}

VectorXd DirectionalDerivative::of(const Function& function, std::span<const Index> ends, double first_step,
                                   std::span<const double> noise, const char* name) {
    Attempt best;
    best.error = std::numeric_limits<double>::infinity();
    best.jumps = true;
    double step = first_step * factor_, best_step = step;
    int way = 0;
    for (int k = 0; k < most_attempts; ++k) {
        Attempt now{{}, std::numeric_limits<double>::infinity(), true, true};
        try {
            now = attempt(function, ends, step, noise);
        } catch (const InvalidInput&) {  // beyond the range of a value
        }
        const bool better =
            best.jumps ? !now.jumps || now.error < best.error : !now.jumps && now.error < best.error;
        if (k > 0 && !better && !best.jumps) break;
        const int next = now.truncated ? -1 : 1;
        // Round-off of a function that does not change falls with the step.
        const bool nothing = way > 0 && next > 0 && 2.0 * size_of(now.derivative) < size_of(best.derivative);
        if (better) {
            best = std::move(now);
            best_step = step;
        }
        const double accepted = std::max(enough, expected_);
        if (nothing || (!best.jumps && best.error <= accepted) || (way != 0 && next != way)) break;
        way = next;
        step *= way > 0 ? ratio : 1.0 / ratio;
    }
    if (best.jumps)
        throw InvalidInput(
            std::string(name) +
            " is not smooth in the inputs of the motion, or one of them is at the end of its range");
    const bool known = best.error <= largest_error;
    factor_ = known ? best_step / first_step : 1.0;
    expected_ = known ? ratio * best.error : 0.0;
    return best.derivative;
}

}  // namespace magshell
