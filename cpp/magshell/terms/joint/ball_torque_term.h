// BallTorqueTerm: moments in ball joints about axes fixed in the world, m on the child link and -m on the
// parent. Such a moment has no potential, so its tangent has a nonsymmetric part.
//
//   f_k = m x (x_k - c)/(8 l^2)      force on corner k of a link's tetrahedron, as sum rho rho^T = 4 l^2 I
//
// c is the mean of the four corners and l a length of the tetrahedron (edges sqrt(8) l).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/terms/term.h"

namespace magshell {

class BallTorqueTerm final : public Term {
  public:
    struct Input {
        std::string owner;
        const Index* parent;  // four corners; nullptr for the world
        const Index* child;
    };

    BallTorqueTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest, Registry& registry);

    std::string_view name() const override { return "joints"; }
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
    struct Side {  // one of the two links of a joint
        std::array<Index, 4> corners;
        double sign, share;  // share: 1/(8 l^2)
        ParameterSlice slice;
        Vec3 moment = Vec3::Zero();

        std::array<Vec3, 4> arms(const double* q) const;
    };
    std::vector<Side> sides_;
};

}  // namespace magshell
