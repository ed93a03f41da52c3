// Magnet: the flux density of uniformly magnetized permanent magnets, with its first and second derivatives.
//
// With Phi, the integral of 1/|x - x'| over the magnet, and its remanent magnetization M_r,
//
//   B = mu_0/(4 pi) (d2 Phi + 4 pi [inside]) M_r
//
// A shape therefore only provides the derivatives of Phi from the second to the fourth; field and gradients are
// the same code for all shapes.
#pragma once

#include <vector>

#include "magshell/field/applied_field.h"
#include "magshell/field/cuboid.h"
#include "magshell/field/cylinder.h"

namespace magshell {

/// A magnet whose shape has a frame of its own: x = center + R(rotation) y. The remanent magnetization [A/m] is
/// given in that frame and rotates with it. A point on the surface counts as outside; on an edge the field is
/// NaN.
///
/// A Shape provides `name`, `sizes` (its parameters), and its potential: see Cuboid.
template <class Shape>
class Magnet final : public AppliedField {
  public:
    Magnet(Shape shape, const Vec3& magnetization, const Vec3& center, const Vec3& rotation);

    std::string_view name() const override { return Shape::name; }
    void add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order, double scale,
                     FieldSamples& out) const override;

    /// Returns the sizes of the shape, then remanent_magnetization, center and rotation.
    std::vector<FieldParameter> parameters() const override;
    std::shared_ptr<AppliedField> clone() const override { return std::make_shared<Magnet>(*this); }
    void set_values(std::span<const double> values) override;
    void add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                 std::span<double> out) const override;

  private:
    static constexpr int n_values = Shape::n_sizes + 9;
    using Row = Eigen::Matrix<double, n_values, 1>;

    void set_pose(const Vec3& magnetization, const Vec3& center, const Vec3& rotation);
    /// Returns the gradient at one point by sizes, magnetization, center, and rotation in world axes.
    Row gradient_at(const Vec3& point, const Vec3& u, const Vec3& m, const Vec3& v) const;

    Shape shape_;
    Vec3 magnetization_, center_, rotation_;
    Mat3 turn_;
};

using CuboidMagnet = Magnet<Cuboid>;
using CylinderMagnet = Magnet<Cylinder>;

}  // namespace magshell
