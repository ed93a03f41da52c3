// Yeoh's law of filled rubber (Yeoh 1993, Rubber Chemistry and Technology 66, 754-771), nearly incompressible.
//
//   W = C10 x + C20 x^2 + C30 x^3 + K/2 (J - 1)^2,   x = J^(-2/3) I1 - 3          [J/m3]
//
// The last summand may be evaluated at the mean J of an element. Flat and inverted elements have no energy.
#include "magshell/energy/isochoric_solid.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {
namespace {

struct Yeoh : IsochoricSolid<Yeoh, 4> {
    static constexpr NamedConstant named_constants[] = {
        {"c10", "Pa"}, {"c20", "Pa"}, {"c30", "Pa"}, {"bulk_modulus", "Pa"}};

    template <class Number>
    static Number shear_modulus(const Number c[]) {
        return Number(2.0) * c[0];
    }

    static InvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1, const SimdDouble& j) {
        const SimdDouble inverse = SimdDouble(1.0) / j, root = cbrt(inverse), by_i = root * root,
                         ratio = by_i * i1;
        const SimdDouble by_ij = SimdDouble(-2.0 / 3.0) * by_i * inverse, by_j = by_ij * i1;
        const SimdDouble by_jj = SimdDouble(-5.0 / 3.0) * by_j * inverse;
        // x is not negative in any state, but may be at the end of a linearized step.
        const SimdDouble x = max(ratio - SimdDouble(3.0), SimdDouble(0.0));
        const SimdDouble slope = c[0] + (SimdDouble(2.0) * c[1] + SimdDouble(3.0) * c[2] * x) * x;
        const SimdDouble curve = SimdDouble(2.0) * c[1] + SimdDouble(6.0) * c[2] * x;
        return {((c[2] * x + c[1]) * x + c[0]) * x,
                slope * by_i,
                slope * by_j,
                curve * by_i * by_i,
                curve * by_i * by_j + slope * by_ij,
                curve * by_j * by_j + slope * by_jj};
    }
};

}  // namespace

SolidMaterials yeoh_materials() {
    return isochoric_entries<Yeoh>("Yeoh");
}

}  // namespace magshell
