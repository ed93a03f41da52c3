#include "magshell/field/far_potential.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace magshell {
namespace {

// Gauss points and weights on (-1, 1): exact for polynomials of degree 7. 1/|y - y'| is harmonic in y', so
// that the error begins with the eighth power of size over distance.
std::array<std::pair<double, double>, 4> gauss_points() {
    const double root = 2.0 / 7.0 * std::sqrt(6.0 / 5.0), weight = std::sqrt(30.0) / 36.0;
    const double near = std::sqrt(3.0 / 7.0 - root), far = std::sqrt(3.0 / 7.0 + root);
    return {{{-far, 0.5 - weight}, {-near, 0.5 + weight}, {near, 0.5 + weight}, {far, 0.5 - weight}}};
}

}  // namespace

FarPotential FarPotential::cuboid() {
    FarPotential result;
    for (const auto& [x, wx] : gauss_points())
        for (const auto& [y, wy] : gauss_points())
            for (const auto& [z, wz] : gauss_points())
                result.charges_.push_back({Vec3(x, y, z), wx * wy * wz});
    return result;
}

FarPotential FarPotential::cylinder() {
    constexpr int directions = 8;
    FarPotential result;
    for (const double side : {-1.0, 1.0}) {  // two Gauss points of the square of the radius
        const double radius = std::sqrt(0.5 + side * 0.5 / std::numbers::sqrt3);
        for (int d = 0; d < directions; ++d) {
            const double angle = 2.0 * std::numbers::pi * (d + 0.5) / directions;
            for (const auto& [z, wz] : gauss_points())
                result.charges_.push_back({Vec3(radius * std::cos(angle), radius * std::sin(angle), z),
                                           0.5 * std::numbers::pi / directions * wz});
        }
    }
    return result;
}

void FarPotential::add(const Vec3& y, const Vec3& half, int order, PotentialDerivatives& out) const {
    const double volume = half.prod();
    for (const Charge& charge : charges_)
        add_point_charge(volume * charge.weight, y - half.cwiseProduct(charge.place), order, out);
}

void FarPotential::add_with_sizes(const Vec3& y, const Vec3& half, PotentialDerivatives& out,
                                  std::span<PotentialDerivatives> by_half) const {
    const double volume = half.prod();
    PotentialDerivatives sum;
    for (const Charge& charge : charges_) {
        PotentialDerivatives one;
        add_point_charge(volume * charge.weight, y - half.cwiseProduct(charge.place), 4, one);
        sum.add(1.0, one, 4);
        for (int a = 0; a < 3; ++a) by_half[a].add_slope(-charge.place[a], one, a);
    }
    out.add(1.0, sum, 4);
    for (int a = 0; a < 3; ++a) by_half[a].add(1.0 / half[a], sum, 3);
}

}  // namespace magshell
