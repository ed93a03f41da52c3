#include "magshell/terms/actuator/volume_term.h"

#include <algorithm>
#include <cmath>

#include "magshell/assembly/lanes.h"

namespace magshell {
namespace {

template <std::size_t N>
std::array<Vec3, N> corners_of(const std::array<Index, N>& places, const std::vector<Vec3>& x) {
    std::array<Vec3, N> corners;
    for (std::size_t k = 0; k < N; ++k) corners[k] = x[places[k]];
    return corners;
}

template <int N>
void add_curvature(const std::array<Vec3, N>& x, double factor, SimdMat3 blocks[]) {
    std::array<Vec3, N*(N + 1) / 2> axes;
    axes.fill(Vec3::Zero());
    VolumeForm<N>::curvature(
        x, [&](int row, int column, const Vec3& axis) { axes[lower_index(row, column)] += factor * axis; });
    for (int row = 1; row < N; ++row)
        for (int column = 0; column < row; ++column)
            set_skew(blocks[lower_index(row, column)], axes[lower_index(row, column)]);
}

}  // namespace

VolumeTerm::VolumeTerm(const std::vector<VolumeInput>& inputs, const Nodes& nodes, const SystemMatrix& matrix,
                       Registry& registry)
    : nodes_(nodes), factor_(registry.load_parameters.add("scene", "load_factor", "1", 1, 1)) {
    for (const VolumeInput& input : inputs) {
        const VolumeNames names = names_of(input.law);
        const Index rows = static_cast<Index>(input.surfaces.size());
        std::array<ParameterSlice, 2> slots;
        for (int k = 0; k < 2; ++k)
            if (names.names[k])
                slots[k] = registry.values.add(input.owner, names.names[k], names.units[k], rows, 1);
        for (Index row = 0; row < rows; ++row) add(input, input.surfaces[row], row, slots, nodes, matrix);
    }
}

void VolumeTerm::add(const VolumeInput& input, const ClosedSurface& surface, Index row,
                     std::array<ParameterSlice, 2> slots, const Nodes& nodes, const SystemMatrix& matrix) {
    Volume& added = volumes_.emplace_back();
    added.law = input.law;
    added.slots = slots;
    added.row = row;
    added.stays_open = input.stays_open;
    for (const std::vector<Index>& of_faces : {surface.triangles, surface.curved})
        for (const Index user : of_faces) added.nodes.push_back(nodes.vertices.core[user]);
    std::sort(added.nodes.begin(), added.nodes.end());
    added.nodes.erase(std::unique(added.nodes.begin(), added.nodes.end()), added.nodes.end());
    const auto add_faces = [&]<int N>(const std::vector<Index>& users, const std::vector<double>& weights,
                                      std::vector<Face<N>>& faces) {
        for (std::size_t f = 0; f < weights.size(); ++f) {
            std::array<Index, N> of_face;
            Face<N>& face = faces.emplace_back();
            for (int k = 0; k < N; ++k) {
                of_face[k] = nodes.vertices.core[users[N * f + k]];
                face.places[k] =
                    static_cast<Index>(std::lower_bound(added.nodes.begin(), added.nodes.end(), of_face[k]) -
                                       added.nodes.begin());
            }
            face.slots = pair_slots<N>(matrix, of_face);
            face.weight = weights[f];
        }
    };
    add_faces.operator()<3>(surface.triangles, surface.weights, added.triangles);
    add_faces.operator()<6>(surface.curved, surface.curved_weights, added.curved);
    if (input.coupled)
        for (std::size_t i = 1; i < added.nodes.size(); ++i)
            for (std::size_t j = 0; j < i; ++j)
                added.pairs.push_back(matrix.node_slot(added.nodes[i], added.nodes[j]));
    added.rest = added.volume_at(added.at_rest(nodes));
}

std::vector<Vec3> VolumeTerm::Volume::at_rest(const Nodes& all) const {
    std::vector<Vec3> x;
    for (const Index node : nodes) x.push_back(all.rest[node] - all.rest[nodes[0]]);
    return x;
}

std::vector<Vec3> VolumeTerm::Volume::at(const double* q) const {
    std::vector<Vec3> x(nodes.size());
    const Vec3 origin = Eigen::Map<const Vec3>(q + 3 * nodes.front());
    for (std::size_t k = 0; k < nodes.size(); ++k) x[k] = Eigen::Map<const Vec3>(q + 3 * nodes[k]) - origin;
    return x;
}

double VolumeTerm::Volume::volume_at(const std::vector<Vec3>& x) const {
    double sum = 0.0;
    for (const Face<3>& face : triangles)
        sum += face.weight * VolumeForm<3>::volume(corners_of(face.places, x));
    for (const Face<6>& face : curved) sum += face.weight * VolumeForm<6>::volume(corners_of(face.places, x));
    return sum;
}

void VolumeTerm::Volume::add_slopes(const std::vector<Vec3>& x, std::vector<Vec3>& out) const {
    const auto add_faces = [&]<int N>(const std::vector<Face<N>>& faces) {
        for (const Face<N>& face : faces) {
            const auto slopes = VolumeForm<N>::slopes(corners_of(face.places, x));
            for (int k = 0; k < N; ++k) out[face.places[k]] += face.weight * slopes[k];
        }
    };
    add_faces(triangles);
    add_faces(curved);
}

double VolumeTerm::Volume::along(const double* p) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < nodes.size(); ++k)
        sum += slopes[k].dot(Eigen::Map<const Vec3>(p + 3 * nodes[k]));
    return sum;
}

bool VolumeTerm::set_values(const Values& values) {
    for (Volume& each : volumes_)
        for (int k = 0; k < 2; ++k)
            if (each.slots[k].entry >= 0) each.numbers[k] = values.number(each.slots[k], each.row);
    return false;  // its round-off depends on the state only
}

Capabilities VolumeTerm::capabilities() const {
    return {.has_infeasible_states = std::any_of(volumes_.begin(), volumes_.end(),
                                                 [](const Volume& each) { return each.stays_open; })};
}

// Along a straight path the volume is a cubic: V(q) + s V'(q) p + s^2 V'(p) q + s^3 V(p).
double VolumeTerm::max_step_length(const double* q, const double* p) const {
    constexpr int samples = 64, halvings = 50;
    double share = 1.0;
    for (const Volume& each : volumes_) {
        if (!each.stays_open) continue;
        const std::vector<Vec3> x = each.at(q), d = each.at(p);
        std::vector<Vec3> by_x(x.size(), Vec3::Zero()), by_d = by_x;
        each.add_slopes(x, by_x);
        each.add_slopes(d, by_d);
        double first = 0.0, second = 0.0;
        for (std::size_t k = 0; k < x.size(); ++k) {
            first += by_x[k].dot(d[k]);
            second += by_d[k].dot(x[k]);
        }
        const double start = each.volume_at(x), third = each.volume_at(d);
        const auto volume = [&](double s) { return start + s * (first + s * (second + s * third)); };
        double open = 0.0;
        for (int k = 1; k <= samples; ++k) {
            const double end = share * k / samples;
            if (volume(end) > 0.0) {
                open = end;
                continue;
            }
            double closed = end;
            for (int half = 0; half < halvings; ++half) {
                const double middle = 0.5 * (open + closed);
                (volume(middle) > 0.0 ? open : closed) = middle;
            }
            share = open;
            break;
        }
    }
    return share;
}

std::string VolumeTerm::invalid_state_reason(const double* q) const {
    for (const Volume& each : volumes_)
        if (const double volume = each.stays_open ? each.volume_at(each.at(q)) : 1.0; !(volume > 0.0))
            return "a cavity of " + std::to_string(each.rest) + " m3 at rest is left with a volume of " +
                   std::to_string(volume / each.rest) +
                   " times that: it has collapsed, or been turned inside out";
    return {};
}

double VolumeTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    double sum = 0.0;
    for (const Volume& each : volumes_)
        sum += VolumeEnergy(each.law, each.numbers, each.rest, each.volume_at(each.at(q)),
                            load_parameters[factor_.first])
                   .energy;
    return sum;
}

void VolumeTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    for (Volume& each : volumes_) {
        const std::vector<Vec3> x = each.at(q);
        each.volume = each.volume_at(x);
        each.slopes.assign(x.size(), Vec3::Zero());
        each.add_slopes(x, each.slopes);
        const VolumeEnergy law(each.law, each.numbers, each.rest, each.volume,
                               load_parameters[factor_.first]);
        each.slope = each.extrapolated = law.slope;
        each.curvature = law.curvature;
        each.magnitude = law.magnitude;
        for (std::size_t k = 0; k < x.size(); ++k)
            for (int axis = 0; axis < 3; ++axis)
                out.add(3 * each.nodes[k] + axis, (law.slope + each.frozen_rate) * each.slopes[k][axis]);
    }
}

void VolumeTerm::extrapolate(const double* p) {
    for (Volume& each : volumes_) each.extrapolated = each.slope + each.curvature * each.along(p);
}

void VolumeTerm::freeze_stress_rates(const double* p) {
    for (Volume& each : volumes_) each.frozen_rate = p ? each.curvature * each.along(p) : 0.0;
}

bool VolumeTerm::has_stress_work_vjp() const {
    return std::all_of(volumes_.begin(), volumes_.end(),
                       [](const Volume& each) { return each.law == VolumeLaw::pressure; });
}

void VolumeTerm::finish_assembly(const double* q, const LoadParameters&, SystemMatrix& out) const {
    for (const Volume& each : volumes_) {
        const std::vector<Vec3> x = each.at(q);
        const double own =
            positive_definite_ && has_target_volume(each.law) && each.pairs.empty() ? 0.0 : each.slope;
        const double slope = (extrapolated_ ? each.extrapolated : own) + each.frozen_rate;
        if (slope == 0.0 && each.curvature == 0.0) continue;
        const auto add_faces = [&]<int N>(const std::vector<Face<N>>& faces) {
            for (const Face<N>& face : faces) {
                SimdMat3 blocks[N * (N + 1) / 2]{};
                add_curvature<N>(corners_of(face.places, x), face.weight * slope, blocks);
                std::array<Index, N> nodes;
                for (int k = 0; k < N; ++k) nodes[k] = each.nodes[face.places[k]];
                scatter_blocks<N>(out, nodes, face.slots, blocks, 0);
            }
        };
        add_faces(each.triangles);
        add_faces(each.curved);
        if (!each.pairs.empty()) add_outer_product(each, each.curvature, out);
    }
}

void VolumeTerm::add_outer_product(const Volume& volume, double stiffness, SystemMatrix& out) const {
    for (std::size_t i = 0; i < volume.nodes.size(); ++i) {
        const Vec3 row = stiffness * volume.slopes[i];
        out.add_diagonal_block(volume.nodes[i], Mat3(row * volume.slopes[i].transpose()));
        for (std::size_t j = 0; j < i; ++j) {
            const SystemMatrix::Slot slot =
                volume.pairs[lower_index(static_cast<int>(i) - 1, static_cast<int>(j))];
            const Index length = out.column_length(volume.nodes[slot & 1 ? i : j]);
            out.add_block(slot, length, Mat3(row * volume.slopes[j].transpose()));
        }
    }
}

void VolumeTerm::add_low_rank(const LoadParameters&, LowRank& out) const {
    for (const Volume& each : volumes_)
        if (each.pairs.empty()) out.add(each.nodes, each.slopes, each.curvature);
}

void VolumeTerm::add_cancelling_here(VectorXd& out) const {
    for (const Volume& each : volumes_)
        for (std::size_t k = 0; k < each.nodes.size(); ++k)
            out.segment<3>(3 * each.nodes[k]) += std::abs(each.magnitude) * each.slopes[k].cwiseAbs();
}

void VolumeTerm::vjp(const double*, const LoadParameters& load_parameters, const double* lambda,
                     Gradient& out) {
    for (const Volume& each : volumes_) {
        const double along = each.along(lambda);
        const VolumeEnergy law(each.law, each.numbers, each.rest, each.volume,
                               load_parameters[factor_.first]);
        for (int k = 0; k < 2; ++k)
            if (each.slots[k].entry >= 0) out.values[each.slots[k].at(each.row)] += law.slope_by[k] * along;
        out.load_parameters[factor_.first] += law.slope_by_factor * along;
    }
}

void VolumeTerm::add_rest_vjp(const double*, const LoadParameters& load_parameters, const double* lambda,
                              VectorXd& out) {
    for (const Volume& each : volumes_) {
        const VolumeEnergy law(each.law, each.numbers, each.rest, each.volume,
                               load_parameters[factor_.first]);
        const double by_rest = law.slope_by_rest * each.along(lambda);
        std::vector<Vec3> slopes(each.nodes.size(), Vec3::Zero());
        each.add_slopes(each.at_rest(nodes_), slopes);
        for (std::size_t k = 0; k < slopes.size(); ++k)
            out.segment<3>(3 * each.nodes[k]) += by_rest * slopes[k];
    }
}

std::size_t VolumeTerm::bytes() const {
    std::size_t total = bytes_of(volumes_);
    for (const Volume& each : volumes_)
        total += bytes_of(each.nodes) + bytes_of(each.triangles) + bytes_of(each.curved) +
                 bytes_of(each.pairs) + bytes_of(each.slopes);
    return total;
}

}  // namespace magshell
