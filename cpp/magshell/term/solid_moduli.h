// What a solid is made of, element by element: the constants that users set, those that the energies take, and
// the gradient from these back to those.
#pragma once

#include <vector>

#include "magshell/body/solid.h"
#include "magshell/core/parameters.h"

namespace magshell {

/// Young's modulus and Poisson's ratio:
///   lambda = E nu / ((1 + nu) (1 - 2 nu)),   mu = E / (2 (1 + nu))
class LameModuli {
  public:
    LameModuli(const Solid& solid, Registry& registry);

    bool set_values(const Values& values);
    /// lambda, mu [Pa]
    void constants(Index element, double out[2]) const;
    void add_vjp(Index element, const double by[2], Gradient& out) const;
    /// A modulus that the forces are of the size of [Pa].
    double size(Index element) const;

  private:
    Slot young_modulus_, poisson_ratio_;
    struct Pair {
        double young_modulus, poisson_ratio;
    };
    std::vector<Pair> of_elements_;
};

/// The constants of energy/guccione.h as they are.
class GuccioneModuli {
  public:
    GuccioneModuli(const Solid& solid, Registry& registry);

    bool set_values(const Values& values);
    void constants(Index element, double out[8]) const;
    void add_vjp(Index element, const double by[8], Gradient& out) const;
    double size(Index element) const;

  private:
    Slot stiffness_, fibre_, cross_, shear_, bulk_modulus_, fibres_;
    std::vector<std::array<double, 8>> of_elements_;
};

}  // namespace magshell
