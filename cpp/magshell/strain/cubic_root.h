// Finds the first root of a cubic that is positive at 0.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

namespace magshell {

/// Returns the first t in (0, longest] at which c[0] + c[1] t + c[2] t^2 + c[3] t^3 vanishes; `longest` if it
/// stays positive, 0 if c[0] is not positive.
inline double first_root(const double c[4], double longest) {
    const auto value = [&](double t) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); };
    if (!(c[0] > 0.0)) return 0.0;
    // Between the roots of its derivative the cubic is monotone, so bisection finds the root.
    double bounds[4] = {0.0, longest, longest, longest};
    const double p = c[2], discriminant = p * p - 3.0 * c[1] * c[3];
    if (discriminant > 0.0) {
        const double q = -(p + std::copysign(std::sqrt(discriminant), p));  // of 3 c3 t^2 + 2 c2 t + c1
        double first = c[3] != 0.0 ? q / (3.0 * c[3]) : longest, second = q != 0.0 ? c[1] / q : longest;
        if (first > second) std::swap(first, second);
        bounds[1] = std::clamp(first, 0.0, longest);
        bounds[2] = std::clamp(second, 0.0, longest);
    }
    for (int k = 0; k < 3; ++k) {
        double low = bounds[k], high = bounds[k + 1];
        if (!(value(high) <= 0.0)) continue;
        for (int round = 0; round < 60 && high - low > 1e-14 * high; ++round) {
            const double middle = 0.5 * (low + high);
            (value(middle) > 0.0 ? low : high) = middle;
        }
        return low;
    }
    return longest;
}

}  // namespace magshell
