#include <algorithm>
#include <limits>

#include "magshell/energy/own_field_geometry.h"
#include "magshell/mesh/box_tree.h"

namespace magshell {

using namespace own_field;

namespace {

// Balls around elements or faces, which are near each other if one of them has the other's center in it.
struct Balls {
    std::vector<Vec3> centers;
    std::vector<double> radii;

    void add(const Vec3& center, double radius) {
        centers.push_back(center);
        radii.push_back(radius);
    }
    Bounds box(std::size_t k) const {
        const Vec3 reach = Vec3::Constant(radii[k]);
        return {centers[k] - reach, centers[k] + reach};
    }
};

// Returns the bounds of the centers in each node of a tree.
std::vector<Bounds> bounds_of_centers(const BoxTree& tree, const std::vector<Vec3>& centers) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::vector<Bounds> bounds(tree.nodes().size(), {Vec3::Constant(infinity), Vec3::Constant(-infinity)});
    for (std::size_t number = bounds.size(); number-- > 0;) {  // children follow their parents
        const BoxTree::Node& node = tree.nodes()[number];
        const auto include = [&](const Bounds& other) {
            bounds[number] = {bounds[number].low.cwiseMin(other.low),
                              bounds[number].high.cwiseMax(other.high)};
        };
        if (node.right >= 0) {
            include(bounds[number + 1]);
            include(bounds[node.right]);
            continue;
        }
        for (Index i = node.first; i < node.first + node.count; ++i)
            include({centers[tree.items()[i]], centers[tree.items()[i]]});
    }
    return bounds;
}

// Returns for each ball the others that are near it, in ascending order, of the first limit(k) ones.
template <class Limit>
std::vector<std::vector<Index>> near_balls(const Balls& of, const Balls& others, const Limit& limit) {
    std::vector<Bounds> boxes;
    for (std::size_t k = 0; k < others.centers.size(); ++k) boxes.push_back(others.box(k));
    const BoxTree tree(boxes, others.centers);
    const std::vector<Bounds> center_bounds = bounds_of_centers(tree, others.centers);
    std::vector<std::vector<Index>> near(of.centers.size());
    in_blocks(static_cast<Index>(near.size()), [&](Index first, Index last) {
        std::vector<Index> open;
        for (Index k = first; k < last; ++k) {
            const Index end = limit(k);
            if (end == 0) continue;
            const Bounds box = of.box(k), center{of.centers[k], of.centers[k]};
            open.assign(1, 0);
            while (!open.empty()) {
                const Index number = open.back();
                open.pop_back();
                const BoxTree::Node& node = tree.nodes()[number];
                if (!node.bounds.meets(center, 0.0) && !center_bounds[number].meets(box, 0.0)) continue;
                if (node.right >= 0) {
                    open.push_back(number + 1);
                    open.push_back(node.right);
                    continue;
                }
                for (Index i = node.first; i < node.first + node.count; ++i) {
                    const Index j = tree.items()[i];
                    const double reach = std::max(of.radii[k], others.radii[j]);
                    if (j < end && (of.centers[k] - others.centers[j]).squaredNorm() < reach * reach)
                        near[k].push_back(j);
                }
            }
            std::sort(near[k].begin(), near[k].end());
        }
    });
    return near;
}

std::vector<std::size_t> positions_in(const SourceTree& tree) {
    std::vector<std::size_t> positions(tree.order().size());
    for (std::size_t k = 0; k < positions.size(); ++k) positions[tree.order()[k]] = k;
    return positions;
}

// Removes the pairs that are not within the far limit, and puts those within the near limit first; returns how many these are.
template <class Within>
Index keep_nearest(std::vector<std::array<Index, 2>>& pairs, const Within& within) {
    std::erase_if(pairs, [&](const auto& pair) { return !within(pair, &Blend::far); });
    const auto others = std::stable_partition(pairs.begin(), pairs.end(),
                                              [&](const auto& pair) { return within(pair, &Blend::near); });
    return static_cast<Index>(others - pairs.begin());
}

}  // namespace

OwnField::Neighbours OwnField::neighbours(const double* q, Targets targets) const {
    const std::vector<Triple<double>> x = positions<double>(q, nullptr);
    const auto middle = [&](const std::array<Index, 3>& nodes) {  // of two nodes if the last is negative
        Vec3 sum = values_of(x[nodes[0]]) + values_of(x[nodes[1]]);
        if (nodes[2] < 0) return Vec3(sum / 2.0);
        sum += values_of(x[nodes[2]]);
        return Vec3(sum / 3.0);
    };
    Neighbours near;
    Balls sources, all, side_elements, side_faces;
    for (Index k = 0; k < target_elements(targets); ++k) {
        const Element& element = elements_[element_order_[k]];
        const Vec3 center = middle(element.nodes);
        all.add(center, of_elements.far * element.length);
        if (k < active_elements_) sources.add(center, of_elements.far * element.length);
        side_elements.add(center, of_sides.far * element.length);
    }
    const std::vector<std::vector<Index>> near_elements =
        near_balls(all, sources, [](Index k) { return k; });  // those with a source come first
    for (Index k = 0; k < target_elements(targets); ++k)
        for (const Index j : near_elements[k]) near.elements.push_back({k, j});
    near.elements_with_fine = static_cast<Index>(near.elements.size());
    if (n_points() > most_direct && accuracy_ > 0.0) near.trees = trees(x, targets, accuracy_);
    if (!has_sides(targets)) return near;
    for (Index k = 0; k < target_faces(targets); ++k) {
        const Face& face = faces_[face_order_[k]];
        side_faces.add(middle(face.nodes), of_sides.far * face.size);
    }
    const auto wanted = [&](Index k) { return targets == Targets::all || has_charge_[element_order_[k]]; };
    const std::vector<std::vector<Index>> near_faces =
        near_balls(side_elements, side_faces, [&](Index k) { return wanted(k) ? target_faces(targets) : 0; });
    for (Index k = 0; k < target_elements(targets); ++k)
        for (const Index j : near_faces[k]) near.sides.push_back({k, j});
    near.sides_with_fine = static_cast<Index>(near.sides.size());
    return near;
}

OwnField::Neighbours OwnField::rough(const double* q, const Neighbours& near) const {
    constexpr double accuracy = 1e-3;  // [-] see test_rough_products_are_close_to_exact_ones
    Neighbours rough = near;
    rough.is_rough = has_rough_products();
    if (!rough.is_rough) return rough;
    const std::vector<Triple<double>> x = positions<double>(q, nullptr);
    const Geometry<double> at(*this, x);
    const auto size_of = [&](Index e) { return std::max(elements_[e].length, element_thickness_[e]); };
    const auto are_elements_within = [&](const std::array<Index, 2>& pair, double Blend::* limit) {
        const Index first = element_order_[pair[0]], second = element_order_[pair[1]];
        const bool edges = elements_[first].is_edge() && elements_[second].is_edge();
        return norm(at.middle(elements_[first]) - at.middle(elements_[second])) <
               (edges ? of_rough_edges : of_rough_triangles).*limit *
                   std::max(size_of(first), size_of(second));
    };
    rough.elements_with_fine = keep_nearest(rough.elements, are_elements_within);
    const auto are_sides_within = [&](const std::array<Index, 2>& pair, double Blend::* limit) {
        const Index e = element_order_[pair[0]], f = face_order_[pair[1]];
        return is_edge_of(e, f) ||
               norm(at.middle(elements_[e]) - at.center(faces_[f])) <
                   of_rough_sides.*limit * std::max({size_of(e), faces_[f].size, thickness_[f]});
    };
    rough.sides_with_fine = keep_nearest(rough.sides, are_sides_within);
    rough.trees = trees(x, Targets::sources, std::max(accuracy, accuracy_));
    return rough;
}

std::shared_ptr<const OwnField::Trees> OwnField::trees(const std::vector<Triple<double>>& x, Targets targets,
                                                       double accuracy) const {
    const Geometry<double> at(*this, x);
    std::vector<Vec3> element_points, side_points;
    for (Index k = 0; k < target_elements(targets); ++k)
        at.each_point(element_order_[k], coarse, [&](const SourcePoint<double>& point, const SamplePoint&) {
            element_points.push_back(values_of(point.at));
        });
    if (has_sides(targets))
        for (Index k = 0; k < target_faces(targets); ++k)
            at.each_side_point(face_order_[k], [&](const SourcePoint<double>& point, const double*, double,
                                                   double) { side_points.push_back(values_of(point.at)); });
    Trees trees{.elements = SourceTree(element_points, 4, accuracy),
                .faces = SourceTree(side_points, 6, accuracy)};
    BoxPairs mirrored;
    pair_boxes(trees.elements, trees.elements, trees.element_pairs, mirrored);
    pair_boxes(trees.elements, trees.faces, trees.side_pairs_of_elements, trees.side_pairs_of_faces);
    trees.element_positions = positions_in(trees.elements);
    trees.face_positions = positions_in(trees.faces);
    return std::make_shared<const Trees>(std::move(trees));
}

}  // namespace magshell
