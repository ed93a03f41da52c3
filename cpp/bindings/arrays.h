// Converts numpy arrays to types of the core. The Python package has checked their shapes, because it knows the
// caller's names for them.
#pragma once

#include <pybind11/eigen.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "magshell/core/errors.h"
#include "magshell/core/types.h"

namespace magshell::bindings {

inline Rows3 to_rows3(const Array& array) {
    if (array.size() == 0) return Rows3(0, 3);
    return Eigen::Map<const Rows3>(array.data(), array.shape(0), 3);
}

inline VectorXd to_vector(const Array& array) {
    return Eigen::Map<const VectorXd>(array.data(), array.size());
}

/// Returns the entries of a one-dimensional array. Throws InvalidInput, which names it, if it has another number of axes.
inline std::vector<Index> to_indices(const IndexArray& array, const char* name) {
    if (array.ndim() != 1)
        throw InvalidInput(std::string(name) + " must have one axis, got " + std::to_string(array.ndim()));
    return {array.data(), array.data() + array.size()};
}

/// Returns one block for each of `rows`, `each` per row: (n, k, 3, 3), without the second axis if k = 0.
inline py::array_t<double> to_matrices(const std::vector<Mat3>& given, Index rows, int each) {
    std::vector<py::ssize_t> shape = {static_cast<py::ssize_t>(rows)};
    if (each > 0) shape.push_back(each);
    shape.insert(shape.end(), {3, 3});
    py::array_t<double> out(shape);
    double* to = out.mutable_data();
    for (const Mat3& matrix : given)
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) *to++ = matrix(r, c);
    return out;
}

// Moves numbers of the core to a numpy array that owns them, so that large arrays are not copied.
template <class Vector>
py::array_t<typename Vector::value_type> given_away(Vector numbers) {
    auto owned = std::make_unique<Vector>(std::move(numbers));
    const auto size = static_cast<py::ssize_t>(owned->size());
    const auto* data = owned->data();
    const py::capsule owner(owned.get(), [](void* each) { delete static_cast<Vector*>(each); });
    owned.release();
    return py::array_t<typename Vector::value_type>(size, data, owner);
}

}  // namespace magshell::bindings
