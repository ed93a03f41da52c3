// A triangle that moves through water: its shape now, and the flow relative to it.
#pragma once

#include <array>
#include <limits>

#include "magshell/core/types.h"

namespace magshell {

struct MovingFace {
    using Corners = std::array<Vec3, 3>;

    Corners opposite;  // a_k, the edge opposite corner k: x_{k+2} - x_{k+1} [m]
    double area;       // A [m2]
    Vec3 normal;       // n, of the face's own orientation; zero where the face has no area
    Vec3 flow;         // u: the velocity of the water minus the mean velocity of the corners [m/s]

    MovingFace(const Vec3& water_velocity, const Corners& positions, const Corners& velocities)
        : flow(water_velocity - mean(velocities)) {
        for (int k = 0; k < 3; ++k) opposite[k] = positions[(k + 2) % 3] - positions[(k + 1) % 3];
        const Vec3 across = opposite[0].cross(opposite[1]);
        area = 0.5 * across.norm();
        normal = reciprocal(2.0 * area) * across;
    }

    /// Returns the derivative by the position of corner k of a vector, from that by N = 2 A n: dN = a_k x dx_k.
    Mat3 by_corner(const Mat3& by_across, int k) const { return times_cross(by_across, opposite[k]); }

    /// Returns M [a]x, where [a]x b = a x b.
    static Mat3 times_cross(const Mat3& m, const Vec3& a) {
        Mat3 product;
        product.col(0) = m.col(1) * a.z() - m.col(2) * a.y();
        product.col(1) = m.col(2) * a.x() - m.col(0) * a.z();
        product.col(2) = m.col(0) * a.y() - m.col(1) * a.x();
        return product;
    }
    /// Returns the mean; it is exact where all three are equal, so that no force acts on a face that moves with
    /// the water.
    static Vec3 mean(const Corners& c) { return c[0] + ((c[1] - c[0]) + (c[2] - c[0])) / 3.0; }
    /// Returns 1 / x, or 0 where x is zero.
    static double reciprocal(double x) { return x > std::numeric_limits<double>::min() ? 1.0 / x : 0.0; }
};

}  // namespace magshell
