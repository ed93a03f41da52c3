// Time integration of a motion: equal steps, which are repeated in substeps if one fails, and what is stored for the adjoint.
//
// If bodies in contact gain energy in a step that no force put in, implicit Euler repeats the step (the dissipative fallback), in substeps
// if it gains energy as well.
#pragma once

#include <map>

#include "magshell/solve/motion/stepper.h"
#include "magshell/solve/statics.h"

namespace magshell {

/// Everything a motion is computed from.
struct MotionInput {
    MotionState start;
    bool rotations_given = true;  // false: the edge rotations of the start are computed from equilibrium
    Inertia inertia;
    Viscosity viscosity;
    Tableau tableau;
    double time_step = 0.0;  // [s]
    Index steps = 0;
    /// Load parameters at the beginning of each step and at its stages, steps (stages + 1) in all; linear in between.
    std::vector<LoadParameters> load_parameters;
    TimeVaryingParameters
        varying;  // the values that vary in time; their numbers are appended to `load_parameters`
    NewtonOptions newton;
    ProjectiveOptions projective;  // used if it solves the stages
    Index record_every = 1;        // steps between recorded states

    /// Returns the load parameters at a fraction of a step.
    LoadParameters load_parameters_at(Index step, double fraction) const;
    /// Returns the index of the entry of `load_parameters` before a fraction of a step, and the weight of the entry after it.
    std::pair<Index, double> between(Index step, double fraction) const;
};

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
    bool begun = false;                  // whether `start` has the edge rotations that the motion begins with
    MotionState start, last;             // start: as the first step used it
    std::vector<MotionState> recorded;   // every record_every steps, including the start
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

/// Called once per iteration; throws Interrupted to stop the motion.
using MotionWatch = std::function<void(double progress, double residual)>;

/// Computes a motion. If it fails or is interrupted, the result holds the steps done until then.
MotionResult simulate(Model& model, const MotionInput& input, const AdjointStorageOptions& keep,
                      const MotionWatch& watch = {});

/// Returns the substeps in which a step was taken.
Substeps substeps_of(const std::map<Index, Substeps>& substeps, Index step);

/// Repeats one step exactly as it was taken; `kept` receives its substeps if it is not null.
void repeat_step(Stepper& stepper, const MotionInput& input, Index step, const Substeps& substeps,
                 MotionState& state, std::vector<SubstepRecord>* kept);

/// Returns the number of steps before the next checkpoint in an interval of `steps` steps, or 0 if the interval fits into storage at
/// once: the optimal schedule `revolve` [Griewank and Walther 2000], with `slots` checkpoints and `leaf` steps that fit at once.
Index next_checkpoint(Index steps, Index leaf, Index slots);

}  // namespace magshell
