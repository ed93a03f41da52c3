#include "magshell/terms/solid/solid_moduli.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

ParameterSlice of_elements(const SolidTermInput& input, const NamedConstant& constant) {
    const Solid& solid = input.solid;
    return input.registry.values.add(solid.owner, constant.name, constant.unit, solid.n_elements(),
                                     constant.width, &solid.elements);
}

}  // namespace

LameModuli::LameModuli(const SolidTermInput& input)
    : young_modulus_(of_elements(input, {"young_modulus", "Pa"})),
      poisson_ratio_(of_elements(input, {"poisson_ratio", "1"})),
      of_elements_(input.solid.n_elements()) {}

bool LameModuli::set_values(const Values& values) {
    if (!values.changed(young_modulus_, poisson_ratio_)) return false;
    for (Index t = 0; t < static_cast<Index>(of_elements_.size()); ++t)
        of_elements_[t] = {values.number(young_modulus_, t), values.number(poisson_ratio_, t)};
    return true;
}

void LameModuli::constants(Index element, double out[]) const {
    const auto [young, nu] = of_elements_[element];
    out[0] = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    out[1] = 0.5 * young / (1.0 + nu);
}

void LameModuli::add_vjp(Index element, const double by[], Gradient& out) const {
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

ConstantTable::ConstantTable(const SolidTermInput& input, std::span<const NamedConstant> constants) {
    for (const NamedConstant& each : constants) {
        slices_.push_back(of_elements(input, each));
        width_ += each.width;
    }
    rows_.resize(width_ * input.solid.n_elements());
}

bool ConstantTable::set_values(const Values& values) {
    if (std::none_of(slices_.begin(), slices_.end(),
                     [&](const ParameterSlice& each) { return values.changed(each); }))
        return false;
    double* to = rows_.data();
    for (Index t = 0; t < slices_.front().rows; ++t)
        for (const ParameterSlice& each : slices_)
            to = std::copy_n(values[each] + t * each.width, each.width, to);
    return true;
}

void ConstantTable::constants(Index element, double out[]) const {
    std::copy_n(of(element), width_, out);
}

void ConstantTable::add_vjp(Index element, const double by[], Gradient& out) const {
    for (const ParameterSlice& each : slices_)
        for (Index k = 0; k < each.width; ++k) out.values[each.at(element) + k] += *by++;
}

}  // namespace magshell
