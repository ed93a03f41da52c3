// The gradient of the energy, with what its round-off is a fraction of.
#pragma once

#include <cmath>

#include "magshell/core/types.h"

namespace magshell {

/// The gradient of the energy, and the sum of the magnitudes of what was added up to it: its round-off is a
/// fraction of that, not of the little that is left.
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
