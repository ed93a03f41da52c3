#include "magshell/mesh/triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <sstream>
#include <utility>
#include <vector>

#include "magshell/core/errors.h"
#include "magshell/mesh/half_edges.h"

namespace magshell {

namespace {

// Smallest ratio of twice the area of a face to its squared longest edge. [-] It is sqrt(3)/2 for an
// equilateral face; below this value it is lost in the round-off of the coordinates. It has no unit, so a mesh
// of microns is judged like one of metres.
constexpr double degenerate_ratio = 1e-10;

template <class... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
    std::ostringstream message;
    (message << ... << parts);
    throw InvalidInput(message.str());
}

struct Triple {
    std::int64_t a, b, c;
    friend std::ostream& operator<<(std::ostream& out, const Triple& t) {
        return out << '(' << t.a << ", " << t.b << ", " << t.c << ')';
    }
};

void check_positions(const Rows3& positions) {
    if (positions.rows() > std::numeric_limits<Index>::max()) {
        refuse("rest_positions has ", positions.rows(), " rows, more than 32-bit indices can count");
    }
    for (Eigen::Index v = 0; v < positions.rows(); ++v) {
        if (!positions.row(v).allFinite()) {
            refuse("rest_positions [m] must be finite, but vertex ", v, " is at (", positions(v, 0), ", ",
                   positions(v, 1), ", ", positions(v, 2), ")");
        }
    }
}

// Checks the half-edges of one edge, in the order of their faces. One half-edge is a boundary edge, two of
// opposite directions an interior one; anything else throws.
void check_edge(std::span<const HalfEdge> group, const Rows3i& faces) {
    const auto opposite = [&](const HalfEdge& h) { return faces(h.face, h.corner); };
    for (std::size_t i = 0; i < group.size(); ++i) {
        for (std::size_t j = i + 1; j < group.size(); ++j) {
            if (opposite(group[i]) == opposite(group[j])) {
                const Index f = group[i].face;
                refuse("faces ", f, " and ", group[j].face, " have the same vertices ",
                       Triple{faces(f, 0), faces(f, 1), faces(f, 2)}, "; every face must be given once");
            }
        }
    }
    const HalfEdge& first = group.front();
    if (group.size() > 2) {
        refuse("edge (", first.low, ", ", first.high, ") belongs to ", group.size(), " faces (",
               group[0].face, ", ", group[1].face, ", ", group[2].face, group.size() > 3 ? ", ...)" : ")",
               "; a manifold surface has at most 2 at an edge");
    }
    if (group.size() == 2 && group[0].forward == group[1].forward) {
        const Index from = first.forward ? first.low : first.high;
        const Index to = first.forward ? first.high : first.low;
        refuse("faces ", group[0].face, " and ", group[1].face, " both run their common edge from vertex ",
               from, " to ", to,
               ", so their normals point to opposite sides. Reverse the vertices of one of them, or take ",
               "flipped() of the part it belongs to; a one-sided surface (a Moebius strip) cannot be "
               "oriented and is ",
               "not supported");
    }
}

}  // namespace

TriangleMesh::TriangleMesh(Rows3 rest_positions, const Rows3l& faces)
    : rest_positions_(std::move(rest_positions)) {
    check_positions(rest_positions_);
    check_faces(faces);
    faces_ = faces.cast<Index>();
    connect();
}

void TriangleMesh::check_faces(const Rows3l& faces) const {
    if (faces.rows() == 0) refuse("faces is empty; a mesh has at least one face");
    if (faces.rows() > std::numeric_limits<Index>::max() / 3) {
        refuse("faces has ", faces.rows(), " rows, more than 32-bit indices can count");
    }
    std::vector<bool> used(rest_positions_.rows(), false);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
        const Triple face{faces(f, 0), faces(f, 1), faces(f, 2)};
        for (const std::int64_t vertex : {face.a, face.b, face.c}) {
            if (vertex < 0 || vertex >= n_vertices()) {
                refuse("face ", f, " ", face, " names vertex ", vertex, ", but vertices are numbered 0 to ",
                       n_vertices() - 1);
            }
            used[vertex] = true;
        }
        if (face.a == face.b || face.b == face.c || face.c == face.a) {
            refuse("face ", f, " ", face, " names a vertex twice; a triangle has three different ones");
        }
        const Vec3 a0 = rest_positions_.row(face.c) - rest_positions_.row(face.b);
        const Vec3 a1 = rest_positions_.row(face.a) - rest_positions_.row(face.c);
        const double double_area = a0.cross(a1).norm();
        const double longest2 = std::max({a0.squaredNorm(), a1.squaredNorm(), (a0 + a1).squaredNorm()});
        if (!(double_area > degenerate_ratio * longest2)) {
            refuse("face ", f, " ", face, " is degenerate: area ", 0.5 * double_area,
                   " m2 for a longest edge of ", std::sqrt(longest2),
                   " m; its vertices coincide or lie on a line");
        }
    }
    const auto unused = std::find(used.begin(), used.end(), false);
    if (unused != used.end()) {
        refuse("vertex ", unused - used.begin(), " belongs to no face (",
               std::count(unused, used.end(), false), " such vertices of ", n_vertices(),
               "); remove unused vertices and renumber the faces");
    }
}

void TriangleMesh::connect() {
    const std::vector<HalfEdge> half_edges = sorted_half_edges(faces_, n_vertices());
    const auto same_edge = [](const HalfEdge& a, const HalfEdge& b) {
        return a.low == b.low && a.high == b.high;
    };

    Index n_edges = 0;
    for (std::size_t i = 0; i < half_edges.size(); ++i) {
        if (i == 0 || !same_edge(half_edges[i - 1], half_edges[i])) ++n_edges;
    }
    edges_.resize(n_edges, 2);
    edge_faces_.setConstant(n_edges, 2, none);
    face_edges_.resize(n_faces(), 3);

    Index edge = 0;
    for (auto begin = half_edges.begin(); begin != half_edges.end(); ++edge) {
        const auto end = std::find_if_not(begin, half_edges.end(),
                                          [&](const HalfEdge& h) { return same_edge(*begin, h); });
        check_edge({begin, end}, faces_);
        edges_.row(edge) << begin->low, begin->high;
        for (auto h = begin; h != end; ++h) {
            edge_faces_(edge, h->forward ? 0 : 1) = h->face;
            face_edges_(h->face, h->corner) = edge;
        }
        begin = end;
    }
}

}  // namespace magshell
