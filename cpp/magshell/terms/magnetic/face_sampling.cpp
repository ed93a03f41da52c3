#include "magshell/terms/magnetic/face_sampling.h"

#include <algorithm>

namespace magshell {

void FaceSampling::set(const double* fine, Index n_faces) {
    n_faces_ = n_faces;
    fine_groups_ = 0;
    first_.clear();
    groups_.clear();
    if (!fine || std::all_of(fine, fine + n_faces, [](double each) { return each == 0.0; })) return;
    first_.push_back(0);
    for (Index f = 0; f < n_faces; ++f)
        first_.push_back(first_.back() + static_cast<Index>(fine[f] != 0.0 ? face_points::fine.size() : 1));
    for (Index group = 0; group < loop_.groups(); ++group) {
        bool any = false;
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) any |= fine[loop_.face(group, lane)] != 0.0;
        groups_.push_back(any ? fine_groups_++ : -1);
    }
}

std::span<const FacePoint> FaceSampling::points(Index face) const {
    if (is_fine(face)) return face_points::fine;
    return face_points::barycenter;
}

void FaceSampling::add_moments(const std::vector<double>& volumes, const std::vector<Vec3>& magnetizations,
                               std::vector<Vec3>& moments) const {
    std::size_t n = 0;
    for (Index f = 0; f < n_faces_; ++f)
        for (const FacePoint& point : points(f))
            moments.push_back((volumes[f] * point.weight) * magnetizations[n++]);
}

std::vector<FieldOverFace> FaceSampling::moments(const FieldSamples& samples, int order,
                                                 const Vec3& everywhere,
                                                 const std::vector<double>& thicknesses) const {
    std::vector<FieldOverFace> fields(fine_groups_);
    const auto set_lanes = [](SimdMat3& group, int lane, const Mat3& from) {
        for (int k = 0; k < 9; ++k) group.at[k].set(lane, from(k / 3, k % 3));
    };
    loop_.each_group([&](Index group) {
        if (!any_fine_in(group)) return;
        FieldOverFace& field = fields[at(group)];
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.face(group, lane);
            Vec3 flux = everywhere;
            Mat3 gradient[4], curvature[10];
            std::fill(std::begin(gradient), std::end(gradient), Mat3::Zero());
            std::fill(std::begin(curvature), std::end(curvature), Mat3::Zero());
            Index n = first(f);
            for (const FacePoint& point : points(f)) {
                const double share[4] = {point.at[0], point.at[1], point.at[2],
                                         point.height * thicknesses[f]};
                flux += point.weight * samples.flux[n];
                for (int a = 0; a < 4 && order >= 1; ++a)
                    gradient[a] += (point.weight * share[a]) * samples.gradient[n];
                for (int a = 0; a < 4 && order >= 2; ++a)
                    for (int b = 0; b <= a; ++b)
                        curvature[lower_index(a, b)] +=
                            (point.weight * share[a] * share[b]) * samples.curvature[n];
                ++n;
            }
            set_lane(field.flux, lane, flux);
            for (int a = 0; a < 4 && order >= 1; ++a) set_lanes(field.gradient[a], lane, gradient[a]);
            for (int k = 0; k < 10 && order >= 2; ++k) set_lanes(field.curvature[k], lane, curvature[k]);
        }
    });
    return fields;
}

}  // namespace magshell
