#include "magshell/terms/solid/solid_moduli.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

ParameterSlice of_elements(const Solid& solid, Registry& registry, const char* name, const char* unit,
                           Index width = 1) {
    return registry.values.add(solid.owner, name, unit, solid.n_elements(), width, &solid.elements);
}

}  // namespace

LameModuli::LameModuli(const Solid& solid, Registry& registry)
    : young_modulus_(of_elements(solid, registry, "young_modulus", "Pa")),
      poisson_ratio_(of_elements(solid, registry, "poisson_ratio", "1")),
      of_elements_(solid.n_elements()) {}

bool LameModuli::set_values(const Values& values) {
    if (!values.changed(young_modulus_, poisson_ratio_)) return false;
    for (Index t = 0; t < static_cast<Index>(of_elements_.size()); ++t)
        of_elements_[t] = {values.number(young_modulus_, t), values.number(poisson_ratio_, t)};
    return true;
}

void LameModuli::constants(Index element, double out[2]) const {
    const auto [young, nu] = of_elements_[element];
    out[0] = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    out[1] = 0.5 * young / (1.0 + nu);
}

void LameModuli::add_vjp(Index element, const double by[2], Gradient& out) const {
    const auto [young, nu] = of_elements_[element];
    double c[2];
    constants(element, c);
    const double both = (1.0 + nu) * (1.0 - 2.0 * nu);
    out.values[young_modulus_.at(element)] += (by[0] * c[0] + by[1] * c[1]) / young;
    out.values[poisson_ratio_.at(element)] +=
        by[0] * young * (1.0 + 2.0 * nu * nu) / (both * both) - by[1] * c[1] / (1.0 + nu);
}

double LameModuli::size(Index element) const {
    double c[2];
    constants(element, c);
    return std::abs(c[0]) + 2.0 * c[1];
}

GuccioneModuli::GuccioneModuli(const Solid& solid, Registry& registry)
    : stiffness_(of_elements(solid, registry, "stiffness", "Pa")),
      fibre_(of_elements(solid, registry, "fibre_exponent", "1")),
      cross_(of_elements(solid, registry, "cross_fibre_exponent", "1")),
      shear_(of_elements(solid, registry, "fibre_shear_exponent", "1")),
      bulk_modulus_(of_elements(solid, registry, "bulk_modulus", "Pa")),
      fibres_(of_elements(solid, registry, "fibres", "1", 3)),
      of_elements_(solid.n_elements()) {}

bool GuccioneModuli::set_values(const Values& values) {
    if (!values.changed(stiffness_, fibre_, cross_, shear_, bulk_modulus_, fibres_)) return false;
    for (Index t = 0; t < static_cast<Index>(of_elements_.size()); ++t) {
        const Vec3 m = values.vector(fibres_, t);
        of_elements_[t] = {values.number(stiffness_, t),
                           values.number(fibre_, t),
                           values.number(cross_, t),
                           values.number(shear_, t),
                           values.number(bulk_modulus_, t),
                           m.x(),
                           m.y(),
                           m.z()};
    }
    return true;
}

void GuccioneModuli::constants(Index element, double out[8]) const {
    std::copy(of_elements_[element].begin(), of_elements_[element].end(), out);
}

void GuccioneModuli::add_vjp(Index element, const double by[8], Gradient& out) const {
    const ParameterSlice* slices[5] = {&stiffness_, &fibre_, &cross_, &shear_, &bulk_modulus_};
    for (int k = 0; k < 5; ++k) out.values[slices[k]->at(element)] += by[k];
    for (int k = 0; k < 3; ++k) out.values[fibres_.at(element) + k] += by[5 + k];
}

double GuccioneModuli::size(Index element) const {
    const std::array<double, 8>& c = of_elements_[element];
    return c[0] * std::max({c[1], c[2], c[3]}) + c[4];
}

}  // namespace magshell
