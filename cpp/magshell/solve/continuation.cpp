#include "magshell/solve/continuation.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "magshell/core/errors.h"
#include "magshell/solve/modes.h"
#include "magshell/solve/obstacle_sides.h"

namespace magshell {
namespace {

constexpr int corrector_iterations = 8, wanted_iterations = 3;
constexpr double smallest_turn_cosine =
    0.5;  // of successive tangents; a sharper bend asks for a shorter step
// Of the largest step, while the parameter goes from 0 to 1: below that nothing moves but by rounding, and arc
// length is that of the parameter.
constexpr double least_movement = 1e-3;
constexpr double longest_turn = 0.5;  // [rad] of an obstacle in one step: full circles must be gone through
constexpr double coincident = 1e-6;   // of a step: critical points closer than that count as one

struct Tangent {
    VectorXd state;
    double parameter = 0.0;
};

class Follower {
  public:
    Follower(Newton& newton, const Controls& from, const Controls& to, const PathOptions& options,
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
        // The mean over the area: three components of each vertex carry its area in the metric.
        const double area = model_.metric().sum() / 3.0;
        weight_ = model_.metric() / (area * model_.extent() * model_.extent());
    }

    bool run(const VectorXd& start) {
        PathPoint here{start, 0.0, {}, 0};
        const NewtonReport at_rest = newton_.solve(here.state, controls(0.0));
        if (!at_rest.converged) return fail("the start is not an equilibrium: " + at_rest.reason);
        here.turns = model_.turns();
        Tangent tangent;
        if (!find_tangent(here, tangent)) return fail("the tangent does not exist at the start");
        psi_ = std::max(length(tangent.state), least_movement * options_.largest_step);
        normalize(tangent);
        if (tangent.parameter < 0.0) flip(tangent);
        result_.points.push_back(here);
        step_ = options_.first_step / tangent.parameter;
        while (static_cast<int>(result_.points.size()) < options_.max_points) {
            if (!advance(tangent)) return false;
            const PathPoint& last = result_.points.back();
            if (until_ && until_(last)) return true;
            if (last.parameter >= options_.highest_parameter || last.parameter <= options_.lowest_parameter)
                return true;
        }
        return fail("the path has max_points = " + std::to_string(options_.max_points) +
                    " points and goes on");
    }

  private:
    /// Those at a parameter, with what varies in place.
    Controls controls(double parameter) const {
        Controls there = interpolate(from_, to_, parameter);
        model_.take(there);
        return there;
    }

    bool fail(std::string reason) {
        result_.reason = std::move(reason);
        return false;
    }

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

    // K dq = -(dR/dlambda + K dq_held) with the factorization at hand; the pull of dq_held is handed in.
    VectorXd response(const VectorXd& q, const Controls& at, const VectorXd& held,
                      const VectorXd& pull) const {
        return held + newton_.solve_with_factor(-model_.gradient_rate(q, at, rate_) - pull);
    }

    // Factorizes at a point: its tangent (not normalized) and its stability.
    bool find_tangent(PathPoint& point, Tangent& tangent) {
        const Controls at = controls(point.parameter);
        model_.evaluate(point.state, at);
        const VectorXd held = model_.prescribed_rate(point.state, at, rate_);
        Eigen::MatrixXd pull = held;
        const FactorReport factor = newton_.factorize(point.state, at, false, {}, pull);
        model_.require_symmetric();  // or the pivots say nothing of stability
        if (!factor.succeeded) return false;
        point.unstable_directions = factor.negative_pivots;
        tangent = {response(point.state, at, held, pull.col(0)), 1.0};
        return true;
    }

    // From a point along its tangent; the model's last evaluated state must be that point. False: no convergence.
    bool correct(const PathPoint& base, const Tangent& along, double step, PathPoint& found,
                 int& iterations) {
        VectorXd q = base.state;
        model_.set_turns(base.turns);
        double parameter = base.parameter + step * along.parameter;
        VectorXd increment = step * along.state;
        for (iterations = 0;; ++iterations, newton_.count_iteration()) {
            if (model_.has_body_contact()) increment *= model_.share_of_step(q, increment);
            if (newton_.options().mixed) model_.extrapolate(increment);
            model_.reduction().advance(q, increment);
            const Controls at = controls(parameter);
            model_.evaluate(q, at);
            const double residual = newton_.relative_residual(q, {});
            newton_.watch(residual);
            const VectorXd gap = model_.reduction().prescribed_increment(q, at);
            const bool in_place = gap.lpNorm<Eigen::Infinity>() <= 1e-14 * model_.extent();
            if (in_place && residual <= newton_.options().tolerance) {
                found = {q, parameter, model_.turns(), 0};
                return true;
            }
            if (!std::isfinite(residual) || iterations == corrector_iterations) return false;
            const VectorXd held = model_.prescribed_rate(q, at, rate_);
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

    bool advance(Tangent& tangent) {
        const PathPoint base = result_.points.back();
        const double shortest = 1e-7 * step_;
        bool at_base = true;  // whether the model was last evaluated there
        std::string through;  // an obstacle
        sides_.remember(base.state, controls(base.parameter));
        for (step_ = std::min(step_, options_.largest_step);; step_ *= 0.5, at_base = false) {
            if (step_ < shortest)
                return fail(through.empty() ? "no step along the path converges, however short" : through);
            if (!at_base) model_.evaluate(base.state, controls(base.parameter));
            PathPoint next;
            Tangent there;
            int iterations = 0;
            if (!correct(base, tangent, step_, next, iterations) || !end_in_range(next)) continue;
            const Controls at = controls(next.parameter);
            through = sides_.crossed(next.state, at);
            if (!through.empty() || sides_.turned(at) > longest_turn || !find_tangent(next, there)) continue;
            normalize(there);
            double turn = cosine(tangent, there);
            if (turn < 0.0) {
                flip(there);
                turn = -turn;
            }
            if (turn < smallest_turn_cosine) continue;
            if (options_.locate_critical && next.unstable_directions != base.unstable_directions)
                locate({0.0, base}, {step_, next}, tangent);
            model_.set_turns(next.turns);
            model_.evaluate(next.state, controls(next.parameter));
            result_.points.push_back(std::move(next));
            tangent = std::move(there);
            step_ *= std::clamp(std::sqrt(double(wanted_iterations) / std::max(iterations, 1)), 0.5, 2.0);
            return true;
        }
    }

    // A point past the end of the range is exchanged for the one at its end.
    bool end_in_range(PathPoint& point) {
        const double end = std::clamp(point.parameter, options_.lowest_parameter, options_.highest_parameter);
        if (end == point.parameter) return true;
        if (!newton_.solve(point.state, controls(end)).converged) return false;
        point.parameter = end;
        point.turns = model_.turns();
        return true;
    }

    // The eigenvalue next to zero at the point just factorized, positive on the side of `count` unstable directions.
    double signed_eigenvalue(const PathPoint& point, Index count, VectorXd* mode) {
        const std::vector<Mode> modes = modes_near_zero(newton_, 1);
        if (mode) *mode = modes.front().shape;
        const double size = std::abs(modes.front().eigenvalue);
        return point.unstable_directions == count ? size : -size;
    }

    // A point of the path between two of its points, `step` along the tangent of the first.
    struct Probe {
        double step;
        PathPoint point;
    };

    // Factorizes at a point between; the model and the factor are there afterwards. Empty: no convergence.
    std::optional<Probe> probe(const PathPoint& base, const Tangent& along, double step) {
        Probe found{step, base};
        Tangent unused;
        int iterations = 0;
        model_.evaluate(base.state, controls(base.parameter));
        const bool there = step == 0.0 || correct(base, along, step, found.point, iterations);
        return there && find_tangent(found.point, unused) ? std::optional(found) : std::nullopt;
    }

    // Every critical point between two points of different stability; halves until each stands alone.
    void locate(const Probe& low, const Probe& high, const Tangent& along) {
        const Index crossings = std::abs(high.point.unstable_directions - low.point.unstable_directions);
        if (crossings == 0) return;
        if (crossings == 1 || high.step - low.step <= coincident * step_) return locate_one(low, high, along);
        const std::optional<Probe> middle = probe(result_.points.back(), along, 0.5 * (low.step + high.step));
        if (!middle) return;
        locate(low, *middle, along);
        locate(*middle, high, along);
    }

    // By the Illinois variant of regula falsi on the eigenvalue next to zero.
    void locate_one(const Probe& below, const Probe& above, const Tangent& along) {
        const PathPoint& base = result_.points.back();
        const Index count = below.point.unstable_directions;
        VectorXd mode;
        if (!probe(base, along, below.step)) return;
        double low = below.step, high = above.step, at_low = signed_eigenvalue(below.point, count, nullptr);
        if (!probe(base, along, above.step)) return;
        double at_high = signed_eigenvalue(above.point, count, &mode);
        const double tolerance = 1e-6 * std::max(std::abs(at_low), std::abs(at_high));
        PathPoint best = above.point;
        int side = 0;
        for (int k = 0; k < 30 && high - low > 1e-9 * step_; ++k) {
            const double step = low + (high - low) * at_low / (at_low - at_high);
            const std::optional<Probe> between = probe(base, along, step);
            if (!between) break;
            const double value = signed_eigenvalue(between->point, count, &mode);
            best = between->point;
            if (std::abs(value) <= tolerance) break;
            if (value > 0.0) {
                low = step;
                at_low = value;
                if (side == 1) at_high *= 0.5;
                side = 1;
            } else {
                high = step;
                at_high = value;
                if (side == -1) at_low *= 0.5;
                side = -1;
            }
        }
        const VectorXd drive = model_.gradient_rate(best.state, controls(best.parameter), rate_);
        const VectorXd free_drive = model_.reduction().vector(drive),
                       free_mode = model_.reduction().vector(mode);
        const double alignment =
            std::abs(free_drive.dot(free_mode)) / (free_drive.norm() * free_mode.norm() + 1e-300);
        const CriticalKind kind = alignment > 1e-3 ? CriticalKind::limit : CriticalKind::bifurcation;
        result_.critical.push_back({best, kind, mode, static_cast<Index>(result_.points.size()) - 1});
    }

    Newton& newton_;
    Model& model_;
    const Controls from_, to_, rate_;
    const PathOptions& options_;
    const Until& until_;
    PathResult& result_;
    ObstacleSides sides_;  // at the last point
    VectorXd weight_;
    double psi_ = 1.0, step_ = 0.0;
};

}  // namespace

PathResult follow_path(Model& model, const VectorXd& start, const Model::Turns& turns, const Controls& from,
                       const Controls& to, const PathOptions& options, const Until& until,
                       const StaticsWatch& watch, const Varying& varying) {
    const WhileVarying while_varying(model, varying);
    model.set_turns(turns);
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
