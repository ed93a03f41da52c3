// SlipMap: the slip velocity of a contact pair, a linear map of the velocities of its nodes.
//
//   u = sum_k S_k v_k,   S_k = w_k P + d [n] O_k,   P = I - n n^T
//
// sum w_k v_k is the difference of the velocities of the closest points, which are d apart along n (contact/proximity.h), and O_k v_k adds up to
// the spin of a triangle of the second part, so that u is the velocity of the first part relative to a body that moves as the triangle does. u
// vanishes in every rigid motion of all nodes. So the forces S_k^T f of a friction f have neither a resultant force nor a resultant moment,
// whereas f and -f at the two points would leave the couple d n x f.
//
// With the triangle's unit normal m and the gradients g_k of its shape functions, the spin of its velocities, exact in rigid motions, is
//
//   O_k = (g_k x m) m^T + 1/2 m (m x g_k)^T
#pragma once

#include "magshell/contact/pair_energy.h"

namespace magshell {

// The most nodes of a slip map: those of two edges, and the corner opposite of the second one in a triangle. See
// test_rigid_motions_are_no_slip_and_friction_has_no_moment.
constexpr int slip_nodes = 5;
/// A vector per node of a slip map.
using SlipVectors = std::array<Vec3, slip_nodes>;

/// The nodes of a pair, and after them further corners of a triangle of the second part, at one state.
struct SlipStencil {
    std::array<Index, slip_nodes> nodes{-1, -1, -1, -1, -1};
    int count = 0;   // of nodes; 0: no slip map, as the triangle has a node of the first part
    int corner = 1;  // place of the first of the triangle's three corners, which are consecutive
    SlipVectors positions;

    SlipStencil() { positions.fill(Vec3::Zero()); }
    /// Creates the stencil of a pair whose second part belongs to a triangle, with positions out of those of all nodes.
    SlipStencil(const ContactPair& pair, const std::array<Index, 3>& triangle, const double* all);

    /// Returns the vectors of these nodes out of those of all nodes, three numbers each.
    SlipVectors of(const double* all) const;
    /// Returns the nodes between which two edges need couplings that the pair itself does not have; the first is negative if there are none.
    std::array<Index, 4> further_couplings() const {
        if (count < slip_nodes) return {-1, -1, -1, -1};
        return {nodes[0], nodes[1], nodes[4], -1};
    }
};

class SlipMap {
  public:
    SlipMap(const Proximity& near, const SlipStencil& stencil);

    /// Returns S_k.
    const Mat3& at(int k) const { return map_[k]; }
    Vec3 slip(const SlipVectors& velocities) const;
    /// Returns the forces S_k^T f.
    SlipVectors forces(const Vec3& friction) const;

    /// A rate of the geometry along one parameter: of the weights, of n, and of d.
    struct Rate {
        PairWeights weights{};
        Vec3 normal = Vec3::Zero();
        double distance = 0.0;
    };
    /// Returns the rates of all S_k at constant spin map.
    std::array<Mat3, slip_nodes> rate(const Rate& along) const;
    /// Returns the rates of all S_k as a corner c of the triangle moves along an axis, at constant w, n and d.
    std::array<Mat3, slip_nodes> rate_by_corner(int c, int axis) const;

  private:
    const Proximity& near_;
    int first_;  // place of the first corner
    Vec3 triangle_normal_ = Vec3::Zero();
    std::array<Vec3, 3> gradients_;
    std::array<Mat3, 3> spin_;  // O_k of the corners
    std::array<Mat3, slip_nodes> map_;
};

}  // namespace magshell
