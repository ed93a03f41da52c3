#include "magshell/energy/six_node_face.h"

#include <Eigen/Cholesky>

#include "magshell/strain/six_nodes.h"

namespace magshell {

using Row9 = Eigen::Matrix<double, 3, 9>;

// Returns, for each direction, the linear function with these two values on its edge and this mean over the
// face.
Row9 membrane_interpolation(const std::array<double, 3>& at) {
    Row9 rows = Row9::Zero();
    for (int i = 0; i < 3; ++i) {
        // A linear function is given by its values at the corners, whose mean is its mean over the face. test()
        // gives both Gauss functions of an edge; the mean of each over the face is 1/3.
        for (int g = 0; g < 2; ++g) rows(i, 3 * i + g) = six_nodes::test(i, g, at) - at[i];
        rows(i, 3 * i + 2) = 3.0 * at[i];
    }
    return rows;
}

SixNodeFace::SixNodeFace(const std::array<std::array<Vec3, 3>, 6>& tangents,
                         const std::array<double, 9>& scale_)
    : scale(scale_), tangents_(tangents) {
    measure_area();
}

void SixNodeFace::measure_area() {
    for (int p = 0; p < 6; ++p) {
        const double jacobian = tangents_[p][0].cross(tangents_[p][1]).norm();
        inverse_jacobian[p] = 1.0 / jacobian;
        area += 0.5 * six_nodes::inside[p].weight * jacobian;
    }
}

SixNodeFace::SixNodeFace(std::array<Vec3, 6> rest) {
    const Vec3 first = rest[0];  // differences keep their digits far from the origin
    for (Vec3& place : rest) place -= first;
    for (int p = 0; p < 6; ++p) {
        const six_nodes::Point& point = six_nodes::inside[p];
        for (int i = 0; i < 3; ++i) {
            tangents_[p][i].setZero();
            const std::array<double, 6> by_node = six_nodes::derivative(i, point.at);
            for (int a = 0; a < 6; ++a) tangents_[p][i] += by_node[a] * rest[a];
        }
    }
    measure_area();
    for (int i = 0; i < 3; ++i) {
        const Vec3 &from = rest[(i + 1) % 3], &to = rest[(i + 2) % 3], &middle = rest[six_nodes::middle(i)];
        for (int g = 0; g < 2; ++g) {
            const std::array<double, 3> along = six_nodes::along(six_nodes::gauss[g]);
            scale[3 * i + g] = 2.0 * (along[0] * from + along[1] * to + along[2] * middle).norm();
        }
        scale[3 * i + 2] = 2.0 * (to - from).norm();
    }
}

std::array<double, 9> SixNodeFace::tests(const std::array<double, 3>& at) const {
    std::array<double, 9> values;
    for (int k = 0; k < 9; ++k) values[k] = scale[k] * six_nodes::test(k / 3, k % 3, at);
    return values;
}

template <class Stiffness>
Mat9 SixNodeFace::membrane(const Stiffness& at_point) const {
    Mat9 sum = Mat9::Zero();
    for (int p = 0; p < 6; ++p) {
        const auto& t = tangents_[p];
        // A flat face with these edges.
        const Vec3 corners[3] = {Vec3::Zero(), t[2], t[2] + t[0]};
        const Row9 rows = membrane_interpolation(six_nodes::inside[p].at);
        sum += six_nodes::inside[p].weight * rows.transpose() * at_point(RestFace(corners)) * rows;
    }
    return sum;
}

Mat9 SixNodeFace::membrane_stiffness(const ShellMaterial& m) const {
    return membrane([&](const RestFace& face) { return face.membrane_stiffness(m); });
}

Mat9 SixNodeFace::membrane_by_poisson_ratio(const ShellMaterial& m) const {
    return membrane([&](const RestFace& face) { return face.membrane_by_poisson_ratio(m); });
}

// Integrates 12 / (Y h^3) (by_products tr(P_i P_l) + by_traces tr P_i tr P_l) against the test functions.
Mat9 SixNodeFace::compliance(double factor, double by_products, double by_traces) const {
    Mat9 sum = Mat9::Zero();
    for (int p = 0; p < 6; ++p) {
        const six_nodes::Point& point = six_nodes::inside[p];
        const auto& t = tangents_[p];
        const double jacobian = 1.0 / inverse_jacobian[p];
        Mat3 inner;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) inner(i, j) = t[i].dot(t[j]);
        const std::array<double, 9> tests = this->tests(point.at);
        Mat3 of_directions;
        for (int i = 0; i < 3; ++i)
            for (int l = 0; l < 3; ++l) {
                const int j = (i + 1) % 3, k = (i + 2) % 3, m = (l + 1) % 3, n = (l + 2) % 3;
                const double products = 0.5 * (inner(j, m) * inner(k, n) + inner(j, n) * inner(k, m));
                of_directions(i, l) = by_products * products + by_traces * inner(j, k) * inner(m, n);
            }
        const double weight = factor * 0.5 * point.weight / (jacobian * jacobian * jacobian);
        for (int a = 0; a < 9; ++a)
            for (int b = 0; b < 9; ++b)
                sum(a, b) += weight * tests[a] * tests[b] * of_directions(a / 3, b / 3);
    }
    return sum;
}

Mat9 SixNodeFace::bending_stiffness(const ShellMaterial& m) const {
    const double cubed = m.thickness * m.thickness * m.thickness;
    return compliance(12.0 / (m.young_modulus * cubed), 1.0 + m.poisson_ratio, -m.poisson_ratio)
        .llt()
        .solve(Mat9::Identity());
}

Mat9 SixNodeFace::bending_by_poisson_ratio(const ShellMaterial& m) const {
    const double cubed = m.thickness * m.thickness * m.thickness;
    const Mat9 stiffness = bending_stiffness(m);
    return -stiffness * compliance(12.0 / (m.young_modulus * cubed), 1.0, -1.0) * stiffness;
}

}  // namespace magshell
