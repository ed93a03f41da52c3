// Jacobi's elliptic functions on a grid, and the arithmetic-geometric mean that determines how fine the grid
// must be.
#pragma once

#include <cmath>
#include <numbers>

namespace magshell {

struct Jacobi {
    double sn, cn, dn;
};

/// k^2, and 1 - k^2 without cancellation.
struct Modulus {
    double square, complement;
};

/// Returns the functions of the sum of two arguments. Deviations from sn^2 + cn^2 = 1 and dn^2 = cn^2 + k'^2
/// sn^2 would grow from sum to sum, the latter as 1/k', so the result is projected onto both.
inline Jacobi sum_of_arguments(const Jacobi& a, const Jacobi& b, const Modulus& m) {
    const double inverse = 1.0 / (1.0 - m.square * a.sn * a.sn * b.sn * b.sn);
    double sn = (a.sn * b.cn * b.dn + b.sn * a.cn * a.dn) * inverse;
    double cn = (a.cn * b.cn - a.sn * b.sn * a.dn * b.dn) * inverse;
    const double back = 1.5 - 0.5 * (sn * sn + cn * cn);
    sn *= back;
    cn *= back;
    return {sn, cn, std::sqrt(cn * cn + m.complement * sn * sn)};
}

/// Returns the functions of a small argument, |u| < 0.3: a series for a sixteenth of it, doubled four times.
inline Jacobi jacobi_near_zero(double u, const Modulus& modulus) {
    const double m = modulus.square, x = u / 16.0, x2 = x * x;
    const double sn =
        x *
        (1.0 - x2 / 6.0 *
                   (1.0 + m -
                    x2 / 20.0 * (1.0 + m * (14.0 + m) - x2 / 42.0 * (1.0 + m * (135.0 + m * (135.0 + m))))));
    Jacobi result{sn, std::sqrt(1.0 - sn * sn), std::sqrt(1.0 - m * sn * sn)};
    for (int doubling = 0; doubling < 4; ++doubling) result = sum_of_arguments(result, result, modulus);
    return result;
}

/// Returns the arithmetic-geometric mean: K(k) = pi / (2 mean(1, k')).
inline double arithmetic_geometric_mean(double a, double b) {
    while (std::abs(a - b) > 1e-8 * a) {
        const double mean = 0.5 * (a + b);
        b = std::sqrt(a * b);
        a = mean;
    }
    return 0.5 * (a + b);
}

}  // namespace magshell
