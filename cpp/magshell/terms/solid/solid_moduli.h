// LameModuli, NamedModuli, IsochoricModuli: the material constants of each element of a solid, as users set them and
// as the energies take them, and the gradient from the latter to the former. A term makes one of them from its input.
#pragma once

#include <array>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include "magshell/core/parameters.h"
#include "magshell/energy/invariant_solid.h"
#include "magshell/terms/solid/solid_materials.h"

namespace magshell {

/// Young's modulus and Poisson's ratio, converted to the Lame constants
///   lambda = E nu / ((1 + nu) (1 - 2 nu)),   mu = E / (2 (1 + nu))
class LameModuli {
  public:
    explicit LameModuli(const SolidTermInput& input);

    bool set_values(const Values& values);
    /// Computes lambda and mu [Pa] of an element.
    void constants(Index element, double out[2]) const;
    void add_vjp(Index element, const double by[2], Gradient& out) const;
    /// Returns a modulus [Pa] of the size of the forces' stiffness, for bounds of round-off.
    double size(Index element) const;

  private:
    ParameterSlice young_modulus_, poisson_ratio_;
    struct Pair {
        double young_modulus, poisson_ratio;
    };
    std::vector<Pair> of_elements_;
};

/// Constants by their names, unchanged.
class ConstantTable {
  public:
    ConstantTable(const SolidTermInput& input, std::span<const NamedConstant> constants);

    bool set_values(const Values& values);
    /// Returns the constants of an element, one after another.
    const double* of(Index element) const { return &rows_[static_cast<std::size_t>(element) * width_]; }
    void constants(Index element, double out[]) const;
    void add_vjp(Index element, const double by[], Gradient& out) const;

  private:
    std::vector<ParameterSlice> slices_;
    std::size_t width_ = 0;
    std::vector<double> rows_;
};

/// The constants `Material::named_constants`, unchanged.
template <class Material>
class NamedModuli : public ConstantTable {
  public:
    explicit NamedModuli(const SolidTermInput& input) : ConstantTable(input, Material::named_constants) {}

    double size(Index element) const { return Material::size(of(element)); }
};

/// The constants of an IsochoricSolid, of which the last is the bulk modulus K, or Poisson's ratio in its place,
///   K = 2 mu (1 + nu) / (3 (1 - 2 nu))
/// if the material's name ends with "poisson_ratio". mu is linear in the other constants.
template <class Law>
class IsochoricModuli {
    static constexpr int n = Law::constants, last = n - 1;

  public:
    explicit IsochoricModuli(const SolidTermInput& input)
        : by_poisson_ratio_(input.response.material.ends_with(poisson_ratio)),
          table_(input, names(by_poisson_ratio_)) {}

    static constexpr std::string_view poisson_ratio = "poisson_ratio";

    bool set_values(const Values& values) { return table_.set_values(values); }

    void constants(Index element, double out[n]) const {
        table_.constants(element, out);
        if (by_poisson_ratio_) out[last] = Law::shear_modulus(out) * per_shear_modulus(out[last]);
    }

    void add_vjp(Index element, const double by[n], Gradient& out) const {
        if (!by_poisson_ratio_) return table_.add_vjp(element, by, out);
        const double *own = table_.of(element), nu = own[last];
        double found[n];
        for (int k = 0; k < last; ++k) {
            double unit[n] = {};
            unit[k] = 1.0;
            found[k] = by[k] + by[last] * per_shear_modulus(nu) * Law::shear_modulus(unit);
        }
        found[last] = by[last] * 2.0 * Law::shear_modulus(own) / ((1.0 - 2.0 * nu) * (1.0 - 2.0 * nu));
        table_.add_vjp(element, found, out);
    }

    double size(Index element) const {
        double c[n];
        constants(element, c);
        const double mu = Law::shear_modulus(c);
        return std::abs(c[last] - 2.0 / 3.0 * mu) + 2.0 * mu;
    }

  private:
    static std::array<NamedConstant, n> names(bool by_poisson_ratio) {
        std::array<NamedConstant, n> names = std::to_array(Law::named_constants);
        if (by_poisson_ratio) names[last] = {poisson_ratio.data(), "1"};
        return names;
    }
    static double per_shear_modulus(double nu) { return 2.0 * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)); }

    bool by_poisson_ratio_;
    ConstantTable table_;
};

}  // namespace magshell
