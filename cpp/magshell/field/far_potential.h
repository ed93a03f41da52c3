// The potential of a body seen from afar, where closed forms are small differences of large numbers.
#pragma once

#include <span>
#include <vector>

#include "magshell/field/potential_derivatives.h"

namespace magshell {

/// Point charges that stand for a uniform body, of a size of its own along each axis.
class FarPotential {
  public:
    /// The Gauss points of the cube |y_i| < 1.
    static FarPotential cuboid();
    /// Points of the cylinder y_1^2 + y_2^2 < 1, |y_3| < 1, alike in eight directions.
    static FarPotential cylinder();

    /// Whether y is so far from a body with these half sizes that the charges give full accuracy.
    bool holds(const Vec3& y, const Vec3& half) const { return y.squaredNorm() > 144.0 * half.squaredNorm(); }

    /// Adds the derivatives up to the order.
    void add(const Vec3& y, const Vec3& half, int order, PotentialDerivatives& out) const;
    /// Adds all of them, and the second and third by each of the half sizes.
    void add_with_sizes(const Vec3& y, const Vec3& half, PotentialDerivatives& out,
                        std::span<PotentialDerivatives> by_half) const;

  private:
    struct Charge {
        Vec3 place;
        double weight;
    };
    std::vector<Charge> charges_;
};

}  // namespace magshell
