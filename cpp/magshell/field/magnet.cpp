#include "magshell/field/magnet.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "magshell/core/rotation_vector.h"
#include "magshell/field/dipoles.h"
#include "magshell/field/point_loop.h"

namespace magshell {
namespace {

constexpr double four_pi = 4.0 * std::numbers::pi;

/// Returns the matrix d2 Phi + 4 pi [inside], which maps M to B up to a constant factor.
Mat3 flux_matrix(const PotentialDerivatives& potential, bool inside) {
    Mat3 result = potential.matrix();
    if (inside) result.diagonal().array() += four_pi;
    return result;
}

}  // namespace

template <class Shape>
Magnet<Shape>::Magnet(Shape shape, const Vec3& magnetization, const Vec3& center, const Vec3& rotation)
    : shape_(std::move(shape)) {
    set_pose(magnetization, center, rotation);
}

template <class Shape>
void Magnet<Shape>::set_pose(const Vec3& magnetization, const Vec3& center, const Vec3& rotation) {
    magnetization_ = magnetization;
    center_ = center;
    rotation_ = rotation;
    turn_ = magshell::rotation(rotation);
}

template <class Shape>
void Magnet<Shape>::add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order,
                                double scale, FieldSamples& out) const {
    const double k = scale * vacuum_permeability / four_pi;
    for_each_point(points.size(), [&](std::size_t point) {
        const Vec3 y = turn_.transpose() * (points[point] - center_);
        const Mat3 frame = shape_.frame(y), axes = turn_ * frame;
        const Vec3 magnetization = frame.transpose() * magnetization_;
        PotentialDerivatives potential;
        shape_.derivatives(y, order + 2, potential);
        out.flux[point] += k * (axes * (flux_matrix(potential, shape_.contains(y)) * magnetization));
        if (order >= 1) out.gradient[point] += k * (axes * potential.along(magnetization) * axes.transpose());
        if (order >= 2) {
            const Vec3 moment = axes.transpose() * moments[point];
            out.curvature[point] += k * (axes * potential.along(magnetization, moment) * axes.transpose());
        }
    });
}

template <class Shape>
std::vector<FieldParameter> Magnet<Shape>::parameters() const {
    std::vector<FieldParameter> result(Shape::sizes.begin(), Shape::sizes.end());
    result.push_back({"remanent_magnetization", "A/m", 1, 3});
    result.push_back({"center", "m", 1, 3});
    result.push_back({"rotation", "rad", 1, 3});
    return result;
}

template <class Shape>
void Magnet<Shape>::set_values(std::span<const double> values) {
    shape_.set_sizes(values.first(Shape::n_sizes));
    const double* rest = values.data() + Shape::n_sizes;
    set_pose(Vec3(rest), Vec3(rest + 3), Vec3(rest + 6));
}

// Gradient of w = u . B + m . (G v), G = dB/dx, at one point, with all vectors in axes of the shape. A
// displacement of the magnet changes w as the opposite displacement of the point does; a rotation as the
// opposite rotation of u, m, v and the point about the center does.
template <class Shape>
typename Magnet<Shape>::Row Magnet<Shape>::gradient_at(const Vec3& point, const Vec3& u, const Vec3& m,
                                                       const Vec3& v) const {
    const Vec3 y = turn_.transpose() * (point - center_);
    const Mat3 frame = shape_.frame(y), axes = turn_ * frame;
    const Vec3 magnetization = frame.transpose() * magnetization_, here = frame.transpose() * y;
    const Vec3 un = axes.transpose() * u, mn = axes.transpose() * m, vn = axes.transpose() * v;

    PotentialDerivatives potential;
    std::array<PotentialDerivatives, Shape::n_sizes> by_size{};
    shape_.derivatives_by_size(y, potential, by_size);
    const Mat3 flux = flux_matrix(potential, shape_.contains(y)), slope = potential.along(magnetization);
    const Vec3 by_point = slope * un + potential.along(magnetization, mn) * vn;
    const Vec3 torque =
        un.cross(flux * magnetization) + mn.cross(slope * vn) + vn.cross(slope * mn) + here.cross(by_point);
    Row row;
    for (int k = 0; k < Shape::n_sizes; ++k)
        row[k] = un.dot(by_size[k].matrix() * magnetization) + mn.dot(by_size[k].along(magnetization) * vn);
    row.template segment<3>(Shape::n_sizes) = frame * (flux * un + potential.along(mn) * vn);
    row.template segment<3>(Shape::n_sizes + 3) = -(axes * by_point);
    row.template segment<3>(Shape::n_sizes + 6) = -(axes * torque);
    return row;
}

template <class Shape>
void Magnet<Shape>::add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                            std::span<double> out) const {
    constexpr std::size_t block = 64;  // summed in order, so that the number of threads changes no bit
    std::vector<Row> sums((points.size() + block - 1) / block, Row::Zero());
    parallel_for(static_cast<int>(sums.size()), [&](int b) {
        const std::size_t first = b * block, last = std::min(first + block, points.size());
        for (std::size_t k = first; k < last; ++k)
            sums[b] += gradient_at(points[k], probe.flux[k], probe.moment[k], probe.direction[k]);
    });
    Row total = Row::Zero();
    for (const Row& sum : sums) total += sum;
    const Vec3 turned = total.template tail<3>();
    total.template tail<3>() = transposed_jacobian_times(rotation_, turned);
    Eigen::Map<Row>(out.data()) += scale * vacuum_permeability / four_pi * total;
}

template class Magnet<Cuboid>;
template class Magnet<Cylinder>;

}  // namespace magshell
