#include "magshell/solve/linear_response.h"

#include <limits>
#include <string>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/linalg/loaded_part.h"
#include "magshell/linalg/residual.h"
#include "magshell/solve/newton/unsymmetric.h"

namespace magshell {
namespace {

// Dofs up to which a faster, possibly worse ordering is used: the better one takes longer than it saves. See test_loaded_part_gives_the_solution_of_the_full_matrix.
constexpr Index few_dofs = 20000;

// RAII guard that counts edge rotations from the reference shape, for which the Hessian has fewer entries.
class RotationsFromRest {
  public:
    explicit RotationsFromRest(Model& model) : terms_(model.elastic().all()) { count(true); }
    ~RotationsFromRest() { count(false); }
    RotationsFromRest(const RotationsFromRest&) = delete;
    RotationsFromRest& operator=(const RotationsFromRest&) = delete;

    VectorXd forces(VectorXd of_sides) const {
        for (const ElasticTerm* term : terms_) term->forces_from_rest(of_sides);
        return of_sides;
    }
    VectorXd motion(VectorXd from_rest) const {
        for (const ElasticTerm* term : terms_) term->rotations_from_sides(from_rest);
        return from_rest;
    }

  private:
    void count(bool from_rest) {
        for (ElasticTerm* term : terms_) term->count_rotations_from_rest(from_rest);
    }
    const std::vector<ElasticTerm*>& terms_;
};

// Solves with one step of iterative refinement in extended precision: if stiffnesses differ by 1e6, the order of elimination would
// otherwise decide how many digits the soft directions keep.
VectorXd refined(const Factor& factor, const std::vector<double>& values, const VectorXd& forces) {
    VectorXd solution = forces;
    factor.solve(solution);
    VectorXd rest = residual(*factor.pattern(), values.data(), solution, forces);
    factor.solve(rest);
    return solution + rest;
}

LoadedPart part_of_model(Model& model, const VectorXd& free_forces) {
    LargeVector<double> values;
    model.reduce_matrix(values);
    model.dof_map().add_curvature(model.residual().gradient, values);
    return loaded_part(*model.dof_map().pattern(), values, free_forces);
}

std::unique_ptr<Factor> analysed(const Model& model, const std::vector<Index>& unknowns,
                                 SparsePattern pattern) {
    FactorOptions options;
    if (pattern.size <= few_dofs) {
        options.ordering = Ordering::amd;
    } else {
        const std::vector<Vec3> points = model.free_points();
        for (const Index unknown : unknowns) options.points.push_back(points[unknown]);
    }
    return analyze(std::make_shared<const SparsePattern>(std::move(pattern)), options);
}

// Returns the motion of supports and motors.
VectorXd prescribed(const Model& model, const VectorXd& q, const LoadParameters& unloaded,
                    const LoadParameters& load_parameters) {
    const DofMap& dof_map = model.dof_map();
    return dof_map.support_factor(load_parameters) * dof_map.prescribed_rate(unloaded) +
           dof_map.prescribed_increment(q, unloaded);
}

// Returns K times a motion, at the last evaluated state.
VectorXd stiffness_times(const VectorXd& motion, Model& model, const VectorXd& q,
                         const LoadParameters& load_parameters) {
    model.assemble(q, load_parameters, false);
    model.require_symmetric();
    model.require_sparse();
    VectorXd forces(motion.size());
    model.matrix().multiply(motion.data(), forces.data());
    if (const SystemMatrix* touching = model.contact_matrix())
        touching->add_product(motion.data(), forces.data());
    return forces;
}

// Solves with the stored factorization: of the symmetric part of K, at the equilibrium or near it.
void solve_with_stored_factor(const Model& model, const Factor& factor, bool transposed, double tolerance,
                              VectorXd& reduced) {
    if (!model.unsymmetric()) return factor.solve_approximately(reduced, tolerance);
    const GmresReport report =
        solve_unsymmetric(model, factor, transposed, {tolerance, to_round_off.max_iterations}, reduced);
    if (!report.converged)
        throw InvalidInput(
            "a linear solve with a pressure without potential did not converge: its relative residual is " +
            std::to_string(report.residual));
}

// Returns the change of all dofs that cancels a change of the gradient, to first order, while prescribed dofs change. The model was
// evaluated last at the state of the equilibrium. exact: with its Hessian, rather than with that of the stored factorization.
VectorXd state_change(Model& model, const StaticsResult& equilibrium, const LoadParameters& load_parameters,
                      ChangeAlong along, bool exact) {
    const VectorXd& q = equilibrium.state;
    const DofMap& dof_map = model.dof_map();
    VectorXd& gradient = along.gradient;
    VectorXd change = along.prescribed;
    if (along.moved.size() > 0) change += along.moved;
    const bool moves = !change.isZero(0.0);
    if (moves || model.capabilities().has_unsymmetric_tangent || (exact && needs_hessian(model, equilibrium)))
        model.assemble(q, load_parameters, false);
    if (moves) {
        VectorXd pull(q.size());
        model.multiply(change, pull);
        model.nonsymmetric_tangent().add_product(change, false, pull);
        dof_map.add_motor_increment_forces(model.residual().gradient, along.prescribed, pull);
        gradient += pull;
    }
    VectorXd reduced = -dof_map.vector(gradient);
    if (along.forces.size() > 0) reduced -= along.forces;
    if (exact)
        solve_at_equilibrium(model, equilibrium, false, reduced);
    else
        solve_with_stored_factor(model, *equilibrium.factor, false, to_round_off.tolerance, reduced);
    change += dof_map.expand(reduced);
    return change;
}

}  // namespace

bool needs_hessian(const Model& model, const StaticsResult& equilibrium) {
    return !equilibrium.factor_is_exact || model.capabilities().has_unsymmetric_tangent;
}

void solve_at_equilibrium(const Model& model, const StaticsResult& equilibrium, bool transposed,
                          VectorXd& reduced) {
    // The factorization may be of a state 1e-7 of the thickness away, whose Hessian differs by up to 1e-4 in slender bodies. Each
    // correction leaves that part of the error, until round-off.
    constexpr int most_corrections = 10;  // see test_gradients_do_not_depend_on_where_the_search_began
    // [-] Residual of the solve of a correction, and the last correction over the solution; see
    // test_gradients_do_not_depend_on_where_the_search_began.
    constexpr double of_correction = 1e-6, negligible = 1e-13;
    const Factor& factor = *equilibrium.factor;
    const VectorXd wanted = reduced;
    solve_with_stored_factor(model, factor, transposed, to_round_off.tolerance, reduced);
    if (equilibrium.factor_is_exact) return;
    const DofMap& dof_map = model.dof_map();
    double last = std::numeric_limits<double>::infinity();
    for (int k = 0; k < most_corrections; ++k) {
        const VectorXd full = dof_map.expand(reduced);
        VectorXd forces(full.size());
        model.multiply(full, forces);
        model.nonsymmetric_tangent().add_product(full, transposed, forces);
        VectorXd image = dof_map.vector(forces);
        dof_map.add_curvature_product(model.residual().gradient, reduced, image);
        VectorXd correction = wanted - image;
        solve_with_stored_factor(model, factor, transposed, of_correction, correction);
        const double length = correction.norm();
        if (!(length < 0.5 * last)) return;
        reduced += correction;
        if (length <= negligible * reduced.norm()) return;
        last = length;
    }
}

SmallDeflection small_deflection(Model& model, const VectorXd& q, const LoadParameters& unloaded,
                                 const LoadParameters& load_parameters,
                                 const std::optional<VectorXd>& at_rest) {
    const VectorXd moved = prescribed(model, q, unloaded, load_parameters);
    model.evaluate(q, load_parameters);
    const VectorXd loaded = model.residual().gradient;
    model.evaluate(q, unloaded);
    VectorXd forces = at_rest.value_or(model.residual().gradient) - loaded;
    if (!moved.isZero(0.0)) forces -= stiffness_times(moved, model, q, unloaded);

    const RotationsFromRest counted(model);
    model.assemble(q, unloaded, false);
    model.require_symmetric();
    model.require_sparse();
    const VectorXd free_forces = model.dof_map().vector(counted.forces(std::move(forces)));
    LoadedPart part = part_of_model(model, free_forces);
    const std::unique_ptr<Factor> factor = analysed(model, part.unknowns, std::move(part.pattern));
    std::copy(part.values.begin(), part.values.end(), factor->values().begin());
    const Index count = factor->size();
    SmallDeflection found{.motion = {}, .report = factor->factorize(), .unknowns = count};
    if (!found.report.succeeded || found.report.negative_pivots || found.report.perturbed_pivots)
        return found;

    VectorXd loads(count);
    for (Index k = 0; k < count; ++k) loads[k] = free_forces[part.unknowns[k]];
    const VectorXd solution = refined(*factor, part.values, loads);
    VectorXd free_motion = VectorXd::Zero(free_forces.size());
    for (Index k = 0; k < count; ++k) free_motion[part.unknowns[k]] = solution[k];
    found.motion = moved + counted.motion(model.dof_map().expand(free_motion));
    return found;
}

VectorXd first_order_change(Model& model, const StaticsResult& equilibrium, const LoadParameters& to) {
    if (!equilibrium.factor)
        throw InvalidInput("the equilibrium has no factorization: it was solved without gradients");
    model.set_angle_branches(equilibrium.angle_branches);
    model.evaluate(equilibrium.state, to);
    return state_change(model, equilibrium, to,
                        {.gradient = model.residual().gradient,
                         .prescribed = model.dof_map().prescribed_increment(equilibrium.state, to)},
                        false);
}

StateOnJoints state_on_joints(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                              const VectorXd& forces) {
    StateOnJoints carried{.moved = q, .driven = {}, .forces = {}};
    model.dof_map().project_state(carried.moved, nullptr);
    carried.driven = model.dof_map().prescribed_increment(carried.moved, load_parameters);
    model.linearize(carried.moved);
    carried.forces = model.dof_map().vector(forces);
    return carried;
}

VectorXd equilibrium_jvp(Model& model, const StaticsResult& equilibrium, ChangeAlong change) {
    if (!equilibrium.factor)
        throw InvalidInput("the equilibrium has no factorization: it was solved without gradients");
    model.set_angle_branches(equilibrium.angle_branches);
    model.evaluate(equilibrium.state, equilibrium.load_parameters);
    return state_change(model, equilibrium, equilibrium.load_parameters, std::move(change), true);
}

}  // namespace magshell
