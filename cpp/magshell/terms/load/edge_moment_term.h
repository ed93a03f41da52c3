// EdgeMomentTerm: couples C [N m] on free boundary edges of a shell. Each rotates the director of its edge about the edge.
//
//   E = - factor C psi,   psi = theta_d - theta~_d - s phi                          [J]
//
// psi is the rotation of the director from the reference configuration. theta_d is the angle between the adjacent face and a fixed direction,
// theta~_d that angle in the reference configuration, and s phi the angle between the director and the face: phi is the rotation dof of the
// edge, s = 1 or -1 its sign. Without directors psi is the rotation of the face. factor is the load factor.
//
// The axis of the couple is the current edge, directed so that the shell is on its left. On an edge of a quadratic triangle the couple is
// divided between the two Gauss points of the edge.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/body/nodes.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/term.h"

namespace magshell {

class EdgeMomentTerm final : public Term, public RestShapeTerm {
  public:
    struct EdgeMoment {
        // On a linear triangle: start and end of the edge, the third corner of the face, and the fixed direction. On a
        // quadratic triangle: the nodes of strain/dihedral_angle_six.h. Unused entries are -1.
        std::array<Index, 9> nodes;
        int point;             // Gauss point, 0 or 1; -1 on a linear triangle
        double rest_angle;     // theta~_d [rad]
        Index rotation;        // scalar dof of phi; -1 without directors
        double rotation_sign;  // s
        Index row;             // index of the caller's couple
        double share = 1.0;    // fraction of the caller's couple that acts here
        // The derivative of `share` by the rest positions of nodes 0, 1 and 2.
        std::array<Vec3, 3> share_by_rest = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
        double couple = 0.0;  // C [N m], that fraction
    };
    using Nine = std::array<SimdVec3, 9>;

    /// Returns theta_d at q [rad], between -pi and pi.
    static double angle(const EdgeMoment& couple, const double* q);
    /// Returns the derivatives of theta_d by the nodes, in lane 0.
    static Nine gradient(const EdgeMoment& couple, const double* q);

    /// Creates the term. rows: number of couples of the caller; `couples` has one entry for each, or two on quadratic triangles.
    EdgeMomentTerm(const Nodes& nodes, const SystemMatrix& matrix, std::vector<EdgeMoment> couples,
                   Index rows, Registry& registry);

    std::string_view name() const override { return "couple"; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    /// On quadratic triangles the fractions of the Gauss points depend on the lengths at rest.
    void add_rest_vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                      VectorXd& out) override;
    std::vector<double> angle_branches() const override { return unwrapped_angles_; }
    void set_angle_branches(const std::vector<double>& angle_branches) override {
        unwrapped_angles_ = angle_branches;
    }
    std::size_t bytes() const override { return bytes_of(couples_) + bytes_of(slots_); }

  private:
    /// Returns theta_d - theta~_d of the k-th entry, with as many full turns as make it nearest to its value at the last evaluated state.
    double unwrapped_angle(const double* q, std::size_t k) const;
    /// Returns d psi/dq . lambda.
    double rotation_rate(const EdgeMoment& couple, const double* q, const double* lambda) const;

    const Index first_scalar_;
    ParameterSlice slice_, factor_;
    std::vector<EdgeMoment> couples_;
    std::vector<PairSlots<9>> slots_;
    // theta_d - theta~_d of each entry at the last evaluated state, full turns included.
    std::vector<double> unwrapped_angles_;
};

}  // namespace magshell
