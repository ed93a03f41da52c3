// Gradients by what a scene was made from, by the names that the package has for them.
#pragma once

#include "bindings/arrays.h"
#include "magshell/assembly/model.h"

namespace magshell::bindings {

// As rows (center, rotation, translation) of the motions: (k, 3, 3), the layout in which they came.
inline Array rows_of(const std::vector<Motion>& motions) {
    Array rows({static_cast<py::ssize_t>(motions.size()), py::ssize_t{3}, py::ssize_t{3}});
    for (std::size_t k = 0; k < motions.size(); ++k) {
        const Vec3* vectors[3] = {&motions[k].centre, &motions[k].rotation_vector, &motions[k].translation};
        for (int row = 0; row < 3; ++row)
            for (int c = 0; c < 3; ++c) rows.mutable_at(k, row, c) = (*vectors[row])[c];
    }
    return rows;
}

// As rows of the laws: (k, 5), the layout in which they came.
inline Array rows_of(const std::vector<ContactLaw>& contacts) {
    Array rows({static_cast<py::ssize_t>(contacts.size()), py::ssize_t{5}});
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        const ContactLaw& law = contacts[k];
        const double numbers[5] = {law.stiffness, law.smoothing, law.offset, law.friction,
                                   law.sticking_speed};
        for (int n = 0; n < 5; ++n) rows.mutable_at(k, n) = numbers[n];
    }
    return rows;
}

// Centers and rotation vectors, (k, 2, 3).
inline Array rows_of(const std::vector<Placement>& placements) {
    Array rows({static_cast<py::ssize_t>(placements.size()), py::ssize_t{2}, py::ssize_t{3}});
    for (std::size_t k = 0; k < placements.size(); ++k)
        for (int c = 0; c < 3; ++c) {
            rows.mutable_at(k, 0, c) = placements[k].center[c];
            rows.mutable_at(k, 1, c) = placements[k].rotation_vector[c];
        }
    return rows;
}

inline py::dict to_dict(const Model& model, const SceneGradient& g) {
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
    result["water"] =
        py::dict(py::arg("fluid_density") = g.water.fluid_density, py::arg("velocity") = g.water.velocity,
                 py::arg("drag_coefficient") = g.water.drag_coefficient,
                 py::arg("thrust_coefficient") = g.water.thrust_coefficient,
                 py::arg("added_mass") = g.water.added_mass);
    result["contacts"] = rows_of(g.contacts);
    result["placements"] = rows_of(g.obstacles);
    result["applied_flux_density"] = g.controls.flux_density;
    result["field_factor"] = g.controls.field;
    result["load_factor"] = g.controls.load;
    result["gravity_factor"] = g.controls.gravity;
    result["motion_factor"] = g.controls.motion;
    return result;
}

}  // namespace magshell::bindings
