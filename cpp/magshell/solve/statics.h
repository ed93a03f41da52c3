// A stable equilibrium: mixed Newton in adaptive load steps, saddles left, relaxation where it does not converge.
#pragma once

#include "magshell/solve/newton.h"

namespace magshell {

struct StaticsOptions {
    NewtonOptions newton;
    double first_step = 1.0;  // of the way from the old controls to the new
    double smallest_step = 1.0 / 64.0;
    bool require_stable = true;  // false: hand back what Newton found, a saddle too
    bool start_at_rest = true;   // the start is an equilibrium at the old controls: worth halving load steps
    int max_relaxation_steps = 500;
    int max_factorizations = 5000;  // after which it gives up; 20 iterations without one count as one
    bool keep_factor = false;       // for gradients
    std::vector<VectorXd> away_from =
        {};                    // equilibria at the new controls, where the start is already: another one
    double away_length = 0.0;  // [m] how far their deflection reaches
};

enum class Outcome { converged, failed, interrupted };

/// Where the last attempt of a search gave up, for those who ask why.
struct FailedAttempt {
    VectorXd state;              // empty: nowhere in particular
    Controls controls;           // that were to be reached
    double shortest_step = 1.0;  // of the way, the smallest that was tried
    double last_move = 0.0;      // [m], of the last relaxation step
    VectorXd falling;            // a direction of all unknowns in which the energy falls there, or empty
};

struct StaticsResult {
    Outcome outcome = Outcome::failed;
    VectorXd state;             // the equilibrium, or the last good state
    Model::Turns turns;         // of the terms, at `state`
    Controls controls;          // at which `state` holds
    double progress = 0.0;      // how far the controls got, 0 to 1
    bool effort_spent = false;  // whether it gave up for what it had cost
    std::string reason;
    FailedAttempt failed;
    int iterations = 0, factorizations = 0, failed_factorizations = 0, load_steps = 0, relaxation_steps = 0;
    int saddles_left = 0;
    double residual = 0.0;
    bool at_roundoff =
        false;  // the residual is within round-off, and not within the tolerance of the forces that cancel
    bool stable = false;
    Index unstable_directions = 0;
    double linear_time = 0.0;              // [s] in factorizations and solves
    std::size_t bytes = 0;                 // of the model and the factorization
    std::string factorization;             // which
    std::shared_ptr<const Factor> factor;  // of the Hessian at a stable `state`, if it was to be kept
};

/// Called now and then with the progress of the controls and the residual; throws Interrupted to stop.
using StaticsWatch = std::function<void(double progress, double residual)>;

/// From an equilibrium `start` at `from`, with the terms' turns there, to one at `to`; the numbers of what varies on the
/// way follow the others in both, and not in the result's.
StaticsResult find_equilibrium(Model& model, const VectorXd& start, const Model::Turns& turns,
                               const Controls& from, const Controls& to, const StaticsOptions& options,
                               const StaticsWatch& watch = {}, const Varying& varying = {});

}  // namespace magshell
