// MagneticSixTerm: the magnetic energy of a shell of quadratic triangles. energy/magnetic_six.h on every face,
// with the field sampled at its six points.
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/six_node_shell.h"
#include "magshell/energy/magnetic_six.h"
#include "magshell/terms/magnetic/field_groups.h"
#include "magshell/terms/magnetic/total_applied_field.h"
#include "magshell/terms/term.h"

namespace magshell {

class MagneticSixTerm final : public Term {
  public:
    /// Creates the term; the sources must outlive it.
    MagneticSixTerm(const SixNodeShell& sheet, Index body, const ColoredLoop& element_blocks,
                    const SystemMatrix& matrix, const FieldSources& sources, Registry& registry);

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
    std::size_t bytes() const override;

  private:
    static constexpr int points = MagneticSix::points;
    struct Points {
        MagneticSix::Element at[points];
    };
    using Fields = PointFields<points>;

    /// Returns the matrix (a~_1, a~_2, n~) at a point of a face.
    Mat3 rest_frame(Index face, int point) const;
    /// Computes the positions [m] and magnetizations [A/m] of all points, face by face.
    void find_points(const double* q, std::vector<Vec3>& places, std::vector<Vec3>& magnetizations) const;
    /// Returns the applied field at all points in SIMD vectors; empty in a uniform field. Order as in
    /// AppliedField::add_samples.
    std::vector<Fields> sample(const double* q, const LoadParameters& load_parameters, int order) const;

    const SixNodeShell& sheet_;
    const Index body_;
    const ElementLoop<6> loop_;
    const TotalAppliedField field_;
    ParameterSlice magnetization_, thickness_;  // values
    std::vector<double> thicknesses_;
    std::vector<Points> elements_;
    std::vector<Fields> fields_;  // sampled for the current assembly; empty in a uniform field
    bool normal_magnetization_ = false;
};

}  // namespace magshell
