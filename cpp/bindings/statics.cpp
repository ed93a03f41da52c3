// Binds static solves. They release the GIL, check for Ctrl-C and report progress.
#include "magshell/solve/statics.h"

#include "bindings/arrays.h"
#include "bindings/model_numbers.h"
#include "bindings/watch.h"
#include "magshell/solve/linear_response.h"
#include "magshell/solve/modes.h"

namespace magshell::bindings {
namespace {

StaticsResult solve(Model& model, const VectorXd& start, const Model::AngleBranches& angle_branches,
                    const LoadParameters& from, const LoadParameters& to, const StaticsOptions& options,
                    const py::object& progress, const std::vector<Index>& entries) {
    const Watch watch(progress);
    const TimeVaryingParameters varying(model.parameters().registry(), entries);
    check_load_parameters(model, varying, from, to);
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    return find_equilibrium(
        model, start, angle_branches, from, to, options,
        [&](double at, double residual) { watch(at, residual); }, varying);
}

void add_effort(StaticsResult& result, const StaticsResult& earlier) {
    result.log.insert(result.log.begin(), earlier.log.begin(), earlier.log.end());
    result.iterations += earlier.iterations;
    result.factorizations += earlier.factorizations;
    result.failed_factorizations += earlier.failed_factorizations;
    result.load_steps += earlier.load_steps;
    result.relaxation_steps += earlier.relaxation_steps;
    result.saddles_escaped += earlier.saddles_escaped;
    result.other_branches.insert(result.other_branches.begin(), earlier.other_branches.begin(),
                                 earlier.other_branches.end());
    result.linear_time += earlier.linear_time;
}

// Makes an obstacle, by its number, from points on its middle (k, 3) and faces (m, 3) of the caller's vertices.
WatchedObstacle watched_obstacle(Index obstacle, const Array& middles, const IndexArray& faces) {
    WatchedObstacle watched{obstacle, {}, {}};
    for (py::ssize_t k = 0; k < middles.shape(0); ++k) watched.middles.emplace_back(middles.data(k, 0));
    for (py::ssize_t f = 0; f < faces.shape(0); ++f)
        watched.faces.push_back({faces.at(f, 0), faces.at(f, 1), faces.at(f, 2)});
    return watched;
}

VectorXd change(Model& model, const StaticsResult& equilibrium, const LoadParameters& to) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    return first_order_change(model, equilibrium, to);
}

VectorXd change_along(Model& model, const StaticsResult& equilibrium, const VectorXd& gradient_change,
                      const VectorXd& prescribed_change, const VectorXd& moved, const VectorXd& forces) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    return equilibrium_jvp(model, equilibrium, {gradient_change, prescribed_change, moved, forces});
}

py::tuple carried(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                  const VectorXd& forces) {
    StateOnJoints found;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        found = state_on_joints(model, q, load_parameters, forces);
    }
    return py::make_tuple(found.moved, found.driven, found.forces);
}

// Returns the lowest eigenmodes of all degrees of freedom about an equilibrium, their eigenvalues [N/m3], and
// the number of negative ones.
py::tuple lowest_modes(Model& model, const VectorXd& state, const Model::AngleBranches& angle_branches,
                       const LoadParameters& load_parameters, int count, const py::object& progress) {
    const Watch watch(progress);
    std::vector<Mode> modes;
    Index negative = 0;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        model.set_angle_branches(angle_branches);
        Newton newton(model, {}, [&](double residual) { watch(1.0, residual); });
        const FactorReport report = newton.factorize_at(state, load_parameters);
        negative = report.negative_pivots;
        if (report.succeeded && report.perturbed_pivots == 0)
            modes = modes_near_zero(newton, count + static_cast<int>(negative));
    }
    py::list shapes;
    std::vector<double> eigenvalues;
    for (Mode& each : modes) {
        eigenvalues.push_back(each.eigenvalue);
        shapes.append(each.shape);
    }
    return py::make_tuple(eigenvalues, shapes, negative);
}

// Moves a state along a step, as far as body contact allows.
VectorXd moved(Model& model, const VectorXd& state, const VectorXd& step) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    model.linearize(state);
    const double share =
        model.capabilities().has_barrier ? 0.9 * model.capabilities().max_step_length(state, step) : 1.0;
    VectorXd there = state;
    model.dof_map().retract(there, share * step);
    return there;
}

}  // namespace

void register_statics(py::module_& module) {
    py::class_<NewtonOptions>(module, "NewtonOptions")
        .def(py::init([](bool mixed, double tolerance, int max_iterations) {
                 return NewtonOptions{mixed, tolerance, max_iterations};
             }),
             py::kw_only(), py::arg("mixed") = true, py::arg("tolerance") = 1e-10,
             py::arg("max_iterations") = 20);

    py::class_<WatchedObstacle>(module, "WatchedObstacle")
        .def(py::init(&watched_obstacle), py::arg("obstacle"), py::arg("middles"), py::arg("faces"));

    py::class_<StaticsOptions>(module, "StaticsOptions")
        .def(py::init<>())
        .def_readwrite("newton", &StaticsOptions::newton)
        .def_readwrite("first_step", &StaticsOptions::first_step)
        .def_readwrite("smallest_step", &StaticsOptions::smallest_step)
        .def_readwrite("require_stable", &StaticsOptions::require_stable)
        .def_readwrite("keep_factor", &StaticsOptions::keep_factor)
        .def_readwrite("away_from", &StaticsOptions::away_from)
        .def_readwrite("away_length", &StaticsOptions::away_length)
        .def_readwrite("watched", &StaticsOptions::watched)
        .def_readwrite("start_at_rest", &StaticsOptions::start_at_rest)
        .def_readwrite("max_relaxation_steps", &StaticsOptions::max_relaxation_steps)
        .def_readwrite("max_factorizations", &StaticsOptions::max_factorizations);

    py::enum_<Outcome>(module, "Outcome")
        .value("converged", Outcome::converged)
        .value("failed", Outcome::failed)
        .value("interrupted", Outcome::interrupted);

    py::class_<FailedAttempt>(module, "FailedAttempt")
        .def_readonly("state", &FailedAttempt::state)
        .def_readonly("load_parameters", &FailedAttempt::load_parameters)
        .def_readonly("shortest_step", &FailedAttempt::shortest_step)
        .def_readonly("last_move", &FailedAttempt::last_displacement)
        .def_readonly("falling", &FailedAttempt::descent_direction);

    py::class_<SolveStep>(module, "SolveStep")
        .def_readonly("load_fraction", &SolveStep::load_fraction)
        .def_readonly("method", &SolveStep::method)
        .def_readonly("displacement", &SolveStep::displacement)
        .def_readonly("factorizations", &SolveStep::factorizations)
        .def_readonly("iterations", &SolveStep::iterations)
        .def_readonly("energy", &SolveStep::energy)
        .def_readonly("negative_pivots", &SolveStep::negative_pivots)
        .def_readonly("failure", &SolveStep::failure);

    py::class_<OtherBranch>(module, "OtherBranch")
        .def_readonly("saddle", &OtherBranch::saddle)
        .def_readonly("state", &OtherBranch::state)
        .def_readonly("other_mode", &OtherBranch::other_mode);

    py::class_<StaticsResult>(module, "StaticsResult")
        .def_readonly("outcome", &StaticsResult::outcome)
        .def_readonly("state", &StaticsResult::state)
        .def_readonly("angle_branches", &StaticsResult::angle_branches)
        .def_readonly("load_parameters", &StaticsResult::load_parameters)
        .def_readonly("load_fraction", &StaticsResult::progress)
        .def_readonly("reason", &StaticsResult::reason)
        .def_readonly("effort_spent", &StaticsResult::effort_spent)
        .def_readonly("failed", &StaticsResult::failed)
        .def_readonly("log", &StaticsResult::log)
        .def_readonly("iterations", &StaticsResult::iterations)
        .def_readonly("factorizations", &StaticsResult::factorizations)
        .def_readonly("failed_factorizations", &StaticsResult::failed_factorizations)
        .def_readonly("load_steps", &StaticsResult::load_steps)
        .def_readonly("relaxation_steps", &StaticsResult::relaxation_steps)
        .def_readonly("saddles_escaped", &StaticsResult::saddles_escaped)
        .def_readonly("other_branches", &StaticsResult::other_branches)
        .def_readonly("residual", &StaticsResult::residual)
        .def_readonly("at_roundoff", &StaticsResult::at_roundoff)
        .def_readonly("stable", &StaticsResult::stable)
        .def_readonly("field_sampling_error", &StaticsResult::field_sampling_error)
        .def_readonly("n_negative_eigenvalues", &StaticsResult::unstable_directions)
        .def_readonly("linear_time", &StaticsResult::linear_time)
        .def_readonly("bytes", &StaticsResult::bytes)
        .def_readonly("factorization", &StaticsResult::factorization)
        .def("add_effort_of", &add_effort, "Count what an earlier part of the same search did as well.",
             py::arg("earlier"));

    module.def("find_equilibrium", &solve, py::arg("model"), py::arg("start"), py::arg("angle_branches"),
               py::arg("from_"), py::arg("to"), py::arg("options"), py::arg("progress") = py::none(),
               py::arg("varying") = std::vector<Index>());
    module.def(
        "lowest_modes", &lowest_modes, py::arg("model"), py::arg("state"), py::arg("angle_branches"),
        py::arg("load_parameters"), py::arg("count"), py::arg("progress") = py::none(),
        "Eigenvalues, shapes of all unknowns (largest displacement 1) nearest to zero, and the number of "
        "unstable directions of an equilibrium; none where it is neutral.");
    module.def("moved", &moved, py::arg("model"), py::arg("state"), py::arg("step"),
               "A state after a step of all unknowns, as far as bodies in contact let it.");
    module.def("first_order_change", &change, py::arg("model"), py::arg("equilibrium"), py::arg("to"),
               "The change of the state to first order, from an equilibrium whose factor was kept to these "
               "load parameters and the values that the model holds now.");
    module.def(
        "push_forward", &change_along, py::arg("model"), py::arg("equilibrium"), py::arg("gradient_change"),
        py::arg("prescribed_change"), py::arg("moved") = VectorXd(), py::arg("forces") = VectorXd(),
        "The derivative of the state along a direction of the inputs of a solve, along which the gradient "
        "and what supports and motors prescribe change so; if joints change, also a state that stays on "
        "them, and "
        "the fixed gradient on the free unknowns there. The model must hold the values of that solve.");
    module.def(
        "state_on_joints", &carried, py::arg("model"), py::arg("q"), py::arg("load_parameters"),
        py::arg("forces"),
        "A state with its rigid parts on their joints as the values are now, the increments from there to "
        "what motors and supports prescribe, and forces of all unknowns on the free ones there.");
}

}  // namespace magshell::bindings
