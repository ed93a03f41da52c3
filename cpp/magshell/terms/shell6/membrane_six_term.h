// MembraneSixTerm: the membrane energy of a shell of quadratic triangles, energy/membrane_six.h on every face.
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/six_node_shell.h"
#include "magshell/energy/grown_six.h"
#include "magshell/energy/membrane_six.h"
#include "magshell/energy/six_node_face.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/shell/elastic_term.h"
#include "magshell/terms/shell/shell_growth.h"
#include "magshell/terms/shell/shell_materials.h"

namespace magshell {

class MembraneSixTerm final : public StrainScaffold<MembraneSixTerm, 9>, public RestShapeTerm {
  public:
    MembraneSixTerm(const SixNodeShell& shell, Index body, const ColoredLoop& element_blocks,
                    const Nodes& nodes, const GrowthForm& growth, const SystemMatrix& matrix,
                    Registry& registry);

    std::string_view name() const override { return "membrane"; }
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

    /// Returns the strains d at q without changing the term.
    Strains strains_at(const double* q) const;
    const ShellMaterial& material(Index face) const { return materials_[face]; }

  private:
    friend class StrainScaffold<MembraneSixTerm, 9>;
    template <class Body>
    void each_group(const Body& body) const {
        loop_.each_group(body);
    }
    GrownSix grown(Index face) const;
    void grow();
    // Adds the gradient with respect to rest positions from that with respect to the natural measures.
    void add_rest_measures_vjp(const Strains& by_measures, VectorXd& out) const;
    void begin_strains(const double*) {}
    void begin_rates(const double*) {}
    void strain(Index group, const double* q, SimdDouble d[9]) const;
    void rate(Index group, const double* p, SimdDouble d[9]) const;
    const Symmetric9& stiffness(Index group) const { return stiffness_[group]; }

    const SixNodeShell& shell_;
    const Index body_, nodes_;
    ElementLoop<6> loop_;
    ShellMaterials materials_;
    ShellGrowth growth_;
    std::vector<SixNodeFace> rest_;
    std::vector<std::array<SimdDouble, 9>> rest_measures_;
    std::vector<Symmetric9> stiffness_;
    std::vector<double> state_;  // positions of the last evaluated state
};

}  // namespace magshell
