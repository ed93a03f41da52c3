// The constant stiffness C of the strain measures of a linear triangle, from its reference shape and material.
//
// St. Venant-Kirchhoff in plane stress; t~_i is the reference edge i rotated by 90 degrees in the plane of the
// face.
//   membrane  S_i = - (t~_j (x) t~_k + t~_k (x) t~_j) / (16 A~^2), Green's strain is sum_i S_i s_i
//                                                                    [Chen22] (18), (22)
//             C_ij = Y A~ h / (1 - nu^2) ((1 - nu) tr(S_i S_j) + nu tr S_i tr S_j)
//   bending   R_i = t~_i (x) t~_i / (A~ l~_i)                        [Chen22] (19), (23)
//             C_ij = Y A~ h^3 / (12 (1 - nu^2)) ((1 - nu) tr(R_i R_j) + nu tr R_i tr R_j)
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "magshell/core/types.h"

namespace magshell {

struct ShellMaterial {
    double thickness, young_modulus, poisson_ratio;
};

/// A face of the reference shape in its plane: its rotated edges, their lengths [m] and its area [m2].
struct RestFace {
    Eigen::Vector2d turned_edge[3];
    double edge_length[3];
    double area;

    explicit RestFace(const Vec3 x[3]) {
        const Vec3 edge[3] = {x[2] - x[1], x[0] - x[2], x[1] - x[0]};
        const Vec3 across = edge[0].cross(edge[1]);
        area = 0.5 * across.norm();
        const Vec3 e1 = edge[0].normalized(), e2 = across.normalized().cross(e1);
        for (int i = 0; i < 3; ++i) {
            turned_edge[i] = {edge[i].dot(e2), -edge[i].dot(e1)};
            edge_length[i] = edge[i].norm();
        }
    }

    /// Creates the face from its edges in axes of its plane.
    explicit RestFace(const std::array<Eigen::Vector2d, 3>& edge)
        : area(0.5 * std::abs(edge[0].x() * edge[1].y() - edge[0].y() * edge[1].x())) {
        for (int i = 0; i < 3; ++i) {
            turned_edge[i] = {edge[i].y(), -edge[i].x()};
            edge_length[i] = edge[i].norm();
        }
    }

    Mat3 membrane_stiffness(const ShellMaterial& m) const { return membrane(m).stiffness(m.poisson_ratio); }
    Mat3 bending_stiffness(const ShellMaterial& m) const { return bending(m).stiffness(m.poisson_ratio); }

    /// Return dC/dnu. C is linear in Young's modulus, and linear (membrane) or cubic (bending) in the
    /// thickness.
    Mat3 membrane_by_poisson_ratio(const ShellMaterial& m) const {
        return membrane(m).by_poisson_ratio(m.poisson_ratio);
    }
    Mat3 bending_by_poisson_ratio(const ShellMaterial& m) const {
        return bending(m).by_poisson_ratio(m.poisson_ratio);
    }

    /// Return S_i and R_i, in axes along edge 0 and, to its left, perpendicular to it; or in the axes of the
    /// edges that the face was created from.
    std::array<Eigen::Matrix2d, 3> membrane_measures() const {
        std::array<Eigen::Matrix2d, 3> measure;
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector2d &tj = turned_edge[(i + 1) % 3], &tk = turned_edge[(i + 2) % 3];
            measure[i] = -(tj * tk.transpose() + tk * tj.transpose()) / (16.0 * area * area);
        }
        return measure;
    }
    std::array<Eigen::Matrix2d, 3> bending_measures() const {
        std::array<Eigen::Matrix2d, 3> measure;
        for (int i = 0; i < 3; ++i)
            measure[i] = turned_edge[i] * turned_edge[i].transpose() / (area * edge_length[i]);
        return measure;
    }

  private:
    // C = modulus / (1 - nu^2) ((1 - nu) products + nu traces)
    struct PlaneStress {
        Mat3 products, traces;  // tr(S_i S_j), tr S_i tr S_j
        double modulus;

        PlaneStress(const std::array<Eigen::Matrix2d, 3>& measure, double modulus_) : modulus(modulus_) {
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) {
                    products(i, j) = (measure[i] * measure[j]).trace();
                    traces(i, j) = measure[i].trace() * measure[j].trace();
                }
        }

        Mat3 stiffness(double nu) const {
            return modulus / (1.0 - nu * nu) * ((1.0 - nu) * products + nu * traces);
        }

        // Derivative of products / (1 + nu) and traces nu / (1 - nu^2).
        Mat3 by_poisson_ratio(double nu) const {
            const double both = 1.0 - nu * nu;
            return modulus *
                   ((1.0 + nu * nu) / (both * both) * traces - products / ((1.0 + nu) * (1.0 + nu)));
        }
    };

    PlaneStress membrane(const ShellMaterial& m) const {
        return {membrane_measures(), m.young_modulus * area * m.thickness};
    }

    PlaneStress bending(const ShellMaterial& m) const {
        const double cubed = m.thickness * m.thickness * m.thickness;
        return {bending_measures(), m.young_modulus * area * cubed / 12.0};
    }
};

}  // namespace magshell
