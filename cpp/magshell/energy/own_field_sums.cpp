#include <cmath>

#include "magshell/energy/own_field_geometry.h"

namespace magshell {

using namespace own_field;

template <class T>
std::vector<Triple<T>> OwnField::positions(const double* q, const double* rate) const {
    std::vector<Triple<T>> x(nodes_.size());
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const double* at = q + 3 * nodes_[k];
        if constexpr (std::is_same_v<T, Dual>) {
            const double* moves = rate + 3 * nodes_[k];
            x[k] = {{at[0], moves[0]}, {at[1], moves[1]}, {at[2], moves[2]}};
        } else {
            x[k] = {at[0], at[1], at[2]};
        }
    }
    return x;
}

template std::vector<Triple<double>> OwnField::positions(const double*, const double*) const;

template <class T>
void OwnField::add_element_pairs(const Geometry<T>& at, const Neighbours& near, Targets targets,
                                 Evaluation<T>& out) const {
    constexpr std::size_t few = 4;
    SourceArrays points;
    std::vector<SourceSums<T>> by_tree;
    if (near.trees) {
        by_tree = near.trees->template element_sums<T>(at);
    } else {
        points.resize(few * active_elements_, active_faces_ > 0, std::is_same_v<T, Dual>);
        in_blocks(active_elements_, [&](Index first, Index last) {
            std::size_t number = few * static_cast<std::size_t>(first);
            for (Index k = first; k < last; ++k)
                at.each_point(
                    element_order_[k], coarse,
                    [&](const SourcePoint<T>& point, const SamplePoint&) { points.set(number++, point); });
        });
    }
    in_blocks(target_elements(targets), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            const Index e = element_order_[k];
            ElementAdjoint<T>& adjoint = out.elements[e];
            const std::size_t own = k < active_elements_ ? few * k : few * active_elements_,
                              own_end = own + few;
            std::size_t number = near.trees ? few * near.trees->element_positions[k] : 0;
            at.each_point(e, coarse, [&](const SourcePoint<T>& point, const SamplePoint& sample) {
                SourceSums<T> sums;
                if (near.trees)
                    sums = by_tree[number++];
                else
                    points.add_sums(point, 0, few * active_elements_, own, own_end, sums);
                at.add(e, sums, sample, adjoint);
            });
            if (!elements_[e].is_edge()) add_self(at, e, adjoint);
        }
    });
    add_near_pairs(at, near, targets, out);
    for (Index k = 0; k < active_elements_; ++k) {
        const Index e = element_order_[k];
        out.energy += T(0.5) * (at.charges[e] * out.elements[e].charge +
                                at.element_currents[e] * out.elements[e].current);
    }
}

// The energy of a charge that is uniform on a triangle with itself is mu_0/(4 pi) Q^2/2 times
//
//   S = - 4/3 sum_i ln(1 - l_i / s) / l_i,      l_i: lengths of the sides, s half their sum         [Eibert, Hansen 1995]
template <class T>
void OwnField::add_self(const Geometry<T>& at, Index element, ElementAdjoint<T>& out) const {
    using std::log;
    const std::array<Index, 3>& nodes = elements_[element].nodes;
    Triple<T> sides[3];
    T lengths[3], half{}, mean{}, by_half{};
    for (int i = 0; i < 3; ++i) {
        sides[i] = at.x[nodes[(i + 2) % 3]] - at.x[nodes[(i + 1) % 3]];
        lengths[i] = norm(sides[i]);
        half += T(0.5) * lengths[i];
    }
    for (int i = 0; i < 3; ++i) {
        mean -= T(4.0 / 3.0) * log(T(1.0) - lengths[i] / half) / lengths[i];
        by_half -= T(4.0 / 3.0) / (half * (half - lengths[i]));
    }
    out.charge += T(strength) * at.charges[element] * mean;
    const T factor = T(0.5 * strength) * at.charges[element] * at.charges[element];
    for (int i = 0; i < 3; ++i) {
        const T& l = lengths[i];
        const T by_length =
            T(0.5) * by_half + T(4.0 / 3.0) * (log(T(1.0) - l / half) / l + T(1.0) / (half - l)) / l;
        const Triple<T> pull = (factor * by_length / l) * sides[i];
        out.nodes[(i + 2) % 3] += pull;
        out.nodes[(i + 1) % 3] -= pull;
    }
}

template <class T>
void OwnField::collect_charges(const Geometry<T>& at, Evaluation<T>& out) const {
    for (const Tetrahedron& tetrahedron : rotating_) {
        const std::array<Triple<T>, 3> by_f =
            at.unstretched(tetrahedron)
                .by_columns(at.by_charges(tetrahedron, out.elements), at.lifted(tetrahedron.magnetization));
        for (const Tetrahedron::Side& side : tetrahedron.sides) {
            Triple<T> by_center;
            for (int c = 0; c < 3; ++c) by_center += T(side.area[c] / tetrahedron.volume) * by_f[c];
            at.add_by_middle(elements_[side.element], by_center, out.elements[side.element]);
        }
    }
}

// Carries the derivatives with respect to normals and currents on to the positions of the nodes.
template <class T>
void OwnField::collect(const Geometry<T>& at, Evaluation<T>& out) const {
    collect_charges(at, out);
    out.by_position.assign(nodes_.size(), {});
    for (std::size_t e = 0; e < elements_.size(); ++e) {
        const Element& element = elements_[e];
        ElementAdjoint<T>& adjoint = out.elements[e];
        for (int k = 0; k < element.n_nodes(); ++k) out.by_position[element.nodes[k]] += adjoint.nodes[k];
        if (!element.is_edge()) continue;
        Triple<T> by_normal = adjoint.normal;
        if (element.bodies[1] >= 0) {
            const Triple<T>& n = at.element_normals[e];
            const T length =
                norm(at.normals[element.bodies[0]] + T(element.normals[1]) * at.normals[element.bodies[1]]);
            by_normal = (T(1.0) / length) * (by_normal - dot(n, by_normal) * n);
        }
        for (int k = 0; k < 2 && element.bodies[k] >= 0; ++k) {
            out.faces[element.bodies[k]].normal += T(element.normals[k]) * by_normal;
            out.faces[element.bodies[k]].current += T(element.turns[k]) * adjoint.current;
        }
    }
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        const Face& face = faces_[f];
        FaceAdjoint<T>& adjoint = out.faces[f];
        const Triple<T>& n = at.normals[f];
        const T by_area = -adjoint.current * at.currents[f] / at.areas[f];
        const Triple<T> by_across =
            (T(0.5) / at.areas[f]) * (adjoint.normal - dot(n, adjoint.normal) * n) + (T(0.5) * by_area) * n;
        const Triple<T> first = at.x[face.nodes[1]] - at.x[face.nodes[0]],
                        second = at.x[face.nodes[2]] - at.x[face.nodes[0]];
        const Triple<T> by_first = cross(second, by_across), by_second = cross(by_across, first);
        out.by_position[face.nodes[0]] += adjoint.corners[0] - by_first - by_second;
        out.by_position[face.nodes[1]] += adjoint.corners[1] + by_first;
        out.by_position[face.nodes[2]] += adjoint.corners[2] + by_second;
        if (!face.rotates) continue;
        const std::array<Triple<T>, 2> by_edges =
            at.unstretched(face).by_edges(at.by_charges(face, out.elements), at.lifted(tangential(f)));
        out.by_position[face.nodes[0]] -= by_edges[0] + by_edges[1];
        out.by_position[face.nodes[1]] += by_edges[0];
        out.by_position[face.nodes[2]] += by_edges[1];
    }
    for (std::size_t d = 0; d < dipoles_.size(); ++d)
        for (int k = 0; k < 4; ++k)
            out.by_position[dipoles_[d].nodes[k]] +=
                T(dipoles_[d].weights.position[k]) * out.dipoles[d].position +
                T(dipoles_[d].weights.moment[k]) * out.dipoles[d].moment;
}

template <class T>
OwnField::Evaluation<T> OwnField::evaluate(const std::vector<Triple<T>>& x, const Neighbours& near,
                                           Targets targets) const {
    const Geometry<T> at(*this, x);
    Evaluation<T> out;
    out.elements.resize(elements_.size());
    out.faces.resize(faces_.size());
    add_element_pairs(at, near, targets, out);
    if (has_sides(targets)) add_sides(at, near, targets, out);
    add_dipoles(at, targets, out);
    collect(at, out);
    return out;
}

double OwnField::gradient(const double* q, const Neighbours& near, std::vector<Vec3>& by_position) const {
    const Evaluation<double> found = evaluate(positions<double>(q, nullptr), near, Targets::sources);
    by_position.resize(nodes_.size());
    for (std::size_t k = 0; k < nodes_.size(); ++k) by_position[k] = values_of(found.by_position[k]);
    return found.energy;
}

void OwnField::add_hessian_product(const double* q, const Neighbours& near, const double* p,
                                   double* out) const {
    const Evaluation<Dual> found = evaluate(positions<Dual>(q, p), near, Targets::sources);
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        Eigen::Map<Vec3>(out + 3 * nodes_[k]) += rates_of(found.by_position[k]);
}

OwnField::FaceGradient OwnField::vjp(const double* q, const double* lambda) const {
    const Index n_faces = static_cast<Index>(faces_.size());
    const Evaluation<Dual> found =
        evaluate(positions<Dual>(q, lambda), neighbours(q, Targets::all), Targets::all);
    FaceGradient by{std::vector<Vec3>(faces_.size(), Vec3::Zero()),
                    std::vector<double>(faces_.size(), 0.0),
                    std::vector<Vec3>(n_tetrahedra_, Vec3::Zero()),
                    std::vector<DipoleWeights>(dipoles_.size()),
                    {},
                    {}};
    for (const Triple<Dual>& each : found.by_position) by.by_position.push_back(rates_of(each));
    const std::vector<Triple<Dual>> x = positions<Dual>(q, lambda);
    const Geometry<Dual> at(*this, x);
    for (Index f = 0; f < n_faces; ++f) {
        const Face& face = faces_[f];
        const FaceAdjoint<Dual>& adjoint = found.faces[f];
        // I_f = h (M . n) A~/A, side charge A~ (M . n)
        const double by_rest_current = rate_of(adjoint.current * Dual(face.area) / at.areas[f]);
        const double along = magnetization_[f].dot(face.normal);
        by.magnetization[f] +=
            (thickness_[f] * by_rest_current + face.area * rate_of(adjoint.charge)) * face.normal;
        by.thickness[f] += along * by_rest_current + rate_of(adjoint.thickness);
        by.rest.corners.push_back(by_corners(at, f, found, by_rest_current / face.area));
        if (face.rotates) {
            const UnstretchedVector<Dual> unstretched = at.unstretched(face);
            const std::array<Dual, 2> pull = unstretched(at.by_charges(face, found.elements));
            for (int c = 0; c < 2; ++c) {
                by.magnetization[f] += thickness_[f] * rate_of(pull[c]) * face.basis[c];
                by.thickness[f] += magnetization_[f].dot(face.basis[c]) * rate_of(pull[c]);
            }
        }
        for (int i = 0; i < 3; ++i) {
            const ElementAdjoint<Dual>& element = found.elements[face.edges[i]];
            if (!face.rotates) {
                by.magnetization[f] += thickness_[f] * rate_of(element.charge) * face.conormals[i];
                by.thickness[f] += magnetization_[f].dot(face.conormals[i]) * rate_of(element.charge);
            }
            by.thickness[f] +=
                (elements_[face.edges[i]].bodies[1] < 0 ? 1.0 : 0.5) * rate_of(element.thickness);
        }
    }
    std::vector<bool> rotates(n_tetrahedra_, false);
    for (const Tetrahedron& tetrahedron : rotating_) {
        rotates[tetrahedron.number] = true;
        by.of_tetrahedra[tetrahedron.number] =
            rates_of(at.unstretched(tetrahedron)(at.by_charges(tetrahedron, found.elements)));
    }
    for (std::size_t e = 0; e < elements_.size(); ++e) {
        const Element& element = elements_[e];
        for (int side = 0; side < 2 && !element.is_edge(); ++side)
            if (element.bodies[side] >= 0 && !rotates[element.bodies[side]])
                by.of_tetrahedra[element.bodies[side]] +=
                    (element.turns[side] * rate_of(found.elements[e].charge)) * element.area;
    }
    by.rest.triangles = by_triangles(at, found);
    for (std::size_t d = 0; d < dipoles_.size(); ++d)
        for (int k = 0; k < 4; ++k) {
            const Triple<Dual>& corner = at.x[dipoles_[d].nodes[k]];
            by.of_dipoles[d].position[k] = rate_of(dot(found.dipoles[d].position, corner));
            by.of_dipoles[d].moment[k] = rate_of(dot(found.dipoles[d].moment, corner));
        }
    return by;
}

OwnField::DipoleActions OwnField::on_dipoles(const double* q) const {
    const std::vector<Triple<double>> x = positions<double>(q, nullptr);
    const Geometry<double> at(*this, x);
    const Evaluation<double> found = evaluate(x, neighbours(q), Targets::sources);
    DipoleActions on;
    for (std::size_t d = 0; d < dipoles_.size(); ++d) {
        const Vec3 moment = values_of(at.moment(dipoles_[d]));
        on.positions.push_back(values_of(at.position(dipoles_[d])));
        on.forces.push_back(-values_of(found.dipoles[d].position));
        on.couples.push_back(values_of(found.dipoles[d].moment).cross(moment));  // m x B, B = - dE/dm
    }
    return on;
}

// B = mu_0/(4 pi) [ sum q r / r^3 + sum c x r / r^3 + sum 3 (m . r) r / r^5 - m / r^3 ],  r = p - p_j
std::vector<Vec3> OwnField::flux_density(const double* q, const std::vector<Vec3>& points) const {
    const std::vector<Triple<double>> x = positions<double>(q, nullptr);
    const Geometry<double> at(*this, x);
    std::vector<SourcePoint<double>> sources;
    for (Index k = 0; k < active_elements_; ++k)
        at.each_point(element_order_[k], fine, [&](const SourcePoint<double>& point, const SamplePoint&) {
            sources.push_back(point);
        });
    std::vector<Vec3> flux(points.size(), Vec3::Zero());
    in_blocks(static_cast<Index>(points.size()), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            for (const SourcePoint<double>& source : sources) {
                const Vec3 r = points[k] - values_of(source.at);
                const double cubed = 1.0 / (r.squaredNorm() * r.norm());
                flux[k] += cubed * (source.charge * r + values_of(source.current).cross(r));
            }
            for (const Dipole& dipole : dipoles_) {
                const Vec3 r = points[k] - values_of(at.position(dipole)), m = values_of(at.moment(dipole));
                const double squared = r.squaredNorm();
                flux[k] += (3.0 * m.dot(r) / squared * r - m) / (squared * r.norm());
            }
            flux[k] *= strength;
        }
    });
    return flux;
}

}  // namespace magshell
