#include "magshell/term/near_pairs.h"

#include <algorithm>
#include <map>

namespace magshell {

NearPairs::NearPairs(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
                     const std::vector<BodyContactInput>& contacts)
    : contacts_(contacts) {
    double edge_sum = 0.0;
    Index n_edges = 0;
    for (const ContactSurfaceInput& given : surfaces) {
        Surface& s = surfaces_.emplace_back();
        s.name = given.name;
        s.numbers = given.numbers;
        std::map<Index, std::pair<double, Index>> vertices;
        std::map<std::array<Index, 2>, std::pair<double, Index>> edges;
        for (const std::array<Index, 3>& face : given.faces) {
            std::array<Index, 3> own;
            for (int k = 0; k < 3; ++k) own[k] = nodes.vertices.core[face[k]];
            const Index f = static_cast<Index>(s.faces.size());
            s.faces.push_back(own);
            const Vec3 &a = nodes.rest[own[0]], &b = nodes.rest[own[1]], &c = nodes.rest[own[2]];
            const double third = (b - a).cross(c - a).norm() / 6.0;
            for (int k = 0; k < 3; ++k) {
                vertices.try_emplace(own[k], 0.0, f).first->second.first += third;
                const auto [low, high] = std::minmax(own[k], own[(k + 1) % 3]);
                edges.try_emplace({low, high}, 0.0, f).first->second.first += third;
            }
        }
        for (const auto& [v, entry] : vertices) {
            s.vertices.push_back(v);
            s.vertex_areas.push_back(entry.first);
            s.vertex_faces.push_back(entry.second);
        }
        for (const auto& [e, entry] : edges) {
            s.edges.push_back(e);
            s.edge_areas.push_back(entry.first);
            s.edge_faces.push_back(entry.second);
            s.edge_lengths.push_back((nodes.rest[e[0]] - nodes.rest[e[1]]).norm());
            edge_sum += s.edge_lengths.back();
            ++n_edges;
        }
    }
    margin_ = n_edges > 0 ? 0.25 * edge_sum / n_edges : 0.0;
}

void NearPairs::set_distances(std::vector<double> distances) {
    distances_ = std::move(distances);
    built_at_.resize(0);
}

template <class Take>
void NearPairs::each_pair(const Take& take) const {
    const auto shares = [](const auto& nodes, Index v) {
        return std::find(nodes.begin(), nodes.end(), v) != nodes.end();
    };
    for (Index c = 0; c < static_cast<Index>(contacts_.size()); ++c) {
        const Surface &a = surfaces_[contacts_[c].a], &b = surfaces_[contacts_[c].b];
        const bool self = &a == &b;
        const auto points = [&](const Surface& one, const Surface& other, bool swapped) {
            for (std::size_t v = 0; v < one.vertices.size(); ++v)
                for (std::size_t f = 0; f < other.faces.size(); ++f) {
                    if (shares(other.faces[f], one.vertices[v])) continue;
                    const std::array<Index, 3>& t = other.faces[f];
                    take(NearPair{c,
                                  {PairKind::point_triangle, {one.vertices[v], t[0], t[1], t[2]},
                                   one.vertex_areas[v], 0.0},
                                  one.vertex_faces[v], static_cast<Index>(f), swapped});
                }
        };
        points(a, b, false);
        if (!self) points(b, a, true);
        for (std::size_t i = 0; i < a.edges.size(); ++i)
            for (std::size_t j = self ? i + 1 : 0; j < b.edges.size(); ++j) {
                const std::array<Index, 2>&e = a.edges[i], &g = b.edges[j];
                if (shares(g, e[0]) || shares(g, e[1])) continue;
                const double product = a.edge_lengths[i] * b.edge_lengths[j];
                take(NearPair{c,
                              {PairKind::edge_edge, {e[0], e[1], g[0], g[1]},
                               0.5 * (a.edge_areas[i] + b.edge_areas[j]), 1e-3 * product * product},
                              a.edge_faces[i], b.edge_faces[j], false});
            }
    }
}

const std::vector<NearPair>& NearPairs::at(const double* q) const {
    Index last = 0;
    for (const Surface& s : surfaces_) last = std::max(last, s.vertices.back());
    const Eigen::Map<const VectorXd> now(q, 3 * (last + 1));
    if (built_at_.size() == now.size()) {
        double moved = 0.0;
        for (Index k = 0; k <= last; ++k)
            moved = std::max(moved, (now.segment<3>(3 * k) - built_at_.segment<3>(3 * k)).norm());
        if (2.0 * moved <= margin_) return near_;
    }
    built_at_ = now;
    near_.clear();
    each_pair([&](const NearPair& pair) {
        PairPlaces x;
        for (int k = 0; k < 4; ++k) x[k] = now.segment<3>(3 * pair.pair.nodes[k]);
        if (pair_distance(pair.pair.kind, x) <= distances_[pair.contact] + margin_) near_.push_back(pair);
    });
    return near_;
}

std::vector<NearPair> NearPairs::along(const double* q, const double* p) const {
    std::vector<NearPair> found;
    each_pair([&](const NearPair& pair) {
        PairPlaces x;
        double reach = distances_[pair.contact];
        for (int k = 0; k < 4; ++k) {
            x[k] = Eigen::Map<const Vec3>(q + 3 * pair.pair.nodes[k]);
            reach += Eigen::Map<const Vec3>(p + 3 * pair.pair.nodes[k]).norm();
        }
        if (pair_distance(pair.pair.kind, x) <= reach) found.push_back(pair);
    });
    return found;
}

std::string NearPairs::names(const NearPair& pair) const {
    const BodyContactInput& of = contacts_[pair.contact];
    const Surface &one = surfaces_[pair.swapped ? of.b : of.a], &other = surfaces_[pair.swapped ? of.a : of.b];
    return "face " + std::to_string(one.numbers[pair.first_face]) + " of " + one.name + " and face " +
           std::to_string(other.numbers[pair.second_face]) + " of " + other.name;
}

std::size_t NearPairs::bytes() const {
    return near_.capacity() * sizeof(NearPair);
}

}  // namespace magshell
