#include "magshell/obstacle/triangle_tree.h"

#include <cmath>
#include <limits>

namespace magshell {
namespace {

double squared_distance_to_box(const Bounds& box, const Vec3& point) {
    return (box.low - point).cwiseMax(point - box.high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

TriangleTree::TriangleTree(const TriangleMesh& mesh)
    : mesh_(mesh),
      tree_(tree_of_faces(mesh.rest_positions(), mesh.faces())),
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
}

// Finds the nearest point of a triangle by the Voronoi regions of its corners and sides; C. Ericson, Real-Time
// Collision Detection, 5.1.5.
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
        const BoxTree::Node& node = tree_.nodes()[index];
        if (squared_distance_to_box(node.bounds, point) > least) continue;
        if (node.right >= 0) {
            const Index left = index + 1;
            const double to_left = squared_distance_to_box(tree_.nodes()[left].bounds, point);
            const double to_right = squared_distance_to_box(tree_.nodes()[node.right].bounds, point);
            stack[top++] = to_left < to_right ? node.right : left;
            stack[top++] = to_left < to_right ? left : node.right;
            continue;
        }
        for (Index k = node.first; k < node.first + node.count; ++k) {
            const Nearest candidate = nearest_on(tree_.items()[k], point);
            const double squared = (point - candidate.point).squaredNorm();
            if (squared > least) continue;
            least = squared;
            nearest = candidate;
            nearest_face = tree_.items()[k];
        }
    }
    if (nearest_face < 0) return signed_distance(point, std::numeric_limits<double>::infinity());
    const Vec3 offset = point - nearest.point;
    const double side = offset.dot(pseudo_normal(nearest_face, nearest.feature));
    return side < 0.0 ? -offset.norm() : offset.norm();
}

}  // namespace magshell
