// From all unknowns to the free ones: supports hold nodes along some directions and may move them as rigid bodies, and
// carriers make the places of nodes functions of a few coordinates, which are the last of the free unknowns.
//
// A node held along directions that are not the world's axes is turned into a frame of its own, in which it
// is held along the first one or two axes. Nodes without supports cost nothing here.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "magshell/assembly/carried.h"
#include "magshell/assembly/support_move.h"
#include "magshell/assembly/system_matrix.h"
#include "magshell/body/nodes.h"
#include "magshell/core/parameters.h"
#include "magshell/linalg/factor.h"

namespace magshell {

/// A node and the orthonormal directions along which it is held (the first `held` columns of `frame`), each by the move
/// of one support, or -1 where that stays.
struct HeldNode {
    Index node;
    int held;
    Mat3 frame;
    std::array<Index, 3> moves = {-1, -1, -1};
};

class Reduction {
  public:
    /// `moves`: how many the held nodes refer to. The nodes have to outlive it. No node is both held and carried.
    Reduction(const SystemMatrix& matrix, std::vector<HeldNode> held, const Nodes& nodes, Index moves,
              Registry& registry, Carriers carriers = {});

    void set_values(const Values& values);
    bool moves() const { return !moves_.empty() || drives(); }
    /// Whether values prescribe coordinates of carriers.
    bool drives() const { return carried_ && carried_->drives(); }
    /// Whether values act through it: vjp adds gradients by them.
    bool has_values() const { return moves() || (carried_ && carried_->placed()); }

    /// The free unknowns that are no coordinates of carriers, ascending: these come first in the reduced order. Those of a
    /// framed node count along its frame.
    const std::vector<Index>& free_unknowns() const { return free_unknowns_; }
    bool framed(Index node) const { return !frame_of_.empty() && frame_of_[node] >= 0; }

    /// How far the moves have gone: 0 at rest, 1 at their end.
    double progress(const Controls& controls) const { return controls[progress_.first]; }

    Index size() const { return pattern_->size; }
    const std::shared_ptr<const SparsePattern>& pattern() const { return pattern_; }
    /// From now on the matrix is the sum of two: nodes that the first does not couple, the other one may. The last pattern
    /// with another one, and that without, come back as the same objects.
    void set_pattern(const SystemMatrix& matrix, const SystemMatrix* layer);

    /// Where the supports want their nodes, less where they are: zero elsewhere.
    VectorXd prescribed_increment(const VectorXd& q, const Controls& controls) const;

    /// d(where the supports want their nodes)/d(progress).
    VectorXd prescribed_rate(const Controls& controls) const;

    /// Adds the gradients by the moves and by their progress, given the gradient by what supports hold; and by what
    /// carriers are driven to and where their joints are, at an adjoint lambda under the gradient of the energy, with
    /// inertia in a motion. by_driving: by what drives, empty where nothing is; by_state has what it says of the state.
    void vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
             const Controls& controls, Gradient& out, const VectorXd& by_driving = {}) const;
    /// Adds to the forces that prescribed increments cause, K p, what a curved way of carried nodes adds.
    void add_driven_forces(const VectorXd& gradient, const VectorXd& move, VectorXd& forces) const {
        if (drives()) carried_->add_driven_forces(gradient, move, forces);
    }
    /// Forces [N] and moments [N m] that drive, one after another, where the gradient of the energy is this.
    VectorXd driving(const VectorXd& gradient) const {
        return drives() ? carried_->driving(gradient) : VectorXd();
    }

    /// Of a number with these gradients by driving(gradient): the motion of all nodes at which that gradient's power is the
    /// number; adds to forces on free unknowns how this power changes along their curved ways. At the state linearized last.
    VectorXd driving_motion(const VectorXd& by_driving) const { return carried_->driving_motion(by_driving); }
    void add_driving_change(const VectorXd& gradient, const VectorXd& by_driving, VectorXd& forces) const {
        carried_->add_driving_change(gradient, by_driving, forces);
    }

    /// Whether supports hold anything; and what of a vector of all unknowns lies along what they hold, three numbers for
    /// each of the nodes that were given, in their order.
    bool holds() const { return !held_.empty(); }
    VectorXd held(const VectorXd& full) const;

    /// Whether [axis]x between two nodes does anything along motions of the free ones.
    bool feels_skew(Index a, Index b, const Vec3& axis) const;

    /// The largest angle [rad] by which a support turns in all.
    double largest_turn() const;

    /// Whether there are nodes that a carrier moves. All of the following is linear at the state linearized last.
    bool carries() const { return carried_ != nullptr; }
    void linearize(const VectorXd& q) {
        if (carried_) carried_->linearize(q);
    }

    /// The free rows and columns, in the order of pattern(). Turns blocks of framed nodes in place first. `layer`: as
    /// in set_pattern.
    void matrix(SystemMatrix& full, SystemMatrix* layer, LargeVector<double>& values) const;
    /// Adds a diagonal of all unknowns, the same along the three axes of a node, which no frame changes: masses, areas.
    void add_weights(const VectorXd& full, LargeVector<double>& values) const;
    /// Adds what a gradient of all unknowns says of the coordinates of carriers, as nodes move along curves.
    void add_curvature(const VectorXd& gradient, LargeVector<double>& values) const {
        if (carried_) carried_->add_curvature(gradient, values.data());
    }
    void add_curvature_product(const VectorXd& gradient, const VectorXd& reduced, VectorXd& out) const {
        if (carried_) carried_->add_curvature_product(gradient, reduced, out);
    }
    VectorXd vector(const VectorXd& full) const;
    /// The diagonal of what add_weights adds; without carriers there is nothing else.
    VectorXd weights(const VectorXd& full) const;
    /// What of a vector of all unknowns lies along motions of the free ones.
    VectorXd project(const VectorXd& full) const;
    /// Moves a state along p, a vector of all unknowns: by p itself where nothing carries.
    void advance(VectorXd& q, const VectorXd& p) const;
    /// See Carrier; empty where nothing carries.
    VectorXd rounding(const VectorXd& q) const { return carried_ ? carried_->rounding(q) : VectorXd(); }
    /// See Carrier: a start, and the way back from it.
    void settle(VectorXd& q, VectorXd* v) const {
        if (carried_) carried_->settle(q, v);
    }
    void settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                    Gradient& out) const {
        if (carried_) carried_->settle_vjp(q, v, by_q, by_v, out);
    }
    /// Of points of all unknowns, the same for the three of a node, those of the free ones.
    std::vector<Vec3> free(const std::vector<Vec3>& full) const;
    /// A free vector back among all unknowns, zero where they are held; B z where they are carried.
    VectorXd expand(const VectorXd& reduced) const;

    std::size_t bytes() const;

  private:
    /// The part of a node's vector along which it is held.
    /// The sum over the held directions d of a node of d (d . vector_of(move)).
    template <class VectorOf>
    static Vec3 held_part(const HeldNode& h, const VectorOf& vector_of) {
        Vec3 part = Vec3::Zero();
        for (int axis = 0; axis < h.held; ++axis)
            part += h.frame.col(axis) * h.frame.col(axis).dot(vector_of(h.moves[axis]));
        return part;
    }
    /// Where a move has a node, and how fast it takes it along; -1 leaves it at rest.
    Vec3 place(Index node, Index move, double progress) const;
    /// How fast its move carries a node, as the progress changes.
    Vec3 rate(Index node, Index move, double progress) const;
    /// Of a node: along which motions it is free.
    Mat3 free_motions(Index node) const;
    bool axis_aligned(const HeldNode& h) const;
    void turn_blocks(SystemMatrix& full) const;
    VectorXd gathered(const VectorXd& full) const;
    static VectorXd rest_state(const Nodes& nodes);

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
    std::vector<Index> held_at_;        // per node: index into held_, else -1
    std::vector<Index> free_unknowns_;  // reduced -> full, ascending
    std::shared_ptr<const SparsePattern> pattern_, alone_,
        coupled_;  // now; the last without and with a layer
    // What is left of the full matrix, in pieces without a gap: supports take little away.
    struct Pieces {
        struct Piece {
            Index from, to, count;
        };
        std::vector<Piece> all;

        void add(Index from, Index to);
    };
    Pieces pieces_, layer_pieces_;
    std::unique_ptr<Carried> carried_;  // nullptr: nothing is
};

}  // namespace magshell
