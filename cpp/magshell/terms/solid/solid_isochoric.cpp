// The neo-Hookean law whose resistance to shear does not depend on the volume; no energy for inverted elements.
//
//   mu/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2,   K = lam + 2/3 mu
//
// The last summand may be evaluated at the mean J of an element.
#include "magshell/core/simd_functions.h"
#include "magshell/energy/invariant_solid.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {
namespace {

struct NeoHookeanIsochoric : LameSolid {
    static constexpr bool refuses_inversion = true, constant_shear = false;

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        const SimdDouble inverse = SimdDouble(1.0) / j, root = cbrt(inverse),
                         half = SimdDouble(0.5) * c[1] * root * root;
        const SimdDouble by_ij = SimdDouble(-2.0 / 3.0) * half * inverse, by_j = by_ij * i1;
        return {half * i1 - SimdDouble(1.5) * c[1],     half, by_j, SimdDouble(0.0), by_ij,
                SimdDouble(-5.0 / 3.0) * by_j * inverse};
    }
    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& j) {
        return quadratic_volume(c[0] + SimdDouble(2.0 / 3.0) * c[1], j);
    }
};

}  // namespace

SolidMaterials isochoric_materials() {
    return {{"NeoHookean isochoric", &make_tetrahedra_term<InvariantSolid<NeoHookeanIsochoric>, LameModuli>}};
}

}  // namespace magshell
