// From all unknowns to the free ones: supports hold nodes along some directions and may move them as rigid
// bodies.
//
// A node held along directions that are not the world's axes is turned into a frame of its own, in which it
// is held along the first one or two axes. Nodes without supports cost nothing here.
#pragma once

#include <memory>
#include <vector>

#include "magshell/assembly/motion.h"
#include "magshell/assembly/system_matrix.h"
#include "magshell/linalg/factor.h"

namespace magshell {

/// A node and the orthonormal directions along which it is held (the first `held` columns of `frame`).
struct HeldNode {
    Index node;
    int held;
    Mat3 frame;
    Index motion = -1;
};

class Reduction {
  public:
    /// `rest` per node; nodes from `n_vertices` on are directions and turn only.
    Reduction(const SystemMatrix& matrix, std::vector<HeldNode> held, const std::vector<Vec3>& rest,
              Index n_vertices);

    /// As many as held nodes refer to.
    void set_motions(std::vector<Motion> motions) { motions_ = std::move(motions); }
    bool moves() const { return !motions_.empty(); }

    Index size() const { return pattern_->size; }
    const std::shared_ptr<const SparsePattern>& pattern() const { return pattern_; }

    /// Where the supports want their nodes at this progress of their motion, less where they are: zero
    /// elsewhere.
    VectorXd prescribed_increment(const VectorXd& q, double progress) const;

    /// d(where the supports want their nodes)/d(progress).
    VectorXd prescribed_rate(double progress) const;

    /// Sets the gradients by each motion and by their progress, given the gradient by what supports hold.
    void vjp(const VectorXd& by_state, double progress, std::vector<Motion>& by_motion,
             double& by_progress) const;

    /// The largest angle [rad] by which a support turns in all.
    double largest_turn() const;

    /// The free rows and columns, in the order of pattern(). Turns blocks of framed nodes in place first.
    void matrix(SystemMatrix& full, LargeVector<double>& values) const;
    VectorXd vector(const VectorXd& full) const;
    /// A diagonal of all unknowns, the same along the three axes of a node, which no frame changes: masses,
    /// areas.
    VectorXd weights(const VectorXd& full) const;
    /// Of points of all unknowns, the same for the three of a node, those of the free ones.
    std::vector<Vec3> free(const std::vector<Vec3>& full) const;
    /// A free vector back among all unknowns, zero where they are held.
    VectorXd expand(const VectorXd& reduced) const;

    std::size_t bytes() const;

  private:
    /// The part of a node's vector along which it is held.
    static Vec3 held_part(const HeldNode& h, const Vec3& vector);
    /// How fast its motion carries a node, as the progress changes.
    Vec3 rate_of(const HeldNode& h, double progress) const;
    bool axis_aligned(const HeldNode& h) const;
    void turn_blocks(SystemMatrix& full) const;

    std::vector<HeldNode> held_;
    std::vector<Motion> motions_;
    std::vector<Vec3> rest_;
    Index n_vertices_, full_size_;
    std::vector<Index> frame_of_;       // per node: index into held_ where turned, else -1; empty if none is
    std::vector<Index> free_unknowns_;  // reduced -> full, ascending
    std::shared_ptr<const SparsePattern> pattern_;
    // What is left of the full matrix, in pieces without a gap: supports take little away.
    struct Piece {
        Index from, count;
    };
    std::vector<Piece> pieces_;
};

}  // namespace magshell
