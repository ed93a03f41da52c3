// Nodes whose places are functions of a few coordinates of their own: a rigid part's, a skeleton's.
//
//   x = P(z),  B = dx/dz        gradient B^T g,  Hessian B^T H B + sum_i g_i d2x_i/dz2,  lambda of the nodes = B
//   lambda_z
//
// The coordinates count from where the nodes are: each iterate is a new origin, so that derivatives are needed at
// z = 0 only. What the nodes are at is the only state; all coordinates are lengths [m].
#pragma once

#include <utility>
#include <vector>

#include "magshell/assembly/link_twists.h"
#include "magshell/core/parameters.h"
#include "magshell/core/types.h"

namespace magshell {

class Carrier {
  public:
    explicit Carrier(std::vector<Index> nodes) : nodes_(std::move(nodes)) {}
    virtual ~Carrier() = default;

    const std::vector<Index>& nodes() const { return nodes_; }
    /// How many are free; the last of all, so many, are prescribed by values.
    virtual Index coordinates() const = 0;
    virtual Index driven() const { return 0; }

    /// B at q: a row for each component of its nodes, a column a coordinate, driven ones too. As twists of its links, and
    /// as it is.
    virtual LinkTwists twists(const VectorXd& q) const = 0;
    Eigen::MatrixXd jacobian(const VectorXd& q) const { return twists(q).matrix(); }

    /// sum_i g_i d2x_i/dz2 at q, for a gradient of all unknowns; symmetric. Of all coordinates.
    virtual Eigen::MatrixXd curvature(const VectorXd& q, const VectorXd& gradient) const = 0;

    /// What prescribes the driven coordinates; how far they are from there, nothing where it is but round-off; what they
    /// are in a unit of the values [m]; and by the values, where a number has these gradients by the coordinates.
    virtual void set_values(const Values&) {}
    virtual VectorXd driven_increment(const VectorXd& /*q*/) const { return {}; }
    virtual VectorXd driven_units() const { return {}; }
    virtual void driven_vjp(const VectorXd& /*q*/, const VectorXd& /*by_driven*/, Gradient& /*out*/) const {}
    /// How sum g . B z changes along all coordinates, at rates z of the driven ones alone, with g as it is.
    virtual VectorXd driving_change(const VectorXd& /*q*/, const VectorXd& /*gradient*/,
                                    const VectorXd& /*driven*/) const {
        return {};
    }

    /// Whether values say where its joints are; and adds the gradients by these, at q, of a number with this gradient by
    /// all nodes, with what they do to sum g . B z at the rates z of all coordinates under a gradient g.
    virtual bool placed() const { return false; }
    virtual void places_vjp(const VectorXd& /*q*/, const VectorXd& /*by_state*/, const VectorXd& /*z*/,
                            const VectorXd& /*gradient*/, Gradient& /*out*/) const {}

    /// Moves its nodes in q along z, all coordinates.
    virtual void advance(VectorXd& q, const VectorXd& z) const = 0;

    /// A start, where the caller says where the vertices are: nodes of its own join them, and what rounding left of
    /// the vertices' order is mended. With the velocities v of the vertices those of all its nodes.
    virtual void settle(VectorXd& q, VectorXd* v) const = 0;

    /// From gradients by what settle makes, at a settled q, to those by what it is given, and by values; v and by_v may be
    /// empty.
    virtual void settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                            Gradient& out) const = 0;

    /// What the rounding of coordinates that are read off nodes moves its nodes by at q [m], over the machine's epsilon,
    /// where they are placed anew: more than their own rounding where arms are long. One number a node.
    virtual VectorXd rounding(const VectorXd& q) const = 0;

    /// Its nodes' rows of a vector of all unknowns, and back.
    VectorXd gather(const VectorXd& full) const {
        VectorXd own(3 * nodes_.size());
        for (std::size_t k = 0; k < nodes_.size(); ++k)
            own.segment<3>(3 * k) = full.segment<3>(3 * nodes_[k]);
        return own;
    }
    void scatter(const VectorXd& own, VectorXd& full) const {
        for (std::size_t k = 0; k < nodes_.size(); ++k)
            full.segment<3>(3 * nodes_[k]) = own.segment<3>(3 * k);
    }

  private:
    std::vector<Index> nodes_;
};

}  // namespace magshell
