// Ground: all that lies below a surface z = h(x, y).
//
// h interpolates heights on a regular grid by bicubic splines. Beyond the border the last coefficients are
// repeated, so that h stays twice continuously differentiable and is constant along the axis that leaves the
// grid from two cells on. The distance is that to the nearest point p of the surface, in which D = |x - p|^2
// / 2 is stationary.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "magshell/obstacle/obstacle.h"

namespace magshell {

class HeightField final : public Obstacle {
  public:
    using Pair = Eigen::Vector2d;

    /// heights [m] in C order, [i, j] at origin + (i, j) * spacing; at least two samples along each axis.
    HeightField(const Pair& origin, const Pair& spacing, const std::array<Index, 2>& samples,
                std::span<const double> heights);

    Distance distance(const Vec3& point) const override;

  private:
    struct Ground {
        double height;
        Pair slope;
        Eigen::Matrix2d bend;  // second derivatives
    };
    Ground ground(const Pair& at) const;

    void bound_derivatives();
    void build_blocks();
    Pair nearest(const Vec3& point, Pair at) const;

    Pair origin_, spacing_;
    std::array<Index, 2> samples_;
    std::vector<double> coefficients_;
    double steepest_, sharpest_;  // bounds of |dh| and of the eigenvalues of d2h [1/m]

    // For the scan: heights of the knots, with those beyond the border until the ground is level, and squares
    // of cells with the range of their heights: what can be left out.
    struct Range {
        double low, high;
        double clamp(double x) const { return x < low ? low : x > high ? high : x; }
    };
    struct Block {
        std::array<Index, 2> first, last;  // knots around it
        double low, high;
    };
    double knot(int axis, Index i) const;
    Range range(int axis, Index first,
                Index last) const;  // of a coordinate between knots; without end at the border
    double squared_bound(const Block& block, const Vec3& point) const;  // of the distance to a block
    void scan_block(const Block& block, const Vec3& point, double& least, Pair& best) const;
    Pair scan(const Vec3& point, const Pair& start, double gap) const;
    std::vector<double> knots_;
    std::vector<Block> blocks_;
};

}  // namespace magshell
