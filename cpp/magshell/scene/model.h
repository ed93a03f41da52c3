// Model: evaluates a scene: energies, residuals and Hessians; solvers only call it. Its parameters and its capabilities have classes of
// their own.
//
// Not thread-safe: an evaluation stores what the following assembly needs.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "magshell/assembly/hessian_operator.h"
#include "magshell/linalg/multifrontal/factor_store.h"
#include "magshell/scene/model_capabilities.h"
#include "magshell/scene/model_parameters.h"

namespace magshell {

class Model {
  public:
    explicit Model(const SceneInput& input);
    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;
    ~Model();

    /// The parameters: their layout, their values, and derivatives with respect to them.
    ModelParameters& parameters() { return parameters_; }
    const ModelParameters& parameters() const { return parameters_; }
    /// Properties of the energy that solvers must know, and how far a step may go.
    const ModelCapabilities& capabilities() const { return capabilities_; }
    /// The terms by kind, for results.
    const SceneTerms& terms() const { return terms_; }

    const Bodies& bodies() const { return bodies_; }
    const Nodes& nodes() const { return bodies_.nodes(); }
    const DofMap& dof_map() const { return dof_map_; }
    /// Linearizes the reduced coordinates at q, as evaluate() does, and nothing else.
    void linearize(const VectorXd& q) { dof_map_.linearize(q); }
    SystemMatrix& matrix() { return matrix_; }
    /// Compute the product with x, the diagonal and the free entries of the Hessian: matrix() plus contact between bodies plus low_rank()
    /// plus, except in the diagonal, operators().
    void multiply(const VectorXd& x, VectorXd& out) const;
    VectorXd diagonal() const;
    void reduce_matrix(LargeVector<double>& values);
    /// Writes the free entries of the Hessian, including its low-rank part and its operators, into a factorization.
    void reduce_matrix(Factor& factor);
    /// The low-rank part of the Hessian assembled last, which matrix() does not contain.
    const LowRank& low_rank() const { return low_rank_; }
    /// The parts of the Hessian assembled last that are known by their products only; matrix() does not contain them.
    const std::vector<std::shared_ptr<const HessianOperator>>& operators() const { return operators_; }
    /// Returns the product of operators() with a vector of the free dofs, linearized as at the call; empty if there are none. rough: nearly
    /// that product in less time. The model must outlive it.
    std::function<VectorXd(const VectorXd&)> operator_product(bool rough) const;
    /// Returns whether nearly that product differs from the exact one.
    bool operators_are_rough() const;  // plain-words: ok, of products
    SystemMatrix* contact_matrix();
    const Residual& residual() const { return residual_; }
    Index size() const { return nodes().n_dofs(); }
    Index n_coordinates() const { return nodes().n_coordinates(); }
    double extent() const { return extent_; }
    /// Returns the smallest length scale of the terms: the thickness of the thinnest shell [m].
    double length_scale() const { return parameters_.length_scale(); }
    const VectorXd& metric() const { return metric_; }
    /// Returns the forces that cancel in the residual of a state; times the machine epsilon they bound its round-off from below.
    VectorXd cancelling_forces(const VectorXd& q);
    /// Adds the part of these forces that depends on the last evaluated state, with the forces of a time stage if in_motion.
    void add_cancelling_forces_here(bool in_motion, VectorXd& out) const;

    double energy(const VectorXd& q, const LoadParameters& load_parameters) const;
    /// Returns the largest Term::field_sampling_error of all terms; NaN if that of one is.
    double field_sampling_error(const VectorXd& q, const LoadParameters& load_parameters);
    /// Returns the names of the terms in the order of energies(); terms with the same name, of several bodies, follow each other.
    std::vector<std::string_view> term_names() const;
    std::vector<std::pair<std::string_view, double>> energies(const VectorXd& q,
                                                              const LoadParameters& load_parameters) const;

    /// Evaluates the residual at q, and stores what assemble and extrapolate need.
    void evaluate(const VectorXd& q, const LoadParameters& load_parameters);
    /// Returns the gradient of all terms of this name at q [N].
    VectorXd term_gradient(std::string_view name, const VectorXd& q, const LoadParameters& load_parameters);
    /// Returns a sentence that names the term and vertex whose force is not finite at q; empty if all forces are finite.
    std::string not_finite(const VectorXd& q, const LoadParameters& load_parameters);
    /// Assembles the Hessian at the last evaluated state. project_psd: contact between bodies and low-rank terms contribute positive
    /// semidefinite parts.
    void assemble(const VectorXd& q, const LoadParameters& load_parameters, bool extrapolated_stress,
                  bool project_psd = false);
    /// Returns true if the Hessian assembled last is nonsymmetric on the free dofs: it is then matrix() plus nonsymmetric_tangent(), and
    /// there is no energy.
    bool unsymmetric() const { return unsymmetric_; }
    /// Throws InvalidInput with an explanation if the Hessian assembled last is nonsymmetric.
    void require_symmetric() const;
    /// Throws InvalidInput with an explanation if the Hessian assembled last is not a sparse matrix, because operators() belong to it.
    void require_sparse() const;
    /// Extrapolates the stresses of the last evaluated state by a step p (mixed iterations).
    void extrapolate(const VectorXd& p);

    /// All contact with obstacles and between bodies.
    const Contacts& contacts() const { return terms_.contacts; }
    /// Forces without an energy act only within the stages of time steps. A step begins at q. At a stage they are added to the residual
    /// after evaluate(), and to matrix() and nonsymmetric_tangent() after assemble(), at the same q.
    void begin_step(const VectorXd& q, const LoadParameters& load_parameters);
    void evaluate_forces(const VectorXd& q, const LoadParameters& load_parameters, const StageMotion& stage);
    void assemble_forces(const LoadParameters& load_parameters, bool project_psd = false);
    /// Returns the forces of contact and friction on all dofs [N] at the last evaluated state, with their factor (Contacts::set_factor).
    VectorXd contact_forces(const VectorXd& q, const LoadParameters& load_parameters) const;
    /// Returns the product of the derivative of minus these forces, transposed, with x. Overwrites the assembled Hessian.
    VectorXd multiply_contact_transposed(const VectorXd& q, const LoadParameters& load_parameters,
                                         const VectorXd& x);
    /// Freezes the normal forces of friction, or releases them.
    void freeze_normal_forces(bool held);
    const NonsymmetricTangent& nonsymmetric_tangent() const { return nonsymmetric_; }
    /// Returns true if forces may carry momentum beside that of the masses (ForceTerm::add_momentum()).
    bool may_have_fluid_momentum() const;
    /// Returns the momentum p(q, v) of all dofs that they carry [N s]; empty if none may.
    VectorXd fluid_momentum(const VectorXd& q, const VectorXd& v) const;
    /// Returns the energy that belongs to it, v . p - T [J], and adds dT/dq [N] to `by_q` unless that is null.
    double fluid_energy(const VectorXd& q, const VectorXd& v, VectorXd* by_q = nullptr) const;
    /// The kinematics at which the forces were evaluated last.
    const Kinematics& kinematics() const { return kinematics_; }

    /// The terms to which viscosity applies: elastic terms, and joint dampers (which may be none).
    ViscousTerms& elastic() { return terms_.elastic; }
    const ViscousTerms& elastic() const { return terms_.elastic; }
    ViscousTerms& dampers() { return terms_.dampers; }
    const ViscousTerms& dampers() const { return terms_.dampers; }
    /// Returns the strain rates of joint dampers at q for velocities v.
    StrainSet damper_rates(const VectorXd& q, const VectorXd& v) const;

    /// Returns the matrix of Projective Dynamics, which is constant while the parameters are. Throws InvalidInput, naming the term, if a
    /// term has none.
    NodeMatrix projective_stiffness() const;
    /// Returns the stiffness of active contacts with obstacles at the last evaluated state, per node [N/m].
    VectorXd contact_stiffness_diagonal() const;
    /// Returns the stiffness of active contact pairs of bodies at that state, within a time step.
    std::vector<PairStiffness> contact_pair_stiffness() const;

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

    /// The accumulated angles of all terms, which depend on the history by full turns (the branch of the angle). Empty: those of the rest
    /// state.
    using AngleBranches = std::vector<std::vector<double>>;
    AngleBranches angle_branches() const;
    void set_angle_branches(const AngleBranches& angle_branches);

    std::size_t bytes() const;
    std::mutex& in_use() { return in_use_; }

  private:
    void assign_columns();
    void update_contact_pattern();
    void collect_nonsymmetric_tangent(const VectorXd& q, const LoadParameters& load_parameters);
    bool skew_blocks_act(std::size_t from) const;  // nonsymmetric_, from that block on

    Registry registry_;
    Bodies bodies_;
    SystemMatrix matrix_;
    DofMap dof_map_;
    SceneTerms terms_;
    LowRank low_rank_;
    std::vector<std::shared_ptr<const HessianOperator>> operators_;
    ModelParameters parameters_;
    ModelCapabilities capabilities_;
    bool unsymmetric_ = false;
    std::int64_t coupled_ = 0;  // version of the contact layer in the reduced pattern; 0: it has none
    // By block: ranges of matrix columns that this block is the first to add to, and therefore clears. Last entry: columns of no block.
    std::vector<std::vector<std::array<Index, 2>>> first_columns_;  // from, to
    Kinematics kinematics_;                                         // of the last evaluation of the forces
    NonsymmetricTangent nonsymmetric_;
    FactorStore factors_;
    Residual residual_;
    VectorXd metric_;
    VectorXd cancelling_forces_;   // of the elastic terms, without strain history
    int cancelling_version_ = -1;  // of the parameters for which that was computed
    double beyond_ = 0.0;         // [m] excess of coordinates over those at rest, for which that was computed
    double extent_, rest_reach_;  // [m]
    std::mutex in_use_;
};

}  // namespace magshell
