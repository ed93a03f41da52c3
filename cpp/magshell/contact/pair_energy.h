// PairEnergy: the energy of a contact pair closer than its activation distance, with gradient and second
// derivatives.
//
//   E = A k m b(d - d_min)       A: area [m2], k: stiffness [Pa], m: contact/parallel_edges.h, b: contact/barrier.h
//
// With the vectors of twelve numbers v_n = w n, v_a = w f_a and u_a = w_a' n (contact/proximity.h), and p = -
// dE/dd:
//
//   gradient  - p v_n
//   Hessian   E'' v_n v_n^T + p sum_free [d u_a u_a^T + u_a v_a^T + v_a u_a^T] - p/d sum_fixed v_a v_a^T
//
// and two more vectors if edges are nearly parallel. `project_psd` projects each bracket onto the positive
// semidefinite matrices (each has rank two with orthogonal u_a and v_a, so the eigenvalues are known): the
// result is positive semidefinite and bounds the Hessian from above.
#pragma once

#include "magshell/contact/barrier.h"
#include "magshell/contact/parallel_edges.h"
#include "magshell/contact/proximity.h"

namespace magshell {

/// A contact pair: the data that never change.
struct ContactPair {
    PairKind kind = PairKind::point_triangle;
    std::array<Index, 4> nodes{-1, -1, -1, -1};
    double area = 0.0;      // A [m2]; negative for overcount corrections
    double parallel = 0.0;  // for two edges: 1e-3 times the product of their squared reference lengths [m4]
    /// Upper bound [m] of activation distance plus minimum separation, for neighbouring parts of a surface that
    /// are closer in the reference shape than the law allows; both distances are scaled down to it.
    double room = std::numeric_limits<double>::infinity();

    /// Returns the factor by which the law's distances are scaled down for this pair.
    double distance_scale(const BarrierLaw& law) const {
        const double both = law.activation_distance + law.min_distance;
        return both > room ? room / both : 1.0;
    }
    /// Returns the law with the scaled distances.
    BarrierLaw scaled(BarrierLaw law) const {
        const double s = distance_scale(law);
        law.activation_distance *= s;
        law.min_distance *= s;
        law.smoothing *= s;
        return law;
    }
    bool operator==(const ContactPair&) const = default;
};

/// Returns the vectors of the pair's nodes out of those of all nodes, three numbers each.
inline PairPositions positions_of(const ContactPair& pair, const double* all) {
    PairPositions x;
    for (int k = 0; k < nodes_of(pair.kind); ++k) x[k] = Eigen::Map<const Vec3>(all + 3 * pair.nodes[k]);
    return x;
}

/// A vector per node of a pair.
using PairVectors = std::array<Vec3, 4>;
/// The 3x3 blocks of a symmetric matrix on and below its diagonal: (i, j) with j <= i is at i (i + 1)/2 + j.
using PairBlocks = std::array<Mat3, 10>;

class PairEnergy {
  public:
    PairEnergy(const ContactPair& pair, const PairPositions& x, const BarrierLaw& law);

    /// Returns true if the pair is active. Otherwise nothing else may be asked for.
    bool acts() const { return acts_; }
    double energy() const { return edges_.factor * energy_; }
    const Proximity& near() const { return near_; }
    int count() const { return nodes_of(pair_.kind); }
    /// Returns N = - dE/dd [N], the normal force.
    double normal_force() const { return -edges_.factor * slope_; }
    /// Returns - dN/dd [N/m].
    double normal_stiffness() const { return edges_.factor * curvature_; }
    /// Returns dN/dx [N/m].
    PairVectors normal_force_by_position() const;
    PairVectors gradient() const;
    /// Computes the Hessian's blocks between the pair's nodes.
    void hessian(bool project_psd, PairBlocks& blocks) const;

    /// The gradient with respect to the law of lambda . gradient plus a function of the normal force, whose derivative is
    /// `by_normal_force`.
    struct ByLaw {
        double stiffness = 0.0, activation_distance = 0.0, min_distance = 0.0, smoothing = 0.0;
    };
    ByLaw vjp(const PairVectors& lambda, double by_normal_force = 0.0) const;

    /// The gradient of the same by the numbers of the pair: area, parallel and room.
    struct ByPair {
        double area = 0.0, parallel = 0.0, room = 0.0;
    };
    ByPair pair_vjp(const PairVectors& lambda, double by_normal_force = 0.0) const;

  private:
    void add_parallel(bool project_psd, PairBlocks& blocks) const;
    /// The rates along lambda of the distance d, to which a change of the normal force counts as well, and of c in
    /// contact/parallel_edges.h.
    struct Rates {
        double distance = 0.0, parallel = 0.0;
    };
    Rates rates(const PairVectors& lambda, double by_normal_force) const;
    /// Returns the gradient with respect to the scaled law of the pair.
    ByLaw vjp_of_own_law(const Rates& rates) const;

    ContactPair pair_;
    double distance_scale_;
    BarrierLaw law_;  // scaled for this pair
    Proximity near_;
    bool acts_;
    ParallelEdges edges_;
    Barrier barrier_;
    double energy_ = 0.0, slope_ = 0.0, curvature_ = 0.0;  // of A k b
};

struct NearPair {
    Index contact = 0;  // index of the SurfacePair
    ContactPair pair;
    Index first_face = 0, second_face = 0;  // a face of each part, numbered in its surface
    bool swapped = false;                   // true: the first part belongs to surface b

    bool operator==(const NearPair&) const = default;
};

}  // namespace magshell
