// A scene in the core: bodies, terms, supports. Everything is evaluated here; solvers only call.
//
// Not for two threads at once: evaluations keep what the assembly after them needs.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "magshell/assembly/contact_layer.h"
#include "magshell/assembly/face_loop.h"
#include "magshell/assembly/low_rank.h"
#include "magshell/assembly/reduction.h"
#include "magshell/body/membrane_faces.h"
#include "magshell/linalg/factor_store.h"
#include "magshell/scene/bodies.h"
#include "magshell/scene/varying.h"
#include "magshell/term/contact_term.h"
#include "magshell/term/field_sources.h"
#include "magshell/term/force_term.h"
#include "magshell/term/solid_term.h"
#include "magshell/term/viscous_terms.h"

namespace magshell {

class BodyContactTerm;
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

    /// What its terms read: the lists of values and of controls.
    const Registry& registry() const { return registry_; }
    /// All values, in the caller's order of rows; solves need them set once.
    void set_values(const VectorXd& in_user_order);
    Controls no_controls() const { return Controls::Zero(registry_.controls.size() + varying_.size()); }

    /// Values that vary from now on; none: those that did are again what they were before.
    void vary(Varying varying);
    const Varying& varying() const { return varying_; }
    /// Puts what varies in place for what is evaluated next, at these controls.
    void take(const Controls& controls);

    const Bodies& bodies() const { return bodies_; }
    const Nodes& nodes() const { return bodies_.nodes(); }
    const MembraneFaces& membrane_faces(Index body) const { return *membrane_faces_[body]; }
    const Reduction& reduction() const { return reduction_; }
    /// As evaluate does, and nothing else.
    void linearize(const VectorXd& q) { reduction_.linearize(q); }
    SystemMatrix& matrix() { return matrix_; }
    /// Of matrix() and what touching bodies add to it: its product with x, its diagonal, its free rows and columns.
    void multiply(const VectorXd& x, VectorXd& out) const;
    VectorXd diagonal() const;
    void reduce_matrix(LargeVector<double>& values);
    /// All of it, for the next factorization.
    void reduce_matrix(Factor& factor);
    /// What of the Hessian as assembled last is in low_rank() and not in matrix().
    const LowRank& low_rank() const { return low_rank_; }
    SystemMatrix* contact_matrix();
    const Residual& residual() const { return residual_; }
    Index size() const { return nodes().n_unknowns(); }
    Index n_coordinates() const { return nodes().n_coordinates(); }
    double extent() const { return extent_; }
    /// The smallest of its terms': the thickness of the thinnest sheet [m].
    double length_scale() const { return length_scale_; }
    const VectorXd& metric() const { return metric_; }
    /// The floor under every residual of a state, to be multiplied by the unit of round-off.
    VectorXd cancelling_forces(const VectorXd& q);
    /// Adds what of it there is at the last evaluated state, with the forces of a time step or without.
    void add_cancelling_forces_here(bool in_motion, VectorXd& out) const;

    double energy(const VectorXd& q, const Controls& controls) const;
    /// In the order of energies(); terms of one name, of several bodies, follow each other.
    std::vector<std::string_view> term_names() const;
    std::vector<std::pair<std::string_view, double>> energies(const VectorXd& q,
                                                              const Controls& controls) const;

    /// The residual at q; keeps what assemble and extrapolate need.
    void evaluate(const VectorXd& q, const Controls& controls);
    /// Which term's force is not finite at q, and on which vertex; empty if all are.
    std::string not_finite(const VectorXd& q, const Controls& controls);
    /// The Hessian at the last evaluated state, in matrix(). Cautious: what touching bodies add is nowhere negative.
    void assemble(const VectorXd& q, const Controls& controls, bool extrapolated_stress,
                  bool cautious = false);
    /// Whether loads follow the bodies, which may make the Hessian unsymmetric; and whether, as assembled last, it is, for
    /// what is free to move: then it is matrix() and remainder(), and there is no energy.
    bool follows() const { return follows_; }
    bool unsymmetric() const { return unsymmetric_; }
    /// The same, and why, for those who need it symmetric. Throws InvalidInput.
    void require_symmetric() const;
    void extrapolate(const VectorXd& p);
    /// How fast the gradient at q changes while the controls, now `at`, change at this rate: exact for those that it is
    /// linear in, by differences of fourth order for what varies. Leaves the model as evaluated elsewhere.
    VectorXd gradient_rate(const VectorXd& q, const Controls& at, const Controls& rate);
    /// Likewise how fast supports carry what they hold; zero elsewhere.
    VectorXd prescribed_rate(const VectorXd& q, const Controls& at, const Controls& rate);

    /// Forces that no energy has act only within the stages of time steps. A step begins at q; at a stage,
    /// after evaluate and after assemble at the same q, they add to the residual and to matrix(), and leave
    /// the rest of their Jacobian in remainder().
    bool has_forces() const { return !forces_.empty(); }
    void begin_step(const VectorXd& q, const Controls& controls);
    bool has_contact() const { return contact_ != nullptr; }
    /// With obstacles; nullptr: there is none.
    ContactTerm* contact() const { return contact_; }
    /// Whether bodies keep each other, or themselves, out.
    bool has_body_contact() const { return body_contact_ != nullptr; }
    const BodyContactTerm* body_contact() const { return body_contact_; }
    /// Whether any pair of them touches at the last evaluated state.
    bool touches() const;
    /// Why a step from q to `end` cannot be: a point would be on the other side of an obstacle. Else empty.
    std::string blocked(const VectorXd& q, const Controls& controls, const VectorXd& end,
                        const Controls& controls_at_end) const;
    void evaluate_forces(const VectorXd& q, const Controls& controls, const StageMotion& stage);
    void assemble_forces(const Controls& controls, bool cautious = false);
    void hold_forces(bool held);
    const Remainder& remainder() const { return remainder_; }
    /// Adds - lambda . df/dk; returns lambda . df by what else they depend on.
    KinematicsGradient forces_vjp(const Controls& controls, const VectorXd& lambda, Gradient& out) const;

    /// Adds lambda . dg/dk at the last evaluated state, for all k but what supports do; lambda is zero where
    /// they hold.
    void vjp(const VectorXd& q, const Controls& controls, const VectorXd& lambda, Gradient& out);

    /// What a law of viscosity is about: elastic terms; and dampers in joints, which may be none.
    ViscousTerms& elastic() { return elastic_; }
    const ViscousTerms& elastic() const { return elastic_; }
    ViscousTerms& dampers() { return dampers_; }
    const ViscousTerms& dampers() const { return dampers_; }
    /// How fast dampers are drawn at q, as nodes move by v; and the way back, to values as well.
    StrainSet damper_rates(const VectorXd& q, const VectorXd& v) const;
    void damper_rates_vjp(const VectorXd& q, const VectorXd& v, const StrainSet& by_rates, VectorXd& by_q,
                          VectorXd& by_v, Gradient& out) const;
    /// Whether some states have no energy, as of solids turned inside out; then, of a step p from q, the largest
    /// share up to which there is one, and what is wrong with a state, in words.
    bool refuses_states() const { return !refusing_.empty(); }
    double largest_share(const VectorXd& q, const VectorXd& p) const;
    std::string refusal(const VectorXd& q) const;
    /// How much of a step may be taken: so far towards the first element that would be turned inside out, or the first
    /// bodies that would pass through each other.
    double share_of_step(const VectorXd& q, const VectorXd& p) const;
    /// Why a step cannot be taken, in words.
    std::string stuck(const VectorXd& q, const VectorXd& p) const;

    /// That of a sheet, "membrane" or "bending".
    const ElasticTerm& elastic_term(Index sheet, std::string_view name) const;
    /// The elastic term of a solid.
    const SolidTerm& solid_term(Index solid) const { return *solid_terms_[solid]; }

    const MuscleTerm& muscle_term(Index muscle) const { return *muscle_terms_[muscle]; }
    Index n_muscles() const { return static_cast<Index>(muscle_terms_.size()); }

    /// What Projective Dynamics has in the place of the Hessian: constant while the values are. Throws InvalidInput where a
    /// term has none, and says which.
    NodeMatrix surrogate() const;
    /// What the obstacles that are touched at the last evaluated state add on the nodes [N/m].
    VectorXd touching_stiffness() const;
    /// What the pairs of bodies that touch there add, in a time step.
    std::vector<PairStiffness> touching_pairs() const;
    /// Counts changes of the values.
    int values_version() const { return values_version_; }

    /// A factorization for the reduced Hessian, analysed once for all of them. `watch` is called now and then
    /// meanwhile, and may throw.
    std::shared_ptr<Factor> new_factor(const std::function<void()>& watch = [] {});
    /// Where each free unknown is at rest [m]: its vertex, or the middle of its edge.
    std::vector<Vec3> free_points() const { return reduction_.free(bodies_.unknown_points()); }
    /// One that nobody else holds, for the next who asks: fresh memory costs page faults. What is large goes
    /// back to the system.
    void keep_spare(std::shared_ptr<Factor> factor);
    /// How often the pattern was analysed.
    int analyses() const { return factors_.analyses(); }

    /// The terms' angles with full turns, which depend on the way there. None at all are those of the rest state.
    using Turns = std::vector<std::vector<double>>;
    Turns turns() const;
    void set_turns(const Turns& turns);

    std::size_t bytes() const;
    std::mutex& in_use() { return in_use_; }

  private:
    void add_loops(Index body, const VectorXd& curvature_scale);
    void add_terms(const SceneInput& input);
    void add_six_node_sheet(std::size_t number, const GrowthForm& growth);
    void add_water(const SceneInput& input);
    void add_magnetic_terms(const SceneInput& input);
    void add_moments(const SceneInput& input);
    void add_joints(const SceneInput& input);
    void add_solids(const SceneInput& input);
    void add_couples(const SceneInput& input);
    void add_volumes(const SceneInput& input);
    void add_contacts(const SceneInput& input);
    void add_body_contacts(const SceneInput& input);
    void share_out_columns();
    void add_muscles(const SceneInput& input);
    void add_remainders(const VectorXd& q, const Controls& controls);
    bool feels_skews(std::size_t from) const;  // of remainder_, from that one on
    void hand_out_values();
    template <class Function>
    VectorXd rate_by_varying(const Controls& at, const Controls& rate, const Function& function);

    Registry registry_;
    Bodies bodies_;
    SystemMatrix matrix_;
    Reduction reduction_;
    Schedule schedule_;
    std::vector<std::unique_ptr<FaceLoop>>
        loops_;  // of each of Bodies::faces(); nullptr where it has no chunks
    std::vector<std::unique_ptr<MembraneFaces>> membrane_faces_;
    std::vector<std::unique_ptr<FaceLoop>> membrane_loops_;  // nullptr where those are the sheet's own
    FieldSources sources_;
    std::vector<std::unique_ptr<Term>> terms_;
    std::vector<std::vector<const Term*>> of_body_;  // those assembled by its chunks
    ViscousTerms elastic_, dampers_;
    const DamperTerm* damper_term_ = nullptr;
    std::vector<const SolidTerm*> solid_terms_;
    std::vector<const MuscleTerm*> muscle_terms_;
    std::vector<const Term*> refusing_;
    std::vector<std::unique_ptr<ForceTerm>> forces_;
    ContactTerm* contact_ = nullptr;
    bool follows_ = false, unsymmetric_ = false;
    BodyContactTerm* body_contact_ = nullptr;
    std::unique_ptr<ContactLayer> layer_;  // nullptr: no bodies touch each other
    std::int64_t coupled_ = 0;             // the version of it that the reduced pattern has; 0: it has none
    // By chunk: the nodes and rotations whose columns it is the first to add to, and so clears. Last: nobody's.
    std::vector<std::vector<std::array<Index, 2>>> first_columns_;  // from, to
    Values values_;
    Varying varying_;
    VectorXd standing_;      // the values, before any varied
    Kinematics kinematics_;  // where the forces were evaluated last
    Remainder remainder_;
    LowRank low_rank_;
    std::vector<LowRankTerm*> borders_;  // those that it is of
    FactorStore factors_;
    int values_version_ = 0;
    double length_scale_ = 0.0;
    Residual residual_;
    VectorXd metric_;
    VectorXd cancelling_forces_;  // of the elastic terms, without history
    double beyond_ = 0.0;         // [m] by how much coordinates were larger than at rest then
    double extent_, rest_reach_;  // [m]
    std::mutex in_use_;
};

/// Has values vary until its end.
class WhileVarying {
  public:
    WhileVarying(Model& model, const Varying& varying) : model_(model), varies_(!varying.empty()) {
        if (varies_) model_.vary(varying);
    }
    ~WhileVarying() {
        if (varies_) model_.vary({});
    }
    WhileVarying(const WhileVarying&) = delete;
    WhileVarying& operator=(const WhileVarying&) = delete;

  private:
    Model& model_;
    bool varies_;
};

}  // namespace magshell
