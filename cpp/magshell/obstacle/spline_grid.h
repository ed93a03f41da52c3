// Numbers on a regular grid, as coefficients of tensor-product cubic B-splines.
#pragma once

#include <span>
#include <vector>

#include "magshell/core/types.h"
#include "magshell/field/cubic_spline.h"

namespace magshell {

/// Coefficients c_{-1} ... c_n along each axis, in C order, that interpolate samples in C order. `samples`:
/// how many there are along each axis, at least 2.
std::vector<double> grid_coefficients(std::span<const double> values, std::span<const Index> samples);

}  // namespace magshell
