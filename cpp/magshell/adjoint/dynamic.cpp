#include "magshell/adjoint/dynamic.h"

#include <algorithm>

#include "magshell/adjoint/viscous.h"
#include "magshell/core/errors.h"
#include "magshell/solve/rotations.h"

namespace magshell {
namespace {

// What is viscous, stage by stage: elastic terms, and dampers in joints.
struct Viscous {
    ViscousAdjoint strains, joints;
};

class Backward {
  public:
    Backward(Newton& newton, const MotionInput& input, const MotionResult& motion,
             const std::vector<VectorXd>& by_q, const std::vector<VectorXd>& by_v)
        : newton_(newton),
          model_(newton.model()),
          input_(input),
          motion_(motion),
          by_q_(by_q),
          by_v_(by_v),
          stepper_(newton, input.tableau, input.inertia, input.viscosity, input.projective),
          scene_(model_.registry()) {
        scene_.controls = model_.no_controls();
        g_.positions = g_.velocities = g_.mass = g_.damping = VectorXd::Zero(model_.size());
        g_.controls.assign(input.controls.size(), model_.no_controls());
    }

    MotionGradient run() {
        take_in(motion_.steps_done);
        Index end = motion_.steps_done;
        for (std::size_t k = motion_.steps.size(); k-- > 0;) back(--end, motion_.steps[k]);
        Index free = motion_.slots - static_cast<Index>(motion_.checkpoints.size()) + 1;
        for (auto at = motion_.checkpoints.rbegin(); at != motion_.checkpoints.rend(); ++at, ++free) {
            stretch(at->first, end, at->second, free);
            end = std::min(end, at->first);
        }
        back_to_start();
        model_.reduction().settle_vjp(motion_.start.q, motion_.start.v, g_.positions, g_.velocities, scene_);
        g_.values = std::move(scene_.values);
        g_.factorizations = newton_.factorizations();
        return std::move(g_);
    }

    double progress() const { return progress_; }

  private:
    // Steps begin .. end, from the state at begin, with so many checkpoints to spare.
    void stretch(Index begin, Index end, const MotionState& at_begin, Index slots) {
        if (begin >= end) return;
        const Index ahead = next_checkpoint(end - begin, motion_.leaf, slots);
        MotionState state = at_begin;
        if (ahead > 0) {
            forward(begin, begin + ahead, state);
            stretch(begin + ahead, end, state, slots - 1);
            stretch(begin, begin + ahead, at_begin, slots);
            return;
        }
        if (end - begin > motion_.leaf) {  // no checkpoint left: all the way again for every leaf
            forward(begin, end - motion_.leaf, state);
            leaf(end - motion_.leaf, end, state);
            stretch(begin, end - motion_.leaf, at_begin, slots);
            return;
        }
        leaf(begin, end, state);
    }

    void forward(Index begin, Index end, MotionState& state) {
        for (Index step = begin; step < end; ++step)
            repeat_step(stepper_, input_, step, substeps_of(motion_.halved, step), state, nullptr);
    }

    void leaf(Index begin, Index end, MotionState state) {
        std::vector<std::vector<SubstepRecord>> steps(end - begin);
        for (Index step = begin; step < end; ++step)
            repeat_step(stepper_, input_, step, substeps_of(motion_.halved, step), state,
                        &steps[step - begin]);
        for (Index step = end - 1; step >= begin; --step) back(step, steps[step - begin]);
    }

    void back(Index step, const std::vector<SubstepRecord>& records) {
        progress_ = 1.0 - static_cast<double>(step + 1) / static_cast<double>(motion_.steps_done);
        const Substeps substeps = substeps_of(motion_.halved, step);
        for (std::size_t k = substeps.size(); k-- > 0;) back(step, substeps[k], records[k]);
        take_in(step);
    }

    void back(Index step, const Substep& substep, const SubstepRecord& record) {
        const double share = substep.share();
        const StepAlgebra algebra = stepper_.algebra(
            share * input_.time_step, stepper_.tableau_from(record.begin, substep.dissipative));
        const Tableau& tableau = algebra.tableau();
        const int n = tableau.stages, first = tableau.begins_explicitly ? 1 : 0;
        const double dt = algebra.dt(), adt = algebra.stage_time();
        const VectorXd &mass = input_.inertia.mass, &damping = input_.inertia.damping;
        const Index coordinates = model_.n_coordinates();
        const StepRates at(model_, algebra, record);

        std::vector<VectorXd> by_v(first + n, VectorXd::Zero(model_.size())), by_w = by_v;
        VectorXd by_x = std::move(g_.positions);
        by_v.back() = std::move(g_.velocities);
        if (by_w_.size() > 0) by_w.back() = std::move(by_w_);
        g_.positions = g_.velocities = VectorXd::Zero(model_.size());
        const std::vector<Controls> controls = controls_of(input_, tableau, step, substep);
        Viscous viscous{
            {model_, model_.elastic(), input_.viscosity, &StageRates::elastic, algebra, record, controls,
             by_strains_},
            {model_, model_.dampers(), damper_law, &StageRates::joints, algebra, record, controls, {}}};
        double by_dt = 0.0;
        for (int i = n - 1; i >= 0; --i) {
            const VectorXd &v = at.all[first + i].v, &w = at.all[first + i].w;
            const VectorXd &by_vi = by_v[first + i] += by_w[first + i] / adt, &by_wi = by_w[first + i];
            by_dt -= (by_wi.dot(w) + by_vi.dot(v)) / dt;
            VectorXd by_v_hat = -by_wi / adt, by_x_hat = VectorXd::Zero(model_.size());
            by_x.head(coordinates) += by_vi.head(coordinates) / adt;
            by_x_hat.head(coordinates) = -by_vi.head(coordinates) / adt;

            const auto [lambda, by_forces] =
                back_through(algebra, at, i, record, step, substep, by_x, viscous);
            const VectorXd accelerated = lambda.cwiseProduct(w), moved = lambda.cwiseProduct(v);
            g_.mass += accelerated;
            g_.damping += moved;
            // d/dt of M (x - x^ - a dt v^)/(a dt)^2 + Gamma (x - x^)/(a dt), with x^ and v^ fixed
            by_dt -= (mass.dot(accelerated + moved / adt) + damping.dot(moved)) / dt;
            by_x_hat -= algebra.weights().cwiseProduct(lambda);
            by_v_hat -= mass.cwiseProduct(lambda) / adt;
            if (model_.has_forces()) {  // - f(x, (x - x^)/(a dt), ...)
                const VectorXd by_rate = by_forces.velocity + by_forces.acceleration / adt;
                by_x_hat += by_rate / adt;
                by_v_hat += by_forces.acceleration / adt;
                by_dt += (by_rate.dot(v) + by_forces.acceleration.dot(w)) / dt;
                g_.positions -= by_forces.begin;
            }

            g_.positions += by_x_hat;
            g_.velocities += by_v_hat;
            for (int j = 0; j < first + i; ++j) {
                const double a = tableau.a[i][j];
                by_v[j] += (dt * a) * by_x_hat;
                by_w[j] += (dt * a) * by_v_hat;
                by_dt += a * (at.all[j].v.dot(by_x_hat) + at.all[j].w.dot(by_v_hat));
            }
            by_x.setZero(model_.size());
        }
        by_w_ = VectorXd();
        if (tableau.begins_explicitly) {
            g_.velocities += by_v.front();
            by_w_ = std::move(by_w.front());
        }
        if (input_.viscosity.any()) {
            model_.take(controls.front());
            model_.evaluate(record.begin.q, model_.no_controls());
            ViscousAdjoint& strains = viscous.strains;
            g_.positions += model_.elastic().forces(strains.by_d_begin, model_.size());
            scene_.controls.setZero();
            model_.elastic().strains_vjp(strains.by_d_begin, scene_);
            model_.varying().move_gradient(scene_);
            add_by_controls(step, substep.begin, scene_.controls);
            by_strains_ = std::move(strains.by_begin);
            by_dt += strains.by_dt;
            g_.viscosity.stiffness_damping += strains.by_law.stiffness_damping;
            g_.viscosity.maxwell_modulus += strains.by_law.maxwell_modulus;
            g_.viscosity.maxwell_time += strains.by_law.maxwell_time;
        }
        if (!model_.dampers().empty()) {
            if (!input_.viscosity.any()) model_.evaluate(record.begin.q, model_.no_controls());
            g_.positions += model_.dampers().forces(viscous.joints.by_d_begin, model_.size());
            by_dt += viscous.joints.by_dt;
            if (tableau.begins_explicitly)
                model_.damper_rates_vjp(record.begin.q, record.begin.v, viscous.joints.by_begin.d_rate,
                                        g_.positions, g_.velocities);
        }
        g_.time_step += share * by_dt;
    }

    // With the Hessian at a stage, which was evaluated last: by the factorization that was kept from nearby
    // if there is one.
    VectorXd solve(const StageState& stage, const Controls& controls, const Anchor& anchor,
                   const VectorXd& rhs) {
        newton_.watch(0.0);
        VectorXd solution = rhs;
        if (stage.factor &&
            newton_.solve_nearby(stage.q, controls, anchor, *stage.factor, solution).converged)
            return solution;
        Eigen::MatrixXd no_moves(stage.q.size(), 0);
        const FactorReport factor = newton_.factorize(stage.q, controls, false, anchor, no_moves);
        if (!factor.succeeded) throw InvalidInput("the adjoint of a step: " + factor.reason);
        return newton_.solve_transposed(rhs);
    }

    // lambda of a stage, and what its forces say of how it moved; adds what it says of the scene and of the controls.
    std::pair<VectorXd, KinematicsGradient> back_through(const StepAlgebra& algebra, const StepRates& at,
                                                         int i, const SubstepRecord& record, Index step,
                                                         const Substep& substep, VectorXd& by_x,
                                                         Viscous& viscous) {
        const StageState& stage = record.stages[i];
        const ElasticAfterwards elastic_afterwards(model_);
        const double share = substep.begin + algebra.tableau().time(i) * substep.share();
        const Controls controls = input_.controls_at(step, share);
        model_.take(controls);
        const VectorXd target = algebra.target(at.x_hat[i], at.v_hat[i]);
        const StageMotion motion{&at.x_hat[i], &at.v_hat[i], algebra.stage_time()};
        model_.set_turns(stage.turns);
        model_.begin_step(record.begin.q, input_.controls_at(step, substep.begin));
        viscous.strains.set_history(i);
        viscous.joints.set_history(i);
        const Anchor anchor{&algebra.weights(), &target, &motion};
        newton_.evaluate(stage.q, controls, anchor);
        viscous.strains.before_solve(i, by_x, scene_);
        viscous.joints.before_solve(i, by_x, scene_);
        const VectorXd lambda = solve(stage, controls, anchor, -by_x);
        viscous.strains.after_solve(i, lambda);
        viscous.joints.after_solve(i, lambda);

        scene_.controls.setZero();
        model_.vjp(stage.q, controls, lambda, scene_);
        KinematicsGradient by_forces;
        if (model_.has_forces()) by_forces = model_.forces_vjp(controls, lambda, scene_);
        if (model_.reduction().has_values()) {
            // Once more: the factorization has turned the blocks of framed nodes.
            model_.assemble(stage.q, controls, false);
            if (model_.has_forces()) model_.assemble_forces(controls);
            VectorXd reaction(model_.size());
            model_.multiply(lambda, reaction);
            model_.remainder().add_product(lambda, true, reaction);
            reaction += by_x + algebra.weights().cwiseProduct(lambda);
            model_.reduction().vjp(reaction, lambda, newton_.gradient(stage.q, anchor), controls, scene_);
        }
        model_.varying().move_gradient(scene_);
        add_by_controls(step, share, scene_.controls);
        if (model_.has_forces()) add_by_controls(step, substep.begin, by_forces.begin_controls);
        return {lambda, std::move(by_forces)};
    }

    // What the controls at a share of a step do is that of the two knots that they lie between.
    void add_by_controls(Index step, double share, const Controls& by) {
        const auto [first, weight] = input_.between(step, share);
        g_.controls[first] += (1.0 - weight) * by;
        g_.controls[first + 1] += weight * by;
    }

    // Rotations that were put to rest depend on everything else.
    void back_to_start() {
        const VectorXd& q = motion_.start.q;
        model_.take(input_.controls_at(0, 0.0));
        if (input_.viscosity.maxwell() && input_.start.e.empty()) {
            model_.evaluate(q, input_.controls_at(0, 0.0));
            g_.positions += model_.elastic().forces(by_strains_.e, model_.size());
            scene_.controls.setZero();
            model_.elastic().strains_vjp(by_strains_.e, scene_);
            model_.varying().move_gradient(scene_);
            g_.controls[0] += scene_.controls;
        }
        if (input_.rotations_given) return;
        model_.set_turns(input_.start.turns);
        const Controls controls = input_.controls_at(0, 0.0);
        const VectorXd lambda = RotationsAtRest(model_, q, controls).adjoint(g_.positions);
        VectorXd reaction(model_.size());
        model_.multiply(lambda, reaction);
        g_.positions += reaction;
        scene_.controls.setZero();
        model_.vjp(q, controls, lambda, scene_);
        model_.varying().move_gradient(scene_);
        g_.controls[0] += scene_.controls;
    }

    // Adds what the loss says of the state at the beginning of a step.
    void take_in(Index step) {
        if (step % input_.record_every != 0) return;
        const std::size_t k = step / input_.record_every;
        g_.positions += by_q_[k];
        g_.velocities += by_v_[k];
    }

    MotionGradient g_;
    Newton& newton_;
    Model& model_;
    const MotionInput& input_;
    const MotionResult& motion_;
    const std::vector<VectorXd>&by_q_, &by_v_;
    Stepper stepper_;
    Gradient scene_;  // by all values; by the controls of the stage at hand
    // By the rates, and by the Maxwell branch, at the beginning of the last step taken back.
    VectorXd by_w_;
    ViscousGradient by_strains_;
    double progress_ = 0.0;
};

}  // namespace

MotionGradient pull_back(Model& model, const MotionInput& input, const MotionResult& motion,
                         const std::vector<VectorXd>& by_q, const std::vector<VectorXd>& by_v,
                         const MotionWatch& watch) {
    if (motion.keep == Keep::nothing)
        throw InvalidInput("the motion was computed without keeping its states");
    const WhileVarying varying(model, input.varying);
    const Backward* running = nullptr;
    Newton newton(model, input.newton, [&](double residual) {
        if (watch) watch(running ? running->progress() : 0.0, residual);
    });
    Backward backward(newton, input, motion, by_q, by_v);
    running = &backward;
    return backward.run();
}

}  // namespace magshell
