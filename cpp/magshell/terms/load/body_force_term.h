// BodyForceTerm: forces at the centers of rigid bodies. A force is given in world axes and does not rotate with the body.
//
//   E = - f . p,   p = c + R (center - c~) = sum b_k x_k,   b_k = 1/4 + rho_k . (center - c~) / 4 l^2               [J]
//
// x_k are the four corners of the body (dofs/rigid_nodes.h), c their mean, rho_k their reference positions relative to the reference mean
// c~, and l the length of the body.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/terms/term.h"

namespace magshell {

class BodyForceTerm final : public Term {
  public:
    struct Input {
        std::string owner;
        const Index* corners;  // the four corners of the body
    };

    /// Registers "force" and "center" of every owner.
    BodyForceTerm(const std::vector<Input>& bodies, const std::vector<Vec3>& rest, Registry& registry);

    std::string_view name() const override { return "wrenches"; }
    bool set_values(const Values& values) override;
    bool depends_on_loads() const override { return false; }
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    std::size_t bytes() const override { return bodies_.capacity() * sizeof(Body); }

  private:
    struct Body {
        std::array<Index, 4> corners;
        Vec3 middle = Vec3::Zero();   // c~ [m]
        std::array<Vec3, 4> offsets;  // rho_k / 4 l^2 [1/m]
        ParameterSlice force, center;
        Vec3 f = Vec3::Zero();         // [N]
        std::array<double, 4> b = {};  // of each corner

        /// Returns sum b_k x_k of four of the rows.
        Vec3 at_center(const double* rows) const;
    };
    std::vector<Body> bodies_;
};

}  // namespace magshell
