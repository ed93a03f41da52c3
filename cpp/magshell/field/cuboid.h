// Cuboid: the potential of a uniformly magnetized cuboid.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "magshell/field/applied_field.h"
#include "magshell/field/far_potential.h"

namespace magshell {

/// A cuboid about the origin with its edges along the axes.
class Cuboid {
  public:
    static constexpr std::string_view name = "cuboid magnet";
    static constexpr std::array<FieldParameter, 1> sizes = {{{"dimensions", "m", 1, 3}}};
    static constexpr int n_sizes = 3;

    /// Creates the cuboid from the lengths of its edges [m], positive.
    explicit Cuboid(const Vec3& dimensions);
    void set_sizes(std::span<const double> dimensions);

    bool contains(const Vec3& y) const;
    /// Returns the axes, as columns, in which the derivatives at y are given.
    Mat3 frame(const Vec3& /*y*/) const { return Mat3::Identity(); }

    /// Adds the derivatives of the integral of 1/|y - y'| over the cuboid, from the second to the given order.
    void derivatives(const Vec3& y, int order, PotentialDerivatives& out) const;
    /// Adds all of them, and the second and third ones differentiated by each of the sizes.
    void derivatives_by_size(const Vec3& y, PotentialDerivatives& out,
                             std::span<PotentialDerivatives> by_size) const;

  private:
    template <class Add>
    void for_each_piece(const Vec3& y, int order, const Add& add) const;

    Vec3 half_;
    FarPotential far_;
};

}  // namespace magshell
