// Newton's method at fixed controls, on the stationarity of the energy.
//
// Mixed (mixed integration points, Magisano, Leonetti, Garcea 2017): the element stresses are unknowns of
// their own, condensed element by element. Only the geometric stiffness sees them,
//
//   K = J^T C J + sum sigma_i d2d_i,   K p = - (J^T C d - f),   q += p,   sigma = C (d(q_old) + J p)
//
// and where plain Newton takes sigma = C d(q), a stress that the strains of a trial step have spoiled, the
// linearized one keeps a thin shell's bending alive. Same matrix, same solution, many fewer iterations.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "magshell/linalg/factor.h"
#include "magshell/linalg/gmres.h"
#include "magshell/scene/model.h"
#include "magshell/term/contact_term.h"

namespace magshell {

struct NewtonOptions {
    bool mixed = true;
    double tolerance = 1e-10;  // of the residual, relative to the forces that cancel in it
    int max_iterations = 20;
};

/// The last of the mixed steps to a state, by which its stresses are known where they have not come to rest.
struct LastStep {
    VectorXd from, step;  // empty: at rest, its strains tell them
};

/// How a load step begins, and where it may end.
struct LoadStep {
    bool roughly = false;                  // where what is left is little beside what the first step moved
    const LastStep* last = nullptr;        // to where it begins
    const FactorReport* factor = nullptr;  // of the last factorization, if that is of where it begins
    std::function<VectorXd(const VectorXd&)> bend = {};  // what to add to its first step, or an empty vector
};

/// What happened in one solve at fixed controls.
struct NewtonReport {
    bool converged = false;
    int iterations = 0;
    double residual = 0.0;
    FactorReport factor;    // of the last matrix factorized
    bool rough = false;     // whether it was ended where little was left
    LastStep last;          // then
    VectorXd tangent;       // the first step, before anything was added to it
    bool in_place = false;  // whether that may stand for the solution's own, nothing having moved since
    bool touched = false;   // whether bodies touched, or were in each other's way, at any of its iterations
    std::string blocked;    // what was in the way of the last step of which little could be taken, in words
    bool lost = false;      // far from any solution: a step half as long will hardly do
    double first_length = 0.0;  // [m] of the first step
    std::string reason;         // why not converged
};

/// A quadratic pull, 1/2 sum w_i (q_i - target_i)^2: the inertia of a time step, or one implicit Euler step
/// of a gradient flow. Among all unknowns; weights are the same along the three axes of a node. Those of nodes that a
/// carrier moves may be negative, as long as the sum over them is not.
struct Anchor {
    const VectorXd* weights = nullptr;
    const VectorXd* target = nullptr;
    const StageMotion* motion = nullptr;  // of a time step: forces that no energy has act as well
};

/// A solve has cost as much as it may.
struct EffortSpent : std::runtime_error {
    EffortSpent() : std::runtime_error("the effort is spent") {}
};

/// A model with its factorization, counting what it costs. Everything that solves goes through here.
class Newton {
  public:
    /// Called once an iteration, and now and then while a pattern is analysed; throws to stop.
    using Watch = std::function<void(double residual)>;

    Newton(Model& model, const NewtonOptions& options, Watch watch = {});
    Newton(const Newton&) = delete;
    Newton& operator=(const Newton&) = delete;
    ~Newton() { model_.keep_spare(std::move(factor_)); }

    /// From q to a stationary point at the controls, or to where it failed. Held nodes are moved to where the
    /// controls want them, in the first iteration and with its linearization.
    NewtonReport solve(VectorXd& q, const Controls& controls, const Anchor& anchor = {});

    /// Whether a factorization before a step serves after it as well, for gradients too.
    bool negligible(const VectorXd& step) const;

    /// As solve(), with another limit on iterations, or with plain steps whatever the options say.
    NewtonReport solve(VectorXd& q, const Controls& controls, const Anchor& anchor, int max_iterations);
    /// As solve(), and given up as soon as the matrix has unstable directions that it had not at the beginning and steps
    /// do not get much shorter, or as steps get longer.
    NewtonReport solve_wary(VectorXd& q, const Controls& controls, const LoadStep& load);
    /// As solve(), beginning and ending as a load step.
    NewtonReport solve_load(VectorXd& q, const Controls& controls, const LoadStep& load);
    NewtonReport solve_plain(VectorXd& q, const Controls& controls, const Anchor& anchor = {});
    /// With plain steps that are shortened until they contract (Deuflhard's natural monotonicity), in rounds
    /// of held normal forces: slower, and sure of foot where contacts open and close, stick and slip.
    NewtonReport solve_damped(VectorXd& q, const Controls& controls, const Anchor& anchor);
    /// With plain steps that end where the energy along them has stopped falling fast, from matrices that are nowhere
    /// negative where bodies touch: what bodies in contact need, far from the solution. solve() ends with it where it
    /// fails.
    NewtonReport solve_searching(VectorXd& q, const Controls& controls, const Anchor& anchor,
                                 int max_iterations);

    /// The residual's parts at q, with the forces of a time step.
    void evaluate(const VectorXd& q, const Controls& controls, const Anchor& anchor);
    /// Evaluates, assembles with the state's own stresses and factorizes.
    FactorReport factorize_at(const VectorXd& q, const Controls& controls, const Anchor& anchor = {});
    /// That of the energy at the last evaluated state, with the pull of the anchor.
    VectorXd gradient(const VectorXd& q, const Anchor& anchor) const;
    /// Assembles at the last evaluated state and factorizes. Each column of `moves`, a motion of held nodes,
    /// is replaced by the forces K moves that it causes.
    FactorReport factorize(const VectorXd& q, const Controls& controls, bool extrapolated_stress,
                           const Anchor& anchor, Eigen::Ref<Eigen::MatrixXd> moves, bool cautious = false);
    /// Replaces rhs by the solution of K^T p = rhs with the Hessian at q, the last evaluated state, by GMRES
    /// with a factorization from nearby; both among all unknowns, zero where held. Once converged, the
    /// residual is 1e-14 of rhs, each component over the root of its own stiffness.
    GmresReport solve_nearby(const VectorXd& q, const Controls& controls, const Anchor& anchor,
                             const Factor& nearby, VectorXd& rhs);
    /// K p = rhs with the last factorization, rhs and p among all unknowns; zero where held. Only where
    /// forces make K unsymmetric the tolerance counts: of the residual, over the norm of rhs.
    VectorXd solve_with_factor(const VectorXd& rhs, double tolerance = 1e-9) const;
    /// K^T p = rhs likewise, to round-off. Throws InvalidInput where forces make K too unsymmetric for that.
    VectorXd solve_transposed(const VectorXd& rhs) const;

    /// As far along a step as there are states; the share of it, negative where that leads nowhere, and the report
    /// says why.
    double advance(VectorXd& q, VectorXd& step, double shortest, NewtonReport& report);
    /// From the end of a step, last evaluated, back towards `from` where the energy has risen again there, which fell
    /// at `slope` [J] at the beginning, to where it hardly changes, between too far and not far enough; the share of the
    /// step that is left.
    double search(VectorXd& q, const Controls& controls, const Anchor& anchor, const VectorXd& from,
                  const VectorXd& step, double slope);

    /// The residual at the last evaluated state, relative to the forces that cancel in it and to their
    /// round-off, if that is to count.
    double relative_residual(const VectorXd& q, const Anchor& anchor, bool with_floor = true) const;
    /// Whether nothing is left to do at q, which was found at these controls before.
    bool still_holds(const VectorXd& q, const Controls& controls);

    Model& model() { return model_; }
    /// Null until something has been factorized.
    const std::shared_ptr<Factor>& factor() const { return factor_; }
    const NewtonOptions& options() const { return options_; }
    int factorizations() const { return factorizations_; }
    int failed_factorizations() const { return failed_factorizations_; }
    int iterations() const { return iterations_; }
    /// The factorization, for somebody to keep; the next one goes elsewhere.
    std::shared_ptr<Factor> release_factor();
    double linear_time() const { return linear_time_; }  // [s] in factorizations and solves
    /// Throws EffortSpent from now on where another factorization would be more than so many; 0: never. Iterations without one
    /// count too, at what they cost.
    void give_up_after(int factorizations) { most_factorizations_ = factorizations; }
    void count_iteration() { ++iterations_; }
    void count_factorizations(int more) { factorizations_ += more; }
    void watch(double residual) const {
        watched_ = residual;
        if (watch_) watch_(residual);
    }

  private:
    NewtonReport iterate(VectorXd& q, const Controls& controls, const Anchor& anchor, int max_iterations,
                         bool mixed, const LoadStep& load, bool wary = false);
    /// What is left of a motion that supports and motors prescribe after a share of it.
    VectorXd left_of(const VectorXd& move, double share, const VectorXd& q, const Controls& controls) const;
    /// Of a step, which is a share of a whole one, the part up to which bodies that touch do not push back by more than it
    /// expects, more than 1 where they go on pushing as before. It has the energy fall at `slope` [J] at its beginning, the
    /// last evaluated state.
    double part_into_contact(const VectorXd& q, const VectorXd& step, double share, double slope) const;
    /// The reason of a report, and what touched.
    void tell_contact(NewtonReport& report) const;
    /// Shortened steps with held normal forces, from the last evaluated state until the residual is small
    /// enough or so many are done; false where none can be taken, and the report says why.
    bool descend(VectorXd& q, const Controls& controls, const Anchor& anchor, double enough, int most_steps,
                 NewtonReport& report);
    void assemble(const VectorXd& q, const Controls& controls, bool extrapolated_stress, const Anchor& anchor,
                  bool cautious = false);
    /// Whether steps with the last factorization will do, which are as good as free.
    bool factor_serves(double contraction, double residual, double last_step) const;
    /// The norm of the forces [N] by which a step from the last evaluated state differs, for the normal forces of obstacles,
    /// from what the last factorization has of them.
    double obstacles_change(const VectorXd& step) const;
    void spend() const;
    FactorReport factorize_assembled(const VectorXd& q, const Anchor& anchor);

    Model& model_;
    NewtonOptions options_;
    Watch watch_;
    mutable double watched_ = 1.0;  // the residual that the watch was told last
    std::shared_ptr<Factor> factor_;
    std::vector<ContactTerm::ActiveContact> touched_;  // what touched obstacles where that was factorized
    bool unsymmetric_ = false;                         // whether what was assembled last is
    int factorizations_ = 0, failed_factorizations_ = 0, iterations_ = 0;
    int most_factorizations_ = 0;
    mutable double linear_time_ = 0.0;
};

}  // namespace magshell
