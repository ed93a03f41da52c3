// How a coefficient of drag or thrust depends on the attack angle phi, the angle between a face and the flow:
// 0 where the water runs along the face, pi/2 where it meets it head on.
//
//   C(phi) = 2 sin^2 phi                                                                      [Chen22] (44)
//
// or a piecewise cubic, from a table. A face knows sine and cosine of its attack angle; the angle itself is
// their atan2, which is as exact near pi/2 as anywhere else.
#pragma once

#include <array>
#include <vector>

namespace magshell {

class AttackCurve {
  public:
    struct Sample {
        double value;
        double slope;  // dC/dphi [1/rad]
    };
    using Cubic = std::array<double, 4>;  // of (phi - knot), the highest power first

    /// 2 sin^2 phi
    AttackCurve() = default;

    /// One cubic from each knot [rad] to the next; the first and the last are continued beyond. Throws
    /// InvalidInput unless the knots ascend and there is one cubic less than knots.
    AttackCurve(std::vector<double> knots, std::vector<Cubic> cubics);

    /// At an attack angle in [0, pi/2]: both are at least zero.
    Sample at(double sine, double cosine) const {
        if (cubics_.empty()) return {2.0 * sine * sine, 4.0 * sine * cosine};
        return interpolated(sine, cosine);
    }

  private:
    Sample interpolated(double sine, double cosine) const;

    std::vector<double> knots_;
    std::vector<Cubic> cubics_;  // none: 2 sin^2 phi
};

}  // namespace magshell
