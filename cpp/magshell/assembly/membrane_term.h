// The membrane energy of a whole sheet: energy/membrane.h on every face, and the stresses of the mixed
// Newton.
#pragma once

#include "magshell/assembly/face_loop.h"
#include "magshell/assembly/membrane_faces.h"
#include "magshell/assembly/strain_history.h"
#include "magshell/energy/material.h"
#include "magshell/energy/membrane.h"

namespace magshell {

class MembraneTerm final : public ElasticTerm {
  public:
    MembraneTerm(const Sheet& sheet, const MembraneFaces& faces, const FaceLoop& loop);

    /// One material a face, in our numbering.
    void set_material(const std::vector<SheetMaterial>& materials);

    std::string_view name() const override { return Membrane::name; }
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
    const Sheet& sheet_;
    const MembraneFaces& faces_;
    const FaceLoop& loop_;
    std::vector<SheetMaterial> materials_;
    std::vector<Membrane::Element> elements_;
    Strains stress_, extrapolated_;
    std::vector<double> state_;  // the nodes at which stress_ holds
};

}  // namespace magshell
