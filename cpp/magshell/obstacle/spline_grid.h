// Interpolation of numbers on a regular grid by tensor-product cubic B-splines.
#pragma once

#include <span>
#include <vector>

#include "magshell/core/types.h"
#include "magshell/field/cubic_spline.h"

namespace magshell {

/// Returns the coefficients c_{-1} ... c_n along each axis, in C order, that interpolate values in C order.
/// samples: number of values along each axis, at least 2.
std::vector<double> grid_coefficients(std::span<const double> values, std::span<const Index> samples);

}  // namespace magshell
