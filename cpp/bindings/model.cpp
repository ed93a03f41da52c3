// The model of a scene to Python: checked arrays in, numbers out. Scene in the package builds it.
#include "magshell/assembly/model.h"

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/core/errors.h"

namespace magshell::bindings {
namespace {

std::vector<DirectedEdge> directed_edges(const IndexArray& pairs) {
    std::vector<DirectedEdge> edges;
    for (py::ssize_t k = 0; k < pairs.shape(0); ++k) edges.push_back({pairs.at(k, 0), pairs.at(k, 1)});
    return edges;
}

std::vector<HeldNode> held_nodes(const IndexArray& nodes, const Array& frames) {
    std::vector<HeldNode> held;
    for (py::ssize_t k = 0; k < nodes.shape(0); ++k) {
        Mat3 frame;
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) frame(r, c) = frames.at(k, r, c);
        held.push_back({nodes.at(k, 0), nodes.at(k, 1), frame, nodes.at(k, 2)});
    }
    return held;
}

std::vector<Motion> motions_of(const Array& rows) {
    std::vector<Motion> motions;
    for (py::ssize_t k = 0; k < rows.shape(0); ++k)
        motions.push_back({Vec3(rows.data(k, 0)), Vec3(rows.data(k, 1)), Vec3(rows.data(k, 2))});
    return motions;
}

std::vector<ContactInput> contacts_of(const py::list& given) {
    std::vector<ContactInput> contacts;
    for (const py::handle each : given) {
        ContactInput& contact = contacts.emplace_back();
        contact.obstacles = each["obstacles"].cast<std::vector<Index>>();
        contact.rubs = each["rubs"].cast<bool>();
        contact.lagged = each["lagged"].cast<bool>();
        const IndexArray vertices = each["vertices"].cast<IndexArray>();
        const Array weights = each["weights"].cast<Array>();
        for (py::ssize_t p = 0; p < vertices.shape(0); ++p)
            contact.points.push_back(
                {{vertices.at(p, 0), vertices.at(p, 1), vertices.at(p, 2)}, Vec3(weights.data(p, 0))});
    }
    return contacts;
}

std::vector<ContactLaw> contact_laws_of(const Array& rows) {
    std::vector<ContactLaw> laws;
    for (py::ssize_t k = 0; k < rows.shape(0); ++k)
        laws.push_back({rows.at(k, 0), rows.at(k, 1), rows.at(k, 2), rows.at(k, 3), rows.at(k, 4)});
    return laws;
}

std::vector<PlacedObstacle> obstacles_of(const py::list& shapes, const Array& placements) {
    std::vector<PlacedObstacle> placed;
    for (py::size_t k = 0; k < shapes.size(); ++k)
        placed.push_back({shapes[k].cast<std::shared_ptr<Obstacle>>(),
                          {Vec3(placements.data(k, 0)), Vec3(placements.data(k, 1))}});
    return placed;
}

SceneValues values_of(const py::dict& given) {
    const auto array = [&](const char* name) { return given[name].cast<Array>(); };
    SceneValues values;
    const Array thickness = array("thickness"), young = array("young_modulus"),
                poisson = array("poisson_ratio");
    for (py::ssize_t f = 0; f < thickness.size(); ++f)
        values.materials.push_back({thickness.at(f), young.at(f), poisson.at(f)});
    values.curvature_scale = to_vector(array("curvature_scale"));
    values.vertex_mass = to_vector(array("vertex_mass"));
    values.gravity = to_vector(array("gravity"));
    values.vertex_loads = to_rows3(array("vertex_loads"));
    values.couples = to_vector(array("couples"));
    values.motions = motions_of(array("motions"));
    for (const py::handle source : given["field_sources"])
        values.field_sources.push_back(source.cast<std::shared_ptr<AppliedField>>());
    values.water = given["water"].cast<std::shared_ptr<Water>>();
    values.contacts = contact_laws_of(array("contacts"));
    values.obstacles = obstacles_of(given["obstacles"], array("placements"));
    return values;
}

std::unique_ptr<Model> make_model(const std::shared_ptr<TriangleMesh>& mesh, const py::dict& values,
                                  const py::kwargs& given) {
    const auto array = [&](const char* name) { return given[name].cast<Array>(); };
    const auto indices = [&](const char* name) { return given[name].cast<IndexArray>(); };
    SceneInput input(*mesh);
    input.directors = given["directors"].cast<bool>();
    input.directed_edges = directed_edges(indices("directed_edges"));
    input.directions = to_rows3(array("directions"));
    input.held = held_nodes(indices("held_nodes"), array("held_frames"));
    const IndexArray couple_edges = indices("couple_edges");
    for (py::ssize_t k = 0; k < couple_edges.shape(0); ++k)
        input.couples.push_back({couple_edges.at(k, 0), couple_edges.at(k, 1)});
    input.magnetic = given["magnetic"].cast<bool>();
    input.contacts = contacts_of(given["contacts"]);
    input.values = values_of(values);
    const py::gil_scoped_release unlocked;
    return std::make_unique<Model>(std::move(input));
}

py::dict energies(const Model& model, const VectorXd& q, const Controls& controls) {
    std::vector<std::pair<std::string_view, double>> of_terms;
    {
        const py::gil_scoped_release unlocked;
        of_terms = model.energies(q, controls);
    }
    py::dict energies;
    for (const auto& [name, value] : of_terms) energies[py::str(name.data(), name.size())] = value;
    return energies;
}

// The lower triangle as (size, column starts, rows, values): of all unknowns, or of the free ones.
py::tuple hessian(Model& model, const VectorXd& q, const Controls& controls, bool reduced) {
    LargeVector<double> values;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        model.evaluate(q, controls);
        model.assemble(q, controls, false);
        if (reduced)
            model.reduction().matrix(model.matrix(), values);
        else
            values = model.matrix().values();
    }
    const SparsePattern& pattern = *model.reduction().pattern();
    const auto& starts = reduced ? pattern.column_starts : model.matrix().column_starts();
    const auto& rows = reduced ? pattern.rows : model.matrix().rows();
    return py::make_tuple(starts.size() - 1, py::array_t<Index>(starts.size(), starts.data()),
                          py::array_t<Index>(rows.size(), rows.data()),
                          py::array_t<double>(values.size(), values.data()));
}

}  // namespace

void register_model(py::module_& module) {
    py::class_<Controls>(module, "Controls")
        .def(py::init([](const Vec3& flux_density, double field, double load, double gravity, double motion) {
                 return Controls{flux_density, field, load, gravity, motion, {}};
             }),
             py::kw_only(), py::arg("flux_density") = Vec3::Zero().eval(), py::arg("field") = 0.0,
             py::arg("load") = 0.0, py::arg("gravity") = 0.0, py::arg("motion") = 0.0)
        .def_readonly("flux_density", &Controls::flux_density)
        .def_readonly("field", &Controls::field)
        .def_readonly("load", &Controls::load)
        .def_readonly("gravity", &Controls::gravity)
        .def_readonly("motion", &Controls::motion)
        .def("towards", &interpolate, py::arg("to"), py::arg("parameter"));

    py::class_<Model>(module, "Model")
        .def(py::init(&make_model), py::arg("mesh"), py::arg("values"))
        .def("set_values",
             [](Model& model, const py::dict& values) {
                 const SceneValues given = values_of(values);
                 const py::gil_scoped_release unlocked;
                 const std::lock_guard lock(model.in_use());
                 model.set_values(given);
             })
        .def("set_magnetization",
             [](Model& model, const Array& magnetization) {
                 const Rows3 rows = to_rows3(magnetization);
                 const py::gil_scoped_release
                     unlocked;  // a solve that holds the lock may be waiting for the GIL
                 const std::lock_guard lock(model.in_use());
                 model.set_magnetization(rows);
             })
        .def_property_readonly("size", &Model::size)
        .def_property_readonly("analyses", &Model::analyses)
        .def_property_readonly(
            "free_points",
            [](const Model& model) {
                const std::vector<Vec3> points = model.free_points();
                Rows3 rows(points.size(), 3);
                for (std::size_t k = 0; k < points.size(); ++k)
                    rows.row(static_cast<Eigen::Index>(k)) = points[k].transpose();
                return rows;
            },
            "Where each free unknown is at rest (n, 3) [m]: its vertex, or the middle of its edge.")
        .def_property_readonly("free_size", [](const Model& m) { return m.reduction().size(); })
        .def_property_readonly("bytes", &Model::bytes)
        .def("rest_state", &Model::rest_state)
        .def("state", [](const Model& m, const Array& x,
                         const Array& r) { return m.state(to_rows3(x), to_vector(r)); })
        .def(
            "full_vector",
            [](const Model& m, const Array& rows) {
                return m.gradient_by_state(to_rows3(rows), VectorXd::Zero(m.sheet().n_edges()));
            },
            "Rows of the caller's vertices (n_v, 3) among all unknowns, zero elsewhere.")
        .def("positions", &Model::positions)
        .def("edge_rotations", &Model::edge_rotations)
        .def("expand", [](const Model& m, const VectorXd& reduced) { return m.reduction().expand(reduced); })
        .def("reduce", [](const Model& m, const VectorXd& full) { return m.reduction().vector(full); })
        .def(
            "free_weights",
            [](const Model& m, const Array& of_vertices) {
                return m.reduction().weights(m.vertex_weights(to_vector(of_vertices)));
            },
            "Masses, say, of the caller's vertices (n_v,) among the free unknowns; zero elsewhere.")
        .def(
            "prescribed_rate",
            [](const Model& m, double progress) { return m.reduction().prescribed_rate(progress); },
            "d(all unknowns)/d(progress) of what moving supports hold; zero elsewhere.")
        .def("energy", &Model::energy, py::call_guard<py::gil_scoped_release>())
        .def_property_readonly("term_names",
                               [](const Model& model) {
                                   py::list names;
                                   for (const std::string_view name : model.term_names())
                                       names.append(py::str(name.data(), name.size()));
                                   return names;
                               })
        .def("energies", &energies)
        .def(
            "gradient",
            [](Model& model, const VectorXd& q, const Controls& controls) {
                const std::lock_guard lock(model.in_use());
                model.evaluate(q, controls);
                return model.residual().gradient;
            },
            py::call_guard<py::gil_scoped_release>())
        .def(
            "assemble",
            [](Model& model, const VectorXd& q, const Controls& controls) {
                const std::lock_guard lock(model.in_use());
                model.evaluate(q, controls);
                model.assemble(q, controls, false);
            },
            "Gradient and Hessian, left in the core: what `python -m magshell.bench kernels` times.",
            py::call_guard<py::gil_scoped_release>())
        .def("hessian", &hessian, py::arg("q"), py::arg("controls"), py::arg("reduced") = true);
}

}  // namespace magshell::bindings
