// EdgeMomentTerm: couples on free boundary edges of a shell, each rotating the edge's director about the edge.
//
//   E = - factor C psi,   psi = theta_d - theta~_d - s phi                          [J]
//
// theta_d is the angle between the adjacent face and a fixed direction; the director is at the angle s phi to
// that face. The couple follows the edge: its axis is the current edge, with the shell to the left. On an edge
// of a quadratic triangle it acts at the two Gauss points, where both the angle and phi are known.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/body/nodes.h"
#include "magshell/terms/term.h"

namespace magshell {

class EdgeMomentTerm final : public Term {
  public:
    struct EdgeMoment {
        // The nodes from and to of the edge, the third corner of the face, and the fixed direction; or the
        // nodes of strain/dihedral_angle_six.h. Unused entries are -1.
        std::array<Index, 9> nodes;
        int point;  // Gauss point, 0 or 1; -1 on a linear triangle
        double rest_angle;
        Index rotation;  // -1 without directors
        double rotation_sign;
        Index row;            // index of the couple in the caller's array
        double share = 1.0;   // fraction of that couple
        double couple = 0.0;  // the fraction's couple [N m]
    };
    using Nine = std::array<SimdVec3, 9>;

    /// angle() returns the angle [rad] between the face and the direction at q; gradient() its derivatives by
    /// the nodes.
    static double angle(const EdgeMoment& couple, const double* q);
    static Nine gradient(const EdgeMoment& couple, const double* q);

    /// Creates the term; rows is the number of couples, each on one edge.
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
    std::vector<double> angle_branches() const override { return unwrapped_angles_; }
    void set_angle_branches(const std::vector<double>& angle_branches) override {
        unwrapped_angles_ = angle_branches;
    }
    std::size_t bytes() const override { return bytes_of(couples_) + bytes_of(slots_); }

  private:
    double unwrapped_angle(const double* q, std::size_t k) const;

    const Index first_scalar_;
    ParameterSlice slice_, factor_;
    std::vector<EdgeMoment> couples_;
    std::vector<PairSlots<9>> slots_;
    std::vector<double>
        unwrapped_angles_;  // unwrapped angles: each is taken on the branch nearest to the last evaluated one
};

}  // namespace magshell
