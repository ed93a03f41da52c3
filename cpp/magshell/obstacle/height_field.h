// HeightField: an obstacle that fills the space below a surface z = h(x, y).
//
// h interpolates heights on a regular grid by bicubic splines. Beyond the border the last coefficients are
// repeated, so that h stays twice continuously differentiable and, two cells beyond the border, no longer changes
// along the axis that leaves the grid. The distance is that to the nearest point p of the surface, where
// D = |x - p|^2 / 2 is smallest: Newton's method finds it, from the point below x if D is convex there, otherwise
// from the nearest point of the bilinear surface through the knots.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "magshell/obstacle/obstacle.h"

namespace magshell {

class HeightField final : public Obstacle {
  public:
    using Pair = Eigen::Vector2d;

    /// Creates the surface. heights [m] in C order, [i, j] at origin + (i, j) * spacing; at least two samples
    /// along each axis.
    HeightField(const Pair& origin, const Pair& spacing, const std::array<Index, 2>& samples,
                std::span<const double> heights);

    Distance distance(const Vec3& point) const override;

  private:
    struct Ground {
        double height;
        Pair slope;
        Eigen::Matrix2d bend;  // second derivatives [1/m]
    };
    Ground ground(const Pair& at) const;

    void bound_derivatives();
    void build_blocks();
    Pair nearest(const Vec3& point, Pair at) const;

    Pair origin_, spacing_;
    std::array<Index, 2> samples_;
    std::vector<double> coefficients_;
    double steepest_, sharpest_;  // bounds of |dh| [-] and of the eigenvalues of d2h [1/m]

    // The bilinear surface on which a scan looks for the start of Newton's method: heights of the knots, including
    // those beyond the border until the surface is level, and blocks of cells with the range of the heights of their
    // knots, by which blocks can be skipped.
    struct Range {
        double low, high;
        double clamp(double x) const { return x < low ? low : x > high ? high : x; }
    };
    struct Block {
        std::array<Index, 2> first, last;  // first and last knots of the block
        double low, high;
    };
    double knot(int axis, Index i) const;
    // Returns the range of a coordinate between two knots; infinite at the border.
    Range range(int axis, Index first, Index last) const;
    // Returns a lower bound of the squared distance to a block of the bilinear surface.
    double squared_bound(const Block& block, const Vec3& point) const;
    void scan_block(const Block& block, const Vec3& point, double& least, Pair& best) const;
    Pair scan(const Vec3& point, const Pair& start, double gap) const;
    std::vector<double> knots_;
    std::vector<Block> blocks_;
};

}  // namespace magshell
