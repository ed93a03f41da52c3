// Binds the adjoints: they take the gradient by positions and edge rotations and return the gradients by all
// parameters of a solve.
#include "bindings/gradients.h"
#include "magshell/adjoint/static.h"

namespace magshell::bindings {
namespace {

py::tuple pull_back_to_inputs(Model& model, const StaticsResult& equilibrium, const Array& by_positions,
                              const Array& by_edge_rotations, const VectorXd& by_driving,
                              const std::vector<VectorXd>& curvature_scales) {
    const Rows3 positions = to_rows3(by_positions);
    const VectorXd rotations = to_vector(by_edge_rotations);
    Gradient gradient;
    RestGradient rest{curvature_scales, {}, {}};
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        gradient = equilibrium_vjp(model, equilibrium, model.bodies().gradient_by_state(positions, rotations),
                                   by_driving, rest);
    }
    if (!rest.asked())
        return py::make_tuple(values_to_user(model, gradient.values), gradient.load_parameters);
    return py::make_tuple(values_to_user(model, gradient.values), gradient.load_parameters,
                          at_nodes(model, rest.by_nodes), at_nodes(model, rest.by_prescribed));
}

py::tuple by_parameters(const Model& model, const Gradient& gradient) {
    return py::make_tuple(values_to_user(model, gradient.values), gradient.load_parameters);
}

// Returns the gradients by all parameters and load parameters that add(gradient) adds up at a state.
template <class Add>
py::tuple by_parameters_at(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                           const Add& add) {
    Gradient gradient(model.parameters().registry());
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        model.evaluate(q, load_parameters);
        add(gradient);
    }
    return by_parameters(model, gradient);
}

// Returns lambda . dg/dk at a state, in equilibrium or not, for all parameters and load parameters k.
py::tuple residual_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                       const VectorXd& lambda) {
    return by_parameters_at(model, q, load_parameters, [&](Gradient& gradient) {
        model.parameters().vjp(q, load_parameters, lambda, gradient);
    });
}

// Returns dF/dq_h . dq_h/dk for all parameters and load parameters k, with the prescribed dofs q_h.
py::tuple prescribed_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                         const VectorXd& by_state) {
    return by_parameters_at(model, q, load_parameters, [&](Gradient& gradient) {
        const VectorXd none = VectorXd::Zero(q.size());
        if (model.dof_map().has_values())
            model.dof_map().vjp(by_state, none, none, load_parameters, gradient, {});
    });
}

}  // namespace

void register_adjoint(py::module_& module) {
    module.def(
        "pull_back", &pull_back_to_inputs, py::arg("model"), py::arg("equilibrium"), py::arg("by_positions"),
        py::arg("by_edge_rotations"), py::arg("by_driving") = VectorXd(),
        py::arg("curvature_scales") = std::vector<VectorXd>(),
        "The gradients by everything a solve takes, of a function of positions (n_v, 3), edge rotations "
        "(n_e,) and what motors do (m,) with these gradients; with the curvature scales of all three-node "
        "shells also those by rest "
        "positions and directions, of the elastic energies and by what supports prescribe there. The model "
        "must hold the values of that solve.");
    module.def(
        "vjp", &residual_vjp, py::arg("model"), py::arg("q"), py::arg("controls"), py::arg("adjoint"),
        "adjoint . dg/dk at a state q, g the gradient of the energy: (n,) by every value and (m,) by the "
        "controls. What supports prescribe stays.");
    module.def(
        "prescribed_vjp", &prescribed_vjp, py::arg("model"), py::arg("q"), py::arg("controls"),
        py::arg("by_state"),
        "by_state (size,) . dq_h/dk, with q_h what supports prescribe at a state q: (n,) by every value and "
        "(m,) by the controls. For scenes without rigid parts.");
}

}  // namespace magshell::bindings
