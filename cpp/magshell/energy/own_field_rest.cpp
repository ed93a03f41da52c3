// The gradient of the own field with respect to the shape at rest (energy/own_field.h).
#include <algorithm>
#include <cmath>

#include "magshell/energy/own_field_geometry.h"

namespace magshell {

std::array<double, 3> parts_of_longest(const std::array<double, 3>& lengths) {
    const double longest = *std::max_element(lengths.begin(), lengths.end());
    std::array<double, 3> parts;
    for (int i = 0; i < 3; ++i) parts[i] = lengths[i] >= (1.0 - 1e-12) * longest ? 1.0 : 0.0;
    const double count = parts[0] + parts[1] + parts[2];
    for (double& part : parts) part /= count;
    return parts;
}

// The charges of a face are Q_i = c_i . w of its conormals c_i, w = h M~, or, if the magnetization rotates, w = U^-1 (h M~). There the
// basis b_c of the plane turns with it, db_c = -(dn~ . b_c) n~, and F = [a_1 a_2] [A_1 A_2]^-1 of the edges a_j now, A_j at rest:
//
//   d(h M~ . b_c) = -(h M~ . n~)(dn~ . b_c),      dE/dA_j = - sum_c b_c (F_c . dE/da_j)
std::array<Vec3, 3> OwnField::by_corners(const Geometry<Dual>& at, Index f, const Evaluation<Dual>& found,
                                         double by_current) const {
    const Face& face = faces_[f];
    const Vec3 &n = face.normal, m = magnetization_[f];
    const double h = thickness_[f], side = rate_of(found.faces[f].charge), along = m.dot(n);
    Vec3 by_normal = (face.area * (h * by_current + side)) * m;
    const double by_area = along * (h * by_current + side);
    std::array<Dual, 2> turned{};
    std::array<Vec3, 2> by_edges{Vec3::Zero(), Vec3::Zero()};
    if (face.rotates) {
        const UnstretchedVector<Dual> unstretched = at.unstretched(face);
        const std::array<Dual, 2> given = at.lifted(tangential(f)),
                                  by_turned = at.by_charges(face, found.elements),
                                  pull = unstretched(by_turned);
        const std::array<Triple<Dual>, 2> by_present = unstretched.by_edges(by_turned, given);
        turned = unstretched(given);
        for (int c = 0; c < 2; ++c) {
            by_normal -= (h * along * rate_of(pull[c])) * face.basis[c];
            for (int j = 0; j < 2; ++j)
                by_edges[j] -= rate_of(dot(unstretched.column(c), by_present[j])) * face.basis[c];
        }
    }
    std::array<Vec3, 3> sides, by_sides;  // the edges opposite the corners
    std::array<double, 3> lengths;
    for (int i = 0; i < 3; ++i) {
        sides[i] = n.cross(face.conormals[i]);
        const ElementAdjoint<Dual>& edge = found.elements[face.edges[i]];
        Vec3 by_conormal = (h * rate_of(edge.charge)) * m;  // of side x n
        if (face.rotates)
            by_conormal = rate_of(edge.charge * turned[0]) * face.basis[0] +
                          rate_of(edge.charge * turned[1]) * face.basis[1];
        by_sides[i] = n.cross(by_conormal);
        by_normal += by_conormal.cross(sides[i]);
        if (elements_[face.edges[i]].bodies[0] == f)
            by_sides[i] += rate_of(edge.length) * sides[i].normalized();
        lengths[i] = sides[i].norm();
    }
    const std::array<double, 3> longest = parts_of_longest(lengths);
    for (int i = 0; i < 3; ++i)
        by_sides[i] += rate_of(found.faces[f].size) * longest[i] * sides[i].normalized();
    const Vec3 by_across = 0.5 / face.area * (by_normal - n.dot(by_normal) * n) + 0.5 * by_area * n,
               first = sides[2], second = -sides[1];
    std::array<Vec3, 3> by;
    by[1] = second.cross(by_across) + by_edges[0];
    by[2] = by_across.cross(first) + by_edges[1];
    by[0] = -by[1] - by[2];
    for (int i = 0; i < 3; ++i) {
        by[(i + 2) % 3] += by_sides[i];
        by[(i + 1) % 3] -= by_sides[i];
    }
    return by;
}

// A tetrahedron whose magnetization rotates has the charges Q_t = a~_t . w, w = U^-1 M~, with F = sum_t xbar_t a~_t^T / V~.
std::vector<OwnField::TriangleGradient> OwnField::by_triangles(const Geometry<Dual>& at,
                                                               const Evaluation<Dual>& found) const {
    std::vector<TriangleGradient> by;
    for (std::size_t e = 0; e < elements_.size(); ++e)
        if (!elements_[e].is_edge())
            by.push_back({rate_of(found.elements[e].charge), rate_of(found.elements[e].length)});
    const std::size_t first = elements_.size() - by.size();
    for (const Tetrahedron& tetrahedron : rotating_) {
        const UnstretchedSolidVector<Dual> unstretched = at.unstretched(tetrahedron);
        const Triple<Dual> given = at.lifted(tetrahedron.magnetization), turned = unstretched(given);
        const std::array<Triple<Dual>, 3> by_f =
            unstretched.by_columns(at.by_charges(tetrahedron, found.elements), given);
        double by_volume = 0.0;
        for (const Tetrahedron::Side& side : tetrahedron.sides) {
            const Triple<Dual> center = at.middle(elements_[side.element]);
            for (int c = 0; c < 3; ++c)
                by_volume -=
                    side.area[c] * rate_of(dot(by_f[c], center)) / (tetrahedron.volume * tetrahedron.volume);
        }
        for (const Tetrahedron::Side& side : tetrahedron.sides) {
            const Element& element = elements_[side.element];
            const double turn = element.turns[element.bodies[0] == tetrahedron.number ? 0 : 1];
            const Triple<Dual> center = at.middle(element);
            Vec3 by_area = rates_of(found.elements[side.element].charge * turned);
            for (int c = 0; c < 3; ++c) by_area[c] += rate_of(dot(by_f[c], center)) / tetrahedron.volume;
            by[side.element - first].area += turn * by_area;
            by[side.element - first].volume += turn * by_volume;
        }
    }
    return by;
}

}  // namespace magshell
