// The bending energy of a sheet of six-node faces: what the curvature inside a face makes (energy/bending_six.h), plus the
// turn and the rotation at two points of each edge (strain/fold_six.h).
//
// As for three nodes: folds are found once an edge, faces combine them, and the Hessian is the faces' J^T C J plus what is
// curved, each fold's and each face's own, times the moments.
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/six_node_shell.h"
#include "magshell/energy/bending_six.h"
#include "magshell/energy/grown_six.h"
#include "magshell/energy/six_node_face.h"
#include "magshell/strain/fold_six.h"
#include "magshell/term/elastic_term.h"
#include "magshell/term/sheet_growth.h"
#include "magshell/term/sheet_materials.h"

namespace magshell {

class BendingSixTerm final : public StrainScaffold<BendingSixTerm, 9> {
  public:
    BendingSixTerm(const SixNodeShell& sheet, Index body, const ChunkLoop& chunks, const Nodes& nodes,
                   const GrowthForm& growth, const SystemMatrix& matrix, Registry& registry);

    std::string_view name() const override { return "bending"; }
    Index body() const override { return body_; }
    bool set_values(const Values& values) override;
    bool varies() const override { return growth_.any(); }
    double length_scale() const override { return materials_.thinnest(); }
    double energy(const double* q, const Controls&) const override;
    void evaluate(const double* q, const Controls&, Residual& out) override;
    void prepare_assembly(const double* q, const Controls&) override;
    void assemble(const Chunk& chunk, const double* q, const Controls&, bool extrapolated_stress,
                  SystemMatrix& out) const override;
    void vjp(const double* q, const Controls&, const double* lambda, Gradient& out) override;
    bool add_projective_stiffness(NodeMatrix& out) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void add_forces(const Strains& stresses, Residual& out) override;
    void strains_vjp(const Strains& stresses, Gradient& out) const override;
    void count_rotations_from_rest(bool from_rest) override;
    void rotations_from_sides(VectorXd& motion) const override;
    void forces_from_rest(VectorXd& forces) const override;
    std::size_t bytes() const override;

    /// d at a state that is only looked at.
    Strains look(const double* q) const;
    const SixNodeFace& rest(Index face) const { return rest_[face]; }
    bool grows() const { return growth_.any(); }
    /// From what strains are measured.
    GrownSix grown(Index face) const {
        return {sheet_.rest[face], growth_.growth(face), growth_.curvature(face)};
    }

  private:
    friend class StrainScaffold<BendingSixTerm, 9>;
    // A fold at one of its points, at the last evaluated state.
    struct FoldState {
        double turn;                      // theta - theta~
        std::array<double, 27> gradient;  // by its nine nodes
        double rate;                      // of theta, along the last step that was asked for
    };
    using FoldStates = std::array<FoldState, 2>;
    // How a side of it turns about the edge: see FoldSix::sides.
    struct SideTurn {
        Vec3 along;
        double foot;
    };
    using SideTurns = std::array<std::array<SideTurn, 2>, 2>;  // at [point][on its right]
    struct FaceSlots {
        PairSlots<15> nodes;
        std::array<std::array<Index, 15>, 6> rotation_nodes;
        std::array<Index, 21> rotations;  // at lower_index(a, b)
    };

    template <class Body>
    void each_pack(const Body& body) const {
        loop_.each_pack(body);
    }
    /// theta - theta~ at both points of every fold.
    std::vector<std::array<double, 2>> turns_at(const double* q) const;
    FoldSix dihedral_angles_at(Index first, Index last, int point, const double* q) const;
    double angle_change(Index fold, int point, double angle) const;
    template <class Turn>
    void measure(Index pack, const double* q, const Turn& turn, Pack d[9]) const;
    void inside(Index pack, const double* q, Pack f[9]) const;
    Vec9 rest_angles(Index face) const;
    void grow();
    void add_growth_vjp(const double* q, const double* lambda, Gradient& out) const;
    GrownFace::ByNatural strains_by_growth(const GrownSix& face, Index number, const Vec9& by,
                                           const Vec9& inside) const;
    void begin_strains(const double* q) { store_folds(q); }
    void begin_rates(const double* p) { store_rates(p); }
    void strain(Index pack, const double* q, Pack d[9]) const;
    void rate(Index pack, const double* p, Pack d[9]) const;
    const Symmetric9& stiffness(Index pack) const { return stiffness_[pack]; }
    /// Of each fold at rest, at both points, how its angle goes with its nodes along a normal of both of its sides.
    std::vector<std::array<std::array<double, 9>, 2>> slopes_at_rest() const;
    void store_folds(const double* q);
    void store_rates(const double* p);
    double moment(const DihedralSixStencil& fold, int point, const Strains& stress) const;
    void assemble_faces(Index pack, const double* q, const Strains& stress, SystemMatrix& out) const;
    void assemble_from_rest(Index pack, const double* q, SystemMatrix& out) const;
    void add_held(Index pack, const Pack3 (&held)[3][2], const Pack sign[3], const Symmetric9& stiffness,
                  const SixNodeRows& stiff, SystemMatrix& out) const;
    void add_rotations(Index pack, int lane, const Pack sign[3], const Symmetric9& stiffness,
                       SystemMatrix& out) const;
    template <class Visit>
    void each_half_turn(const Visit& visit) const;
    void assemble_folds(Index first, Index last, const double* q, const Strains& stress,
                        SystemMatrix& out) const;

    const SixNodeShell& sheet_;
    const Index body_;
    const Nodes& nodes_;
    const Index first_scalar_;
    const ChunkLoop& chunks_;
    ElementLoop<6> loop_;
    SheetMaterials materials_;
    SheetGrowth growth_;
    std::vector<SixNodeFace> rest_;
    std::vector<BendingSix::Element> elements_;
    std::vector<std::array<Pack, 9>> rest_measures_;
    std::vector<Vec9> rest_inside_;  // a face, of the shape at rest, where anything grows
    std::vector<FaceSlots> face_slots_;
    std::vector<PairSlots<9>> fold_slots_;
    std::vector<Symmetric9> stiffness_;
    std::vector<FoldStates> folds_;
    std::vector<double> state_;  // the nodes at which all of this holds
    bool from_rest_ = false;
    std::vector<SideTurns> side_turns_;  // of each fold, where rotations count from rest
};

}  // namespace magshell
