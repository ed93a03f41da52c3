// TorqueTerm: prescribed moments on links: m on one link and -m on another, such as the two of a ball joint, or m on one alone. m is given
// in world axes and does not rotate with the links. Such a moment has no potential, so its tangent has a nonsymmetric part.
//
// It acts as forces on the four corners of the tetrahedron that represents a link (dofs/rigid_nodes.h):
//
//   f_k = m x (x_k - c) / (8 l^2)
//
// c is the mean of the corners, and l the length of the link, sqrt(8) l an edge. As sum_k (x_k - c) (x_k - c)^T = 4 l^2 I, these forces
// have no resultant, and their moment is m.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/terms/term.h"

namespace magshell {

class TorqueTerm final : public Term {
  public:
    struct Input {
        std::string owner;
        const Index* parent;  // the four corners of the link; nullptr for none
        const Index* child;   // the four corners of the link
    };

    /// Registers the "torque" of every owner.
    TorqueTerm(std::string_view name, const std::vector<Input>& moments, const std::vector<Vec3>& rest,
               Registry& registry);

    std::string_view name() const override { return name_; }
    Capabilities capabilities() const override { return {.has_unsymmetric_tangent = true}; }
    bool set_values(const Values& values) override;
    bool depends_on_loads() const override { return false; }
    double energy(const double*, const LoadParameters&) const override { return 0.0; }
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void add_nonsymmetric_tangent(const double* q, const LoadParameters& load_parameters,
                                  NonsymmetricTangent& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    std::size_t bytes() const override { return sides_.capacity() * sizeof(Side); }

  private:
    struct Side {  // one of the two links
        std::array<Index, 4> corners;
        double sign;   // 1 for the child, -1 for the parent
        double share;  // 1/(8 l^2) [1/m2]
        ParameterSlice slice;
        Vec3 moment = Vec3::Zero();  // sign m / (8 l^2) [N/m]

        /// Returns x_k - c at q.
        std::array<Vec3, 4> arms(const double* q) const;
    };
    std::string_view name_;
    std::vector<Side> sides_;
};

}  // namespace magshell
