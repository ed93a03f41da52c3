// Binds the model of a scene: checked arrays in, numbers out. The Python class Scene creates it.
#include "magshell/scene/model.h"

#include <optional>
#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/model_numbers.h"
#include "bindings/operator_part.h"
#include "bindings/scene_input.h"
#include "magshell/assembly/hessian_operator.h"
#include "magshell/core/errors.h"
#include "magshell/mesh/space_filling_order.h"
#include "magshell/solve/linear_response.h"
#include "magshell/terms/magnetic/applied_field_term.h"
#include "magshell/terms/magnetic/own_field_term.h"

namespace magshell::bindings {
namespace {

// Returns the orders of the elements of all bodies, in the order in which a scene numbers them.
std::vector<Renumbering> element_orders(const Bodies& bodies) {
    std::vector<Renumbering> orders;
    for (const Shell* shell : bodies.shells()) orders.push_back(shell->faces);
    for (const Solid* solid : bodies.solids()) {
        orders.push_back(solid->elements);
        if (solid->surface()) orders.push_back(solid->surface()->faces);
    }
    for (const SixNodeShell* shell : bodies.six_node_shells()) orders.push_back(shell->faces);
    for (std::size_t k = bodies.shells().size() + bodies.solids().size(); k < bodies.faces().size(); ++k)
        if (const Surface* surface = bodies.faces()[k].surface) orders.push_back(surface->faces);
    return orders;
}

// numbered_like: a model of the same scene in another rest shape, whose numbering the new one gets.
std::unique_ptr<Model> make_model(const py::kwargs& given) {
    const SceneInput input = scene_input(given);
    std::optional<ScopedOrders> orders;
    if (given.contains("numbered_like"))
        orders.emplace(element_orders(given["numbered_like"].cast<const Model&>().bodies()));
    const py::gil_scoped_release unlocked;
    return std::make_unique<Model>(input);
}

// Returns (owner, name, unit, first, rows, width) of each parameter.
py::list entries_of(const Parameters& parameters) {
    py::list entries;
    for (const Parameters::Entry& entry : parameters.entries())
        entries.append(py::make_tuple(entry.owner, entry.name, entry.unit, entry.slice.first,
                                      entry.slice.rows, entry.slice.width));
    return entries;
}

py::dict energies(const Model& model, const VectorXd& q, const LoadParameters& load_parameters) {
    std::vector<std::pair<std::string_view, double>> of_terms;
    {
        const py::gil_scoped_release unlocked;
        of_terms = model.energies(q, load_parameters);
    }
    py::dict energies;
    for (const auto& [name, value] : of_terms) {  // terms of the same name, of several bodies, are summed
        const py::str key(name.data(), name.size());
        energies[key] = value + (energies.contains(key) ? energies[key].cast<double>() : 0.0);
    }
    return energies;
}

// Returns [(name, J)] for each term; terms of the same name, of several bodies, are consecutive.
py::list term_energies(Model& model, const VectorXd& q, const Model::AngleBranches& angle_branches,
                       const LoadParameters& load_parameters) {
    std::vector<std::pair<std::string_view, double>> of_terms;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        model.set_angle_branches(angle_branches);
        of_terms = model.energies(q, load_parameters);
    }
    py::list energies;
    for (const auto& [name, value] : of_terms)
        energies.append(py::make_tuple(py::str(name.data(), name.size()), value));
    return energies;
}

// Returns the Hessian of the free dofs in three parts: the lower triangle as hessian() has it, (columns, stiffnesses) of low rank, and an
// OperatorPart or None.
py::tuple hessian_parts(const py::object& owner, const VectorXd& q, const LoadParameters& load_parameters) {
    Model& model = owner.cast<Model&>();
    LargeVector<double> values;
    SparsePattern pattern;
    Eigen::MatrixXd columns;
    VectorXd stiffness;
    OperatorFactor::Operator product;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        model.evaluate(q, load_parameters);
        model.assemble(q, load_parameters, false);
        model.require_symmetric();
        model.reduce_matrix(values);
        model.dof_map().add_curvature(model.residual().gradient, values);
        pattern = *model.dof_map().pattern();
        columns = model.low_rank().reduced(model.dof_map(), model.size());
        stiffness = model.low_rank().stiffness();
        product = model.operator_product(false);
    }
    const Index size = pattern.size;
    const std::shared_ptr<OperatorPart> part =
        product ? std::make_shared<OperatorPart>(owner, q, std::move(product)) : nullptr;
    return py::make_tuple(py::make_tuple(size, given_away(std::move(pattern.column_starts)),
                                         given_away(std::move(pattern.rows)), given_away(std::move(values))),
                          py::make_tuple(columns, stiffness), part);
}

// Returns the lower triangle as (size, column starts, rows, values), of all degrees of freedom or of the free
// ones.
py::tuple hessian(Model& model, const VectorXd& q, const LoadParameters& load_parameters, bool reduced) {
    LargeVector<double> values;
    SparsePattern pattern;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        model.evaluate(q, load_parameters);
        model.assemble(q, load_parameters, false);
        model.require_symmetric();
        model.require_sparse();
        if (reduced) {
            model.reduce_matrix(values);
            model.dof_map().add_curvature(model.residual().gradient, values);
            pattern = *model.dof_map().pattern();
        } else {
            merge(model.matrix(), model.contact_matrix(), pattern.column_starts, pattern.rows, values);
        }
    }
    const std::size_t size = pattern.column_starts.size() - 1;
    return py::make_tuple(size, given_away(std::move(pattern.column_starts)),
                          given_away(std::move(pattern.rows)), given_away(std::move(values)));
}

std::vector<Index> recut_faces(const Model& model) {
    std::vector<Index> faces;
    Index first = 0;  // first face of a body in the numbering of all
    for (Index body = 0; body < static_cast<Index>(model.bodies().shells().size()); ++body) {
        const Shell& sheet = *model.bodies().shells()[body];
        for (Index f = 0; f < sheet.n_faces(); ++f)
            if (model.terms().membrane_faces[body]->parts(f)[1].part > 0.0)
                faces.push_back(first + sheet.faces.user[f]);
        first += sheet.n_faces();
    }
    return faces;
}

// Returns the principal strains of membrane and bending, (n_f, 4). Reads nothing that a solve in another thread
// changes.
PrincipalStrains strains_at(const Model& model, const VectorXd& q, const VectorXd& thickness) {
    const py::gil_scoped_release unlocked;
    return principal_strains(model, q, thickness);
}

py::tuple largest_at(const Model& model, const VectorXd& q, const VectorXd& thickness) {
    return to_tuple(largest_of(strains_at(model, q, thickness)));
}

Rows3 rows_from(const std::vector<Vec3>& vectors) {
    Rows3 rows(static_cast<Eigen::Index>(vectors.size()), 3);
    for (std::size_t k = 0; k < vectors.size(); ++k) rows.row(k) = vectors[k].transpose();
    return rows;
}

Rows3 own_flux_density(const Model& model, const VectorXd& q, const Rows3& at) {
    std::vector<Vec3> points(at.rows());
    for (Eigen::Index k = 0; k < at.rows(); ++k) points[k] = at.row(k).transpose();
    if (!model.terms().own_field) return Rows3::Zero(at.rows(), 3);
    return rows_from(model.terms().own_field->field().flux_density(q.data(), points));
}

}  // namespace

void register_model(py::module_& module) {
    py::class_<SmallDeflection>(module, "SmallDeflection", "How a scene at rest gives way to small forces.")
        .def_readonly("motion", &SmallDeflection::motion,
                      "(n,) of all unknowns; empty where the stiffness is not positive definite")
        .def_readonly("report", &SmallDeflection::report, "of the factorization")
        .def_readonly("unknowns", &SmallDeflection::unknowns, "of the matrix that was factorized");

    py::class_<Model>(module, "Model")
        .def(py::init(&make_model))
        .def_property_readonly(
            "parameters", [](const Model& m) { return entries_of(m.parameters().registry().values); },
            "(owner, name, unit, first, rows, width) of each, in the flat vector of set_values.")
        .def_property_readonly(
            "load_parameters",
            [](const Model& m) { return entries_of(m.parameters().registry().load_parameters); },
            "(owner, name, unit, first, rows, width) of each, in the flat vectors of load parameters.")
        .def(
            "set_values",
            [](Model& model, const Array& values) {
                const VectorXd given = to_vector(values);
                if (given.size() != model.parameters().registry().values.size())
                    throw InvalidInput("the scene has " +
                                       std::to_string(model.parameters().registry().values.size()) +
                                       " values, got " + std::to_string(given.size()));
                const py::gil_scoped_release
                    unlocked;  // a solve that holds the lock may be waiting for the GIL
                const std::lock_guard lock(model.in_use());
                model.parameters().set_values(given);
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
        .def_property_readonly("free_size", [](const Model& m) { return m.dof_map().size(); })
        .def_property_readonly("bytes", &Model::bytes)
        .def_property_readonly("n_strains", [](const Model& m) { return m.elastic().size(); })
        .def("rest_state", [](const Model& m) { return m.bodies().rest_state(); })
        .def("state",
             [](const Model& m, const Array& x, const Array& r) {
                 VectorXd q = m.bodies().state(to_rows3(x), to_vector(r));
                 m.dof_map().project_state(q, nullptr);
                 return q;
             })
        .def(
            "settled_velocity",
            [](const Model& m, const VectorXd& q, VectorXd v) {
                VectorXd at = q;
                m.dof_map().project_state(at, &v);
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
        .def("expand", [](const Model& m, const VectorXd& reduced) { return m.dof_map().expand(reduced); })
        .def("reduce", [](const Model& m, const VectorXd& full) { return m.dof_map().vector(full); })
        .def(
            "free_weights",
            [](const Model& m, const Array& of_vertices) {
                return m.dof_map().weights(m.bodies().vertex_weights(to_vector(of_vertices)));
            },
            "Masses, say, of the caller's vertices (n_v,) among the free unknowns; zero elsewhere.")
        .def(
            "free_weight_values",
            [](const Model& m, const Array& of_points) {
                LargeVector<double> values(m.dof_map().pattern()->rows.size(), 0.0);
                m.dof_map().add_weights(m.bodies().vertex_weights(to_vector(of_points)), values);
                return py::array_t<double>(values.size(), values.data());
            },
            "The same as a matrix, in the places of hessian(): with rigid parts it is no diagonal. At the "
            "state that was "
            "evaluated last.")
        .def(
            "driven_increment",
            [](const Model& m, const VectorXd& q, const LoadParameters& load_parameters) {
                return m.dof_map().prescribed_increment(q, load_parameters);
            },
            py::arg("q"), py::arg("load_parameters"),
            "How far from a state what motors and supports prescribe at these load parameters is, of all "
            "unknowns, "
            "(n,); zero "
            "elsewhere.")
        .def(
            "prescribed_rate",
            [](const Model& m, const LoadParameters& load_parameters) {
                return m.dof_map().prescribed_rate(load_parameters);
            },
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
        .def("term_energies", &term_energies,
             "[(name, J)] of each term, at a state with these branches of angles.", py::arg("q"),
             py::arg("angle_branches"), py::arg("load_parameters"))
        .def(
            "field_sampling_error",
            [](Model& model, const VectorXd& q, const LoadParameters& load_parameters) {
                const std::lock_guard lock(model.in_use());
                for (const std::unique_ptr<Term>& term : model.terms().energies)
                    if (term->name() == "magnetic") term->prepare_assembly(q.data(), load_parameters);
                return model.field_sampling_error(q, load_parameters);
            },
            "The estimate of find_equilibrium's result at a state, from samples of its own.", py::arg("q"),
            py::arg("load_parameters"), py::call_guard<py::gil_scoped_release>())
        .def(
            "refusal",
            [](const Model& model, const VectorXd& q) {
                return model.capabilities().invalid_state_reason(q);
            },
            "What is wrong with a state, in words; empty where nothing is.",
            py::call_guard<py::gil_scoped_release>())
        .def(
            "not_finite",
            [](Model& model, const VectorXd& q, const LoadParameters& load_parameters) {
                const std::lock_guard lock(model.in_use());
                return model.not_finite(q, load_parameters);
            },
            "Which force is not finite at a state, in words; empty where all are.", py::arg("q"),
            py::arg("load_parameters"), py::call_guard<py::gil_scoped_release>())
        .def(
            "gradient",
            [](Model& model, const VectorXd& q, const LoadParameters& load_parameters) {
                const std::lock_guard lock(model.in_use());
                model.evaluate(q, load_parameters);
                return model.residual().gradient;
            },
            py::call_guard<py::gil_scoped_release>())
        .def(
            "driving",
            [](Model& model, const VectorXd& q, const LoadParameters& load_parameters,
               const Model::AngleBranches& angle_branches) {
                const std::lock_guard lock(model.in_use());
                model.set_angle_branches(angle_branches);
                model.evaluate(q, load_parameters);
                return model.dof_map().motor_forces(model.residual().gradient);
            },
            py::arg("q"), py::arg("load_parameters"), py::arg("angle_branches"),
            "What the motors of joints do in an equilibrium q, N and N m, one after another.",
            py::call_guard<py::gil_scoped_release>())
        .def(
            "held_forces",
            [](Model& model, const VectorXd& q, const Model::AngleBranches& angle_branches,
               const LoadParameters& load_parameters) {
                const std::lock_guard lock(model.in_use());
                model.set_angle_branches(angle_branches);
                model.evaluate(q, load_parameters);
                return model.dof_map().along_supports(model.residual().gradient);
            },
            "(3 m,) [N], with which supports pull at the held nodes of a scene at rest.", py::arg("q"),
            py::arg("angle_branches"), py::arg("load_parameters"), py::call_guard<py::gil_scoped_release>())
        .def(
            "assemble",
            [](Model& model, const VectorXd& q, const LoadParameters& load_parameters) {
                const std::lock_guard lock(model.in_use());
                model.evaluate(q, load_parameters);
                model.assemble(q, load_parameters, false);
            },
            "Gradient and Hessian, left in the core: what `python -m benchmarks kernels` times.",
            py::call_guard<py::gil_scoped_release>())
        .def(
            "hessian_product",
            [](Model& model, const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& p) {
                const std::lock_guard lock(model.in_use());
                model.evaluate(q, load_parameters);
                model.assemble(q, load_parameters, false);
                model.require_symmetric();
                VectorXd product(p.size());
                model.multiply(p, product);
                return product;
            },
            py::arg("q"), py::arg("load_parameters"), py::arg("direction"),
            py::call_guard<py::gil_scoped_release>(),
            "The product of the Hessian with a direction, of all unknowns (n,), with the own field.")
        .def(
            "rough_operator_product",
            [](Model& model, const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& p) {
                const std::lock_guard lock(model.in_use());
                model.evaluate(q, load_parameters);
                model.assemble(q, load_parameters, false);
                VectorXd product = VectorXd::Zero(p.size());
                for (const std::shared_ptr<const HessianOperator>& each : model.operators())
                    if (const auto* quick = dynamic_cast<const RoughHessianOperator*>(each.get()))
                        quick->add_rough_product(p, product);
                return product;
            },
            py::arg("q"), py::arg("load_parameters"), py::arg("direction"),
            py::call_guard<py::gil_scoped_release>(),
            "Nearly the product of the own field's Hessian with a direction, of all unknowns (n,), as solves "
            "with "
            "a large tolerance take it.")
        .def(
            "term_gradient",
            [](Model& model, const std::string& name, const VectorXd& q,
               const LoadParameters& load_parameters) {
                const std::lock_guard lock(model.in_use());
                return model.term_gradient(name, q, load_parameters);
            },
            py::arg("name"), py::arg("q"), py::arg("load_parameters"),
            py::call_guard<py::gil_scoped_release>(),
            "The gradient of the terms of one name, of all unknowns (n,) [N].")
        .def(
            "magnetic_moments",
            [](const Model& model, const std::string& name, const VectorXd& q,
               const LoadParameters& load_parameters) {
                std::vector<Vec3> points, moments;
                for (const std::unique_ptr<Term>& term : model.terms().energies)
                    if (const AppliedFieldTerm* in_field = dynamic_cast<const AppliedFieldTerm*>(term.get());
                        in_field && (name.empty() || term->name() == name))
                        in_field->add_moments(q.data(), load_parameters, points, moments);
                return std::pair(rows_from(points), rows_from(moments));
            },
            py::arg("name"), py::arg("q"), py::arg("load_parameters"),
            "Points [m] and magnetic moments [A m2] of the terms of one name, or of all of them, in the "
            "applied field, (n, 3) each.")
        .def(
            "own_flux_density",
            [](const Model& model, const VectorXd& q, const Array& points) {
                const Rows3 at = to_rows3(points);
                const py::gil_scoped_release unlocked;
                return own_flux_density(model, q, at);
            },
            py::arg("q"), py::arg("points"),
            "The flux density of the magnetized bodies at points outside of them, (n, 3) [T].")
        .def(
            "own_field_on_moments",
            [](const Model& model, const VectorXd& q) {
                OwnField::DipoleActions on;
                if (model.terms().own_field) on = model.terms().own_field->field().on_dipoles(q.data());
                return std::tuple(rows_from(on.positions), rows_from(on.forces), rows_from(on.couples));
            },
            py::arg("q"),
            "Of each rigid body with a moment in the own field: the place of the moment [m], the force [N] "
            "and the couple "
            "[N m] on it, (n, 3) each.")
        .def(
            "own_energies",
            [](const Model& model, const VectorXd& q) {
                return model.terms().own_field ? model.terms().own_field->own_energies(q.data())
                                               : std::vector<double>();
            },
            py::arg("q"), py::call_guard<py::gil_scoped_release>(),
            "The energy of each shell of the own field in its own field alone, (n,) [J].")
        .def(
            "own_field_gap_forces",
            [](const Model& model, const VectorXd& q) {
                OwnField::GapForces found;
                std::vector<std::string> owners;
                if (const OwnFieldTerm* own_field = model.terms().own_field) {
                    const py::gil_scoped_release unlocked;
                    owners = own_field->owners();
                    found = own_field->gap_forces(q.data());
                }
                const auto actions = [](const OwnField::GapActions& each) {
                    return std::tuple(rows_from(each.taken), rows_from(each.finer), each.sizes);
                };
                return std::tuple(owners, actions(found.forces), actions(found.couples),
                                  rows_from(found.centers), found.nearest, found.taken_within,
                                  found.finer_within, found.nearest_within);
            },
            py::arg("q"),
            "Of each body of the own field: its owner; the force [N] of others on it between near elements, "
            "as the energy has it and at more points, (n, 3) each, and the sum of the sizes of the latter on "
            "its "
            "elements; the same of the couple about its center [N m]; its center (n, 3) [m]; and the "
            "distance "
            "of the nearest points [m]. Of its own elements that are near now but not at rest: the sums of "
            "the "
            "sizes of their forces, both ways, and the distance.")
        .def(
            "low_rank",
            [](Model& model, bool reduced) {
                const std::lock_guard lock(model.in_use());
                const LowRank& rest = model.low_rank();
                return py::make_tuple(
                    reduced ? rest.reduced(model.dof_map(), model.size()) : rest.columns(model.size()),
                    rest.stiffness());
            },
            py::arg("reduced") = true,
            "What hessian(), called last, leaves out: columns u (n, k) and stiffnesses s (k,), the sum of s "
            "u u^T. Of "
            "cavities, cells and tendons, which couple all of their nodes.")
        .def(
            "linearize",
            [](Model& model, const VectorXd& q) {
                const std::lock_guard lock(model.in_use());
                model.linearize(q);
            },
            py::arg("q"), py::call_guard<py::gil_scoped_release>(),
            "How nodes of links and rigid parts move, at a state: evaluations begin with it.")
        .def("hessian", &hessian, py::arg("q"), py::arg("load_parameters"), py::arg("reduced") = true)
        .def("hessian_parts", &hessian_parts, py::arg("q"), py::arg("load_parameters"),
             "The Hessian of the free unknowns at a state: the lower triangle as hessian() has it, columns "
             "and "
             "stiffnesses as low_rank() has them, and the OperatorPart of the own field, or None.")
        .def(
            "small_deflection",
            [](Model& model, const VectorXd& q, const LoadParameters& unloaded,
               const LoadParameters& load_parameters, const std::optional<VectorXd>& at_rest) {
                const std::lock_guard lock(model.in_use());
                return small_deflection(model, q, unloaded, load_parameters, at_rest);
            },
            py::arg("q"), py::arg("unloaded"), py::arg("load_parameters"), py::arg("at_rest") = py::none(),
            py::call_guard<py::gil_scoped_release>(),
            "The motion from the rest shape q, of all unknowns, to first order in the load parameters. "
            "at_rest "
            "(n,): the "
            "gradient there, unless it is that without load parameters.");
}

}  // namespace magshell::bindings
