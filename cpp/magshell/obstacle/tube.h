// A ball swept along a curve while its radius changes: pipes, tunnels, horns.
//
//   F(x) = min_s psi(x, s),      psi = |x - c(s)| - r(s)
//
// c and r are cubic splines. In the minimum psi_s = 0, so the gradient of F is psi_x = n = (x - c) / |x - c|, and
//
//   H = psi_xx - psi_xs psi_xs^T / psi_ss,      psi_xx = P / d,   psi_xs = - P c' / d,   P = I - n n^T
//   psi_ss = (|c'|^2 - (n . c')^2) / d - n . c'' - r''
//
// F is the distance to the union of the balls outside it, and inside as far as the centers of curvature.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "magshell/field/cubic_spline.h"
#include "magshell/obstacle/obstacle.h"

namespace magshell {

class Tube final : public Obstacle {
  public:
    /// The curve goes through the points, the radius through the radii, one a point, with one knot at each.
    /// An open tube goes on straight at both ends, with the radii of the last points, which it settles to
    /// within three knots; a closed one
    /// ends in the last balls. Throws InvalidInput where the radius is not positive, or changes as fast as
    /// the curve advances, so that one ball swallows the next.
    Tube(std::span<const Vec3> points, std::span<const double> radii, bool closed);

    Distance distance(const Vec3& point) const override;

  private:
    // The spline and its derivatives by s [knots]: center and radius.
    struct Section {
        Vec4 value, first, second;
    };
    Section section(double s) const;
    void check(double first_knot) const;

    // psi and its derivatives by s. Where the point lies on the curve, psi has a kink and no direction.
    struct Slope {
        double value, first, second;
    };
    static Slope slope_at(const Section& section, const Vec3& point);
    double nearest(const Vec3& point, Eigen::Index sample) const;
    Distance distance_at(double s, const Vec3& point) const;

    // What continues the curve of an open tube: a straight line outwards with a constant radius.
    struct Ray {
        Vec3 origin, outwards;
        double radius;
    };
    static bool beyond(const Ray& ray, const Vec3& point, double value, Distance& out);

    bool closed_;
    std::vector<Vec4> coefficients_;  // c_{i-1} ... c_{i+2} belong to the segment from knot i on
    // Of center and radius, several a segment, a column a coordinate: the search through them is most of the work.
    Eigen::Array<double, Eigen::Dynamic, 4> samples_;
    double last_;  // knot; the first is 0
    std::array<Ray, 2> rays_;
};

}  // namespace magshell
