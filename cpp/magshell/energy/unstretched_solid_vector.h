// UnstretchedSolidVector: w = U^-1 m for the vector m of a body whose deformation gradient is F = R U, with the rotation R.
//
//   w = F^-1 R m,      R: limit of X <- (X + X^-T)/2 from X = F                     [Higham 1986]
//   d(g . w) = dF : (- a w^T + R [y]),      a = F^-T g,  y = (tr U 1 - U)^-1 (m x R^T a),  [y] v = y x v
//
// F w = R m, so that a magnetization that rotates without stretching has the charges of F w (energy/own_field.h). F must not be inverted.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "magshell/core/dual.h"

namespace magshell {

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
