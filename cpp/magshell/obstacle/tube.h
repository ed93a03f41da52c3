// Tube: a ball swept along a curve with a varying radius: pipes, tunnels, horns.
//
//   F(x) = min_s psi(x, s),      psi = |x - c(s)| - r(s)
//
// c and r are cubic splines. At the minimum psi_s = 0, so the gradient of F is psi_x = n = (x - c) / |x - c|,
// and
//
//   H = psi_xx - psi_xs psi_xs^T / psi_ss,      psi_xx = P / d,   psi_xs = - P c' / d,   P = I - n n^T
//   psi_ss = (|c'|^2 - (n . c')^2) / d - n . c'' - r''
//
// Outside, F is the distance to the union of the balls; inside it is that up to the centers of curvature.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "magshell/field/cubic_spline.h"
#include "magshell/obstacle/obstacle.h"

namespace magshell {

class Tube final : public Obstacle {
  public:
    /// Creates the tube through the points with these radii, one spline knot per point. An open tube continues
    /// straight at both ends with constant radius, which it reaches within three knots; a closed tube ends in
    /// its last balls. Throws InvalidInput where the radius is not positive, or changes as fast as the curve
    /// advances, so that one ball contains the next.
    Tube(std::span<const Vec3> points, std::span<const double> radii, bool closed);

    Distance distance(const Vec3& point) const override;

  private:
    // The spline and its derivatives with respect to s [knots]: center and radius.
    struct Section {
        Vec4 value, first, second;
    };
    Section section(double s) const;
    void check(double first_knot) const;

    // psi and its derivatives with respect to s. Where the point lies on the curve, psi has a kink and no direction.
    struct Slope {
        double value, first, second;
    };
    static Slope slope_at(const Section& section, const Vec3& point);
    double nearest(const Vec3& point, Eigen::Index sample) const;
    Distance distance_at(double s, const Vec3& point) const;

    // The continuation of an open tube's curve: a straight line outwards with a constant radius.
    struct Ray {
        Vec3 origin, outwards;
        double radius;
    };
    static bool beyond(const Ray& ray, const Vec3& point, double value, Distance& out);

    bool closed_;
    std::vector<Vec4> coefficients_;  // c_{i-1} ... c_{i+2} belong to the segment that begins at knot i
    // Samples of center and radius, several per segment, one column per coordinate: searching them is most of
    // the work.
    Eigen::Array<double, Eigen::Dynamic, 4> samples_;
    double last_;  // last knot; the first is 0
    std::array<Ray, 2> rays_;
};

}  // namespace magshell
