// BendingSixTerm: the bending energy of a shell of quadratic triangles. Its strains combine the curvature
// inside each face (energy/bending_six.h) with the dihedral angle and the director rotation at two Gauss points
// of each edge (strain/dihedral_angle_six.h).
//
// The structure is that of BendingTerm: dihedral angles are computed once per edge and combined by the faces;
// the Hessian is J^T C J of each face plus the second derivatives of its curvature and of each dihedral angle,
// scaled by the moments.
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/six_node_shell.h"
#include "magshell/energy/bending_six.h"
#include "magshell/energy/grown_six.h"
#include "magshell/energy/six_node_face.h"
#include "magshell/strain/dihedral_angle_six.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/shell/elastic_term.h"
#include "magshell/terms/shell/shell_growth.h"
#include "magshell/terms/shell/shell_materials.h"

namespace magshell {

class GrownSixRest;

class BendingSixTerm final : public StrainScaffold<BendingSixTerm, 9>, public RestShapeTerm {
  public:
    BendingSixTerm(const SixNodeShell& shell, Index body, const ColoredLoop& element_blocks,
                   const Nodes& nodes, const GrowthForm& growth, const SystemMatrix& matrix,
                   Registry& registry);

    std::string_view name() const override { return "bending"; }
    Index body() const override { return body_; }
    bool set_values(const Values& values) override;
    bool varies() const override { return growth_.any(); }
    double length_scale() const override { return materials_.thinnest(); }
    double energy(const double* q, const LoadParameters&) const override;
    void evaluate(const double* q, const LoadParameters&, Residual& out) override;
    void prepare_assembly(const double* q, const LoadParameters&) override;
    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters&,
                  bool extrapolated_stress, SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) override;
    bool add_projective_stiffness(NodeMatrix& out) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void add_forces(const Strains& stresses, Residual& out) override;
    void strains_vjp(const Strains& stresses, Gradient& out) const override;
    void count_rotations_from_rest(bool from_rest) override;
    void rotations_from_sides(VectorXd& motion) const override;
    void forces_from_rest(VectorXd& forces) const override;
    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override;
    void add_rest_strains_vjp(const Strains& by_strains, VectorXd& out) const override;
    std::size_t bytes() const override;

    /// Returns the strains d at q without changing the term.
    Strains strains_at(const double* q) const;
    const SixNodeFace& rest(Index face) const { return rest_[face]; }
    bool grows() const { return growth_.any(); }
    /// Returns the natural (stress-free) configuration of a face, from which strains are measured.
    GrownSix grown(Index face) const {
        return {shell_.rest[face], growth_.growth(face), growth_.curvature(face)};
    }

  private:
    friend class StrainScaffold<BendingSixTerm, 9>;
    // The dihedral angle at one Gauss point of an edge, at the last evaluated state.
    struct DihedralState {
        double angle_change;              // change of the dihedral angle, theta - theta~ [rad]
        std::array<double, 27> gradient;  // by the nine nodes of the stencil
        double rate;                      // of theta, along the last step of store_rates()
    };
    using DihedralStates = std::array<DihedralState, 2>;
    // The rotation of one adjacent face about the edge: see DihedralAngleSix::sides.
    struct SideRotation {
        Vec3 along;
        double foot;
    };
    using SideRotations = std::array<std::array<SideRotation, 2>, 2>;  // [point][0: left, 1: right]
    struct FaceSlots {
        PairSlots<15> nodes;
        std::array<std::array<Index, 15>, 6> rotation_nodes;
        std::array<Index, 21> rotations;  // at lower_index(a, b)
    };

    template <class Body>
    void each_group(const Body& body) const {
        loop_.each_group(body);
    }
    /// Returns theta - theta~ [rad] at both points of every dihedral stencil.
    std::vector<std::array<double, 2>> angle_changes_at(const double* q) const;
    /// Returns the angles at one point of dihedral stencils first to last - 1, in one SIMD vector.
    DihedralAngleSix dihedrals_at(Index first, Index last, int point, const double* q) const;
    /// Returns theta - theta~ [rad], from -pi to pi.
    double angle_change(Index fold, int point, double angle) const;
    /// Adds the strains of the edges of a SIMD vector of faces: from angle_of(stencil, point) and the rotations in q. Linear in both, so it
    /// computes rates as well.
    template <class AngleOf>
    void add_edge_strains(Index group, const double* q, const AngleOf& angle_of, SimdDouble d[9]) const;
    /// Computes the curvature measures inside the faces of a SIMD vector, relative to their natural values.
    void interior(Index group, const double* q, SimdDouble f[9]) const;
    /// Returns the weighted dihedral angles of the edges of a face in the reference shape, as they enter its strains.
    Vec9 rest_angles(Index face) const;
    /// Sets the natural configuration of all faces, from which strains are measured, after growth or curvature have changed.
    void set_natural_measures();
    void add_growth_vjp(const double* q, const double* lambda, Gradient& out) const;
    // Gradients with respect to the numbers that a face takes from its rest shape (SixNodeFace), and to the nodes of that shape.
    struct ByRestFace {
        std::array<double, 6> inverse_jacobian{};
        Vec9 scale = Vec9::Zero();
        std::array<Vec3, 6> nodes;
    };
    // Computes the gradient of by . d, with d the measures inside the faces of a SIMD vector. now: the shape of these faces at q.
    void strains_by_rest(Index group, const BendingSix& now, const SimdDouble by[9],
                         ByRestFace out[SimdDouble::width]) const;
    // rest: the face at rest, without growth.
    void add_rest_face(Index face, const SixNodeFace& rest, const ByRestFace& by, VectorXd& out) const;
    // The same for shells that grow: of lambda . g, and of by . d at the shapes `now` of a SIMD vector of faces at q.
    void add_grown_rest_vjp(const double* q, const double* lambda, VectorXd& out);
    void add_grown_strains_by_rest(Index group, const BendingSix& now, const Vec9 by[SimdDouble::width],
                                   GrownSixRest* const of_faces[SimdDouble::width], VectorXd& out) const;
    void add_rest_angles(const Strains& by_strains, VectorXd& out) const;
    Mat2 compliance_by_deformation(Index face, const GrownTriangle& triangle, const std::array<double, 3>& at,
                                   double weight, const Vec9& of_r, const Vec9& of_d) const;
    GrownFace::ByNatural strains_by_growth(const GrownSix& face, Index number, const Vec9& by,
                                           const Vec9& interior) const;
    // For StrainScaffold:
    void begin_strains(const double* q) { store_dihedrals(q); }
    void begin_rates(const double* p) { store_rates(p); }
    void strain(Index group, const double* q, SimdDouble d[9]) const;
    void rate(Index group, const double* p, SimdDouble d[9]) const;
    const Symmetric9& stiffness(Index group) const { return stiffness_[group]; }
    /// Returns the derivative of each reference dihedral angle, at both points, with respect to its nodes along
    /// the mean normal of the two sides.
    std::vector<std::array<std::array<double, 9>, 2>> slopes_at_rest() const;
    void store_dihedrals(const double* q);
    void store_rates(const double* p);
    double moment(const DihedralSixStencil& fold, int point, const Strains& stress) const;
    // The Hessian of the faces of a SIMD vector, without the second derivatives of dihedral angles; of dihedral stencils first to last - 1,
    // those second derivatives; and of faces at rest, with rotations measured from the reference orientation.
    void assemble_faces(Index group, const double* q, const Strains& stress, SystemMatrix& out) const;
    void assemble_from_rest(Index group, const double* q, SystemMatrix& out) const;
    // Adds the blocks with the directions across clamped edges, and those between the rotations of a face.
    void add_directions(Index group, const SimdVec3 (&directions)[3][2], const SimdDouble sign[3],
                        const Symmetric9& stiffness, const SixNodeRows& stiff, SystemMatrix& out) const;
    void add_rotations(Index group, int lane, const SimdDouble sign[3], const Symmetric9& stiffness,
                       SystemMatrix& out) const;
    template <class Visit>
    void each_half_rotation(const Visit& visit) const;
    void assemble_dihedrals(Index first, Index last, const double* q, const Strains& stress,
                            SystemMatrix& out) const;

    const SixNodeShell& shell_;
    const Index body_;
    const Nodes& nodes_;
    const Index first_scalar_;
    const ColoredLoop& element_blocks_;
    ElementLoop<6> loop_;
    ShellMaterials materials_;
    ShellGrowth growth_;
    std::vector<SixNodeFace> rest_;  // the natural configuration, by face
    std::vector<BendingSix::Element> elements_;
    std::vector<std::array<SimdDouble, 9>>
        rest_measures_;                     // natural values of the curvature measures, by SIMD vector
    std::vector<Vec9> reference_interior_;  // curvature measures of the reference shape, where anything grows
    std::vector<FaceSlots> face_slots_;
    std::vector<PairSlots<9>> dihedral_slots_;
    std::vector<Symmetric9> stiffness_;
    std::vector<DihedralStates> dihedrals_;
    std::vector<double> state_;  // the positions of the last evaluated state
    bool from_rest_ = false;     // whether rotations are measured from the reference orientation
    // for each edge, while rotations are measured from the reference orientation
    std::vector<SideRotations> side_rotations_;
};

}  // namespace magshell
