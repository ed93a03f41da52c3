// The model of a scene to Python: checked arrays in, numbers out. Scene in the package builds it.
#include "magshell/scene/model.h"

#include <map>
#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/solid.h"
#include "bindings/strains.h"
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
        held.push_back(
            {nodes.at(k, 0), nodes.at(k, 1), frame, {nodes.at(k, 2), nodes.at(k, 3), nodes.at(k, 4)}});
    }
    return held;
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

std::vector<ContactSurfaceInput> contact_surfaces_of(const py::list& given) {
    std::vector<ContactSurfaceInput> surfaces;
    for (const py::handle each : given) {
        ContactSurfaceInput& surface = surfaces.emplace_back();
        surface.name = each["name"].cast<std::string>();
        surface.numbers = each["numbers"].cast<std::vector<Index>>();
        const IndexArray faces = each["faces"].cast<IndexArray>();
        for (py::ssize_t f = 0; f < faces.shape(0); ++f)
            surface.faces.push_back({faces.at(f, 0), faces.at(f, 1), faces.at(f, 2)});
    }
    return surfaces;
}

std::vector<BodyContactInput> body_contacts_of(const py::list& given) {
    std::vector<BodyContactInput> contacts;
    for (const py::handle each : given)
        contacts.push_back({each["a"].cast<Index>(), each["b"].cast<Index>(), each["penalty"].cast<bool>(),
                            each["rubs"].cast<bool>(), each["lagged"].cast<bool>()});
    return contacts;
}

std::vector<SheetInput> sheets_of(const py::list& given) {
    std::vector<SheetInput> sheets;
    for (const py::handle each : given) {
        SheetInput& sheet = sheets.emplace_back();
        sheet.owner = each["owner"].cast<std::string>();
        sheet.mesh = each["mesh"].cast<std::shared_ptr<TriangleMesh>>();
        sheet.vertices = each["vertices"].cast<std::vector<Index>>();
        sheet.curvature_scale = to_vector(each["curvature_scale"].cast<Array>());
        sheet.directors = each["directors"].cast<bool>();
        sheet.magnetic = each["magnetic"].cast<bool>();
        sheet.directed_edges = directed_edges(each["directed_edges"].cast<IndexArray>());
    }
    return sheets;
}

std::vector<PressureInput> pressures_of(const py::list& given) {
    std::vector<PressureInput> pressures;
    for (const py::handle each : given)
        pressures.push_back({each["owner"].cast<std::string>(), each["rows"].cast<Index>(),
                             each["nodes_per_face"].cast<int>(), each["nodes"].cast<std::vector<Index>>(),
                             each["row"].cast<std::vector<Index>>()});
    return pressures;
}

std::vector<RigidInput> rigid_of(const py::list& given) {
    std::vector<RigidInput> rigid;
    for (const py::handle each : given)
        rigid.push_back({each["owner"].cast<std::string>(), to_rows3(each["points"].cast<Array>()),
                         each["vertices"].cast<std::vector<Index>>(), each["magnetic"].cast<bool>()});
    return rigid;
}

Vec3 to_vec3(const py::handle& given) {
    const Array numbers = given.cast<Array>();
    return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

JointKind joint_kind(const std::string& name) {
    const std::map<std::string, JointKind> kinds = {{"free", JointKind::free},
                                                    {"fixed", JointKind::fixed},
                                                    {"revolute", JointKind::revolute},
                                                    {"prismatic", JointKind::prismatic},
                                                    {"ball", JointKind::ball}};
    return kinds.at(name);
}

std::vector<SkeletonInput> skeletons_of(const py::list& given) {
    std::vector<SkeletonInput> skeletons;
    for (const py::handle each : given) {
        SkeletonInput& skeleton = skeletons.emplace_back();
        skeleton.links = each["links"].cast<std::vector<Index>>();
        skeleton.owners = each["owners"].cast<std::vector<std::string>>();
        for (const py::handle joint : each["joints"])
            skeleton.joints.push_back({joint_kind(joint["kind"].cast<std::string>()),
                                       joint["parent"].cast<Index>(), to_vec3(joint["origin"]),
                                       to_vec3(joint["axis"])});
    }
    return skeletons;
}

std::vector<ClosureInput> closures_of(const py::list& given) {
    std::vector<ClosureInput> closures;
    for (const py::handle each : given)
        closures.push_back({each["owner"].cast<std::string>(), each["parent"].cast<Index>(),
                            each["child"].cast<Index>(), to_vec3(each["place"])});
    return closures;
}

std::unique_ptr<Model> make_model(const py::kwargs& given) {
    const auto array = [&](const char* name) { return given[name].cast<Array>(); };
    const auto indices = [&](const char* name) { return given[name].cast<IndexArray>(); };
    SceneInput input;
    input.n_vertices = given["n_vertices"].cast<Index>();
    input.original = given["original"].cast<std::vector<Index>>();
    input.sheets = sheets_of(given["sheets"]);
    input.solids = solids_of(given["solids"]);
    input.skins = skins_of(given["skins"]);
    input.rigid = rigid_of(given["rigid"]);
    input.skeletons = skeletons_of(given["skeletons"]);
    input.closures = closures_of(given["closures"]);
    input.directions = to_rows3(array("directions"));
    input.held = held_nodes(indices("held_nodes"), array("held_frames"));
    input.moves = given["moves"].cast<Index>();
    const IndexArray couples = indices("couples");
    for (py::ssize_t k = 0; k < couples.shape(0); ++k)
        input.couples.push_back({couples.at(k, 0), couples.at(k, 1), couples.at(k, 2)});
    for (const py::handle each : given["face_energies"])
        input.face_energies.push_back({each["owner"].cast<std::string>(), each["body"].cast<Index>(),
                                       each["energy"].cast<std::shared_ptr<FaceEnergy>>()});
    input.pressures = pressures_of(given["pressures"]);
    input.volumes = volumes_of(given["volumes"]);
    input.tendons = tendons_of(given["tendons"]);
    input.gravity = given["gravity"].cast<bool>();
    input.loads = given["loads"].cast<bool>();
    for (const py::handle source : given["field_sources"])
        input.field_sources.push_back(source.cast<std::shared_ptr<AppliedField>>());
    input.contacts = contacts_of(given["contacts"]);
    input.contact_surfaces = contact_surfaces_of(given["contact_surfaces"]);
    input.body_contacts = body_contacts_of(given["body_contacts"]);
    for (const py::handle obstacle : given["obstacles"])
        input.obstacles.push_back(obstacle.cast<std::shared_ptr<Obstacle>>());
    input.water = given["water"].cast<std::shared_ptr<Water>>();
    const py::gil_scoped_release unlocked;
    return std::make_unique<Model>(input);
}

// (owner, name, unit, first, rows, width) of each.
py::list entries_of(const Parameters& parameters) {
    py::list entries;
    for (const Parameters::Entry& entry : parameters.entries())
        entries.append(py::make_tuple(entry.owner, entry.name, entry.unit, entry.slot.first, entry.slot.rows,
                                      entry.slot.width));
    return entries;
}

py::dict energies(const Model& model, const VectorXd& q, const Controls& controls) {
    std::vector<std::pair<std::string_view, double>> of_terms;
    {
        const py::gil_scoped_release unlocked;
        of_terms = model.energies(q, controls);
    }
    py::dict energies;
    for (const auto& [name, value] : of_terms) {  // terms of one name, of several bodies, as one
        const py::str key(name.data(), name.size());
        energies[key] = value + (energies.contains(key) ? energies[key].cast<double>() : 0.0);
    }
    return energies;
}

// The lower triangle as (size, column starts, rows, values): of all unknowns, or of the free ones.
py::tuple hessian(Model& model, const VectorXd& q, const Controls& controls, bool reduced) {
    LargeVector<double> values;
    std::vector<Index> starts, rows;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        model.evaluate(q, controls);
        model.assemble(q, controls, false);
        model.require_symmetric();
        if (reduced) {
            model.reduce_matrix(values);
            model.reduction().add_curvature(model.residual().gradient, values);
            starts = model.reduction().pattern()->column_starts;
            rows = model.reduction().pattern()->rows;
        } else {
            merge(model.matrix(), model.contact_matrix(), starts, rows, values);
        }
    }
    return py::make_tuple(starts.size() - 1, py::array_t<Index>(starts.size(), starts.data()),
                          py::array_t<Index>(rows.size(), rows.data()),
                          py::array_t<double>(values.size(), values.data()));
}

std::vector<Index> recut_faces(const Model& model) {
    std::vector<Index> faces;
    Index first = 0;  // of a body, in the numbers of all
    for (Index body = 0; body < static_cast<Index>(model.bodies().sheets().size()); ++body) {
        const Sheet& sheet = *model.bodies().sheets()[body];
        for (Index f = 0; f < sheet.n_faces(); ++f)
            if (model.membrane_faces(body).shares(f)[1].part > 0.0)
                faces.push_back(first + sheet.faces.user[f]);
        first += sheet.n_faces();
    }
    return faces;
}

// (n_f, 4): of the membrane and of bending. Reads nothing that a solve of another thread changes.
PrincipalStrains strains_at(const Model& model, const VectorXd& q, const VectorXd& thickness) {
    const py::gil_scoped_release unlocked;
    return principal_strains(model, q, thickness);
}

py::tuple largest_at(const Model& model, const VectorXd& q, const VectorXd& thickness) {
    return to_tuple(largest_of(strains_at(model, q, thickness)));
}

}  // namespace

void register_model(py::module_& module) {
    py::class_<Model>(module, "Model")
        .def(py::init(&make_model))
        .def_property_readonly(
            "parameters", [](const Model& m) { return entries_of(m.registry().values); },
            "(owner, name, unit, first, rows, width) of each, in the flat vector of set_values.")
        .def_property_readonly(
            "controls", [](const Model& m) { return entries_of(m.registry().controls); },
            "Likewise, in the flat vectors of controls.")
        .def(
            "set_values",
            [](Model& model, const Array& values) {
                const VectorXd given = to_vector(values);
                if (given.size() != model.registry().values.size())
                    throw InvalidInput("the scene has " + std::to_string(model.registry().values.size()) +
                                       " values, got " + std::to_string(given.size()));
                const py::gil_scoped_release
                    unlocked;  // a solve that holds the lock may be waiting for the GIL
                const std::lock_guard lock(model.in_use());
                model.set_values(given);
            },
            "All of them, rows in the caller's order.")
        .def_property_readonly("size", &Model::size)
        .def_property_readonly(
            "recut_faces", &recut_faces,
            "The caller's faces (k,) whose stretch is measured on other triangles than their own.")
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
        .def_property_readonly("n_strains", &Model::n_strains)
        .def("rest_state", [](const Model& m) { return m.bodies().rest_state(); })
        .def("state",
             [](const Model& m, const Array& x, const Array& r) {
                 VectorXd q = m.bodies().state(to_rows3(x), to_vector(r));
                 m.reduction().settle(q, nullptr);
                 return q;
             })
        .def(
            "settled_velocity",
            [](const Model& m, const VectorXd& q, VectorXd v) {
                VectorXd at = q;
                m.reduction().settle(at, &v);
                return v;
            },
            "Velocities of all unknowns, with those of rigid parts as their vertices say.")
        .def(
            "points", [](const Model& m, const VectorXd& q) { return m.bodies().points(q); },
            "Positions, then the own points of rigid parts (10 each).")
        .def(
            "full_vector",
            [](const Model& m, const Array& rows) { return m.bodies().vectors(to_rows3(rows)); },
            "Rows of the caller's vertices (n_v, 3) among all unknowns, zero elsewhere.")
        .def("positions", [](const Model& m, const VectorXd& q) { return m.bodies().positions(q); })
        .def("edge_rotations", [](const Model& m, const VectorXd& q) { return m.bodies().edge_rotations(q); })
        .def("principal_strains", &strains_at, py::arg("q"), py::arg("thickness"))
        .def("largest_strains", &largest_at, py::arg("q"), py::arg("thickness"))
        .def("expand", [](const Model& m, const VectorXd& reduced) { return m.reduction().expand(reduced); })
        .def("reduce", [](const Model& m, const VectorXd& full) { return m.reduction().vector(full); })
        .def(
            "free_weights",
            [](const Model& m, const Array& of_vertices) {
                return m.reduction().weights(m.bodies().vertex_weights(to_vector(of_vertices)));
            },
            "Masses, say, of the caller's vertices (n_v,) among the free unknowns; zero elsewhere.")
        .def(
            "free_weight_values",
            [](const Model& m, const Array& of_points) {
                LargeVector<double> values(m.reduction().pattern()->rows.size(), 0.0);
                m.reduction().add_weights(m.bodies().vertex_weights(to_vector(of_points)), values);
                return py::array_t<double>(values.size(), values.data());
            },
            "The same as a matrix, in the places of hessian(): with rigid parts it is no diagonal. At the "
            "state that was "
            "evaluated last.")
        .def(
            "prescribed_rate",
            [](const Model& m, const Controls& controls) { return m.reduction().prescribed_rate(controls); },
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
        .def("refusal", &Model::refusal, "What is wrong with a state, in words; empty where nothing is.",
             py::call_guard<py::gil_scoped_release>())
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
        .def(
            "low_rank",
            [](Model& model, bool reduced) {
                const std::lock_guard lock(model.in_use());
                const LowRank& rest = model.low_rank();
                return py::make_tuple(
                    reduced ? rest.reduced(model.reduction(), model.size()) : rest.columns(model.size()),
                    rest.stiffness());
            },
            py::arg("reduced") = true,
            "What hessian(), called last, leaves out: columns u (n, k) and stiffnesses s (k,), the sum of s "
            "u u^T. Of "
            "cavities, cells and tendons, which couple all of their nodes.")
        .def("hessian", &hessian, py::arg("q"), py::arg("controls"), py::arg("reduced") = true);
}

}  // namespace magshell::bindings
