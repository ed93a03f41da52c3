// OwnFieldTerm: the energy of magnetized shells of linear triangles in the field that they make themselves (energy/own_field.h).
#pragma once

#include "magshell/body/nodes.h"
#include "magshell/body/surface.h"
#include "magshell/energy/magnetization_law.h"
#include "magshell/energy/own_field.h"
#include "magshell/terms/operator_term.h"

namespace magshell {

class OwnFieldTerm final : public OperatorTerm {
  public:
    struct Sheet {
        const Surface* surface;
        MagnetizationLaw law;
    };

    /// max_points: number of source points beyond which set_values() throws InvalidInput. accuracy: of the sums over many points, 0 if all
    /// are direct. The surfaces must outlive the term.
    OwnFieldTerm(std::vector<Sheet> sheets, Index max_points, double accuracy, Index n_dofs,
                 Registry& registry);

    std::string_view name() const override { return "own field"; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    std::shared_ptr<const HessianOperator> hessian_operator(
        const double* q, const LoadParameters& load_parameters) const override;
    bool add_projective_stiffness(NodeMatrix&) const override { return false; }
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    std::size_t bytes() const override { return field_.bytes() + sources_->bytes(); }

    /// Returns the own field of the present values.
    const OwnField& field() const { return *sources_; }
    /// Returns the energy of each surface in its own field alone [J].
    std::vector<double> own_energies(const double* q) const;

  private:
    const std::vector<Sheet> sheets_;
    const Index max_points_, n_dofs_;
    std::vector<ParameterSlice> magnetization_, thickness_;  // of each surface
    ParameterSlice factor_;
    std::vector<Vec3> magnetizations_;  // of all faces [A/m]
    std::vector<double> thicknesses_;   // [m]
    OwnField field_;                    // of all faces
    std::shared_ptr<const OwnField>
        sources_;  // of the edges with a source; shared with the Hessians of earlier solves, so it is replaced, never changed
};

}  // namespace magshell
