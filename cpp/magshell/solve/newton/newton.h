// Newton's method for stationary points of the energy at fixed load parameters.
//
// Mixed iterations (mixed integration points [Magisano, Leonetti, Garcea 2017]) treat the element stresses as independent unknowns that are
// condensed element by element. Only the geometric stiffness depends on them:
//
//   K = J^T C J + sum sigma_i d2d_i,   K p = - (J^T C d - f),   q += p,   sigma = C (d(q_old) + J p)
//
// Standard Newton uses sigma = C d(q), which a trial step with large membrane strains spoils. The linearized stress does not
// contain these strains, so a thin shell keeps its bending stiffness. The matrix pattern and the solution are the same, and many
// fewer iterations are needed.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "magshell/linalg/factor.h"
#include "magshell/linalg/krylov/gmres.h"
#include "magshell/scene/model.h"

namespace magshell {

struct NewtonOptions {
    bool mixed = true;
    double tolerance = 1e-10;  // [-] of the residual, relative to the forces that cancel in it
    int max_iterations = 20;
};

/// The last mixed iteration of an inexact load step, from which the next one extrapolates its stresses.
struct StressPredictor {
    VectorXd from, step;  // empty: the stresses follow from the strains of the state
};

/// The proximal (quadratic) term 1/2 sum w_i (q_i - target_i)^2 added to the energy: the inertia of a time stage, or of an implicit
/// Euler step of a gradient flow. Of all dofs; the weights [N/m] are the same along the three axes of a node. Weights of nodes of rigid
/// bodies may be negative as long as their sum over the body is positive.
struct ProximalTerm {
    const VectorXd* weights = nullptr;
    const VectorXd* target = nullptr;
    const StageMotion* motion =
        nullptr;  // kinematics of a time stage, in which forces without potential act as well
};

/// How one solve iterates. The defaults solve for a stationary point of the energy, as exactly as the options say.
struct NewtonPolicy {
    ProximalTerm proximal = {};
    bool mixed = true;       // false: standard steps, whatever the options say
    int max_iterations = 0;  // 0: as the options say
    /// Near a barrier full steps may fail; standard steps with a line search on the slope of the energy follow, with matrices
    /// projected to be positive semidefinite.
    bool search_at_barrier = true;
    /// Stops as soon as the matrix has negative pivots that it had not at the beginning while the steps do not get much shorter, or if
    /// the second step grows too long (early termination on loss of stability; Crisfield 9.5).
    bool stop_on_instability = false;
    bool inexact = false;  // may end once the remaining displacement is small beside the first step
    /// The caller calls Newton::complete_report() where it needs the negative pivots. The iteration then stops on instability where the
    /// energy has a negative curvature along a step.
    bool defers_count = false;
    const StressPredictor* stress_predictor = nullptr;  // of the previous load step
    const FactorReport* factor =
        nullptr;  // of the last factorization, if it was made at or near the state where the solve begins
    std::function<VectorXd(const VectorXd&)> correction =
        {};  // returns what to add to the first step, or an empty vector
    std::function<VectorXd(const VectorXd& q, const VectorXd& step)> landing =
        {};  // returns what to add to q at the end of a step, or an empty vector
    std::function<void(const VectorXd&)> visit = {};  // called with every state after the first
};

/// The result of one solve at fixed load parameters.
struct NewtonReport {
    bool converged = false;
    int iterations = 0;
    double residual = 0.0;
    FactorReport factor;               // of the last matrix that was factorized
    bool inexact = false;              // whether it ended before full convergence
    StressPredictor stress_predictor;  // if it did
    VectorXd tangent;                  // the first step, without the correction of the load step
    bool factor_is_current = false;    // whether the last factorization may serve at the solution
    bool had_contact = false;          // whether bodies were in contact, or limited a step, in any iteration
    std::string blocked_by;     // the elements or faces that limited the last step to a small part, in words
    bool diverged = false;      // far from any solution: half the load step will hardly converge
    double first_length = 0.0;  // [m] of the first step
    std::string reason;         // why it did not converge
};

/// Thrown if a solve would exceed its budget of factorizations.
struct EffortSpent : std::runtime_error {
    EffortSpent() : std::runtime_error("the budget of factorizations is spent") {}
};

/// A model with its factorization, and counters of what solving has cost. All solvers use this class.
class Newton {
  public:
    /// Called once per iteration and from time to time during the analysis of a pattern; throws to stop.
    using Watch = std::function<void(double residual)>;

    Newton(Model& model, const NewtonOptions& options, Watch watch = {});
    Newton(const Newton&) = delete;
    Newton& operator=(const Newton&) = delete;
    ~Newton() { give_up_factor(); }

    /// Solves from q for a stationary point at these load parameters; leaves q at the last state if it fails. Prescribed nodes are moved to
    /// their target in the first iteration, with its linearization.
    NewtonReport solve(VectorXd& q, const LoadParameters& load_parameters, const NewtonPolicy& policy = {});

    /// Returns true if a step or displacement [m] is so short that a factorization made before it is valid after it, for gradients too.
    bool is_negligible(const VectorXd& step) const;
    bool is_negligible(double displacement) const;

    /// Evaluates the residual at q, with the forces of a time stage.
    void evaluate(const VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal);
    /// Evaluates, assembles with the stresses of the state itself, and factorizes.
    FactorReport factorize_at(const VectorXd& q, const LoadParameters& load_parameters,
                              const ProximalTerm& proximal = {});
    /// Returns the gradient of the energy at the last evaluated state plus that of the proximal term [N].
    VectorXd gradient(const VectorXd& q, const ProximalTerm& proximal) const;
    /// Assembles at the last evaluated state and factorizes. Replaces each column of `moves`, a motion of prescribed nodes, by the
    /// forces K moves that it causes. project_psd: makes the contribution of contact and low-rank terms positive semidefinite.
    FactorReport factorize(const VectorXd& q, const LoadParameters& load_parameters, bool extrapolated_stress,
                           const ProximalTerm& proximal, Eigen::Ref<Eigen::MatrixXd> moves,
                           bool project_psd = false);
    /// Lets the next factorization leave the number of negative pivots open where counting them takes solves.
    void defer_count() { defers_count_ = true; }
    /// Returns the report of the last factorization with the number of negative pivots.
    FactorReport complete_report() const;
    /// Replaces rhs by the solution of K^T p = rhs with the Hessian at q, the last evaluated state, by GMRES with a factorization made
    /// nearby. Both are of all dofs, zero where prescribed. The residual is below 1e-14 of rhs, each component
    /// scaled by the root of its own stiffness.
    GmresReport solve_gmres_adjoint(const VectorXd& q, const LoadParameters& load_parameters,
                                    const ProximalTerm& proximal, const Factor& nearby, VectorXd& rhs);
    /// Returns p with K p = rhs by the last factorization; both are of all dofs, zero where prescribed. tolerance: residual over rhs,
    /// used only where GMRES is needed: if K is nonsymmetric or not a sparse matrix.
    VectorXd solve_with_factor(const VectorXd& rhs, double tolerance = 1e-9) const;
    /// Returns p with S p = rhs, where S is the symmetric part of K that was factorized last: with friction, that of held normal forces.
    VectorXd solve_with_symmetric_part(const VectorXd& rhs) const;
    /// Returns p with K^T p = rhs, to round-off. Throws InvalidInput if K is too nonsymmetric for that.
    VectorXd solve_transposed(const VectorXd& rhs) const;

    /// Applies as much of a step to q as leads to states with an energy. Returns the step length in [0, 1], or -1 with a reason
    /// in the report if it is below `shortest`.
    double apply_increment(VectorXd& q, VectorXd& step, double shortest, NewtonReport& report);
    /// Line search along a step that was applied completely and evaluated last. slope: initial decrease of the energy along it [J].
    /// Goes back towards `from` if the energy rises at the end, until its slope is less than half of the initial one.
    /// Where the energy still falls faster than that at the end, the step is doubled up to the length `longest` (the strong Wolfe
    /// condition). Returns the step length that is left.
    double line_search(VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                       const VectorXd& from, const VectorXd& step, double slope, double longest = 1.0);

    /// Returns the length, in units of `step`, at which bodies in contact do not push back by more than the step predicts; more than 1 if the
    /// predicted force is not reached. alpha: length of `step` over the full Newton step. slope: initial decrease of the energy along
    /// it [J], at q, the last evaluated state.
    double contact_step_length(const VectorXd& q, const VectorXd& step, double alpha, double slope) const;
    /// Returns the norm of the change of obstacle contact forces [N] along a step, between the contacts now and those of the last
    /// factorization.
    double contact_force_change(const VectorXd& step) const {
        return model_.contacts().force_change(touched_, step);
    }
    /// Returns the rest of a prescribed motion of supports and motors after a step of this length.
    VectorXd remaining_motion(const VectorXd& move, double alpha, const VectorXd& q,
                              const LoadParameters& load_parameters) const;

    /// Returns the residual at the last evaluated state, relative to the forces that cancel in it and, with_floor, to their round-off.
    double relative_residual(const VectorXd& q, const ProximalTerm& proximal, bool with_floor = true) const;
    /// Returns true if q, found at these load parameters before, is still an equilibrium.
    bool is_equilibrium(const VectorXd& q, const LoadParameters& load_parameters);

    Model& model() { return model_; }
    /// The last factorization; null before the first. While others hold it, the next one is made in new memory.
    const std::shared_ptr<Factor>& factor() const { return factor_; }
    /// Returns true if the matrix assembled last is nonsymmetric.
    bool is_unsymmetric() const { return unsymmetric_; }
    const NewtonOptions& options() const { return options_; }
    int factorizations() const { return factorizations_; }
    int failed_factorizations() const { return failed_factorizations_; }
    int iterations() const { return iterations_; }
    double linear_time() const { return linear_time_; }  // [s] spent in factorizations and solves
    /// Sets the number of factorizations after which the next one throws EffortSpent; 0: unlimited. Iterations without a
    /// factorization count as well, by their cost.
    void set_max_factorizations(int factorizations) { max_factorizations_ = factorizations; }
    void count_iteration() { ++iterations_; }
    void count_factorizations(int more) { factorizations_ += more; }
    void watch(double residual) const {
        watched_ = residual;
        if (watch_) watch_(residual);
    }

  private:
    /// Appends the blocking faces, or those with the largest contact force, to the reason of a report.
    void describe_contact(NewtonReport& report) const;
    void assemble(const VectorXd& q, const LoadParameters& load_parameters, bool extrapolated_stress,
                  const ProximalTerm& proximal, bool project_psd = false);
    /// Keeps the memory of the last factorization for another solve, unless others hold it.
    void give_up_factor();
    void check_effort() const;
    FactorReport factorize_assembled(const VectorXd& q, const ProximalTerm& proximal);

    Model& model_;
    NewtonOptions options_;
    Watch watch_;
    mutable double watched_ = 1.0;  // the residual last reported to the watch
    std::shared_ptr<Factor> factor_;
    std::vector<Contacts::ObstaclePoint> touched_;  // contacts with obstacles at the last factorization
    bool unsymmetric_ = false;                      // whether the matrix assembled last is
    int factorizations_ = 0, failed_factorizations_ = 0, iterations_ = 0;
    bool defers_count_ = false;
    int max_factorizations_ = 0;
    mutable double linear_time_ = 0.0;
};

}  // namespace magshell
