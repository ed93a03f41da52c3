#include "magshell/contact/face_boxes.h"

#include <algorithm>

#include "magshell/core/parallel.h"

namespace magshell {
namespace {

// [-] growth of the tree's boxes that makes a new tree worth its time; changes time only, fixed by
// test_broad_phase_does_not_depend_on_threads_or_earlier_queries
constexpr double grown = 1.5;
// [tasks] for a few threads, as tasks differ in size; plain-words: ok
constexpr std::size_t enough_tasks = 32;
constexpr Index too_few_faces = 512;    // [faces] below which one thread does the work; plain-words: ok
constexpr Index block_of_faces = 1024;  // [faces] per task; plain-words: ok

using Pair = std::pair<Index, Index>;

/// Replaces a pair of boxes that are near by the pairs of their children; returns false if both are leaves.
bool split(const Pair& pair, const std::vector<BoxTree::Node>& of_a, const std::vector<BoxTree::Node>& of_b,
           bool same, std::vector<Pair>& out) {
    const auto [one, other] = pair;
    const BoxTree::Node &a = of_a[one], &b = of_b[other];
    const bool leaf_a = a.right < 0, leaf_b = b.right < 0;
    if (leaf_a && leaf_b) return false;
    if (same && one == other)
        out.insert(out.end(), {{one + 1, one + 1}, {a.right, a.right}, {one + 1, a.right}});
    else if (!leaf_a && (leaf_b || a.count >= b.count))
        out.insert(out.end(), {{one + 1, other}, {a.right, other}});
    else
        out.insert(out.end(), {{one, other + 1}, {one, b.right}});
    return true;
}

}  // namespace

Bounds NodePaths::around(std::span<const Index> nodes) const {
    const auto at = [](const double* all, Index node) { return Eigen::Map<const Vec3>(all + 3 * node); };
    Bounds bounds{at(from, nodes[0]), at(from, nodes[0])};
    const auto include = [&](const Vec3& x) {
        bounds.low = bounds.low.cwiseMin(x);
        bounds.high = bounds.high.cwiseMax(x);
    };
    for (Index node : nodes.subspan(1)) include(at(from, node));
    if (!still())
        for (Index node : nodes) include(at(to, node));
    return bounds;
}

void FaceBoxes::fit(const NodePaths& ways) {
    boxes_.resize(surface_->faces.size());
    const Index count = surface_->n_faces(), blocks = (count + block_of_faces - 1) / block_of_faces;
    parallel_for(blocks, [&](int block) {
        for (Index f = block * block_of_faces; f < std::min(count, (block + 1) * block_of_faces); ++f)
            boxes_[f] = ways.around(surface_->faces[f]);
    });
    if (nodes_.empty()) make();
    if (refit() > grown * measure_) {
        make();
        refit();
    }
}

void FaceBoxes::make() {
    std::vector<Vec3> centers;
    centers.reserve(boxes_.size());
    for (const Bounds& box : boxes_) centers.push_back(box.low + box.high);
    const BoxTree tree(boxes_, centers);
    nodes_ = tree.nodes();
    items_ = tree.items();
    measure_ = refit();
}

// Updates all boxes. Returns the sum of the lengths of their sides, a measure of how much they overlap.
// Children come after their parents in the list.
double FaceBoxes::refit() {
    double measure = 0.0;
    for (std::size_t k = nodes_.size(); k-- > 0;) {
        BoxTree::Node& node = nodes_[k];
        if (node.right < 0) {
            node.bounds = boxes_[items_[node.first]];
            for (Index i = node.first + 1; i < node.first + node.count; ++i) {
                node.bounds.low = node.bounds.low.cwiseMin(boxes_[items_[i]].low);
                node.bounds.high = node.bounds.high.cwiseMax(boxes_[items_[i]].high);
            }
        } else {
            const Bounds &left = nodes_[k + 1].bounds, &right = nodes_[node.right].bounds;
            node.bounds = {left.low.cwiseMin(right.low), left.high.cwiseMax(right.high)};
        }
        measure += (node.bounds.high - node.bounds.low).sum();
    }
    return measure;
}

std::size_t FaceBoxes::bytes() const {
    return boxes_.capacity() * sizeof(Bounds) + nodes_.capacity() * sizeof(BoxTree::Node) +
           items_.capacity() * sizeof(Index);
}

void near_faces(const FaceBoxes& a, const FaceBoxes& b, double margin,
                const std::function<void(int)>& prepare,
                const std::function<void(int, Index, Index)>& visit) {
    const bool same = &a == &b;
    const auto near = [&](const Pair& pair) {
        return (same && pair.first == pair.second) ||
               a.nodes()[pair.first].bounds.meets(b.nodes()[pair.second].bounds, margin);
    };
    // Descends level by level until there are enough pairs for all threads. The result is the same for any
    // number of threads.
    std::vector<Pair> tasks, next;
    if (near({0, 0})) tasks.push_back({0, 0});
    const bool several = a.nodes()[0].count + b.nodes()[0].count > too_few_faces;
    for (bool more = several; more && tasks.size() < enough_tasks; tasks.swap(next)) {
        next.clear();
        more = false;
        for (const Pair& pair : tasks) {
            const std::size_t before = next.size();
            if (!split(pair, a.nodes(), b.nodes(), same, next)) {
                next.push_back(pair);
                continue;
            }
            more = true;
            next.erase(
                std::remove_if(next.begin() + before, next.end(), [&](const Pair& p) { return !near(p); }),
                next.end());
        }
    }
    prepare(static_cast<int>(tasks.size()));
    parallel_for(static_cast<int>(tasks.size()), [&](int task) {
        std::vector<Pair> stack{tasks[task]};
        while (!stack.empty()) {
            const Pair pair = stack.back();
            stack.pop_back();
            if (!near(pair) || split(pair, a.nodes(), b.nodes(), same, stack)) continue;
            const BoxTree::Node &one = a.nodes()[pair.first], &other = b.nodes()[pair.second];
            const bool itself = same && pair.first == pair.second;
            for (Index k = one.first; k < one.first + one.count; ++k)
                for (Index l = itself ? k + 1 : other.first; l < other.first + other.count; ++l) {
                    const Index f = a.items()[k], g = b.items()[l];
                    if (a.box(f).meets(b.box(g), margin)) visit(task, f, g);
                }
        }
    });
}

}  // namespace magshell
