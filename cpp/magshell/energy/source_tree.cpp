#include "magshell/energy/source_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "magshell/energy/solid_harmonics.h"

namespace magshell {
namespace {

// [-] Sum of the radii of two distant boxes over their distance; see test_tree_sums_agree_with_direct_ones.
constexpr double opening = 0.6;
// [-] Digits that a degree adds, over those for points on the spheres around their boxes, towards each other: for typical points, which decide
// up to an accuracy `usual`, and for the few that are nearest to those, which decide beyond. See test_tree_sums_agree_with_direct_ones
// and test_tree_sums_of_a_flat_sheet_agree_with_direct_ones.
constexpr double typical = 1.7, nearest = 1.2, usual = 1e-6;
// [-] Sides and radii of boxes that differ by less than this factor are taken for equal, and coordinates within a box for equal in cells of
// this part of its side, counted from an odd offset. On a regular mesh they are equal but for round-off, which would change the tree,
// and with it forces by the accuracy, between nearly equal states: Newton's method would not converge. See
// test_newton_converges_on_a_regular_mesh.
constexpr double alike = 1.0137, cell = 1e-4, offset = 0.377;

int degree_for(double accuracy) {
    const double first = std::max(accuracy, usual);
    return static_cast<int>(std::ceil(std::log(first) / (typical * std::log(opening)) +
                                      std::log(accuracy / first) / (nearest * std::log(opening))));
}

}  // namespace

SourceTree::SourceTree(const std::vector<Vec3>& points, Index group_size, double accuracy)
    : group_size_(group_size), degree_(degree_for(accuracy)) {
    const Index n_groups = static_cast<Index>(points.size()) / group_size;
    order_.resize(n_groups);
    std::iota(order_.begin(), order_.end(), Index(0));
    middles_.assign(n_groups, Vec3::Zero());
    for (Index g = 0; g < n_groups; ++g) {
        for (Index k = 0; k < group_size; ++k) middles_[g] += points[g * group_size + k];
        middles_[g] /= static_cast<double>(group_size);
    }
    if (n_groups > 0) split(0, n_groups, -1, points);
    std::vector<std::size_t> level_of(boxes_.size(), 0);
    for (std::size_t b = 0; b < boxes_.size(); ++b) {
        if (boxes_[b].parent >= 0) level_of[b] = level_of[boxes_[b].parent] + 1;
        if (level_of[b] >= levels_.size()) levels_.resize(level_of[b] + 1);
        levels_[level_of[b]].push_back(static_cast<Index>(b));
    }
}

Index SourceTree::split(Index first, Index last, Index parent, const std::vector<Vec3>& points) {
    const Index number = static_cast<Index>(boxes_.size());
    Box box;
    box.first = first, box.last = last, box.parent = parent;
    const auto each_point = [&](const auto& body) {
        for (Index k = first; k < last; ++k)
            for (Index i = 0; i < group_size_; ++i) body(points[order_[k] * group_size_ + i]);
    };
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    each_point([&](const Vec3& point) { low = low.cwiseMin(point), high = high.cwiseMax(point); });
    box.center = 0.5 * (low + high);
    double squared = 0.0;
    each_point([&](const Vec3& point) { squared = std::max(squared, (point - box.center).squaredNorm()); });
    box.radius = std::sqrt(squared);
    boxes_.push_back(box);
    // A leaf has about as many points as an expansion has terms.
    if ((last - first) * group_size_ <= harmonic_count(degree_) || last - first < 2) return number;
    const Vec3 sides = high - low;
    int longest = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (sides[axis] > alike * sides[longest]) longest = axis;
    const double side = std::max(sides[longest], std::numeric_limits<double>::min());
    const auto cell_of = [&](Index group) {
        return std::floor((middles_[group][longest] - low[longest]) / (cell * side) + offset);
    };
    const Index middle = first + (last - first) / 2;
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                     [&](Index a, Index b) {
                         const double at_a = cell_of(a), at_b = cell_of(b);
                         return at_a < at_b || (at_a == at_b && a < b);
                     });
    const Index left = split(first, middle, number, points);
    const Index right = split(middle, last, number, points);
    boxes_[number].children = {left, right};
    return number;
}

void pair_boxes(const SourceTree& targets, const SourceTree& sources, BoxPairs& of_targets,
                BoxPairs& of_sources) {
    of_targets.distant.assign(targets.boxes().size(), {});
    of_targets.near.assign(targets.boxes().size(), {});
    of_sources.distant.assign(sources.boxes().size(), {});
    of_sources.near.assign(sources.boxes().size(), {});
    if (targets.boxes().empty() || sources.boxes().empty()) return;
    std::vector<std::array<Index, 2>> open{{0, 0}};
    while (!open.empty()) {
        const auto [a, b] = open.back();
        open.pop_back();
        const SourceTree::Box &target = targets.boxes()[a], &source = sources.boxes()[b];
        if (target.radius + source.radius < opening * (target.center - source.center).norm()) {
            of_targets.distant[a].push_back(b);
            of_sources.distant[b].push_back(a);
        } else if (target.is_leaf() && source.is_leaf()) {
            of_targets.near[a].push_back(b);
            of_sources.near[b].push_back(a);
        } else if (source.is_leaf() ||
                   (!target.is_leaf() && (target.radius > alike * source.radius ||
                                          (source.radius <= alike * target.radius && a <= b)))) {
            // Ties are broken so that in one tree a box sees another if that sees it.
            for (const Index child : target.children) open.push_back({child, b});
        } else {
            for (const Index child : source.children) open.push_back({a, child});
        }
    }
}

}  // namespace magshell
