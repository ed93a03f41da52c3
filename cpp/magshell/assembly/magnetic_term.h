// The magnetic energy of a whole sheet, in a uniform applied flux density and any number of field sources.
//
// Where the field is uniform nothing is sampled; where no face is magnetized along its normal as well, the force does
// not depend on the deformation and there is no Hessian to add.
#pragma once

#include <memory>

#include "magshell/assembly/face_loop.h"
#include "magshell/energy/magnetic.h"
#include "magshell/field/applied_field.h"

namespace magshell {

class MagneticTerm final : public Term {
  public:
    MagneticTerm(const Sheet& sheet, const FaceLoop& loop);

    /// Remanent magnetization [A/m] in world axes at rest and thickness [m], one a face, in our numbering.
    void set_magnetization(const std::vector<Vec3>& remanent_magnetization, const std::vector<double>& thickness);

    void set_sources(std::vector<std::shared_ptr<const AppliedField>> sources) { sources_ = std::move(sources); }

    std::string_view name() const override { return Magnetic::name; }
    double energy(const double* q, const Controls& controls) const override;
    void evaluate(const double* q, const Controls& controls, Residual& out) override;
    void prepare_assembly(const double* q, const Controls& controls) override;
    void assemble(const Part& part, const double* q, const Controls& controls, bool, SystemMatrix& out) const override;
    void vjp(const double* q, const Controls& controls, const double* lambda, SceneGradient& out) override;
    std::size_t bytes() const override;

  private:
    bool sampled(const Controls& controls) const { return !sources_.empty() && controls.field != 0.0; }
    /// The barycentres and the magnetizations [A/m] there, by face.
    void place(const double* q, std::vector<Vec3>& points, std::vector<Vec3>& magnetizations) const;
    /// The applied field at every barycentre, in packs. Order as in AppliedField::add_samples.
    std::vector<Magnetic::Field> sample(const double* q, const Controls& controls, int order) const;

    const Sheet& sheet_;
    const FaceLoop& loop_;
    std::vector<std::shared_ptr<const AppliedField>> sources_;
    std::vector<double> thickness_;
    std::vector<Magnetic::Element> elements_;
    std::vector<Magnetic::Field> fields_;  // sampled for the assembly at hand; empty in a uniform field
    bool normal_magnetization_ = false;
};

}  // namespace magshell
