// Cubic B-splines on equally spaced knots: coefficients that interpolate samples, and weights that evaluate the
// spline.
//
//   f(origin + (i + t) spacing) = sum_{k=0..3} w_k(t) c_{i-1+k},       0 <= t <= 1
//
// is twice continuously differentiable. n samples determine n + 2 coefficients c_{-1} ... c_n up to two
// conditions, for which "not a knot" is taken: the third derivative does not jump at the second and the last
// but one knot, so that cubics are reproduced up to the border. 3 samples give their parabola, 2 their straight
// line.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace magshell {

using Vec4 = Eigen::Vector4d;  // three components and a zero: one vector register

/// Returns the coefficients c_{-1} ... c_n that interpolate the samples f_0 ... f_{n-1}, n >= 2.
std::vector<Vec4> spline_coefficients(std::span<const Vec4> samples);

/// Applies the transpose of spline_coefficients: returns the gradient with respect to the n samples, given that with respect to the n + 2
/// coefficients.
std::vector<Vec4> spline_samples_gradient(std::span<const Vec4> by_coefficients);

/// The weights of four neighbouring coefficients, for the value and for its first and second derivative with respect to t.
using SplineWeights = std::array<std::array<double, 4>, 3>;

constexpr SplineWeights spline_weights(double t) {
    const double u = 1.0 - t;
    return {{
        {u * u * u / 6.0, (4.0 - 3.0 * t * t * (1.0 + u)) / 6.0, (4.0 - 3.0 * u * u * (1.0 + t)) / 6.0,
         t * t * t / 6.0},
        {-0.5 * u * u, 0.5 * t * (3.0 * t - 4.0), 0.5 * u * (4.0 - 3.0 * u), 0.5 * t * t},
        {u, 3.0 * t - 2.0, 1.0 - 3.0 * t, t},
    }};
}

}  // namespace magshell
