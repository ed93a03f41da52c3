// Static solves to Python: the GIL is released, Ctrl-C is looked for, progress is called back.
#include "magshell/solve/statics.h"

#include "bindings/arrays.h"
#include "bindings/watch.h"
#include "magshell/solve/response.h"

namespace magshell::bindings {
namespace {

StaticsResult solve(Model& model, const VectorXd& start, const Model::Turns& turns, const Controls& from,
                    const Controls& to, const StaticsOptions& options, const py::object& progress) {
    const Watch watch(progress);
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    return find_equilibrium(model, start, turns, from, to, options,
                            [&](double at, double residual) { watch(at, residual); });
}

VectorXd change(Model& model, const StaticsResult& equilibrium, const Controls& to) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    return first_order_change(model, equilibrium, to);
}

}  // namespace

void register_statics(py::module_& module) {
    py::class_<NewtonOptions>(module, "NewtonOptions")
        .def(py::init([](bool mixed, double tolerance, int max_iterations) {
                 return NewtonOptions{mixed, tolerance, max_iterations};
             }),
             py::kw_only(), py::arg("mixed") = true, py::arg("tolerance") = 1e-10,
             py::arg("max_iterations") = 20);

    py::class_<StaticsOptions>(module, "StaticsOptions")
        .def(py::init<>())
        .def_readwrite("newton", &StaticsOptions::newton)
        .def_readwrite("first_step", &StaticsOptions::first_step)
        .def_readwrite("smallest_step", &StaticsOptions::smallest_step)
        .def_readwrite("require_stable", &StaticsOptions::require_stable)
        .def_readwrite("keep_factor", &StaticsOptions::keep_factor)
        .def_readwrite("start_at_rest", &StaticsOptions::start_at_rest)
        .def_readwrite("max_relaxation_steps", &StaticsOptions::max_relaxation_steps);

    py::enum_<Outcome>(module, "Outcome")
        .value("converged", Outcome::converged)
        .value("failed", Outcome::failed)
        .value("interrupted", Outcome::interrupted);

    py::class_<FailedAttempt>(module, "FailedAttempt")
        .def_readonly("state", &FailedAttempt::state)
        .def_readonly("controls", &FailedAttempt::controls)
        .def_readonly("shortest_step", &FailedAttempt::shortest_step)
        .def_readonly("last_move", &FailedAttempt::last_move)
        .def_readonly("falling", &FailedAttempt::falling);

    py::class_<StaticsResult>(module, "StaticsResult")
        .def_readonly("outcome", &StaticsResult::outcome)
        .def_readonly("state", &StaticsResult::state)
        .def_readonly("turns", &StaticsResult::turns)
        .def_readonly("controls", &StaticsResult::controls)
        .def_readonly("progress", &StaticsResult::progress)
        .def_readonly("reason", &StaticsResult::reason)
        .def_readonly("failed", &StaticsResult::failed)
        .def_readonly("iterations", &StaticsResult::iterations)
        .def_readonly("factorizations", &StaticsResult::factorizations)
        .def_readonly("failed_factorizations", &StaticsResult::failed_factorizations)
        .def_readonly("load_steps", &StaticsResult::load_steps)
        .def_readonly("relaxation_steps", &StaticsResult::relaxation_steps)
        .def_readonly("saddles_left", &StaticsResult::saddles_left)
        .def_readonly("residual", &StaticsResult::residual)
        .def_readonly("stable", &StaticsResult::stable)
        .def_readonly("unstable_directions", &StaticsResult::unstable_directions)
        .def_readonly("linear_time", &StaticsResult::linear_time)
        .def_readonly("bytes", &StaticsResult::bytes)
        .def_readonly("factorization", &StaticsResult::factorization);

    module.def("find_equilibrium", &solve, py::arg("model"), py::arg("start"), py::arg("turns"),
               py::arg("from_"), py::arg("to"), py::arg("options"), py::arg("progress") = py::none());
    module.def("first_order_change", &change, py::arg("model"), py::arg("equilibrium"), py::arg("to"),
               "The change of the state to first order, from an equilibrium whose factor was kept to these "
               "controls and the values that the model holds now.");
}

}  // namespace magshell::bindings
