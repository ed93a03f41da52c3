// Sums over the points of two near elements of an OwnField (energy/own_field.h), for numbers and for dual numbers:
//
//   G = sum_ij w_i w_j / |p_i - p_j|,     p_i = sum_k u_ik x_k + zeta_i h n                                       [1/m]
//
// The points of an element share its charge and current, so that one G with its derivatives serves the pair in both directions.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/vector3.h"
#include "magshell/energy/own_field_pairs.h"
#include "magshell/energy/simd_dual.h"

namespace magshell {
namespace own_field {

inline SimdDual inverse_root(const SimdDual& a) {
    const SimdDouble root = magshell::inverse_root(a.value);
    return {root, SimdDouble(-0.5) * (root * root * root) * a.rate};
}

inline constexpr int most_points = 16;  // of an element

/// The weights of the points of an element by component; lanes behind the last point have none.
struct PointWeights {
    int count = 0, n_nodes = 0;
    alignas(64) std::array<std::array<double, most_points>, 3> nodes{};  // u
    alignas(64) std::array<double, most_points> levels{}, weights{};     // zeta, w
};

/// The points of all elements by component; each element begins at a SIMD vector, and missing points are far away.
class PointArrays {
  public:
    PointArrays(std::size_t elements, int points, bool has_rates)
        // plain-words: ok, a stride between elements
        : stride_((points + SimdDouble::width - 1) / SimdDouble::width * SimdDouble::width) {
        for (int c = 0; c < 3; ++c) {
            values_[c].assign(elements * stride_, far_away);
            if (has_rates) rates_[c].assign(elements * stride_, 0.0);
        }
    }
    std::size_t stride() const { return stride_; }  // plain-words: ok, between elements

    template <class T>
    void set(std::size_t element, std::size_t point, const Triple<T>& at) {
        const T* const given[3] = {&at.x, &at.y, &at.z};
        for (int c = 0; c < 3; ++c) {
            values_[c][element * stride_ + point] = value_of(*given[c]);
            if (!rates_[c].empty()) rates_[c][element * stride_ + point] = rate_of(*given[c]);
        }
    }
    const double* values(int component, std::size_t element) const {
        return values_[component].data() + element * stride_;
    }
    const double* rates(int component, std::size_t element) const {
        return rates_[component].empty() ? nullptr : rates_[component].data() + element * stride_;
    }

  private:
    std::size_t stride_;
    std::array<std::vector<double>, 3> values_, rates_;
};

/// G and its derivatives with respect to the nodes of both elements and to h n.
template <class T>
struct PairDerivatives {
    T value{};
    Triple<T> nodes[2][3], levels[2];
};

/// The sums of a pair of which one is a triangle; those of edges are in energy/own_field_edge_pairs.h.
template <class T>
class PairMean {
  public:
    using Lanes = typename LanesOf<T>::Type;

    PairMean() {
        value_ = LanesOf<T>::zero();
        for (int side = 0; side < 2; ++side) {
            levels_[side] = none();
            for (Triple<Lanes>& node : nodes_[side]) node = none();
        }
    }

    /// Adds `sign` times G over the points of a rule.
    void add(const PointArrays& points, std::size_t first, const PointWeights& of_first, std::size_t second,
             const PointWeights& of_second, double sign) {
        using Load = LanesOf<T>;
        constexpr int width = SimdDouble::width, most_vectors = most_points / width;
        const int vectors = static_cast<int>(points.stride()) / width;
        const auto from = [&](int component, std::size_t element, std::size_t k, const auto& read) {
            const double* const rates = points.rates(component, element);
            return read(points.values(component, element) + k, rates ? rates + k : nullptr);
        };
        Triple<Lanes> at_second[most_vectors], forces[most_vectors];
        for (int v = 0; v < vectors; ++v) {
            const std::size_t k = static_cast<std::size_t>(v) * width;
            at_second[v] = {from(0, second, k, Load::load), from(1, second, k, Load::load),
                            from(2, second, k, Load::load)};
            forces[v] = none();
        }
        for (int i = 0; i < of_first.count; ++i) {
            const std::size_t k = static_cast<std::size_t>(i);
            const Triple<Lanes> at = {from(0, first, k, Load::broadcast), from(1, first, k, Load::broadcast),
                                      from(2, first, k, Load::broadcast)};
            const SimdDouble weight(sign * of_first.weights[i]);
            Triple<Lanes> total = none();
            for (int v = 0; v < vectors; ++v) {
                const Triple<Lanes> d = at - at_second[v];
                const Lanes inverse = inverse_root(dot(d, d));
                const SimdDouble both =
                    weight * LanesOf<double>::load(&of_second.weights[v * width], nullptr);
                const Lanes scaled = both * inverse;
                const Triple<Lanes> force = (scaled * (inverse * inverse)) * d;
                value_ += scaled;
                total += force;
                forces[v] += force;
            }
            for (int n = 0; n < of_first.n_nodes; ++n)
                add_scaled(SimdDouble(-of_first.nodes[n][i]), total, nodes_[0][n]);
            add_scaled(SimdDouble(-of_first.levels[i]), total, levels_[0]);
        }
        for (int v = 0; v < vectors; ++v) {
            for (int n = 0; n < of_second.n_nodes; ++n)
                add_scaled(LanesOf<double>::load(&of_second.nodes[n][v * width], nullptr), forces[v],
                           nodes_[1][n]);
            add_scaled(LanesOf<double>::load(&of_second.levels[v * width], nullptr), forces[v], levels_[1]);
        }
    }

    PairDerivatives<T> operator()() const {
        PairDerivatives<T> out{LanesOf<T>::sum(value_), {}, {}};
        for (int side = 0; side < 2; ++side) {
            for (int node = 0; node < 3; ++node) out.nodes[side][node] = sum(nodes_[side][node]);
            out.levels[side] = sum(levels_[side]);
        }
        return out;
    }

  private:
    static Triple<Lanes> none() { return {LanesOf<T>::zero(), LanesOf<T>::zero(), LanesOf<T>::zero()}; }
    static void add_scaled(const SimdDouble& factor, const Triple<Lanes>& more, Triple<Lanes>& out) {
        out.x += factor * more.x;
        out.y += factor * more.y;
        out.z += factor * more.z;
    }
    static Triple<T> sum(const Triple<Lanes>& a) {
        return {LanesOf<T>::sum(a.x), LanesOf<T>::sum(a.y), LanesOf<T>::sum(a.z)};
    }

    Lanes value_;
    Triple<Lanes> nodes_[2][3], levels_[2];
};

}  // namespace own_field
}  // namespace magshell
