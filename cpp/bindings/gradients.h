// Converts gradients with respect to parameters and load parameters to Python: flat, in the caller's order of rows.
#pragma once

#include "bindings/arrays.h"
#include "magshell/scene/model.h"

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

}  // namespace magshell::bindings
