// PotentialDerivatives: the second to fourth derivatives of a potential that is harmonic outside its sources,
// stored as symmetric tensors.
#pragma once

#include <array>
#include <cmath>

#include "magshell/core/types.h"

namespace magshell {

/// Return the index of the derivative along these axes: derivatives with respect to x come first, then y, then z.
constexpr int derivative_index(int i, int j) {
    const int p = (i > 0) + (j > 0), c = (i == 2) + (j == 2);
    return p * (p + 1) / 2 + c;
}
constexpr int derivative_index(int i, int j, int k) {
    const int p = (i > 0) + (j > 0) + (k > 0), c = (i == 2) + (j == 2) + (k == 2);
    return p * (p + 1) / 2 + c;
}
constexpr int derivative_index(int i, int j, int k, int l) {
    const int p = (i > 0) + (j > 0) + (k > 0) + (l > 0), c = (i == 2) + (j == 2) + (k == 2) + (l == 2);
    return p * (p + 1) / 2 + c;
}

/// The second to fourth derivatives at a point.
struct PotentialDerivatives {
    std::array<double, 6> second{};
    std::array<double, 10> third{};
    std::array<double, 15> fourth{};

    /// Adds factor * other, up to the given order of derivatives.
    void add(double factor, const PotentialDerivatives& other, int order) {
        for (int n = 0; n < 6; ++n) second[n] += factor * other.second[n];
        if (order >= 3)
            for (int n = 0; n < 10; ++n) third[n] += factor * other.third[n];
        if (order >= 4)
            for (int n = 0; n < 15; ++n) fourth[n] += factor * other.fourth[n];
    }

    void scale(double factor) {
        for (double& each : second) each *= factor;
        for (double& each : third) each *= factor;
        for (double& each : fourth) each *= factor;
    }

    /// Adds factor * d(other)/dx_axis as far as it is known: to the second and third derivatives.
    void add_slope(double factor, const PotentialDerivatives& other, int axis) {
        for (int i = 0; i < 3; ++i)
            for (int j = i; j < 3; ++j) {
                second[derivative_index(i, j)] += factor * other.third[derivative_index(i, j, axis)];
                for (int k = j; k < 3; ++k)
                    third[derivative_index(i, j, k)] +=
                        factor * other.fourth[derivative_index(i, j, k, axis)];
            }
    }

    Mat3 matrix() const {
        const auto& s = second;
        Mat3 result;
        result << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
        return result;
    }

    /// Returns the third derivatives contracted with a.
    Mat3 along(const Vec3& a) const {
        Mat3 result;
        for (int i = 0; i < 3; ++i)
            for (int j = i; j < 3; ++j)
                result(j, i) = result(i, j) = third[derivative_index(i, j, 0)] * a[0] +
                                              third[derivative_index(i, j, 1)] * a[1] +
                                              third[derivative_index(i, j, 2)] * a[2];
        return result;
    }

    /// Returns the fourth derivatives contracted with a and b.
    Mat3 along(const Vec3& a, const Vec3& b) const {
        Mat3 result;
        for (int i = 0; i < 3; ++i)
            for (int j = i; j < 3; ++j) {
                double sum = 0.0;
                for (int k = 0; k < 3; ++k) {
                    sum += fourth[derivative_index(i, j, k, k)] * a[k] * b[k];
                    for (int l = k + 1; l < 3; ++l)
                        sum += fourth[derivative_index(i, j, k, l)] * (a[k] * b[l] + a[l] * b[k]);
                }
                result(j, i) = result(i, j) = sum;
            }
        return result;
    }
};

/// Returns the sign of x, the coordinate relative to a face; on the face the sign of its side, so that it
/// belongs to the outside.
inline double outward_sign(double x, double side) {
    return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : side;
}

/// Adds the derivatives of charge/|x|: with e = x/|x|, the n-th ones are polynomials of e divided by |x|^(n+1).
inline void add_point_charge(double charge, const Vec3& x, int order, PotentialDerivatives& out) {
    const double inverse = 1.0 / x.norm(), k3 = charge * inverse * inverse * inverse;
    const double k4 = 3.0 * k3 * inverse, k5 = k4 * inverse;
    const Vec3 e = x * inverse;
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j) {
            const double ij = i == j;
            out.second[derivative_index(i, j)] += k3 * (3.0 * e[i] * e[j] - ij);
            if (order < 3) continue;
            for (int k = j; k < 3; ++k) {
                const double jk = j == k, ik = i == k;
                out.third[derivative_index(i, j, k)] +=
                    k4 * (ij * e[k] + jk * e[i] + ik * e[j] - 5.0 * e[i] * e[j] * e[k]);
                if (order < 4) continue;
                for (int l = k; l < 3; ++l) {
                    const double il = i == l, jl = j == l, kl = k == l;
                    const double pairs = ij * e[k] * e[l] + ik * e[j] * e[l] + il * e[j] * e[k] +
                                         jk * e[i] * e[l] + jl * e[i] * e[k] + kl * e[i] * e[j];
                    out.fourth[derivative_index(i, j, k, l)] +=
                        k5 * (ij * kl + ik * jl + il * jk - 5.0 * pairs + 35.0 * e[i] * e[j] * e[k] * e[l]);
                }
            }
        }
}

}  // namespace magshell
