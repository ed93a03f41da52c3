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
    void build_blocks(std::span<const double> heights);
    Pair scan(const Vec3& point, const Pair& start) const;
    Pair nearest(const Vec3& point, Pair at) const;

    Pair origin_, spacing_;
    std::array<Index, 2> samples_;
    std::vector<double> coefficients_;
    double steepest_, sharpest_;  // bounds of |dh| and of the eigenvalues of d2h [1/m]

    // Squares of knots, with the range of their heights: what a scan can leave out.
    struct Block {
        std::array<Index, 2> first, last;
        double low, high;
    };
    std::vector<Block> blocks_;
    std::vector<double> heights_;
};

}  // namespace magshell
