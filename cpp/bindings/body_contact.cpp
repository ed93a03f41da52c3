// Binds the contact state of bodies, for results.
#include <algorithm>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/contact/pair_friction.h"
#include "magshell/core/errors.h"
#include "magshell/scene/model.h"
#include "magshell/terms/contact/body_contact_term.h"

namespace magshell::bindings {
namespace {

// Returns the active pairs of all contacts at q, with the velocities v of all degrees of freedom. Entries that
// pairs of fewer vertices do not have are -1 and zero.
py::dict contact_pair_stiffness(Model& model, const VectorXd& q, const VectorXd& v) {
    std::vector<BodyContactTerm::ActiveContact> all;
    std::vector<FrictionLaw> laws;
    std::vector<SlipStencil> stencils;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        if (!model.contacts().bodies()) throw InvalidInput("the scene has no contact of bodies");
        if (q.size() != model.size() || v.size() != model.size())
            throw InvalidInput("q and v must have one number per degree of freedom, " +
                               std::to_string(model.size()) + ", got " + std::to_string(q.size()) + " and " +
                               std::to_string(v.size()));
        all = model.contacts().bodies()->active_contacts(q.data());
        for (const BodyContactTerm::ActiveContact& touch : all)
            laws.push_back(model.contacts().bodies()->friction(touch));
        for (const BodyContactTerm::ActiveContact& touch : all)
            stencils.push_back(model.contacts().bodies()->slip_stencil(touch.near, q.data()));
    }
    const py::ssize_t n = static_cast<py::ssize_t>(all.size());
    IndexArray contacts(n), vertices({n, py::ssize_t{4}});
    py::array_t<bool> swapped(n);
    Array distances(n), normal_forces(n), forces({n, py::ssize_t{4}, py::ssize_t{3}});
    Array weights({n, py::ssize_t{4}}), normals({n, py::ssize_t{3}});
    constexpr py::ssize_t most = slip_nodes;
    IndexArray slip_vertices({n, most});
    Array vertex_friction({n, most, py::ssize_t{3}});
    Array friction({n, py::ssize_t{3}}), sliding({n, py::ssize_t{3}});
    for (py::ssize_t k = 0; k < n; ++k) {
        const BodyContactTerm::ActiveContact& touch = all[k];
        const Proximity& near = touch.at.near();
        const PairVectors gradient = touch.at.gradient();
        contacts.mutable_at(k) = touch.near.contact;
        swapped.mutable_at(k) = touch.near.swapped;
        distances.mutable_at(k) = near.distance;
        normal_forces.mutable_at(k) = touch.at.normal_force();
        for (int i = 0; i < 4; ++i) {
            const bool there = i < touch.at.count();
            vertices.mutable_at(k, i) = there ? model.nodes().user_vertex(touch.near.pair.nodes[i]) : -1;
            weights.mutable_at(k, i) = there ? near.weights[i] : 0.0;
            for (int axis = 0; axis < 3; ++axis)
                forces.mutable_at(k, i, axis) = there ? -gradient[i][axis] : 0.0;
        }
        const PairFriction pair(touch.at, stencils[k], stencils[k].of(v.data()), laws[k]);
        const Vec3 &force = pair.friction().force, &along = pair.slip();
        const SlipVectors on_nodes = pair.force();
        for (int i = 0; i < slip_nodes; ++i) {
            slip_vertices.mutable_at(k, i) =
                i < pair.count() ? model.nodes().user_vertex(stencils[k].nodes[i]) : -1;
            std::copy_n(on_nodes[i].data(), 3, vertex_friction.mutable_data(k, i, 0));
        }
        for (int axis = 0; axis < 3; ++axis) {
            normals.mutable_at(k, axis) = near.normal[axis];
            friction.mutable_at(k, axis) = force[axis];
            sliding.mutable_at(k, axis) = along[axis];
        }
    }
    py::dict found;
    found["contacts"] = contacts;
    found["pairs"] = vertices;
    found["swapped"] = swapped;
    found["distances"] = distances;
    found["normal_forces"] = normal_forces;
    found["forces"] = forces;
    found["weights"] = weights;
    found["normals"] = normals;
    found["friction_forces"] = friction;
    found["sliding_velocities"] = sliding;
    found["slip_vertices"] = slip_vertices;
    found["vertex_friction_forces"] = vertex_friction;
    return found;
}

std::pair<double, std::string> nearest_neighbours(Model& model, Index contact) {
    const std::lock_guard lock(model.in_use());
    if (!model.contacts().bodies() || contact < 0 ||
        contact >= static_cast<Index>(model.contacts().bodies()->n_contacts()))
        throw InvalidInput("the scene has no such contact of bodies");
    return model.contacts().bodies()->nearest_neighbours(contact);
}

}  // namespace

void register_body_contact(py::module_& module) {
    module.def(
        "nearest_neighbours", &nearest_neighbours, py::arg("model"), py::arg("contact"),
        "Of a contact of bodies, by its number, the neighbours along a surface that are nearest each other "
        "at rest, if "
        "that is nearer than twice its reach and minimal distance: how far [m], and their faces in words.");
    module.def(
        "touching_pairs", &contact_pair_stiffness, py::arg("model"), py::arg("q"), py::arg("v"),
        "Pairs of bodies in contact: contacts (n,), pairs (n, 4), distances (n,) [m], normal_forces (n,) "
        "[N], "
        "forces (n, 4, 3) [N], weights (n, 4) of the difference of the closest points, normals (n, 3) on the "
        "first part, friction_forces (n, 3) [N] on it and sliding_velocities (n, 3) [m/s] of it; "
        "vertex_friction_forces (n, 5, 3) [N] on slip_vertices (n, 5), which have no moment.");
}

}  // namespace magshell::bindings
