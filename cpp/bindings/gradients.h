// Converts gradients by parameters and load parameters to Python: flat, in the caller's order of rows.
#pragma once

#include "bindings/arrays.h"
#include "magshell/scene/model.h"

namespace magshell::bindings {

inline VectorXd values_to_user(const Model& model, const VectorXd& by_values) {
    return model.parameters().registry().values.to_user(by_values);
}

}  // namespace magshell::bindings
