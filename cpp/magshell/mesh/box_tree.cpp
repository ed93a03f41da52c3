#include "magshell/mesh/box_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace magshell {

BoxTree::BoxTree(const std::vector<Bounds>& boxes, const std::vector<Vec3>& centers) : items_(boxes.size()) {
    std::iota(items_.begin(), items_.end(), 0);
    build(0, static_cast<Index>(items_.size()), boxes, centers);
}

Index BoxTree::build(Index first, Index count, const std::vector<Bounds>& boxes,
                     const std::vector<Vec3>& centers) {
    constexpr Index few = 4;
    constexpr double endless = std::numeric_limits<double>::infinity();
    const Index node = static_cast<Index>(nodes_.size());
    Bounds around{Vec3::Constant(endless), Vec3::Constant(-endless)};
    for (Index k = first; k < first + count; ++k) {
        around.low = around.low.cwiseMin(boxes[items_[k]].low);
        around.high = around.high.cwiseMax(boxes[items_[k]].high);
    }
    nodes_.push_back({around, first, count, -1});
    if (count <= few) return node;
    int axis;
    (around.high - around.low).maxCoeff(&axis);
    const auto begin = items_.begin() + first;
    std::nth_element(begin, begin + count / 2, begin + count,
                     [&](Index a, Index b) { return centers[a][axis] < centers[b][axis]; });
    build(first, count / 2, boxes, centers);
    const Index right = build(first + count / 2, count - count / 2, boxes, centers);
    nodes_[node].right = right;
    return node;
}

BoxTree tree_of_faces(const Rows3& positions, const Rows3i& faces) {
    std::vector<Bounds> boxes;
    std::vector<Vec3> centers;
    for (Index f = 0; f < static_cast<Index>(faces.rows()); ++f) {
        const auto at = [&](int i) { return Vec3(positions.row(faces(f, i)).transpose()); };
        const Vec3 corners[3] = {at(0), at(1), at(2)};
        boxes.push_back(bounds_around(corners));
        centers.push_back(corners[0] + corners[1] + corners[2]);
    }
    return BoxTree(boxes, centers);
}

}  // namespace magshell
