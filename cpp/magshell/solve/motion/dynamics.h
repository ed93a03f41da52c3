// Time integration of a motion, in given steps or in steps that its error estimate chooses, and what is stored for the adjoint.
//
// A given step that fails is repeated in substeps; a chosen one is made shorter.
//
// If bodies in contact gain energy in a step that no force put in, implicit Euler repeats the step (the dissipative fallback), in substeps
// if it gains energy as well.
#pragma once

#include <functional>
#include <map>

#include "magshell/solve/motion/stepper.h"
#include "magshell/solve/statics.h"

namespace magshell {

/// Steps that are chosen by their estimated errors, on a ladder (step_ladder.h) in each of several equal intervals.
struct AdaptiveSteps {
    double tolerance = 0.0;  // [m] of one step
    double interval = 0.0;   // [s]
    Index intervals = 0;     // 0: the steps are given
    int deepest = 0;         // the shortest step is interval / 2^deepest
    Index record_every = 1;  // intervals between recorded states
    /// Returns the load parameters of a step, from one fraction of an interval to another: at its beginning and at its stages.
    std::function<std::vector<LoadParameters>(Index interval, double begin, double end)> load_parameters;
};

/// Everything a motion is computed from.
struct MotionInput {
    MotionState start;
    bool rotations_given = true;  // false: the edge rotations of the start are computed from equilibrium
    Inertia inertia;
    Viscosity viscosity;
    Tableau tableau;
    std::vector<double> time_steps;     // [s]; empty if they are to be chosen
    std::vector<Index> recorded = {0};  // numbers of steps after which a state is recorded, ascending
    AdaptiveSteps adaptive;
    /// Load parameters at the beginning of each step and at its stages, steps (stages + 1) in all; linear in between.
    std::vector<LoadParameters> load_parameters;
    TimeVaryingParameters
        varying;  // the values that vary in time; their numbers are appended to `load_parameters`
    NewtonOptions newton;
    ProjectiveOptions projective;          // used if it solves the stages
    std::vector<WatchedObstacle> watched;  // small ones, which no face may slip over

    Index steps() const { return static_cast<Index>(time_steps.size()); }
    /// Returns the number of the state that is recorded after so many steps, or -1 if none is.
    Index recorded_after(Index steps) const;
    /// Returns the load parameters at a fraction of a step.
    LoadParameters load_parameters_at(Index step, double fraction) const;
    /// Returns the index of the entry of `load_parameters` before a fraction of a step, and the weight of the entry after it.
    std::pair<Index, double> between(Index step, double fraction) const;
};

/// Returns the start of a motion: with edge rotations in equilibrium if none were given, and new Maxwell branches without stress.
MotionState start_of_motion(Model& model, const MotionInput& input);

/// The data of a motion that are stored for its adjoint. The less is stored, the more steps are computed again.
enum class AdjointStorage { nothing, checkpoints, stages, factors };

struct AdjointStorageOptions {
    bool gradients = false;
    std::size_t budget = 0;  // [bytes]
    AdjointStorage wanted =
        AdjointStorage::nothing;  // nothing: all stages, or checkpoints if the budget is too small for them
};

/// A part of a step, from one fraction of it to another; dissipative: taken by implicit Euler instead of the method chosen.
struct Substep {
    double begin = 0.0, end = 1.0;
    bool dissipative = false;

    double fraction() const { return end - begin; }
};
using Substeps = std::vector<Substep>;

/// Returns the load parameters at the beginning of a substep and at its stages.
std::vector<LoadParameters> stage_load_parameters(const MotionInput& input, const Tableau& tableau,
                                                  Index step, const Substep& substep);

struct MotionResult {
    Outcome outcome = Outcome::failed;
    std::string reason;
    Index steps_done = 0;
    bool begun = false;                 // whether `start` has the edge rotations that the motion begins with
    MotionState start, last;            // start: as the first step used it
    double fraction_done = 0.0;         // of the motion
    std::vector<double> time_steps;     // [s] of the steps done
    std::vector<Index> steps_recorded;  // numbers of steps after which states were recorded
    std::vector<double> step_errors;    // [m] estimated, of the steps done
    std::vector<int> step_factorizations;  // of the steps done, and of attempts at them
    std::vector<Index> divided;  // steps that failed as a whole, or that implicit Euler took instead
    std::vector<Index> gaining;  // steps that gained energy in contact even in their shortest part
    bool watched_energy = true;  // false: contact may have gained energy, as EnergyBalance does not apply
    std::vector<MotionState> recorded;   // including the start
    std::vector<double> kinetic_energy;  // [J], of the recorded states
    std::vector<std::vector<double>>
        energies;  // [J], of the recorded states, term by term; NaN if interrupted before they were known
    std::map<Index, Substeps>
        substeps;  // of the steps that were taken in substeps, or by the dissipative fallback
    AdjointStorage keep = AdjointStorage::nothing;
    std::vector<std::vector<SubstepRecord>> steps;  // if stages are stored
    std::map<Index, MotionState> checkpoints;       // by the step that begins there
    Index leaf = 0,
          slots = 0;  // steps whose stages fit into the budget at once, and number of checkpoints that do
    int iterations = 0, factorizations = 0;
    double linear_time = 0.0;
    std::size_t bytes = 0;  // of what is stored for the adjoint
};

/// Called once per iteration; throws Interrupted to stop the motion. shortest_part: of the steps that were divided so far [s], once these
/// are many, else 0.
using MotionWatch = std::function<void(double progress, double shortest_part)>;

/// Follows a motion step by step while the factorizations of its stages are at hand; the model is the motion's.
class MotionFollower {
  public:
    virtual ~MotionFollower() = default;
    virtual void begin(const MotionState& start) = 0;
    /// Called with the substeps of each step and their stages.
    virtual void follow(Index step, const Substeps& substeps, const std::vector<SubstepRecord>& records) = 0;
};

/// Computes a motion. If it fails or is interrupted, the result holds the steps done until then. follower: of given steps; or nullptr.
MotionResult simulate(Model& model, const MotionInput& input, const AdjointStorageOptions& keep,
                      const MotionWatch& watch = {}, MotionFollower* follower = nullptr);

/// Returns the substeps in which a step was taken.
Substeps substeps_of(const std::map<Index, Substeps>& substeps, Index step);

/// Repeats one step exactly as it was taken; `kept` receives its substeps if it is not null.
void repeat_step(Stepper& stepper, const MotionInput& input, Index step, const Substeps& substeps,
                 MotionState& state, std::vector<SubstepRecord>* kept);

/// Returns the number of steps before the next checkpoint in an interval of `steps` steps, or 0 if the interval fits into storage at
/// once: the optimal schedule `revolve` [Griewank and Walther 2000], with `slots` checkpoints and `leaf` steps that fit at once.
Index next_checkpoint(Index steps, Index leaf, Index slots);

}  // namespace magshell
