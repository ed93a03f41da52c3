// PairFriction: the friction of a contact pair. force/friction.h
//
//   F_k = S_k^T f(N, n, u),   u = sum_k S_k v_k                            contact/slip_map.h
//
// with the normal force N, the normal n and the slip map S, so that rigid motions of both parts are no slip and the forces have no moment.
// Exact friction takes them from the current state. Lagged friction takes them from an earlier one, so that it depends on the velocities only.
#pragma once

#include "magshell/contact/slip_map.h"
#include "magshell/force/friction.h"

namespace magshell {

class PairFriction {
  public:
    /// Computes friction. at: an active pair that N, n and d are taken from; it must outlive the object. stencil: its slip stencil, at the
    /// same state. velocities: of the nodes of the stencil [m/s].
    PairFriction(const PairEnergy& at, const SlipStencil& stencil, const SlipVectors& velocities,
                 const FrictionLaw& law);

    int count() const { return count_; }
    /// Returns S_k.
    const Mat3& map(int k) const { return map_.at(k); }
    /// Returns the friction force on each node [N].
    SlipVectors force() const { return map_.forces(friction_.force); }
    /// Returns the block dF_i/dv_j = S_i^T df/du S_j; secant: with the majorant in place of df/du, which keeps
    /// Newton's iteration from overshooting.
    Mat3 by_velocity(int i, int j, bool secant) const {
        return map_.at(i).transpose() * (secant ? friction_.secant : friction_.by_velocity) * map_.at(j);
    }
    /// The blocks between all nodes; (i, j) is at slip_nodes i + j.
    using Blocks = std::array<Mat3, slip_nodes * slip_nodes>;
    /// Computes the blocks dF_i/dx_j at constant velocities, through N, n and S; not symmetric.
    void by_position(Blocks& blocks) const;

    /// The gradient of lambda . F.
    struct Gradient {
        SlipVectors by_velocity, by_position;
        double by_normal_force;  // by the normal force alone, for PairEnergy::vjp
        FrictionLaw by_law;
    };
    Gradient vjp(const SlipVectors& lambda) const;

    const Friction& friction() const { return friction_; }
    const Vec3& slip() const { return slip_; }

  private:
    /// dF_i/dx_j is a sum of products left_i right_j^T.
    struct Product {
        SlipVectors left, right;
    };
    /// Calls take(product) for each of them.
    template <class Take>
    void each_product(const Take& take) const;
    /// Returns dF for rates of S, N and n.
    SlipVectors force_rate(const std::array<Mat3, slip_nodes>& map_rate, const Vec3& normal_rate) const;

    const PairEnergy& at_;
    const int count_, corner_;
    SlipMap map_;
    SlipVectors velocities_;
    Vec3 slip_;
    Friction friction_;
};

}  // namespace magshell
