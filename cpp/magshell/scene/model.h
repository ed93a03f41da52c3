// A scene in the core: bodies, energy terms and supports. It evaluates energies, residuals and Hessians; solvers only call it.
//
// Not thread-safe: an evaluation stores what the following assembly needs.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "magshell/assembly/contact_layer.h"
#include "magshell/assembly/element_loop.h"
#include "magshell/assembly/low_rank.h"
#include "magshell/body/membrane_faces.h"
#include "magshell/dofs/dof_map.h"
#include "magshell/linalg/multifrontal/factor_store.h"
#include "magshell/scene/bodies.h"
#include "magshell/scene/time_varying.h"
#include "magshell/terms/contact/contacts.h"
#include "magshell/terms/force_term.h"
#include "magshell/terms/magnetic/field_sources.h"
#include "magshell/terms/shell/viscous_terms.h"
#include "magshell/terms/solid/solid_term.h"

namespace magshell {

class LowRankTerm;
class DamperTerm;
class MuscleTerm;
struct GrowthForm;

class Model {
  public:
    explicit Model(const SceneInput& input);
    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;
    ~Model();

    /// Lists the parameters (values) and load parameters that its terms read.
    const Registry& registry() const { return registry_; }
    /// Sets all parameters, in the row order of the caller; required once before a solve.
    void set_values(const VectorXd& in_user_order);
    LoadParameters zero_load_parameters() const {
        return LoadParameters::Zero(registry_.load_parameters.size() + varying_.size());
    }

    /// Lets some parameters vary with the load parameters from now on. With none, those that varied return to their former values.
    void vary(TimeVaryingParameters time_varying);
    const TimeVaryingParameters& time_varying() const { return varying_; }
    /// Applies the varying parameters at these load parameters to the next evaluations.
    void set_time_varying(const LoadParameters& load_parameters);

    const Bodies& bodies() const { return bodies_; }
    const Nodes& nodes() const { return bodies_.nodes(); }
    const MembraneFaces& membrane_faces(Index body) const { return *membrane_faces_[body]; }
    const DofMap& dof_map() const { return dof_map_; }
    /// Linearizes the reduced coordinates at q, as evaluate() does, and nothing else.
    void linearize(const VectorXd& q) { dof_map_.linearize(q); }
    SystemMatrix& matrix() { return matrix_; }
    /// Compute the product with x, the diagonal and the free entries of the Hessian: matrix() plus contact between bodies plus low_rank().
    void multiply(const VectorXd& x, VectorXd& out) const;
    VectorXd diagonal() const;
    void reduce_matrix(LargeVector<double>& values);
    /// Writes the free entries of the Hessian, including its low-rank part, into a factorization.
    void reduce_matrix(Factor& factor);
    /// The low-rank part of the Hessian assembled last, which matrix() does not contain.
    const LowRank& low_rank() const { return low_rank_; }
    SystemMatrix* contact_matrix();
    const Residual& residual() const { return residual_; }
    Index size() const { return nodes().n_dofs(); }
    Index n_coordinates() const { return nodes().n_coordinates(); }
    double extent() const { return extent_; }
    /// Returns the smallest length scale of the terms: the thickness of the thinnest shell [m].
    double length_scale() const { return length_scale_; }
    const VectorXd& metric() const { return metric_; }
    /// Returns the forces that cancel in the residual of a state; times the machine epsilon they bound its round-off from below.
    VectorXd cancelling_forces(const VectorXd& q);
    /// Adds the part of these forces that depends on the last evaluated state, with the forces of a time stage if in_motion.
    void add_cancelling_forces_here(bool in_motion, VectorXd& out) const;

    double energy(const VectorXd& q, const LoadParameters& load_parameters) const;
    /// Returns the names of the terms in the order of energies(); terms with the same name, of several bodies, follow each other.
    std::vector<std::string_view> term_names() const;
    std::vector<std::pair<std::string_view, double>> energies(const VectorXd& q,
                                                              const LoadParameters& load_parameters) const;

    /// Evaluates the residual at q, and stores what assemble and extrapolate need.
    void evaluate(const VectorXd& q, const LoadParameters& load_parameters);
    /// Returns a sentence that names the term and vertex whose force is not finite at q; empty if all forces are finite.
    std::string not_finite(const VectorXd& q, const LoadParameters& load_parameters);
    /// Assembles the Hessian at the last evaluated state. project_psd: contact between bodies and low-rank terms contribute positive semidefinite parts.
    void assemble(const VectorXd& q, const LoadParameters& load_parameters, bool extrapolated_stress,
                  bool project_psd = false);
    /// Returns true if the Hessian assembled last is nonsymmetric on the free dofs: it is then matrix() plus nonsymmetric_tangent(), and
    /// there is no energy.
    bool unsymmetric() const { return unsymmetric_; }
    /// Throws InvalidInput with an explanation if the Hessian assembled last is nonsymmetric.
    void require_symmetric() const;
    /// Extrapolates the stresses of the last evaluated state by a step p (mixed iterations).
    void extrapolate(const VectorXd& p);
    /// Returns the derivative of the gradient at q along the load path: load parameters `at`, changing at `rate`. It is exact for those that
    /// enter linearly, and by fourth-order differences for varying parameters. Leaves the model evaluated elsewhere.
    VectorXd gradient_rate(const VectorXd& q, const LoadParameters& at, const LoadParameters& rate);
    /// Returns the derivative of the prescribed positions in the same way; zero for all other dofs.
    VectorXd prescribed_rate(const VectorXd& q, const LoadParameters& at, const LoadParameters& rate);

    /// Forces without an energy act only within the stages of time steps. A step begins at q. At a stage they are added to the residual
    /// after evaluate(), and to matrix() and nonsymmetric_tangent() after assemble(), at the same q.
    void begin_step(const VectorXd& q, const LoadParameters& load_parameters);
    /// All contact with obstacles and between bodies.
    const Contacts& contacts() const { return contacts_; }
    /// Returns why a step from q to `end` is impossible: a point would cross an obstacle. Empty if no point does.
    std::string crossing_reason(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& end,
                                const LoadParameters& load_parameters_at_end) const;
    void evaluate_forces(const VectorXd& q, const LoadParameters& load_parameters, const StageMotion& stage);
    void assemble_forces(const LoadParameters& load_parameters, bool project_psd = false);
    /// Freezes the normal forces of friction, or releases them.
    void freeze_normal_forces(bool held);
    const NonsymmetricTangent& nonsymmetric_tangent() const { return nonsymmetric_; }
    /// Adds - lambda . df/dk to the gradient; returns the gradient of lambda . f by the kinematics.
    KinematicsGradient forces_vjp(const LoadParameters& load_parameters, const VectorXd& lambda,
                                  Gradient& out) const;

    /// Adds lambda . dg/dk at the last evaluated state for all parameters k except those of supports; lambda is zero where nodes are
    /// prescribed.
    void vjp(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& lambda, Gradient& out);

    /// The terms to which viscosity applies: elastic terms, and joint dampers (which may be none).
    ViscousTerms& elastic() { return elastic_; }
    const ViscousTerms& elastic() const { return elastic_; }
    ViscousTerms& dampers() { return dampers_; }
    const ViscousTerms& dampers() const { return dampers_; }
    /// Returns the strain rates of joint dampers at q for velocities v; and their adjoint, which adds gradients by parameters, too.
    StrainSet damper_rates(const VectorXd& q, const VectorXd& v) const;
    void damper_rates_vjp(const VectorXd& q, const VectorXd& v, const StrainSet& by_rates, VectorXd& by_q,
                          VectorXd& by_v, Gradient& out) const;
    /// What a solver must know of the energy: the answers of all terms together.
    const Capabilities& capabilities() const { return capabilities_; }
    /// Returns true if the Hessian assembled with project_psd equals the exact one at that state.
    bool projection_is_exact() const { return !capabilities_.has_psd_projection && low_rank_.empty(); }
    /// Returns true if the stresses that a load step extrapolates are a good start of the next one. Those of solids are not, as their
    /// elements are stretched at first, nor those of liquids, whose pressure belongs to another volume at first.
    bool has_stress_prediction() const { return !capabilities_.has_transient_stresses && low_rank_.empty(); }
    /// max_step_length() returns the largest step length along p up to which there is an energy, at most 1; invalid_state_reason() describes
    /// what is wrong with a state, or returns an empty string.
    double max_step_length(const VectorXd& q, const VectorXd& p) const;
    std::string invalid_state_reason(const VectorXd& q) const;
    /// Returns the step length that may be taken along p: a safety factor times the distance to the first inverted element or the first
    /// collision of bodies, at most 1; 0 if there is none.
    double admissible_step_length(const VectorXd& q, const VectorXd& p) const;
    /// Returns a sentence that names the elements or faces that limit a step.
    std::string describe_blocked_step(const VectorXd& q, const VectorXd& p) const;

    /// Returns a term of a shell, "membrane" or "bending".
    const ElasticTerm& elastic_term(Index shell, std::string_view name) const;
    /// Returns the elastic term of a solid.
    const SolidTerm& solid_term(Index solid) const { return *solid_terms_[solid]; }

    const MuscleTerm& muscle_term(Index muscle) const { return *muscle_terms_[muscle]; }

    /// Returns the matrix of Projective Dynamics, which is constant while the parameters are. Throws InvalidInput, naming the term, if a
    /// term has none.
    NodeMatrix projective_stiffness() const;
    /// Returns the stiffness of active contacts with obstacles at the last evaluated state, per node [N/m].
    VectorXd contact_stiffness_diagonal() const;
    /// Returns the stiffness of active contact pairs of bodies at that state, within a time step.
    std::vector<PairStiffness> contact_pair_stiffness() const;
    /// Returns a counter of parameter changes.
    int values_version() const { return values_version_; }

    /// Returns a factorization object for the reduced Hessian, whose pattern is analysed once for all. `watch` is called from time to time
    /// during the analysis and may throw.
    std::shared_ptr<Factor> new_factor(const std::function<void()>& watch = [] {});
    /// Returns the rest position of each free dof [m].
    std::vector<Vec3> free_points() const { return dof_map_.free(bodies_.dof_points()); }
    /// Stores a factorization that nobody else uses for the next request, because fresh memory costs page faults; very large ones are
    /// freed.
    void store_spare_factor(std::shared_ptr<Factor> factor);
    /// Returns how often a pattern was analysed.
    int analyses() const { return factors_.analyses(); }

    /// The accumulated angles of all terms, which depend on the history by full turns (the branch of the angle). Empty: those of the rest state.
    using AngleBranches = std::vector<std::vector<double>>;
    AngleBranches angle_branches() const;
    void set_angle_branches(const AngleBranches& angle_branches);

    std::size_t bytes() const;
    std::mutex& in_use() { return in_use_; }

  private:
    void add_loops(Index body, const VectorXd& curvature_scale);
    void add_terms(const SceneInput& input);
    void add_six_node_shell(std::size_t number, const GrowthForm& growth);
    void add_water(const SceneInput& input);
    void add_magnetic_terms(const SceneInput& input);
    void add_moments(const SceneInput& input);
    void add_joints(const SceneInput& input);
    void add_solids(const SceneInput& input);
    void add_edge_moments(const SceneInput& input);
    void add_volumes(const SceneInput& input);
    void add_contacts(const SceneInput& input);
    void add_body_contacts(const SceneInput& input);
    void assign_columns();
    void add_muscles(const SceneInput& input);
    void collect_nonsymmetric_tangent(const VectorXd& q, const LoadParameters& load_parameters);
    bool skew_blocks_act(std::size_t from) const;  // nonsymmetric_, from that block on
    void distribute_values();
    template <class Function>
    VectorXd rate_by_varying(const LoadParameters& at, const LoadParameters& rate, const Function& function);

    Registry registry_;
    Bodies bodies_;
    SystemMatrix matrix_;
    DofMap dof_map_;
    ElementColoring coloring_;
    std::vector<std::unique_ptr<FaceLoop>> loops_;  // of each of Bodies::faces(); nullptr if it has no blocks
    std::vector<std::unique_ptr<MembraneFaces>> membrane_faces_;
    std::vector<std::unique_ptr<FaceLoop>>
        membrane_loops_;  // nullptr if the membrane uses the shell's own faces
    FieldSources sources_;
    std::vector<std::unique_ptr<Term>> terms_;
    std::vector<std::vector<const Term*>>
        of_body_;  // the terms that are assembled by the blocks of each body
    ViscousTerms elastic_, dampers_;
    const DamperTerm* damper_term_ = nullptr;
    std::vector<const SolidTerm*> solid_terms_;
    std::vector<const MuscleTerm*> muscle_terms_;
    std::vector<const Term*> restricting_terms_;
    std::vector<std::unique_ptr<ForceTerm>> forces_;
    Contacts contacts_;
    Capabilities capabilities_;
    bool unsymmetric_ = false;
    std::unique_ptr<ContactLayer> layer_;  // nullptr without contact between bodies
    std::int64_t coupled_ = 0;             // version of layer_ in the reduced pattern; 0: it has none
    // By block: ranges of matrix columns that this block is the first to add to, and therefore clears. Last entry: columns of no block.
    std::vector<std::vector<std::array<Index, 2>>> first_columns_;  // from, to
    Values values_;
    TimeVaryingParameters varying_;
    VectorXd base_values_;   // the parameters before any of them varied
    Kinematics kinematics_;  // of the last evaluation of the forces
    NonsymmetricTangent nonsymmetric_;
    LowRank low_rank_;
    std::vector<LowRankTerm*> borders_;  // the terms that contribute to it
    FactorStore factors_;
    int values_version_ = 0;
    double length_scale_ = 0.0;
    Residual residual_;
    VectorXd metric_;
    VectorXd cancelling_forces_;  // of the elastic terms, without strain history
    double beyond_ = 0.0;         // [m] excess of coordinates over those at rest, for which that was computed
    double extent_, rest_reach_;  // [m]
    std::mutex in_use_;
};

/// RAII guard that lets parameters vary until the end of its scope.
class ScopedTimeVarying {
  public:
    ScopedTimeVarying(Model& model, const TimeVaryingParameters& time_varying)
        : model_(model), varies_(!time_varying.empty()) {
        if (varies_) model_.vary(time_varying);
    }
    ~ScopedTimeVarying() {
        if (varies_) model_.vary({});
    }
    ScopedTimeVarying(const ScopedTimeVarying&) = delete;
    ScopedTimeVarying& operator=(const ScopedTimeVarying&) = delete;

  private:
    Model& model_;
    bool varies_;
};

}  // namespace magshell
