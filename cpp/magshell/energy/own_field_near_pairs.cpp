#include <algorithm>

#include "magshell/energy/own_field_element_pairs.h"
#include "magshell/energy/own_field_geometry.h"

namespace magshell {

using namespace own_field;

namespace {

template <class T>
using PairAdjoint = std::array<PoseAdjoint<T>, 2>;

// Sets the derivatives for pairs of two kinds of elements, those with these numbers in a block. near: the rule that replaces the coarse
// points.
template <class Value, class T>
void set_pairs(const std::vector<ElementPose<T>>& poses, const std::array<Index, 2>* pairs,
               const std::vector<Index>& numbers, const std::array<bool, 2>& are_edges, const GaussRule& near,
               PairAdjoint<T>* out) {
    using Pairs = ElementPairs<T, Value>;
    using Points = PointsOfKinds<typename Pairs::Pair::Number>;
    static const Points few(coarse), some(medium), most(fine);
    const Points& many = &near == &medium ? some : most;
    const Index count = static_cast<Index>(numbers.size());
    for (Index begin = 0; begin < count; begin += Pairs::width) {
        Pairs sums;
        for (int lane = 0; lane < Pairs::width; ++lane) {  // the last pair again in lanes that are left
            const auto& [first, second] = pairs[numbers[std::min(begin + lane, count - 1)]];
            sums.set(lane, poses[first], poses[second]);
        }
        sums.add(few(are_edges[0]), few(are_edges[1]), -1.0);
        sums.add(many(are_edges[0]), many(are_edges[1]), 1.0);
        sums.finish(are_edges[0] && are_edges[1]);
        for (Index k = begin; k < std::min(begin + Pairs::width, count); ++k)
            out[numbers[k]] = sums(static_cast<int>(k - begin));
    }
}

}  // namespace

template <class T>
void OwnField::add_near_pairs(const Geometry<T>& at, const Neighbours& near, Targets targets,
                              Evaluation<T>& out) const {
    if (near.elements.empty()) return;
    constexpr bool has_rates = std::is_same_v<T, Dual>;
    std::vector<ElementPose<T>> poses;
    for (Index k = 0; k < target_elements(targets); ++k) poses.push_back(at.pose(element_order_[k]));
    const Units units = has_rates && near.is_rough ? units_of<T>(at.x, poses, {}) : Units();
    for (ElementPose<T>& pose : poses) pose = scaled(pose, 1.0 / units.charge, 1.0 / units.rate);
    std::vector<PoseAdjoint<T>> found(poses.size());
    const auto fill = [&](Index begin, Index count, PairAdjoint<T>* adjoints) {
        const std::array<Index, 2>* const pairs = near.elements.data() + begin;
        const auto is_edge = [&](Index k) { return elements_[element_order_[k]].is_edge(); };
        for (const bool first : {false, true})
            for (const bool second : {false, true}) {
                std::vector<Index> with_fine, with_medium;
                for (Index k = 0; k < count; ++k)
                    if (is_edge(pairs[k][0]) == first && is_edge(pairs[k][1]) == second)
                        (begin + k < near.elements_with_fine ? with_fine : with_medium).push_back(k);
                const std::array<bool, 2> are_edges{first, second};
                if (has_rates && near.is_rough) {
                    set_pairs<SimdFloat>(poses, pairs, with_fine, are_edges, fine, adjoints);
                    set_pairs<SimdFloat>(poses, pairs, with_medium, are_edges, medium, adjoints);
                } else {
                    set_pairs<SimdDouble>(poses, pairs, with_fine, are_edges, fine, adjoints);
                }
            }
    };
    fill_in_order<PairAdjoint<T>>(static_cast<Index>(near.elements.size()), fill,
                                  [&](Index k, const PairAdjoint<T>& adjoint) {
                                      for (int side = 0; side < 2; ++side)
                                          found[near.elements[k][side]] += adjoint[side];
                                  });
    const double by_charge = strength * units.charge, energy = by_charge * units.charge;
    for (std::size_t k = 0; k < found.size(); ++k)
        at.add(element_order_[k], scaled(found[k], energy, by_charge, units.rate),
               out.elements[element_order_[k]]);
}

template void OwnField::add_near_pairs(const Geometry<double>&, const Neighbours&, Targets,
                                       Evaluation<double>&) const;
template void OwnField::add_near_pairs(const Geometry<Dual>&, const Neighbours&, Targets,
                                       Evaluation<Dual>&) const;

}  // namespace magshell
