#include "magshell/solve/motion/dynamics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "magshell/core/errors.h"
#include "magshell/solve/globalization/obstacle_sides.h"
#include "magshell/solve/motion/edge_rotations.h"
#include "magshell/solve/motion/energy_balance.h"
#include "magshell/solve/motion/step_ladder.h"

namespace magshell {
namespace {

constexpr double smallest_part = 1.0 / 64.0;  // [-] of a step; see test_a_step_that_fails_is_taken_in_parts

std::size_t bytes_of(const MotionState& state) {
    std::size_t bytes = state.rates.elastic.d.bytes();
    for (const StrainSet& strains : state.e) bytes += strains.bytes();
    for (const StrainSet& rates : state.rates.elastic.e) bytes += rates.bytes();
    return bytes + sizeof(double) * (state.q.size() + state.v.size() + state.rates.v.size() +
                                     state.rates.acceleration.size() + state.rates.c.size() +
                                     state.rates.momentum_rate.size());
}

std::size_t bytes_of(const SubstepRecord& substep) {
    std::size_t bytes = bytes_of(substep.begin);
    const Factor* last = nullptr;  // stages in a row may share a factorization
    for (const StageState& stage : substep.stages) {
        bytes += sizeof(double) * (stage.q.size() + stage.contact.size());
        if (stage.factor && stage.factor.get() != last) bytes += stage.factor->own_bytes();
        last = stage.factor.get();
    }
    return bytes;
}

// Appends the last state to the recorded ones, with the kinetic energy for the present parameters; its other energies are
// filled in later.
void record_state(const Model& model, const MotionInput& input, MotionResult& result) {
    const MotionState& state = result.last;
    result.recorded.push_back(
        {state.q, state.v, state.angle_branches, {}, {}, state.motor_forces, state.held});
    result.kinetic_energy.push_back(0.5 * state.v.dot(input.inertia.mass.cwiseProduct(state.v)) +
                                    model.fluid_energy(state.q, state.v));
    result.energies.emplace_back(model.term_names().size(), std::numeric_limits<double>::quiet_NaN());
}

class Run {
  public:
    // grown: the input itself if the steps are to be chosen; it receives those that are accepted. Else nullptr. follower: or nullptr.
    Run(Newton& newton, const MotionInput& input, MotionInput* grown, const AdjointStorageOptions& keep,
        MotionFollower* follower, MotionResult& result)
        : newton_(newton),
          model_(newton.model()),
          input_(input),
          grown_(grown),
          follower_(follower),
          result_(result),
          stepper_(newton, input.tableau, input.inertia, input.viscosity, input.projective),
          balance_(model_, input.inertia, stepper_.free_bodies(), input.tableau) {
        if (grown_) grown_->load_parameters = input_.adaptive.load_parameters(0, 0.0, 1.0);
        result_.start = result_.last = start_of_motion(newton.model(), input);
        result_.begun = true;
        result_.watched_energy = !balance_.fails_to_apply();
        if (keep.gradients) plan(keep);
        if (follower_) follower_->begin(result_.start);
    }

    bool run() {
        record();
        if (result_.keep == AdjointStorage::checkpoints) result_.checkpoints[0] = result_.start;
        return grown_ ? choose_steps() : take_steps();
    }

  private:
    // A step, or an attempt at one.
    struct Attempt {
        bool succeeded = false, divided = false;
        bool gained = false;  // energy in contact, in a shortest part
        Substeps substeps;
        std::vector<SubstepRecord> records;  // if they are stored
        double error = 0.0;                  // [m], the sum of those of the substeps
    };

    bool take_steps() {
        while (result_.steps_done < input_.steps()) {
            const Index step = result_.steps_done;
            if (step == next_checkpoint_) keep_checkpoint(step);
            const int before = newton_.factorizations();
            MotionState state = result_.last;
            Attempt attempt = take(step, 1.0, true, state);
            if (!attempt.succeeded) return false;
            result_.fraction_done = static_cast<double>(step + 1) / static_cast<double>(input_.steps());
            finish_step(std::move(attempt), std::move(state), newton_.factorizations() - before);
        }
        return true;
    }

    // Takes steps on a ladder; only those that are accepted remain in the input and in the result.
    bool choose_steps() {
        const AdaptiveSteps& adaptive = input_.adaptive;
        // The order of every method here is its number of stages.
        StepLadder ladder(adaptive.tolerance, input_.tableau.stages, adaptive.deepest);
        const std::size_t rows = input_.tableau.stages + 1;
        int before = newton_.factorizations();
        for (Index interval = 0; interval < adaptive.intervals;) {
            const Index step = result_.steps_done;
            grown_->time_steps.resize(step);
            grown_->time_steps.push_back(ladder.fraction() * adaptive.interval);
            grown_->load_parameters.resize(rows * step);
            for (LoadParameters& each : adaptive.load_parameters(interval, ladder.begin(), ladder.end()))
                grown_->load_parameters.push_back(std::move(each));
            MotionState state = result_.last;
            Attempt attempt = take(step, ladder.fraction(), false, state);
            if (!attempt.succeeded || !ladder.accepts(attempt.error)) {
                if (ladder.reject(attempt.succeeded ? attempt.error
                                                    : std::numeric_limits<double>::infinity()))
                    continue;
                if (attempt.succeeded) {
                    std::ostringstream reason;
                    reason << "its error is estimated to be " << attempt.error
                           << " m, above the tolerance of " << adaptive.tolerance << " m";
                    result_.reason = reason.str();
                }
                return false;
            }
            if (ladder.accept(attempt.error) && ++interval % adaptive.record_every == 0)
                grown_->recorded.push_back(step + 1);
            result_.fraction_done =
                (static_cast<double>(interval) + ladder.begin()) / static_cast<double>(adaptive.intervals);
            finish_step(std::move(attempt), std::move(state), newton_.factorizations() - before);
            before = newton_.factorizations();
            if (result_.keep != AdjointStorage::nothing) thin_out(step);
        }
        return true;
    }

    void finish_step(Attempt attempt, MotionState state, int factorizations) {
        const Index step = result_.steps_done;
        if (attempt.substeps.size() > 1 || attempt.substeps.front().dissipative)
            result_.substeps[step] = std::move(attempt.substeps);
        if (attempt.divided) result_.divided.push_back(step);
        if (attempt.gained) result_.gaining.push_back(step);
        if (follower_) be_followed(step, attempt.records);
        if (!attempt.records.empty()) {
            for (const SubstepRecord& substep : attempt.records) result_.bytes += bytes_of(substep);
            result_.steps.push_back(std::move(attempt.records));
        }
        result_.step_errors.push_back(attempt.error);
        result_.step_factorizations.push_back(factorizations);
        std::swap(result_.last, state);
        before_last_ = std::move(state);
        ++result_.steps_done;
        if (input_.recorded_after(result_.steps_done) >= 0) record();
    }

    // Shows a step to the follower, and then drops what is not to be stored.
    void be_followed(Index step, std::vector<SubstepRecord>& records) {
        follower_->follow(step, substeps_of(result_.substeps, step), records);
        if (result_.keep == AdjointStorage::factors) return;
        for (SubstepRecord& substep : records)
            for (StageState& stage : substep.stages)
                if (stage.factor.use_count() == 1)
                    model_.store_spare_factor(std::const_pointer_cast<Factor>(std::move(stage.factor)));
                else
                    stage.factor.reset();
        if (!stores_stages(step)) records.clear();
    }

    // Decides what is stored: all stages, if the budget allows it. Otherwise a third of the budget is for the stages of the last
    // steps, a third for checkpoints, and a third for the steps that are repeated. Factorizations are stored on demand only:
    // allocating memory for each costs more than the adjoint saves. The number of steps that are yet to be chosen is unknown, so
    // all stages are stored until they exceed the budget.
    void plan(const AdjointStorageOptions& keep) {
        const bool explicit_first = input_.tableau.begins_explicitly;
        const std::size_t vector = sizeof(double) * model_.size();
        const std::size_t strains = sizeof(double) * model_.elastic().size();
        const bool implicit_contact = input_.tableau.implicit_contact;
        const bool carries = explicit_first && model_.may_have_fluid_momentum();
        std::size_t state =
            ((explicit_first ? 4 : 2) + (implicit_contact ? 1 : 0) + (carries ? 1 : 0)) * vector;
        const std::size_t branches = input_.viscosity.branches.size();
        state += branches * strains;
        if (explicit_first && input_.viscosity.any()) state += (1 + branches) * strains;
        const std::size_t step = state + (implicit_contact ? 2 : 1) * input_.tableau.stages * vector;
        const bool fits = step * static_cast<std::size_t>(input_.steps()) <= keep.budget;
        result_.keep = keep.wanted != AdjointStorage::nothing ? keep.wanted
                       : fits                                 ? AdjointStorage::stages
                                                              : AdjointStorage::checkpoints;
        budget_ =
            keep.wanted == AdjointStorage::nothing ? keep.budget : std::numeric_limits<std::size_t>::max();
        if (result_.keep != AdjointStorage::checkpoints && !grown_) return;
        result_.leaf = std::max<Index>(1, static_cast<Index>(keep.budget / 3 / step));
        result_.slots = std::max<Index>(1, static_cast<Index>(keep.budget / 3 / state));
        slots_left_ = result_.slots;
        if (!grown_) aim(0);
    }

    void aim(Index step) {
        const Index ahead = next_checkpoint(input_.steps() - result_.leaf - step, result_.leaf, slots_left_);
        next_checkpoint_ = ahead > 0 ? step + ahead : -1;
    }

    void keep_checkpoint(Index step) {
        result_.checkpoints[step] = result_.last;
        result_.bytes += bytes_of(result_.last);
        --slots_left_;
        aim(step);
    }

    // Stores the beginning of a chosen step that was just taken, at equal distances that double when all slots are taken. Exchanges
    // stages for such checkpoints when they exceed the budget.
    void thin_out(Index step) {
        if (result_.keep == AdjointStorage::checkpoints) {
            if (step % spacing_ == 0) result_.checkpoints[step] = before_last_;
        } else if (result_.bytes > budget_) {
            result_.keep = AdjointStorage::checkpoints;
            for (std::size_t k = 0; k < result_.steps.size(); ++k)
                result_.checkpoints[static_cast<Index>(k)] = std::move(result_.steps[k].front().begin);
            result_.steps.clear();
        } else {
            return;
        }
        while (static_cast<Index>(result_.checkpoints.size()) > result_.slots) {
            spacing_ *= 2;
            std::erase_if(result_.checkpoints, [&](const auto& each) { return each.first % spacing_ != 0; });
        }
        result_.bytes = 0;
        for (const auto& each : result_.checkpoints) result_.bytes += bytes_of(each.second);
    }

    // Returns true if a step starts without the rates of a previous one and has rigid bodies or skeletons: their first
    // SDIRK2 stage is of first order. A short first substep makes this error small; each further substep is as long as all before it.
    bool needs_short_start(const MotionState& state) const {
        return input_.tableau.begins_explicitly && !stepper_.tableau_from(state, false).begins_explicitly &&
               model_.dof_map().has_reduced_coordinates();
    }

    // Returns the substeps of such a step, the last one first.
    static Substeps short_start_substeps() {
        Substeps ahead;
        for (double end = 1.0; end > smallest_part; end *= 0.5) ahead.push_back({0.5 * end, end});
        ahead.push_back({0.0, smallest_part});
        return ahead;
    }

    bool stores_stages(Index step) const {
        if (result_.keep == AdjointStorage::checkpoints)
            return !grown_ && step >= input_.steps() - result_.leaf;
        return result_.keep != AdjointStorage::nothing;
    }

    // Takes a step: the given fraction of an interval. If the whole step fails, takes it in substeps if it is divisible; the attempt fails
    // if the shortest substep fails.
    Attempt take(Index step, double fraction, bool divisible, MotionState& state) {
        const bool keep = stores_stages(step) || follower_;
        Attempt attempt;
        Substeps ahead = needs_short_start(state) ? short_start_substeps() : Substeps{Substep{}};
        while (!ahead.empty()) {
            const Substep substep = ahead.back();
            ahead.pop_back();
            SubstepRecord record;
            const Tableau& tableau = stepper_.tableau_from(state, substep.dissipative);
            const std::vector<LoadParameters> load_parameters =
                stage_load_parameters(input_, tableau, step, substep);
            const double dt = substep.fraction() * input_.time_steps[step];
            const bool recorded = keep || balance_.applies(),
                       shortest = fraction * substep.fraction() <= smallest_part;
            const bool taken =
                stepper_.step(state, dt, substep.dissipative, load_parameters, recorded ? &record : nullptr,
                              result_.keep == AdjointStorage::factors || follower_, result_.reason);
            const bool calm = substep.dissipative || input_.tableau.stages == 1;  // implicit Euler already
            const bool gains_energy =
                taken && balance_.applies() &&
                balance_.gains_energy(stepper_.algebra(dt, tableau), record, state, load_parameters);
            // No shorter and no calmer part is left: it is kept, and told.
            const bool kept = gains_energy && calm && shortest;
            if (taken && (!gains_energy || kept)) {
                attempt.gained |= kept;
                attempt.error += stepper_.error();
                attempt.substeps.push_back(substep);
                if (keep) attempt.records.push_back(std::move(record));
                continue;
            }
            attempt.divided = true;
            if (gains_energy) {
                state = std::move(record.begin);
                result_.reason = "bodies in contact gained energy";
            }
            if (gains_energy && !calm) {
                ahead.push_back({substep.begin, substep.end, true});
                continue;
            }
            if (!divisible || shortest) return attempt;
            const double middle = 0.5 * (substep.begin + substep.end);
            ahead.push_back({middle, substep.end, substep.dissipative});
            ahead.push_back({substep.begin, middle, substep.dissipative});
        }
        attempt.succeeded = true;
        return attempt;
    }

    void record() {
        const Index done = result_.steps_done;
        const LoadParameters now =
            done == 0 ? input_.load_parameters_at(0, 0.0) : input_.load_parameters_at(done - 1, 1.0);
        const MotionState& state = result_.last;
        model_.set_angle_branches(state.angle_branches);
        model_.parameters().set_time_varying(now);
        record_state(model_, input_, result_);
        std::vector<double>& of_terms = result_.energies.back();
        std::size_t term = 0;
        for (const auto& [name, energy] : model_.energies(state.q, now)) of_terms[term++] = energy;
    }

    Newton& newton_;
    Model& model_;
    const MotionInput& input_;
    MotionInput* grown_;
    MotionFollower* follower_;
    MotionResult& result_;
    Stepper stepper_;
    EnergyBalance balance_;
    Index next_checkpoint_ = -1, slots_left_ = 0;
    Index spacing_ = 1;        // steps between checkpoints of chosen steps
    std::size_t budget_ = 0;   // [bytes] of the stages of chosen steps
    MotionState before_last_;  // the state before the last step
};

// Returns how many steps a number of checkpoints covers if each step is repeated so often: leaf (slots + repetitions choose slots).
double covered(Index leaf, Index slots, Index repetitions) {
    double steps = static_cast<double>(leaf);
    for (Index k = 1; k <= slots; ++k) steps *= static_cast<double>(repetitions + k) / static_cast<double>(k);
    return steps;
}

}  // namespace

MotionState start_of_motion(Model& model, const MotionInput& input) {
    MotionState start = input.start;
    model.set_angle_branches(start.angle_branches);
    model.parameters().set_time_varying(input.load_parameters_at(0, 0.0));
    if (!input.rotations_given)
        start.q += EdgeRotationEquilibrium(model, start.q, input.load_parameters_at(0, 0.0)).correction();
    if (input.viscosity.maxwell() && start.e.empty())
        start.e.assign(input.viscosity.branches.size(), model.elastic().strains(start.q));
    return start;
}

std::pair<Index, double> MotionInput::between(Index step, double fraction) const {
    const Index first = step * (tableau.stages + 1);
    int i = 0;
    while (i + 1 < tableau.stages && fraction > tableau.time(i)) ++i;
    const double begin = i == 0 ? 0.0 : tableau.time(i - 1), end = tableau.time(i);
    return {first + i, (fraction - begin) / (end - begin)};
}

std::vector<LoadParameters> stage_load_parameters(const MotionInput& input, const Tableau& tableau,
                                                  Index step, const Substep& substep) {
    std::vector<LoadParameters> load_parameters = {input.load_parameters_at(step, substep.begin)};
    for (int i = 0; i < tableau.stages; ++i)
        load_parameters.push_back(
            input.load_parameters_at(step, substep.begin + tableau.time(i) * substep.fraction()));
    return load_parameters;
}

LoadParameters MotionInput::load_parameters_at(Index step, double fraction) const {
    const auto [first, weight] = between(step, fraction);
    return interpolate(load_parameters[first], load_parameters[first + 1], weight);
}

Index MotionInput::recorded_after(Index steps) const {
    const auto found = std::lower_bound(recorded.begin(), recorded.end(), steps);
    return found == recorded.end() || *found != steps ? -1 : static_cast<Index>(found - recorded.begin());
}

Substeps substeps_of(const std::map<Index, Substeps>& substeps, Index step) {
    const auto found = substeps.find(step);
    return found == substeps.end() ? Substeps{Substep{}} : found->second;
}

void repeat_step(Stepper& stepper, const MotionInput& input, Index step, const Substeps& substeps,
                 MotionState& state, std::vector<SubstepRecord>* kept) {
    for (const Substep& substep : substeps) {
        SubstepRecord record;
        std::string reason;
        const std::vector<LoadParameters> load_parameters =
            stage_load_parameters(input, stepper.tableau_from(state, substep.dissipative), step, substep);
        if (!stepper.step(state, substep.fraction() * input.time_steps[step], substep.dissipative,
                          load_parameters, kept ? &record : nullptr, false, reason))
            throw InvalidInput("a step that was taken before cannot be repeated: " + reason);
        if (kept) kept->push_back(std::move(record));
    }
}

Index next_checkpoint(Index steps, Index leaf, Index slots) {
    if (steps <= leaf || slots == 0) return 0;
    Index repetitions = 1;
    while (covered(leaf, slots, repetitions) < static_cast<double>(steps)) ++repetitions;
    const double before = covered(leaf, slots, repetitions - 1);
    return std::clamp<Index>(static_cast<Index>(before), 1, steps - 1);
}

namespace {

// The length [s] of the shortest part of the given steps that were divided so far, 0 if these are few.
class ShortestPart {
  public:
    ShortestPart(const MotionInput& input, const MotionResult& result) : input_(input), result_(result) {}

    double now() {
        constexpr std::size_t many = 10;  // see test_divided_steps_are_told_during_the_motion
        if (input_.adaptive.intervals > 0) return 0.0;
        for (; counted_ < result_.divided.size(); ++counted_) {
            const Index step = result_.divided[counted_];
            const auto found = result_.substeps.find(step);
            if (found == result_.substeps.end()) continue;
            for (const Substep& part : found->second)
                shortest_ = std::min(shortest_, part.fraction() * input_.time_steps[step]);
        }
        return counted_ >= many && std::isfinite(shortest_) ? shortest_ : 0.0;
    }

  private:
    const MotionInput& input_;
    const MotionResult& result_;
    std::size_t counted_ = 0;
    double shortest_ = std::numeric_limits<double>::infinity();
};

}  // namespace

MotionResult simulate(Model& model, const MotionInput& input, const AdjointStorageOptions& keep,
                      const MotionWatch& watch, MotionFollower* follower) {
    MotionResult result;
    result.last = input.start;
    model.contacts().forget();
    const ScopedTimeVarying varying(model.parameters(), input.varying);
    const ScopedWatch while_watching(model, input.watched);
    ShortestPart shortest(input, result);
    Newton newton(model, input.newton, [&](double) {
        if (watch) watch(result.fraction_done, shortest.now());
    });
    MotionInput grown;
    const bool chooses = input.adaptive.intervals > 0;
    if (chooses) grown = input;
    const MotionInput& used = chooses ? grown : input;
    try {
        Run run(newton, used, chooses ? &grown : nullptr, keep, follower, result);
        result.outcome = run.run() ? Outcome::converged : Outcome::failed;
    } catch (const Interrupted&) {
        result.outcome = Outcome::interrupted;
        result.reason = "interrupted";
        if (!result.begun) record_state(model, input, result);
    }
    result.time_steps.assign(used.time_steps.begin(), used.time_steps.begin() + result.steps_done);
    result.steps_recorded.assign(used.recorded.begin(), used.recorded.begin() + result.recorded.size());
    result.iterations = newton.iterations();
    result.factorizations = newton.factorizations();
    result.linear_time = newton.linear_time();
    return result;
}

}  // namespace magshell
