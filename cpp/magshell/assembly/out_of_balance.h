// The out-of-balance force, i.e. the gradient of the energy, with a measure of its round-off.
#pragma once

#include <cmath>

#include "magshell/core/types.h"

namespace magshell {

/// The gradient of the energy, and the sum of the magnitudes of its contributions: its round-off is a fraction of this sum, not of the gradient,
/// in which the contributions cancel.
struct Residual {
    VectorXd gradient, magnitude;

    void reset(Index size) {
        gradient.setZero(size);
        magnitude.setZero(size);
    }
    void add(Index unknown, double value) {
        gradient[unknown] += value;
        magnitude[unknown] += std::abs(value);
    }
};

}  // namespace magshell
