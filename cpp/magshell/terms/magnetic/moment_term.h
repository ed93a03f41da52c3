// MomentTerm: rigid bodies with a magnetic moment of their own in the applied field.
//
//   E = - mu . B(p),   mu = R m = sum alpha_k x_k,   p = c + R (center - c~) = sum b_k x_k                      [J]
//
// with the weights alpha_k, b_k of the corners (corner_weights.h).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/terms/magnetic/applied_field_term.h"
#include "magshell/terms/magnetic/corner_weights.h"
#include "magshell/terms/magnetic/total_applied_field.h"

namespace magshell {

class MomentTerm final : public AppliedFieldTerm {
  public:
    struct Magnet {
        std::string owner;
        std::array<Index, 4> corners;
    };

    /// Registers "magnetic_moment" and "center" of every owner. The sources must outlive the term.
    MomentTerm(const std::vector<Magnet>& magnets, const Nodes& nodes, const FieldSources& sources,
               const SystemMatrix& matrix, Registry& registry);

    std::string_view name() const override { return "moments"; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void add_moments(const double* q, const LoadParameters& load_parameters, std::vector<Vec3>& points,
                     std::vector<Vec3>& moments) const override;
    std::size_t bytes() const override { return element_blocks_.size() * sizeof(ElementBlock); }

  private:
    using Each = std::array<Vec3, 4>;
    struct ElementBlock {
        std::array<Index, 4> corners;
        CornerWeights weights;
        ParameterSlice moment, center;
        std::array<double, 4> alpha{}, b{};
        std::array<std::array<SystemMatrix::Slot, 4>, 4> slots;  // lower triangle
    };

    static Each at_corners(const ElementBlock& element_block, const double* from);
    static Vec3 sum(const std::array<double, 4>& weights, const Each& of);
    /// Returns the total field at the magnets, the uniform part included in `flux`, and adds the magnets' points
    /// and moments at q.
    FieldSamples sample(const double* q, const LoadParameters& load_parameters, int order,
                        std::vector<Vec3>& points, std::vector<Vec3>& moments) const;

    const TotalAppliedField field_;
    std::vector<ElementBlock> element_blocks_;
};

}  // namespace magshell
