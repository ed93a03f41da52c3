// Friction of a pair that touches.                                                              force/friction.h
//
//   F_i = w_i f(N, n, v),   v = sum_j w_j v_j
//
// with the normal force N, the normal n and the weights w of the closest points. Exact: those of the same state. Lagged:
// those of an earlier one, which leaves the velocities alone.
#pragma once

#include "magshell/contact/pair_energy.h"
#include "magshell/force/friction.h"

namespace magshell {

class PairFriction {
  public:
    /// at: where N, n and w are from, a pair that acts; velocities: of its nodes [m/s]. `at` has to outlive it.
    PairFriction(const PairEnergy& at, const PairVectors& velocities, const FrictionLaw& law);

    /// N (of force) on each node.
    PairVectors force() const;
    /// 3x3 blocks dF_i/dv_j = w_i w_j df/dv; secant: with what never overshoots in place of df/dv.
    Mat3 by_velocity(int i, int j, bool secant) const {
        const PairWeights& w = at_.near().weights;
        return w[i] * w[j] * (secant ? friction_.secant : friction_.by_velocity);
    }
    /// Blocks dF_i/dx_j, through N, n and w, with velocities that stay: not symmetric. (i, j) at 4 i + j.
    void by_position(std::array<Mat3, 16>& blocks) const;

    /// Of lambda . F.
    struct Gradient {
        PairVectors by_velocity, by_position;
        double by_normal_force;  // alone, for PairEnergy::vjp
        FrictionLaw by_law;
    };
    Gradient vjp(const PairVectors& lambda) const;

    const Friction& friction() const { return friction_; }

  private:
    /// dF_i/dx_j is a sum of products left_i right_j^T.
    struct Product {
        PairVectors left, right;
    };
    /// Calls take(product) for each.
    template <class Take>
    void each_product(const Take& take) const;

    const PairEnergy& at_;
    PairVectors velocities_;
    Friction friction_;
};

}  // namespace magshell
