// UnstretchedVector: w = U^-1 m for the tangential vector m of a triangle whose deformation gradient is F = R U, with the rotation R.
//
//   C = F^T F,  J = sqrt(det C),  s = sqrt(tr C + 2 J),  U = (C + J 1)/s,  U^-1 = adj(C + J 1)/(J s)
//
// F w = R m, so that a magnetization that rotates without stretching has the sources of F w (energy/own_field.h).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "magshell/core/dual.h"

namespace magshell {

template <class T>
class UnstretchedVector {
  public:
    /// edges: from the first corner to the others, now; inverse: [E_1 E_2]^-1 by rows, with the edges at rest in the basis of the plane.
    UnstretchedVector(const std::array<Triple<T>, 2>& edges, const std::array<double, 4>& inverse)
        : inverse_(inverse),
          first_(T(inverse[0]) * edges[0] + T(inverse[2]) * edges[1]),
          second_(T(inverse[1]) * edges[0] + T(inverse[3]) * edges[1]) {
        using std::sqrt;
        c11_ = dot(first_, first_), c22_ = dot(second_, second_), c12_ = dot(first_, second_);
        j_ = sqrt(c11_ * c22_ - c12_ * c12_);
        s_ = sqrt(c11_ + c22_ + T(2.0) * j_);
    }

    /// Returns U^-1 m.
    std::array<T, 2> operator()(const std::array<T, 2>& m) const {
        const T scale = T(1.0) / (j_ * s_);
        return {scale * ((c22_ + j_) * m[0] - c12_ * m[1]), scale * ((c11_ + j_) * m[1] - c12_ * m[0])};
    }

    /// Returns the derivatives of g . U^-1 m by both edges.
    std::array<Triple<T>, 2> by_edges(const std::array<T, 2>& g, const std::array<T, 2>& m) const {
        const std::array<T, 2> w = (*this)(m);
        const T value = g[0] * w[0] + g[1] * w[1], scale = T(1.0) / (j_ * s_);
        // d(g . adj(C + J 1) m) = g_2 m_2 dC_11 + g_1 m_1 dC_22 - (g_1 m_2 + g_2 m_1) dC_12 + g . m dJ
        const T by_s = -value / s_;
        const T by_j = scale * (g[0] * m[0] + g[1] * m[1]) - value / j_ + by_s / s_;
        const T by_trace = T(0.5) * by_s / s_;
        const T by_11 = scale * g[1] * m[1] + by_trace + T(0.5) * by_j * c22_ / j_;
        const T by_22 = scale * g[0] * m[0] + by_trace + T(0.5) * by_j * c11_ / j_;
        const T by_12 = -scale * (g[0] * m[1] + g[1] * m[0]) - by_j * c12_ / j_;
        const Triple<T> by_first = (T(2.0) * by_11) * first_ + by_12 * second_;
        const Triple<T> by_second = (T(2.0) * by_22) * second_ + by_12 * first_;
        return {T(inverse_[0]) * by_first + T(inverse_[1]) * by_second,
                T(inverse_[2]) * by_first + T(inverse_[3]) * by_second};
    }

    /// Returns a column of F.
    const Triple<T>& column(int c) const { return c == 0 ? first_ : second_; }

  private:
    std::array<double, 4> inverse_;
    Triple<T> first_, second_;  // the columns of F
    T c11_, c22_, c12_, j_, s_;
};

// UnstretchedSolidVector: w = U^-1 m for the vector m of a body whose deformation gradient is F = R U, with the rotation R.
//
//   w = F^-1 R m,      R: limit of X <- (X + X^-T)/2 from X = F                     [Higham 1986]
//   d(g . w) = dF : (- a w^T + R [y]),      a = F^-T g,  y = (tr U 1 - U)^-1 (m x R^T a),  [y] v = y x v
//
// F w = R m, so that a magnetization that rotates without stretching has the charges of F w (energy/own_field.h). F must not be inverted.
template <class T>
class UnstretchedSolidVector {
  public:
    using Columns = std::array<Triple<T>, 3>;

    explicit UnstretchedSolidVector(const Columns& f) : f_(f), inverse_(inverse_transposed(f)), r_(f) {
        // Iterations at most, and the change of R [-] after which the next one is the last, as they converge quadratically, also the
        // rates; see test_derivatives_hold_where_a_body_is_turned_far_and_stretched.
        constexpr int most = 40;
        constexpr double close = 1e-6;
        double change = 1.0;
        for (int k = 0; k < most; ++k) {
            const bool last = change < close;
            const Columns other = inverse_transposed(r_);
            change = 0.0;
            for (int i = 0; i < 3; ++i) {
                const Triple<T> difference = T(0.5) * (other[i] - r_[i]);
                change = std::max(change, values_of(difference).norm());
                r_[i] += difference;
            }
            if (last) break;
        }
    }

    /// Returns U^-1 m.
    Triple<T> operator()(const Triple<T>& m) const { return transposed_times(inverse_, times(r_, m)); }

    /// Returns the derivatives of g . U^-1 m by the columns of F.
    Columns by_columns(const Triple<T>& g, const Triple<T>& m) const {
        const Triple<T> w = (*this)(m), a = times(inverse_, g);
        Columns rest;  // tr U 1 - U, symmetric
        const Triple<T> u[3] = {transposed_times(r_, f_[0]), transposed_times(r_, f_[1]),
                                transposed_times(r_, f_[2])};
        const T trace = u[0].x + u[1].y + u[2].z;
        rest[0] = Triple<T>{trace, T(0.0), T(0.0)} - u[0];
        rest[1] = Triple<T>{T(0.0), trace, T(0.0)} - u[1];
        rest[2] = Triple<T>{T(0.0), T(0.0), trace} - u[2];
        const Triple<T> y = transposed_times(inverse_transposed(rest), cross(m, transposed_times(r_, a)));
        return {y.z * r_[1] - y.y * r_[2] - w.x * a, y.x * r_[2] - y.z * r_[0] - w.y * a,
                y.y * r_[0] - y.x * r_[1] - w.z * a};
    }

  private:
    static Columns inverse_transposed(const Columns& a) {
        const Triple<T> first = cross(a[1], a[2]);
        const T scale = T(1.0) / dot(a[0], first);
        return {scale * first, scale * cross(a[2], a[0]), scale * cross(a[0], a[1])};
    }
    static Triple<T> times(const Columns& a, const Triple<T>& v) {
        return v.x * a[0] + v.y * a[1] + v.z * a[2];
    }
    static Triple<T> transposed_times(const Columns& a, const Triple<T>& v) {
        return {dot(a[0], v), dot(a[1], v), dot(a[2], v)};
    }

    Columns f_, inverse_, r_;  // F, F^-T, R
};

}  // namespace magshell
