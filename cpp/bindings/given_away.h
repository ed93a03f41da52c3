// Moves numbers of the core to a numpy array that owns them, so that large arrays are not copied.
#pragma once

#include <memory>
#include <utility>

#include "bindings/bindings.h"

namespace magshell::bindings {

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
