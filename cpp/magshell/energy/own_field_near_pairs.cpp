#include "magshell/energy/own_field_near_pairs.h"

#include <algorithm>

#include "magshell/energy/own_field_edge_pairs.h"
#include "magshell/energy/own_field_geometry.h"

namespace magshell {

using namespace own_field;

namespace {

constexpr Index chunk = 2048;  // pairs whose derivatives are kept until they are added in order

// Sets the sums over the points of pairs of edges, the pairs with these numbers in a block.
template <class Value, class T>
void set_edge_means(const std::vector<EdgePose<T>>& poses, double unit, const std::array<Index, 2>* pairs,
                    const std::vector<Index>& numbers, PairDerivatives<T>* means) {
    using Means = EdgePairMeans<T, Value>;
    const Index count = static_cast<Index>(numbers.size());
    for (Index begin = 0; begin < count; begin += Means::width) {
        Means sums(unit);
        for (int lane = 0; lane < Means::width; ++lane) {  // the last pair again in lanes that are left
            const auto& [first, second] = pairs[numbers[std::min(begin + lane, count - 1)]];
            sums.set(lane, poses[first], poses[second]);
        }
        sums.add(coarse, -1.0);
        sums.add(fine, 1.0);
        for (Index k = begin; k < std::min(begin + Means::width, count); ++k)
            means[numbers[k]] = sums(static_cast<int>(k - begin));
    }
}

// Returns the largest rate of a coordinate, or one if all are zero.
template <class T>
double largest_rate(const std::vector<Triple<T>>& x) {
    double largest = 0.0;
    for (const Triple<T>& each : x) largest = std::max(largest, rates_of(each).cwiseAbs().maxCoeff());
    return largest > 0.0 ? largest : 1.0;
}

}  // namespace

// The energy of a near pair changes by
//
//   W mu_0/(4 pi) (Q Q' - I I' L . L') (G_fine - G_coarse),      L = x_b - x_a
//
// with the weight W of the distance of the middles.
template <class T>
void OwnField::add_near_pairs(const Geometry<T>& at, const Neighbours& near, Targets targets,
                              Evaluation<T>& out) const {
    if (near.elements.empty()) return;
    constexpr bool has_rates = std::is_same_v<T, Dual>;
    const Index n = target_elements(targets);
    const auto is_edge = [&](Index k) { return elements_[element_order_[k]].is_edge(); };
    std::vector<EdgePose<T>> poses(static_cast<std::size_t>(n));
    bool has_triangles = false;
    for (Index k = 0; k < n; ++k) {
        const Index e = element_order_[k];
        has_triangles |= !is_edge(k);
        if (is_edge(k))
            poses[k] = {at.middle(elements_[e]), at.along(elements_[e]),
                        T(element_thickness_[e]) * at.element_normals[e]};
    }
    const double unit = near.is_rough ? largest_rate(at.x) : 1.0;
    PointWeights weights[2][2];  // coarse, fine; of edges, of triangles
    const std::size_t with_points = has_triangles ? static_cast<std::size_t>(n) : 0;
    PointArrays points[2] = {{with_points, 4, has_rates}, {with_points, most_points, has_rates}};
    const GaussRule* const rules[2] = {&coarse, &fine};
    bool known[2] = {false, false};
    for (Index k = 0; k < n && has_triangles; ++k) {  // the weights, of one element of each kind
        const Index e = element_order_[k];
        const int kind = elements_[e].is_edge() ? 0 : 1;
        if (known[kind]) continue;
        known[kind] = true;
        for (int rule = 0; rule < 2; ++rule) {
            PointWeights& into = weights[rule][kind];
            into.n_nodes = elements_[e].n_nodes();
            at.each_point(e, *rules[rule], [&](const SourcePoint<T>&, const SamplePoint& sample) {
                for (int i = 0; i < 3; ++i) into.nodes[i][into.count] = sample.weights[i];
                into.levels[into.count] = sample.zeta;
                into.weights[into.count++] = sample.weight;
            });
        }
    }
    in_blocks(has_triangles ? n : 0, [&](Index first, Index last) {
        for (Index k = first; k < last; ++k)
            for (int rule = 0; rule < 2; ++rule) {
                std::size_t number = 0;
                at.each_point(element_order_[k], *rules[rule],
                              [&](const SourcePoint<T>& point, const SamplePoint&) {
                                  points[rule].set(static_cast<std::size_t>(k), number++, point.at);
                              });
            }
    });
    const auto mean_of = [&](const std::array<Index, 2>& pair) {
        const int kinds[2] = {is_edge(pair[0]) ? 0 : 1, is_edge(pair[1]) ? 0 : 1};
        PairMean<T> mean;
        for (int rule = 0; rule < 2; ++rule)
            mean.add(points[rule], pair[0], weights[rule][kinds[0]], pair[1], weights[rule][kinds[1]],
                     rule == 0 ? -1.0 : 1.0);
        return mean();
    };
    const auto add_pair = [&](const std::array<Index, 2>& pair, const PairDerivatives<T>& mean,
                              std::array<ElementAdjoint<T>, 2>& adjoints) {
        Index numbers[2];
        const Element* elements[2];
        Triple<T> lines[2];
        for (int side = 0; side < 2; ++side) {
            numbers[side] = element_order_[pair[side]];
            elements[side] = &elements_[numbers[side]];
            lines[side] = elements[side]->is_edge() ? at.along(*elements[side]) : Triple<T>();
        }
        const Triple<T> apart = at.middle(*elements[0]) - at.middle(*elements[1]);
        const T distance = norm(apart), longer = std::max(elements[0]->length, elements[1]->length);
        T weight, slope;
        lift(blend(of_elements, value_of(distance) / value_of(longer)), distance / longer, weight, slope);
        const T value = T(strength) * mean.value, scaled = weight * value, along = dot(lines[0], lines[1]);
        const T currents[2] = {at.element_currents[numbers[0]], at.element_currents[numbers[1]]};
        const T product = at.charges[numbers[0]] * at.charges[numbers[1]] - currents[0] * currents[1] * along;
        const T by_mean = T(strength) * weight * product;
        const Triple<T> by_middle = (product * value * slope / (distance * longer)) * apart;
        const T by_longer = -product * value * slope * distance / (longer * longer);
        const std::array<double, 2> parts = parts_of_larger(elements[0]->length, elements[1]->length);
        for (int side = 0; side < 2; ++side) {
            ElementAdjoint<T>& adjoint = adjoints[side];
            const int other = 1 - side;
            for (int k = 0; k < elements[side]->n_nodes(); ++k)
                adjoint.nodes[k] += by_mean * mean.nodes[side][k];
            at.add_by_middle(*elements[side], side == 0 ? by_middle : -by_middle, adjoint);
            adjoint.charge += scaled * at.charges[numbers[other]];
            adjoint.length += T(parts[side]) * by_longer;
            if (!elements[side]->is_edge()) continue;
            const Triple<T> by_level = by_mean * mean.levels[side];
            adjoint.normal += T(element_thickness_[numbers[side]]) * by_level;
            adjoint.thickness += dot(at.element_normals[numbers[side]], by_level);
            if (elements[other]->is_edge()) {
                adjoint.current -= scaled * currents[other] * along;
                const Triple<T> by_line = (-scaled * currents[0] * currents[1]) * lines[other];
                adjoint.nodes[0] -= by_line;
                adjoint.nodes[1] += by_line;
            }
        }
    };
    const Index n_pairs = static_cast<Index>(near.elements.size());
    std::vector<std::array<ElementAdjoint<T>, 2>> adjoints(std::min(chunk, n_pairs));
    for (Index begin = 0; begin < n_pairs; begin += chunk) {
        const Index count = std::min(chunk, n_pairs - begin);
        in_blocks(count, [&](Index first, Index last) {
            const std::array<Index, 2>* const pairs = near.elements.data() + begin + first;
            std::array<PairDerivatives<T>, block> means;
            std::vector<Index> edges;  // pairs of edges
            for (Index k = 0; k < last - first; ++k)
                if (is_edge(pairs[k][0]) && is_edge(pairs[k][1]))
                    edges.push_back(k);
                else
                    means[k] = mean_of(pairs[k]);
            if (has_rates && near.is_rough)
                set_edge_means<SimdFloat>(poses, unit, pairs, edges, means.data());
            else
                set_edge_means<SimdDouble>(poses, unit, pairs, edges, means.data());
            for (Index k = 0; k < last - first; ++k) {
                adjoints[first + k] = {};
                add_pair(pairs[k], means[k], adjoints[first + k]);
            }
        });
        for (Index k = 0; k < count; ++k)
            for (int side = 0; side < 2; ++side)
                out.elements[element_order_[near.elements[begin + k][side]]] += adjoints[k][side];
    }
}

template void OwnField::add_near_pairs(const Geometry<double>&, const Neighbours&, Targets,
                                       Evaluation<double>&) const;
template void OwnField::add_near_pairs(const Geometry<Dual>&, const Neighbours&, Targets,
                                       Evaluation<Dual>&) const;

}  // namespace magshell
