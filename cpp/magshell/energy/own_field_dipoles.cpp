#include "magshell/energy/own_field_geometry.h"

namespace magshell {

using namespace own_field;

// E = - mu_0/(4 pi) sum_j m . (q_j r + cross(c_j, r)) / |r|^3,  r = p - p_j, for a dipole m at p and the fine points p_j of
// the target elements, with charges q_j and currents c_j. The elements of the dipole's own rigid body are left out: their
// energy does not change. The charged sides of faces are left out too: the currents already contain the normal
// magnetization, and only charges Q_e feel the sides.
template <class T>
void OwnField::add_dipole(const Geometry<T>& at, std::size_t number, Targets targets,
                          Evaluation<T>& out) const {
    const Triple<T> p = at.position(dipoles_[number]), m = at.moment(dipoles_[number]);
    DipoleAdjoint<T>& adjoint = out.dipoles[number];
    for (Index k = 0; k < target_elements(targets); ++k) {
        const Index e = element_order_[k];
        if (is_part_of(e, static_cast<Index>(number))) continue;
        at.each_point(e, fine, [&](const SourcePoint<T>& point, const SamplePoint& sample) {
            const Triple<T> r = p - point.at;
            const T squared = dot(r, r), inverse = T(1.0) / norm(r);
            const T cubed = inverse / squared;
            const Triple<T> field = point.charge * r + cross(point.current, r);  // times r^-3
            const T product = dot(m, field);
            const Triple<T> by_position =
                cubed * (point.charge * m + cross(m, point.current) - (T(3.0) * product / squared) * r);
            SourceSums<T> sums;
            sums.charges = -cubed * dot(m, r);
            sums.currents = cubed * cross(r, m);
            sums.pull = -by_position;
            at.add(e, sums, sample, out.elements[e]);
            adjoint.position -= T(strength) * by_position;
            adjoint.moment -= (T(strength) * cubed) * field;
            out.energy -= T(strength) * cubed * product;
        });
    }
}

// E = mu_0/(4 pi) [ m . m' / |r|^3 - 3 (m . r)(m' . r) / |r|^5 ] for two dipoles m and m' (`other`) at the distance r.
template <class T>
void OwnField::add_dipole_pair(const Geometry<T>& at, std::size_t first, std::size_t second,
                               Evaluation<T>& out) const {
    const Triple<T> r = at.position(dipoles_[first]) - at.position(dipoles_[second]);
    const Triple<T> m = at.moment(dipoles_[first]), other = at.moment(dipoles_[second]);
    const T squared = dot(r, r), cubed = T(strength) / (squared * norm(r));
    const T along = dot(m, r) / squared, along_other = dot(other, r) / squared;
    out.energy += cubed * (dot(m, other) - T(3.0) * along * along_other * squared);
    out.dipoles[first].moment += cubed * (other - (T(3.0) * along_other) * r);
    out.dipoles[second].moment += cubed * (m - (T(3.0) * along) * r);
    const Triple<T> by_position =
        (T(3.0) * cubed) *
        ((T(5.0) * along * along_other - dot(m, other) / squared) * r - along_other * m - along * other);
    out.dipoles[first].position += by_position;
    out.dipoles[second].position -= by_position;
}

template <class T>
void OwnField::add_dipoles(const Geometry<T>& at, Targets targets, Evaluation<T>& out) const {
    out.dipoles.resize(dipoles_.size());
    for (std::size_t k = 0; k < dipoles_.size(); ++k) {
        add_dipole(at, k, targets, out);
        for (std::size_t other = 0; other < k; ++other) add_dipole_pair(at, k, other, out);
    }
}

template void OwnField::add_dipoles(const Geometry<double>&, Targets, Evaluation<double>&) const;
template void OwnField::add_dipoles(const Geometry<Dual>&, Targets, Evaluation<Dual>&) const;

}  // namespace magshell
