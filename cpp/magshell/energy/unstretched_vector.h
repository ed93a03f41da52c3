// UnstretchedVector: w = U^-1 m for the tangential vector m of a triangle whose deformation gradient is F = R U, with the rotation R.
//
//   C = F^T F,  J = sqrt(det C),  s = sqrt(tr C + 2 J),  U = (C + J 1)/s,  U^-1 = adj(C + J 1)/(J s)
//
// F w = R m, so that a magnetization that rotates without stretching has the sources of F w (energy/own_field.h).
#pragma once

#include <array>

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

  private:
    std::array<double, 4> inverse_;
    Triple<T> first_, second_;  // the columns of F
    T c11_, c22_, c12_, j_, s_;
};

}  // namespace magshell
