#include "magshell/energy/grown_face.h"

namespace magshell {
namespace {

Eigen::Matrix<double, 3, 2> axes_of(const std::array<Vec3, 3>& x) {
    const Vec3 edge = x[2] - x[1], across = edge.cross(x[0] - x[2]);
    Eigen::Matrix<double, 3, 2> axes;
    axes.col(0) = edge.normalized();
    axes.col(1) = across.normalized().cross(axes.col(0));
    return axes;
}

std::array<Eigen::Vector2d, 3> edges_in(const Eigen::Matrix<double, 3, 2>& axes,
                                        const std::array<Vec3, 3>& x) {
    return {axes.transpose() * (x[2] - x[1]), axes.transpose() * (x[0] - x[2]),
            axes.transpose() * (x[1] - x[0])};
}

}  // namespace

// Derivatives of the work A' e(r) : s(d), with strain tensors e(d) = sum_i d_i measure_i and their stresses
// s(d).
struct GrownTriangle::Work {
    Vec3 on_r, on_d;  // A' measure_i : s(d) and A' measure_i : s(r)
    double total;
    Mat2 by_growth;  // both e change as G^-1 e G^-1, the area as det G
};

GrownTriangle::Work GrownTriangle::work(const std::array<Mat2, 3>& measures, double modulus, double nu,
                                        const Vec3& r, const Vec3& d) const {
    Mat2 of_r = Mat2::Zero(), of_d = Mat2::Zero();
    for (int i = 0; i < 3; ++i) {
        of_r += r[i] * measures[i];
        of_d += d[i] * measures[i];
    }
    const auto stress = [&](const Mat2& e) -> Mat2 {
        return face.area * modulus / (1.0 - nu * nu) * ((1.0 - nu) * e + nu * e.trace() * Mat2::Identity());
    };
    const Mat2 stress_r = stress(of_r), stress_d = stress(of_d);
    Work work;
    for (int i = 0; i < 3; ++i) {
        work.on_r[i] = measures[i].cwiseProduct(stress_d).sum();
        work.on_d[i] = measures[i].cwiseProduct(stress_r).sum();
    }
    work.total = of_r.cwiseProduct(stress_d).sum();
    const Mat2 both = (of_r * stress_d + of_d * stress_r) * inverse;
    work.by_growth = work.total * inverse - both - both.transpose();
    return work;
}

Mat2 GrownTriangle::membrane_by_growth(const ShellMaterial& m, const Vec3& r, const Vec3& d) const {
    return work(face.membrane_measures(), m.young_modulus * m.thickness, m.poisson_ratio, r, d).by_growth;
}

// R'_i = det G / (A~ l'_i) G^-1 (t~_i (x) t~_i) G^-1, with the rotated edges t~_i.
Mat2 GrownTriangle::bending_by_growth(const ShellMaterial& m, const Vec3& r, const Vec3& d) const {
    const double modulus = m.young_modulus * m.thickness * m.thickness * m.thickness / 12.0;
    const Work found = work(face.bending_measures(), modulus, m.poisson_ratio, r, d);
    Mat2 by_growth = found.by_growth + 2.0 * found.total * inverse;
    for (int i = 0; i < 3; ++i)
        by_growth -= (r[i] * found.on_r[i] + d[i] * found.on_d[i]) * relative_length_by_growth(i);
    return by_growth;
}

GrownFace::GrownFace(const std::array<Vec3, 3>& rest, const Mat3& growth, const Mat3& curvature)
    : axes_(axes_of(rest)),
      triangle_(edges_in(axes_, rest), axes_.transpose() * growth * axes_),
      curvature_(axes_.transpose() * curvature * axes_) {}

std::array<Vec3, 3> GrownFace::corners() const {
    const std::array<Eigen::Vector2d, 3>& t = triangle_.grown;
    const auto at = [](const Eigen::Vector2d& place) { return Vec3(place.x(), place.y(), 0.0); };
    return {at(-t[2]), Vec3::Zero(), at(t[0])};
}

Vec3 GrownFace::squared_lengths() const {
    return {triangle_.grown[0].squaredNorm(), triangle_.grown[1].squaredNorm(),
            triangle_.grown[2].squaredNorm()};
}

Vec3 GrownFace::natural_angle_changes(const Vec3& rest_angles) const {
    Vec3 natural_angle_changes;
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector2d &tj = triangle_.grown[(i + 1) % 3], &tk = triangle_.grown[(i + 2) % 3];
        const double length = face().edge_length[i];
        natural_angle_changes[i] =
            rest_angles[i] * (lengthened(i) - 1.0) - length / (4.0 * face().area) * tj.dot(curvature_ * tk);
    }
    return natural_angle_changes;
}

GrownFace::ByNatural GrownFace::natural_angle_changes_vjp(const Vec3& rest_angles, const Vec3& by) const {
    ByNatural sum{Mat2::Zero(), Mat2::Zero()};
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Eigen::Vector2d &tj = triangle_.grown[j], &tk = triangle_.grown[k];
        const double length = face().edge_length[i], over = length / (4.0 * face().area);
        const double share = lengthened(i);
        const double bent = over * tj.dot(curvature_ * tk);
        const Mat2 stretched = triangle_.relative_length_by_growth(i);
        sum.growth += by[i] * (rest_angles[i] * share * (stretched - 0.5 * triangle_.inverse) -
                               bent * (stretched - triangle_.inverse) -
                               over * (symmetric_product(curvature_ * tk, triangle_.edge[j]) +
                                       symmetric_product(curvature_ * tj, triangle_.edge[k])));
        sum.curvature -= by[i] * over * symmetric_product(tj, tk);
    }
    return sum;
}

// With dt~ = H t~ and dt' = G H t~, the area A' changes by tr H, and det G stays.
GrownFace::ByRest GrownFace::natural_angle_changes_by_rest(const Vec3& rest_angles, const Vec3& by) const {
    ByRest sum{Mat2::Zero(), Vec3::Zero()};
    const Mat2& growth = triangle_.growth;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const std::array<Eigen::Vector2d, 3>&edge = triangle_.edge, &grown = triangle_.grown;
        const double over = face().edge_length[i] / (4.0 * face().area), share = lengthened(i);
        const double bent = over * grown[j].dot(curvature_ * grown[k]);
        const Mat2 stretched = growth * grown[i] * edge[i].transpose() / grown[i].squaredNorm(),
                   at_rest = edge[i] * edge[i].transpose() / edge[i].squaredNorm();
        sum.deformation +=
            by[i] *
            (rest_angles[i] * share * (stretched - at_rest) - bent * (stretched - Mat2::Identity()) -
             over * growth *
                 (curvature_ * grown[k] * edge[j].transpose() + curvature_ * grown[j] * edge[k].transpose()));
        sum.angles[i] = by[i] * (share - 1.0);
    }
    return sum;
}

}  // namespace magshell
