// PosedField: a field given in a frame of its own with a pose in the world, x = center + R(rotation) y.
//
//   B(x) = R B_own(R^T (x - center))
//
// The gradient with respect to the pose follows from samples of the field itself, whatever kind of field it is.
#pragma once

#include "magshell/field/applied_field.h"

namespace magshell {

class PosedField final : public AppliedField {
  public:
    PosedField(std::shared_ptr<const AppliedField> field, const Vec3& center, const Vec3& rotation);

    std::string_view name() const override { return field_->name(); }
    void add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order, double scale,
                     FieldSamples& out) const override;

    /// Returns the field's own parameters, then center and rotation.
    std::vector<FieldParameter> parameters() const override;
    std::shared_ptr<AppliedField> clone() const override;
    void set_values(std::span<const double> values) override;
    void add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                 std::span<double> out) const override;

    bool needs_gil() const override { return field_->needs_gil(); }

  private:
    void set_pose(const Vec3& center, const Vec3& rotation);
    std::vector<Vec3> own_points(std::span<const Vec3> points) const;
    std::vector<Vec3> own_axes(std::span<const Vec3> vectors) const;

    std::shared_ptr<const AppliedField> field_;
    std::shared_ptr<AppliedField> own_;  // the same object if its parameters belong to this one, else nullptr
    std::size_t n_own_ = 0;              // number of values of its parameters
    // its current values: they are set again only if they changed, since splines through a grid are expensive
    std::vector<double> last_;
    Vec3 center_, rotation_;
    Mat3 turn_;
    bool moved_ = false;
};

}  // namespace magshell
