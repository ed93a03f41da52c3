// CreaseTerm: torsional springs along edges of a shell, the fold lines of origami.
//
//   E = 1/2 k L (theta - theta_r)^2                                                                              [J]
//
// with the stiffness k per length [N m/(rad m)], the length L of the edge at rest [m], the dihedral angle theta [rad] of
// strain/dihedral_angle.h with its full turns, and its value theta_r without moment.
#pragma once

#include <optional>
#include <vector>

#include "magshell/assembly/lanes.h"
#include "magshell/body/nodes.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/shell/crease_input.h"
#include "magshell/terms/stress_rate_term.h"
#include "magshell/terms/term.h"

namespace magshell {

class CreaseTerm final : public Term, public RestShapeTerm, public StressRateTerm {
  public:
    CreaseTerm(const std::vector<CreaseInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
               Registry& registry);

    std::string_view name() const override { return "creases"; }
    Capabilities capabilities() const override { return {.has_psd_projection = true}; }
    bool depends_on_loads() const override { return false; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void set_psd_projection(bool project_psd) override { psd_projection_ = project_psd; }
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override;
    void freeze_stress_rates(const double* p) override;
    void release_stresses() override { frozen_.reset(); }
    bool has_stress_work_vjp() const override { return true; }
    Strains strain_rates(const double* p) override;
    void add_stress_work_vjp(const double* q, const Strains& curvatures, Residual& by_q, Gradient& out,
                             VectorXd* by_rest) override;
    std::vector<double> angle_branches() const override { return unwrapped_angles_; }
    void set_angle_branches(const std::vector<double>& angle_branches) override {
        unwrapped_angles_ = angle_branches;
    }
    bool add_projective_stiffness(NodeMatrix&) const override { return false; }
    /// The moment k L (theta - theta_r) [N m] of an edge, between two nodes.
    struct Moment {
        Index start, end;
        double moment;
    };
    std::vector<Moment> moments(const double* q) const;
    std::size_t bytes() const override {
        return bytes_of(edges_) + bytes_of(unwrapped_angles_) + bytes_of(state_);
    }

  private:
    struct Edge {
        std::array<Index, 4> nodes;
        PairSlots<4> slots;
        double length;  // L [m]
        ParameterSlice stiffness_of,
            angle_of;          // angle_of has no rows if theta_r is that of the reference shape
        Index row;             // among the edges of its crease
        double reach, height;  // [m] largest coordinate at rest, least height of its faces
        double stiffness = 0.0, rest_angle = 0.0;  // k L [N m], theta_r
        Index row_of(const ParameterSlice& slice) const { return slice.rows > 1 ? row : 0; }
    };
    /// Returns the rate of the angle of an edge at q along lambda.
    static double rate(const Edge& edge, const double* q, const double* lambda);
    /// Returns theta - theta_r at the last evaluated state, or the rate of theta that is held.
    double turned(std::size_t k) const {
        return frozen_ ? frozen_->number(static_cast<Index>(k), 0)
                       : unwrapped_angles_[k] - edges_[k].rest_angle;
    }
    /// Returns theta at q with as many full turns as make it nearest to its value at the last evaluated state.
    double unwrapped_angle(const double* q, std::size_t k) const;

    const Nodes& nodes_;
    std::vector<Edge> edges_;
    std::vector<double> unwrapped_angles_;  // of each edge at the last evaluated state
    std::vector<double> state_;             // positions there
    std::optional<Strains> frozen_;         // rates of theta while moments are held at their rates
    bool psd_projection_ = false;
};

}  // namespace magshell
