#include "magshell/solve/continuation.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "magshell/core/bracket.h"
#include "magshell/core/errors.h"
#include "magshell/solve/modes.h"
#include "magshell/solve/nonsymmetric_modes.h"

namespace magshell {
namespace {

// Newton iterations of the corrector per step: the largest number allowed, and the number at which the step length is kept; see
// test_buckling_is_where_the_path_branches.
constexpr int max_corrector_iterations = 8, target_iterations = 3;
// [-] Smallest cosine between the tangents at both ends of a step; if the path bends more, the step is halved. See
// test_buckling_is_where_the_path_branches.
constexpr double min_tangent_cosine = 0.5;
// [-] Lower bound of psi (see the header), over the largest step. It applies where the load moves the bodies by round-off only; arc length
// is then that of the path parameter. See test_buckling_without_a_load_is_refused.
constexpr double min_movement = 1e-3;
// [rad] Largest rotation of an obstacle in one step, so that a full turn is not skipped; see test_obstacles_that_move_far.py.
constexpr double max_obstacle_rotation = 0.5;
// [-] Distance along the path, over the step, below which several critical points are located as one; see
// test_buckling_is_where_the_path_branches.
constexpr double coincident_step = 1e-6;
// [-] Largest distance of supports from their target positions at a point of the path, over the extent; see test_a_clamp_that_shakes.
constexpr double support_tolerance = 1e-14;
// [-] Shortest step of the path, over the longest one before; where none that long succeeds, the path ends. See
// test_buckling_is_where_the_path_branches and test_a_path_does_not_pass_through_a_small_ball_between_contact_points.
constexpr double min_step_ratio = 1e-7;
// [-] A critical point is located once the eigenvalue nearest to zero is below this fraction of the larger one at the ends of the interval,
// or once the interval is below this fraction of the step; see test_buckling_is_where_the_path_branches.
constexpr double eigenvalue_tolerance = 1e-6, location_tolerance = 1e-9;
// [-] Cosine between the mode and the derivative of the residual by the path parameter, above which a critical point is a limit point and
// below which it is a bifurcation; see test_buckling_is_where_the_path_branches.
constexpr double limit_alignment = 1e-3;
constexpr double no_norm = 1e-300;  // added to a denominator, against division by zero; plain-words: ok

// The tangent (dq/ds, dlambda/ds) of the path.
struct Tangent {
    VectorXd state;
    double parameter = 0.0;
};

// Follows one path: predictor along the tangent, corrector, control of the step length, location of critical points.
class Follower {
  public:
    Follower(Newton& newton, const LoadParameters& from, const LoadParameters& to, const PathOptions& options,
             const Until& until, PathResult& result)
        : newton_(newton),
          model_(newton.model()),
          from_(from),
          to_(to),
          rate_(to + (-1.0) * from),
          options_(options),
          until_(until),
          result_(result),
          sides_(model_) {
        // The diagonal metric holds the area of each vertex three times, once per component; so the total area is a third of its sum.
        const double area = model_.metric().sum() / 3.0;
        weight_ = model_.metric() / (area * model_.extent() * model_.extent());
    }

    // Follows the path from `start` to the end of the parameter range, or until until_ returns true. Returns false, with a reason in
    // the result, if it cannot be followed that far.
    bool run(const VectorXd& start) {
        Tangent tangent;
        if (!(options_.branch_at ? begin_branch(tangent) : begin(start, tangent))) return false;
        while (static_cast<int>(result_.points.size()) < options_.max_points) {
            if (!advance(tangent)) return false;
            const PathPoint& last = result_.points.back();
            if (until_ && until_(last)) return true;
            if (last.parameter >= options_.max_parameter || last.parameter <= options_.min_parameter)
                return true;
        }
        return fail("the path reached max_points = " + std::to_string(options_.max_points) +
                    " points before its end");
    }

  private:
    // Begins at an equilibrium, in the direction in which the path parameter grows.
    bool begin(const VectorXd& start, Tangent& tangent) {
        PathPoint here{start, 0.0, {}, 0};
        const NewtonReport at_rest = newton_.solve(here.state, load_parameters(0.0));
        if (!at_rest.converged) return fail("the start is not an equilibrium: " + at_rest.reason);
        here.angle_branches = model_.angle_branches();
        if (!find_tangent(here, tangent)) return fail("the tangent does not exist at the start");
        here.field_sampling_error = model_.field_sampling_error(here.state, load_parameters(here.parameter));
        psi_ = std::max(length(tangent.state), min_movement * options_.max_step);
        normalize(tangent);
        if (tangent.parameter < 0.0) flip(tangent);
        result_.points.push_back(here);
        step_ = options_.first_step / tangent.parameter;
        return true;
    }

    // Begins at a bifurcation, along its mode [Crisfield 21.7; Keller 1977], which is perpendicular to the path through it if the
    // bifurcation is symmetric.
    bool begin_branch(Tangent& tangent) {
        const CriticalPoint& from = *options_.branch_at;
        psi_ = from.psi;
        result_.points.push_back(from.point);
        tangent = {options_.branch_side * from.mode, 0.0};
        if (!(length(tangent.state) > 0.0)) return fail("the mode of the bifurcation moves nothing");
        normalize(tangent);
        step_ = options_.max_step;
        model_.set_angle_branches(from.point.angle_branches);
        model_.evaluate(from.point.state, load_parameters(from.point.parameter));
        return true;
    }

    /// Returns the load parameters at a path parameter and applies the values that vary with them to the model.
    LoadParameters load_parameters(double parameter) const {
        LoadParameters there = interpolate(from_, to_, parameter);
        model_.parameters().set_time_varying(there);
        return there;
    }

    bool fail(std::string reason) {
        result_.reason = std::move(reason);
        return false;
    }

    // The inner product, norm and angle of the arc length (see the header).
    double product(const VectorXd& a, const VectorXd& b) const { return a.dot(weight_.cwiseProduct(b)); }
    double length(const VectorXd& a) const { return std::sqrt(product(a, a)); }

    void normalize(Tangent& t) const {
        const double norm = std::hypot(length(t.state), psi_ * t.parameter);
        t.state /= norm;
        t.parameter /= norm;
    }

    static void flip(Tangent& t) {
        t.state = -t.state;
        t.parameter = -t.parameter;
    }

    double cosine(const Tangent& a, const Tangent& b) const {
        return product(a.state, b.state) + psi_ * psi_ * a.parameter * b.parameter;
    }

    // Returns dq/dlambda with the last factorization: the given motion `held` of the supports plus the motion dq of the free dofs, from
    // K dq = -(dR/dlambda + K held). pull: K held.
    VectorXd response(const VectorXd& q, const LoadParameters& at, const VectorXd& held,
                      const VectorXd& pull) const {
        return held + newton_.solve_with_factor(-model_.parameters().gradient_rate(q, at, rate_) - pull);
    }

    // Factorizes the Hessian at a point of the path. Sets its tangent, not normalized, and its number of unstable directions. Returns false
    // if the Hessian is singular.
    bool find_tangent(PathPoint& point, Tangent& tangent) {
        const LoadParameters at = load_parameters(point.parameter);
        model_.evaluate(point.state, at);
        const VectorXd held = model_.parameters().prescribed_rate(point.state, at, rate_);
        Eigen::MatrixXd pull = held;
        const FactorReport factor = newton_.factorize(point.state, at, false, {}, pull);
        if (!factor.succeeded) return false;
        point.unstable_directions = count_unstable_directions(newton_, factor);
        tangent = {response(point.state, at, held, pull.col(0)), 1.0};
        return true;
    }

    // Takes a step along the tangent of the point `base` and corrects it by mixed Newton steps in state and path parameter, perpendicular to
    // the tangent. The model must have been evaluated at `base` last. Returns false if the corrector does not converge.
    bool correct(const PathPoint& base, const Tangent& along, double step, PathPoint& found,
                 int& iterations) {
        VectorXd q = base.state;
        model_.set_angle_branches(base.angle_branches);
        double parameter = base.parameter + step * along.parameter;
        VectorXd increment = step * along.state;
        for (iterations = 0;; ++iterations, newton_.count_iteration()) {
            if (model_.capabilities().has_barrier)
                increment *= model_.capabilities().admissible_step_length(q, increment);
            if (newton_.options().mixed) model_.extrapolate(increment);
            model_.dof_map().retract(q, increment);
            const LoadParameters at = load_parameters(parameter);
            model_.evaluate(q, at);
            const double residual = newton_.relative_residual(q, {});
            newton_.watch(residual);
            const VectorXd gap = model_.dof_map().prescribed_increment(q, at);
            const bool in_place = gap.lpNorm<Eigen::Infinity>() <= support_tolerance * model_.extent();
            if (in_place && residual <= newton_.options().tolerance) {
                found = {q, parameter, model_.angle_branches(), 0};
                return true;
            }
            if (!std::isfinite(residual) || iterations == max_corrector_iterations) return false;
            const VectorXd held = model_.parameters().prescribed_rate(q, at, rate_);
            Eigen::MatrixXd pulls(q.size(), 2);
            pulls << gap, held;
            if (!newton_.factorize(q, at, newton_.options().mixed, {}, pulls).succeeded) return false;
            const VectorXd correction =
                gap + newton_.solve_with_factor(-model_.residual().gradient - pulls.col(0));
            const VectorXd by_parameter = response(q, at, held, pulls.col(1));
            const double change = -product(along.state, correction) /
                                  (product(along.state, by_parameter) + psi_ * psi_ * along.parameter);
            increment = correction + change * by_parameter;
            parameter += change;
        }
    }

    // Appends the next point of the path and replaces the tangent by the tangent there. The step is halved until the corrector converges, no
    // obstacle is passed through or rotates too far, and the path does not bend too much. Returns false if no step is short enough.
    bool advance(Tangent& tangent) {
        const PathPoint base = result_.points.back();
        longest_ = std::max(longest_, std::min(step_, options_.max_step));
        bool at_base = true;  // whether the model was last evaluated at the base point
        std::string through;  // the obstacle that the last trial step would pass through
        sides_.remember(base.state, load_parameters(base.parameter));
        for (step_ = std::min(step_, options_.max_step);; step_ *= 0.5, at_base = false) {
            if (step_ < min_step_ratio * longest_) return fail(through.empty() ? describe_halt() : through);
            if (!at_base) model_.evaluate(base.state, load_parameters(base.parameter));
            PathPoint next;
            Tangent there;
            int iterations = 0;
            if (!correct(base, tangent, step_, next, iterations) || !end_in_range(next)) continue;
            const LoadParameters at = load_parameters(next.parameter);
            through = sides_.crossed(next.state, at);
            if (!through.empty() || sides_.turned(at) > max_obstacle_rotation || !find_tangent(next, there))
                continue;
            next.field_sampling_error = model_.field_sampling_error(next.state, at);
            normalize(there);
            double turn = cosine(tangent, there);
            if (turn < 0.0) {
                flip(there);
                turn = -turn;
            }
            if (turn < min_tangent_cosine) continue;
            const bool on_branch =
                options_.branch_at && result_.points.size() == 1;  // begins at a critical point
            if (options_.locate_critical && !on_branch &&
                next.unstable_directions != base.unstable_directions)
                locate({0.0, base}, {step_, next}, tangent);
            model_.set_angle_branches(next.angle_branches);
            model_.evaluate(next.state, load_parameters(next.parameter));
            result_.points.push_back(std::move(next));
            tangent = std::move(there);
            step_ *= std::clamp(std::sqrt(double(target_iterations) / std::max(iterations, 1)), 0.5, 2.0);
            return true;
        }
    }

    // Says that no step is short enough.
    std::string describe_halt() const {
        const std::string halt = "no step along the path converges, however short";
        if (!model_.contacts().any()) return halt;
        return halt +
               ". Where contact begins or ends a path turns sharply: a smaller contact_stiffness or a larger "
               "smoothing of the contact bends it less, and ms.equilibrium needs no arc length";
    }

    // Replaces a point with a path parameter outside its range by an equilibrium at the end of the range, solved from that point. Returns
    // false if the solve does not converge.
    bool end_in_range(PathPoint& point) {
        const double end = std::clamp(point.parameter, options_.min_parameter, options_.max_parameter);
        if (end == point.parameter) return true;
        if (!newton_.solve(point.state, load_parameters(end)).converged) return false;
        point.parameter = end;
        point.angle_branches = model_.angle_branches();
        return true;
    }

    // Returns the mode with the eigenvalue nearest to zero of the tangent factorized last, by its real part. transposed: the mode of K^T,
    // which is the same if K is symmetric. Empty if no eigenvalue could be computed.
    Mode nearest_mode(bool transposed) {
        if (!newton_.is_unsymmetric()) return modes_near_zero(newton_, 1).front();
        const std::vector<NonsymmetricMode> modes = spectrum_near_zero(newton_, 0.0, transposed).modes;
        if (modes.empty()) return {0.0, {}};
        const NonsymmetricMode& nearest =
            *std::min_element(modes.begin(), modes.end(), [](const auto& a, const auto& b) {
                return std::abs(a.eigenvalue.real()) < std::abs(b.eigenvalue.real());
            });
        return {nearest.eigenvalue.real(), nearest.shape};
    }

    // Returns the size of the eigenvalue nearest to zero at the point factorized last, with a sign that changes at the critical point:
    // positive as long as the point has `count` unstable directions, negative otherwise. Sets the mode too.
    double signed_eigenvalue(const PathPoint& point, Index count) {
        nearest_ = nearest_mode(false);
        const double size = std::abs(nearest_.eigenvalue);
        return point.unstable_directions == count ? size : -size;
    }

    // A trial point of the path, a step along the tangent from the last accepted point.
    struct Probe {
        double step;
        PathPoint point;
    };

    // Computes the point at a step along the tangent from `base`, and factorizes there. Returns an empty value if it does not converge.
    std::optional<Probe> probe(const PathPoint& base, const Tangent& along, double step) {
        Probe found{step, base};
        Tangent unused;
        int iterations = 0;
        model_.evaluate(base.state, load_parameters(base.parameter));
        const bool there = step == 0.0 || correct(base, along, step, found.point, iterations);
        return there && find_tangent(found.point, unused) ? std::optional(found) : std::nullopt;
    }

    // Locates the critical points between two points with different numbers of unstable directions. Bisects until the number changes by one in
    // each interval, or the interval is very short.
    void locate(const Probe& low, const Probe& high, const Tangent& along) {
        const Index crossings = std::abs(high.point.unstable_directions - low.point.unstable_directions);
        if (crossings == 0) return;
        if (crossings == 1 || high.step - low.step <= coincident_step * step_)
            return locate_one(low, high, along);
        const std::optional<Probe> middle = probe(result_.points.back(), along, 0.5 * (low.step + high.step));
        if (!middle) return;
        locate(low, *middle, along);
        locate(*middle, high, along);
    }

    // Locates the critical point between two points by regula falsi (Illinois variant) on the eigenvalue nearest to zero, and appends it to
    // the result.
    void locate_one(const Probe& below, const Probe& above, const Tangent& along) {
        const PathPoint& base = result_.points.back();
        const Index count = below.point.unstable_directions;
        if (!probe(base, along, below.step)) return;
        const double at_low = signed_eigenvalue(below.point, count);
        if (!probe(base, along, above.step)) return;
        Bracket bracket{below.step, at_low, above.step, signed_eigenvalue(above.point, count)};
        const double tolerance =
            eigenvalue_tolerance * std::max(std::abs(bracket.at_lower), std::abs(bracket.at_upper));
        PathPoint best = above.point;
        int side = 0;
        for (int k = 0; k < 30 && bracket.width() > location_tolerance * step_; ++k) {
            const double step = bracket.secant_zero();
            const std::optional<Probe> between = probe(base, along, step);
            if (!between) break;
            const double value = signed_eigenvalue(between->point, count);
            best = between->point;
            if (std::abs(value) <= tolerance) break;
            if (value > 0.0)
                bracket.move_lower(step, value, side == 1 ? 0.5 : 1.0);
            else
                bracket.move_upper(step, value, side == -1 ? 0.5 : 1.0);
            side = value > 0.0 ? 1 : -1;
        }
        if (nearest_.shape.size() == 0)
            return;  // the numbers of unstable directions of the points tell of it
        // [-] Eigenvalue at a critical point, over those at the ends of the interval, above which no real one passes through zero there:
        // a complex pair passes the imaginary axis. See test_a_path_passes_the_limit_point_of_a_live_pressure.
        constexpr double no_crossing = 0.1;
        const bool flutters = newton_.is_unsymmetric() &&
                              std::abs(nearest_.eigenvalue) > no_crossing / eigenvalue_tolerance * tolerance;
        const Mode mode = nearest_;
        const CriticalKind kind = flutters ? CriticalKind::flutter : kind_of(best);
        result_.critical.push_back(
            {best, kind, mode.shape, static_cast<Index>(result_.points.size()) - 1, psi_});
    }

    // Returns the kind of the critical point located last. At a limit point the loads and supports act on the left mode, so that the path
    // has no tangent with a change of the loads; at a bifurcation they do not.
    CriticalKind kind_of(const PathPoint& point) {
        const LoadParameters at = load_parameters(point.parameter);
        model_.set_angle_branches(point.angle_branches);
        model_.evaluate(point.state, at);
        VectorXd drive = model_.parameters().gradient_rate(point.state, at, rate_), left = nearest_.shape;
        const VectorXd held = model_.parameters().prescribed_rate(point.state, at, rate_);
        if (newton_.is_unsymmetric() || !held.isZero(0.0)) {
            Eigen::MatrixXd pull = held;
            newton_.factorize(point.state, at, false, {}, pull);
            drive += pull.col(0);
            if (newton_.is_unsymmetric()) left = nearest_mode(true).shape;
        }
        if (left.size() == 0) return CriticalKind::bifurcation;
        const VectorXd free_drive = model_.dof_map().vector(drive), free_mode = model_.dof_map().vector(left);
        const double alignment =
            std::abs(free_drive.dot(free_mode)) / (free_drive.norm() * free_mode.norm() + no_norm);
        return alignment > limit_alignment ? CriticalKind::limit : CriticalKind::bifurcation;
    }

    Newton& newton_;
    Model& model_;
    const LoadParameters from_, to_, rate_;
    const PathOptions& options_;
    const Until& until_;
    PathResult& result_;
    Mode nearest_;          // the mode nearest to zero at the point examined last
    ObstacleSides sides_;   // at the last accepted point
    VectorXd weight_;       // diagonal matrix of |dx|^2 / extent^2
    double psi_ = 1.0;      // weight of the path parameter in the arc length
    double step_ = 0.0;     // arc length of the next or current step
    double longest_ = 0.0;  // arc length of the longest step so far
};

}  // namespace

PathResult follow_path(Model& model, const VectorXd& start, const Model::AngleBranches& angle_branches,
                       const LoadParameters& from, const LoadParameters& to, const PathOptions& options,
                       const Until& until, const StaticsWatch& watch, const TimeVaryingParameters& varying) {
    const ScopedTimeVarying while_varying(model.parameters(), varying);
    const ScopedWatch while_watching(model, options.watched);
    model.set_angle_branches(angle_branches);
    PathResult result;
    Newton newton(model, options.newton, [&](double residual) {
        if (watch) watch(result.points.empty() ? 0.0 : result.points.back().parameter, residual);
    });
    try {
        Follower follower(newton, from, to, options, until, result);
        result.outcome = follower.run(start) ? Outcome::converged : Outcome::failed;
    } catch (const Interrupted&) {
        result.outcome = Outcome::interrupted;
        result.reason = "interrupted";
    }
    result.iterations = newton.iterations();
    result.factorizations = newton.factorizations();
    result.failed_factorizations = newton.failed_factorizations();
    return result;
}

}  // namespace magshell
