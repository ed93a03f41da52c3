#include "magshell/field/cubic_spline.h"

namespace magshell {
namespace {

// Solves c_{i-1} + 4 c_i + c_{i+1} = 6 f_i for first <= i <= last; c_{first-1} and c_{last+1} are known. The
// system is diagonally dominant, so elimination needs no pivots. `c` and `f` have the same indices.
void solve_interior(std::span<Vec4> c, std::span<const Vec4> f, int first, int last) {
    std::vector<double> above(f.size());
    for (int i = first; i <= last; ++i) {
        const double pivot = 4.0 - (i == first ? 0.0 : above[i - 1]);
        above[i] = 1.0 / pivot;
        c[i] = (6.0 * f[i] - c[i - 1]) / pivot;
    }
    for (int i = last; i >= first; --i) c[i] -= above[i] * c[i + 1];
}

}  // namespace

std::vector<Vec4> spline_coefficients(std::span<const Vec4> f) {
    const int n = static_cast<int>(f.size());
    std::vector<Vec4> padded(n + 2);
    const std::span<Vec4> c(padded.data() + 1, n);
    const auto second_difference = [&](int i) -> Vec4 { return f[i - 1] - 2.0 * f[i] + f[i + 1]; };

    if (n <= 3) {
        const Vec4 bend = n == 3 ? second_difference(1) : Vec4(Vec4::Zero());
        for (int i = 0; i < n; ++i) c[i] = f[i] - bend / 6.0;
    } else {
        // Not-a-knot condition: the fourth difference of c about knot 1 is zero, hence c and f have the same
        // second difference there.
        c[1] = f[1] - second_difference(1) / 6.0;
        c[n - 2] = f[n - 2] - second_difference(n - 2) / 6.0;
        solve_interior(c, f, 2, n - 3);
        c[0] = 6.0 * f[1] - 4.0 * c[1] - c[2];
        c[n - 1] = 6.0 * f[n - 2] - 4.0 * c[n - 2] - c[n - 3];
    }
    padded.front() = 6.0 * f[0] - 4.0 * c[0] - c[1];
    padded.back() = 6.0 * f[n - 1] - 4.0 * c[n - 1] - c[n - 2];
    return padded;
}

// Transpose of spline_coefficients: its lines, transposed and in reverse order.
std::vector<Vec4> spline_samples_gradient(std::span<const Vec4> by_coefficients) {
    const int n = static_cast<int>(by_coefficients.size()) - 2;
    std::vector<Vec4> c(by_coefficients.begin() + 1, by_coefficients.end() - 1);
    std::vector<Vec4> f(n, Vec4(Vec4::Zero()));
    // Transpose of c_outer = 6 f_i - 4 c_i - c_inner.
    const auto extrapolated = [&](const Vec4& by_outer, int i, int inner) {
        f[i] += 6.0 * by_outer;
        c[i] -= 4.0 * by_outer;
        c[inner] -= by_outer;
    };
    extrapolated(by_coefficients.back(), n - 1, n - 2);
    extrapolated(by_coefficients.front(), 0, 1);

    if (n <= 3) {
        Vec4 sum = Vec4::Zero();
        for (int i = 0; i < n; ++i) sum += c[i], f[i] += c[i];
        if (n == 3) f[0] -= sum / 6.0, f[1] += sum / 3.0, f[2] -= sum / 6.0;
        return f;
    }
    extrapolated(c[n - 1], n - 2, n - 3);
    extrapolated(c[0], 1, 2);
    // The matrix of the interior is symmetric: c = 6 A^-1 (f - ends / 6).
    std::vector<Vec4> rhs(n), y(n, Vec4(Vec4::Zero()));
    for (int i = 2; i <= n - 3; ++i) rhs[i] = c[i] / 6.0;
    solve_interior(y, rhs, 2, n - 3);
    for (int i = 2; i <= n - 3; ++i) f[i] += 6.0 * y[i];
    if (n >= 5) c[1] -= y[2], c[n - 2] -= y[n - 3];
    for (const int i : {1, n - 2}) {
        f[i - 1] -= c[i] / 6.0;
        f[i] += 4.0 / 3.0 * c[i];
        f[i + 1] -= c[i] / 6.0;
    }
    return f;
}

}  // namespace magshell
