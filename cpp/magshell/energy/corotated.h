// Corotated: corotated linear elasticity. One point per SIMD lane.
//
//   W = mu |F - R|^2 + lam/2 (tr(R^T F) - 3)^2                                    [J/m3]
//   P = 2 mu F + s R,   s = lam (tr U - 3) - 2 mu                                 [Pa]
//   dR(D) = R [w],   w = (tr U I - U)^-1 axial(R^T D - D^T R)
//
// R is the nearest rotation, U = R^T F with signed stretches s_i. The measure of volume is tr U - 2. Mixed
// Newton stores the stress s. Where s_i + s_j = 0, R jumps; there, and only there, its derivative is bounded,
// which keeps the Hessian finite.
#pragma once

#include "magshell/energy/invariant_solid.h"
#include "magshell/strain/polar.h"

namespace magshell {

struct Corotated : LameSolid {
    static constexpr int stresses = 1;
    static constexpr bool refuses_inversion = false;
    static constexpr int stored_measures = 0;

    SimdMat3 f;
    Polar polar;

    explicit Corotated(const SimdMat3& gradient) : f(gradient), polar(f) {}

    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& v) {
        return quadratic_volume(c[0], v);
    }

    SimdDouble volume_measure() const { return polar.trace() - SimdDouble(2.0); }
    SimdDouble volume_rate(const SimdMat3& d) const { return double_dot(polar.rotation, d); }
    SimdVec3 volume_gradient(const SimdVec3& g) const { return multiply(polar.rotation, g); }
    SimdMat3 volume_piola() const { return polar.rotation; }

    SimdDouble energy(const SimdDouble c[]) const {
        SimdDouble sum(0.0);
        for (const SimdDouble& stretch : polar.stretch)
            sum += (stretch - SimdDouble(1.0)) * (stretch - SimdDouble(1.0));
        return c[1] * sum;
    }

    void stress(const SimdDouble c[], const SimdDouble& pressure, SimdDouble s[]) const {
        s[0] = pressure - SimdDouble(2.0) * c[1];
    }

    void stress_rate(const SimdDouble[], const SimdMat3&, SimdDouble pressure_rate, SimdDouble s[]) const {
        s[0] = pressure_rate;
    }

    SimdMat3 piola(const SimdDouble c[], const SimdDouble s[]) const {
        return SimdDouble(2.0) * c[1] * f + s[0] * polar.rotation;
    }

    void work_by_constants(const SimdDouble[], const SimdMat3& d, SimdDouble work[]) const {
        work[0] = SimdDouble(0.0);
        work[1] = SimdDouble(2.0) * double_dot(f - polar.rotation, d);
    }
    static void pressure_by_constants(const SimdDouble[], const SimdDouble& v, SimdDouble by[]) {
        by[0] = v - SimdDouble(1.0);
        by[1] = SimdDouble(0.0);
    }

    template <int N>
    class Tangent {
      public:
        Tangent(const Corotated& at, const SimdDouble c[], const SimdDouble s[], const SimdDouble& bulk,
                const SimdDouble& volume, const SimdVec3* gradients)
            : g_(gradients), bulk_(volume * bulk), shear_(SimdDouble(2.0) * volume * c[1]) {
            const SimdDouble* stretch = at.polar.stretch;
            const SimdDouble least = SimdDouble(1e-10) * stretch[0] + SimdDouble(1e-100);
            SimdMat3 spin;  // s (tr U I - U)^-1 in the current frame
            for (SimdDouble& entry : spin.at) entry = SimdDouble(0.0);
            for (int i = 0; i < 3; ++i) {
                const SimdDouble sum = max(stretch[(i + 1) % 3] + stretch[(i + 2) % 3], least);
                spin += (volume * s[0] / sum) * outer(at.polar.u[i], at.polar.u[i]);
            }
            for (int k = 0; k < N; ++k) {
                r_[k] = multiply(at.polar.rotation, g_[k]);
                turned_[k] = multiply(transpose(cross_matrix(r_[k])), spin);
            }
        }

        SimdMat3 block(int k, int l) const {
            SimdMat3 h = multiply(turned_[k], cross_matrix(r_[l]));
            h += outer(bulk_ * r_[k], r_[l]);
            add_to_diagonal(h, shear_ * dot(g_[k], g_[l]));
            return h;
        }

      private:
        const SimdVec3* g_;
        SimdDouble bulk_, shear_;
        SimdVec3 r_[N];
        SimdMat3 turned_[N];
    };
};

}  // namespace magshell
