#include "magshell/energy/grown_six.h"

#include <cmath>

#include "magshell/strain/six_nodes.h"

namespace magshell {
namespace {

Eigen::Matrix<double, 3, 2> plane_axes(const Vec3& first, const Vec3& normal) {
    Eigen::Matrix<double, 3, 2> axes;
    axes.col(0) = (first - first.dot(normal) * normal).normalized();
    axes.col(1) = normal.cross(axes.col(0));
    return axes;
}

Eigen::Matrix<double, 3, 2> corner_axes(const std::array<Vec3, 6>& x) {
    const Vec3 edge = x[2] - x[1];
    return plane_axes(edge, edge.cross(x[0] - x[2]).normalized());
}

Vec3 with_zero_z(const Eigen::Vector2d& in_plane) {
    return {in_plane.x(), in_plane.y(), 0.0};
}

double test_at(int r, int p) {
    return six_nodes::test(r / 3, r % 3, six_nodes::inside[p].at);
}

}  // namespace

std::array<double, 3> GrownSix::gauss_point(int i, int g) {
    std::array<double, 3> at{};
    at[(i + 1) % 3] = 1.0 - six_nodes::gauss[g];
    at[(i + 2) % 3] = six_nodes::gauss[g];
    return at;
}

std::array<double, 3> GrownSix::middle_point(int m) {
    std::array<double, 3> at = {0.5, 0.5, 0.5};
    at[m] = 0.0;
    return at;
}

TangentPoint::TangentPoint(const std::array<Vec3, 6>& rest, const Vec3& first_axis,
                           const std::array<double, 3>& at) {
    std::array<Vec3, 3> t;
    for (int i = 0; i < 3; ++i) {
        t[i].setZero();
        const std::array<double, 6> by_node = six_nodes::derivative(i, at);
        for (int a = 0; a < 6; ++a) t[i] += by_node[a] * rest[a];
    }
    axes = plane_axes(first_axis, t[0].cross(t[1]).normalized());
    for (int i = 0; i < 3; ++i) along[i] = axes.transpose() * t[i];
}

GrownSix::GrownSix(const std::array<Vec3, 6>& rest, const Mat3& growth, const Mat3& curvature)
    : rest_(rest),
      axes_(corner_axes(rest)),
      growth_(axes_.transpose() * growth * axes_),
      inverse_(growth_.inverse()),
      curvature_(axes_.transpose() * curvature * axes_),
      determinant_(growth_.determinant()) {
    for (const six_nodes::Point& point : six_nodes::inside)
        interior_points_.emplace_back(rest, axes_.col(0), point.at);
    for (int i = 0; i < 3; ++i)
        for (int g = 0; g < 2; ++g) at_gauss_.emplace_back(rest, axes_.col(0), gauss_point(i, g));
    for (int m = 0; m < 3; ++m) at_middle_.emplace_back(rest, axes_.col(0), middle_point(m));
    const SixNodeFace before(rest);
    for (int r = 0; r < 9; ++r) {
        length_ratio_[r] = 1.0;
        if (r % 3 < 2) {
            const Eigen::Vector2d& t = at_gauss_[2 * (r / 3) + r % 3].along[r / 3];
            length_ratio_[r] = (growth_ * t).norm() / t.norm();
        }
        scale_[r] = length_ratio_[r] * before.scale[r];
    }
}

SixNodeFace GrownSix::face() const {
    std::array<std::array<Vec3, 3>, 6> tangents;
    for (int p = 0; p < 6; ++p)
        for (int i = 0; i < 3; ++i) tangents[p][i] = with_zero_z(growth_ * interior_points_[p].along[i]);
    std::array<double, 9> scale;
    for (int r = 0; r < 9; ++r) scale[r] = scale_[r];
    return {tangents, scale};
}

Vec9 GrownSix::squared_lengths() const {
    Vec9 lengths;
    for (int i = 0; i < 3; ++i) {
        for (int g = 0; g < 2; ++g)
            lengths[3 * i + g] = (growth_ * at_gauss_[2 * i + g].along[i]).squaredNorm();
        lengths[3 * i + 2] = 0.0;
        for (int m = 0; m < 3; ++m)
            lengths[3 * i + 2] += (growth_ * at_middle_[m].along[i]).squaredNorm() / 3.0;
    }
    return lengths;
}

Vec9 GrownSix::curvature_measures() const {
    Vec9 measures = Vec9::Zero();
    for (int p = 0; p < 6; ++p) {
        const std::array<Eigen::Vector2d, 3>& t = interior_points_[p].along;
        const double jacobian = determinant_ * std::abs(t[0].x() * t[1].y() - t[0].y() * t[1].x());
        for (int r = 0; r < 9; ++r) {
            const Eigen::Vector2d tj = growth_ * t[(r / 3 + 1) % 3], tk = growth_ * t[(r / 3 + 2) % 3];
            measures[r] -= scale_[r] * 0.5 * six_nodes::inside[p].weight * test_at(r, p) / jacobian *
                           tj.dot(curvature_ * tk);
        }
    }
    return measures;
}

std::array<Vec3, 3> GrownSix::grown_tangents(const std::array<double, 3>& at) const {
    const TangentPoint point(rest_, axes_.col(0), at);
    std::array<Vec3, 3> grown;
    for (int i = 0; i < 3; ++i) grown[i] = point.axes * (growth_ * point.along[i]);
    return grown;
}

Mat2 GrownSix::membrane_by_growth(const ShellMaterial& m, const Vec9& r, const Vec9& d) const {
    Mat2 sum = Mat2::Zero();
    for (int p = 0; p < 6; ++p) {
        const Eigen::Matrix<double, 3, 9> rows = membrane_interpolation(six_nodes::inside[p].at);
        sum += six_nodes::inside[p].weight *
               GrownTriangle(interior_points_[p].along, growth_).membrane_by_growth(m, rows * r, rows * d);
    }
    return sum;
}

// The work r . C d equals r_ . S d_ with the moments r_ = C r and d_ = C d and the compliance S = C^-1, so for
// fixed r and d its change is - r_ . dS d_. At a point S is f w/2 J' (b_p tr(M_r M_d) + b_t tr M_r tr M_d),
// with moments M = sum_a s'_a psi_a m_a T'_i and T' = G T~ G / det^2.
Mat2 GrownSix::bending_by_growth(const ShellMaterial& m, const Vec9& r, const Vec9& d) const {
    const Mat9 stiffness = face().bending_stiffness(m);
    const Vec9 of_r = stiffness * r, of_d = stiffness * d;
    Mat2 sum = Mat2::Zero();
    for (int p = 0; p < 6; ++p) {
        const Moments at = moments(m, p, of_r, of_d);
        const Mat2 both = inverse_ * (at.of_r * at.strain_d + at.of_d * at.strain_r);
        sum += both + both.transpose() - 3.0 * at.of_r.cwiseProduct(at.strain_d).sum() * inverse_;
    }
    // S d_ equals d.
    return -sum - length_ratio_by_growth(of_r.cwiseProduct(d) + of_d.cwiseProduct(r));
}

GrownSix::Moments GrownSix::moments(const ShellMaterial& m, int p, const Vec9& of_r, const Vec9& of_d) const {
    const double factor = 12.0 / (m.young_modulus * m.thickness * m.thickness * m.thickness);
    std::array<Eigen::Vector2d, 3> t;
    for (int i = 0; i < 3; ++i) t[i] = growth_ * interior_points_[p].along[i];
    const double jacobian = std::abs(t[0].x() * t[1].y() - t[0].y() * t[1].x());
    Moments at{Mat2::Zero(), Mat2::Zero(), Mat2::Zero(), Mat2::Zero()};
    for (int a = 0; a < 9; ++a) {
        const Mat2 direction =
            -symmetric_product(t[(a / 3 + 1) % 3], t[(a / 3 + 2) % 3]) / (jacobian * jacobian);
        at.of_r += scale_[a] * test_at(a, p) * of_r[a] * direction;
        at.of_d += scale_[a] * test_at(a, p) * of_d[a] * direction;
    }
    const double weight = factor * 0.5 * six_nodes::inside[p].weight * jacobian;
    const auto strain = [&](const Mat2& moment) -> Mat2 {
        return weight *
               ((1.0 + m.poisson_ratio) * moment - m.poisson_ratio * moment.trace() * Mat2::Identity());
    };
    at.strain_r = strain(at.of_r);
    at.strain_d = strain(at.of_d);
    return at;
}

Mat2 GrownSix::compliance_by_deformation(const ShellMaterial& m, int p, const Vec9& of_r,
                                         const Vec9& of_d) const {
    const Moments at = moments(m, p, of_r, of_d);
    const Mat2 both = at.of_r * at.strain_d + at.of_d * at.strain_r;
    return both + both.transpose() - 3.0 * at.of_r.cwiseProduct(at.strain_d).sum() * Mat2::Identity();
}

double GrownSix::jacobian(int p) const {
    const std::array<Eigen::Vector2d, 3>& t = interior_points_[p].along;
    return determinant_ * std::abs(t[0].x() * t[1].y() - t[0].y() * t[1].x());
}

double GrownSix::curvature_weight(int r, int p) const {
    return -scale_[r] * 0.5 * six_nodes::inside[p].weight * test_at(r, p) / jacobian(p);
}

Mat2 GrownSix::length_ratio_by_growth(const Vec9& by_logarithm) const {
    Mat2 sum = Mat2::Zero();
    for (int i = 0; i < 3; ++i)
        for (int g = 0; g < 2; ++g) {
            const Eigen::Vector2d& t = at_gauss_[2 * i + g].along[i];
            const Eigen::Vector2d grown = growth_ * t;
            sum += by_logarithm[3 * i + g] / grown.squaredNorm() * symmetric_product(grown, t);
        }
    return sum;
}

Mat2 GrownSix::lengths_by_growth(const Vec9& by) const {
    Mat2 sum = Mat2::Zero();
    for (int i = 0; i < 3; ++i) {
        for (int g = 0; g < 2; ++g) {
            const Eigen::Vector2d& t = at_gauss_[2 * i + g].along[i];
            sum += 2.0 * by[3 * i + g] * symmetric_product(growth_ * t, t);
        }
        for (int m = 0; m < 3; ++m) {
            const Eigen::Vector2d& t = at_middle_[m].along[i];
            sum += 2.0 / 3.0 * by[3 * i + 2] * symmetric_product(growth_ * t, t);
        }
    }
    return sum;
}

Mat2 GrownSix::interior_by_growth(const Vec9& by, const Vec9& interior) const {
    const Vec9 work = by.cwiseProduct(interior);
    return length_ratio_by_growth(work) - work.sum() * inverse_;
}

GrownFace::ByNatural GrownSix::natural_by_growth(const Vec9& by, const Vec9& rest) const {
    const Vec9 of_rest = by.cwiseProduct(rest).cwiseProduct(reference_factors()),
               of_curvature = by.cwiseProduct(curvature_measures());
    GrownFace::ByNatural sum{length_ratio_by_growth(of_rest + of_curvature) -
                                 (0.5 * of_rest.sum() + of_curvature.sum()) * inverse_,
                             Mat2::Zero()};
    for (int p = 0; p < 6; ++p) {
        const std::array<Eigen::Vector2d, 3>& t = interior_points_[p].along;
        const double jacobian = determinant_ * std::abs(t[0].x() * t[1].y() - t[0].y() * t[1].x());
        for (int i = 0; i < 3; ++i) {
            double weight = 0.0;
            for (int r = 3 * i; r < 3 * i + 3; ++r)
                weight -= by[r] * scale_[r] * 0.5 * six_nodes::inside[p].weight * test_at(r, p) / jacobian;
            const Eigen::Vector2d &j = t[(i + 1) % 3], &k = t[(i + 2) % 3];
            const Eigen::Vector2d tj = growth_ * j, tk = growth_ * k;
            sum.growth +=
                weight * (symmetric_product(curvature_ * tk, j) + symmetric_product(curvature_ * tj, k));
            sum.curvature += weight * symmetric_product(tj, tk);
        }
    }
    return sum;
}

}  // namespace magshell
