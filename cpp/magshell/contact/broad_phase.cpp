#include "magshell/contact/broad_phase.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "magshell/contact/neighbours.h"
#include "magshell/contact/pair_energy.h"
#include "magshell/contact/proximity.h"
#include "magshell/core/parallel.h"
#include "magshell/core/types.h"

namespace magshell {
namespace {

// [-] Relative round-off of a signed volume; fixed by test_crossings_are_those_of_ipctk
constexpr double round_off = 16.0 * std::numeric_limits<double>::epsilon();

/// Returns the side of the plane through a, b, c on which a point is: 1, -1, or 0 if round-off leaves it open.
int side(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& point) {
    const Vec3 one = a - point, two = b - point, three = c - point;
    const double volume = one.dot(two.cross(three));
    const double bound =
        round_off *
        one.cwiseAbs().dot(Vec3(two.y() * three.z(), two.z() * three.x(), two.x() * three.y()).cwiseAbs() +
                           Vec3(two.z() * three.y(), two.x() * three.z(), two.y() * three.x()).cwiseAbs());
    return volume > bound ? 1 : volume < -bound ? -1 : 0;
}

/// Returns true if an edge and a triangle intersect, also if they are so close that round-off leaves it open.
bool passes_through(const std::array<Vec3, 2>& edge, const std::array<Vec3, 3>& triangle) {
    const auto& [a, b, c] = triangle;
    const int at_begin = side(a, b, c, edge[0]), at_end = side(a, b, c, edge[1]);
    if (at_begin * at_end > 0) return false;
    int least = 1, most = -1;
    bool certain = at_begin != 0 && at_end != 0;
    for (int k = 0; k < 3; ++k) {
        const int turn = side(edge[0], edge[1], triangle[k], triangle[(k + 1) % 3]);
        least = std::min(least, turn);
        most = std::max(most, turn);
        certain = certain && turn != 0;
    }
    if (least < 0 && most > 0) return false;
    if (certain) return true;
    // Here an end is near the plane, or the edge near a side of the triangle, or all of it near one plane: the
    // distance decides.
    double distance = std::numeric_limits<double>::infinity(), size = 0.0;
    for (int k = 0; k < 3; ++k) {
        distance = std::min(distance, pair_distance(PairKind::edge_edge,
                                                    {edge[0], edge[1], triangle[k], triangle[(k + 1) % 3]}));
        size = std::max(size, triangle[k].cwiseAbs().maxCoeff());
    }
    for (const Vec3& end : edge) {
        distance = std::min(distance, pair_distance(PairKind::point_triangle, {end, a, b, c}));
        size = std::max(size, end.cwiseAbs().maxCoeff());
    }
    return distance <= round_off * size;
}

/// A vertex or an edge of one of the triangles near a point.
struct Shared {
    std::array<Index, 2> nodes;  // lower first; twice the same for a vertex
    std::size_t from;            // index of the pair

    bool operator<(const Shared& other) const { return nodes < other.nodes; }
};

/// Calls visit(first, count) for each group of equal entries.
template <class Visit>
void each_group(const std::vector<Shared>& all, const Visit& visit) {
    for (std::size_t k = 0, after; k < all.size(); k = after) {
        for (after = k + 1; after < all.size() && all[after].nodes == all[k].nodes;) ++after;
        visit(k, static_cast<int>(after - k));
    }
}

/// Adds correction pairs to `all` for the pairs of a point and a triangle from `first` on: pairs of the same
/// point with the edges and vertices that its triangles share, if they are closer than `margin` [m] with nodes
/// at q. The pairs of one point must be consecutive.
///
/// It counts triangles minus shared edges plus vertices, which is 1 for any region of a surface without holes
/// (Euler characteristic). Neighbouring parts with a reduced activation distance do not count, because each has
/// a law of its own.
void add_overcount_corrections(std::size_t first, const double* q, double margin,
                               std::vector<NearPair>& all) {
    std::vector<Shared> edges, vertices;
    std::vector<int> shared;  // number of shared edges at each vertex, at its first entry
    const auto add = [&](const Shared& shared, PairKind kind, int times) {
        NearPair near = all[shared.from];
        near.pair.kind = kind;
        near.pair.area *= times;
        near.pair.nodes = {near.pair.nodes[0], shared.nodes[0],
                           kind == PairKind::point_edge ? shared.nodes[1] : -1, -1};
        if (pair_distance(kind, positions_of(near.pair, q)) < margin) all.push_back(near);
    };
    const std::size_t end = all.size();
    for (std::size_t begin = first, next; begin < end; begin = next) {
        const Index point = all[begin].pair.nodes[0];
        for (next = begin + 1; next < end && all[next].pair.nodes[0] == point;) ++next;
        if (next == begin + 1) continue;
        edges.clear();
        vertices.clear();
        for (std::size_t k = begin; k < next; ++k) {
            if (std::isfinite(all[k].pair.room)) continue;
            const std::array<Index, 4>& nodes = all[k].pair.nodes;
            for (int i = 1; i < 4; ++i) {
                const auto [low, high] = std::minmax(nodes[i], nodes[i % 3 + 1]);
                edges.push_back({{low, high}, k});
                vertices.push_back({{nodes[i], nodes[i]}, k});
            }
        }
        std::stable_sort(edges.begin(), edges.end());
        std::stable_sort(vertices.begin(), vertices.end());
        shared.assign(vertices.size(), 0);
        const auto place_of = [&](Index node) {
            return std::lower_bound(vertices.begin(), vertices.end(), Shared{{node, node}, 0}) -
                   vertices.begin();
        };
        each_group(edges, [&](std::size_t k, int count) {
            if (count == 1) return;
            for (Index node : edges[k].nodes) shared[place_of(node)] += count - 1;
            add(edges[k], PairKind::point_edge, 1 - count);
        });
        each_group(vertices, [&](std::size_t k, int count) {
            const int times = 1 - count + shared[k];
            if (times != 0) add(vertices[k], PairKind::point_point, times);
        });
    }
}

// [-] of the product of squared reference lengths, below which edges count as parallel
// (contact/parallel_edges.h); fixed by test_energies_are_those_of_ipctk
constexpr double parallel_share = 1e-3;
constexpr std::size_t block_of_pairs = 1024;  // [pairs] per task; plain-words: ok

std::uint64_t key_of(Index first, Index second) {
    return static_cast<std::uint64_t>(first) << 32 | static_cast<std::uint32_t>(second);
}
Index first_of(std::uint64_t key) {
    return static_cast<Index>(key >> 32);
}
Index second_of(std::uint64_t key) {
    return static_cast<Index>(key & 0xffffffffu);
}

template <class Nodes>
bool has(const Nodes& nodes, Index node) {
    return std::find(nodes.begin(), nodes.end(), node) != nodes.end();
}

}  // namespace

BroadPhase::BroadPhase(std::vector<ContactSurface> surfaces, std::vector<SurfacePair> contacts)
    : surfaces_(std::move(surfaces)),
      contacts_(std::move(contacts)),
      rooms_(contacts_.size()),
      nearest_(contacts_.size()) {
    boxes_.reserve(surfaces_.size());
    for (const ContactSurface& surface : surfaces_) boxes_.emplace_back(surface);
}

void BroadPhase::fit(const NodePaths& ways) {
    for (FaceBoxes& each : boxes_) each.fit(ways);
}

BroadPhase::Keys BroadPhase::find(Index contact, const NodePaths& ways, double margin) const {
    const Index of_a = contacts_[contact].a, of_b = contacts_[contact].b;
    const ContactSurface &a = surfaces_[of_a], &b = surfaces_[of_b];
    std::vector<Keys> found;
    const auto points = [&](const ContactSurface& one, Index f, const FaceBoxes& boxes,
                            const ContactSurface& other, Index g, std::vector<Key>& keys) {
        const ContactSurface::Brought& brought = one.brought[f];
        for (int k = 0; k < brought.n_vertices; ++k) {
            const Index v = brought.vertices[k], node = one.vertices[v];
            if (has(other.faces[g], node)) continue;
            if (ways.around({&node, 1}).meets(boxes.box(g), margin)) keys.push_back(key_of(v, g));
        }
    };
    near_faces(
        boxes_[of_a], boxes_[of_b], margin, [&](int tasks) { found.resize(tasks); },
        [&](int task, Index f, Index g) {
            Keys& keys = found[task];
            points(a, f, boxes_[of_b], b, g, keys.of[0]);
            points(b, g, boxes_[of_a], a, f, keys.of[of_a == of_b ? 0 : 1]);
            const ContactSurface::Brought &one = a.brought[f], &two = b.brought[g];
            for (int k = 0; k < one.n_edges; ++k) {
                const ContactSurface::Edge& edge = a.edges[one.edges[k]];
                const Bounds around = ways.around(edge);
                for (int l = 0; l < two.n_edges; ++l) {
                    const ContactSurface::Edge& other = b.edges[two.edges[l]];
                    if (has(other, edge[0]) || has(other, edge[1]) ||
                        !around.meets(ways.around(other), margin))
                        continue;
                    auto [first, second] = std::pair(one.edges[k], two.edges[l]);
                    if (of_a == of_b && first > second) std::swap(first, second);
                    keys.of[2].push_back(key_of(first, second));
                }
            }
        });
    Keys all;
    for (int sort = 0; sort < 3; ++sort) {
        for (const Keys& part : found)
            all.of[sort].insert(all.of[sort].end(), part.of[sort].begin(), part.of[sort].end());
        std::sort(all.of[sort].begin(), all.of[sort].end());
    }
    return all;
}

NearPair BroadPhase::pair_of(Index contact, Sort sort, Key key) const {
    const bool swapped = sort == Sort::of_b_on_a;
    const ContactSurface& a = surfaces_[swapped ? contacts_[contact].b : contacts_[contact].a];
    const ContactSurface& b = surfaces_[swapped ? contacts_[contact].a : contacts_[contact].b];
    const Index first = first_of(key), second = second_of(key);
    NearPair near{contact, {}, 0, 0, swapped};
    if (sort == Sort::edges) {
        const ContactSurface::Edge &one = a.edges[first], &two = b.edges[second];
        const double product = a.edge_lengths[first] * b.edge_lengths[second];
        near.pair = {PairKind::edge_edge,
                     {one[0], one[1], two[0], two[1]},
                     0.25 * std::min(a.edge_areas[first], b.edge_areas[second]),
                     parallel_share * product * product};
        near.first_face = a.edge_faces[first];
        near.second_face = b.edge_faces[second];
    } else {
        const ContactSurface::Face& face = b.faces[second];
        near.pair = {PairKind::point_triangle,
                     {a.vertices[first], face[0], face[1], face[2]},
                     0.5 * a.vertex_areas[first]};
        near.first_face = a.vertex_faces[first];
        near.second_face = second;
    }
    const auto& rooms = rooms_[contact].of[static_cast<int>(sort)];
    const auto at =
        std::lower_bound(rooms.begin(), rooms.end(), key,
                         [](const std::pair<Key, double>& room, Key k) { return room.first < k; });
    if (at != rooms.end() && at->first == key) near.pair.room = at->second;
    return near;
}

std::vector<NearPair> BroadPhase::near(const double* q, const std::vector<double>& margins) {
    const NodePaths ways(q);
    fit(ways);
    std::vector<NearPair> all;
    for (Index contact = 0; contact < static_cast<Index>(contacts_.size()); ++contact) {
        const Keys keys = find(contact, ways, margins[contact]);
        for (int sort = 0; sort < 3; ++sort) {
            const std::vector<Key>& of = keys.of[sort];
            std::vector<std::vector<NearPair>> parts((of.size() + block_of_pairs - 1) / block_of_pairs);
            parallel_for(static_cast<int>(parts.size()), [&](int part) {
                const std::size_t end = std::min(of.size(), (part + 1) * block_of_pairs);
                for (std::size_t k = part * block_of_pairs; k < end; ++k) {
                    NearPair near = pair_of(contact, static_cast<Sort>(sort), of[k]);
                    if (pair_distance(near.pair.kind, positions_of(near.pair, q)) < margins[contact])
                        parts[part].push_back(near);
                }
            });
            const std::size_t first = all.size();
            for (const std::vector<NearPair>& part : parts) all.insert(all.end(), part.begin(), part.end());
            if (sort < 2) add_overcount_corrections(first, q, margins[contact], all);
        }
    }
    return all;
}

std::vector<NearPair> BroadPhase::near_along_path(const double* q, const double* end,
                                                  const std::vector<double>& margins) {
    const NodePaths ways(q, end);
    fit(ways);
    std::vector<NearPair> all;
    for (Index contact = 0; contact < static_cast<Index>(contacts_.size()); ++contact) {
        const Keys keys = find(contact, ways, margins[contact]);
        for (int sort = 0; sort < 3; ++sort)
            for (Key key : keys.of[sort]) all.push_back(pair_of(contact, static_cast<Sort>(sort), key));
    }
    return all;
}

void BroadPhase::make_room(const std::vector<Vec3>& rest, const std::vector<double>& near_at_rest) {
    rooms_.assign(contacts_.size(), {});
    nearest_.assign(contacts_.size(), {});
    Rows3 places(rest.size(), 3);
    for (std::size_t k = 0; k < rest.size(); ++k) places.row(k) = rest[k].transpose();
    const NodePaths ways(places.data());
    fit(ways);
    Neighbours neighbours(surfaces_, rest);
    for (Index contact = 0; contact < static_cast<Index>(contacts_.size()); ++contact) {
        if (!neighbours.connected(contacts_[contact].a, contacts_[contact].b)) continue;
        const Keys keys = find(contact, ways, near_at_rest[contact]);
        for (int sort = 0; sort < 3; ++sort)
            for (Key key : keys.of[sort]) {
                const NearPair near = pair_of(contact, static_cast<Sort>(sort), key);
                const double distance = pair_distance(near.pair.kind, positions_of(near.pair, places.data()));
                if (distance >= near_at_rest[contact] || !neighbours.are(near.pair, distance)) continue;
                rooms_[contact].of[sort].push_back({key, 0.5 * distance});
                if (!nearest_[contact] || distance < nearest_[contact]->distance)
                    nearest_[contact] = {distance, near};
            }
    }
}

std::vector<NearPair> BroadPhase::crossings(const double* q) {
    fit(NodePaths(q));
    std::vector<NearPair> all;
    for (Index contact = 0; contact < static_cast<Index>(contacts_.size()); ++contact) {
        const Index of_a = contacts_[contact].a, of_b = contacts_[contact].b;
        std::vector<std::vector<NearPair>> found;
        const auto edges_through = [&](const ContactSurface& one, Index f, const ContactSurface& other,
                                       Index g, bool swapped, std::vector<NearPair>& out) {
            const ContactSurface::Brought& brought = one.brought[f];
            const ContactSurface::Face& face = other.faces[g];
            for (int k = 0; k < brought.n_edges; ++k) {
                const ContactSurface::Edge& edge = one.edges[brought.edges[k]];
                if (has(face, edge[0]) || has(face, edge[1])) continue;
                const auto at = [&](Index node) { return Vec3(Eigen::Map<const Vec3>(q + 3 * node)); };
                if (!passes_through({at(edge[0]), at(edge[1])}, {at(face[0]), at(face[1]), at(face[2])}))
                    continue;
                NearPair& near = out.emplace_back();
                near.contact = contact;
                near.first_face = f;
                near.second_face = g;
                near.swapped = swapped;
            }
        };
        near_faces(
            boxes_[of_a], boxes_[of_b], 0.0, [&](int tasks) { found.resize(tasks); },
            [&](int task, Index f, Index g) {
                edges_through(surfaces_[of_a], f, surfaces_[of_b], g, false, found[task]);
                edges_through(surfaces_[of_b], g, surfaces_[of_a], f, of_a != of_b, found[task]);
            });
        const std::size_t first = all.size();
        for (const std::vector<NearPair>& part : found) all.insert(all.end(), part.begin(), part.end());
        const auto order = [](const NearPair& near) {
            return std::tuple(near.swapped, near.first_face, near.second_face);
        };
        std::sort(all.begin() + first, all.end(),
                  [&](const NearPair& one, const NearPair& other) { return order(one) < order(other); });
        all.erase(std::unique(all.begin() + first, all.end()), all.end());
    }
    return all;
}

std::size_t BroadPhase::bytes() const {
    std::size_t sum = 0;
    for (const FaceBoxes& each : boxes_) sum += each.bytes();
    for (const Rooms& each : rooms_)
        for (const auto& of : each.of) sum += of.capacity() * sizeof(of[0]);
    return sum;
}

}  // namespace magshell
