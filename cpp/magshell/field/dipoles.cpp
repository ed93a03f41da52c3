#include "magshell/field/dipoles.h"

#include <numbers>
#include <string>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"
#include "magshell/field/point_loop.h"

namespace magshell {
namespace {

// Flux density of a dipole and its derivatives. p is the dipole's moment, r the vector from it to the point, e
// = r/|r|, and m the moment at the point.
//
//   B           = k/|r|^3  (3 (p.e) e - p)                                            k = mu_0/(4 pi)
//   dB/dx       = 3k/|r|^4 (p e^T + e p^T + (p.e) (I - 5 e e^T))
//   d2(m.B)/dx2 = 3k/|r|^5 (p m^T + m p^T - 5 (v e^T + e v^T) + (35 a b - 5 c) e e^T + (c - 5 a b) I)
//
// with a = p.e, b = m.e, c = p.m, v = b p + a m. B is harmonic and free of curl and divergence, so both
// matrices are symmetric and have trace zero.

Vec3 flux(const Vec3& p, const Vec3& e) {
    return 3.0 * p.dot(e) * e - p;
}

Mat3 gradient(const Vec3& p, const Vec3& e) {
    const Mat3 pe = p * e.transpose();
    const double a = p.dot(e);
    Mat3 result = pe + pe.transpose() - 5.0 * a * e * e.transpose();
    result.diagonal().array() += a;
    return result;
}

Mat3 curvature(const Vec3& p, const Vec3& m, const Vec3& e) {
    const double a = p.dot(e), b = m.dot(e), c = p.dot(m);
    const Vec3 v = b * p + a * m;
    const Mat3 half = p * m.transpose() - 5.0 * v * e.transpose();
    Mat3 result = half + half.transpose() + (35.0 * a * b - 5.0 * c) * e * e.transpose();
    result.diagonal().array() += c - 5.0 * a * b;
    return result;
}

}  // namespace

Dipoles::Dipoles(std::vector<Vec3> positions, std::vector<Vec3> moments)
    : positions_(std::move(positions)), moments_(std::move(moments)) {
    if (positions_.size() != moments_.size()) {
        throw InvalidInput("dipoles need one moment a position, got " + std::to_string(positions_.size()) +
                           " positions and " + std::to_string(moments_.size()) + " moments");
    }
}

void Dipoles::add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order,
                          double scale, FieldSamples& out) const {
    const double k = scale * vacuum_permeability / (4.0 * std::numbers::pi);
    for_each_point(points.size(), [&](std::size_t point) {
        for (std::size_t d = 0; d < positions_.size(); ++d) {
            const Vec3 r = points[point] - positions_[d];
            const double distance = r.norm();
            const Vec3 e = r / distance;  // NaN on the dipole itself, and so are all results
            const double k3 = k / (distance * distance * distance);
            out.flux[point] += k3 * flux(moments_[d], e);
            if (order >= 1) out.gradient[point] += 3.0 * k3 / distance * gradient(moments_[d], e);
            if (order >= 2) {
                out.curvature[point] +=
                    3.0 * k3 / (distance * distance) * curvature(moments_[d], moments[point], e);
            }
        }
    });
}

// Gradients with respect to the parameters: B and dB/dx are linear in p and, as matrices that map p to u . B and m . dB/dx
// v, symmetric. The derivative with respect to p is therefore the flux of a dipole u plus the gradient of a dipole m along
// v. The derivative with respect to the position of the dipole is minus that with respect to the point.
std::vector<FieldParameter> Dipoles::parameters() const {
    const Index n = static_cast<Index>(positions_.size());
    return {{"positions", "m", n, 3}, {"moments", "A m^2", n, 3}};
}

void Dipoles::set_values(std::span<const double> values) {
    const std::size_t n = positions_.size();
    for (std::size_t d = 0; d < n; ++d) {
        positions_[d] = Vec3(values.data() + 3 * d);
        moments_[d] = Vec3(values.data() + 3 * (n + d));
    }
}

void Dipoles::add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                      std::span<double> out) const {
    const double k = scale * vacuum_permeability / (4.0 * std::numbers::pi);
    const auto n = static_cast<int>(positions_.size());
    parallel_for(n, [&](int d) {
        Vec3 by_position = Vec3::Zero(), by_moment = Vec3::Zero();
        for (std::size_t point = 0; point < points.size(); ++point) {
            const Vec3 r = points[point] - positions_[d], &u = probe.flux[point], &m = probe.moment[point];
            const double distance = r.norm();
            const Vec3 e = r / distance, v = probe.direction[point] / distance;
            const double k3 = k / (distance * distance * distance);
            by_moment += k3 * (flux(u, e) + 3.0 * gradient(m, e) * v);
            by_position -=
                3.0 * k3 / distance * (gradient(moments_[d], e) * u + curvature(moments_[d], m, e) * v);
        }
        Eigen::Map<Vec3>(out.data() + 3 * d) += by_position;
        Eigen::Map<Vec3>(out.data() + 3 * (n + d)) += by_moment;
    });
}

}  // namespace magshell
