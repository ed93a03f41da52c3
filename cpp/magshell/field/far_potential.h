// The potential of a body seen from afar, where closed forms are small differences of large numbers.
#pragma once

#include <span>

#include "magshell/field/potential_derivatives.h"

namespace magshell {

enum class FarShape { cuboid, cylinder };

/// Point charges that stand for a uniform body about the origin: Gauss points, as many as the distance asks
/// for. A cylinder has its axis along the third axis, and its radius as half size along the other two.
class FarPotential {
  public:
    FarPotential(FarShape shape, const Vec3& half);

    /// Whether y is so far away that sums over the surface lose more than the charges err, 1e-12 of the whole.
    bool holds(const Vec3& y) const { return y.squaredNorm() > nearest_squared_; }

    /// Adds the derivatives up to the order.
    void add(const Vec3& y, int order, PotentialDerivatives& out) const;
    /// Adds all of them, and the second and third by each of the half sizes.
    void add_with_sizes(const Vec3& y, PotentialDerivatives& out,
                        std::span<PotentialDerivatives> by_half) const;

  private:
    /// Calls add(place, charge) for all of them, places in half sizes.
    template <class Add>
    void for_each_charge(const Vec3& y, const Add& add) const;

    FarShape shape_;
    Vec3 half_;
    double nearest_squared_;
};

}  // namespace magshell
