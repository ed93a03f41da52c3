// MagneticTerm: the magnetic energy of a shell of linear triangles in a uniform applied flux density and any
// number of field sources.
//
// In a uniform field nothing is sampled. If no face has a normal magnetization either, the force does not
// depend on the deformation, and there is no Hessian to add.
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/surface.h"
#include "magshell/energy/magnetic.h"
#include "magshell/terms/magnetic/total_applied_field.h"
#include "magshell/terms/term.h"

namespace magshell {

class MagneticTerm final : public Term {
  public:
    /// Creates the term; the sources must outlive it.
    MagneticTerm(const Surface& surface, Index body, const FaceLoop& loop, const FieldSources& sources,
                 Registry& registry);

    std::string_view name() const override { return Magnetic::name; }
    Index body() const override { return body_; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void prepare_assembly(const double* q, const LoadParameters& load_parameters) override;
    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters& load_parameters,
                  bool, SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    double field_sampling_error(const double* q, const LoadParameters& load_parameters,
                                double extent) override;
    std::size_t bytes() const override;

  private:
    /// Finds the face across each edge of every face, if it is not known yet.
    void find_neighbours();
    /// Computes the barycenters [m] of all faces and the magnetizations [A/m] there.
    void find_points(const double* q, std::vector<Vec3>& points, std::vector<Vec3>& magnetizations) const;
    /// Returns the applied field at every barycenter in SIMD vectors; empty in a uniform field. Order as in
    /// AppliedField::add_samples.
    std::vector<Magnetic::Field> sample(const double* q, const LoadParameters& load_parameters,
                                        int order) const;

    const Surface& surface_;
    const Index body_;
    const FaceLoop& loop_;
    const TotalAppliedField field_;
    ParameterSlice magnetization_, thickness_;  // values
    std::vector<double> thicknesses_;
    LargeVector<Magnetic::Element> elements_;
    std::vector<Magnetic::Field> fields_;  // sampled for the current assembly; empty in a uniform field
    std::vector<std::array<Index, 3>>
        neighbours_;  // across the edge opposite each corner, -1 for none; see find_neighbours
    bool normal_magnetization_ = false;
};

}  // namespace magshell
