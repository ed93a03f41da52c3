// RotatingMagnetic: the law of a magnetization that turns with a face and does not stretch, M = R M~_r (magnetic_face.h).
//
// F = R U is the polar decomposition of the tangential deformation gradient, from the rest plane with the orthonormal axes
// (t~_1, t~_2) to space: F_j = sum_k a_k D_kj with a constant D. R_1, R_2 and the current unit normal n are orthonormal:
//
//   R_1 = (F_1 + F_2 x n)/t,   R_2 = (F_2 + n x F_1)/t,   t = tr U = |F_1 + F_2 x n|
//   M = m + gamma n,   m = alpha R_1 + beta R_2          (alpha, beta, gamma): M~_r [A/m] in (t~_1, t~_2, n~)
//
// With rho_k = sum_j D_kj R_j, s_k = n x rho_k, the reciprocal edges a^k (a^k . a_l = delta_kl), w_k = m . a^k,
// y_k = (n x m) . a^k, z_k = b . a^k, c = b . (n x m) and beta = b . n, for a fixed b
//
//   d(m . b)/da_k = (c/t) s_k + beta w_k n
//   H_kl = - (b . m)/t^2 s_k s_l^T - c/t^2 (s_k rho_l^T + rho_k s_l^T) + beta (y_l/t s_k - w_k a^l) n^T + beta n (y_k/t s_l - w_l a^k)^T
//          + [ c/2t (s_k . a^l + s_l . a^k) - (w_k z_l + w_l z_k)/2 ] n n^T
//   dR_1 = omega R_2 + p_1 n,   dR_2 = - omega R_1 + p_2 n,   omega = sum_k s_k . da_k / t,   p_j = sum_k (n . da_k)(R_j . a^k)
//
// Derived by the product rule from dR = omega R S + n p^T, checked against differences and torch (tests/core/test_magnetization_laws.py).
#pragma once

#include "magshell/energy/magnetic_face.h"

namespace magshell {

class RotatingMagnetic : public MagneticFace<RotatingMagnetic> {
  public:
    struct Element {
        SimdDouble volume;              // A~ h [m3]
        SimdDouble alpha, beta, gamma;  // M~_r [A/m] in (t~_1, t~_2, n~)
        SimdDouble d11, d12, d22;       // D [1/m]; D_21 = 0, since t~_1 is along a~_1
    };

    RotatingMagnetic(const SimdVec3 x[3], const Element& e) : MagneticFace(x) {
        const SimdVec3 f1 = e.d11 * a1, f2 = e.d12 * a1 + e.d22 * a2;
        const SimdVec3 sum1 = f1 + cross(f2, normal), sum2 = f2 + cross(normal, f1);
        inverse_trace_ = SimdDouble(1.0) / sqrt(squared_norm(sum1));
        r1_ = inverse_trace_ * sum1;
        r2_ = inverse_trace_ * sum2;
        rho_[0] = e.d11 * r1_ + e.d12 * r2_;
        rho_[1] = e.d22 * r2_;
        s_[0] = cross(normal, rho_[0]);
        s_[1] = cross(normal, rho_[1]);
        reciprocal_[0] = inverse_area2 * cross(a2, normal);
        reciprocal_[1] = inverse_area2 * cross(normal, a1);
    }

    /// Returns the matrix (t~_1, t~_2, n~) of edge vectors at rest.
    static Mat3 rest_frame(const Vec3& a1, const Vec3& a2) {
        const Vec3 first = a1.normalized(), normal = a1.cross(a2).normalized();
        Mat3 frame;
        frame << first, normal.cross(first), normal;
        return frame;
    }
    static void set_rest(const Vec3& a1, const Vec3& a2, Element& e, int lane) {
        const Mat3 frame = rest_frame(a1, a2);
        const double length = a1.norm(), across = a2.dot(frame.col(1));
        e.d11.set(lane, 1.0 / length);
        e.d12.set(lane, -a2.dot(frame.col(0)) / (length * across));
        e.d22.set(lane, 1.0 / across);
    }
    /// Returns true if a magnetization of these coordinates is linear in the positions.
    static bool is_linear(const Vec3& coordinates) { return coordinates.isZero(0.0); }

    SimdVec3 magnetization(const Element& e) const { return turned(e) + e.gamma * normal; }

    void frame(SimdVec3 columns[3]) const { columns[0] = r1_, columns[1] = r2_, columns[2] = normal; }
    void frame_rate(const SimdVec3 rate[3], SimdVec3 columns[3]) const {
        const SimdVec3 by1 = rate[1] - rate[0], by2 = rate[2] - rate[0];
        const SimdDouble omega = inverse_trace_ * (dot(s_[0], by1) + dot(s_[1], by2));
        const SimdVec3 lift = dot(normal, by1) * reciprocal_[0] + dot(normal, by2) * reciprocal_[1];
        columns[0] = omega * r2_ + dot(r1_, lift) * normal;
        columns[1] = dot(r2_, lift) * normal - omega * r1_;
        columns[2] = normal_rate(rate);
    }

    void by_edges(const Element& e, const SimdVec3& b, SimdVec3& d1, SimdVec3& d2) const {
        const SimdVec3 p = tangential(b), m = turned(e);
        const SimdDouble couple = inverse_trace_ * dot(b, cross(normal, m)), across = dot(b, normal);
        d1 = couple * s_[0] + (across * dot(m, reciprocal_[0])) * normal + e.gamma * cross(a2, p);
        d2 = couple * s_[1] + (across * dot(m, reciprocal_[1])) * normal - e.gamma * cross(a1, p);
    }

    void edge_hessian(const Element& e, const SimdVec3& b, SimdMat3& h11, SimdMat3& h12,
                      SimdMat3& h22) const {
        const SimdDouble scale = -e.volume;
        normal_hessian(scale * e.gamma, b, h11, h12, h22);
        const SimdVec3 m = turned(e), across = cross(normal, m);
        const SimdDouble beta = scale * dot(b, normal);
        const SimdDouble couple = scale * inverse_trace_ * dot(b, across);
        Products at{
            beta, couple, -scale * inverse_trace_ * inverse_trace_ * dot(b, m), -couple * inverse_trace_, {},
            {},   {}};
        for (int k = 0; k < 2; ++k) {
            at.w[k] = dot(m, reciprocal_[k]);
            at.y[k] = inverse_trace_ * dot(across, reciprocal_[k]);
            at.z[k] = scale * dot(b, reciprocal_[k]);
        }
        h11 += block(at, 0, 0);
        h12 += block(at, 0, 1);
        h22 += block(at, 1, 1);
    }

  private:
    // Factors of H_kl, all but w and y times - A~ h.
    struct Products {
        SimdDouble beta, couple, along, turning;  // beta, c/t, -(b . m)/t^2, -c/t^2
        SimdDouble w[2], y[2], z[2];              // w_k, y_k/t, z_k
    };

    /// Returns m = alpha R_1 + beta R_2.
    SimdVec3 turned(const Element& e) const { return e.alpha * r1_ + e.beta * r2_; }

    SimdMat3 block(const Products& at, int k, int l) const {
        const SimdVec3 left = at.beta * (at.y[l] * s_[k] - at.w[k] * reciprocal_[l]),
                       right = at.beta * (at.y[k] * s_[l] - at.w[l] * reciprocal_[k]);
        const SimdDouble half(0.5);
        const SimdDouble twice =
            half * at.couple * (dot(s_[k], reciprocal_[l]) + dot(s_[l], reciprocal_[k])) -
            half * (at.w[k] * at.z[l] + at.w[l] * at.z[k]);
        return outer(s_[k], at.along * s_[l] + at.turning * rho_[l]) + outer(at.turning * rho_[k], s_[l]) +
               outer(left, normal) + outer(normal, right + twice * normal);
    }

    SimdVec3 r1_, r2_;                        // R
    SimdVec3 rho_[2], s_[2], reciprocal_[2];  // rho_k, s_k [1/m], a^k [1/m]
    SimdDouble inverse_trace_;                // 1/t
};

}  // namespace magshell
