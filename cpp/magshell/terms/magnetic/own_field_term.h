// OwnFieldTerm: the energy of magnetized shells, solids and rigid bodies with a moment in the field that they make themselves
// (energy/own_field.h).
#pragma once

#include "magshell/body/nodes.h"
#include "magshell/energy/own_field.h"
#include "magshell/terms/magnetic/corner_weights.h"
#include "magshell/terms/magnetic/sheet_triangles.h"
#include "magshell/terms/magnetic/solid_triangles.h"
#include "magshell/terms/operator_term.h"
#include "magshell/terms/rest_shape_term.h"

namespace magshell {

class OwnFieldTerm final : public OperatorTerm, public RestShapeTerm {
  public:
    /// A rigid body with a moment, and all of its nodes, first the corners of its tetrahedron.
    struct Magnet {
        std::string owner;
        std::vector<Index> nodes;
    };
    struct Sources {
        std::vector<SheetTriangles> sheets;
        std::vector<MagnetizedSolid> solids;
        std::vector<Magnet> magnets;
    };

    /// max_points: number of source points beyond which set_values() throws InvalidInput. accuracy: of the sums over many points, 0 if all
    /// are direct. The surfaces and solids must outlive the term.
    OwnFieldTerm(Sources sources, Index max_points, double accuracy, const Nodes& nodes, Registry& registry);

    std::string_view name() const override { return "own field"; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    std::shared_ptr<const HessianOperator> hessian_operator(
        const double* q, const LoadParameters& load_parameters) const override;
    bool add_projective_stiffness(NodeMatrix&) const override { return false; }
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void add_rest_vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                      VectorXd& out) override;
    std::size_t bytes() const override { return field_.bytes() + sources_->bytes(); }

    /// Returns the own field of the present values.
    const OwnField& field() const { return *sources_; }
    /// Returns the energy of each surface and of each solid in its own field alone [J].
    std::vector<double> own_energies(const double* q) const;
    /// Returns the forces between near elements of the surfaces and solids, first of the surfaces.
    OwnField::GapForces gap_forces(const double* q) const;
    /// Returns the owners of the surfaces and solids.
    std::vector<std::string> owners() const;

  private:
    /// The own field at one state, which energy, forces and Hessian share.
    struct State {
        std::shared_ptr<const OwnField> sources;
        VectorXd q;
        OwnField::Neighbours near;
        double energy;                  // [J]
        std::vector<Vec3> by_position;  // [N]
    };
    /// A product of the Hessian for a factor of one, which vjp() has computed beside the derivatives by values.
    struct Product {
        VectorXd q, direction, image;
    };
    class Hessian;
    /// Returns the own field at q, which is kept until it is asked for at another state.
    std::shared_ptr<const State> state_at(const double* q) const;
    /// Adds the derivatives by the corners of the triangles of solids at rest.
    void add_triangles_rest_vjp(double factor, VectorXd& out) const;

    const std::vector<SheetTriangles> sheets_;
    const std::vector<MagnetizedSolid> solids_;
    const std::vector<Magnet> magnets_;
    std::vector<CornerWeights> corners_;  // of the magnets
    const Index max_points_, n_dofs_;
    std::vector<ParameterSlice> magnetization_, thickness_;  // of each surface
    std::vector<ParameterSlice> of_solids_;                  // magnetization of each solid
    std::vector<ParameterSlice> moment_, center_;            // of each magnet
    ParameterSlice factor_;
    std::vector<Vec3> magnetizations_;  // of all triangles of sheets [A/m]
    std::vector<double> thicknesses_;   // [m]
    std::vector<Vec3> of_tetrahedra_;   // magnetizations [A/m]
    OwnField field_;                    // of all faces and tetrahedra
    std::shared_ptr<const OwnField>
        sources_;  // of the elements with a source; shared with the Hessians of earlier solves, so it is replaced, never changed
    mutable std::shared_ptr<const State> state_;
    std::shared_ptr<const Product> product_;  // of the last vjp()
    OwnField::RestGradient by_rest_;          // of the last vjp()
};

}  // namespace magshell
