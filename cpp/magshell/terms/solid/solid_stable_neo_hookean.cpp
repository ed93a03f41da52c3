// Stable neo-Hookean laws, which stay finite for flat and inverted elements and restore them.
//
// I1 = |F|^2, J = det F. Each law is split into w(I1, J) + U(J), as energy/invariant_solid.h requires; U is the last
// summand, with lam.
//
//   Smith, de Goes, Kim 2018, without the barrier:
//       mu/2 (I1 - 3) - mu (J - 1) + mu/2 (J - 1)^2     + lam/2 (J - 1)^2
//   with their logarithmic barrier (14), reparametrized so that small strains have the moduli lam and mu:
//       m/2 (I1 - 3) + l/2 (J - a)^2 - m/2 ln(I1 + 1),   m = 4/3 mu,  l = lam + 5/6 mu,  a = 1 + m/l - m/(4 l)
//   minus its value in the reference configuration, and with l (J - a) = l (J - 1) - mu:
//       m/2 (I1 - 3) - m/2 ln((I1 + 1)/4) - mu (J - 1) + 5/12 mu (J - 1)^2     + lam/2 (J - 1)^2
#include "magshell/core/simd_functions.h"
#include "magshell/energy/invariant_solid.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {
namespace {

struct StableNeoHookean : LameSolid {
    static constexpr bool refuses_inversion = false, constant_shear = true;

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        const SimdDouble &mu = c[1], change = j - SimdDouble(1.0), half = SimdDouble(0.5) * mu;
        return {half * (i1 - SimdDouble(3.0)) - mu * change + half * change * change,
                half,
                mu * (change - SimdDouble(1.0)),
                SimdDouble(0.0),
                SimdDouble(0.0),
                mu};
    }
    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        return quadratic_volume(c[0], j);
    }
};

struct StableNeoHookeanBarrier : LameSolid {
    static constexpr bool refuses_inversion = false, constant_shear = false;

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        const SimdDouble half = SimdDouble(2.0 / 3.0) * c[1], above = i1 + SimdDouble(1.0),
                         inverse = SimdDouble(1.0) / above;
        const SimdDouble change = j - SimdDouble(1.0), resists = SimdDouble(5.0 / 6.0) * c[1];
        return {half * (i1 - SimdDouble(3.0) - log(SimdDouble(0.25) * above)) +
                    (SimdDouble(0.5) * resists * change - c[1]) * change,
                half * (SimdDouble(1.0) - inverse),
                resists * change - c[1],
                half * inverse * inverse,
                SimdDouble(0.0),
                resists};
    }
    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        return quadratic_volume(c[0], j);
    }
};

}  // namespace

SolidMaterials stable_neo_hookean_materials() {
    return {{"StableNeoHookean", &make_tetrahedra_term<InvariantSolid<StableNeoHookean>, LameModuli>},
            {"StableNeoHookean barrier",
             &make_tetrahedra_term<InvariantSolid<StableNeoHookeanBarrier>, LameModuli>}};
}

}  // namespace magshell
