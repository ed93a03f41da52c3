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
    model.reduction().add_curvature(model.residual().gradient, values);
    return loaded_part(*model.reduction().pattern(), values, free_forces);
}

std::unique_ptr<Factor> analysed(const Model& model, const std::vector<Index>& unknowns,
                                 SparsePattern pattern) {
    FactorOptions options;
    if (pattern.size <= few) {
        options.ordering = Ordering::amd;
    } else {
        const std::vector<Vec3> points = model.free_points();
        for (const Index unknown : unknowns) options.points.push_back(points[unknown]);
    }
    return analyze(std::make_shared<const SparsePattern>(std::move(pattern)), options);
}

// What supports and motors move.
VectorXd prescribed(const Model& model, const VectorXd& q, const Controls& unloaded,
                    const Controls& controls) {
    const Reduction& reduction = model.reduction();
    return reduction.progress(controls) * reduction.prescribed_rate(unloaded) +
           reduction.prescribed_increment(q, unloaded);
}

// At the last evaluated state.
VectorXd stiffness_times(const VectorXd& motion, Model& model, const VectorXd& q, const Controls& controls) {
    model.assemble(q, controls, false);
    model.require_symmetric();
    VectorXd forces(motion.size());
    model.matrix().multiply(motion.data(), forces.data());
    if (const SystemMatrix* touching = model.contact_matrix())
        touching->add_product(motion.data(), forces.data());
    return forces;
}

}  // namespace

SmallDeflection small_deflection(Model& model, const VectorXd& q, const Controls& unloaded,
                                 const Controls& controls, const std::optional<VectorXd>& at_rest) {
    const VectorXd moved = prescribed(model, q, unloaded, controls);
    model.evaluate(q, controls);
    const VectorXd loaded = model.residual().gradient;
    model.evaluate(q, unloaded);
    VectorXd forces = at_rest.value_or(model.residual().gradient) - loaded;
    if (!moved.isZero(0.0)) forces -= stiffness_times(moved, model, q, unloaded);

    const RotationsFromRest counted(model);
    model.assemble(q, unloaded, false);
    model.require_symmetric();
    const VectorXd free_forces = model.reduction().vector(counted.forces(std::move(forces)));
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
    found.motion = moved + counted.motion(model.reduction().expand(free_motion));
    return found;
}

}  // namespace magshell
