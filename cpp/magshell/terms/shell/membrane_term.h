// MembraneTerm: the membrane energy of a shell of linear triangles; energy/membrane.h has the formula for one triangle.
//
// A "face" below is a triangle of body/membrane_faces.h. Most of these are faces of the shell. Where an obtuse face was cut along the other
// diagonal together with its neighbour, a triangle consists of parts of two faces and has the mean of their materials and growth,
// weighted by the fractions of its parts.
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/membrane_faces.h"
#include "magshell/energy/grown_face.h"
#include "magshell/energy/membrane.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/shell/elastic_term.h"
#include "magshell/terms/shell/shell_growth.h"
#include "magshell/terms/shell/shell_materials.h"

namespace magshell {

class MembraneTerm final : public StrainScaffold<MembraneTerm>, public RestShapeTerm {
  public:
    /// Creates the term. `loop` must iterate over the corners of `faces`.
    MembraneTerm(const Surface& surface, Index body, const MembraneFaces& faces, const FaceLoop& loop,
                 const GrowthForm& growth, const Nodes& nodes, Registry& registry);

    std::string_view name() const override { return Membrane::name; }
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
    /// Returns the natural (stress-free) configuration of a face, from which strains are measured.
    GrownFace grown(Index face) const;

  private:
    friend class StrainScaffold<MembraneTerm>;
    template <class Body>
    void each_group(const Body& body) const {
        loop_.each_group(body);
    }
    void begin_strains(const double*) {}
    void begin_rates(const double*) {}
    void strain(Index group, const double* q, SimdDouble d[3]) const;
    void rate(Index group, const double* p, SimdDouble d[3]) const;
    RestFace rest_face(Index face) const;
    Mat3 mean_growth(Index face) const;
    // Derivatives with respect to the shape of a triangle, in world axes: by a homogeneous deformation at rest, and by the growth tensor in
    // its plane.
    struct ByFace {
        Mat3 deformation, growth;
    };
    // Return the derivatives with respect to the shape of each triangle: of lambda . g at the last evaluated state, and of the strains
    // times stresses.
    std::vector<ByFace> by_shape(const double* q, const double* lambda) const;
    std::vector<ByFace> strains_by_shape(const Strains& stresses) const;
    template <class ByGrowth>
    ByFace by_face(const GrownFace& own, const ByGrowth& by_growth_of) const;
    void add_by_shape(const std::vector<ByFace>& by_faces, std::vector<double> by_first, VectorXd& out) const;
    // Returns, for the triangles with parts of two faces, the derivative of lambda . g by the first part through the stiffness.
    std::vector<double> by_first_part(const double* q, const double* lambda) const;
    // Adds the gradient with respect to rest positions through the parts of two faces in a triangle, from the derivative with respect to
    // the first part.
    void add_parts_vjp(const std::vector<double>& by_first, VectorXd& out) const;
    void add_growth_vjp(const std::vector<ByFace>& by_faces, Gradient& out) const;
    const Symmetric3& stiffness(Index group) const { return elements_[group].stiffness; }

    const Surface& surface_;
    const Index body_;
    const MembraneFaces& faces_;
    const FaceLoop& loop_;
    const Index nodes_;
    ShellMaterials materials_;
    ShellGrowth growth_;
    LargeVector<Membrane::Element> elements_;
    std::vector<double> state_;  // positions of the last evaluated state
};

}  // namespace magshell
