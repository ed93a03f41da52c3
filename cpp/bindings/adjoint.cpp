// Adjoints to Python: a gradient by positions and edge rotations in, gradients by everything a solve takes out.
#include "magshell/adjoint/static.h"

#include "bindings/arrays.h"

namespace magshell::bindings {
namespace {

// As rows (center, rotation, translation) of the motions: (k, 3, 3), the layout in which they came.
Array rows_of(const std::vector<Motion>& motions) {
    Array rows({static_cast<py::ssize_t>(motions.size()), py::ssize_t{3}, py::ssize_t{3}});
    for (std::size_t k = 0; k < motions.size(); ++k) {
        const Vec3* vectors[3] = {&motions[k].centre, &motions[k].rotation_vector, &motions[k].translation};
        for (int row = 0; row < 3; ++row)
            for (int c = 0; c < 3; ++c) rows.mutable_at(k, row, c) = (*vectors[row])[c];
    }
    return rows;
}

py::dict to_dict(const Model& model, const SceneGradient& g) {
    py::dict result;
    result["thickness"] = g.thickness;
    result["young_modulus"] = g.young_modulus;
    result["poisson_ratio"] = g.poisson_ratio;
    result["curvature_scale"] = g.curvature_scale;
    result["remanent_magnetization"] = g.remanent_magnetization;
    if (g.weights.size() > 0) result["vertex_weights"] = model.vertex_rows(g.weights);
    if (g.loads.size() > 0) result["vertex_loads"] = model.vertex_rows(g.loads);
    result["couples"] = g.couples;
    result["motions"] = rows_of(g.motions);
    result["field_sources"] = g.field_sources;
    result["applied_flux_density"] = g.controls.flux_density;
    result["field_factor"] = g.controls.field;
    result["load_factor"] = g.controls.load;
    result["gravity_factor"] = g.controls.gravity;
    result["motion_factor"] = g.controls.motion;
    return result;
}

py::dict pull_back_to_inputs(Model& model, const StaticsResult& equilibrium, const Array& by_positions,
                             const Array& by_edge_rotations) {
    const Rows3 positions = to_rows3(by_positions);
    const VectorXd rotations = to_vector(by_edge_rotations);
    SceneGradient gradient;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        gradient = pull_back(model, equilibrium, model.gradient_by_state(positions, rotations));
    }
    return to_dict(model, gradient);
}

}  // namespace

void register_adjoint(py::module_& module) {
    module.def("pull_back", &pull_back_to_inputs, py::arg("model"), py::arg("equilibrium"), py::arg("by_positions"),
               py::arg("by_edge_rotations"),
               "The gradients by everything a solve takes, of a function of positions (n_v, 3) and edge rotations "
               "(n_e,) with these gradients. The model must hold the values of that solve.");
}

}  // namespace magshell::bindings
