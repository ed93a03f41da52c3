// Yeoh's law of filled rubber (Yeoh 1993, Rubber Chemistry and Technology 66, 754-771), nearly incompressible.
//
//   W = C10 x + C20 x^2 + C30 x^3 + K/2 (J - 1)^2,   x = J^(-2/3) I1 - 3          [J/m3]
//
// The last summand may be evaluated at the mean J of an element. Flat and inverted elements have no energy. With C10 = mu/2,
// C20 = C30 = 0 and K = lam + 2/3 mu it is the neo-Hookean law whose resistance to shear does not depend on the volume.
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

/// The constants of the neo-Hookean case, by Young's modulus and Poisson's ratio.
class NeoHookeanModuli final : public SolidModuli {
  public:
    explicit NeoHookeanModuli(const SolidTermInput& input) : lame_(input) {}

    bool set_values(const Values& values) override { return lame_.set_values(values); }
    void constants(Index element, double out[]) const override {
        double lame[2];
        lame_.constants(element, lame);
        const auto [lambda, mu] = lame;
        out[0] = 0.5 * mu;
        out[1] = out[2] = 0.0;
        out[3] = lambda + 2.0 / 3.0 * mu;
    }
    void add_vjp(Index element, const double by[], Gradient& out) const override {
        const double by_lame[] = {by[3], 0.5 * by[0] + 2.0 / 3.0 * by[3]};
        lame_.add_vjp(element, by_lame, out);
    }
    double size(Index element) const override { return lame_.size(element); }

  private:
    LameModuli lame_;
};

}  // namespace

SolidMaterials yeoh_materials() {
    SolidMaterials all = isochoric_entries<Yeoh>("Yeoh");
    all.emplace_back("NeoHookean isochoric", &make_tetrahedra_term<InvariantSolid<Yeoh>, NeoHookeanModuli>);
    return all;
}

}  // namespace magshell
