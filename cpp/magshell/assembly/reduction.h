// From all unknowns to the free ones: supports hold nodes along some directions and may move them as rigid bodies.
//
// A node held along directions that are not the world's axes is turned into a frame of its own, in which it
// is held along the first one or two axes. Nodes without supports cost nothing here.
#pragma once

#include <memory>
#include <vector>

#include "magshell/assembly/support_move.h"
#include "magshell/assembly/system_matrix.h"
#include "magshell/body/nodes.h"
#include "magshell/core/parameters.h"
#include "magshell/linalg/factor.h"

namespace magshell {

/// A node and the orthonormal directions along which it is held (the first `held` columns of `frame`).
struct HeldNode {
    Index node;
    int held;
    Mat3 frame;
    Index move = -1;
};

class Reduction {
  public:
    /// `moves`: how many the held nodes refer to. The nodes have to outlive it.
    Reduction(const SystemMatrix& matrix, std::vector<HeldNode> held, const Nodes& nodes, Index moves,
              Registry& registry);

    void set_values(const Values& values);
    bool moves() const { return !moves_.empty(); }

    /// How far the moves have gone: 0 at rest, 1 at their end.
    double progress(const Controls& controls) const { return controls[progress_.first]; }

    Index size() const { return pattern_->size; }
    const std::shared_ptr<const SparsePattern>& pattern() const { return pattern_; }

    /// Where the supports want their nodes, less where they are: zero elsewhere.
    VectorXd prescribed_increment(const VectorXd& q, const Controls& controls) const;

    /// d(where the supports want their nodes)/d(progress).
    VectorXd prescribed_rate(const Controls& controls) const;

    /// Adds the gradients by the moves and by their progress, given the gradient by what supports hold.
    void vjp(const VectorXd& by_state, const Controls& controls, Gradient& out) const;

    /// The largest angle [rad] by which a support turns in all.
    double largest_turn() const;

    /// The free rows and columns, in the order of pattern(). Turns blocks of framed nodes in place first.
    void matrix(SystemMatrix& full, LargeVector<double>& values) const;
    VectorXd vector(const VectorXd& full) const;
    /// A diagonal of all unknowns, the same along the three axes of a node, which no frame changes: masses, areas.
    VectorXd weights(const VectorXd& full) const;
    /// Of points of all unknowns, the same for the three of a node, those of the free ones.
    std::vector<Vec3> free(const std::vector<Vec3>& full) const;
    /// A free vector back among all unknowns, zero where they are held.
    VectorXd expand(const VectorXd& reduced) const;

    std::size_t bytes() const;

  private:
    /// The part of a node's vector along which it is held.
    static Vec3 held_part(const HeldNode& h, const Vec3& vector);
    /// How fast its move carries a node, as the progress changes.
    Vec3 rate_of(const HeldNode& h, double progress) const;
    bool axis_aligned(const HeldNode& h) const;
    void turn_blocks(SystemMatrix& full) const;

    std::vector<HeldNode> held_;
    const Nodes& nodes_;
    struct MoveSlots {
        Slot center, rotation, displacement;
    };
    std::vector<MoveSlots> slots_;
    std::vector<SupportMove> moves_;
    Slot progress_;
    Index full_size_;
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
