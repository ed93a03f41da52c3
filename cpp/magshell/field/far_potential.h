// FarPotential: the potential of a magnet seen from far away, where closed forms are small differences of large
// numbers.
#pragma once

#include <span>

#include "magshell/field/potential_derivatives.h"

namespace magshell {

enum class FarShape { cuboid, cylinder };

/// Point charges at Gauss points that represent a uniform body about the origin; their number depends on the
/// distance. A cylinder lies along the third axis and has its radius as half size along the other two.
class FarPotential {
  public:
    FarPotential(FarShape shape, const Vec3& half);

    /// Returns true if y is so far away that sums over the surface lose more digits than the charges, whose
    /// relative error is 1e-12.
    bool holds(const Vec3& y) const { return y.squaredNorm() > nearest_squared_; }

    /// Adds the derivatives up to the given order.
    void add(const Vec3& y, int order, PotentialDerivatives& out) const;
    /// Adds all of them, and the second and third ones differentiated by each of the half sizes.
    void add_with_sizes(const Vec3& y, PotentialDerivatives& out,
                        std::span<PotentialDerivatives> by_half) const;

  private:
    /// Calls add(position, charge) for all charges, positions in half sizes.
    template <class Add>
    void for_each_charge(const Vec3& y, const Add& add) const;

    FarShape shape_;
    Vec3 half_;
    double nearest_squared_;
};

}  // namespace magshell
