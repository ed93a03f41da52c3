// Motions and their adjoint to Python: whole runs with the GIL released.
#include "bindings/arrays.h"
#include "bindings/gradients.h"
#include "bindings/watch.h"
#include "magshell/adjoint/dynamic.h"

namespace magshell::bindings {
namespace {

Tableau tableau_of(const std::string& name) {
    if (name == "tr_bdf2") return tr_bdf2();
    if (name == "sdirk3") return sdirk3();
    return name == "sdirk2" ? sdirk2() : implicit_euler();
}

std::vector<Controls> controls_of(const py::dict& given) {
    const Rows3 flux_density = to_rows3(given["flux_density"].cast<Array>());
    const auto factor = [&](const char* name) { return to_vector(given[name].cast<Array>()); };
    const VectorXd field = factor("field"), load = factor("load"), gravity = factor("gravity"),
                   motion = factor("motion");
    const Array poses = given["obstacles"].cast<Array>();  // (knots, n, 4, 3), or none
    std::vector<Controls> controls;
    for (Index k = 0; k < flux_density.rows(); ++k) {
        controls.push_back({flux_density.row(k).transpose(), field[k], load[k], gravity[k], motion[k], {}});
        for (py::ssize_t o = 0; poses.ndim() == 4 && o < poses.shape(1); ++o)
            controls.back().obstacles.push_back({Vec3(poses.data(k, o, 0, 0)), Vec3(poses.data(k, o, 1, 0)),
                                                 Vec3(poses.data(k, o, 2, 0)), Vec3(poses.data(k, o, 3, 0))});
    }
    return controls;
}

py::dict rows_of(const std::vector<Controls>& controls) {
    const Index n = static_cast<Index>(controls.size());
    Rows3 flux_density(n, 3);
    VectorXd field(n), load(n), gravity(n), motion(n);
    for (Index k = 0; k < n; ++k) {
        flux_density.row(k) = controls[k].flux_density.transpose();
        field[k] = controls[k].field;
        load[k] = controls[k].load;
        gravity[k] = controls[k].gravity;
        motion[k] = controls[k].motion;
    }
    py::dict rows;
    rows["applied_flux_density"] = flux_density;
    rows["field_factor"] = field;
    rows["load_factor"] = load;
    rows["gravity_factor"] = gravity;
    rows["motion_factor"] = motion;
    return rows;
}

// Membrane and bending, (2, n_f, 3) in our order of faces; empty without a Maxwell branch.
SheetStrains strains_of(const Model& model, const Array& rows) {
    SheetStrains strains;
    if (rows.size() == 0) return strains;
    const Index n_f = model.sheet().n_faces();
    const double* from = rows.data();
    for (Strains* part : {&strains.membrane, &strains.bending}) {
        part->assign(3 * packs_for(n_f), Pack(0.0));
        for (Index f = 0; f < n_f; ++f)
            for (int i = 0; i < 3; ++i) (*part)[3 * (f / Pack::width) + i].set(f % Pack::width, *from++);
    }
    return strains;
}

Array rows_of(const Model& model, const SheetStrains& strains) {
    const py::ssize_t n_f = strains.empty() ? 0 : model.sheet().n_faces();
    Array rows({py::ssize_t{2}, n_f, py::ssize_t{3}});
    double* to = rows.mutable_data();
    for (const Strains* part : {&strains.membrane, &strains.bending})
        for (Index f = 0; f < n_f; ++f)
            for (int i = 0; i < 3; ++i) *to++ = (*part)[3 * (f / Pack::width) + i][f % Pack::width];
    return rows;
}

MotionInput input_of(const Model& model, const py::dict& given) {
    const auto array = [&](const char* name) { return given[name].cast<Array>(); };
    MotionInput input;
    input.start.q = to_vector(array("state"));
    input.start.v = to_vector(array("velocity"));
    input.start.memory = given["memory"].cast<Model::Memory>();
    input.inertia = {model.vertex_weights(to_vector(array("mass"))),
                     model.vertex_weights(to_vector(array("damping")))};
    input.start.e = strains_of(model, given["maxwell_strains"].cast<Array>());
    input.start.rates.w = to_vector(array("acceleration"));
    if (input.start.rates.w.size() > 0) {
        input.start.rates.v = input.start.v;
        input.start.rates.d = strains_of(model, given["strain_rates"].cast<Array>());
        input.start.rates.e = strains_of(model, given["maxwell_strain_rates"].cast<Array>());
    }
    input.rotations_given = given["rotations_given"].cast<bool>();
    input.viscosity = {given["stiffness_damping"].cast<double>(), given["maxwell_modulus"].cast<double>(),
                       given["maxwell_time"].cast<double>()};
    input.tableau = tableau_of(given["integrator"].cast<std::string>());
    input.time_step = given["time_step"].cast<double>();
    input.steps = given["steps"].cast<Index>();
    input.controls = controls_of(given["controls"]);
    input.newton = given["newton"].cast<NewtonOptions>();
    input.record_every = given["record_every"].cast<Index>();
    return input;
}

// (n, n_v, 3), of the recorded states.
template <class Field>
Array positions_of(const Model& model, const MotionResult& motion, const Field& field) {
    const py::ssize_t n = static_cast<py::ssize_t>(motion.recorded.size()), n_v = model.sheet().n_vertices();
    Array rows({n, n_v, py::ssize_t{3}});
    for (py::ssize_t k = 0; k < n; ++k)
        Eigen::Map<Rows3>(rows.mutable_data(k, 0, 0), n_v, 3) = model.positions(field(motion.recorded[k]));
    return rows;
}

Array rotations_of(const Model& model, const MotionResult& motion) {
    const py::ssize_t n = static_cast<py::ssize_t>(motion.recorded.size()), n_e = model.sheet().n_edges();
    Array rows({n, n_e});
    for (py::ssize_t k = 0; k < n; ++k)
        Eigen::Map<VectorXd>(rows.mutable_data(k, 0), n_e) = model.edge_rotations(motion.recorded[k].q);
    return rows;
}

MotionResult run(Model& model, const MotionInput& input, bool gradients, std::size_t budget, Keep keep,
                 const py::object& progress) {
    const Watch watch(progress);
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    return simulate(model, input, {gradients, budget, keep},
                    [&](double at, double residual) { watch(at, residual); });
}

py::dict back(Model& model, const MotionInput& input, const MotionResult& motion, const Array& by_positions,
              const Array& by_edge_rotations, const Array& by_velocities, const py::object& progress) {
    const Watch watch(progress);
    std::vector<VectorXd> by_q, by_v;
    const VectorXd no_rotations = VectorXd::Zero(model.sheet().n_edges());
    const py::ssize_t n_v = model.sheet().n_vertices(), n_e = model.sheet().n_edges();
    for (py::ssize_t k = 0; k < static_cast<py::ssize_t>(motion.recorded.size()); ++k) {
        const auto rows = [&](const Array& of) {
            return Rows3(Eigen::Map<const Rows3>(of.data(k, 0, 0), n_v, 3));
        };
        const VectorXd rotations = Eigen::Map<const VectorXd>(by_edge_rotations.data(k, 0), n_e);
        by_q.push_back(model.gradient_by_state(rows(by_positions), rotations));
        by_v.push_back(model.gradient_by_state(rows(by_velocities), no_rotations));
    }
    MotionGradient gradient;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        gradient = pull_back(model, input, motion, by_q, by_v,
                             [&](double at, double residual) { watch(at, residual); });
    }
    py::dict result = to_dict(model, gradient.scene);
    for (const auto& [name, rows] : rows_of(gradient.controls)) result[name] = rows;
    result["positions"] = model.positions(gradient.positions);
    result["velocities"] = model.positions(gradient.velocities);
    result["mass"] = VectorXd(model.vertex_rows(gradient.mass).rowwise().sum());
    result["damping"] = VectorXd(model.vertex_rows(gradient.damping).rowwise().sum());
    result["time_step"] = gradient.time_step;
    result["stiffness_damping"] = gradient.viscosity.stiffness_damping;
    result["maxwell_modulus"] = gradient.viscosity.maxwell_modulus;
    result["maxwell_time"] = gradient.viscosity.maxwell_time;
    result["factorizations"] = gradient.factorizations;
    return result;
}

}  // namespace

void register_dynamics(py::module_& module) {
    py::class_<MotionInput>(module, "MotionInput")
        .def(py::init(&input_of), py::arg("model"), py::arg("given"));

    py::enum_<Keep>(module, "Keep")
        .value("nothing", Keep::nothing)
        .value("checkpoints", Keep::checkpoints)
        .value("stages", Keep::stages)
        .value("factors", Keep::factors);

    py::class_<MotionResult>(module, "MotionResult")
        .def_readonly("outcome", &MotionResult::outcome)
        .def_readonly("reason", &MotionResult::reason)
        .def_readonly("steps_done", &MotionResult::steps_done)
        .def_property_readonly("last_state", [](const MotionResult& r) { return r.last.q; })
        .def_property_readonly("last_velocity", [](const MotionResult& r) { return r.last.v; })
        .def_property_readonly("last_acceleration", [](const MotionResult& r) { return r.last.rates.w; })
        .def("last_maxwell_strains",
             [](const MotionResult& r, const Model& m) { return rows_of(m, r.last.e); })
        .def("last_strain_rates",
             [](const MotionResult& r, const Model& m) { return rows_of(m, r.last.rates.d); })
        .def("last_maxwell_strain_rates",
             [](const MotionResult& r, const Model& m) { return rows_of(m, r.last.rates.e); })
        .def_property_readonly("last_memory", [](const MotionResult& r) { return r.last.memory; })
        .def_readonly("kinetic_energy", &MotionResult::kinetic_energy)
        .def_readonly("energies", &MotionResult::energies)
        .def_readonly("halved", &MotionResult::halved)
        .def_readonly("keep", &MotionResult::keep)
        .def_readonly("iterations", &MotionResult::iterations)
        .def_readonly("factorizations", &MotionResult::factorizations)
        .def_readonly("linear_time", &MotionResult::linear_time)
        .def_readonly("bytes", &MotionResult::bytes)
        .def("positions",
             [](const MotionResult& r, const Model& m) {
                 return positions_of(m, r, [](const MotionState& s) -> const VectorXd& { return s.q; });
             })
        .def("velocities",
             [](const MotionResult& r, const Model& m) {
                 return positions_of(m, r, [](const MotionState& s) -> const VectorXd& { return s.v; });
             })
        .def("edge_rotations", [](const MotionResult& r, const Model& m) { return rotations_of(m, r); });

    module.def("simulate", &run, py::arg("model"), py::arg("input"), py::arg("gradients"), py::arg("budget"),
               py::arg("keep"), py::arg("progress") = py::none());
    module.def("pull_back_motion", &back, py::arg("model"), py::arg("input"), py::arg("motion"),
               py::arg("by_positions"), py::arg("by_edge_rotations"), py::arg("by_velocities"),
               py::arg("progress") = py::none());
}

}  // namespace magshell::bindings
