// SampledField: a flux density given by samples on a regular grid, interpolated by tensor-product cubic
// B-splines.
#pragma once

#include <array>
#include <vector>

#include "magshell/field/applied_field.h"
#include "magshell/field/cubic_spline.h"

namespace magshell {

/// The field is twice continuously differentiable inside the grid and NaN outside. Its error falls with the
/// fourth power of the spacing, that of the gradient with the third, that of the second derivative with the
/// second.
class SampledField final : public AppliedField {
  public:
    /// Creates the field from samples B [T] in C order: the last axis runs fastest. Along an axis with one
    /// sample the field is constant; its origin and spacing are not used.
    SampledField(const Vec3& origin, const Vec3& spacing, const std::array<Index, 3>& samples,
                 std::span<const Vec3> flux_density);

    std::string_view name() const override { return "sampled field"; }
    void add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order, double scale,
                     FieldSamples& out) const override;

    std::vector<FieldParameter> parameters() const override;
    std::shared_ptr<AppliedField> clone() const override { return std::make_shared<SampledField>(*this); }
    void set_values(std::span<const double> values) override;
    /// The points must lie in the grid.
    void add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                 std::span<double> out) const override;

    /// Returns true if the point lies in the grid, with a tolerance of a billionth of a cell for round-off.
    bool contains(const Vec3& point) const;

  private:
    // One axis of the grid. A constant axis has stride 0 and knots_per_metre 0, so that all four weights, which
    // add up to one, refer to the same coefficient.
    struct Axis {
        double origin;
        double knots_per_metre;
        Index samples;
        std::ptrdiff_t stride;  // between neighbouring coefficients

        double grid_coordinate(double x) const { return (x - origin) * knots_per_metre; }
        bool contains(double x) const;
    };

    // The 64 coefficients around a point: the index of the first, and the weights along each axis.
    struct Cell {
        std::ptrdiff_t first = 0;
        std::array<SplineWeights, 3> weights;
    };
    Cell cell_of(const Vec3& point) const;

    template <int Order>
    void add_sample(std::size_t k, const Vec3& point, const Vec3& moment, double scale,
                    FieldSamples& out) const;

    /// Returns the number of samples.
    std::size_t count() const;

    std::array<Axis, 3> axes_;
    std::vector<Vec4> coefficients_;
};

}  // namespace magshell
