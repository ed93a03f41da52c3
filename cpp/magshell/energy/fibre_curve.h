// FibreCurve: a curve through equally spaced samples, twice continuously differentiable everywhere. It is a
// cubic B-spline whose coefficients beyond both ends repeat the last one, so that it becomes constant there.
// field/cubic_spline.h
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "magshell/field/cubic_spline.h"

namespace magshell {

class FibreCurve {
  public:
    struct Sample {
        double integral, value, slope;
    };

    FibreCurve() = default;
    /// Creates the curve from the coefficients c_i at origin + i spacing, two or more.
    FibreCurve(double origin, double spacing, std::vector<double> coefficients)
        : origin_(origin), spacing_(spacing), c_(std::move(coefficients)), integrals_(size() + 4) {
        for (int i = -2; i <= size(); ++i) integrals_[i + 3] = integrals_[i + 2] + interval_integral(i);
    }

    bool empty() const { return c_.empty(); }

    /// Returns the curve and its integral at a position. The integral is zero where the curve stops being
    /// constant at its lower end.
    Sample at(double place) const {
        const double s = (place - origin_) / spacing_;
        // The curve is constant below knot -2 and above knot n + 1.
        if (!(s > -2.0)) return {(s + 2.0) * spacing_ * c_.front(), c_.front(), 0.0};
        if (s >= size() + 1.0)
            return {(integrals_.back() + (s - size() - 1.0) * c_.back()) * spacing_, c_.back(), 0.0};
        const int i = std::min(static_cast<int>(std::floor(s)), size());
        const double t = s - i;
        const SplineWeights w = spline_weights(t);
        Sample sample{integrals_[i + 2], 0.0, 0.0};
        const std::array<double, 4> inside = integrated(t);
        for (int k = 0; k < 4; ++k) {
            const double c = coefficient(i - 1 + k);
            sample.integral += inside[k] * c;
            sample.value += w[0][k] * c;
            sample.slope += w[1][k] * c / spacing_;
        }
        sample.integral *= spacing_;
        return sample;
    }

  private:
    int size() const { return static_cast<int>(c_.size()); }
    double coefficient(int i) const { return c_[std::clamp(i, 0, size() - 1)]; }

    // Returns the integrals of the four spline weights from 0 to t.
    static std::array<double, 4> integrated(double t) {
        const double u = 1.0 - t, t2 = t * t, t3 = t2 * t, t4 = t2 * t2, u4 = u * u * u * u;
        const double last = t4 / 24.0;
        const double second = (4.0 * t - 2.0 * t3 + 0.75 * t4) / 6.0;
        const double first = (1.0 - u4) / 24.0;
        return {first, second, t - first - second - last, last};
    }

    // Returns the integral over the interval that begins at knot i, in units of the spacing.
    double interval_integral(int i) const {
        return (coefficient(i - 1) + 11.0 * coefficient(i) + 11.0 * coefficient(i + 1) + coefficient(i + 2)) /
               24.0;
    }

    double origin_ = 0.0, spacing_ = 1.0;
    std::vector<double> c_;
    std::vector<double> integrals_;  // integral up to knot i in units of the spacing, at i + 2
};

}  // namespace magshell
