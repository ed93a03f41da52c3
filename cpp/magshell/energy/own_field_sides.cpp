#include <cmath>

#include "magshell/energy/own_field_geometry.h"

namespace magshell {

using namespace own_field;

namespace {

// The solid angle of the triangle with corners r, seen from the origin, positive on the side of its normal [Van Oosterom, Strackee 1983],
// and its derivatives with respect to the corners.
template <class T>
T solid_angle(const Triple<T> r[3], Triple<T> by_corner[3]) {
    using std::atan2;
    const T l[3] = {norm(r[0]), norm(r[1]), norm(r[2])};
    const Triple<T> across[3] = {cross(r[1], r[2]), cross(r[2], r[0]), cross(r[0], r[1])};
    const T d[3] = {dot(r[1], r[2]), dot(r[2], r[0]), dot(r[0], r[1])};
    const T volume = dot(r[0], across[0]);
    const T other = l[0] * l[1] * l[2] + d[0] * l[0] + d[1] * l[1] + d[2] * l[2];
    const T scale = T(2.0) / (volume * volume + other * other);
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const Triple<T> by_other = ((l[i] * l[j] + d[k]) / l[k]) * r[k] + l[j] * r[i] + l[i] * r[j];
        by_corner[k] = scale * (volume * by_other - other * across[k]);
    }
    return T(-2.0) * atan2(volume, other);
}

}  // namespace

template <class T>
void OwnField::add_sides(const Geometry<T>& at, const Neighbours& near, Targets targets,
                         Evaluation<T>& out) const {
    constexpr bool has_rates = std::is_same_v<T, Dual>;
    SourceArrays element_points, side_points;
    element_points.resize(4 * static_cast<std::size_t>(active_elements_), false, has_rates);
    side_points.resize(6 * static_cast<std::size_t>(active_faces_), false, has_rates);
    for (Index k = 0; k < active_elements_; ++k) {
        std::size_t number = 4 * static_cast<std::size_t>(k);
        at.each_point(element_order_[k], coarse, [&](const SourcePoint<T>& point, const SamplePoint&) {
            element_points.set(number++, point);
        });
    }
    for (Index k = 0; k < active_faces_; ++k) {
        std::size_t number = 6 * static_cast<std::size_t>(k);
        at.each_side_point(face_order_[k], [&](const SourcePoint<T>& point, const double*, double, double) {
            side_points.set(number++, point);
        });
    }
    std::vector<SourceSums<T>> at_elements, at_faces;
    if (near.trees) {
        at_elements = near.trees->template side_sums_at_elements<T>(at);
        at_faces = near.trees->template element_sums_at_sides<T>(at);
    }
    std::vector<T> potentials(target_elements(targets));  // dE/dQ_e of the sides
    in_blocks(target_elements(targets), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            const Index e = element_order_[k];
            ElementAdjoint<T> adjoint;
            std::size_t number = near.trees ? 4 * near.trees->element_positions[k] : 0;
            at.each_point(e, coarse, [&](const SourcePoint<T>& point, const SamplePoint& sample) {
                SourceSums<T> sums;
                if (near.trees)
                    sums = at_elements[number++];
                else
                    side_points.add_sums(point, 0, side_points.size(), 0, 0, sums);
                at.add(e, sums, sample, adjoint);
            });
            potentials[k] = adjoint.charge;
            out.elements[e] += adjoint;
        }
    });
    in_blocks(target_faces(targets), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k) {
            const Index f = face_order_[k];
            std::size_t number = near.trees ? 6 * near.trees->face_positions[k] : 0;
            at.each_side_point(
                f, [&](const SourcePoint<T>& point, const double* weights, double zeta, double weight) {
                    SourceSums<T> sums;
                    if (near.trees)
                        sums = at_faces[number++];
                    else
                        element_points.add_sums(point, 0, element_points.size(), 0, 0, sums);
                    at.add(f, sums, weights, zeta, weight, out.faces[f]);
                });
        }
    });
    std::vector<ElementAdjoint<T>> of_elements_near(near.sides.size());
    std::vector<FaceAdjoint<T>> of_faces_near(near.sides.size());
    in_blocks(static_cast<Index>(near.sides.size()), [&](Index first, Index last) {
        for (Index k = first; k < last; ++k)
            add_near_side(at, element_order_[near.sides[k][0]], face_order_[near.sides[k][1]],
                          of_elements_near[k], of_faces_near[k]);
    });
    for (std::size_t k = 0; k < near.sides.size(); ++k) {
        const Index e = element_order_[near.sides[k][0]], f = face_order_[near.sides[k][1]];
        potentials[near.sides[k][0]] += of_elements_near[k].charge;
        out.elements[e] += of_elements_near[k];
        out.faces[f] += of_faces_near[k];
    }
    for (Index k = 0; k < active_elements_; ++k) out.energy += at.charges[element_order_[k]] * potentials[k];
}

// Replaces the points of a charged side by two layers of dipoles, with the weight of the near value; takes the pair away if the element
// is an edge of the face.
template <class T>
void OwnField::add_near_side(const Geometry<T>& at, Index e, Index f, ElementAdjoint<T>& of_element,
                             FaceAdjoint<T>& of_face) const {
    const Element& element = elements_[e];
    const Face& face = faces_[f];
    const T charge = at.charges[e];
    ElementAdjoint<T> element_change;
    FaceAdjoint<T> face_change;
    // Their energy with the points is subtracted.
    at.each_side_point(
        f, [&](const SourcePoint<T>& side, const double* weights, double side_zeta, double side_weight) {
            SourceSums<T> at_side;
            at.each_point(e, coarse, [&](const SourcePoint<T>& point, const SamplePoint& sample) {
                const Triple<T> d = point.at - side.at;
                const T inverse = T(1.0) / norm(d);
                const T cubed = inverse * inverse * inverse;
                SourceSums<T> at_element;
                at_element.charges = -side.charge * inverse;
                at_element.pull = (-point.charge * side.charge) * cubed * d;
                at.add(e, at_element, sample, element_change);
                at_side.charges -= point.charge * inverse;
                at_side.pull -= at_element.pull;
            });
            at.add(f, at_side, weights, side_zeta, side_weight, face_change);
        });
    const bool meet = element.is_edge() && (element.bodies[0] == f || element.bodies[1] == f);
    if (!meet)
        for (int level = 0; level < coarse.count; ++level) {
            const double side_zeta = coarse.points[level] - 0.5;
            const Triple<T> shift = T(side_zeta * thickness_[f]) * at.normals[f];
            at.each_point(e, fine, [&](const SourcePoint<T>& point, const SamplePoint& sample) {
                Triple<T> r[3], by_corner[3];
                for (int k = 0; k < 3; ++k) r[k] = at.x[face.nodes[k]] + shift - point.at;
                const T angle = solid_angle(r, by_corner);
                const double share = strength * sample.weight * coarse.weights[level];
                const T potential = T(share) * at.currents[f] * angle;
                element_change.charge += potential;
                face_change.current += T(share) * charge * angle;
                const T force = T(share) * charge * at.currents[f];
                Triple<T> sum;
                for (int k = 0; k < 3; ++k) {
                    const Triple<T> pull = force * by_corner[k];
                    face_change.corners[k] += pull;
                    sum += pull;
                }
                face_change.normal += T(side_zeta * thickness_[f]) * sum;
                face_change.thickness += T(side_zeta) * dot(at.normals[f], sum);
                for (int k = 0; k < element.n_nodes(); ++k)
                    element_change.nodes[k] -= T(sample.weights[k]) * sum;
                element_change.normal -= T(sample.zeta * element_thickness_[e]) * sum;
                element_change.thickness -= T(sample.zeta) * dot(at.element_normals[e], sum);
            });
        }
    const Triple<T> apart = at.middle(element) - at.center(face);
    const T distance = norm(apart), longer = std::max(element.length, face.size);
    T weight, slope;
    lift(meet ? BlendWeight{1.0, 0.0, 0.0} : blend(of_sides, value_of(distance) / value_of(longer)),
         distance / longer, weight, slope);
    const Triple<T> by_middle = (charge * element_change.charge * slope / (distance * longer)) * apart;
    const T by_longer = -charge * element_change.charge * slope * distance / (longer * longer);
    const std::array<double, 2> parts = parts_of_larger(element.length, face.size);
    element_change.scale(weight);
    face_change.scale(weight);
    element_change.length += T(parts[0]) * by_longer;
    face_change.size += T(parts[1]) * by_longer;
    at.add_by_middle(element, by_middle, element_change);
    for (Triple<T>& corner : face_change.corners) corner -= T(1.0 / 3.0) * by_middle;
    of_element += element_change;
    of_face += face_change;
}

template void OwnField::add_sides(const Geometry<double>&, const Neighbours&, Targets,
                                  Evaluation<double>&) const;
template void OwnField::add_sides(const Geometry<Dual>&, const Neighbours&, Targets, Evaluation<Dual>&) const;

}  // namespace magshell
