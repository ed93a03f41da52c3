// Finds the pairs of faces of a surface that pass through each other. Candidates come from a tree of boxes
// tested against itself. For most pairs the signs of a few volumes decide whether they cross. If a vertex or an
// edge lies in a face or on another edge, they do not: the surface may end there, touch itself, or pass through
// itself with pairs of faces that share no more than a line.
//
// Such pairs are decided twice more, after the surface was displaced by
//
//   u = +- s a (b . X + c k)     X: reference positions, k: number of the connected part, s small,
//                                a and b in directions that a mesh would not have
//
// which tears nothing and moves meeting parts against each other, to one side or to the other. Faces that cross
// do so both times; faces that only touch separate in one of the two. (A connected part whose *reference* shape
// passes through itself exactly at its vertices is not displaced against itself, so such a place is not found.)
#include "magshell/mesh/self_intersections.h"

#include <algorithm>
#include <numeric>
#include <unordered_set>

#include "magshell/core/types.h"
#include "magshell/mesh/box_tree.h"

namespace magshell {
namespace {

/// The relation of two triangles in space. crossing: an edge of one passes through the interior of the other, with both ends and all sides farther away
/// than the tolerance. touching: too close to decide. apart: neither.
enum class Meeting { apart, touching, crossing };

/// A triangle at its current position.
struct Triangle {
    Vec3 corner[3];
    Vec3 normal;  // unit normal; zero where the corners are on one line

    Triangle(const Vec3& a, const Vec3& b, const Vec3& c)
        : corner{a, b, c}, normal((b - a).cross(c - a).normalized()) {}
};

/// The range of distances of points along a direction.
struct Range {
    double low, high;

    bool beyond(double close) const { return low > close || high < -close; }
};

Range range_of(const Triangle& t, const Vec3& origin, const Vec3& direction) {
    const double d[3] = {direction.dot(t.corner[0] - origin), direction.dot(t.corner[1] - origin),
                         direction.dot(t.corner[2] - origin)};
    return {std::min({d[0], d[1], d[2]}), std::max({d[0], d[1], d[2]})};
}

/// Returns true if the plane of a, or a plane through one of its edges and its normal, has all of b on the
/// other side.
bool separated_by(const Triangle& a, const Triangle& b, double close) {
    if (range_of(b, a.corner[0], a.normal).beyond(close)) return true;
    for (int i = 0; i < 3; ++i) {
        const Vec3 outward = (a.corner[(i + 1) % 3] - a.corner[i]).cross(a.normal).normalized();
        if (range_of(b, a.corner[i], outward).low > close) return true;
    }
    return false;
}

/// Tests an edge from p to q against the interior of a triangle: it crosses if its ends lie on both sides of
/// the plane and it passes all three sides in the same sense.
/// Tests two triangles without a common vertex. close: tolerance [m], larger than the error of coordinates.
Meeting meeting(const Vec3& p, const Vec3& q, const Triangle& t, double close) {
    const double at_p = t.normal.dot(p - t.corner[0]), at_q = t.normal.dot(q - t.corner[0]);
    if (std::min(at_p, at_q) > close || std::max(at_p, at_q) < -close) return Meeting::apart;
    const Vec3 along = (q - p).normalized();
    bool one_side = false, other_side = false;
    bool certain = std::min(at_p, at_q) < -close && std::max(at_p, at_q) > close;
    for (int i = 0; i < 3; ++i) {
        const Vec3& from = t.corner[i];
        const double distance = along.cross((t.corner[(i + 1) % 3] - from).normalized()).dot(from - p);
        if (distance > close)
            one_side = true;
        else if (distance < -close)
            other_side = true;
        else
            certain = false;
    }
    if (one_side && other_side) return Meeting::apart;
    return certain ? Meeting::crossing : Meeting::touching;
}

// If two triangles cross, the ends of their common line lie on edges of one or the other.
Meeting meeting(const Triangle& a, const Triangle& b, double close) {
    if (separated_by(a, b, close) || separated_by(b, a, close)) return Meeting::apart;
    Meeting most = Meeting::apart;
    for (int i = 0; i < 3; ++i) {
        most = std::max(most, meeting(a.corner[i], a.corner[(i + 1) % 3], b, close));
        most = std::max(most, meeting(b.corner[i], b.corner[(i + 1) % 3], a, close));
    }
    return most;
}

// The common line of two triangles with one common vertex begins at the vertex and ends on the edge opposite to
// it, of one or the other.
/// Tests two triangles whose corners i and j are the same vertex, beyond that vertex.
Meeting meeting_beyond_vertex(const Triangle& a, int i, const Triangle& b, int j, double close) {
    const Vec3& vertex = a.corner[i];
    const Vec3 &a1 = a.corner[(i + 1) % 3], &a2 = a.corner[(i + 2) % 3];
    const Vec3 &b1 = b.corner[(j + 1) % 3], &b2 = b.corner[(j + 2) % 3];
    // In smooth surfaces nearly all such pairs extend in different directions, which this test detects.
    const Vec3 to_a = (a1 - vertex).normalized() + (a2 - vertex).normalized(),
               to_b = (b1 - vertex).normalized() + (b2 - vertex).normalized();
    const Vec3 between = (to_a - to_b).normalized();
    if (std::min(between.dot(a1 - vertex), between.dot(a2 - vertex)) > close &&
        std::max(between.dot(b1 - vertex), between.dot(b2 - vertex)) < -close)
        return Meeting::apart;
    return std::max(meeting(a1, a2, b, close), meeting(b1, b2, a, close));
}

using Pair = std::pair<Index, Index>;

constexpr double close_to = 1e-12;  // [-] relative to the size of the surface: closer than this is touching
constexpr double moved_by = 1e-6;   // [-] displacement relative to the size of the surface

/// The faces of a mesh at their current positions.
class PlacedFaces {
  public:
    PlacedFaces(const TriangleMesh& mesh, const Rows3& positions) : mesh_(mesh) {
        triangles_.reserve(mesh.n_faces());
        for (Index f = 0; f < mesh.n_faces(); ++f) {
            const auto at = [&](int i) { return Vec3(positions.row(mesh.faces()(f, i)).transpose()); };
            triangles_.emplace_back(at(0), at(1), at(2));
        }
    }

    Meeting meeting(Index f, Index g, double close) const {
        int shared = 0, in_f = 0, in_g = 0;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (mesh_.faces()(f, i) == mesh_.faces()(g, j)) {
                    ++shared;
                    in_f = i;
                    in_g = j;
                }
        if (shared > 1) return Meeting::apart;
        if (shared == 1) return meeting_beyond_vertex(triangles_[f], in_f, triangles_[g], in_g, close);
        return magshell::meeting(triangles_[f], triangles_[g], close);
    }

    Bounds bounds(Index f) const { return bounds_around(triangles_[f].corner); }

  private:
    const TriangleMesh& mesh_;
    std::vector<Triangle> triangles_;
};

/// Calls visit(f, g) for the pairs of faces whose boxes meet, each once.
template <class Visit>
void near_pairs(const BoxTree& tree, const PlacedFaces& faces, double margin, const Visit& visit) {
    std::vector<Pair> stack{{0, 0}};
    while (!stack.empty()) {
        const auto [one, other] = stack.back();
        stack.pop_back();
        const BoxTree::Node &a = tree.nodes()[one], &b = tree.nodes()[other];
        if (one != other && !a.bounds.meets(b.bounds, margin)) continue;
        const bool leaf_a = a.right < 0, leaf_b = b.right < 0;
        if (one == other && !leaf_a) {
            stack.insert(stack.end(), {{one + 1, one + 1}, {a.right, a.right}, {one + 1, a.right}});
        } else if (!leaf_a && (leaf_b || a.count >= b.count)) {
            stack.insert(stack.end(), {{one + 1, other}, {a.right, other}});
        } else if (!leaf_b) {
            stack.insert(stack.end(), {{one, other + 1}, {one, b.right}});
        } else {
            for (Index k = a.first; k < a.first + a.count; ++k)
                for (Index l = one == other ? k + 1 : b.first; l < b.first + b.count; ++l) {
                    const Index f = tree.items()[k], g = tree.items()[l];
                    if (faces.bounds(f).meets(faces.bounds(g), margin)) visit(std::min(f, g), std::max(f, g));
                }
        }
    }
}

/// Locations at which two parts of a surface cross, identified by the vertices of the faces there.
class Places {
  public:
    Places(const TriangleMesh& mesh, const std::vector<Pair>& pairs) : mesh_(mesh) {
        for (const Pair& pair : pairs)
            each_key(pair, [&](std::uint64_t key) {
                keys_.insert(key);
                return false;
            });
    }

    bool has(const Pair& pair) const {
        return each_key(pair, [&](std::uint64_t key) { return keys_.count(key) > 0; });
    }

  private:
    // Keys of a pair: a vertex of one face and one of the other. Faces around the same two vertices are at the
    // same location.
    template <class Stop>
    bool each_key(const Pair& pair, const Stop& stop) const {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const auto [low, high] =
                    std::minmax(mesh_.faces()(pair.first, i), mesh_.faces()(pair.second, j));
                if (stop(static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint64_t>(high)))
                    return true;
            }
        return false;
    }

    const TriangleMesh& mesh_;
    std::unordered_set<std::uint64_t> keys_;
};

/// Returns the number of the connected part of each vertex, from 0.
std::vector<Index> parts_of(const TriangleMesh& mesh) {
    std::vector<Index> lowest(mesh.n_vertices());
    std::iota(lowest.begin(), lowest.end(), 0);
    const auto root = [&](Index v) {
        while (lowest[v] != v) v = lowest[v] = lowest[lowest[v]];
        return v;
    };
    for (Index e = 0; e < mesh.n_edges(); ++e) {
        const Index one = root(mesh.edges()(e, 0)), other = root(mesh.edges()(e, 1));
        lowest[std::max(one, other)] = std::min(one, other);
    }
    std::vector<Index> part(mesh.n_vertices());
    Index count = 0;
    for (Index v = 0; v < mesh.n_vertices(); ++v) part[v] = root(v) == v ? count++ : part[root(v)];
    return part;
}

/// Returns b . X + c k at each vertex, scaled to at most 1.
VectorXd shares(const TriangleMesh& mesh) {
    const Vec3 b = Vec3(0.71, -0.43, 0.56).normalized();
    const std::vector<Index> part = parts_of(mesh);
    VectorXd share = (mesh.rest_positions().rowwise() - mesh.rest_positions().row(0)) * b;
    const double c = 0.62 * share.cwiseAbs().maxCoeff();
    for (Index v = 0; v < mesh.n_vertices(); ++v) share[v] += c * part[v];
    return share / std::max(share.cwiseAbs().maxCoeff(), 1e-300);
}

/// Returns `crossing` and those of the touching pairs that cross after the displacement.
std::vector<Pair> crossing_when_moved(const TriangleMesh& mesh, const Rows3& positions, const VectorXd& by,
                                      double close, const std::vector<Pair>& touching,
                                      std::vector<Pair> crossing) {
    const Vec3 a = Vec3(0.53, 0.61, 0.59).normalized();
    const PlacedFaces moved(mesh, positions + by * a.transpose());
    for (const Pair& pair : touching)
        if (moved.meeting(pair.first, pair.second, close) == Meeting::crossing) crossing.push_back(pair);
    return crossing;
}

}  // namespace

std::vector<Pair> self_intersections(const TriangleMesh& mesh, const Rows3& positions) {
    const PlacedFaces faces(mesh, positions);
    const double size = (positions.colwise().maxCoeff() - positions.colwise().minCoeff()).norm();
    // Coordinates are exact to a unit of round-off.
    const double close = close_to * size + 1e-15 * positions.cwiseAbs().maxCoeff();
    std::vector<Pair> crossing, touching;
    near_pairs(tree_of_faces(positions, mesh.faces()), faces, close, [&](Index f, Index g) {
        const Meeting found = faces.meeting(f, g, close);
        if (found == Meeting::crossing) crossing.emplace_back(f, g);
        if (found == Meeting::touching) touching.emplace_back(f, g);
    });
    if (!touching.empty()) {
        const VectorXd by = moved_by * size * shares(mesh);
        const std::vector<Pair> there = crossing_when_moved(mesh, positions, by, close, touching, crossing);
        const std::vector<Pair> back = crossing_when_moved(mesh, positions, -by, close, touching, crossing);
        const Places places_there(mesh, there), places_back(mesh, back);
        for (const Pair& pair : there)
            if (places_back.has(pair)) crossing.push_back(pair);
        for (const Pair& pair : back)
            if (places_there.has(pair)) crossing.push_back(pair);
    }
    std::sort(crossing.begin(), crossing.end());
    crossing.erase(std::unique(crossing.begin(), crossing.end()), crossing.end());
    return crossing;
}

}  // namespace magshell
