// Cylinder: the potential of a uniformly magnetized cylinder.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "magshell/field/applied_field.h"
#include "magshell/field/far_potential.h"

namespace magshell {

/// A cylinder about the origin along the third axis. The interface is that of Cuboid.
class Cylinder {
  public:
    static constexpr std::string_view name = "cylinder magnet";
    static constexpr std::array<FieldParameter, 2> sizes = {{{"radius", "m", 1, 1}, {"height", "m", 1, 1}}};
    static constexpr int n_sizes = 2;

    /// Creates the cylinder from radius and height [m], positive.
    Cylinder(double radius, double height);
    void set_sizes(std::span<const double> radius_and_height);

    bool contains(const Vec3& y) const;
    /// Returns the axes at y: away from the axis, around it, and along it.
    Mat3 frame(const Vec3& y) const;

    void derivatives(const Vec3& y, int order, PotentialDerivatives& out) const;
    void derivatives_by_size(const Vec3& y, PotentialDerivatives& out,
                             std::span<PotentialDerivatives> by_size) const;

  private:
    template <class Add>
    void for_each_piece(const Vec3& y, int order, bool by_radius, const Add& add) const;

    double radius_, half_height_;
    FarPotential far_;
};

}  // namespace magshell
