// Controls from Python, with the numbers of what varies behind them.
#pragma once

#include <string>

#include "magshell/core/errors.h"
#include "magshell/scene/model.h"

namespace magshell::bindings {

/// Throws InvalidInput where the ends of a way have not as many numbers as the model and what varies.
inline void check_controls(const Model& model, const TimeVaryingParameters& varying, const Controls& from,
                           const Controls& to) {
    const Index width = model.registry().controls.size() + varying.size();
    if (from.size() != width || to.size() != width)
        throw InvalidInput("controls must have shape (" + std::to_string(width) + ",)");
}

}  // namespace magshell::bindings
