// Converts load parameters from Python, followed by the values of time-varying parameters.
#pragma once

#include <string>

#include "magshell/core/errors.h"
#include "magshell/scene/model.h"

namespace magshell::bindings {

/// Throws InvalidInput unless both ends of a load path have as many numbers as the model's load parameters and
/// varying parameters.
inline void check_load_parameters(const Model& model, const TimeVaryingParameters& varying,
                                  const LoadParameters& from, const LoadParameters& to) {
    const Index width = model.parameters().registry().load_parameters.size() + varying.size();
    if (from.size() != width || to.size() != width)
        throw InvalidInput("load_parameters must have shape (" + std::to_string(width) + ",)");
}

}  // namespace magshell::bindings
