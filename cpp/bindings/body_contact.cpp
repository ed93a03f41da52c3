// What touches in a state, for results.
#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/core/errors.h"
#include "magshell/scene/model.h"
#include "magshell/term/body_contact_term.h"

namespace magshell::bindings {
namespace {

// The pairs of all contacts: (contact (n,), the caller's vertices (n, 4), -1 where there are fewer, distances (n,) [m],
// normal forces (n,) [N], forces (n, 4, 3) [N]).
py::tuple touching_pairs(Model& model, const VectorXd& q) {
    std::vector<BodyContactTerm::Touch> all;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        if (!model.has_body_contact()) throw InvalidInput("the scene has no contact of bodies");
        all = model.body_contact()->touches(q.data());
    }
    const py::ssize_t n = static_cast<py::ssize_t>(all.size());
    IndexArray contacts(n), vertices({n, py::ssize_t{4}});
    Array distances(n), normal_forces(n), forces({n, py::ssize_t{4}, py::ssize_t{3}});
    for (py::ssize_t k = 0; k < n; ++k) {
        const BodyContactTerm::Touch& touch = all[k];
        const PairVectors gradient = touch.at.gradient();
        contacts.mutable_at(k) = touch.near.contact;
        distances.mutable_at(k) = touch.at.near().distance;
        normal_forces.mutable_at(k) = touch.at.normal_force();
        for (int i = 0; i < 4; ++i) {
            const bool there = i < touch.at.count();
            vertices.mutable_at(k, i) = there ? model.nodes().user_vertex(touch.near.pair.nodes[i]) : -1;
            for (int axis = 0; axis < 3; ++axis)
                forces.mutable_at(k, i, axis) = there ? -gradient[i][axis] : 0.0;
        }
    }
    return py::make_tuple(contacts, vertices, distances, normal_forces, forces);
}

}  // namespace

void register_body_contact(py::module_& module) {
    module.def("touching_pairs", &touching_pairs, py::arg("model"), py::arg("q"),
               "Pairs of bodies in contact: contact (n,), vertices (n, 4), distances (n,), normal forces "
               "(n,), forces "
               "(n, 4, 3).");
}

}  // namespace magshell::bindings
