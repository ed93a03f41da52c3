// AttackCurve: a drag or thrust coefficient as a function of the angle of attack phi between a face and the
// flow: 0 where the flow is parallel to the face, pi/2 where it is perpendicular.
//
//   C(phi) = 2 sin^2 phi                                                                      [Chen22] (44)
//
// or a piecewise cubic through a table. Callers give sine and cosine of the angle; the angle is their atan2,
// which is as accurate near pi/2 as elsewhere.
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
    using Cubic = std::array<double, 4>;  // coefficients of powers of (phi - knot), the highest first

    /// Creates the curve 2 sin^2 phi.
    AttackCurve() = default;

    /// Creates a piecewise cubic, one polynomial from each knot [rad] to the next; the first and the last are
    /// continued beyond the table. Throws InvalidInput unless the knots ascend and there is one polynomial less
    /// than knots.
    AttackCurve(std::vector<double> knots, std::vector<Cubic> cubics);

    /// Returns the coefficient at an angle of attack in [0, pi/2]; both arguments are nonnegative.
    Sample at(double sine, double cosine) const {
        if (cubics_.empty()) return {2.0 * sine * sine, 4.0 * sine * cosine};
        return interpolated(sine, cosine);
    }

  private:
    Sample interpolated(double sine, double cosine) const;

    std::vector<double> knots_;
    std::vector<Cubic> cubics_;  // empty: 2 sin^2 phi
};

}  // namespace magshell
