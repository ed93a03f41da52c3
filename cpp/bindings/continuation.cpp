// Binds path following.
#include "magshell/solve/continuation.h"

#include "bindings/arrays.h"
#include "bindings/call_python.h"
#include "bindings/model_numbers.h"
#include "bindings/watch.h"

namespace magshell::bindings {
namespace {

PathResult follow(Model& model, const VectorXd& start, const Model::AngleBranches& angle_branches,
                  const LoadParameters& from, const LoadParameters& to, const PathOptions& options,
                  const std::vector<Index>& entries, const py::object& until, const py::object& progress) {
    const TimeVaryingParameters varying(model.parameters().registry(), entries);
    check_load_parameters(model, varying, from, to);
    const Watch watch(progress);
    Until ends;
    if (!until.is_none())
        ends = [&](const PathPoint& point) {
            const py::gil_scoped_acquire locked;
            return call_python(until, point.parameter, model.bodies().positions(point.state)).cast<bool>();
        };
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    return follow_path(
        model, start, angle_branches, from, to, options, ends,
        [&](double at, double residual) { watch(at, residual); }, varying);
}

}  // namespace

void register_continuation(py::module_& module) {
    py::class_<PathPoint>(module, "PathPoint")
        .def_readonly("state", &PathPoint::state)
        .def_readonly("parameter", &PathPoint::parameter)
        .def_readonly("angle_branches", &PathPoint::angle_branches)
        .def_readonly("n_negative_eigenvalues", &PathPoint::unstable_directions)
        .def_readonly("field_sampling_error", &PathPoint::field_sampling_error);

    py::enum_<CriticalKind>(module, "CriticalKind")
        .value("limit", CriticalKind::limit)
        .value("bifurcation", CriticalKind::bifurcation)
        .value("flutter", CriticalKind::flutter);

    py::class_<CriticalPoint>(module, "CriticalPoint")
        .def_readonly("point", &CriticalPoint::point)
        .def_readonly("kind", &CriticalPoint::kind)
        .def_readonly("mode", &CriticalPoint::mode)
        .def_readonly("after_point", &CriticalPoint::after_point);

    py::class_<PathOptions>(module, "PathOptions")
        .def(py::init<>())
        .def_readwrite("newton", &PathOptions::newton)
        .def_readwrite("first_step", &PathOptions::first_step)
        .def_readwrite("max_step", &PathOptions::max_step)
        .def_readwrite("max_points", &PathOptions::max_points)
        .def_readwrite("min_parameter", &PathOptions::min_parameter)
        .def_readwrite("max_parameter", &PathOptions::max_parameter)
        .def_readwrite("locate_critical", &PathOptions::locate_critical)
        .def_readwrite("watched", &PathOptions::watched)
        .def_readwrite("branch_at", &PathOptions::branch_at)
        .def_readwrite("branch_side", &PathOptions::branch_side);

    py::class_<PathResult>(module, "PathResult")
        .def_readonly("outcome", &PathResult::outcome)
        .def_readonly("points", &PathResult::points)
        .def_readonly("critical", &PathResult::critical)
        .def_readonly("reason", &PathResult::reason)
        .def_readonly("iterations", &PathResult::iterations)
        .def_readonly("factorizations", &PathResult::factorizations)
        .def_readonly("failed_factorizations", &PathResult::failed_factorizations);

    module.def("follow_path", &follow, py::arg("model"), py::arg("start"), py::arg("angle_branches"),
               py::arg("from_"), py::arg("to"), py::arg("options"), py::arg("varying"),
               py::arg("until") = py::none(), py::arg("progress") = py::none());
}

}  // namespace magshell::bindings
