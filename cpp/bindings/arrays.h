// numpy arrays to the core's own: shapes are checked by the package, which knows the caller's names for them.
#pragma once

#include <pybind11/eigen.h>

#include "bindings/bindings.h"
#include "magshell/core/types.h"

namespace magshell::bindings {

inline Rows3 to_rows3(const Array& array) {
    if (array.size() == 0) return Rows3(0, 3);
    return Eigen::Map<const Rows3>(array.data(), array.shape(0), 3);
}

inline VectorXd to_vector(const Array& array) {
    return Eigen::Map<const VectorXd>(array.data(), array.size());
}

}  // namespace magshell::bindings
