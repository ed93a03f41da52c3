#include "magshell/field/sampled_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/field/point_loop.h"

namespace magshell {
namespace {

// A dense array with three axes in C order.
struct Grid {
    std::array<Index, 3> size;
    std::vector<Vec4> values;

    std::ptrdiff_t stride(int axis) const {
        std::ptrdiff_t result = 1;
        for (int a = axis + 1; a < 3; ++a) result *= size[a];
        return result;
    }
};

// Replaces every line of values along one axis by its image under `map`, which is two longer or two shorter.
Grid map_lines(int axis, const Grid& from, std::vector<Vec4> (*map)(std::span<const Vec4>), Index longer) {
    const Index n = from.size[axis];
    Grid result{from.size, {}};
    result.size[axis] = n + longer;
    const std::ptrdiff_t stride = from.stride(axis);  // the same in both grids
    const std::ptrdiff_t lines = static_cast<std::ptrdiff_t>(from.values.size()) / n;
    result.values.resize(lines * (n + longer));

    std::vector<Vec4> line(n);
    for (std::ptrdiff_t l = 0; l < lines; ++l) {
        const std::ptrdiff_t slab = l / stride, offset = l % stride;
        for (Index i = 0; i < n; ++i) line[i] = from.values[(slab * n + i) * stride + offset];
        const std::vector<Vec4> mapped = map(line);
        for (Index i = 0; i < n + longer; ++i)
            result.values[(slab * (n + longer) + i) * stride + offset] = mapped[i];
    }
    return result;
}

}  // namespace

SampledField::SampledField(const Vec3& origin, const Vec3& spacing, const std::array<Index, 3>& samples,
                           std::span<const Vec3> flux_density) {
    std::size_t expected = 1;
    for (const Index n : samples) expected *= static_cast<std::size_t>(std::max<Index>(n, 0));
    if (expected == 0 || expected != flux_density.size()) {
        throw InvalidInput("a grid of " + std::to_string(samples[0]) + " x " + std::to_string(samples[1]) +
                           " x " + std::to_string(samples[2]) + " samples does not fit " +
                           std::to_string(flux_density.size()) + " values");
    }

    std::ptrdiff_t stride = 1;  // of coefficients: an axis has two more than samples
    for (int a = 2; a >= 0; --a) {
        const bool constant = samples[a] == 1;
        axes_[a] = {origin[a], constant ? 0.0 : 1.0 / spacing[a], samples[a], constant ? 0 : stride};
        stride *= constant ? 1 : samples[a] + 2;
    }
    set_values({flux_density.data()->data(), 3 * flux_density.size()});
}

std::size_t SampledField::count() const {
    std::size_t count = 1;
    for (const Axis& axis : axes_) count *= static_cast<std::size_t>(axis.samples);
    return count;
}

std::vector<FieldParameter> SampledField::parameters() const {
    return {{"flux_density", "T", static_cast<Index>(count()), 3}};
}

void SampledField::set_values(std::span<const double> values) {
    Grid grid{{axes_[0].samples, axes_[1].samples, axes_[2].samples}, {}};
    grid.values.reserve(count());
    for (std::size_t k = 0; k < count(); ++k)
        grid.values.emplace_back(values[3 * k], values[3 * k + 1], values[3 * k + 2], 0.0);
    for (int a = 0; a < 3; ++a)
        if (axes_[a].samples > 1) grid = map_lines(a, grid, spline_coefficients, 2);
    coefficients_ = std::move(grid.values);
}

bool SampledField::Axis::contains(double x) const {
    constexpr double slack = 1e-9;  // [-] tolerance beyond the ends of the grid, in spacings
    const double u = grid_coordinate(x);
    return u >= -slack && u <= samples - 1 + slack;  // false for NaN
}

bool SampledField::contains(const Vec3& point) const {
    return axes_[0].contains(point[0]) && axes_[1].contains(point[1]) && axes_[2].contains(point[2]);
}

SampledField::Cell SampledField::cell_of(const Vec3& point) const {
    Cell cell;
    for (int a = 0; a < 3; ++a) {
        const Axis& axis = axes_[a];
        const double u = axis.grid_coordinate(point[a]);
        const double i = std::clamp(std::floor(u), 0.0, std::max(axis.samples - 2.0, 0.0));
        cell.weights[a] = spline_weights(u - i);
        cell.first += static_cast<std::ptrdiff_t>(i) * axis.stride;
    }
    return cell;
}

template <int Order>
void SampledField::add_sample(std::size_t k, const Vec3& point, const Vec3& moment, double scale,
                              FieldSamples& out) const {
    const Cell found = cell_of(point);
    const std::array<SplineWeights, 3>& w = found.weights;
    const Vec4* cell = coefficients_.data() + found.first;

    // Computes partial derivatives by sum factorization: d[a][b][c] is differentiated a, b and c times along x,
    // y and z.
    constexpr int n = Order + 1;
    const Vec4 zero = Vec4::Zero();
    Vec4 d[n][n][n];
    std::fill_n(&d[0][0][0], n * n * n, zero);
    for (int i = 0; i < 4; ++i) {
        Vec4 dyz[n][n];
        std::fill_n(&dyz[0][0], n * n, zero);
        for (int j = 0; j < 4; ++j) {
            const Vec4* row = cell + i * axes_[0].stride + j * axes_[1].stride;
            for (int c = 0; c <= Order; ++c) {
                Vec4 dz = w[2][c][0] * row[0];
                for (int l = 1; l < 4; ++l) dz += w[2][c][l] * row[l * axes_[2].stride];
                for (int b = 0; b + c <= Order; ++b) dyz[b][c] += w[1][b][j] * dz;
            }
        }
        for (int a = 0; a <= Order; ++a)
            for (int b = 0; a + b <= Order; ++b)
                for (int c = 0; a + b + c <= Order; ++c) d[a][b][c] += w[0][a][i] * dyz[b][c];
    }

    const Vec3 knots_per_metre(axes_[0].knots_per_metre, axes_[1].knots_per_metre, axes_[2].knots_per_metre);
    out.flux[k] += scale * d[0][0][0].template head<3>();
    if constexpr (Order >= 1) {
        Mat3 gradient;
        gradient << d[1][0][0].template head<3>(), d[0][1][0].template head<3>(),
            d[0][0][1].template head<3>();
        out.gradient[k] += scale * gradient * knots_per_metre.asDiagonal();
    }
    if constexpr (Order >= 2) {
        const auto contracted = [&](const Vec4& derivative) { return moment.dot(derivative.head<3>()); };
        const double xx = contracted(d[2][0][0]), yy = contracted(d[0][2][0]), zz = contracted(d[0][0][2]);
        const double xy = contracted(d[1][1][0]), xz = contracted(d[1][0][1]), yz = contracted(d[0][1][1]);
        Mat3 curvature;
        curvature << xx, xy, xz, xy, yy, yz, xz, yz, zz;
        out.curvature[k] += scale * (knots_per_metre * knots_per_metre.transpose()).cwiseProduct(curvature);
    }
}

void SampledField::add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order,
                               double scale, FieldSamples& out) const {
    for_each_point(points.size(), [&](std::size_t k) {
        if (!contains(points[k])) {
            constexpr double none = std::numeric_limits<double>::quiet_NaN();
            out.flux[k].setConstant(none);
            if (order >= 1) out.gradient[k].setConstant(none);
            if (order >= 2) out.curvature[k].setConstant(none);
        } else if (order == 0) {
            add_sample<0>(k, points[k], Vec3::Zero(), scale, out);
        } else if (order == 1) {
            add_sample<1>(k, points[k], Vec3::Zero(), scale, out);
        } else {
            add_sample<2>(k, points[k], moments[k], scale, out);
        }
    });
}

// Gradient with respect to the samples. A point depends linearly on the coefficients around it. Points are processed one
// after another, because they share coefficients.
void SampledField::add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                           std::span<double> out) const {
    Grid grid;
    for (int a = 0; a < 3; ++a) grid.size[a] = axes_[a].samples + (axes_[a].samples > 1 ? 2 : 0);
    grid.values.assign(coefficients_.size(), Vec4(Vec4::Zero()));
    for (std::size_t k = 0; k < points.size(); ++k) {
        const Cell cell = cell_of(points[k]);
        Vec3 along = probe.direction[k];
        for (int a = 0; a < 3; ++a) along[a] *= axes_[a].knots_per_metre;
        const auto& [x, y, z] = cell.weights;
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                for (int l = 0; l < 4; ++l) {
                    const double value = x[0][i] * y[0][j] * z[0][l];
                    const double rate = along[0] * x[1][i] * y[0][j] * z[0][l] +
                                        along[1] * x[0][i] * y[1][j] * z[0][l] +
                                        along[2] * x[0][i] * y[0][j] * z[1][l];
                    grid.values[cell.first + i * axes_[0].stride + j * axes_[1].stride + l * axes_[2].stride]
                        .head<3>() += scale * (value * probe.flux[k] + rate * probe.moment[k]);
                }
    }
    for (int a = 2; a >= 0; --a)
        if (axes_[a].samples > 1) grid = map_lines(a, grid, spline_samples_gradient, -2);
    for (std::size_t k = 0; k < grid.values.size(); ++k)
        for (int c = 0; c < 3; ++c) out[3 * k + c] += grid.values[k][c];
}

}  // namespace magshell
