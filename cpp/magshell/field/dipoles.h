// Dipoles: the flux density of point dipoles, with its first and second derivatives in closed form.
#pragma once

#include <vector>

#include "magshell/field/applied_field.h"

namespace magshell {

constexpr double vacuum_permeability = 1.25663706127e-6;  // mu_0 [T m/A], CODATA 2022

/// Point dipoles in vacuum. A sample point that coincides with a dipole gets NaN.
class Dipoles final : public AppliedField {
  public:
    /// Creates the dipoles; positions [m] and moments [A m^2], one of each per dipole.
    Dipoles(std::vector<Vec3> positions, std::vector<Vec3> moments);

    std::string_view name() const override { return "dipoles"; }
    void add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order, double scale,
                     FieldSamples& out) const override;

    std::vector<FieldParameter> parameters() const override;
    std::shared_ptr<AppliedField> clone() const override { return std::make_shared<Dipoles>(*this); }
    void set_values(std::span<const double> values) override;
    void add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                 std::span<double> out) const override;

  private:
    std::vector<Vec3> positions_;
    std::vector<Vec3> moments_;
};

}  // namespace magshell
