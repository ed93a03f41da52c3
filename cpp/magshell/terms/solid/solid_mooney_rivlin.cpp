// The Mooney-Rivlin law of rubber (Mooney 1940, Rivlin 1948), nearly incompressible.
//
//   W = C10 (J^(-2/3) I1 - 3) + C01 (J^(-4/3) I2 - 3) + K/2 (J - 1)^2             [J/m3]
//
// The last summand may be evaluated at the mean J of an element. Flat and inverted elements have no energy.
#include "magshell/energy/isochoric_solid.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {
namespace {

struct MooneyRivlin : IsochoricSolid<MooneyRivlin, 3> {
    static constexpr bool has_i2 = true;
    static constexpr NamedConstant named_constants[] = {{"c10", "Pa"}, {"c01", "Pa"}, {"bulk_modulus", "Pa"}};

    template <class Number>
    static Number shear_modulus(const Number c[]) {
        return Number(2.0) * (c[0] + c[1]);
    }

    static ThreeInvariantDerivatives derivatives(const SimdDouble c[], const SimdDouble& i1,
                                                 const SimdDouble& i2, const SimdDouble& j) {
        const SimdDouble inverse = SimdDouble(1.0) / j, root = cbrt(inverse), square = root * root;
        const SimdDouble by_1 = c[0] * square, by_2 = c[1] * square * square;
        const SimdDouble by_1j = SimdDouble(-2.0 / 3.0) * by_1 * inverse,
                         by_2j = SimdDouble(-4.0 / 3.0) * by_2 * inverse;
        const SimdDouble j1 = by_1j * i1, j2 = by_2j * i2;
        return {
            {by_1 * i1 - SimdDouble(3.0) * c[0] + by_2 * i2 - SimdDouble(3.0) * c[1], by_1, j1 + j2,
             SimdDouble(0.0), by_1j, -(SimdDouble(5.0 / 3.0) * j1 + SimdDouble(7.0 / 3.0) * j2) * inverse},
            by_2,
            SimdDouble(0.0),
            SimdDouble(0.0),
            by_2j};
    }
};

}  // namespace

SolidMaterials mooney_rivlin_materials() {
    return isochoric_entries<MooneyRivlin>("MooneyRivlin");
}

}  // namespace magshell
