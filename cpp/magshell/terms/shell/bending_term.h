// BendingTerm: the bending energy of a shell of linear triangles, for both `hinge` and `midedge` bending
// (energy/bending.h, strain/dihedral_angle.h).
//
// Dihedral angles and their gradients are computed once per edge; each face combines those of its three edges.
// The Hessian is J^T C J of each face, plus the second derivative of each dihedral angle times the moment at
// its edge.
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/shell.h"
#include "magshell/energy/bending.h"
#include "magshell/energy/grown_face.h"
#include "magshell/strain/dihedral_angle.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/shell/elastic_term.h"
#include "magshell/terms/shell/shell_growth.h"
#include "magshell/terms/shell/shell_materials.h"

namespace magshell {

class BendingTerm final : public StrainScaffold<BendingTerm>, public RestShapeTerm {
  public:
    BendingTerm(const Shell& shell, Index body, const ColoredLoop& element_blocks, const GrowthForm& growth,
                const Nodes& nodes, const SystemMatrix& matrix, Registry& registry);

    std::string_view name() const override { return "bending"; }
    Index body() const override { return body_; }
    bool set_values(const Values& values) override;
    bool varies() const override { return growth_.any(); }
    double length_scale() const override { return materials_.thinnest(); }
    double energy(const double* q, const LoadParameters&) const override;
    void evaluate(const double* q, const LoadParameters&, Residual& out) override;
    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters&,
                  bool extrapolated_stress, SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) override;
    bool add_projective_stiffness(NodeMatrix& out) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void add_forces(const Strains& stresses, Residual& out) override;
    void strains_vjp(const Strains& stresses, Gradient& out) const override;
    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override;
    void add_rest_strains_vjp(const Strains& stresses, VectorXd& out) const override;
    std::size_t bytes() const override;

    bool grows() const { return growth_.any(); }
    /// grown() returns the natural (stress-free) configuration of a face; natural_angle_changes() returns the
    /// angles [rad] of its edges there, relative to the reference shape.
    GrownFace grown(Index face) const {
        return {shell_.rest_corners(face), growth_.growth(face), growth_.curvature(face)};
    }
    Vec3 natural_angle_changes(Index face) const;
    /// Returns the stiffness of the bending strains of a face with a curvature scale of 1 [N m], and its curvature scales.
    Mat3 unscaled_stiffness(Index face) const { return rest_face(face).bending_stiffness(materials_[face]); }
    Vec3 scales_of(Index face) const;

  private:
    friend class StrainScaffold<BendingTerm>;
    struct FaceSlots {
        PairSlots<6> nodes;
        std::array<Index, 18> rotation_nodes;  // entry of rotation i and node k, at 6 i + k
        std::array<Index, 6> rotations;        // entry of rotations i and j, at lower_index(i, j)
    };

    using SidesOfGroup = std::array<const std::array<FaceSide, 3>*, SimdDouble::width>;
    SidesOfGroup sides_of(Index group) const {
        SidesOfGroup sides;
        for (int lane = 0; lane < SimdDouble::width; ++lane)
            sides[lane] = &shell_.sides[element_of(group, lane, shell_.n_faces())];
        return sides;
    }
    Index face_groups() const { return groups_for(shell_.n_faces()); }
    template <class Body>
    void each_group(const Body& body) const {
        element_blocks_.each(
            [&](const ElementBlock& element_block) { FaceLoop::over_groups(element_block, body); });
    }
    void edge_strains(Index group, const double* q, const std::vector<double>& changes,
                      SimdDouble delta[3]) const;
    void begin_strains(const double* q) { store_dihedrals(q); }
    void begin_rates(const double* p) { store_rates(p); }
    void strain(Index group, const double* q, SimdDouble d[3]) const {
        edge_strains(group, q, angle_changes_, d);
        if (natural_angles_.empty()) return;
        for (int i = 0; i < 3; ++i) d[i] -= natural_angles_[group][i];
    }
    void rate(Index group, const double* p, SimdDouble d[3]) const { edge_strains(group, p, rates_, d); }
    const Symmetric3& stiffness(Index group) const { return stiffness_[group]; }
    /// Returns the derivative of each reference dihedral angle with respect to its nodes along the mean normal
    /// of the two adjacent faces.
    std::vector<std::array<double, 4>> slopes_at_rest() const;
    double moment(const DihedralStencil& fold, const Strains& stress) const;
    void store_dihedrals(const double* q);
    void store_rates(const double* p);
    RestFace rest_face(Index face) const;
    Vec3 rest_angles(Index face) const;
    /// Averages a number per face and edge as the two adjacent faces share it. The operation is its own
    /// transpose.
    Vec3 shared(const std::vector<Vec3>& of_faces, Index face) const;
    void find_natural_angles();
    void add_natural_angles_vjp(const std::vector<Vec3>& by_angles, Gradient& out) const;
    // Gradients of lambda . g at the last evaluated state by the rest shape of a face: by a homogeneous deformation and by the growth
    // tensor in its plane, both through its stiffness, and by the angles from which its strains are measured.
    struct ByRestFace {
        Mat3 deformation, growth;
        Vec3 angles;
    };
    std::vector<ByRestFace> by_rest_faces(const double* q, const double* lambda);
    // Calls body(f, strains, rates, stress_rates) for each face, in parallel: the strains at q, and the rates of strains and stresses along
    // lambda, whose rates of the dihedral angles store_rates() has stored.
    template <class Body>
    void each_face(const double* q, const double* lambda, const Body& body);
    // Adds the gradient with respect to rest positions through the angles from which strains are measured, from that with respect to these
    // angles of each face.
    void add_rest_angles_vjp(std::vector<Vec3> by_angles, VectorXd& out) const;
    void assemble_faces(Index group, SystemMatrix& out) const;
    void assemble_dihedrals(Index first, Index last, const double* q, const Strains& stress,
                            SystemMatrix& out) const;

    const Shell& shell_;
    const Index body_;
    const ColoredLoop& element_blocks_;
    const Nodes& nodes_;
    const Index first_scalar_;
    ShellMaterials materials_;
    ShellGrowth growth_;
    ParameterSlice curvature_scale_;
    LargeVector<FaceSlots> face_slots_;
    LargeVector<PairSlots<4>> fold_slots_;
    VectorXd curvature_scales_;  // one per edge, [Chen22] k_cur
    LargeVector<Symmetric3> stiffness_;
    // natural_angle_changes() of each SIMD vector, where anything grows
    std::vector<std::array<SimdDouble, 3>> natural_angles_;
    // For each dihedral stencil at the last evaluated state: theta - theta~, the rate of theta along the last
    // extrapolated step, and its gradient with respect to the four nodes.
    std::vector<double> angle_changes_, rates_;
    LargeVector<std::array<double, 12>> gradients_;
};

}  // namespace magshell
