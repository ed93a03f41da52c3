// The bending energy of a whole sheet, `hinge` and `midedge` alike: energy/bending.h over
// strain/fold_angle.h.
//
// Fold angles and their gradients are found once an edge; faces combine three of them. The Hessian is the
// faces' J^T C J, plus each fold's curvature times the moment of the faces beside it.
#pragma once

#include "magshell/assembly/strain_history.h"
#include "magshell/energy/bending.h"
#include "magshell/energy/material.h"
#include "magshell/strain/fold_angle.h"

namespace magshell {

class BendingTerm final : public ElasticTerm {
  public:
    BendingTerm(const Sheet& sheet, const Schedule& schedule, const SystemMatrix& matrix);

    /// One material a face in our numbering; one curvature scale an edge in the caller's, [Chen22] k_cur.
    void set_material(const std::vector<SheetMaterial>& materials, const VectorXd& curvature_scale);

    std::string_view name() const override { return "bending"; }
    bool driven() const override { return false; }
    double energy(const double* q, const Controls&) const override;
    void evaluate(const double* q, const Controls&, Residual& out) override;
    void assemble(const Part& part, const double* q, const Controls&, bool extrapolated_stress,
                  SystemMatrix& out) const override;
    void extrapolate(const double* p) override;
    void vjp(const double* q, const Controls&, const double* lambda, SceneGradient& out) override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void strains(const double* q, Strains& out) override;
    void strain_rates(const double* p, Strains& out) override;
    void stresses(const Strains& strains, Strains& out) const override;
    void add_forces(const Strains& stresses, Residual& out) override;
    std::size_t bytes() const override;

  private:
    // A fold at the last evaluated state.
    struct FoldState {
        double turn;          // theta - theta~
        double gradient[12];  // by its four nodes
        double rate;          // of theta, along the last extrapolated step
        double unused[2];     // two cache lines in all
    };
    struct FaceSlots {
        PairSlots<6> nodes;
        std::array<Index, 18> rotation_nodes;  // rotation i against node k, at 6 i + k
        std::array<Index, 6> rotations;        // rotations (i, j) at lower_index(i, j)
    };

    Index face_packs() const { return packs_for(sheet_.n_faces()); }
    template <class Body>
    void each_pack(const Body& body) const {
        schedule_.each([&](const Part& part) {
            for (Index pack = part.first_face / Pack::width; pack < packs_for(part.last_face); ++pack)
                body(pack);
        });
    }
    void strain(Index pack, const double* q, const double FoldState::* turn, Pack delta[3]) const;
    double moment(const FoldStencil& fold, const Strains& stress) const;
    void store_folds(const double* q);
    void store_rates(const double* p);
    Vec3 curvature_scales(Index face) const;
    void assemble_faces(Index pack, SystemMatrix& out) const;
    void assemble_folds(Index first, Index last, const double* q, const Strains& stress,
                        SystemMatrix& out) const;

    const Sheet& sheet_;
    const Schedule& schedule_;
    std::vector<FaceSlots> face_slots_;
    std::vector<PairSlots<4>> fold_slots_;
    std::vector<SheetMaterial> materials_;
    VectorXd curvature_scale_;
    std::vector<Symmetric3> stiffness_;
    Strains stress_, extrapolated_;
    std::vector<FoldState> folds_;
};

}  // namespace magshell
