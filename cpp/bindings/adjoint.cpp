// Binds the adjoints: they take the gradient by positions and edge rotations and return the gradients by all
// parameters of a solve.
#include "bindings/gradients.h"
#include "magshell/adjoint/static.h"

namespace magshell::bindings {
namespace {

py::tuple pull_back_to_inputs(Model& model, const StaticsResult& equilibrium, const Array& by_positions,
                              const Array& by_edge_rotations, const VectorXd& by_driving) {
    const Rows3 positions = to_rows3(by_positions);
    const VectorXd rotations = to_vector(by_edge_rotations);
    Gradient gradient;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        gradient = equilibrium_vjp(model, equilibrium, model.bodies().gradient_by_state(positions, rotations),
                                   by_driving);
    }
    return py::make_tuple(values_to_user(model, gradient.values), gradient.load_parameters);
}

}  // namespace

void register_adjoint(py::module_& module) {
    module.def(
        "pull_back", &pull_back_to_inputs, py::arg("model"), py::arg("equilibrium"), py::arg("by_positions"),
        py::arg("by_edge_rotations"), py::arg("by_driving") = VectorXd(),
        "The gradients by everything a solve takes, of a function of positions (n_v, 3), edge rotations "
        "(n_e,) and what motors do (m,) with these gradients. The model must hold the values of that solve.");
}

}  // namespace magshell::bindings
