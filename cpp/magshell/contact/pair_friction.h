// PairFriction: the friction of a contact pair. force/friction.h
//
//   F_i = w_i f(N, n, v),   v = sum_j w_j v_j
//
// with the normal force N, the normal n and the weights w of the closest points. Exact friction takes them from
// the current state. Lagged friction takes them from an earlier one, so that it depends on the velocities only.
#pragma once

#include "magshell/contact/pair_energy.h"
#include "magshell/force/friction.h"

namespace magshell {

class PairFriction {
  public:
    /// Computes friction. at: an active pair that N, n and w are taken from; it must outlive the object.
    /// velocities: of the pair's nodes [m/s].
    PairFriction(const PairEnergy& at, const PairVectors& velocities, const FrictionLaw& law);

    /// Returns the friction force on each node [N].
    PairVectors force() const;
    /// Returns the block dF_i/dv_j = w_i w_j df/dv; secant: with the majorant in place of df/dv, which keeps
    /// Newton's iteration from overshooting.
    Mat3 by_velocity(int i, int j, bool secant) const {
        const PairWeights& w = at_.near().weights;
        return w[i] * w[j] * (secant ? friction_.secant : friction_.by_velocity);
    }
    /// Computes the blocks dF_i/dx_j at constant velocities, through N, n and w; not symmetric. Block (i, j) is
    /// at 4 i + j.
    void by_position(std::array<Mat3, 16>& blocks) const;

    /// The gradient of lambda . F.
    struct Gradient {
        PairVectors by_velocity, by_position;
        double by_normal_force;  // by the normal force alone, for PairEnergy::vjp
        FrictionLaw by_law;
    };
    Gradient vjp(const PairVectors& lambda) const;

    const Friction& friction() const { return friction_; }

  private:
    /// dF_i/dx_j is a sum of products left_i right_j^T.
    struct Product {
        PairVectors left, right;
    };
    /// Calls take(product) for each of them.
    template <class Take>
    void each_product(const Take& take) const;

    const PairEnergy& at_;
    PairVectors velocities_;
    Friction friction_;
};

}  // namespace magshell
