#include "magshell/solve/small_deflection.h"

#include "magshell/linalg/loaded_part.h"
#include "magshell/linalg/residual.h"

namespace magshell {
namespace {

constexpr Index few =
    20000;  // unknowns: the better of two orderings takes longer than it saves one factorization

// While it lives, edge rotations count from rest in the Hessian, which has fewer entries then.
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

// Refined once with a residual of more digits: where stiffnesses differ by 1e6, the order of elimination would decide what is
// left of the soft ones' digits.
VectorXd refined(const Factor& factor, const LoadedPart& part, const VectorXd& forces) {
    VectorXd solution = forces;
    factor.solve(solution);
    VectorXd rest = residual(part.pattern, part.values.data(), solution, forces);
    factor.solve(rest);
    return solution + rest;
}

}  // namespace

SmallDeflection small_deflection(Model& model, const VectorXd& q, const Controls& controls,
                                 const VectorXd& gradient, const std::optional<VectorXd>& at_rest) {
    const RotationsFromRest counted(model);
    model.evaluate(q, controls);
    model.assemble(q, controls, false);
    model.require_symmetric();
    LargeVector<double> values;
    model.reduce_matrix(values);
    const Reduction& reduction = model.reduction();
    reduction.add_curvature(model.residual().gradient, values);
    const VectorXd forces = at_rest.value_or(model.residual().gradient) - gradient;
    const VectorXd free_forces = reduction.vector(counted.forces(forces));

    LoadedPart part = loaded_part(*reduction.pattern(), values, free_forces);
    const Index count = part.pattern.size;
    FactorOptions options;
    if (count <= few) {
        options.ordering = Ordering::amd;
    } else {
        const std::vector<Vec3> points = model.free_points();
        for (const Index unknown : part.unknowns) options.points.push_back(points[unknown]);
    }
    const auto pattern = std::make_shared<const SparsePattern>(part.pattern);
    const std::unique_ptr<Factor> factor = analyze(pattern, options);
    std::copy(part.values.begin(), part.values.end(), factor->values().begin());
    SmallDeflection found{.motion = {}, .report = factor->factorize(), .unknowns = count};
    if (!found.report.succeeded || found.report.negative_pivots || found.report.perturbed_pivots)
        return found;

    VectorXd loads(count);
    for (Index k = 0; k < count; ++k) loads[k] = free_forces[part.unknowns[k]];
    const VectorXd solution = refined(*factor, part, loads);
    VectorXd free_motion = VectorXd::Zero(free_forces.size());
    for (Index k = 0; k < count; ++k) free_motion[part.unknowns[k]] = solution[k];
    found.motion = counted.motion(reduction.expand(free_motion));
    return found;
}

}  // namespace magshell
