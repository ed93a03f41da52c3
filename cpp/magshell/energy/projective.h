// Projective: the energy of Projective Dynamics, squared distances of F to rotations and to matrices of unit
// determinant. One point per SIMD lane.
//
//   W = mu |F - R|^2 + lam/2 |F - P|^2                                            [J/m3]  [Qiao21] (3)
//   T = 2 mu (F - R) + lam (F - P) = (2 mu + lam) F - sum_i t_i u_i v_i^T,   t_i = 2 mu + lam d_i         [Pa]
//
// F = sum s_i u_i v_i^T; R is the nearest rotation, P = sum d_i u_i v_i^T the nearest matrix with determinant
// 1. Mixed Newton stores the stresses t_i. For small strains lam counts a third, since F - P is then tr(E)/3 I.
// In the frames of u and v, with n_i = 1/d_i, b_i = 1 + k n_i^2 and the multiplier k of P,
//
//   dd_i/ds_i = (b_j n_l^2 + b_l n_j^2)/D,  dd_i/ds_j = - b_l n_i n_j/D,   D = sum of b_i b_j n_l^2
//   (t_i - t_j)/(s_i - s_j) = lam/(1 + k d_l),   (t_i + t_j)/(s_i + s_j) as it is
//
// Where s_i + s_j = 0, R and P jump; P also jumps where two small stretches are equal in an element that is far
// too large. There, and only there, derivatives are bounded, which keeps the Hessian finite.
#pragma once

#include "magshell/energy/invariant_solid.h"
#include "magshell/strain/polar.h"
#include "magshell/strain/unit_determinant.h"

namespace magshell {

struct Projective : LameSolid {
    static constexpr int stresses = 3;
    static constexpr bool refuses_inversion = false;
    static constexpr int stored_measures = 0;

    static RestModuli rest_moduli(const SimdDouble c[]) { return {SimdDouble(1.0 / 3.0) * c[0], c[1]}; }
    static void rest_moduli_vjp(const SimdDouble[], const RestModuli& by, SimdDouble out[]) {
        out[0] += SimdDouble(1.0 / 3.0) * by.lambda;
        out[1] += by.mu;
    }
    /// Returns a weight that bounds the Hessian from above: the squared distance to a set grows no faster than
    /// the squared distance to one of its points.
    static SimdDouble projective_weight(const SimdDouble c[]) { return SimdDouble(2.0) * c[1] + c[0]; }

    SimdMat3 f;
    Polar polar;
    UnitDeterminant nearest;

    explicit Projective(const SimdMat3& gradient) : f(gradient), polar(f), nearest(polar.stretch) {}

    /// The energy has no part that depends on a measure of volume.
    static Volumetric volumetric(const SimdDouble[], const SimdDouble&) {
        return {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
    }
    SimdDouble volume_measure() const { return SimdDouble(1.0); }
    SimdDouble volume_rate(const SimdMat3&) const { return SimdDouble(0.0); }
    static void pressure_by_constants(const SimdDouble[], const SimdDouble&, SimdDouble by[]) {
        by[0] = by[1] = SimdDouble(0.0);
    }

    SimdDouble energy(const SimdDouble c[]) const {
        SimdDouble shear(0.0), volume(0.0);
        for (int i = 0; i < 3; ++i) {
            const SimdDouble from_rotation = polar.stretch[i] - SimdDouble(1.0);
            const SimdDouble from_volume = polar.stretch[i] - nearest.d[i];
            shear += from_rotation * from_rotation;
            volume += from_volume * from_volume;
        }
        return c[1] * shear + SimdDouble(0.5) * c[0] * volume;
    }

    void stress(const SimdDouble c[], const SimdDouble&, SimdDouble t[]) const {
        for (int i = 0; i < 3; ++i) t[i] = SimdDouble(2.0) * c[1] + c[0] * nearest.d[i];
    }

    void stress_rate(const SimdDouble c[], const SimdMat3& along, const SimdDouble&, SimdDouble t[]) const {
        SimdDouble rate[3];
        for (int i = 0; i < 3; ++i)
            rate[i] = dot(polar.u[i], multiply(along, multiply(transpose(polar.rotation), polar.u[i])));
        for (int i = 0; i < 3; ++i) {
            SimdDouble sum(0.0);
            for (int j = 0; j < 3; ++j) sum += by_stretch(i, j) * rate[j];
            t[i] = c[0] * sum;
        }
    }

    // sum_i t_i u_i v_i^T = (sum_i t_i u_i u_i^T) R
    SimdMat3 piola(const SimdDouble c[], const SimdDouble t[]) const {
        return (SimdDouble(2.0) * c[1] + c[0]) * f - multiply(along_directions(t), polar.rotation);
    }

    void work_by_constants(const SimdDouble[], const SimdMat3& d, SimdDouble work[]) const {
        work[0] = double_dot(f - multiply(along_directions(nearest.d), polar.rotation), d);
        work[1] = SimdDouble(2.0) * double_dot(f - polar.rotation, d);
    }

    template <int N>
    class Tangent {
      public:
        Tangent(const Projective& at, const SimdDouble c[], const SimdDouble t[], const SimdDouble&,
                const SimdDouble& volume, const SimdVec3* gradients) {
            const SimdDouble* s = at.polar.stretch;
            const SimdDouble all = SimdDouble(2.0) * c[1] + c[0];
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    stretch_[3 * i + j] =
                        volume * ((i == j ? all : SimdDouble(0.0)) - c[0] * at.by_stretch(i, j));
            const SimdDouble least = SimdDouble(1e-10) * s[0] + SimdDouble(1e-100);
            for (int l = 0; l < 3; ++l) {
                const int i = (l + 1) % 3, j = (l + 2) % 3;
                const SimdDouble shear =
                    all -
                    c[0] / max(SimdDouble(1.0) + at.nearest.multiplier * at.nearest.d[l], SimdDouble(1e-10));
                const SimdDouble turn = all - (t[i] + t[j]) / max(s[i] + s[j], least);
                same_[l] = SimdDouble(0.5) * volume * (shear + turn);
                other_[l] = SimdDouble(0.5) * volume * (shear - turn);
            }
            for (int i = 0; i < 3; ++i) u_[i] = at.polar.u[i];
            for (int k = 0; k < N; ++k) {
                const SimdVec3 turned = multiply(at.polar.rotation, gradients[k]);  // v_i . g = u_i . R g
                for (int i = 0; i < 3; ++i) g_[k][i] = dot(u_[i], turned);
            }
        }

        // In the frames of u and v: dF_ij = x_i g_j for a node that moves along x.
        SimdMat3 block(int k, int l) const {
            const SimdDouble *a = g_[k], *b = g_[l];
            SimdMat3 h;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) {
                    const int rest = 3 - i - j;
                    h.at[3 * i + j] = stretch_[3 * i + j] * a[i] * b[j];
                    if (i != j)
                        h.at[3 * i + j] += other_[rest] * a[j] * b[i];
                    else
                        h.at[3 * i + j] += same_[(i + 1) % 3] * a[(i + 2) % 3] * b[(i + 2) % 3] +
                                           same_[(i + 2) % 3] * a[(i + 1) % 3] * b[(i + 1) % 3];
                }
            SimdMat3 turned = outer(u_[0], SimdVec3{h.at[0], h.at[1], h.at[2]});
            turned += outer(u_[1], SimdVec3{h.at[3], h.at[4], h.at[5]});
            turned += outer(u_[2], SimdVec3{h.at[6], h.at[7], h.at[8]});
            const SimdMat3 directions{
                {u_[0].x, u_[0].y, u_[0].z, u_[1].x, u_[1].y, u_[1].z, u_[2].x, u_[2].y, u_[2].z}};
            return multiply(turned, directions);
        }

      private:
        SimdDouble stretch_[9], same_[3], other_[3];
        SimdVec3 u_[3];
        SimdDouble g_[N][3];
    };

  private:
    SimdMat3 along_directions(const SimdDouble t[]) const {
        SimdMat3 sum = outer(t[0] * polar.u[0], polar.u[0]);
        for (int i = 1; i < 3; ++i) sum += outer(t[i] * polar.u[i], polar.u[i]);
        return sum;
    }

    /// Returns dd_i/ds_j.
    SimdDouble by_stretch(int i, int j) const {
        SimdDouble n[3], b[3];
        for (int l = 0; l < 3; ++l) {
            n[l] = SimdDouble(1.0) / nearest.d[l];
            b[l] = SimdDouble(1.0) + nearest.multiplier * n[l] * n[l];
        }
        SimdDouble determinant(0.0);
        for (int l = 0; l < 3; ++l) determinant += b[(l + 1) % 3] * b[(l + 2) % 3] * n[l] * n[l];
        determinant = max(determinant, SimdDouble(1e-10) * n[2] * n[2]);
        if (i != j) return -(b[3 - i - j] * n[i] * n[j]) / determinant;
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        return (b[p] * n[q] * n[q] + b[q] * n[p] * n[p]) / determinant;
    }
};

}  // namespace magshell
