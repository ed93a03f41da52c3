// UnitDeterminant: the matrix with determinant 1 that is nearest to F = U diag(s) V^T. It is U diag(d) V^T,
// with d the vector nearest to s whose product is 1. If s is sorted and only its last entry may be negative,
// all d are positive, and with a Lagrange multiplier k
//
//   d_i - k/d_i = s_i,   d_i = (s_i + r_i)/2,   r_i = sqrt(s_i^2 + 4 k),   d_1 d_2 d_3 = 1
//
// k > 0 where det F < 1. If F is large and thin, the product exceeds 1 even at the smallest k with real roots,
// -s_3^2/4; then d_3 = (s_3 - r_3)/2. One point per SIMD lane; the result of a lane does not depend on the
// others.
#pragma once

#include <cmath>

#include "magshell/core/simd_functions.h"

namespace magshell {

struct UnitDeterminant {
    SimdDouble d[3], multiplier;

    /// Computes d. s: stretches sorted by magnitude; only the last one may be negative.
    explicit UnitDeterminant(const SimdDouble s[3]) : multiplier(0.0) {
        constexpr int most = 12;
        SimdDouble root[3];
        for (int iteration = 0;; ++iteration) {
            for (int i = 0; i < 3; ++i) {
                root[i] = sqrt(max(s[i] * s[i] + SimdDouble(4.0) * multiplier, SimdDouble(0.0)));
                d[i] = SimdDouble(0.5) * (s[i] + root[i]);
            }
            const SimdDouble off = d[0] * d[1] * d[2] - SimdDouble(1.0);
            const SimdDouble open = abs(off) - SimdDouble(settled);
            if (iteration == most || all_negative(open)) break;
            SimdDouble slope[3];
            for (int i = 0; i < 3; ++i) slope[i] = d[i] * root[i];
            const SimdDouble sum = slope[0] * slope[1] + slope[1] * slope[2] + slope[2] * slope[0];
            const SimdDouble step = off * root[0] * root[1] * root[2] / sum;
            multiplier = where_negative(open, multiplier, multiplier - step);
        }
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const bool found = std::abs(d[0][lane] * d[1][lane] * d[2][lane] - 1.0) < 4.0 * settled &&
                               d[2][lane] > 0.0 && s[2][lane] * s[2][lane] + 4.0 * multiplier[lane] >= 0.0;
            if (!found) search(lane, s);
        }
    }

  private:
    static constexpr double settled = 2e-15;

    static bool all_negative(const SimdDouble& a) {
        bool all = true;
        for (int lane = 0; lane < SimdDouble::width; ++lane) all &= a[lane] < 0.0;
        return all;
    }

    // Finds the multiplier of one lane by bisection, on the branch that contains the product 1.
    void search(int lane, const SimdDouble s[3]) {
        const double at[3] = {s[0][lane], s[1][lane], s[2][lane]};
        double k[3];
        const auto product = [&](double multiplier_, bool upper) {
            for (int i = 0; i < 3; ++i) {
                const double root = std::sqrt(std::max(at[i] * at[i] + 4.0 * multiplier_, 0.0));
                if (i == 2 && (!upper || at[i] < 0.0))  // this form does not cancel
                    k[i] = upper ? 2.0 * multiplier_ / (root - at[i]) : -2.0 * multiplier_ / (at[i] + root);
                else
                    k[i] = 0.5 * (at[i] + root);
            }
            return k[0] * k[1] * k[2];
        };
        double low = at[2] > 0.0 ? -0.25 * at[2] * at[2] : 0.0, high = 0.0;
        const bool upper = product(low, true) <= 1.0;
        if (upper)
            for (high = 1.0; product(high, true) < 1.0;) high *= 4.0;
        for (int halving = 0; halving < 2000; ++halving) {
            const double middle = 0.5 * (low + high);
            if (middle == low || middle == high) break;
            ((product(middle, upper) < 1.0) == upper ? low : high) = middle;
        }
        const double found = 0.5 * (low + high);
        product(found, upper);
        multiplier.set(lane, found);
        for (int i = 0; i < 3; ++i) d[i].set(lane, k[i]);
    }
};

}  // namespace magshell
