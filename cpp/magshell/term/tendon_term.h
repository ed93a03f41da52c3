// Strings through points that ride on nodes, x_p = sum_j w_j x_j, free of friction: what counts is their length alone.
//
//   L = sum_i |x_{i+1} - x_i|,     E = T L + k/s S(L - s r)                                                         [J]
//
// with a tension T [N], a stiffness k [N/m] beyond the length r [m] at which it is slack, S of energy/contact.h, and s the
// share of r that a string is of its tendon: 1 where the tendon slides, else one string a segment. The part of the Hessian
// that couples all nodes of a string, k/s S'' dL/dx dL/dx^T, is of rank one: it never enters the matrix.
#pragma once

#include <string>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/term/low_rank_term.h"

namespace magshell {

/// A point that rides on the caller's vertices.
struct EmbeddedPoint {
    std::vector<Index> vertices;
    std::vector<double> weights;
};

struct TendonInput {
    std::string owner;  // under which its numbers are registered
    std::vector<EmbeddedPoint> points;
    /// Whether each segment is a string of its own, and then its share of the length at rest, one a segment.
    bool slides = true;
    std::vector<double> shares;
};

class TendonTerm final : public LowRankTerm {
  public:
    TendonTerm(const std::vector<TendonInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
               Registry& registry);

    std::string_view name() const override { return "tendons"; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const Controls& controls) const override;
    void evaluate(const double* q, const Controls& controls, Residual& out) override;
    void finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const override;
    void add_low_rank(const Controls& controls, LowRank& out) const override;
    void extrapolate(const double* p) override;
    void add_cancelling_here(VectorXd& out) const override;
    void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) override;
    std::size_t bytes() const override;

  private:
    struct Segment {
        std::vector<Index> places;              // among the nodes of its string
        std::vector<double> weights;            // of these in x_b - x_a
        std::vector<SystemMatrix::Slot> pairs;  // at lower_index(row - 1, column)
        double softening;                       // [m], below which its length is no longer that of a line
    };
    struct String {
        Index tendon;
        double share;
        std::vector<Index> nodes;
        std::vector<Segment> segments;
        // At the last evaluated state.
        double length = 0.0, tension = 0.0, stiffness = 0.0, extrapolated = 0.0;
        std::vector<Vec3> slopes;  // dL/dx

        Vec3 span(const Segment& segment, const double* q) const;
        double length_at(const double* q) const;
        double along(const double* p) const;
    };
    static constexpr int n_numbers = 4;
    struct Tendon {
        std::array<Slot, n_numbers> slots;
        std::array<double, n_numbers> numbers{};  // T, k, r, smoothing
    };
    /// Energy, dE/dL, d2E/dL2, and dE/dL by the numbers of its tendon.
    struct Pull {
        double energy, tension, stiffness = 0.0;
        std::array<double, n_numbers> tension_by{};
        Pull(const std::array<double, n_numbers>& numbers, double share, double length);
    };

    void add_string(Index tendon, double share, const EmbeddedPoint* first, std::size_t points,
                    const Nodes& nodes, const SystemMatrix& matrix);

    Slot factor_;
    std::vector<Tendon> tendons_;
    std::vector<String> strings_;
    double factor_now_ = 0.0;  // at the last evaluated state
};

}  // namespace magshell
