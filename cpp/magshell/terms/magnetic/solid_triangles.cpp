#include "magshell/terms/magnetic/solid_triangles.h"

#include <algorithm>
#include <array>

#include "magshell/strain/tetrahedron.h"

namespace magshell {
namespace {

using Corners = std::array<int, 3>;

// The faces of a tetrahedron, counterclockwise from outside.
constexpr Corners faces[4] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

int middle_node(int a, int b) {
    for (int m = 0; m < 6; ++m)
        if ((middle_of[m][0] == a && middle_of[m][1] == b) || (middle_of[m][0] == b && middle_of[m][1] == a))
            return 4 + m;
    return -1;
}

// Returns the triangles of an element as triples of its nodes.
std::vector<Corners> triangles_of_element(bool quadratic) {
    std::vector<Corners> triangles;
    for (const auto& [a, b, c] : faces) {
        if (!quadratic) {
            triangles.push_back({a, b, c});
            continue;
        }
        const int ab = middle_node(a, b), bc = middle_node(b, c), ca = middle_node(c, a);
        triangles.insert(triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    return triangles;
}

struct Side {
    std::array<Index, 3> key;  // nodes in ascending order
    std::array<Index, 3> nodes;
    std::array<Vec3, 3> rest;
    Index tetrahedron;
};

}  // namespace

OwnField::Triangles triangles_of(const std::vector<MagnetizedSolid>& solids) {
    OwnField::Triangles out;
    std::vector<Side> sides;
    for (const auto& [solid, law] : solids) {
        const Index first = static_cast<Index>(out.rotates.size());
        const std::vector<Corners> triangles = triangles_of_element(solid->quadratic());
        for (Index t = 0; t < solid->n_elements(); ++t) {
            const std::span<const Index> nodes = solid->nodes_of(t);
            for (const Corners& corners : triangles) {
                Side& side = sides.emplace_back();
                for (int i = 0; i < 3; ++i) {
                    side.nodes[i] = nodes[corners[i]];
                    side.rest[i] = solid->rest(t, corners[i]);
                }
                side.key = side.nodes;
                std::sort(side.key.begin(), side.key.end());
                side.tetrahedron = first + t;
            }
        }
        out.rotates.insert(out.rotates.end(), solid->n_elements(), law == MagnetizationLaw::rotates);
    }
    std::stable_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.key < b.key; });
    for (std::size_t k = 0; k < sides.size(); ++k) {
        if (k > 0 && sides[k].key == sides[k - 1].key) {
            out.tetrahedra.back()[1] = sides[k].tetrahedron;
            continue;
        }
        out.nodes.push_back(sides[k].nodes);
        out.rest.push_back(sides[k].rest);
        out.tetrahedra.push_back({sides[k].tetrahedron, -1});
    }
    return out;
}

}  // namespace magshell
