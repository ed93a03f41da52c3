#include "magshell/adjoint/dynamic.h"

#include <algorithm>

#include "magshell/adjoint/checkpointed_reverse.h"
#include "magshell/adjoint/free_flight_adjoint.h"
#include "magshell/adjoint/viscous.h"
#include "magshell/core/errors.h"
#include "magshell/solve/motion/edge_rotations.h"
#include "magshell/solve/motion/motor_reactions.h"

namespace magshell {
namespace {

// The adjoints of the viscous parts of a step: of elastic terms, and of joint dampers.
struct Viscous {
    ViscousAdjoint strains, joints;
};

// Goes backwards from the last step to the first. The members g_, by_w_, by_v_before_, by_dt_before_ and by_strains_ hold the gradients with
// respect to the state at the beginning of the last step processed. g_ and scene_ also sum those with respect to the inputs.
class Backward {
  public:
    Backward(Newton& newton, const MotionInput& input, const MotionResult& motion,
             const GradientsByStates& by)
        : newton_(newton),
          model_(newton.model()),
          input_(input),
          motion_(motion),
          by_(by),
          stepper_(newton, input.tableau, input.inertia, input.viscosity, input.projective),
          scene_(model_.parameters().registry()) {
        scene_.load_parameters = model_.parameters().zero_load_parameters();
        g_.positions = g_.velocities = g_.mass = g_.damping = VectorXd::Zero(model_.size());
        g_.time_steps.assign(input.time_steps.size(), 0.0);
        g_.load_parameters.assign(input.load_parameters.size(), model_.parameters().zero_load_parameters());
        g_.viscosity.branches.assign(input.viscosity.branches.size(), {0.0, 0.0});
        g_.rest.asked = by.wants_rest;
        if (by.wants_rest) g_.rest.clear(model_);
    }

    MotionGradient run() {
        add_state_gradient(motion_.steps_done);
        Index end = motion_.steps_done;
        // The last steps are stored with all their stages; those before them are repeated from checkpoints.
        for (std::size_t k = motion_.steps.size(); k-- > 0;) back(--end, motion_.steps[k]);
        const CheckpointedReverse segments(
            motion_.leaf, [this](Index begin, Index end, MotionState& state) { forward(begin, end, state); },
            [this](Index begin, Index end, const MotionState& state) { leaf(begin, end, state); });
        Index free = motion_.slots - static_cast<Index>(motion_.checkpoints.size()) + 1;
        for (auto at = motion_.checkpoints.rbegin(); at != motion_.checkpoints.rend(); ++at, ++free) {
            segments.back(at->first, end, at->second, free);
            end = std::min(end, at->first);
        }
        back_to_start();
        model_.dof_map().project_state_vjp(motion_.start.q, motion_.start.v, g_.positions, g_.velocities,
                                           scene_, g_.rest.asked ? &g_.rest.by_nodes : nullptr);
        if (g_.rest.asked) g_.rest.add_directions_at_start(model_, g_.positions);
        g_.values = std::move(scene_.values);
        std::reverse(g_.stages.begin(), g_.stages.end());
        g_.factorizations = newton_.factorizations();
        return std::move(g_);
    }

    double progress() const { return progress_; }

  private:
    // Repeats steps from the state at `begin`, which becomes that at `end`.
    void forward(Index begin, Index end, MotionState& state) {
        for (Index step = begin; step < end; ++step)
            repeat_step(stepper_, input_, step, substeps_of(motion_.substeps, step), state, nullptr);
    }

    // Repeats steps with all their stages, and computes their adjoint.
    void leaf(Index begin, Index end, MotionState state) {
        std::vector<std::vector<SubstepRecord>> steps(end - begin);
        for (Index step = begin; step < end; ++step)
            repeat_step(stepper_, input_, step, substeps_of(motion_.substeps, step), state,
                        &steps[step - begin]);
        for (Index step = end - 1; step >= begin; --step) back(step, steps[step - begin]);
    }

    // Computes the adjoint of a step, substep by substep.
    void back(Index step, const std::vector<SubstepRecord>& records) {
        progress_ = 1.0 - static_cast<double>(step + 1) / static_cast<double>(motion_.steps_done);
        const Substeps substeps = substeps_of(motion_.substeps, step);
        for (std::size_t k = substeps.size(); k-- > 0;)
            back(step, substeps[k], records[k],
                 k + 1 == substeps.size() ? by_motor_forces(step + 1) : VectorXd());
        add_state_gradient(step);
    }

    // Returns the gradient with respect to the motor forces in the state after this number of steps; empty if the loss does not depend on
    // them.
    VectorXd by_motor_forces(Index steps) const {
        const Index k = input_.recorded_after(steps);
        if (by_.motor_forces.empty() || k < 0) return {};
        const VectorXd& by = by_.motor_forces[k];
        return by.isZero(0.0) ? VectorXd() : by;
    }

    // The gradient with respect to the start of a stage, or of the nearby state at which motor forces are evaluated.
    struct BeforeStage {
        VectorXd x_hat, v_hat, p_hat;
        double dt = 0.0;

        explicit BeforeStage(Index size)
            : x_hat(VectorXd::Zero(size)), v_hat(VectorXd::Zero(size)), p_hat(VectorXd::Zero(size)) {}
    };

    // Adds the contribution of lambda, at a state with these rates, to the gradients with respect to inertia, by forces, and by the start
    // of the stage.
    void through_rates(const StepAlgebra& algebra, const VectorXd& lambda,
                       const KinematicsGradient& by_forces, const VectorXd& v, const VectorXd& w,
                       BeforeStage& by) {
        const VectorXd &mass = input_.inertia.mass, &damping = input_.inertia.damping;
        const double dt = algebra.dt(), adt = algebra.stage_time();
        const VectorXd accelerated = lambda.cwiseProduct(w), moved = lambda.cwiseProduct(v);
        g_.mass += accelerated;
        g_.damping += moved;
        // The derivative with respect to dt of M (x - x^ - a dt v^)/(a dt)^2 + Gamma (x - x^)/(a dt) at constant x^ and v^.
        by.dt -= (mass.dot(accelerated + moved / adt) + damping.dot(moved)) / dt;
        by.x_hat -= algebra.weights().cwiseProduct(lambda);
        by.v_hat -= mass.cwiseProduct(lambda) / adt;
        if (!model_.capabilities().has_velocity_forces) return;  // - f(x, (x - x^)/(a dt), ...)
        by.x_hat += by_forces.velocity / adt;
        by.dt += (by_forces.velocity.dot(v) - by_forces.time * adt) / dt;
        if (by_forces.p_hat.size() > 0) by.p_hat -= by_forces.p_hat;
        g_.positions -= by_forces.begin;
    }

    // Adds the gradients of by_momentum . p(q, v), the carried momentum at a fraction of a step, with respect to q, v and the scene.
    void through_momentum(Index step, double fraction, const VectorXd& q, const VectorXd& v,
                          const VectorXd& by_momentum, VectorXd& by_q, VectorXd& by_v) {
        model_.parameters().set_time_varying(input_.load_parameters_at(step, fraction));
        scene_.load_parameters.setZero();
        model_.parameters().momentum_vjp(q, v, by_momentum, by_q, by_v, scene_);
        model_.parameters().time_varying().move_gradient(scene_);
        add_by_load_parameters(step, fraction, scene_.load_parameters);
    }

    // Computes the adjoint of a substep, stage by stage, by the formulas of dynamic.h. adt: a dt.
    void back(Index step, const Substep& substep, const SubstepRecord& record,
              const VectorXd& by_motor_forces) {
        const double fraction = substep.fraction();
        const StepAlgebra algebra = stepper_.algebra(
            fraction * input_.time_steps[step], stepper_.tableau_from(record.begin, substep.dissipative));
        const Tableau& tableau = algebra.tableau();
        const int n = tableau.stages, first = tableau.begins_explicitly ? 1 : 0;
        const double dt = algebra.dt(), adt = algebra.stage_time();
        const Index coordinates = model_.n_coordinates();
        const std::vector<LoadParameters> load_parameters =
            stage_load_parameters(input_, tableau, step, substep);
        const StepRates at(model_, algebra, stepper_.free_bodies(), record, load_parameters);
        FreeFlightAdjoint flight(at.flight);

        const bool carries = model_.may_have_fluid_momentum();
        std::vector<VectorXd> by_v(first + n, VectorXd::Zero(model_.size())), by_w = by_v, by_r;
        VectorXd by_momentum;  // by the carried momentum at the beginning
        if (carries) {
            by_r = by_v;
            by_momentum = by_v.front();
            if (by_r_.size() > 0) by_r.back() = std::move(by_r_);
        }
        VectorXd by_x = std::move(g_.positions);
        by_v.back() = std::move(g_.velocities);
        if (by_w_.size() > 0) by_w.back() = std::move(by_w_);
        flight.through_finish(record.stages.back().q, at.all.back().v, by_w.back(), by_v.back(), by_x,
                              g_.mass);
        g_.positions = g_.velocities = VectorXd::Zero(model_.size());
        Viscous viscous{{model_, model_.elastic(), input_.viscosity, &StageRates::elastic, algebra, record,
                         load_parameters, by_strains_},
                        {model_,
                         model_.dampers(),
                         damper_law,
                         &StageRates::joints,
                         algebra,
                         record,
                         load_parameters,
                         {}}};
        double by_dt = by_dt_before_;
        by_dt_before_ = 0.0;
        const VectorXd by_earlier = std::move(by_v_before_);
        by_v_before_ = VectorXd();
        BeforeStage by_end(model_.size());
        // Gradients with respect to w and c of the last stage that come from the motor forces; by_c: by c of the present stage.
        VectorXd by_w_last = VectorXd::Zero(model_.size()), by_c_last = by_w_last, by_c;
        if (by_motor_forces.size() > 0)
            back_through_motors(algebra, at, record, step, substep, by_motor_forces, viscous, by_v.back(),
                                by_w_last, by_c_last, by_end);
        for (int i = n - 1; i >= 0; --i) {
            const VectorXd& v = at.all[first + i].v;
            const VectorXd w = algebra.stage_acceleration(at.all[first + i], at.v_hat[i]);
            const double there = substep.begin + tableau.time(i) * fraction;
            BeforeStage by(model_.size());
            if (i == n - 1) by = std::move(by_end);
            if (carries) {
                const VectorXd by_p = by_r[first + i] / adt;
                by.p_hat -= by_p;
                by.dt -= by_r[first + i].dot(at.all[first + i].momentum_rate) / dt;
                through_momentum(step, there, record.stages[i].q, v, by_p, by_x, by_v[first + i]);
            }
            // Gradients with respect to e_i, the acceleration without contact, and to w_i = e_i + F c_i, the one with it (dynamic.h).
            const VectorXd& by_ei = by_w[first + i];
            const VectorXd by_wi = i == n - 1 ? VectorXd(by_ei + by_w_last) : by_ei;
            const VectorXd& by_vi = by_v[first + i] += by_wi / adt;
            if (tableau.implicit_contact) {
                by_c = -tableau.contact_factor(i) * by_ei;
                if (i == n - 1) by_c += by_c_last;
            }
            by.dt -= (by_wi.dot(w) + by_vi.dot(v)) / dt;
            by.v_hat -= by_wi / adt;
            by_x.head(coordinates) += by_vi.head(coordinates) / adt;
            by.x_hat.head(coordinates) -= by_vi.head(coordinates) / adt;

            const auto [lambda, by_forces] =
                back_through(algebra, at, i, record, step, substep, by_x, by_c, viscous);
            through_rates(algebra, lambda, by_forces, v, w, by);
            if (by_.wants_stages)
                g_.stages.push_back(
                    {lambda, record.stages[i].q, v, w, input_.load_parameters_at(step, there)});

            by_dt += by.dt;
            g_.positions += by.x_hat;
            g_.velocities += by.v_hat;
            flight.add_stage(i, by.x_hat, by.v_hat);
            for (int j = 0; j < first + i; ++j) {
                const double a = tableau.a[i][j];
                by_v[j] += (dt * a) * by.x_hat;
                by_w[j] += (dt * a) * by.v_hat;
                by_dt += a * (at.all[j].v.dot(by.x_hat) + at.all[j].acceleration.dot(by.v_hat));
                if (!carries) continue;
                by_r[j] += (dt * a) * by.p_hat;
                by_dt += a * at.all[j].momentum_rate.dot(by.p_hat);
            }
            if (carries) by_momentum += by.p_hat;
            by_x.setZero(model_.size());
        }
        by_w_ = by_r_ = VectorXd();
        if (tableau.begins_explicitly) {
            g_.velocities += by_v.front();
            by_w_ = std::move(by_w.front());
            if (carries) by_r_ = std::move(by_r.front());
        }
        if (carries)
            through_momentum(step, substep.begin, record.begin.q, record.begin.v, by_momentum, g_.positions,
                             g_.velocities);
        flight.add_by_begin(record.begin.q, record.begin.v, g_.positions, g_.velocities, g_.mass, by_dt,
                            g_.rest.asked ? &g_.rest.by_nodes : nullptr);
        if (input_.viscosity.any()) {
            model_.parameters().set_time_varying(load_parameters.front());
            model_.evaluate(record.begin.q, model_.parameters().zero_load_parameters());
            ViscousAdjoint& strains = viscous.strains;
            g_.positions += model_.elastic().forces(strains.by_d_begin, model_.size());
            scene_.load_parameters.setZero();
            model_.elastic().strains_vjp(strains.by_d_begin, scene_);
            g_.rest.add_strains(model_.elastic(), strains.by_d_begin);
            model_.parameters().time_varying().move_gradient(scene_);
            add_by_load_parameters(step, substep.begin, scene_.load_parameters);
            by_strains_ = std::move(strains.by_begin);
            by_dt += strains.by_dt;
            g_.viscosity.stiffness_damping += strains.by_law.stiffness_damping;
            for (std::size_t k = 0; k < g_.viscosity.branches.size(); ++k) {
                g_.viscosity.branches[k].modulus += strains.by_law.branches[k].modulus;
                g_.viscosity.branches[k].time += strains.by_law.branches[k].time;
            }
        }
        if (model_.capabilities().has_own_viscosity) {
            if (!input_.viscosity.any())
                model_.evaluate(record.begin.q, model_.parameters().zero_load_parameters());
            g_.positions += model_.dampers().forces(viscous.joints.by_d_begin, model_.size());
            model_.dampers().strains_vjp(viscous.joints.by_d_begin, scene_);
            by_dt += viscous.joints.by_dt;
            if (tableau.begins_explicitly)
                model_.parameters().damper_rates_vjp(record.begin.q, record.begin.v,
                                                     viscous.joints.by_begin.d_rate, g_.positions,
                                                     g_.velocities, scene_);
        }
        g_.time_steps[step] += fraction * by_dt;
        if (by_earlier.size() > 0) g_.velocities += by_earlier;
    }

    // Solves with the transposed Hessian at a state, evaluated last: by GMRES with a nearby factorization if there is one.
    VectorXd solve(const VectorXd& q, const Factor* nearby, const LoadParameters& load_parameters,
                   const ProximalTerm& proximal, const VectorXd& rhs) {
        newton_.watch(0.0);
        VectorXd solution = rhs;
        if (nearby && newton_.solve_gmres_adjoint(q, load_parameters, proximal, *nearby, solution).converged)
            return solution;
        Eigen::MatrixXd no_moves(q.size(), 0);
        const FactorReport factor = newton_.factorize(q, load_parameters, false, proximal, no_moves);
        if (!factor.succeeded)
            throw InvalidInput("the gradient of a time step cannot be computed: " + factor.reason);
        return newton_.solve_transposed(rhs);
    }

    // Sets the model to the conditions under which a stage was solved.
    void set_stage(const StepAlgebra& algebra, const SubstepRecord& record, int i, Index step,
                   const Substep& substep, const LoadParameters& load_parameters, const Viscous& viscous) {
        model_.parameters().set_time_varying(load_parameters);
        model_.set_angle_branches(record.stages[i].angle_branches);
        model_.begin_step(record.begin.q, input_.load_parameters_at(step, substep.begin));
        model_.contacts().set_factor(algebra.tableau().contact_factor(i));
        viscous.strains.set_history(i);
        viscous.joints.set_history(i);
    }

    // Goes back through the acceleration by contact, c = J (J^T M J)^-1 J^T f, at the evaluated stage. by_c: gradient with respect to it.
    // Adds the gradients with respect to the masses, and by the state: by_x, and as forces on free dofs alone by_free. Returns the gradient
    // with respect to minus the scaled contact forces.
    VectorXd back_through_contact(const VectorXd& q, const VectorXd& c, double factor, const VectorXd& by_c,
                                  const LoadParameters& load_parameters, VectorXd& by_x, VectorXd& by_free) {
        const VectorXd& mass = input_.inertia.mass;
        const DofMap& dof_map = model_.dof_map();
        const VectorXd force = model_.contact_forces(q, load_parameters) / factor;
        const VectorXd moved = dof_map.acceleration(mass, by_c);
        g_.mass -= moved.cwiseProduct(c);
        const VectorXd by_forces = -moved / factor;
        by_x += model_.multiply_contact_transposed(q, load_parameters, by_forces);
        if (dof_map.has_reduced_coordinates()) {
            // dc = J (J^T M J)^-1 [dJ^T (f - M c)] + (I - J (J^T M J)^-1 J^T M) dJ z, with c = J z
            const VectorXd from_c = by_c - mass.cwiseProduct(moved),
                           from_force = force - mass.cwiseProduct(c);
            dof_map.add_curvature_forces(from_c, c, by_free);
            dof_map.add_curvature_forces(from_force, moved, by_free);
            const VectorXd nothing = VectorXd::Zero(q.size());
            if (g_.rest.asked) {
                dof_map.rest_vjp(nothing, c, from_c, {}, g_.rest.by_nodes);
                dof_map.rest_vjp(nothing, moved, from_force, {}, g_.rest.by_nodes);
            }
            if (dof_map.has_values()) {
                dof_map.vjp(nothing, c, from_c, load_parameters, scene_);
                dof_map.vjp(nothing, moved, from_force, load_parameters, scene_);
            }
        }
        return by_forces;
    }

    // Returns lambda of a stage and the gradient with respect to the kinematics of its forces. Adds the gradients with respect to the scene
    // and the load parameters. by_c: gradient with respect to the acceleration by contact; empty if contact is not implicit.
    std::pair<VectorXd, KinematicsGradient> back_through(const StepAlgebra& algebra, const StepRates& at,
                                                         int i, const SubstepRecord& record, Index step,
                                                         const Substep& substep, VectorXd& by_x,
                                                         const VectorXd& by_c, Viscous& viscous) {
        const StageState& stage = record.stages[i];
        const ScopedStrainHistory elastic_afterwards(model_);
        const ScopedContactFactor usual_contact_afterwards(model_);
        const double fraction = substep.begin + algebra.tableau().time(i) * substep.fraction();
        const LoadParameters load_parameters = input_.load_parameters_at(step, fraction);
        const VectorXd target = algebra.target(at.x_hat[i], at.v_hat[i]);
        const StageMotion motion{&at.x_hat[i], &at.p_hat[i], algebra.stage_time()};
        set_stage(algebra, record, i, step, substep, load_parameters, viscous);
        const ProximalTerm proximal{&algebra.weights(), &target, &motion};
        newton_.evaluate(stage.q, load_parameters, proximal);
        VectorXd by_free = VectorXd::Zero(by_x.size()), by_contact;
        if (by_c.size() > 0)
            by_contact = back_through_contact(stage.q, stage.contact, algebra.tableau().contact_factor(i),
                                              by_c, load_parameters, by_x, by_free);
        g_.rest.add_strains(model_.elastic(), viscous.strains.before_solve(i, by_x, scene_));
        viscous.joints.before_solve(i, by_x, scene_);
        const VectorXd lambda =
            solve(stage.q, stage.factor.get(), load_parameters, proximal, -(by_x + by_free));
        viscous.strains.after_solve(i, lambda);
        viscous.joints.after_solve(i, lambda);
        return {lambda, by_scene(stage.q, load_parameters, proximal, step, substep, fraction, lambda, {},
                                 by_x, by_contact)};
    }

    // Adds the gradients through the motor forces at the end of a substep: by the scene and the load parameters, by the state next to the
    // last stage at which they are evaluated, and by the velocities that enter its acceleration (solve/motion/motor_reactions.h).
    void back_through_motors(const StepAlgebra& algebra, const StepRates& at, const SubstepRecord& record,
                             Index step, const Substep& substep, const VectorXd& by_motor_forces,
                             Viscous& viscous, VectorXd& by_v_last, VectorXd& by_w_last, VectorXd& by_c_last,
                             BeforeStage& by) {
        const int i = algebra.tableau().stages - 1;
        const StageState& stage = record.stages[i];
        const ScopedStrainHistory elastic_afterwards(model_);
        const LoadParameters load_parameters = input_.load_parameters_at(step, substep.end);
        const VectorXd target = algebra.target(at.x_hat[i], at.v_hat[i]);
        const StageMotion motion{&at.x_hat[i], &at.p_hat[i], algebra.stage_time()};
        const ScopedContactFactor usual_contact_afterwards(model_);
        set_stage(algebra, record, i, step, substep, load_parameters, viscous);
        const ProximalTerm there{&algebra.weights(), &target, &motion};
        const MotorReactions end(newton_, input_.inertia, record.begin, algebra, stage.q, load_parameters,
                                 there, at.v_hat[i], at.all.back());
        if (!end.converged())
            throw InvalidInput(
                "the motor forces have no gradient in a step in which they could not be computed (NaN)");
        const ProximalTerm proximal = end.proximal();
        const VectorXd& q = end.q();
        newton_.evaluate(q, load_parameters, proximal);
        model_.assemble(q, load_parameters, false);
        model_.assemble_forces(load_parameters);
        const VectorXd motors = model_.dof_map().motor_motion(by_motor_forces);
        const VectorXd by_q = product(motors, algebra.weights());
        VectorXd by_free = by_q;
        model_.dof_map().add_motor_force_change(newton_.gradient(q, proximal), by_motor_forces, by_free);
        const std::shared_ptr<Factor> nearby = newton_.factor();
        const bool serves = nearby && nearby->pattern() == model_.dof_map().pattern();
        const VectorXd lambda =
                           solve(q, serves ? nearby.get() : nullptr, load_parameters, proximal, -by_free),
                       all = lambda + motors;
        viscous.strains.at_nearby_state(i, q, all);
        viscous.joints.at_nearby_state(i, q, all);
        const KinematicsGradient by_forces =
            by_scene(q, load_parameters, proximal, step, substep, substep.end, lambda, by_motor_forces, by_q);
        VectorXd v = VectorXd::Zero(model_.size());
        v.head(model_.n_coordinates()) =
            (q - at.x_hat[i]).head(model_.n_coordinates()) / algebra.stage_time();
        through_rates(algebra, all, by_forces, v, (v - at.v_hat[i]) / algebra.stage_time(), by);
        if (end.acceleration_change().size() == 0) return;
        const VectorXd pull = input_.inertia.mass.cwiseProduct(all);
        g_.mass += all.cwiseProduct(end.acceleration_change());
        if (end.is_first_step()) {
            by_c_last += end.contact_weight() * pull;
            return;
        }
        by_w_last -= pull;
        by_v_last += end.weight_last() * pull;
        g_.velocities += end.weight_begin() * pull;
        by_v_before_ = end.weight_before() * pull;
        // The acceleration is of degree -1 in the lengths of this substep and the one before.
        const double by_before = pull.dot(end.change_by_dt_before());
        const VectorXd last = algebra.stage_acceleration(at.all.back(), at.v_hat[i]);
        by.dt -=
            (pull.dot(end.acceleration_change() + last) + by_before * record.begin.dt_before) / algebra.dt();
        by_dt_before_ = by_before;
    }

    // Returns (K + W)^T times a motion of all dofs, with the matrix assembled last.
    VectorXd product(const VectorXd& along, const VectorXd& weights) const {
        VectorXd forces(model_.size());
        model_.multiply(along, forces);
        model_.nonsymmetric_tangent().add_product(along, true, forces);
        return forces + weights.cwiseProduct(along);
    }

    // Adds the gradients with respect to the scene and the load parameters for an adjoint at the evaluated state, plus the motion along the
    // motors if the loss depends on their forces. by_contact: gradient with respect to minus the contact forces, beside that by lambda.
    // Returns the gradient with respect to the kinematics.
    KinematicsGradient by_scene(const VectorXd& q, const LoadParameters& load_parameters,
                                const ProximalTerm& proximal, Index step, const Substep& substep,
                                double fraction, const VectorXd& lambda, const VectorXd& by_motor_forces,
                                const VectorXd& by_q, const VectorXd& by_contact = {}) {
        const DofMap& dof_map = model_.dof_map();
        const VectorXd all =
            by_motor_forces.size() > 0 ? VectorXd(lambda + dof_map.motor_motion(by_motor_forces)) : lambda;
        scene_.load_parameters.setZero();
        model_.parameters().vjp(q, load_parameters, all, scene_);
        g_.rest.add(model_, q, load_parameters, all);
        KinematicsGradient by_forces;
        if (model_.capabilities().has_velocity_forces) {
            by_forces = model_.parameters().forces_vjp(model_.kinematics(), load_parameters, all, scene_);
            g_.rest.add_forces(model_, all);
        }
        if (by_contact.size() > 0) {
            model_.contacts().vjp(q, model_.kinematics(), load_parameters, by_contact, by_forces, scene_);
            g_.rest.add_contacts(model_, q, load_parameters, by_contact);
        }
        if (dof_map.has_values() || g_.rest.asked) {
            // Assembles again, because the factorization has rotated the blocks of rotated nodes.
            model_.assemble(q, load_parameters, false);
            model_.assemble_forces(load_parameters);
            const VectorXd reaction = product(lambda, *proximal.weights) + by_q;
            const VectorXd gradient = newton_.gradient(q, proximal);
            g_.rest.add_constrained(dof_map, reaction, lambda, gradient, load_parameters, by_motor_forces);
            if (dof_map.has_values())
                dof_map.vjp(reaction, lambda, gradient, load_parameters, scene_, by_motor_forces);
        }
        model_.parameters().time_varying().move_gradient(scene_);
        add_by_load_parameters(step, fraction, scene_.load_parameters);
        if (model_.capabilities().has_velocity_forces)
            add_by_load_parameters(step, substep.begin, by_forces.begin_load_parameters);
        return by_forces;
    }

    // Distributes a gradient with respect to the load parameters at a fraction of a step to the two entries that they are interpolated
    // from.
    void add_by_load_parameters(Index step, double fraction, const LoadParameters& by) {
        const auto [first, weight] = input_.between(step, fraction);
        g_.load_parameters[first] += (1.0 - weight) * by;
        g_.load_parameters[first + 1] += weight * by;
    }

    // Continues to the inputs of the start: edge rotations in equilibrium depend on all others.
    void back_to_start() {
        const VectorXd& q = motion_.start.q;
        model_.parameters().set_time_varying(input_.load_parameters_at(0, 0.0));
        if (input_.viscosity.maxwell() && input_.start.e.empty()) {
            model_.evaluate(q, input_.load_parameters_at(0, 0.0));
            StrainSet by_strains = model_.elastic().zeros();  // in which every branch begins
            for (const StrainSet& by_branch : by_strains_.e) by_strains.add(1.0, by_branch);
            g_.positions += model_.elastic().forces(by_strains, model_.size());
            scene_.load_parameters.setZero();
            model_.elastic().strains_vjp(by_strains, scene_);
            g_.rest.add_strains(model_.elastic(), by_strains);
            model_.parameters().time_varying().move_gradient(scene_);
            g_.load_parameters[0] += scene_.load_parameters;
        }
        if (input_.rotations_given) return;
        model_.set_angle_branches(input_.start.angle_branches);
        const LoadParameters load_parameters = input_.load_parameters_at(0, 0.0);
        const VectorXd lambda = EdgeRotationEquilibrium(model_, q, load_parameters).adjoint(g_.positions);
        VectorXd reaction(model_.size());
        model_.multiply(lambda, reaction);
        g_.positions += reaction;
        scene_.load_parameters.setZero();
        model_.parameters().vjp(q, load_parameters, lambda, scene_);
        g_.rest.add(model_, q, load_parameters, lambda);
        model_.parameters().time_varying().move_gradient(scene_);
        g_.load_parameters[0] += scene_.load_parameters;
    }

    // Adds the gradient of the loss by the state at the beginning of a step.
    void add_state_gradient(Index step) {
        const Index k = input_.recorded_after(step);
        if (k < 0) return;
        g_.positions += by_.q[k];
        g_.velocities += by_.v[k];
    }

    MotionGradient g_;
    Newton& newton_;
    Model& model_;
    const MotionInput& input_;
    const MotionResult& motion_;
    const GradientsByStates& by_;
    Stepper stepper_;
    Gradient scene_;  // by all parameters, and by the load parameters of the current stage
    // By the acceleration with which the last step processed begins, and the rate of the carried momentum; empty if its method needs none.
    VectorXd by_w_, by_r_;
    // By the velocity at the beginning of the step before that; empty if nothing depends on it.
    VectorXd by_v_before_;
    double by_dt_before_ = 0.0;   // by the length of the substep before the last one processed
    ViscousGradient by_strains_;  // by the strains, their rates and the Maxwell strains with which it begins
    double progress_ = 0.0;
};

}  // namespace

MotionGradient motion_vjp(Model& model, const MotionInput& input, const MotionResult& motion,
                          const GradientsByStates& by, const MotionWatch& watch) {
    if (motion.keep == AdjointStorage::nothing)
        throw InvalidInput("the motion has no stored states: it was computed without gradients");
    const ScopedTimeVarying varying(model.parameters(), input.varying);
    const Backward* running = nullptr;
    Newton newton(model, input.newton, [&](double residual) {
        if (watch) watch(running ? running->progress() : 0.0, residual);
    });
    Backward backward(newton, input, motion, by);
    running = &backward;
    return backward.run();
}

}  // namespace magshell
