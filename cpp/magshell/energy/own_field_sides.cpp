#include <algorithm>

#include "magshell/energy/own_field_geometry.h"
#include "magshell/energy/own_field_side_pairs.h"

namespace magshell {

using namespace own_field;

namespace {

// Sets the derivatives for the pairs with these numbers in a block. meets: the elements are edges of the faces. near: the rule of the elements
// where the faces have their solid angles.
template <class Value, class T>
void set_sides(const std::vector<ElementPose<T>>& elements, const std::vector<FacePose<T>>& faces,
               const std::array<Index, 2>* pairs, const std::vector<Index>& numbers, bool edges, bool meets,
               const GaussRule& near, SideAdjoint<T>* out) {
    using Pairs = SidePairs<T, Value>;
    using Points = PointsOfKinds<typename Pairs::Pair::Number>;
    static const Points few(coarse), some(medium), most(fine);
    const Points& many = &near == &medium ? some : most;
    const Index count = static_cast<Index>(numbers.size());
    for (Index begin = 0; begin < count; begin += Pairs::width) {
        Pairs sums;
        for (int lane = 0; lane < Pairs::width; ++lane) {  // the last pair again in lanes that are left
            const auto& [element, face] = pairs[numbers[std::min(begin + lane, count - 1)]];
            sums.set(lane, elements[element], faces[face]);
        }
        sums.add_points(few(edges));
        if (!meets) sums.add_angles(many(edges));
        sums.finish(meets);
        for (Index k = begin; k < std::min(begin + Pairs::width, count); ++k)
            out[numbers[k]] = sums(static_cast<int>(k - begin));
    }
}

}  // namespace

template <class T>
void OwnField::add_near_sides(const Geometry<T>& at, const Neighbours& near, Targets targets,
                              std::vector<T>& potentials, Evaluation<T>& out) const {
    constexpr bool has_rates = std::is_same_v<T, Dual>;
    std::vector<ElementPose<T>> elements;
    std::vector<FacePose<T>> faces;
    for (Index k = 0; k < target_elements(targets); ++k) elements.push_back(at.pose(element_order_[k]));
    for (Index k = 0; k < target_faces(targets); ++k) faces.push_back(at.face_pose(face_order_[k]));
    const Units units = has_rates && near.is_rough ? units_of(at.x, elements, faces) : Units();
    for (ElementPose<T>& pose : elements) pose = scaled(pose, 1.0 / units.charge, 1.0 / units.rate);
    for (FacePose<T>& pose : faces) pose = scaled(pose, 1.0 / units.face, 1.0 / units.rate);
    std::vector<PoseAdjoint<T>> of_elements(elements.size());
    std::vector<FacePoseAdjoint<T>> of_faces(faces.size());
    const auto kind_of = [&](const std::array<Index, 2>& pair) {  // 0: triangle, 1: edge, 2: edge of the face
        const Index e = element_order_[pair[0]];
        return !elements_[e].is_edge() ? 0 : is_edge_of(e, face_order_[pair[1]]) ? 2 : 1;
    };
    const auto fill = [&](Index begin, Index count, SideAdjoint<T>* adjoints) {
        const std::array<Index, 2>* const pairs = near.sides.data() + begin;
        std::vector<Index> with_fine[3], with_medium[3];
        for (Index k = 0; k < count; ++k)
            (begin + k < near.sides_with_fine ? with_fine : with_medium)[kind_of(pairs[k])].push_back(k);
        for (int kind = 0; kind < 3; ++kind) {
            const bool edges = kind > 0, meets = kind == 2;
            if (has_rates && near.is_rough) {
                set_sides<SimdFloat>(elements, faces, pairs, with_fine[kind], edges, meets, fine, adjoints);
                set_sides<SimdFloat>(elements, faces, pairs, with_medium[kind], edges, meets, medium,
                                     adjoints);
            } else {
                set_sides<SimdDouble>(elements, faces, pairs, with_fine[kind], edges, meets, fine, adjoints);
            }
        }
    };
    fill_in_order<SideAdjoint<T>>(static_cast<Index>(near.sides.size()), fill,
                                  [&](Index k, const SideAdjoint<T>& adjoint) {
                                      of_elements[near.sides[k][0]] += adjoint.element;
                                      of_faces[near.sides[k][1]] += adjoint.face;
                                  });
    const double by_charge = strength * units.face, by_face = strength * units.charge,
                 energy = by_face * units.face;
    for (std::size_t k = 0; k < elements.size(); ++k) {
        const PoseAdjoint<T> by = scaled(of_elements[k], energy, by_charge, units.rate);
        potentials[k] += by.charge;
        at.add(element_order_[k], by, out.elements[element_order_[k]]);
    }
    for (std::size_t k = 0; k < faces.size(); ++k)
        at.add(face_order_[k], scaled(of_faces[k], energy, by_face, units.rate), out.faces[face_order_[k]]);
}

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
    add_near_sides(at, near, targets, potentials, out);
    for (Index k = 0; k < active_elements_; ++k) out.energy += at.charges[element_order_[k]] * potentials[k];
}

template void OwnField::add_sides(const Geometry<double>&, const Neighbours&, Targets,
                                  Evaluation<double>&) const;
template void OwnField::add_sides(const Geometry<Dual>&, const Neighbours&, Targets, Evaluation<Dual>&) const;

}  // namespace magshell
