// A motion: steps of equal length, halved where one fails, and what is kept of them for the way back. Where bodies touch
// and a step gains energy that nobody put in, implicit Euler takes it instead, in halves where even that does.
#pragma once

#include <map>

#include "magshell/solve/statics.h"
#include "magshell/solve/stepper.h"

namespace magshell {

/// What the steps are taken with.
struct MotionInput {
    MotionState start;
    bool rotations_given = true;  // false: those of the start are to be at rest first
    Inertia inertia;
    Viscosity viscosity;
    Tableau tableau;
    double time_step = 0.0;  // [s]
    Index steps = 0;
    /// Per step, at its beginning and at its stages: steps (stages + 1). In between, straight lines.
    std::vector<Controls> controls;
    Varying varying;  // values whose numbers stand in them, after the others
    NewtonOptions newton;
    ProjectiveOptions projective;  // where it solves the stages
    Index record_every = 1;        // steps between the states handed out, from the start on

    /// At a share of a step.
    Controls controls_at(Index step, double share) const;
    /// The two of `controls` next to it, and the weight of the second.
    std::pair<Index, double> between(Index step, double share) const;
};

/// How much of a motion is kept for gradients. Less means more steps taken again on the way back.
enum class Keep { nothing, checkpoints, stages, factors };

struct KeepOptions {
    bool gradients = false;
    std::size_t budget = 0;       // [bytes]
    Keep wanted = Keep::nothing;  // nothing: stages, or checkpoints where the budget does not hold them
};

/// A part of a step, from a share of it to another; dissipative: by implicit Euler, whatever the method is.
struct Substep {
    double begin = 0.0, end = 1.0;
    bool dissipative = false;

    double share() const { return end - begin; }
};
using Substeps = std::vector<Substep>;

/// At the beginning of a step or of a part of one, and at its stages.
std::vector<Controls> controls_of(const MotionInput& input, const Tableau& tableau, Index step,
                                  const Substep& substep);

struct MotionResult {
    Outcome outcome = Outcome::failed;
    std::string reason;
    Index steps_done = 0;
    bool begun = false;                         // whether the start's edge rotations are those it moves with
    MotionState start, last;                    // start: as the first step took it
    std::vector<MotionState> recorded;          // every record_every steps, the start first
    std::vector<double> kinetic_energy;         // [J], of those
    std::vector<std::vector<double>> energies;  // [J], of those, term by term; NaN if interrupted meanwhile
    std::map<Index, Substeps> halved;  // the steps that were taken in substeps, or in a dissipative one
    Keep keep = Keep::nothing;
    std::vector<std::vector<SubstepRecord>> steps;  // where stages are kept
    std::map<Index, MotionState> checkpoints;       // by the step that begins there
    Index leaf = 0, slots = 0;                      // steps that fit at once; checkpoints that do
    int iterations = 0, factorizations = 0;
    double linear_time = 0.0;
    std::size_t bytes = 0;  // of what is kept for gradients
};

/// Called now and then; throws Interrupted to stop.
using MotionWatch = std::function<void(double progress, double residual)>;

/// Takes the steps. Interrupted or failed, it hands back those that were done.
MotionResult simulate(Model& model, const MotionInput& input, const KeepOptions& keep,
                      const MotionWatch& watch = {});

/// The substeps in which a step was taken.
Substeps substeps_of(const std::map<Index, Substeps>& halved, Index step);

/// Takes one step again exactly as it was taken; `kept` gets its substeps.
void repeat_step(Stepper& stepper, const MotionInput& input, Index step, const Substeps& substeps,
                 MotionState& state, std::vector<SubstepRecord>* kept);

/// Where to put the next checkpoint in a stretch of so many steps (Griewank and Walther's revolve): the
/// number of steps before it, or 0 where the stretch fits at once.
Index next_checkpoint(Index steps, Index leaf, Index slots);

}  // namespace magshell
