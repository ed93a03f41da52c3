// What carriers make of the reduced matrix and of vectors: B^T H B with its curvature. Their coordinates are the last
// unknowns, those of one carrier after another. Scenes without carriers have none of this.
#pragma once

#include <Eigen/Cholesky>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "magshell/assembly/carrier.h"
#include "magshell/assembly/link_coupling.h"
#include "magshell/assembly/system_matrix.h"
#include "magshell/linalg/factor.h"

namespace magshell {

using Carriers = std::vector<std::unique_ptr<Carrier>>;

class Carried {
  public:
    Carried(Carriers carriers, const SystemMatrix& matrix);

    Index coordinates() const { return coordinates_; }
    bool carries(Index unknown) const { return carrier_of_[unknown] >= 0; }

    /// While the reduced pattern is built, in this order. The matrix is the sum of a few. `reduced`: of each unknown,
    /// negative where it is held or carried; of the free ones there are so many.
    void couple(const std::vector<const SystemMatrix*>& matrices, const std::vector<Index>& reduced,
                Index free);
    void append_rows(Index free, std::vector<Index>& rows) const;
    void append_columns(SparsePattern& pattern) const;
    void find_places(const std::vector<const SystemMatrix*>& matrices, const std::vector<Index>& reduced,
                     const SparsePattern& pattern);

    /// From now on B is that at q.
    void linearize(const VectorXd& q);

    /// Adds B^T H B of one of the matrices; the same of a diagonal; and the curvature under a gradient.
    void add_matrix(std::size_t which, const SystemMatrix& full, double* values) const;
    void add_weights(const VectorXd& weights, double* values) const;
    void add_curvature(const VectorXd& gradient, double* values) const;
    void add_curvature_product(const VectorXd& gradient, const VectorXd& reduced, VectorXd& out) const;

    /// Values may prescribe some coordinates of carriers, which are not among the unknowns then. Adds the motion that
    /// brings the nodes there; adds to the forces that a motion of all nodes causes what comes of how driven nodes curve
    /// away; and adds the gradients by those values, of a number whose gradient by all nodes is `by_state`, at an adjoint
    /// lambda of all unknowns under a gradient g. driving: the forces [N], or moments [N m], that hold them, by g. For the
    /// gradients of a number by these: the motion B z at which their power is that number's; and forces that B^T makes what
    /// such powers change by along the free coordinates, with g as it is.
    bool drives() const { return drives_; }
    /// Whether values say where joints are, which vjp adds to as well.
    bool placed() const { return placed_; }
    void set_values(const Values& values);
    void add_driven_increment(const VectorXd& q, VectorXd& increment) const;
    void add_driven_forces(const VectorXd& gradient, const VectorXd& move, VectorXd& forces) const;
    void vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
             const VectorXd& by_driving, Gradient& out) const;
    VectorXd driving(const VectorXd& gradient) const;
    VectorXd driving_motion(const VectorXd& by_driving) const;
    void add_driving_change(const VectorXd& gradient, const VectorXd& by_driving, VectorXd& forces) const;

    /// The last numbers of a reduced vector: B^T f, and the diagonal of B^T w B.
    void pull_back(const VectorXd& full, VectorXd& reduced) const;
    void diagonal(const VectorXd& weights, VectorXd& reduced) const;
    /// B z on the nodes carried.
    void push_forward(const VectorXd& reduced, VectorXd& full) const;
    /// What of a full vector is a motion that the carriers allow, and nothing else of it on their nodes.
    void project(VectorXd& full) const;
    /// The rows of the nodes carried, from another vector of all unknowns.
    void replace(const VectorXd& from, VectorXd& to) const;

    /// Moves q, the nodes carried along what of p they can follow.
    void advance(VectorXd& q, const VectorXd& p) const;
    /// See Carrier; of all unknowns, zero where nothing is carried.
    VectorXd rounding(const VectorXd& q) const;
    void settle(VectorXd& q, VectorXd* v) const;
    void settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                    Gradient& out) const;

    /// Where each coordinate is: the mean of the nodes that it moves.
    void append_points(const std::vector<Vec3>& full, std::vector<Vec3>& points) const;

    std::size_t bytes() const;

  private:
    struct Places {                            // of one of the matrices
        LinkCoupling mixed, inner;             // with free unknowns, and with others of this carrier
        std::map<Index, LinkCoupling> across;  // rows of a later carrier
    };
    struct Chunk {
        std::unique_ptr<Carrier> carrier;
        Index first = 0;    // among the carriers' coordinates
        LinkTwists twists;  // B
        // Of B^T B of the free ones, once something asks for it.
        mutable std::optional<Eigen::LDLT<Eigen::MatrixXd>> normal;
        std::vector<Places> places;
        std::set<Index> later;                       // carriers after it that it is coupled with
        std::vector<Index> own;                      // where each column's rows of this carrier begin
        std::map<Index, std::vector<Index>> beside;  // and those of a later one
    };

    void find_places(std::size_t which, const SystemMatrix& matrix, const std::vector<Index>& reduced,
                     const SparsePattern& pattern);
    /// The free coordinates of a motion of all nodes; those of driven ones; forces with which B^T gives these.
    VectorXd free_part(const Chunk& chunk, const VectorXd& full) const;
    VectorXd driven_part(const Chunk& chunk, const VectorXd& full) const;
    static const Eigen::LDLT<Eigen::MatrixXd>& normal(const Chunk& chunk);
    static VectorXd driven_of(const Chunk& chunk, const VectorXd& rows);
    /// Adds forces on its nodes that B^T makes these of its free coordinates.
    void add_forces_of(const Chunk& chunk, const VectorXd& by_coordinates, VectorXd& forces) const;
    /// Rates [m] of what is driven in a chunk, from numbers of all motors in their units; `first` goes on to the next chunk.
    static VectorXd driven_rates(const Chunk& chunk, const VectorXd& all, Index& first);
    VectorXd pull_back_free(const Chunk& chunk, const VectorXd& rows) const;
    void add_lower(const Chunk& chunk, const Eigen::MatrixXd& block, double* values) const;

    std::vector<Chunk> chunks_;
    Index coordinates_ = 0, free_ = 0;
    bool drives_ = false, placed_ = false;
    VectorXd at_;                               // q of the linearization
    std::vector<Index> carrier_of_, row_of_;    // by unknown: its carrier, its row of B there
    std::map<Index, std::set<Index>> coupled_;  // by free unknown: carriers
};

}  // namespace magshell
