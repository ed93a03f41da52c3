// TendonTerm: tendons, frictionless strings through points embedded in elements, x_p = sum_j w_j x_j. Their
// energy depends on their length only:
//
//   L = sum_i |x_{i+1} - x_i|,     E = T L + k/s S(L - s r)                                                         [J]
//
// with a tension T [N], a stiffness k [N/m] beyond the slack length r [m], and S of energy/contact.h. s is the
// fraction of r that belongs to the string: 1 where the tendon slides through its points, else each segment is
// a string of its own. The part of the Hessian that couples all nodes of a string, k/s S'' dL/dx dL/dx^T, has
// rank one and is kept out of the sparse matrix.
#pragma once

#include <string>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/terms/low_rank_term.h"
#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/stress_rate_term.h"

namespace magshell {

/// A point embedded in an element, as a weighted sum of the caller's vertices.
struct EmbeddedPoint {
    std::vector<Index> vertices;
    std::vector<double> weights;
};

struct TendonInput {
    std::string owner;  // name under which its parameters are registered
    std::vector<EmbeddedPoint> points;
    /// slides: false if each segment is a string of its own; `shares` then holds each segment's fraction of the
    /// reference length.
    bool slides = true;
    std::vector<double> shares;
};

class TendonTerm final : public LowRankTerm, public RestShapeTerm, public StressRateTerm {
  public:
    TendonTerm(const std::vector<TendonInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
               Registry& registry);

    std::string_view name() const override { return "tendons"; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void add_low_rank(const LoadParameters& load_parameters, LowRank& out) const override;
    void extrapolate(const double* p) override;
    void add_cancelling_here(VectorXd& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void add_rest_vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                      VectorXd& out) override;
    /// Adds the rates of the forces factor T to these forces, which depend on loads.
    void freeze_stress_rates(const double* p) override;
    void release_stresses() override { freeze_stress_rates(nullptr); }
    /// Returns true if no tendon is elastic, so that the rates are zero.
    bool has_stress_work_vjp() const override;
    std::size_t bytes() const override;

  private:
    struct Segment {
        std::vector<Index> places;              // indices among the nodes of the string
        std::vector<double> weights;            // weights of these nodes in x_b - x_a
        std::vector<SystemMatrix::Slot> pairs;  // at lower_index(row - 1, column)
        double softening;                       // [m] length below which the segment's length is smoothed
        Vec3 at_rest;                           // [m] x_b - x_a at rest
    };
    struct String {
        Index tendon;
        double share;
        std::vector<Index> nodes;
        std::vector<Segment> segments;
        // Values at the last evaluated state.
        double length = 0.0, tension = 0.0, stiffness = 0.0, extrapolated = 0.0;
        std::vector<Vec3> slopes;  // dL/dx
        double frozen_rate = 0.0;  // [N] of factor T, while stresses are held at their rates

        Vec3 span(const Segment& segment, const double* q) const;
        double length_at(const double* q) const;
        double along(const double* p) const;
    };
    static constexpr int n_numbers = 4;
    struct Tendon {
        std::array<ParameterSlice, n_numbers> slots;
        std::array<double, n_numbers> numbers{};  // T, k, r, smoothing
    };
    /// Energy of a string, dE/dL, d2E/dL2, and the derivatives of dE/dL by the tendon's parameters.
    struct Pull {
        double energy, tension, stiffness = 0.0;
        std::array<double, n_numbers> tension_by{};
        /// Returns the derivative of dE/dL by the share, with the numbers of the tendon.
        double tension_by_fraction(const std::array<double, n_numbers>& numbers, double share) const;
        Pull(const std::array<double, n_numbers>& numbers, double share, double length);
    };

    void add_string(Index tendon, double share, const EmbeddedPoint* first, std::size_t points,
                    const Nodes& nodes, const SystemMatrix& matrix);

    ParameterSlice factor_;
    std::vector<Tendon> tendons_;
    std::vector<String> strings_;
    double factor_now_ = 0.0;  // at the last evaluated state
};

}  // namespace magshell
