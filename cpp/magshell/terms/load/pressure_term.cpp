#include "magshell/terms/load/pressure_term.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/assembly/lanes.h"

namespace magshell {
namespace {

// Relative size below which the sum of contributions of neighbouring faces counts as round-off. [-]
constexpr double cancelled = 1e-13, round_off = 8.0 * std::numeric_limits<double>::epsilon();

// Returns the sum of the coefficients of all parts of a face.
template <class Kernel>
const typename Kernel::Coefficients& of_all_parts() {
    static const typename Kernel::Coefficients known = [] {
        typename Kernel::Coefficients sum{};
        for (const auto& part : Kernel::of_parts())
            for (std::size_t k = 0; k < sum.size(); ++k)
                for (int pair = 0; pair < Kernel::pairs; ++pair) sum[k][pair] += part[k][pair];
        return sum;
    }();
    return known;
}

}  // namespace

PressureTerm::PressureTerm(const std::vector<PressureInput>& inputs, const Nodes& nodes,
                           const SystemMatrix& matrix, Registry& registry)
    : nodes_(nodes), factor_(registry.load_parameters.add("scene", "load_factor", "1", 1, 1)) {
    for (const PressureInput& input : inputs) {
        const Index first = static_cast<Index>(pressures_.size());
        loads_.push_back({registry.values.add(input.owner, "pressure", "Pa", input.rows, 1), first});
        pressures_.resize(first + input.rows, 0.0);
        for (std::size_t face = 0; face < input.nodes.size() / input.nodes_per_face; ++face)
            if (input.nodes_per_face == 3)
                add_face<3>(input, face, first, nodes, matrix);
            else
                add_face<6>(input, face, first, nodes, matrix);
    }
    number_pairs();
}

template <int N>
void PressureTerm::add_face(const PressureInput& input, std::size_t face, Index first, const Nodes& nodes,
                            const SystemMatrix& matrix) {
    Face<N>& added = std::get<std::vector<Face<N>>>(faces_).emplace_back();
    for (int k = 0; k < N; ++k) added.nodes[k] = nodes.vertices.core[input.nodes[N * face + k]];
    constexpr int parts = FacePressure<N>::parts;
    for (int part = 0; part < parts; ++part) {
        const Index row = input.row[parts * face + part];
        added.places[part] = row < 0 ? -1 : first + row;
    }
    added.slices = pair_slots<N>(matrix, added.nodes);
}

void PressureTerm::number_pairs() {
    const auto ends = [](const auto& nodes, int k, int l) -> std::array<Index, 2> {
        return {std::min(nodes[k], nodes[l]), std::max(nodes[k], nodes[l])};
    };
    const auto each_pair = [](const auto& face, const auto& function) {
        for (int k = 0; k < static_cast<int>(face.nodes.size()); ++k)
            for (int l = 0; l <= k; ++l) function(k, l);
    };
    each_face([&](const auto& face) {
        each_pair(face, [&](int k, int l) { pairs_.push_back(ends(face.nodes, k, l)); });
    });
    std::sort(pairs_.begin(), pairs_.end());
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
    const auto number = [&](auto& faces) {
        for (auto& face : faces)
            each_pair(face, [&](int k, int l) {
                const auto place = std::lower_bound(pairs_.begin(), pairs_.end(), ends(face.nodes, k, l));
                face.pairs[lower_index(k, l)] = static_cast<Index>(place - pairs_.begin());
            });
    };
    std::apply([&](auto&... kind) { (number(kind), ...); }, faces_);
}

template <int N>
typename FacePressure<N>::Corners PressureTerm::Face<N>::at(const double* q) const {
    typename Kernel::Corners x;
    for (int k = 0; k < N; ++k) x[k] = Eigen::Map<const Vec3>(q + 3 * nodes[k]);
    return x;
}

template <int N>
typename FacePressure<N>::Coefficients PressureTerm::Face<N>::coefficients(
    const std::vector<double>& pressures) const {
    typename Kernel::Coefficients sum{};
    const auto add = [&](const typename Kernel::Coefficients& a, double pressure) {
        for (int k = 0; k < N; ++k)
            for (int pair = 0; pair < Kernel::pairs; ++pair) sum[k][pair] += pressure * a[k][pair];
    };
    if (places.front() >= 0 && std::equal(places.begin() + 1, places.end(), places.begin())) {
        add(of_all_parts<Kernel>(), pressures[places.front()]);
        return sum;
    }
    for (int part = 0; part < Kernel::parts; ++part)
        if (places[part] >= 0) add(Kernel::of_parts()[part], pressures[places[part]]);
    return sum;
}

bool PressureTerm::set_values(const Values& values) {
    bool changed = false;
    for (const Load& load : loads_) {
        changed |= values.changed(load.slice);
        for (Index row = 0; row < load.slice.rows; ++row)
            pressures_[load.first + row] = values.number(load.slice, row);
    }
    return changed;
}

// Along the straight path from the reference shape the forces are quadratic in the path parameter s, which two
// Gauss points integrate exactly.
double PressureTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    double sum = 0.0;
    each_face([&](const auto& face) {
        using Kernel = typename std::remove_cvref_t<decltype(face)>::Kernel;
        const auto a = face.coefficients(pressures_);
        const typename Kernel::Corners now = face.at(q);
        typename Kernel::Corners moved = now;
        for (std::size_t k = 0; k < now.size(); ++k) moved[k] -= nodes_.rest[face.nodes[k]];
        for (const double sign : {-1.0, 1.0}) {
            const double back = 0.5 - sign * 0.5 / std::sqrt(3.0);
            typename Kernel::Corners between = now;
            for (std::size_t k = 0; k < now.size(); ++k) between[k] -= back * moved[k];
            const typename Kernel::Corners g = Kernel::forces(a, Kernel::relative(between));
            for (std::size_t k = 0; k < now.size(); ++k) sum += 0.5 * g[k].dot(moved[k]);
        }
    });
    return load_parameters[factor_.first] * sum;
}

void PressureTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const double factor = load_parameters[factor_.first];
    each_face([&](const auto& face) {
        using Kernel = typename std::remove_cvref_t<decltype(face)>::Kernel;
        const auto g = Kernel::forces(face.coefficients(pressures_), Kernel::relative(face.at(q)));
        for (std::size_t k = 0; k < g.size(); ++k)
            for (int axis = 0; axis < 3; ++axis) out.add(3 * face.nodes[k] + axis, factor * g[k][axis]);
    });
}

void PressureTerm::finish_assembly(const double* q, const LoadParameters& load_parameters,
                                   SystemMatrix& out) const {
    const double factor = load_parameters[factor_.first];
    if (factor == 0.0) return;
    each_face([&](const auto& face) {
        using Kernel = typename std::remove_cvref_t<decltype(face)>::Kernel;
        constexpr int n = std::tuple_size_v<typename Kernel::Corners>;
        const auto c = Kernel::axes(face.coefficients(pressures_), Kernel::relative(face.at(q)));
        SimdMat3 blocks[n * (n + 1) / 2]{};
        for (int k = 1; k < n; ++k)
            for (int l = 0; l < k; ++l)
                set_skew(blocks[lower_index(k, l)], -0.5 * factor * (c[k][l] - c[l][k]));
        scatter_blocks<n>(out, face.nodes, face.slices, blocks, 0);
    });
}

void PressureTerm::add_nonsymmetric_tangent(const double* q, const LoadParameters& load_parameters,
                                            NonsymmetricTangent& out) const {
    const double factor = load_parameters[factor_.first];
    if (factor == 0.0) return;
    std::vector<Vec3> axes(pairs_.size(), Vec3::Zero());
    std::vector<double> negligible(pairs_.size(), 0.0);
    each_face([&](const auto& face) {
        using Kernel = typename std::remove_cvref_t<decltype(face)>::Kernel;
        const auto a = face.coefficients(pressures_);
        const auto x = face.at(q);
        const auto c = Kernel::axes(a, Kernel::relative(x));
        double largest = 0.0, reach = 0.0;
        for (const auto& row : a)
            for (const double each : row) largest = std::max(largest, std::abs(each));
        for (const Vec3& node : x) reach = std::max(reach, node.lpNorm<Eigen::Infinity>());
        for (int k = 0; k < static_cast<int>(x.size()); ++k)
            for (int l = 0; l <= k; ++l) {
                const Index pair = face.pairs[lower_index(k, l)];
                // A node that takes two places of a face counts both as row and as column.
                const double twice = k != l && face.nodes[k] == face.nodes[l] ? 2.0 : 1.0;
                const Vec3 axis = -0.5 * twice * (c[k][l] + c[l][k]);
                axes[pair] += axis;
                negligible[pair] += cancelled * axis.norm() + round_off * largest * reach;
            }
    });
    for (std::size_t k = 0; k < pairs_.size(); ++k)
        if (axes[k].norm() > negligible[k]) out.add({pairs_[k], factor * axes[k]});
}

void PressureTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                       Gradient& out) {
    const double factor = load_parameters[factor_.first];
    std::vector<double> by_pressure(pressures_.size(), 0.0);
    each_face([&](const auto& face) {
        using Kernel = typename std::remove_cvref_t<decltype(face)>::Kernel;
        const auto y = Kernel::relative(face.at(q)), rate = face.at(lambda);
        for (std::size_t part = 0; part < face.places.size(); ++part) {
            if (face.places[part] < 0) continue;
            const auto g = Kernel::forces(Kernel::of_parts()[part], y);
            for (std::size_t k = 0; k < g.size(); ++k) by_pressure[face.places[part]] += rate[k].dot(g[k]);
        }
    });
    for (const Load& load : loads_)
        for (Index row = 0; row < load.slice.rows; ++row) {
            const double by = by_pressure[load.first + row];
            out.values[load.slice.at(row)] += factor * by;
            out.load_parameters[factor_.first] += pressures_[load.first + row] * by;
        }
}

std::size_t PressureTerm::bytes() const {
    return bytes_of(std::get<0>(faces_)) + bytes_of(std::get<1>(faces_)) + bytes_of(pairs_) +
           bytes_of(pressures_);
}

}  // namespace magshell
