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
#include "magshell/energy/neo_hookean.h"
#include "magshell/strain/polar.h"

namespace magshell {

struct Corotated : LameSolid {
    static constexpr int stresses = 1;
    static constexpr bool refuses_inversion = false;
    static constexpr bool keeps_measures = false;

    Pack33 f;
    Polar polar;

    explicit Corotated(const Pack33& gradient) : f(gradient), polar(f) {}

    static Volumetric volumetric(const Pack c[], const Pack& v) { return quadratic_volume(c[0], v); }

    Pack volume_measure() const { return polar.trace() - Pack(2.0); }
    Pack volume_rate(const Pack33& d) const { return double_dot(polar.rotation, d); }
    Pack3 volume_gradient(const Pack3& g) const { return multiply(polar.rotation, g); }
    Pack33 volume_piola() const { return polar.rotation; }

    Pack energy(const Pack c[]) const {
        Pack sum(0.0);
        for (const Pack& stretch : polar.stretch) sum += (stretch - Pack(1.0)) * (stretch - Pack(1.0));
        return c[1] * sum;
    }

    void stress(const Pack c[], const Pack& pressure, Pack s[]) const { s[0] = pressure - Pack(2.0) * c[1]; }

    void stress_rate(const Pack[], const Pack33&, Pack pressure_rate, Pack s[]) const {
        s[0] = pressure_rate;
    }

    Pack33 piola(const Pack c[], const Pack s[]) const {
        return Pack(2.0) * c[1] * f + s[0] * polar.rotation;
    }

    void work_by_constants(const Pack[], const Pack33& d, Pack work[]) const {
        work[0] = Pack(0.0);
        work[1] = Pack(2.0) * double_dot(f - polar.rotation, d);
    }
    static void pressure_by_constants(const Pack[], const Pack& v, Pack by[]) {
        by[0] = v - Pack(1.0);
        by[1] = Pack(0.0);
    }

    template <int N>
    class Tangent {
      public:
        Tangent(const Corotated& at, const Pack c[], const Pack s[], const Pack& bulk, const Pack& volume,
                const Pack3* gradients)
            : g_(gradients), bulk_(volume * bulk), shear_(Pack(2.0) * volume * c[1]) {
            const Pack* stretch = at.polar.stretch;
            const Pack least = Pack(1e-10) * stretch[0] + Pack(1e-100);
            Pack33 spin;  // s (tr U I - U)^-1 in the current frame
            for (Pack& entry : spin.at) entry = Pack(0.0);
            for (int i = 0; i < 3; ++i) {
                const Pack sum = max(stretch[(i + 1) % 3] + stretch[(i + 2) % 3], least);
                spin += (volume * s[0] / sum) * outer(at.polar.u[i], at.polar.u[i]);
            }
            for (int k = 0; k < N; ++k) {
                r_[k] = multiply(at.polar.rotation, g_[k]);
                turned_[k] = multiply(transpose(cross_matrix(r_[k])), spin);
            }
        }

        Pack33 block(int k, int l) const {
            Pack33 h = multiply(turned_[k], cross_matrix(r_[l]));
            h += outer(bulk_ * r_[k], r_[l]);
            add_to_diagonal(h, shear_ * dot(g_[k], g_[l]));
            return h;
        }

      private:
        const Pack3* g_;
        Pack bulk_, shear_;
        Pack3 r_[N];
        Pack33 turned_[N];
    };
};

}  // namespace magshell
