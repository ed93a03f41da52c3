// LameModuli, GuccioneModuli: the material constants of each element of a solid, as users set them and as the
// energies take them, and the gradient from the latter to the former.
#pragma once

#include <vector>

#include "magshell/body/solid.h"
#include "magshell/core/parameters.h"

namespace magshell {

/// Young's modulus and Poisson's ratio, converted to the Lame constants
///   lambda = E nu / ((1 + nu) (1 - 2 nu)),   mu = E / (2 (1 + nu))
class LameModuli {
  public:
    LameModuli(const Solid& solid, Registry& registry);

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

/// The constants of energy/guccione.h, unchanged.
class GuccioneModuli {
  public:
    GuccioneModuli(const Solid& solid, Registry& registry);

    bool set_values(const Values& values);
    void constants(Index element, double out[8]) const;
    void add_vjp(Index element, const double by[8], Gradient& out) const;
    double size(Index element) const;

  private:
    ParameterSlice stiffness_, fibre_, cross_, shear_, bulk_modulus_, fibres_;
    std::vector<std::array<double, 8>> of_elements_;
};

}  // namespace magshell
