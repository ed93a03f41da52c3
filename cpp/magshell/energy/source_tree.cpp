#include "magshell/energy/source_tree.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace magshell {
namespace {

// [-] Sum of the radii of two distant boxes over their distance; see test_tree_sums_agree_with_direct_ones.
constexpr double opening = 0.6;
// [-] Digits of an interpolation that the decay of its Chebyshev coefficients promises, over those that the sums need: the largest
// terms come from near boxes; see test_tree_sums_agree_with_direct_ones.
constexpr double promised_digits = 0.75;
// Most points of a leaf, near those of a grid, at accuracies of up to `loose` and beyond; see benchmarks/own_field_costs.py.
constexpr Index leaf_points = 400, loose_leaf_points = 120;
constexpr double loose = 1e-4;  // [-] see benchmarks/own_field_costs.py
constexpr double thinnest =
    0.02;  // [-] least side of a box over its diameter, so that differences along it keep digits; see
           // test_tree_sums_agree_with_direct_ones
// [-] Least over middle variance of points below which a box turns into their plane; see test_tree_sums_agree_with_direct_ones.
constexpr double thin_spread = 0.1;

}  // namespace

double chebyshev_point(int n, int i) {
    return std::cos((2 * i + 1) * std::numbers::pi / (2 * n));
}

SourceTree::SourceTree(const std::vector<Vec3>& points, Index group_size, double accuracy)
    : group_size_(group_size),
      leaf_points_(accuracy > loose ? loose_leaf_points : leaf_points),
      digits_(-std::log10(accuracy)) {
    const Index n_groups = static_cast<Index>(points.size()) / group_size;
    order_.resize(n_groups);
    std::iota(order_.begin(), order_.end(), Index(0));
    middles_.assign(n_groups, Vec3::Zero());
    for (Index g = 0; g < n_groups; ++g) {
        for (Index k = 0; k < group_size; ++k) middles_[g] += points[g * group_size + k];
        middles_[g] /= static_cast<double>(group_size);
    }
    if (n_groups > 0) split(0, n_groups, -1, Mat3::Identity(), points);
    for (std::size_t b = 0; b < boxes_.size(); ++b) {
        std::size_t level = 0;
        for (Index up = boxes_[b].parent; up >= 0; up = boxes_[up].parent) ++level;
        if (level >= levels_.size()) levels_.resize(level + 1);
        levels_[level].push_back(static_cast<Index>(b));
    }
}

Index SourceTree::split(Index first, Index last, Index parent, const Mat3& axes,
                        const std::vector<Vec3>& points) {
    const Index number = static_cast<Index>(boxes_.size());
    Box box;
    box.first = first, box.last = last, box.parent = parent, box.axes = axes;
    Vec3 mean = Vec3::Zero();
    for (Index k = first; k < last; ++k) mean += middles_[order_[k]];
    mean /= static_cast<double>(last - first);
    Mat3 spread = Mat3::Zero();
    for (Index k = first; k < last; ++k) {
        const Vec3 off = middles_[order_[k]] - mean;
        spread += off * off.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> main(spread);
    if (main.eigenvalues()[0] <= thin_spread * main.eigenvalues()[1]) {
        // The smallest rotation that takes the third axis across the points.
        Vec3 across = main.eigenvectors().col(0);
        if (across.dot(axes.col(2)) < 0.0) across = -across;
        box.axes = Eigen::Quaterniond::FromTwoVectors(axes.col(2), across).toRotationMatrix() * axes;
    }
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (Index k = first; k < last; ++k)
        for (Index i = 0; i < group_size_; ++i) {
            const Vec3 local = box.axes.transpose() * points[order_[k] * group_size_ + i];
            low = low.cwiseMin(local), high = high.cwiseMax(local);
        }
    box.center = box.axes * (0.5 * (low + high));
    for (Index k = first; k < last; ++k)
        for (Index i = 0; i < group_size_; ++i)
            box.radius = std::max(box.radius, (points[order_[k] * group_size_ + i] - box.center).norm());
    box.half = (0.5 * (high - low)).cwiseMax(thinnest * box.radius);
    set_grid(box);
    boxes_.push_back(box);
    if ((last - first) * group_size_ <= leaf_points_ || last - first < 2) return number;
    int longest = 0;
    box.half.maxCoeff(&longest);
    const Vec3 along = box.axes.col(longest);
    const Index middle = first + (last - first) / 2;
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                     [&](Index a, Index b) {
                         const double at_a = along.dot(middles_[a]), at_b = along.dot(middles_[b]);
                         return at_a < at_b || (at_a == at_b && a < b);
                     });
    const Index left = split(first, middle, number, box.axes, points);
    const Index right = split(middle, last, number, box.axes, points);
    boxes_[number].children = {left, right};
    return number;
}

void SourceTree::set_grid(Box& box) {
    for (int d = 0; d < 3; ++d) {
        // The nearest point of a distant box is at least radius/opening away: the Chebyshev coefficients fall like this ratio.
        const double far = box.half[d] > 0.0 ? box.radius / (opening * box.half[d]) : 1.0 / opening;
        const double ratio = far + std::sqrt(far * far - 1.0);
        box.counts[d] = std::min(
            most_counts, 1 + static_cast<int>(std::ceil(promised_digits * digits_ / std::log10(ratio))));
        box.counts[d] = std::max(box.counts[d], 2);
    }
    box.grid = grids_[0].size();
    const std::size_t width = SimdDouble::width, count = static_cast<std::size_t>(box.n_grid());
    for (std::vector<double>& each : grids_)
        each.resize(box.grid + (count + width - 1) / width * width, far_away);
    std::size_t number = box.grid;
    for (int i = 0; i < box.counts[0]; ++i)
        for (int j = 0; j < box.counts[1]; ++j)
            for (int k = 0; k < box.counts[2]; ++k, ++number) {
                const Vec3 local(chebyshev_point(box.counts[0], i), chebyshev_point(box.counts[1], j),
                                 chebyshev_point(box.counts[2], k));
                const Vec3 place = box.center + box.axes * box.half.cwiseProduct(local);
                for (int c = 0; c < 3; ++c) grids_[c][number] = place[c];
            }
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
        } else if (source.is_leaf() || (!target.is_leaf() && (target.radius > source.radius ||
                                                              (target.radius == source.radius && a <= b)))) {
            // Ties are broken so that in one tree a box sees another if that sees it.
            for (const Index child : target.children) open.push_back({child, b});
        } else {
            for (const Index child : source.children) open.push_back({a, child});
        }
    }
}

}  // namespace magshell
