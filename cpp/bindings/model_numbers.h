// Converts gradients and strains of a model to Python, flat and in the caller's order of rows, and checks its load parameters.
#pragma once

#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/core/errors.h"
#include "magshell/scene/model.h"
#include "magshell/scene/principal_strains.h"

namespace magshell::bindings {

inline VectorXd values_to_user(const Model& model, const VectorXd& by_values) {
    return model.parameters().registry().values.to_user(by_values);
}

/// Returns the rows of all vertices (n_v, 3) and of the directions (n_d, 3), of a vector of three numbers per node or of all dofs.
inline py::tuple at_nodes(const Model& model, const VectorXd& of_nodes) {
    const Nodes& nodes = model.nodes();
    VectorXd of_dofs = VectorXd::Zero(nodes.n_dofs());
    of_dofs.head(of_nodes.size()) = of_nodes;
    return py::make_tuple(model.bodies().gradient_by_vectors(of_dofs),
                          Rows3(Eigen::Map<const Rows3>(of_dofs.data() + nodes.n_coordinates(),
                                                        nodes.n_nodes() - nodes.n_vertices(), 3)));
}

/// Returns (membrane strain, its face, bending strain, its face).
inline py::tuple to_tuple(const LargestStrains& largest) {
    return py::make_tuple(largest.membrane, largest.membrane_face, largest.bending, largest.bending_face);
}

/// Throws InvalidInput unless both ends of a load path have as many numbers as the model's load parameters and
/// varying parameters.
inline void check_load_parameters(const Model& model, const TimeVaryingParameters& varying,
                                  const LoadParameters& from, const LoadParameters& to) {
    const Index width = model.parameters().registry().load_parameters.size() + varying.size();
    if (from.size() != width || to.size() != width)
        throw InvalidInput("load_parameters must have shape (" + std::to_string(width) + ",)");
}

}  // namespace magshell::bindings
