#include "magshell/energy/grown_six_rest.h"

#include <Eigen/LU>

#include "magshell/energy/rest_corners.h"
#include "magshell/strain/six_nodes.h"

namespace magshell {
namespace {

// Adds the gradient with respect to the components of tangents in the axes of a point to that with respect to the nodes, and returns that
// with respect to the first edge of the corners, which is `first`.
Vec3 add_point(const TangentPoint& point, const std::array<double, 3>& at, const Vec3& first,
               const std::array<Eigen::Vector2d, 3>& by, std::array<Vec3, 6>& out) {
    const Vec3 a = point.axes.col(0), b = point.axes.col(1), n = a.cross(b);
    double turned = 0.0;
    for (int i = 0; i < 3; ++i) turned += by[i].x() * point.along[i].y() - by[i].y() * point.along[i].x();
    turned /= first.dot(a);
    Mat2 tangents;
    tangents << point.along[0], point.along[1];
    const Eigen::Vector2d of_b = tangents.inverse().col(1);
    for (int i = 0; i < 3; ++i) {
        Vec3 by_tangent = point.axes * by[i];
        if (i < 2) by_tangent += turned * first.dot(n) * of_b[i] * n;
        const std::array<double, 6> by_node = six_nodes::derivative(i, at);
        for (int k = 0; k < 6; ++k) out[k] += by_node[k] * by_tangent;
    }
    return turned * b;
}

// Adds the gradient with respect to the components of a symmetric tensor that is fixed in space, in the axes of the corners' plane, to that
// with respect to the corners, and returns that with respect to the first edge.
Vec3 add_tensor(const Eigen::Matrix<double, 3, 2>& axes, const Vec3& first, const RestShape& corners,
                const Mat3& tensor, const Mat2& by, std::array<Vec3, 6>& out) {
    const Vec3 a = axes.col(0), b = axes.col(1), n = a.cross(b);
    const Eigen::Matrix<double, 3, 2> by_axes = tensor * axes * (by + by.transpose());
    for (int k = 0; k < 3; ++k) out[k] += n.dot(by_axes.col(1)) * b.dot(corners.gradients[k]) * n;
    return ((b.dot(by_axes.col(0)) - a.dot(by_axes.col(1))) * b + n.dot(by_axes.col(0)) * n) / first.norm();
}

}  // namespace

void GrownSixRest::add_grown(const TangentPoint& point, const Tangents& by_grown, Tangents& by_along) {
    for (int i = 0; i < 3; ++i) {
        by_along[i] += face_.growth() * by_grown[i];
        by_growth_ += symmetric_product(by_grown[i], point.along[i]);
    }
}

// With du = H u for all grown tangents u, S : H = (S U^-T) : dU for the matrix U of two of them.
void GrownSixRest::add_deformation(int point, const Mat2& by) {
    const TangentPoint& at = face_.interior_points()[point];
    Mat2 grown;
    grown << face_.growth() * at.along[0], face_.growth() * at.along[1];
    const Mat2 by_two = by * grown.inverse().transpose();
    add_grown(at, {by_two.col(0), by_two.col(1), Eigen::Vector2d::Zero()}, by_interior_[point]);
}

void GrownSixRest::add_lengths(const Vec9& by) {
    const auto add = [&](const TangentPoint& point, int i, double by_square, Tangents& by_along) {
        Tangents by_grown;
        by_grown.fill(Eigen::Vector2d::Zero());
        by_grown[i] = 2.0 * by_square * face_.growth() * point.along[i];
        add_grown(point, by_grown, by_along);
    };
    for (int i = 0; i < 3; ++i) {
        for (int g = 0; g < 2; ++g) add(face_.at_gauss()[2 * i + g], i, by[3 * i + g], by_gauss_[2 * i + g]);
        for (int m = 0; m < 3; ++m) add(face_.at_middle()[m], i, by[3 * i + 2] / 3.0, by_middle_[m]);
    }
}

void GrownSixRest::add_membrane(const ShellMaterial& m, const Vec9& r, const Vec9& d) {
    for (int p = 0; p < 6; ++p) {
        const Eigen::Matrix<double, 3, 9> rows = membrane_interpolation(six_nodes::inside[p].at);
        const GrownTriangle triangle(face_.interior_points()[p].along, face_.growth());
        add_deformation(
            p, six_nodes::inside[p].weight * triangle.natural().membrane_by_growth(m, rows * r, rows * d));
    }
}

// The formula is that of GrownSix::bending_by_growth, by a deformation of the grown triangle.
void GrownSixRest::add_compliance(const ShellMaterial& m, const Vec9& of_r, const Vec9& of_d) {
    for (int p = 0; p < 6; ++p) add_deformation(p, -face_.compliance_by_deformation(m, p, of_r, of_d));
}

void GrownSixRest::add_inverse_jacobian(int point, double by) {
    const TangentPoint& at = face_.interior_points()[point];
    const double jacobian =
        face_.determinant() * std::abs(at.along[0].x() * at.along[1].y() - at.along[0].y() * at.along[1].x());
    add_deformation(point, -by / jacobian * Mat2::Identity());
}

void GrownSixRest::add_length_ratio(const Vec9& by_logarithm) {
    for (int i = 0; i < 3; ++i)
        for (int g = 0; g < 2; ++g) {
            const double by = by_logarithm[3 * i + g];
            const TangentPoint& point = face_.at_gauss()[2 * i + g];
            const Eigen::Vector2d &along = point.along[i], grown = face_.growth() * along;
            Tangents by_grown;
            by_grown.fill(Eigen::Vector2d::Zero());
            by_grown[i] = by / grown.squaredNorm() * grown;
            add_grown(point, by_grown, by_gauss_[2 * i + g]);
            by_gauss_[2 * i + g][i] -= by / along.squaredNorm() * along;
        }
}

void GrownSixRest::add_scale(const Vec9& by_logarithm) {
    add_length_ratio(by_logarithm);
    by_log_length_ += by_logarithm;
}

void GrownSixRest::add_natural(const Vec9& by, const Vec9& rest) {
    const Vec9 of_rest = by.cwiseProduct(rest).cwiseProduct(face_.reference_factors());
    add_length_ratio(of_rest);
    by_growth_ -= 0.5 * of_rest.sum() * face_.growth().inverse();
    add_scale(by.cwiseProduct(face_.curvature_measures()));
    for (int p = 0; p < 6; ++p) {
        const TangentPoint& point = face_.interior_points()[p];
        Tangents grown, by_grown;
        for (int i = 0; i < 3; ++i) grown[i] = face_.growth() * point.along[i];
        by_grown.fill(Eigen::Vector2d::Zero());
        double total = 0.0;
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            double weight = 0.0;
            for (int a = 3 * i; a < 3 * i + 3; ++a) weight += by[a] * face_.curvature_weight(a, p);
            by_grown[j] += weight * face_.curvature() * grown[k];
            by_grown[k] += weight * face_.curvature() * grown[j];
            by_curvature_ += weight * symmetric_product(grown[j], grown[k]);
            total += weight * grown[j].dot(face_.curvature() * grown[k]);
        }
        add_grown(point, by_grown, by_interior_[p]);
        add_deformation(p, -total * Mat2::Identity());  // through the Jacobian
    }
}

std::array<Vec3, 6> GrownSixRest::nodes(const Mat3& growth, const Mat3& curvature, Vec9& by_lengths) const {
    const std::array<Vec3, 6>& rest = face_.rest();
    const Vec3 first = rest[2] - rest[1];
    std::array<Vec3, 6> out;
    out.fill(Vec3::Zero());
    const RestShape corners({rest[0], rest[1], rest[2]});
    Vec3 by_first = add_tensor(face_.axes(), first, corners, growth, by_growth_, out) +
                    add_tensor(face_.axes(), first, corners, curvature, by_curvature_, out);
    for (int p = 0; p < 6; ++p)
        by_first +=
            add_point(face_.interior_points()[p], six_nodes::inside[p].at, first, by_interior_[p], out);
    for (int i = 0; i < 3; ++i)
        for (int g = 0; g < 2; ++g)
            by_first += add_point(face_.at_gauss()[2 * i + g], GrownSix::gauss_point(i, g), first,
                                  by_gauss_[2 * i + g], out);
    for (int m = 0; m < 3; ++m)
        by_first += add_point(face_.at_middle()[m], GrownSix::middle_point(m), first, by_middle_[m], out);
    out[1] -= by_first;
    out[2] += by_first;
    const SixNodeFace before(rest);
    for (int r = 0; r < 9; ++r) by_lengths[r] = by_log_length_[r] / before.scale[r];
    return out;
}

}  // namespace magshell
