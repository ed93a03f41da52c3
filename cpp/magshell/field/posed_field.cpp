#include "magshell/field/posed_field.h"

#include <algorithm>
#include <utility>

#include "magshell/core/rotation_vector.h"

namespace magshell {

PosedField::PosedField(std::shared_ptr<const AppliedField> field, const Vec3& center, const Vec3& rotation)
    : field_(std::move(field)) {
    for (const FieldParameter& p : field_->parameters()) n_own_ += static_cast<std::size_t>(p.rows) * p.width;
    set_pose(center, rotation);
}

void PosedField::set_pose(const Vec3& center, const Vec3& rotation) {
    center_ = center;
    rotation_ = rotation;
    turn_ = magshell::rotation(rotation);
    moved_ = !center.isZero(0.0) || !rotation.isZero(0.0);
}

std::vector<Vec3> PosedField::own_points(std::span<const Vec3> points) const {
    std::vector<Vec3> own;
    own.reserve(points.size());
    for (const Vec3& x : points) own.push_back(turn_.transpose() * (x - center_));
    return own;
}

std::vector<Vec3> PosedField::own_axes(std::span<const Vec3> vectors) const {
    std::vector<Vec3> own;
    own.reserve(vectors.size());
    for (const Vec3& v : vectors) own.push_back(turn_.transpose() * v);
    return own;
}

void PosedField::add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order,
                             double scale, FieldSamples& out) const {
    if (!moved_) {
        field_->add_samples(points, moments, order, scale, out);
        return;
    }
    FieldSamples own;
    own.reset(points.size(), order);
    field_->add_samples(own_points(points), own_axes(moments), order, scale, own);
    for (std::size_t k = 0; k < own.flux.size(); ++k) out.flux[k] += turn_ * own.flux[k];
    for (std::size_t k = 0; k < own.gradient.size(); ++k)
        out.gradient[k] += turn_ * own.gradient[k] * turn_.transpose();
    for (std::size_t k = 0; k < own.curvature.size(); ++k)
        out.curvature[k] += turn_ * own.curvature[k] * turn_.transpose();
}

std::vector<FieldParameter> PosedField::parameters() const {
    std::vector<FieldParameter> result = field_->parameters();
    result.push_back({"center", "m", 1, 3});
    result.push_back({"rotation", "rad", 1, 3});
    return result;
}

std::shared_ptr<AppliedField> PosedField::clone() const {
    auto copy = std::make_shared<PosedField>(*this);
    copy->own_ = field_->clone();
    if (copy->own_) copy->field_ = copy->own_;
    return copy;
}

void PosedField::set_values(std::span<const double> values) {
    const std::span<const double> of_field = values.first(n_own_);
    if (own_ && !std::equal(of_field.begin(), of_field.end(), last_.begin(), last_.end())) {
        last_.assign(of_field.begin(), of_field.end());
        own_->set_values(of_field);
    }
    set_pose(Vec3(values.data() + n_own_), Vec3(values.data() + n_own_ + 3));
}

// Gradient of w = u . B + m . (G v), G = dB/dx, with all vectors in the field's own axes. A displacement of the
// field changes w as the opposite displacement of the point does; a rotation as the opposite rotation of u, m,
// v and the point about the center does.
void PosedField::add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                         std::span<double> out) const {
    const std::vector<Vec3> y = own_points(points);
    const FieldProbe own{own_axes(probe.flux), own_axes(probe.moment), own_axes(probe.direction)};
    if (n_own_ > 0) field_->add_vjp(y, own, scale, out.first(n_own_));

    FieldSamples at;
    at.reset(points.size(), 2);
    field_->add_samples(y, own.moment, 2, scale, at);
    Vec3 by_points = Vec3::Zero(), torques = Vec3::Zero();
    for (std::size_t k = 0; k < y.size(); ++k) {
        const Vec3 &u = own.flux[k], &m = own.moment[k], &v = own.direction[k];
        const Mat3& slope = at.gradient[k];
        const Vec3 by_point = slope.transpose() * u + at.curvature[k] * v;
        by_points += by_point;
        torques +=
            u.cross(at.flux[k]) + m.cross(slope * v) + v.cross(slope.transpose() * m) + y[k].cross(by_point);
    }
    double* by_place = out.data() + n_own_;
    Eigen::Map<Vec3> by_center(by_place), by_rotation(by_place + 3);
    by_center -= turn_ * by_points;
    by_rotation -= transposed_jacobian_times(rotation_, turn_ * torques);
}

}  // namespace magshell
