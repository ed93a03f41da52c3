// Binds motions and their adjoints. Whole runs release the GIL.
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <utility>

#include "bindings/arrays.h"
#include "bindings/call_python.h"
#include "bindings/model_numbers.h"
#include "bindings/watch.h"
#include "magshell/adjoint/dynamic.h"
#include "magshell/adjoint/motion_tangent.h"
#include "magshell/core/errors.h"
#include "magshell/solve/motion/motion_balance.h"

namespace magshell::bindings {
namespace {

Tableau tableau_of(const std::string& name) {
    if (name == "euler") return implicit_euler();
    if (name == "tr_bdf2") return tr_bdf2();
    if (name == "sdirk2") return sdirk2();
    if (name == "sdirk3") return sdirk3();
    throw InvalidInput("no integrator is called \"" + name + "\"");
}

// Converts load parameters with one row per time point.
using Knots = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::vector<LoadParameters> load_parameters_of(const Model& model, const TimeVaryingParameters& varying,
                                               const Array& rows) {
    const Index width = model.parameters().registry().load_parameters.size() + varying.size();
    if (rows.ndim() != 2 || rows.shape(1) != width)
        throw InvalidInput("load_parameters must have one row per time point, of " + std::to_string(width) +
                           " numbers");
    std::vector<LoadParameters> load_parameters;
    for (py::ssize_t k = 0; k < rows.shape(0); ++k)
        load_parameters.push_back(Eigen::Map<const VectorXd>(rows.data(k, 0), width));
    return load_parameters;
}

Knots rows_of(const std::vector<LoadParameters>& load_parameters) {
    Knots rows(load_parameters.size(), load_parameters.empty() ? 0 : load_parameters.front().size());
    for (std::size_t k = 0; k < load_parameters.size(); ++k) rows.row(k) = load_parameters[k].transpose();
    return rows;
}

// Returns the strains of each element and elastic term in the core's order, once for each branch; none without numbers.
MaxwellStrains strains_of(Model& model, const Array& numbers, std::size_t branches) {
    if (numbers.size() == 0) return {};
    const std::size_t size = static_cast<std::size_t>(model.elastic().size());
    if (static_cast<std::size_t>(numbers.size()) != branches * size)
        throw InvalidInput("the scene has " + std::to_string(size) + " strains for each of " +
                           std::to_string(branches) + " branches, got " + std::to_string(numbers.size()));
    const double* from = numbers.data();
    MaxwellStrains strains(branches, model.elastic().zeros());
    for (StrainSet& of_branch : strains)
        for (Strains& part : of_branch.of_terms)
            for (Index element = 0; element < part.elements; ++element)
                for (int i = 0; i < part.width; ++i) part.set(element, i, *from++);
    return strains;
}

VectorXd numbers_of(const Model& model, const MaxwellStrains& strains) {
    VectorXd numbers(static_cast<Index>(strains.size()) * model.elastic().size());
    double* to = numbers.data();
    for (const StrainSet& of_branch : strains)
        for (const Strains& part : of_branch.of_terms)
            for (Index element = 0; element < part.elements; ++element)
                for (int i = 0; i < part.width; ++i) *to++ = part.number(element, i);
    return numbers;
}

Viscosity viscosity_of(const py::dict& given) {
    Viscosity law;
    law.stiffness_damping = given["stiffness_damping"].cast<double>();
    law.damping_varies = given["stiffness_damping_varies"].cast<bool>();
    const VectorXd moduli = to_vector(given["maxwell_modulus"].cast<Array>()),
                   times = to_vector(given["maxwell_time"].cast<Array>());
    for (Index k = 0; k < moduli.size(); ++k) law.branches.push_back({moduli[k], times[k]});
    return law;
}

// Copies of the result share the Python function, so that they can be made and destroyed without the GIL.
AdaptiveSteps adaptive_of(const Model& model, const TimeVaryingParameters& varying, const py::dict& given) {
    AdaptiveSteps adaptive;
    adaptive.tolerance = given["tolerance"].cast<double>();
    adaptive.interval = given["interval"].cast<double>();
    adaptive.intervals = given["intervals"].cast<Index>();
    adaptive.deepest = given["deepest"].cast<int>();
    adaptive.record_every = given["record_every"].cast<Index>();
    const auto function = std::make_shared<py::object>(given["load_parameters"]);
    adaptive.load_parameters = [&model, varying, function](Index interval, double begin, double end) {
        const py::gil_scoped_acquire locked;
        return load_parameters_of(model, varying, call_python(*function, interval, begin, end).cast<Array>());
    };
    return adaptive;
}

MotionInput input_of(Model& model, const py::dict& given) {
    const auto array = [&](const char* name) { return given[name].cast<Array>(); };
    MotionInput input;
    input.start.q = to_vector(array("state"));
    input.start.v = to_vector(array("velocity"));
    input.start.angle_branches = given["angle_branches"].cast<Model::AngleBranches>();
    input.inertia = {model.bodies().vertex_weights(to_vector(array("mass"))),
                     model.bodies().vertex_weights(to_vector(array("damping")))};
    input.viscosity = viscosity_of(given);
    const std::size_t branches = input.viscosity.branches.size();
    input.start.e = strains_of(model, array("maxwell_strains"), branches);
    input.start.rates.acceleration = to_vector(array("acceleration"));
    if (input.start.rates.acceleration.size() > 0) {
        input.start.rates.v = input.start.v;
        if (MaxwellStrains rates = strains_of(model, array("strain_rates"), 1); !rates.empty())
            input.start.rates.elastic.d = std::move(rates.front());
        input.start.rates.elastic.e = strains_of(model, array("maxwell_strain_rates"), branches);
        if (model.may_have_fluid_momentum())
            input.start.rates.momentum_rate = to_vector(array("momentum_rate"));
    }
    input.rotations_given = given["rotations_given"].cast<bool>();
    input.tableau = tableau_of(given["integrator"].cast<std::string>());
    input.tableau.implicit_contact = given["implicit_contact"].cast<bool>() && model.contacts().any();
    if (VectorXd by_contact = to_vector(array("contact_acceleration"));
        by_contact.size() > 0 && !input.start.rates.empty()) {
        if (input.tableau.implicit_contact)
            input.start.rates.c = std::move(by_contact);
        else
            input.start.rates.acceleration += by_contact;
    }
    input.time_steps = given["time_steps"].cast<std::vector<double>>();
    input.recorded = given["recorded"].cast<std::vector<Index>>();
    input.varying =
        TimeVaryingParameters(model.parameters().registry(), given["varying"].cast<std::vector<Index>>());
    input.load_parameters = load_parameters_of(model, input.varying, array("load_parameters"));
    input.newton = given["newton"].cast<NewtonOptions>();
    if (const py::object projective = given["projective"]; !projective.is_none()) {
        const auto [iterations, tolerance, history, coulomb] =
            projective.cast<std::tuple<int, double, int, bool>>();
        input.projective = {true, iterations, tolerance, history, coulomb};
        if (tolerance > 0.0) input.newton.tolerance = tolerance;
    }
    input.watched = given["watched"].cast<std::vector<WatchedObstacle>>();
    if (const py::object adaptive = given["adaptive"]; !adaptive.is_none())
        input.adaptive = adaptive_of(model, input.varying, adaptive.cast<py::dict>());
    return input;
}

// Returns the positions of the recorded states, (n, n_v, 3), those of points of rigid bodies included.
template <class Field>
Array positions_of(const Model& model, const MotionResult& motion, const Field& field) {
    const py::ssize_t n = static_cast<py::ssize_t>(motion.recorded.size()),
                      n_v = model.nodes().n_user_vertices();
    Array rows({n, n_v, py::ssize_t{3}});
    for (py::ssize_t k = 0; k < n; ++k)
        Eigen::Map<Rows3>(rows.mutable_data(k, 0, 0), n_v, 3) =
            model.bodies().points(field(motion.recorded[k]));
    return rows;
}

Array rotations_of(const Model& model, const MotionResult& motion) {
    const py::ssize_t n = static_cast<py::ssize_t>(motion.recorded.size()), n_e = model.bodies().n_edges();
    Array rows({n, n_e});
    for (py::ssize_t k = 0; k < n; ++k)
        Eigen::Map<VectorXd>(rows.mutable_data() + k * n_e, n_e) =
            model.bodies().edge_rotations(motion.recorded[k].q);
    return rows;
}

// Returns the given directions across edges of the recorded states, (n, 3 n_d), as they are stored between positions and
// rotations.
Array directions_of(const MotionResult& motion, const Model& model) {
    const py::ssize_t n = static_cast<py::ssize_t>(motion.recorded.size());
    const Index n_v = model.nodes().n_vertices(), size = 3 * (model.nodes().n_nodes() - n_v);
    Array rows({n, static_cast<py::ssize_t>(size)});
    for (py::ssize_t k = 0; k < n; ++k)
        Eigen::Map<VectorXd>(rows.mutable_data() + k * size, size) =
            motion.recorded[k].q.segment(3 * n_v, size);
    return rows;
}

// Returns the motor forces of the recorded states, (n, m); NaN in states that no step led to.
Knots driving_of(const MotionResult& motion) {
    const Eigen::Index n = static_cast<Eigen::Index>(motion.recorded.size()),
                       m = motion.last.motor_forces.size();
    Knots rows = Knots::Constant(n, m, std::numeric_limits<double>::quiet_NaN());
    for (Eigen::Index k = 0; k < n; ++k)
        if (motion.recorded[k].motor_forces.size() == m)
            rows.row(k) = motion.recorded[k].motor_forces.transpose();
    return rows;
}

// Returns the support forces of the recorded states, (n, m, 3) [N], of the prescribed nodes in the order in
// which they were given; NaN in states that no step led to.
Array held_forces_of(const MotionResult& motion, const Model& model) {
    const py::ssize_t n = static_cast<py::ssize_t>(motion.recorded.size());
    const VectorXd none = model.dof_map().along_supports(VectorXd::Zero(model.size()));
    const py::ssize_t size = none.size();
    Array rows({n, size / 3, py::ssize_t{3}});
    for (py::ssize_t k = 0; k < n; ++k) {
        const VectorXd& held = motion.recorded[k].held;
        Eigen::Map<VectorXd> row(rows.mutable_data() + k * size, size);
        if (held.size() == size)
            row = held;
        else
            row.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    return rows;
}

// Returns the principal strains of every recorded state.
py::list largest_strains(const MotionResult& motion, const Model& model, const VectorXd& thickness) {
    std::vector<LargestStrains> largest;
    {
        const py::gil_scoped_release unlocked;
        for (const MotionState& each : motion.recorded)
            largest.push_back(largest_of(principal_strains(model, each.q, thickness)));
    }
    py::list rows;
    for (const LargestStrains& each : largest) rows.append(to_tuple(each));
    return rows;
}

MotionResult run(Model& model, const MotionInput& input, bool gradients, std::size_t budget,
                 AdjointStorage keep, const py::object& progress) {
    const Watch watch(progress);
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    return simulate(model, input, {gradients, budget, keep},
                    [&](double at, double residual) { watch(at, residual); });
}

// Returns one vector of all stages, (stages, all dofs).
Knots rows_of_stages(const MotionGradient& gradient, VectorXd StageAdjoint::* of) {
    Knots rows(gradient.stages.size(), gradient.stages.empty() ? 0 : (gradient.stages[0].*of).size());
    for (std::size_t k = 0; k < gradient.stages.size(); ++k)
        rows.row(static_cast<Eigen::Index>(k)) = (gradient.stages[k].*of).transpose();
    return rows;
}

py::dict back(Model& model, const MotionInput& input, const MotionResult& motion, const Array& by_positions,
              const Array& by_edge_rotations, const Array& by_velocities, const Knots& by_driving,
              bool by_rest, bool stages, const py::object& progress) {
    const Watch watch(progress);
    GradientsByStates by;
    by.wants_rest = by_rest;
    by.wants_stages = stages;
    const VectorXd no_rotations = VectorXd::Zero(model.bodies().n_edges());
    const py::ssize_t n_v = model.nodes().n_user_vertices(), n_e = model.bodies().n_edges();
    for (py::ssize_t k = 0; k < static_cast<py::ssize_t>(motion.recorded.size()); ++k) {
        const auto rows = [&](const Array& of) {
            return Rows3(Eigen::Map<const Rows3>(of.data(k, 0, 0), n_v, 3));
        };
        const VectorXd rotations = Eigen::Map<const VectorXd>(by_edge_rotations.data() + k * n_e, n_e);
        by.q.push_back(model.bodies().gradient_by_state(rows(by_positions), rotations));
        by.v.push_back(model.bodies().gradient_by_state(rows(by_velocities), no_rotations));
        if (by_driving.size() > 0) by.motor_forces.push_back(by_driving.row(k).transpose());
    }
    MotionGradient gradient;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        gradient =
            motion_vjp(model, input, motion, by, [&](double at, double residual) { watch(at, residual); });
    }
    py::dict result;
    result["values"] = values_to_user(model, gradient.values);
    result["load_parameters"] = rows_of(gradient.load_parameters);
    if (gradient.rest.asked) result["rest"] = at_nodes(model, gradient.rest.by_nodes);
    const Rows3 by_vertices = model.bodies().gradient_by_vectors(gradient.positions);
    const Rows3 by_points = model.bodies().points(gradient.positions);  // of rigid bodies, too
    result["positions"] = by_vertices;
    result["own_points"] = Rows3(by_points.bottomRows(by_points.rows() - by_vertices.rows()));
    result["edge_rotations"] = model.bodies().edge_rotations(gradient.positions);
    result["velocities"] = model.bodies().gradient_by_vectors(gradient.velocities);
    result["own_velocities"] = model.bodies().points(gradient.velocities);
    result["mass"] = VectorXd(model.bodies().points(gradient.mass).rowwise().sum());
    result["damping"] = VectorXd(model.bodies().positions(gradient.damping).rowwise().sum());
    result["time_step"] = VectorXd(Eigen::Map<const VectorXd>(
        gradient.time_steps.data(), static_cast<Eigen::Index>(gradient.time_steps.size())));
    result["stiffness_damping"] = gradient.viscosity.stiffness_damping;
    std::vector<double> by_moduli, by_times;
    for (const MaxwellBranch& by_branch : gradient.viscosity.branches) {
        by_moduli.push_back(by_branch.modulus);
        by_times.push_back(by_branch.time);
    }
    result["maxwell_modulus"] = by_moduli;
    result["maxwell_time"] = by_times;
    result["factorizations"] = gradient.factorizations;
    if (stages) {
        result["stage_adjoints"] = rows_of_stages(gradient, &StageAdjoint::lambda);
        result["stage_states"] = rows_of_stages(gradient, &StageAdjoint::q);
        result["stage_velocities"] = rows_of_stages(gradient, &StageAdjoint::velocity);
        result["stage_load_parameters"] = rows_of_stages(gradient, &StageAdjoint::load_parameters);
        result["stage_accelerations"] = rows_of_stages(gradient, &StageAdjoint::acceleration);
    }
    return result;
}

MotionInputTangent input_tangent_of(const Model& model, const MotionInput& input, const py::dict& given) {
    const auto array = [&](const char* name) { return given[name].cast<Array>(); };
    MotionInputTangent along;
    along.values = to_vector(array("values"));
    if (const py::object function = given["values_at"]; !function.is_none())
        along.values_at = [function](double t) -> VectorXd {
            const py::gil_scoped_acquire locked;
            const py::object found = call_python(function, t);
            if (found.is_none()) throw InvalidInput("beyond the range of a value");
            return to_vector(found.cast<Array>());
        };
    if (const py::object function = given["model_at"]; !function.is_none())
        along.model_at = [function](double t) -> Model& {
            const py::gil_scoped_acquire locked;
            const py::object found = call_python(function, t);
            if (found.is_none()) throw InvalidInput("beyond the range of a value");
            return found.cast<Model&>();
        };
    along.load_parameters = load_parameters_of(model, input.varying, array("load_parameters"));
    along.positions = to_vector(array("state"));
    along.velocities = to_vector(array("velocity"));
    along.mass = model.bodies().vertex_weights(to_vector(array("mass")));
    along.damping = model.bodies().vertex_weights(to_vector(array("damping")));
    along.time_steps = given["time_steps"].cast<std::vector<double>>();
    along.viscosity = viscosity_of(given);
    along.first_step = given["first_step"].cast<double>();
    along.length = given["length"].cast<double>();
    return along;
}

// Returns the tangents of positions, edge rotations, velocities and motor forces of all recorded states, and the number of factorizations.
py::tuple tangents_of(const Model& model, const MotionResult& motion, const MotionTangent& found) {
    const py::ssize_t n = static_cast<py::ssize_t>(found.states.size()),
                      n_v = model.nodes().n_user_vertices(), n_e = model.bodies().n_edges();
    Array points({n, n_v, py::ssize_t{3}}), velocities({n, n_v, py::ssize_t{3}}), rotations({n, n_e});
    Knots driving(n, motion.last.motor_forces.size());
    for (py::ssize_t k = 0; k < n; ++k) {
        const MotionTangent::State& each = found.states[k];
        Eigen::Map<Rows3>(points.mutable_data(k, 0, 0), n_v, 3) = model.bodies().points(each.q);
        Eigen::Map<Rows3>(velocities.mutable_data(k, 0, 0), n_v, 3) = model.bodies().points(each.v);
        Eigen::Map<VectorXd>(rotations.mutable_data() + k * n_e, n_e) = model.bodies().edge_rotations(each.q);
        driving.row(k) = each.motor_forces.transpose();
    }
    return py::make_tuple(points, rotations, velocities, driving, found.factorizations);
}

py::tuple forward(Model& model, const MotionInput& input, const MotionResult& motion, const VectorXd& values,
                  const py::dict& given, const py::object& progress) {
    const Watch watch(progress);
    const MotionInputTangent along = input_tangent_of(model, input, given);
    MotionTangent found;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        found = motion_jvp(model, input, motion, values, along,
                           [&](double at, double residual) { watch(at, residual); });
    }
    return tangents_of(model, motion, found);
}

// Returns a motion; its tangents as tangents_of does, or None; and why there are none.
py::tuple run_with_tangent(Model& model, const MotionInput& input, std::size_t budget, AdjointStorage keep,
                           const VectorXd& values, const py::dict& given, const py::object& progress) {
    const Watch watch(progress);
    const MotionInputTangent along = input_tangent_of(model, input, given);
    MotionWithTangent found;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        found = simulate_with_tangent(model, input, {true, budget, keep}, values, along,
                                      [&](double at, double residual) { watch(at, residual); });
    }
    const bool known = found.refusal.empty() && found.motion.outcome == Outcome::converged;
    const py::object tangents =
        known ? py::object(tangents_of(model, found.motion, found.tangent)) : py::object(py::none());
    return py::make_tuple(std::move(found.motion), tangents, found.refusal);
}

// Returns for each term of the energy its name, its body or -1, and whether it has no potential.
py::list kinds_of_terms(const Model& model) {
    py::list kinds;
    for (const std::unique_ptr<Term>& term : model.terms().energies)
        kinds.append(py::make_tuple(py::str(term->name().data(), term->name().size()), term->body(),
                                    term->capabilities().has_unsymmetric_tangent));
    return kinds;
}

// Returns the gradient of each term of the energy by all unknowns, (terms, unknowns).
Knots term_gradients(Model& model, const VectorXd& q, const Model::AngleBranches& angle_branches,
                     const LoadParameters& load_parameters) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(model.in_use());
    model.set_angle_branches(angle_branches);
    model.linearize(q);
    Knots rows(model.terms().energies.size(), model.size());
    Residual of_term;
    Eigen::Index row = 0;
    for (const std::unique_ptr<Term>& term : model.terms().energies) {
        of_term.reset(model.size());
        term->evaluate(q.data(), load_parameters, of_term);
        rows.row(row++) = of_term.gradient.transpose();
    }
    return rows;
}

// Returns the recorded states of a balance: sums of forces (n, rows, 7), energies (n, terms and Maxwell branches), work by parameters that
// change (n, terms), kinetic energies and momenta (n, 7); the state at the end; and the names of the terms without energy.
py::tuple balance_of(Model& model, const MotionInput& input,
                     const std::map<Index, std::vector<std::tuple<double, double, bool>>>& given,
                     Index steps_done, const py::object& progress) {
    const Watch watch(progress);
    std::map<Index, Substeps> substeps;
    for (const auto& [step, parts] : given)
        for (const auto& [begin, end, dissipative] : parts)
            substeps[step].push_back({begin, end, dissipative});
    MotionBalance balance;
    {
        const py::gil_scoped_release unlocked;
        const std::lock_guard lock(model.in_use());
        balance = motion_balance(model, input, substeps, steps_done,
                                 [&](double at, double residual) { watch(at, residual); });
    }
    const py::ssize_t n = static_cast<py::ssize_t>(balance.states.size());
    const MotionBalance::State& first = balance.states.front();
    Array forces({n, static_cast<py::ssize_t>(first.forces.rows()), py::ssize_t{7}});
    Knots energies(n, first.energies.size()), driven(n, first.driven.size()), momenta(n, 7);
    for (py::ssize_t k = 0; k < n; ++k) {
        const MotionBalance::State& state = balance.states[k];
        Eigen::Map<MotionBalance::Rows>(forces.mutable_data(k, 0, 0), state.forces.rows(), 7) = state.forces;
        energies.row(k) = state.energies.transpose();
        driven.row(k) = state.driven.transpose();
        momenta.row(k) << state.kinetic, state.momenta.transpose();
    }
    py::list names;
    for (const std::unique_ptr<ForceTerm>& force : model.terms().forces)
        names.append(py::str(force->name().data(), force->name().size()));
    return py::make_tuple(forces, energies, driven, momenta, balance.last, names);
}

}  // namespace

void register_dynamics(py::module_& module) {
    py::class_<MotionInput>(module, "MotionInput")
        .def(py::init(&input_of), py::arg("model"), py::arg("given"));

    py::enum_<AdjointStorage>(module, "Keep")
        .value("nothing", AdjointStorage::nothing)
        .value("checkpoints", AdjointStorage::checkpoints)
        .value("stages", AdjointStorage::stages)
        .value("factors", AdjointStorage::factors);

    py::class_<MotionResult>(module, "MotionResult")
        .def_readonly("outcome", &MotionResult::outcome)
        .def_readonly("reason", &MotionResult::reason)
        .def_readonly("steps_done", &MotionResult::steps_done)
        .def_readonly("fraction_done", &MotionResult::fraction_done)
        .def_readonly("time_steps", &MotionResult::time_steps)
        .def_readonly("steps_recorded", &MotionResult::steps_recorded)
        .def_readonly("step_errors", &MotionResult::step_errors)
        .def_readonly("step_factorizations", &MotionResult::step_factorizations)
        .def_readonly("divided", &MotionResult::divided)
        .def_readonly("gaining", &MotionResult::gaining)
        .def_readonly("watched_energy", &MotionResult::watched_energy)
        .def_readonly("begun", &MotionResult::begun)
        .def_property_readonly("last_state", [](const MotionResult& r) { return r.last.q; })
        .def_property_readonly("last_velocity", [](const MotionResult& r) { return r.last.v; })
        .def_property_readonly("last_acceleration",
                               [](const MotionResult& r) { return r.last.rates.acceleration; })
        .def_property_readonly("last_contact_acceleration",
                               [](const MotionResult& r) { return r.last.rates.c; })
        .def_property_readonly("last_momentum_rate",
                               [](const MotionResult& r) { return r.last.rates.momentum_rate; })
        .def("last_maxwell_strains",
             [](const MotionResult& r, const Model& m) { return numbers_of(m, r.last.e); })
        .def("last_strain_rates",
             [](const MotionResult& r, const Model& m) {
                 const StrainSet& rates = r.last.rates.elastic.d;
                 return numbers_of(m, rates.empty() ? MaxwellStrains{} : MaxwellStrains{rates});
             })
        .def("last_maxwell_strain_rates",
             [](const MotionResult& r, const Model& m) { return numbers_of(m, r.last.rates.elastic.e); })
        .def_property_readonly("last_turns", [](const MotionResult& r) { return r.last.angle_branches; })
        .def_readonly("kinetic_energy", &MotionResult::kinetic_energy)
        .def_readonly("energies", &MotionResult::energies)
        .def_property_readonly("substeps",
                               [](const MotionResult& r) {
                                   std::map<Index, std::vector<std::tuple<double, double, bool>>> all;
                                   for (const auto& [step, substeps] : r.substeps)
                                       for (const Substep& each : substeps)
                                           all[step].emplace_back(each.begin, each.end, each.dissipative);
                                   return all;
                               })
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
        .def("edge_rotations", [](const MotionResult& r, const Model& m) { return rotations_of(m, r); })
        .def("directions", &directions_of)
        .def("driving", &driving_of)
        .def("held_forces", &held_forces_of,
             "(n, m, 3) [N], with which supports pulled at the held nodes of recorded states; NaN where no "
             "step "
             "led to.")
        .def("largest_strains", &largest_strains, py::arg("model"), py::arg("thickness"));

    module.def("simulate", &run, py::arg("model"), py::arg("input"), py::arg("gradients"), py::arg("budget"),
               py::arg("keep"), py::arg("progress") = py::none());
    module.def("simulate_with_tangent", &run_with_tangent, py::arg("model"), py::arg("input"),
               py::arg("budget"), py::arg("keep"), py::arg("values"), py::arg("along"),
               py::arg("progress") = py::none(),
               "A motion in given steps; what push_forward_motion returns of it, or None; and why there is "
               "none.");
    module.def("pull_back_motion", &back, py::arg("model"), py::arg("input"), py::arg("motion"),
               py::arg("by_positions"), py::arg("by_edge_rotations"), py::arg("by_velocities"),
               py::arg("by_driving") = Knots(), py::arg("by_rest") = false, py::arg("stages") = false,
               py::arg("progress") = py::none());
    module.def("kinds_of_terms", &kinds_of_terms, py::arg("model"),
               "(name, number of the body or -1, whether it has no potential) of each term of the energy.");
    module.def(
        "keeps_energy",
        [](const Model& model) {
            const Capabilities& has = model.capabilities();
            return !has.has_velocity_forces && !has.has_own_viscosity && !has.has_unsymmetric_tangent;
        },
        py::arg("model"), "Whether all forces of the scene, without damping, have a potential.");
    module.def("term_gradients", &term_gradients, py::arg("model"), py::arg("q"), py::arg("angle_branches"),
               py::arg("load_parameters"),
               "The gradient of each term of the energy by all unknowns, (terms, n).");
    module.def(
        "motion_balance", &balance_of, py::arg("model"), py::arg("input"), py::arg("substeps"),
        py::arg("steps_done"), py::arg("progress") = py::none(),
        "The sums of a motion until each recorded state, which is repeated for them: work and impulses "
        "of all forces (n, rows, 7), energies of the terms and of the Maxwell branches, work of "
        "parameters "
        "that change, kinetic energy and momenta (n, 7); the last state; the names of the terms "
        "without energy.");
    module.def("push_forward_motion", &forward, py::arg("model"), py::arg("input"), py::arg("motion"),
               py::arg("values"), py::arg("along"), py::arg("progress") = py::none(),
               "The derivatives of positions, edge rotations, velocities and motor forces of recorded states "
               "along a direction of the inputs, and the number of factorizations that they took.");
}

}  // namespace magshell::bindings
