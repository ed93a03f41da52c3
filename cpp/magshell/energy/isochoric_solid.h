// IsochoricSolid: the base of hyperelastic laws of rubber that split the energy into a part that resists changes of
// shape, in the invariants of J^(-1/3) F, and one that resists changes of volume:
//
//   W = w(I1 J^(-2/3), I2 J^(-4/3)) + K/2 (J - 1)^2                               [J/m3]
//
// Their constants are those of w, in which w is linear, and then the bulk modulus K. A law declares its constants as
// users set them in `named_constants`, the bulk modulus last, and gives
//     shear_modulus(c)     mu for small strains, by the constants of w
// Poisson's ratio may stand for the bulk modulus, K = 2 mu (1 + nu)/(3 (1 - 2 nu)); IsochoricModuli in
// terms/solid/solid_moduli.h converts it.
#pragma once

#include "magshell/core/simd_functions.h"
#include "magshell/energy/invariant_solid.h"

namespace magshell {

template <class Law, int n>
struct IsochoricSolid {
    static constexpr int constants = n;
    static constexpr bool refuses_inversion = true, constant_shear = false, has_i2 = false;

    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        return quadratic_volume(c[n - 1], j);
    }

    static RestModuli rest_moduli(const SimdDouble c[]) {
        const SimdDouble mu = Law::shear_modulus(c);
        return {c[n - 1] - SimdDouble(2.0 / 3.0) * mu, mu};
    }
    static void rest_moduli_vjp(const SimdDouble[], const RestModuli& by, SimdDouble out[]) {
        const SimdDouble by_mu = by.mu - SimdDouble(2.0 / 3.0) * by.lambda;
        for (int k = 0; k < n - 1; ++k) out[k] += by_mu * Law::shear_modulus(UnitConstants<n>(k).at);
        out[n - 1] += by.lambda;
    }
};

}  // namespace magshell
