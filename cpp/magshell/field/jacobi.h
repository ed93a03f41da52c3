// Jacobi's elliptic functions on a grid, and the integrals that say how fine it has to be.
#pragma once

#include <cmath>
#include <numbers>

namespace magshell {

struct Jacobi {
    double sn, cn, dn;
};

/// Of the sum of two arguments; m = k^2.
inline Jacobi sum_of_arguments(const Jacobi& a, const Jacobi& b, double m) {
    const double inverse = 1.0 / (1.0 - m * a.sn * a.sn * b.sn * b.sn);
    return {(a.sn * b.cn * b.dn + b.sn * a.cn * a.dn) * inverse,
            (a.cn * b.cn - a.sn * b.sn * a.dn * b.dn) * inverse,
            (a.dn * b.dn - m * a.sn * b.sn * a.cn * b.cn) * inverse};
}

/// Of a small argument, |u| < 0.3: a series for a sixteenth of it, doubled four times.
inline Jacobi jacobi_near_zero(double u, double m) {
    const double x = u / 16.0, x2 = x * x;
    const double sn =
        x *
        (1.0 - x2 / 6.0 *
                   (1.0 + m -
                    x2 / 20.0 * (1.0 + m * (14.0 + m) - x2 / 42.0 * (1.0 + m * (135.0 + m * (135.0 + m))))));
    Jacobi result{sn, std::sqrt(1.0 - sn * sn), std::sqrt(1.0 - m * sn * sn)};
    for (int doubling = 0; doubling < 4; ++doubling) result = sum_of_arguments(result, result, m);
    return result;
}

/// The arithmetic-geometric mean: K(k) = pi / (2 mean(1, k')).
inline double arithmetic_geometric_mean(double a, double b) {
    while (std::abs(a - b) > 1e-8 * a) {
        const double mean = 0.5 * (a + b);
        b = std::sqrt(a * b);
        a = mean;
    }
    return 0.5 * (a + b);
}

}  // namespace magshell
