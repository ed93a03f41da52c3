// A scene in the core: a sheet, its terms, its supports. Everything is evaluated here; solvers only call.
//
// Not for two threads at once: evaluations keep what the assembly after them needs.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "magshell/assembly/bending_term.h"
#include "magshell/assembly/contact_term.h"
#include "magshell/assembly/couple_term.h"
#include "magshell/assembly/force_term.h"
#include "magshell/assembly/load_term.h"
#include "magshell/assembly/magnetic_term.h"
#include "magshell/assembly/membrane_term.h"
#include "magshell/assembly/reduction.h"
#include "magshell/assembly/scene_input.h"
#include "magshell/assembly/water_term.h"
#include "magshell/linalg/factor.h"

namespace magshell {

class Model {
  public:
    explicit Model(SceneInput input);

    /// New values for what the scene was built with; they have the same shapes and the same terms. The
    /// magnetization has to be set again after them, as it takes its volumes from the thickness.
    void set_values(const SceneValues& values);

    /// (n_f, 3) [A/m], rest frame, world axes. Only of a scene that was said to be magnetic.
    void set_magnetization(const Rows3& remanent_magnetization);

    const Sheet& sheet() const { return sheet_; }
    const Reduction& reduction() const { return reduction_; }
    SystemMatrix& matrix() { return matrix_; }
    const Residual& residual() const { return residual_; }
    Index size() const { return sheet_.n_unknowns(); }
    double extent() const { return extent_; }
    double thinnest() const { return thinnest_; }
    const VectorXd& metric() const { return metric_; }
    /// The floor under every residual of a state, to be multiplied by the unit of round-off.
    VectorXd cancelling_forces(const VectorXd& q);
    /// Adds what of it points that touch had at the last evaluated state, with the forces of a time step or
    /// without.
    void add_cancelling_contact_forces(bool in_motion, VectorXd& out) const;

    VectorXd rest_state() const;
    /// All unknowns from the caller's positions (n_v, 3) and edge rotations (n_e,), and back.
    VectorXd state(const Rows3& positions, const VectorXd& edge_rotations) const;
    /// A gradient by the caller's positions and edge rotations as one by all unknowns.
    VectorXd gradient_by_state(const Rows3& by_positions, const VectorXd& by_edge_rotations) const;
    Rows3 positions(const VectorXd& q) const;
    VectorXd edge_rotations(const VectorXd& q) const;
    /// One number a vertex of the caller as one for each unknown, zero for those that are no vertex.
    VectorXd vertex_weights(const VectorXd& by_vertex) const;
    /// A vector of all unknowns (a gradient, a mode) as rows of the caller's vertices.
    Rows3 vertex_rows(const VectorXd& full) const { return positions(full); }

    double energy(const VectorXd& q, const Controls& controls) const;
    /// In the order of energies().
    std::vector<std::string_view> term_names() const;
    std::vector<std::pair<std::string_view, double>> energies(const VectorXd& q,
                                                              const Controls& controls) const;

    /// The residual at q; keeps what assemble and extrapolate need.
    void evaluate(const VectorXd& q, const Controls& controls);
    /// Which term's force is not finite at q, and on which vertex; empty if all are.
    std::string not_finite(const VectorXd& q, const Controls& controls);
    /// The Hessian at the last evaluated state, in matrix().
    void assemble(const VectorXd& q, const Controls& controls, bool extrapolated_stress);
    void extrapolate(const VectorXd& p);
    /// How fast the gradient at q changes while the controls change at this rate; exact, as it is linear in
    /// them.
    VectorXd gradient_rate(const VectorXd& q, const Controls& rate);

    /// Forces that no energy has act only within the stages of time steps. A step begins at q; at a stage,
    /// after evaluate and after assemble at the same q, they add to the residual and to matrix(), and leave
    /// the rest of their Jacobian in remainder().
    bool has_forces() const { return !forces_.empty(); }
    void begin_step(const VectorXd& q, const Controls& controls);
    bool has_contact() const { return contact_ != nullptr; }
    /// Why a step from q to `end` cannot be: a point would be on the other side of an obstacle. Else empty.
    std::string blocked(const VectorXd& q, const Controls& controls, const VectorXd& end,
                        const Controls& controls_at_end) const;
    void evaluate_forces(const VectorXd& q, const Controls& controls, const StageMotion& stage);
    void assemble_forces(const Controls& controls, bool cautious = false);
    void hold_forces(bool held);
    const Remainder& remainder() const { return remainder_; }
    /// Adds - lambda . df/dk to the scene's gradient; returns lambda . df by what else they depend on.
    KinematicsGradient forces_vjp(const Controls& controls, const VectorXd& lambda, SceneGradient& out) const;

    /// lambda . dg/dk at the last evaluated state, for all k but what supports do; lambda is zero where they
    /// hold.
    SceneGradient vjp(const VectorXd& q, const Controls& controls, const VectorXd& lambda);

    /// The elastic terms' stresses are C (scale d - shift) from now on, and C d without a shift.
    void set_history(double scale, const SheetStrains* shift);
    SheetStrains strains(const VectorXd& q);
    /// At the last evaluated state: J p, and J^T s.
    SheetStrains strain_rates(const VectorXd& p);
    VectorXd strain_forces(const SheetStrains& stresses);
    SheetStrains stresses(const SheetStrains& strains) const;

    /// A factorization for the reduced Hessian, analysed once for all of them. `watch` is called now and then
    /// meanwhile, and may throw.
    std::shared_ptr<Factor> new_factor(const std::function<void()>& watch = [] {});
    /// Where each free unknown is at rest [m]: its vertex, or the middle of its edge.
    std::vector<Vec3> free_points() const { return reduction_.free(sheet_.unknown_points()); }
    /// One that nobody else holds, for the next who asks: fresh memory costs page faults. What is large goes
    /// back to the system.
    void keep_spare(std::shared_ptr<Factor> factor);
    /// How often the pattern was analysed.
    int analyses() const { return analyses_; }

    /// What the terms remember of how the state was reached. An empty memory is that of the rest state.
    using Memory = std::vector<std::vector<double>>;
    Memory memory() const;
    void set_memory(const Memory& memory);

    std::size_t bytes() const;
    std::mutex& in_use() { return in_use_; }

  private:
    void add_terms(const SceneInput& input);
    void add_couples(const SceneInput& input);
    void add_contacts(const std::vector<ContactInput>& contacts);
    template <class T>
    T* add(std::unique_ptr<T> term);
    void share_out_columns();

    Sheet sheet_;
    SystemMatrix matrix_;
    Reduction reduction_;
    Schedule schedule_;
    FaceLoop faces_;
    std::vector<std::unique_ptr<Term>> terms_;
    // By part: the nodes and rotations whose columns it is the first to add to, and so clears. Last:
    // nobody's.
    std::vector<std::vector<Index>> first_nodes_, first_rotations_;
    MembraneTerm* membrane_ = nullptr;
    BendingTerm* bending_ = nullptr;
    MagneticTerm* magnetic_ = nullptr;
    LoadTerm *gravity_ = nullptr, *loads_ = nullptr;
    CoupleTerm* couples_ = nullptr;
    ContactTerm* contact_ = nullptr;
    WaterTerm* water_ = nullptr;
    std::vector<std::unique_ptr<ForceTerm>> forces_;
    Kinematics kinematics_;  // where the forces were evaluated last
    Remainder remainder_;
    std::unique_ptr<Factor> analysed_;
    std::shared_ptr<Factor> spare_;
    int analyses_ = 0;
    std::vector<double> thickness_;  // in our numbering
    double thinnest_ = 0.0;
    Residual residual_;
    VectorXd metric_;             // area at each unknown of a vertex, zero for directions and rotations
    VectorXd cancelling_forces_;  // of the elastic terms, without history
    double beyond_ = 0.0;         // [m] by how much coordinates were larger than at rest then
    double history_scale_ = 1.0;
    double extent_, rest_reach_;  // [m]: of the bounding box; the largest coordinate at rest
    std::mutex in_use_;
};

}  // namespace magshell
