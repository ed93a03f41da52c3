// MuscleFibres: the fibres of a muscle in SIMD vectors, their law and parameters, as the energy term and the rate
// term of a muscle share them.
//
// Parameters: "fibres" (unit vector of each element in the reference configuration), "strength" w [Pa] of each
// element, and "activation" a of each segment, which its elements share. For a muscle with a force-velocity curve,
// make_muscle also adds "shortening_rate" [1/s], the rate at which a shortening fibre has no active tension.
//
// With the gradients g_k of the shape functions and the direction m of the fibres, alpha_k = g_k . m, so that
// F m = sum_k alpha_k x_k for the nodes x_k of an element (PushForward).
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "magshell/assembly/element_loop.h"
#include "magshell/body/fibres.h"
#include "magshell/core/parameters.h"
#include "magshell/energy/fibre.h"
#include "magshell/strain/tetrahedron.h"

namespace magshell {

/// A muscle as the caller describes it.
struct MuscleInput {
    std::string owner;  // name under which its parameters are registered
    Index solid = 0;
    std::vector<Index> elements;  // of the solid
    std::vector<Index> segments;  // segment of each element
    Index n_segments = 1;
    FibreLaw law;
};

/// Adds the nodal forces alpha_k pull of an integration point to g, or stores them there if it is the first point.
template <int N>
inline void add_pulls(const PushForward<N>& m, const SimdVec3& pull, bool first, SimdVec3 g[N]) {
    for (int k = 0; k < N; ++k) {
        const SimdVec3 share = m.alpha[k] * pull;
        g[k] = first ? share : g[k] + share;
    }
}

/// The blocks alpha_k alpha_l M of an integration point, in the form that add_blocks takes.
template <int N>
struct FibreTangent {
    const PushForward<N>& m;
    SimdMat3 stiffness;

    SimdMat3 block(int k, int l) const { return (m.alpha[k] * m.alpha[l]) * stiffness; }
};

template <class Element>
class MuscleFibres {
  public:
    static constexpr int N = Element::nodes, points = Element::points;
    using Nodes = std::array<Index, N>;

    struct Pieces {
        PushForward<N> m[points];
        SimdDouble volume[points];
        SimdDouble strength, activation;
    };

    MuscleFibres(const MuscleInput& input, const Fibres& fibres, const ColoredLoop& element_blocks,
                 const SystemMatrix& matrix, Registry& registry)
        : fibres(fibres),
          law(input.law),
          loop(nodes(fibres), element_blocks, matrix),
          directions(
              registry.values.add(input.owner, "fibres", "1", fibres.n_elements(), 3, &fibres.elements)),
          strength(
              registry.values.add(input.owner, "strength", "Pa", fibres.n_elements(), 1, &fibres.elements)),
          activation(registry.values.add(input.owner, "activation", "1", input.n_segments, 1)),
          pieces_(loop.groups()) {
        for (Index k = 0; k < fibres.n_elements(); ++k)
            segments_.push_back(input.segments[fibres.elements.user[k]]);
    }

    bool set_values(const Values& values) {
        const bool turned = values.changed(directions);
        const auto each_lane = [&](const auto& body) {
            for (Index group = 0; group < loop.groups(); ++group)
                for (int lane = 0; lane < SimdDouble::width; ++lane)
                    body(pieces_[group], lane, loop.element(group, lane));
        };
        if (turned)
            each_lane([&](Pieces& each, int lane, Index t) {
                const RestElement<Element> rest = rest_of(t);
                const Vec3 m = values.vector(directions, t);
                for (int p = 0; p < points; ++p) {
                    const Eigen::Matrix<double, N, 1> alpha = gradients(rest, p) * m;
                    each.volume[p].set(lane, rest.volume[p]);
                    for (int k = 0; k < N; ++k) each.m[p].alpha[k].set(lane, alpha[k]);
                }
            });
        if (values.changed(strength))
            each_lane([&](Pieces& each, int lane, Index t) {
                each.strength.set(lane, values.number(strength, t));
            });
        if (values.changed(activation))
            each_lane([&](Pieces& each, int lane, Index t) {
                each.activation.set(lane, values.number(activation, segments_[t]));
            });
        return turned || values.changed(strength, activation);
    }

    const Pieces& at(Index group) const { return pieces_[group]; }
    Index segment(Index element) const { return segments_[element]; }

    RestElement<Element> rest_of(Index element) const {
        Vec3 x[N];
        for (int k = 0; k < N; ++k) x[k] = fibres.rest(element, k);
        return RestElement<Element>(x);
    }

    // Returns the gradients g_k of a point's shape functions, one per row.
    static Eigen::Matrix<double, N, 3> gradients(const RestElement<Element>& rest, int p) {
        return Element::shape_derivatives(p) * rest.gradients[p];
    }

    /// Adds the gradient with respect to rest positions of a power at a point that is proportional to its volume and a function of F m, and of
    /// the like of other motions of the nodes. pulled: as Found::pulled, of all of these.
    void add_rest(Index group, int p, const SimdDouble& power, const SimdDouble pulled[N],
                  VectorXd& out) const {
        // A deformation I + H of the rest shape turns F m into F (I - H) m.
        for (int lane = 0; lane < loop.lanes_in(group); ++lane) {
            const Index t = loop.element(group, lane);
            const Eigen::Matrix<double, N, 3> g = gradients(rest_of(t), p);
            Vec3 direction = Vec3::Zero(), by_direction = direction;
            for (int k = 0; k < N; ++k) {
                direction += at(group).m[p].alpha[k][lane] * (fibres.rest(t, k) - fibres.rest(t, 0));
                by_direction += pulled[k][lane] * g.row(k).transpose();
            }
            const Mat3 by = power[lane] * Mat3::Identity() - by_direction * direction.transpose();
            for (int k = 0; k < N; ++k)
                out.segment<3>(3 * fibres.nodes_of(t)[k]) += by * g.row(k).transpose();
        }
    }

    std::size_t bytes() const { return loop.bytes() + bytes_of(pieces_) + bytes_of(segments_); }

    /// Gradients of an element with respect to its parameters. `pulled` is the part of each node in the gradient with respect to m, sum_k g_k pulled_k
    /// = F^T b, at each point, where b is the gradient with respect to F m.
    struct Found {
        SimdDouble strength{0.0}, activation{0.0};
        SimdDouble pulled[points][N];

        Found() {
            for (SimdDouble(&of_point)[N] : pulled) std::fill_n(of_point, N, SimdDouble(0.0));
        }
        /// Adds b = `by`, the gradient with respect to F m at a point; F is the deformation gradient of the nodes x.
        void add(int p, const SimdVec3 x[N], const SimdVec3& by) {
            for (int k = 0; k < N; ++k) pulled[p][k] += dot(x[k], by);
        }
    };

    class Gatherer {
      public:
        explicit Gatherer(const MuscleFibres& muscle) : muscle_(muscle) {
            by_direction_.resize(muscle.fibres.n_elements(), Vec3::Zero());
            by_strength_.resize(muscle.fibres.n_elements(), 0.0);
            by_activation_.resize(muscle.fibres.n_elements(), 0.0);
        }

        void take(Index group, const Found& found) {
            for (int lane = 0; lane < muscle_.loop.lanes_in(group); ++lane) {
                const Index t = muscle_.loop.element(group, lane);
                by_strength_[t] = found.strength[lane];
                by_activation_[t] = found.activation[lane];
                const RestElement<Element> rest = muscle_.rest_of(t);
                for (int p = 0; p < points; ++p) {
                    const Eigen::Matrix<double, N, 3> g = gradients(rest, p);
                    for (int k = 0; k < N; ++k)
                        by_direction_[t] += found.pulled[p][k][lane] * g.row(k).transpose();
                }
            }
        }

        void hand_over(Gradient& out) const {
            for (Index t = 0; t < muscle_.fibres.n_elements(); ++t) {
                out.values.segment<3>(muscle_.directions.at(t)) += by_direction_[t];
                out.values[muscle_.strength.at(t)] += by_strength_[t];
                out.values[muscle_.activation.at(muscle_.segment(t))] += by_activation_[t];
            }
        }

      private:
        const MuscleFibres& muscle_;
        std::vector<Vec3> by_direction_;
        std::vector<double> by_strength_, by_activation_;
    };

    const Fibres& fibres;
    const FibreLaw law;
    const ElementLoop<N> loop;
    const ParameterSlice directions, strength, activation;

  private:
    static const std::vector<Nodes>& nodes(const Fibres& fibres) {
        if constexpr (N == 4)
            return fibres.linear_nodes;
        else
            return fibres.quadratic_nodes;
    }

    std::vector<Pieces> pieces_;
    std::vector<Index> segments_;
};

}  // namespace magshell
