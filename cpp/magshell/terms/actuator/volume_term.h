// VolumeTerm: energies of the volumes of cavities and pneumatic cells, which closed surfaces bound.
// energy/volume_form.h, energy/volume_law.h
//
//   g = E'(V) dV/dx,     H = E'(V) d2V/dx2 + E''(V) dV/dx dV/dx^T
//
// The last part couples all nodes of a surface. It goes into the sparse matrix if these nodes are coupled
// there, else into the low-rank part. In mixed Newton steps the pressure is an unknown of its own, condensed:
// the curvature uses the pressure at the end of the linearized step, without which a stiff liquid does not
// converge.
#pragma once

#include <string>
#include <vector>

#include "magshell/assembly/lanes.h"
#include "magshell/body/nodes.h"
#include "magshell/energy/volume_form.h"
#include "magshell/energy/volume_law.h"
#include "magshell/terms/low_rank_term.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/stress_rate_term.h"

namespace magshell {

/// A closed surface: the nodes of its faces in the caller's numbering of vertices, and one weight per face, -1
/// for a face of opposite orientation.
struct ClosedSurface {
    std::vector<Index> triangles, curved;  // three nodes per face; six nodes per face
    std::vector<double> weights, curved_weights;
};

/// Volumes under one law, each with one or two parameters.
struct VolumeInput {
    std::string owner;  // name under which the parameters are registered
    VolumeLaw law = VolumeLaw::pressure;
    bool stays_open = false;  // true: states without volume have no energy
    bool coupled = false;     // true: all nodes of a surface are coupled in the sparse matrix
    std::vector<ClosedSurface> surfaces;
};

class VolumeTerm final : public LowRankTerm, public RestShapeTerm, public StressRateTerm {
  public:
    VolumeTerm(const std::vector<VolumeInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
               Registry& registry);

    std::string_view name() const override { return "volume"; }
    bool set_values(const Values& values) override;
    Capabilities capabilities() const override;
    double max_step_length(const double* q, const double* p) const override;
    std::string invalid_state_reason(const double* q) const override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void add_low_rank(const LoadParameters& load_parameters, LowRank& out) const override;
    void extrapolate(const double* p) override;
    void add_cancelling_here(VectorXd& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void add_rest_vjp(const double*, const LoadParameters& load_parameters, const double* lambda,
                      VectorXd& out) override;
    /// Adds the rates of dE/dV to dE/dV, which depends on loads.
    void freeze_stress_rates(const double* p) override;
    void release_stresses() override { freeze_stress_rates(nullptr); }
    /// Returns true if all pressures are given, so that the rates are zero.
    bool has_stress_work_vjp() const override;
    std::size_t bytes() const override;

  private:
    template <int N>
    struct Face {
        std::array<Index, N> places;  // indices among the nodes of the surface
        PairSlots<N> slots;
        double weight;
    };
    struct Volume {
        std::vector<Index> nodes;
        std::vector<Face<3>> triangles;
        std::vector<Face<6>> curved;
        VolumeLaw law;
        std::array<ParameterSlice, 2> slots;
        Index row;
        bool stays_open;
        double rest = 0.0;  // [m3]
        std::vector<SystemMatrix::Slot>
            pairs;  // of all pairs of nodes, at lower_index(row - 1, column); empty: low rank
        std::array<double, 2> numbers{};
        // Values at the last evaluated state.
        double volume = 0.0, slope = 0.0, curvature = 0.0, magnitude = 0.0, extrapolated = 0.0;
        std::vector<Vec3> slopes;  // dV/dx
        double frozen_rate = 0.0;  // [Pa] of dE/dV, while stresses are held at their rates

        /// Returns the positions relative to the first node: the volume does not depend on the origin, and no
        /// digits are lost far from it.
        std::vector<Vec3> at(const double* q) const;
        std::vector<Vec3> at_rest(const Nodes& all) const;
        double volume_at(const std::vector<Vec3>& x) const;
        void add_slopes(const std::vector<Vec3>& x, std::vector<Vec3>& out) const;
        double along(const double* p) const;
    };

    void add(const VolumeInput& input, const ClosedSurface& surface, Index row,
             std::array<ParameterSlice, 2> slots, const Nodes& nodes, const SystemMatrix& matrix);
    void add_outer_product(const Volume& volume, double stiffness, SystemMatrix& out) const;

    const Nodes& nodes_;
    ParameterSlice factor_;
    std::vector<Volume> volumes_;
};

}  // namespace magshell
