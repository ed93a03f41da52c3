// FaceSampling: the points at which each face of a surface samples the applied field: once at its barycenter, or finely, in its plane and
// through its thickness (energy/face_points.h).
#pragma once

#include <span>
#include <vector>

#include "magshell/assembly/element_loop.h"
#include "magshell/energy/face_points.h"
#include "magshell/energy/magnetic_face_fine.h"
#include "magshell/field/applied_field.h"

namespace magshell {

/// Returns a point of a face from its corners and its thickness times its normal [m], or the point's velocity from theirs.
inline Vec3 position_of(const FacePoint& point, const Vec3 corners[3], const Vec3& across) {
    return point.at[0] * corners[0] + point.at[1] * corners[1] + point.at[2] * corners[2] +
           point.height * across;
}

class FaceSampling {
  public:
    explicit FaceSampling(const FaceLoop& loop) : loop_(loop) {}

    /// Sets which faces sample the field finely, by numbers that are not zero; nullptr: none of them.
    void set(const double* fine, Index n_faces);

    bool any_fine() const { return !groups_.empty(); }
    bool is_fine(Index face) const { return any_fine() && first_[face + 1] - first_[face] > 1; }
    /// Returns true if a face of a SIMD vector samples finely.
    bool any_fine_in(Index group) const { return any_fine() && groups_[group] >= 0; }

    Index n_points() const { return any_fine() ? first_.back() : n_faces_; }
    /// Returns the number of a face's first point. Those of a face follow each other, in the order of points().
    Index first(Index face) const { return any_fine() ? first_[face] : face; }
    std::span<const FacePoint> points(Index face) const;

    /// Returns the moments B, G_a and C_ab of energy/magnetic_face_fine.h, for those SIMD vectors in which a face samples
    /// finely, in their order; see at(). order: of the highest derivative of the field, 0 to 2. everywhere: a uniform field
    /// that is added to B [T].
    std::vector<FieldOverFace> moments(const FieldSamples& samples, int order, const Vec3& everywhere,
                                       const std::vector<double>& thicknesses) const;
    /// Returns the place of a SIMD vector in moments().
    Index at(Index group) const { return groups_[group]; }

    /// Appends the magnetic moment of each point [A m2] from the volumes of the faces [m3] and the magnetizations at the
    /// points [A/m].
    void add_moments(const std::vector<double>& volumes, const std::vector<Vec3>& magnetizations,
                     std::vector<Vec3>& moments) const;

    std::size_t bytes() const { return bytes_of(first_) + bytes_of(groups_); }

  private:
    const FaceLoop& loop_;
    Index n_faces_ = 0, fine_groups_ = 0;
    std::vector<Index> first_;   // of each face, and the number of all; empty if no face samples finely
    std::vector<Index> groups_;  // of each SIMD vector its place in moments(), -1 for none; or empty
};

}  // namespace magshell
