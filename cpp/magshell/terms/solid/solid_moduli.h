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

/// The constants of the elements, as an energy takes them.
class SolidModuli {
  public:
    virtual ~SolidModuli() = default;
    /// Returns whether they changed.
    virtual bool set_values(const Values& values) = 0;
    virtual void constants(Index element, double out[]) const = 0;
    /// Adds the gradient of a function with the derivatives `by` by the constants of an element.
    virtual void add_vjp(Index element, const double by[], Gradient& out) const = 0;
    /// Returns a modulus [Pa] of the size of the forces' stiffness, for bounds of round-off.
    virtual double size(Index element) const = 0;
};

/// Young's modulus and Poisson's ratio, converted to the Lame constants
///   lambda = E nu / ((1 + nu) (1 - 2 nu)),   mu = E / (2 (1 + nu))
class LameModuli final : public SolidModuli {
  public:
    explicit LameModuli(const SolidTermInput& input);

    bool set_values(const Values& values) override;
    /// Computes lambda and mu [Pa] of an element.
    void constants(Index element, double out[]) const override;
    void add_vjp(Index element, const double by[], Gradient& out) const override;
    double size(Index element) const override;

  private:
    ParameterSlice young_modulus_, poisson_ratio_;
    struct Pair {
        double young_modulus, poisson_ratio;
    };
    std::vector<Pair> of_elements_;
};

/// Constants by their names, unchanged.
class ConstantTable : public SolidModuli {
  public:
    ConstantTable(const SolidTermInput& input, std::span<const NamedConstant> constants);

    bool set_values(const Values& values) override;
    /// Returns the constants of an element, one after another.
    const double* of(Index element) const { return &rows_[static_cast<std::size_t>(element) * width_]; }
    void constants(Index element, double out[]) const override;
    void add_vjp(Index element, const double by[], Gradient& out) const override;

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

    double size(Index element) const override { return Material::size(of(element)); }
};

/// The constants of an IsochoricSolid, of which the last is the bulk modulus K, or Poisson's ratio in its place,
///   K = 2 mu (1 + nu) / (3 (1 - 2 nu))
/// if the material's name ends with "poisson_ratio". mu is linear in the other constants.
template <class Law>
class IsochoricModuli : public ConstantTable {
    static constexpr int n = Law::constants, last = n - 1;

  public:
    explicit IsochoricModuli(const SolidTermInput& input)
        : ConstantTable(input, names(input.response.material.ends_with(poisson_ratio))),
          by_poisson_ratio_(input.response.material.ends_with(poisson_ratio)) {}

    static constexpr std::string_view poisson_ratio = "poisson_ratio";

    void constants(Index element, double out[]) const override {
        ConstantTable::constants(element, out);
        if (by_poisson_ratio_) out[last] = Law::shear_modulus(out) * per_shear_modulus(out[last]);
    }

    void add_vjp(Index element, const double by[], Gradient& out) const override {
        if (!by_poisson_ratio_) return ConstantTable::add_vjp(element, by, out);
        const double *own = of(element), nu = own[last];
        double found[n];
        for (int k = 0; k < last; ++k) {
            double unit[n] = {};
            unit[k] = 1.0;
            found[k] = by[k] + by[last] * per_shear_modulus(nu) * Law::shear_modulus(unit);
        }
        found[last] = by[last] * 2.0 * Law::shear_modulus(own) / ((1.0 - 2.0 * nu) * (1.0 - 2.0 * nu));
        ConstantTable::add_vjp(element, found, out);
    }

    double size(Index element) const override {
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

    const bool by_poisson_ratio_;
};

}  // namespace magshell
