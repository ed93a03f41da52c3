// Neo-Hookean laws that have no energy for inverted elements, by their measure of volume change.
//
//   ln J        mu/2 (I1 - 3) - mu ln J              + lam/2 (ln J)^2
//   J           mu/2 (I1 - 3) - mu ln J              + lam/2 (J - 1)^2
//
// The last summand may be evaluated at the mean J of an element.
#include "magshell/core/simd_functions.h"
#include "magshell/energy/invariant_solid.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {
namespace {

/// Returns mu/2 (I1 - 3) - mu ln J and its derivatives.
inline InvariantDerivatives shear_and_logarithm(const SimdDouble& mu, const SimdDouble& i1,
                                                const SimdDouble& j) {
    const SimdDouble inverse = SimdDouble(1.0) / j, half = SimdDouble(0.5) * mu;
    return {half * (i1 - SimdDouble(3.0)) - mu * log(j),
            half,
            -mu * inverse,
            SimdDouble(0.0),
            SimdDouble(0.0),
            mu * inverse * inverse};
}

struct NeoHookeanLogarithm : LameSolid {
    static constexpr bool refuses_inversion = true, constant_shear = true;

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        return shear_and_logarithm(c[1], i1, j);
    }
    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        const SimdDouble ln = log(j), inverse = SimdDouble(1.0) / j;
        return {SimdDouble(0.5) * c[0] * ln * ln, c[0] * ln * inverse,
                c[0] * (SimdDouble(1.0) - ln) * inverse * inverse};
    }
};

struct NeoHookeanVolume : LameSolid {
    static constexpr bool refuses_inversion = true, constant_shear = true;

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        return shear_and_logarithm(c[1], i1, j);
    }
    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        return quadratic_volume(c[0], j);
    }
};

}  // namespace

SolidMaterials neo_hookean_materials() {
    return {{"NeoHookean ln J", &make_tetrahedra_term<InvariantSolid<NeoHookeanLogarithm>, LameModuli>},
            {"NeoHookean J", &make_tetrahedra_term<InvariantSolid<NeoHookeanVolume>, LameModuli>}};
}

}  // namespace magshell
