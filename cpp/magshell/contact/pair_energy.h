// The energy of a pair that is nearer than it may be, its gradient and its second derivatives.
//
//   E = A k m b(d - d_min)       A: area [m2], k: stiffness [Pa], m: contact/parallel_edges.h, b: contact/barrier.h
//
// With v_n = w n, v_a = w f_a and u_a = w_a' n, twelve numbers each (contact/proximity.h), p = - dE/dd:
//
//   gradient  - p v_n
//   Hessian   E'' v_n v_n^T + p sum_free [d u_a u_a^T + u_a v_a^T + v_a u_a^T] - p/d sum_fixed v_a v_a^T
//
// and two more vectors where edges are nearly parallel. `cautious` drops what is negative of each bracket (of rank
// two, u_a and v_a being orthogonal: a root each): what is left is positive semidefinite and nowhere below.
#pragma once

#include "magshell/contact/barrier.h"
#include "magshell/contact/parallel_edges.h"
#include "magshell/contact/proximity.h"

namespace magshell {

/// A pair of a contact: what never changes of it.
struct ContactPair {
    PairKind kind = PairKind::point_triangle;
    std::array<Index, 4> nodes{-1, -1, -1, -1};
    double area = 0.0;  // A [m2]; negative where it takes back what other pairs count twice
    double parallel =
        0.0;  // of two edges: a thousandth of the product of the squares of their rest lengths [m4]
    /// What reach and thickness together are scaled down to [m]: for neighbours on a surface, that its mesh puts nearer
    /// than they may be.
    double room = std::numeric_limits<double>::infinity();

    /// The share of a law's reach and thickness that this pair has.
    double distance_scale(const BarrierLaw& law) const {
        const double both = law.reach + law.thickness;
        return both > room ? room / both : 1.0;
    }
    /// The law that holds for it.
    BarrierLaw scaled(BarrierLaw law) const {
        const double s = distance_scale(law);
        law.reach *= s;
        law.thickness *= s;
        law.smoothing *= s;
        return law;
    }
    bool operator==(const ContactPair&) const = default;
};

/// The nodes' vectors, out of all that there are, three numbers each.
inline PairPositions positions_of(const ContactPair& pair, const double* all) {
    PairPositions x;
    for (int k = 0; k < nodes_of(pair.kind); ++k) x[k] = Eigen::Map<const Vec3>(all + 3 * pair.nodes[k]);
    return x;
}

/// A vector for each node of a pair.
using PairVectors = std::array<Vec3, 4>;
/// The 3x3 blocks of a symmetric matrix on and below its diagonal: (i, j) with j <= i is at i (i + 1)/2 + j.
using PairBlocks = std::array<Mat3, 10>;

class PairEnergy {
  public:
    PairEnergy(const ContactPair& pair, const PairPositions& x, const BarrierLaw& law);

    /// Whether the parts are near enough. If they are not, there is nothing else to ask for.
    bool acts() const { return acts_; }
    double energy() const { return edges_.factor * energy_; }
    const Proximity& near() const { return near_; }
    int count() const { return nodes_of(pair_.kind); }
    /// N = - dE/dd [N], the force that pushes them apart.
    double normal_force() const { return -edges_.factor * slope_; }
    /// - dN/dd [N/m]
    double normal_stiffness() const { return edges_.factor * curvature_; }
    /// dN/dx [N/m]
    PairVectors normal_force_by_position() const;
    PairVectors gradient() const;
    /// Only the blocks of the pair's own nodes.
    void hessian(bool project_psd, PairBlocks& blocks) const;

    /// Of lambda . gradient, and of a function of the normal force with `by_normal_force`.
    struct ByLaw {
        double stiffness = 0.0, reach = 0.0, thickness = 0.0, smoothing = 0.0;
    };
    ByLaw vjp(const PairVectors& lambda, double by_normal_force = 0.0) const;

  private:
    void add_parallel(bool project_psd, PairBlocks& blocks) const;

    ContactPair pair_;
    double distance_scale_;
    BarrierLaw law_;  // its own
    Proximity near_;
    bool acts_;
    ParallelEdges edges_;
    Barrier barrier_;
    double energy_ = 0.0, slope_ = 0.0, curvature_ = 0.0;  // of A k b
};

}  // namespace magshell
