// Couples on free boundary edges, each turning the edge's director about the edge.
//
//   E = - factor C psi,   psi = theta_d - theta~_d - s phi                          [J]
//
// theta_d is the angle of the edge's face to a fixed direction, and the director stands off that face by s
// phi. The couple follows the edge: its axis is always the edge itself, the sheet to the left. On an edge of a six-node face
// it acts at its two Gauss points, where both the angle and phi are known.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/body/nodes.h"
#include "magshell/term/term.h"

namespace magshell {

class CoupleTerm final : public Term {
  public:
    struct Couple {
        // Edge from, to, the face's third corner, the direction; or those of strain/fold_six.h. Others are -1.
        std::array<Index, 9> nodes;
        int point;  // which of the two Gauss points; -1 on a face of three nodes
        double rest_angle;
        Index rotation;  // -1 without directors
        double rotation_sign;
        Index row;            // whose couple
        double share = 1.0;   // of it
        double couple = 0.0;  // that share [N m]
    };
    using Nine = std::array<Pack3, 9>;

    /// The angle to the direction where the nodes are at q, and its gradient by them.
    static double angle(const Couple& couple, const double* q);
    static Nine gradient(const Couple& couple, const double* q);

    /// rows: how many couples there are, each on one edge.
    CoupleTerm(const Nodes& nodes, const SystemMatrix& matrix, std::vector<Couple> couples, Index rows,
               Registry& registry);

    std::string_view name() const override { return "couple"; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const Controls& controls) const override;
    void evaluate(const double* q, const Controls& controls, Residual& out) override;
    void finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const override;
    void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) override;
    std::vector<double> angle_branches() const override { return last_turn_; }
    void set_angle_branches(const std::vector<double>& turns) override { last_turn_ = turns; }
    std::size_t bytes() const override { return bytes_of(couples_) + bytes_of(slots_); }

  private:
    double turn(const double* q, std::size_t k) const;

    const Index first_scalar_;
    Slot slot_, factor_;
    std::vector<Couple> couples_;
    std::vector<PairSlots<9>> slots_;
    std::vector<double>
        last_turn_;  // full circles count: an angle is taken as the one nearest to the last evaluated
};

}  // namespace magshell
