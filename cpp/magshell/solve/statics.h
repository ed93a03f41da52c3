// Finds a stable equilibrium: mixed Newton in adaptive load steps, escape from saddles, and energy descent if it does not converge.
#pragma once

#include "magshell/solve/globalization/obstacle_sides.h"
#include "magshell/solve/globalization/proximal_continuation.h"
#include "magshell/solve/newton/newton.h"
#include "magshell/solve/solve_log.h"

namespace magshell {

struct StaticsOptions {
    NewtonOptions newton;
    double first_step = 1.0;  // initial load step, of the path from the old load parameters to the new ones
    double smallest_step = 0.015625;  // 1/64 of the path
    bool require_stable = true;       // false: return what Newton found, even if it is a saddle
    bool start_at_rest =
        true;  // the start is an equilibrium at the old load parameters, so load steps may be shortened
    int max_relaxation_steps = 500;
    int max_factorizations =
        5000;  // after which the solve gives up; 20 iterations without a factorization count as one
    bool keep_factor = false;  // for gradients
    std::vector<VectorXd> away_from =
        {};  // known equilibria at the new load parameters, which the result must differ from
    double away_length = 0.0;  // [m] rms deflection of these, the length scale of the deflation
    std::vector<WatchedObstacle> watched = {};  // those that move
};

enum class Outcome { converged, failed, interrupted };

/// The state at which the last attempt gave up, for error messages.
struct FailedAttempt {
    VectorXd state;                  // empty if there is none
    LoadParameters load_parameters;  // the load parameters that were to be reached
    double shortest_step = 1.0;      // the smallest load step that was tried, of the load path
    double last_displacement = 0.0;  // [m], of the last relaxation step
    VectorXd descent_direction;      // a direction of all dofs in which the energy falls there, or empty
};

struct StaticsResult {
    Outcome outcome = Outcome::failed;
    VectorXd state;                       // the equilibrium, or the last good state
    Model::AngleBranches angle_branches;  // of the angles of the terms at `state`
    LoadParameters load_parameters;       // the load parameters at which `state` is an equilibrium
    double progress = 0.0;                // load fraction reached, 0 to 1
    bool effort_spent = false;            // whether the budget of factorizations ended the solve
    std::string reason;
    FailedAttempt failed;
    std::vector<SolveStep> log;  // of all steps; their factorizations and iterations sum to those below
    int iterations = 0, factorizations = 0, failed_factorizations = 0, load_steps = 0, relaxation_steps = 0;
    int saddles_escaped = 0;
    std::vector<OtherBranch> other_branches;  // of all saddles that were left
    double residual = 0.0;
    bool at_roundoff =
        false;  // the residual is within round-off, but not within the tolerance relative to the forces that cancel
    bool stable = false;
    double field_sampling_error =
        0.0;  // [-] as Term::field_sampling_error, at the end of a search that succeeded
    Index unstable_directions = 0;
    double linear_time = 0.0;              // [s] in factorizations and solves
    std::size_t bytes = 0;                 // of the model and the factorization
    std::string factorization;             // name of the factorization
    std::shared_ptr<const Factor> factor;  // of the Hessian near a stable `state`, if it was to be kept
    bool factor_is_exact = false;          // whether it is that at `state` itself
};

/// Called once per iteration with the load fraction and the residual; throws Interrupted to stop.
using StaticsWatch = std::function<void(double progress, double residual)>;

/// Solves from an equilibrium `start` at `from`, whose angles have these branches, to one at `to`. The values of `varying` are appended to
/// both, and removed from those of the result.
StaticsResult find_equilibrium(Model& model, const VectorXd& start,
                               const Model::AngleBranches& angle_branches, const LoadParameters& from,
                               const LoadParameters& to, const StaticsOptions& options,
                               const StaticsWatch& watch = {}, const TimeVaryingParameters& varying = {});

}  // namespace magshell
