// Binds the adjoints: they take the gradient with respect to positions and edge rotations and return the gradients with respect to all
// parameters of a solve.
#include <optional>

#include "bindings/model_numbers.h"
#include "magshell/adjoint/static.h"
#include "magshell/scene/stress_stiffness.h"

namespace magshell::bindings {
namespace {

py::tuple pull_back_to_inputs(Model& model, const StaticsResult& equilibrium, const Array& by_positions,
                              const Array& by_edge_rotations, const VectorXd& by_driving, bool by_rest) {
    const Rows3 positions = to_rows3(by_positions);
    const VectorXd rotations = to_vector(by_edge_rotations);
    Gradient gradient;
    RestGradient rest{by_rest, {}};
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        gradient = equilibrium_vjp(model, equilibrium, model.bodies().gradient_by_state(positions, rotations),
                                   by_driving, rest);
    }
    if (!rest.asked) return py::make_tuple(values_to_user(model, gradient.values), gradient.load_parameters);
    return py::make_tuple(values_to_user(model, gradient.values), gradient.load_parameters,
                          at_nodes(model, rest.by_nodes));
}

py::tuple by_parameters(const Model& model, const Gradient& gradient) {
    return py::make_tuple(values_to_user(model, gradient.values), gradient.load_parameters);
}

// Returns the gradients with respect to all parameters and load parameters that add(gradient) adds up at a state.
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

// Returns lambda . dg/dk at a state, in equilibrium or not, for all parameters and load parameters k, and lambda . dg/dX of all nodes.
py::tuple residual_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                       const VectorXd& lambda, bool by_rest) {
    RestGradient rest{by_rest, {}};
    const py::tuple found = by_parameters_at(model, q, load_parameters, [&](Gradient& gradient) {
        model.parameters().vjp(q, load_parameters, lambda, gradient);
        if (by_rest) rest.clear(model);
        rest.add(model, q, load_parameters, lambda);
    });
    return py::make_tuple(found[0], found[1], rest.by_nodes);
}

// Returns dF/dq_h . dq_h/dk for all parameters and load parameters k, with the prescribed dofs q_h, and dF/dq_h . dq_h/dX of all nodes.
py::tuple prescribed_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                         const VectorXd& by_state) {
    VectorXd by_rest = VectorXd::Zero(3 * model.nodes().n_nodes());
    const py::tuple found = by_parameters_at(model, q, load_parameters, [&](Gradient& gradient) {
        const VectorXd none = VectorXd::Zero(q.size());
        const DofMap& dof_map = model.dof_map();
        if (dof_map.has_values()) dof_map.vjp(by_state, none, none, load_parameters, gradient, {});
        dof_map.held_rest_vjp(by_state, load_parameters, by_rest);
    });
    return py::make_tuple(found[0], found[1], by_rest);
}

// Returns the derivatives of the stresses times strain curvatures at a state: by all dofs, by all parameters and load parameters, and by the
// rest shape.
py::tuple stress_work_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                          const std::vector<VectorXd>& curvatures, bool by_rest) {
    VectorXd by_q = VectorXd::Zero(model.size()), rest;
    if (by_rest) rest = VectorXd::Zero(3 * model.nodes().n_nodes());
    const py::tuple found = by_parameters_at(model, q, load_parameters, [&](Gradient& gradient) {
        add_stress_work_vjp(model, q, load_parameters, curvatures, by_q, gradient, by_rest ? &rest : nullptr);
    });
    return py::make_tuple(by_q, found[0], found[1], rest);
}

}  // namespace

void register_adjoint(py::module_& module) {
    module.def(
        "without_rest_gradient",
        [](const Model& model) {
            py::list names;
            for (const std::string_view name : without_rest_gradient(model))
                names.append(py::str(name.data(), name.size()));
            return names;
        },
        py::arg("model"), "The names of the energies and forces that have no derivative by rest positions.");
    module.def(
        "pull_back", &pull_back_to_inputs, py::arg("model"), py::arg("equilibrium"), py::arg("by_positions"),
        py::arg("by_edge_rotations"), py::arg("by_driving") = VectorXd(), py::arg("by_rest") = false,
        "The gradients by everything a solve takes, of a function of positions (n_v, 3), edge rotations "
        "(n_e,) and what motors do (m,) with these gradients; by_rest: also those by rest positions and "
        "directions, through the shape of bodies at rest and through what supports prescribe there. The "
        "model "
        "must hold the values of that solve.");
    module.def(
        "vjp", &residual_vjp, py::arg("model"), py::arg("q"), py::arg("load_parameters"), py::arg("adjoint"),
        py::arg("by_rest") = false,
        "adjoint . dg/dk at a state q, g the gradient of the energy: (n,) by every value and (m,) by the "
        "load parameters; by_rest: also by the rest shape, three numbers per node, else none. What supports "
        "prescribe "
        "stays.");
    module.def(
        "freeze_stress_rates",
        [](Model& model, const VectorXd& q, const LoadParameters& load_parameters,
           const std::optional<VectorXd>& motion) {
            const std::lock_guard lock(model.in_use());
            freeze_stress_rates(model, q, load_parameters, motion ? &*motion : nullptr);
        },
        py::arg("model"), py::arg("q"), py::arg("load_parameters"), py::arg("motion").none(true),
        py::call_guard<py::gil_scoped_release>(),
        "Hold the stresses of all terms at their rates along a motion of all unknowns (n,) from q, or at "
        "zero, until "
        "release_stresses: Hessians are then those of these stresses.");
    module.def(
        "release_stresses",
        [](Model& model) {
            const std::lock_guard lock(model.in_use());
            release_stresses(model);
        },
        py::arg("model"), py::call_guard<py::gil_scoped_release>(),
        "Let stresses follow from strains again.");
    module.def(
        "strain_rates",
        [](Model& model, const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& motion) {
            const std::lock_guard lock(model.in_use());
            return strain_rates(model, q, load_parameters, motion);
        },
        py::arg("model"), py::arg("q"), py::arg("load_parameters"), py::arg("motion"),
        py::call_guard<py::gil_scoped_release>(),
        "The rates of the strains of each energy that has a stress, [(k,)], along a motion of all unknowns "
        "(n,) from q.");
    module.def(
        "stress_work_vjp", &stress_work_vjp, py::arg("model"), py::arg("q"), py::arg("load_parameters"),
        py::arg("curvatures"), py::arg("by_rest") = false,
        "The derivatives of the stresses at q times fixed strain curvatures, as strain_rates has them: by "
        "all unknowns, by every value, "
        "by the load parameters, and, if by_rest, by the rest shape, three numbers per node, else none.");
    module.def(
        "without_stress_work_vjp",
        [](const Model& model) {
            py::list names;
            for (const std::string_view name : without_stress_work_vjp(model))
                names.append(py::str(name.data(), name.size()));
            return names;
        },
        py::arg("model"), "The names of the energies whose stress rates stress_work_vjp leaves out.");
    module.def(
        "at_nodes", &at_nodes, py::arg("model"), py::arg("vector"),
        "The rows of all vertices (n_v, 3) and directions (n_d, 3) of three numbers per node, or of all "
        "unknowns.");
    module.def(
        "prescribed_vjp", &prescribed_vjp, py::arg("model"), py::arg("q"), py::arg("load_parameters"),
        py::arg("by_state"),
        "by_state (size,) . dq_h/dk, with q_h what supports prescribe at a state q: (n,) by every value, "
        "(m,) by the load parameters, and by the rest shape, three numbers per node. For scenes without "
        "rigid "
        "parts.");
}

}  // namespace magshell::bindings
