#include "magshell/obstacle/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace magshell {
namespace {

double squared_distance_to_box(const Vec3& low, const Vec3& high, const Vec3& point) {
    return (low - point).cwiseMax(point - high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

TriangleTree::TriangleTree(const TriangleMesh& mesh)
    : mesh_(mesh),
      faces_(mesh.n_faces()),
      face_normals_(mesh.n_faces()),
      edge_normals_(mesh.n_edges(), Vec3(Vec3::Zero())),
      vertex_normals_(mesh.n_vertices(), Vec3(Vec3::Zero())) {
    for (Index f = 0; f < mesh.n_faces(); ++f) {
        const Vec3 area = (corner(f, 1) - corner(f, 0)).cross(corner(f, 2) - corner(f, 0));
        face_normals_[f] = area.normalized();
        for (int i = 0; i < 3; ++i) {
            const Vec3 to_next = corner(f, (i + 1) % 3) - corner(f, i),
                       to_last = corner(f, (i + 2) % 3) - corner(f, i);
            const double angle = std::atan2(to_next.cross(to_last).norm(), to_next.dot(to_last));
            edge_normals_[mesh.face_edges()(f, i)] += face_normals_[f];
            vertex_normals_[mesh.faces()(f, i)] += angle * face_normals_[f];
        }
    }
    std::iota(faces_.begin(), faces_.end(), 0);
    build(0, mesh.n_faces());
}

// Halves the faces at the median of their centres along the longest side, until few are left.
Index TriangleTree::build(Index first, Index count) {
    constexpr Index few = 4;
    constexpr double endless = std::numeric_limits<double>::infinity();
    const Index node = static_cast<Index>(nodes_.size());
    nodes_.push_back({Vec3::Constant(endless), Vec3::Constant(-endless), first, count, -1});
    for (Index k = first; k < first + count; ++k) {
        for (int i = 0; i < 3; ++i) {
            nodes_[node].low = nodes_[node].low.cwiseMin(corner(faces_[k], i));
            nodes_[node].high = nodes_[node].high.cwiseMax(corner(faces_[k], i));
        }
    }
    if (count <= few) return node;
    int axis;
    (nodes_[node].high - nodes_[node].low).maxCoeff(&axis);
    const auto centre = [&](Index f) { return corner(f, 0)[axis] + corner(f, 1)[axis] + corner(f, 2)[axis]; };
    const auto begin = faces_.begin() + first;
    std::nth_element(begin, begin + count / 2, begin + count,
                     [&](Index a, Index b) { return centre(a) < centre(b); });
    build(first, count / 2);
    const Index right = build(first + count / 2, count - count / 2);
    nodes_[node].right = right;
    return node;
}

// By the Voronoi regions of the triangle's corners and sides; C. Ericson, Real-Time Collision
// Detection, 5.1.5.
TriangleTree::Nearest TriangleTree::nearest_on(Index face, const Vec3& point) const {
    const Vec3 a = corner(face, 0), b = corner(face, 1), c = corner(face, 2);
    const Vec3 ab = b - a, ac = c - a;
    const Vec3 from_a = point - a, from_b = point - b, from_c = point - c;
    const double a1 = ab.dot(from_a), a2 = ac.dot(from_a);
    if (a1 <= 0.0 && a2 <= 0.0) return {a, 4};
    const double b1 = ab.dot(from_b), b2 = ac.dot(from_b);
    if (b1 >= 0.0 && b2 <= b1) return {b, 5};
    const double c1 = ab.dot(from_c), c2 = ac.dot(from_c);
    if (c2 >= 0.0 && c1 <= c2) return {c, 6};
    const double area_c = a1 * b2 - b1 * a2;
    if (area_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0) return {a + a1 / (a1 - b1) * ab, 3};
    const double area_b = c1 * a2 - a1 * c2;
    if (area_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0) return {a + a2 / (a2 - c2) * ac, 2};
    const double area_a = b1 * c2 - c1 * b2;
    const double towards_c = b2 - b1, towards_b = c1 - c2;
    if (area_a <= 0.0 && towards_c >= 0.0 && towards_b >= 0.0)
        return {b + towards_c / (towards_c + towards_b) * (c - b), 1};
    const double total = area_a + area_b + area_c;
    return {a + area_b / total * ab + area_c / total * ac, 0};
}

Vec3 TriangleTree::pseudo_normal(Index face, int feature) const {
    if (feature == 0) return face_normals_[face];
    if (feature <= 3) return edge_normals_[mesh_.face_edges()(face, feature - 1)];
    return vertex_normals_[mesh_.faces()(face, feature - 4)];
}

double TriangleTree::signed_distance(const Vec3& point, double bound) const {
    double least = bound * bound;
    Index nearest_face = -1;
    Nearest nearest{};
    std::array<Index, 64> stack;  // the tree is balanced: its depth is the logarithm of the number of faces
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const Index index = stack[--top];
        const Node& node = nodes_[index];
        if (squared_distance_to_box(node.low, node.high, point) > least) continue;
        if (node.right >= 0) {
            const Index left = index + 1;
            const double to_left = squared_distance_to_box(nodes_[left].low, nodes_[left].high, point);
            const double to_right =
                squared_distance_to_box(nodes_[node.right].low, nodes_[node.right].high, point);
            stack[top++] = to_left < to_right ? node.right : left;
            stack[top++] = to_left < to_right ? left : node.right;
            continue;
        }
        for (Index k = node.first; k < node.first + node.count; ++k) {
            const Nearest candidate = nearest_on(faces_[k], point);
            const double squared = (point - candidate.point).squaredNorm();
            if (squared > least) continue;
            least = squared;
            nearest = candidate;
            nearest_face = faces_[k];
        }
    }
    if (nearest_face < 0) return signed_distance(point, std::numeric_limits<double>::infinity());
    const Vec3 offset = point - nearest.point;
    const double side = offset.dot(pseudo_normal(nearest_face, nearest.feature));
    return side < 0.0 ? -offset.norm() : offset.norm();
}

}  // namespace magshell
