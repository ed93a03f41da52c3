// ParallelEdges: a mollifier that lets the energy of two edges vanish smoothly as they become parallel, because
// their closest points jump from one end to the other there.                                     [Li et al.
// 2020] (IPC), 24
//
//   c = |a x b|^2,   m = (2 - c/e) c/e up to c = e, 1 beyond,   a = x_1 - x_0, b = x_3 - x_2
//
// e is 1e-3 times the product of the squared reference lengths: angles below 1.8 degrees. Next to parallel
// edges, pairs of a point and a triangle provide the missing energy.
#pragma once

#include "magshell/contact/proximity.h"

namespace magshell {

/// m and its derivatives with respect to the edges a and b; those with respect to nodes are the same with the signs - + - +.
struct ParallelEdges {
    double factor = 1.0;             // m
    bool acts = false;               // true if the derivatives are not zero
    double slope = 0.0, bend = 0.0;  // dm/dc, d2m/dc2
    Vec3 by_one, by_two;             // dc/da, dc/db
    Vec3 one, two, normal;           // a, b, and a unit direction perpendicular to both
    double area = 0.0;               // |a x b|

    /// Computes the mollifier. below: e [m4]; 0 for none.
    ParallelEdges(const PairPositions& x, double below) {
        if (!(below > 0.0)) return;
        one = x[1] - x[0];
        two = x[3] - x[2];
        normal = one.cross(two);
        const double squared = normal.squaredNorm(), y = squared / below;
        if (y >= 1.0) return;
        acts = true;
        factor = (2.0 - y) * y;
        slope = 2.0 * (1.0 - y) / below;
        bend = -2.0 / (below * below);
        by_one = 2.0 * two.cross(normal);
        by_two = 2.0 * normal.cross(one);
        area = std::sqrt(squared);
        if (area > 0.0)
            normal /= area;
        else
            normal = one.unitOrthogonal();
    }

    /// The second derivatives of c: by a twice, by a (rows) and b, by b twice. project_psd: projected to be
    /// positive semidefinite.
    struct Second {
        Mat3 one, mixed, two;
    };
    Second second(bool project_psd) const {
        // In the plane of a and b, c is the square of the area A, whose second derivatives have the eigenvalues
        // 1 and -1; perpendicular to it they are 2 (|b|^2, - a . b; |a|^2), which is positive semidefinite.
        const Mat3 across = 2.0 * normal * normal.transpose();
        const Vec3 area_by_one = two.cross(normal), area_by_two = normal.cross(one);
        Mat3 turned;  // - [n]
        turned << 0.0, normal.z(), -normal.y(), -normal.z(), 0.0, normal.x(), normal.y(), -normal.x(), 0.0;
        const double both = one.dot(two);
        Second c{two.squaredNorm() * across + 2.0 * area_by_one * area_by_one.transpose(),
                 -both * across + 2.0 * area_by_one * area_by_two.transpose(),
                 one.squaredNorm() * across + 2.0 * area_by_two * area_by_two.transpose()};
        c.mixed += (project_psd ? 1.0 : 2.0) * area * turned;
        if (project_psd) {
            const Mat3 within = area * (Mat3::Identity() - 0.5 * across);
            c.one += within;
            c.two += within;
        }
        return c;
    }
};

}  // namespace magshell
