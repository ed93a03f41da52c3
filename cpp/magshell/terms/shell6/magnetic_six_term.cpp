#include "magshell/terms/shell6/magnetic_six_term.h"

#include <Eigen/LU>

namespace magshell {

MagneticSixTerm::MagneticSixTerm(const SixNodeShell& sheet, Index body, const ColoredLoop& element_blocks,
                                 const SystemMatrix& matrix, const FieldSources& sources, Registry& registry)
    : sheet_(sheet),
      body_(body),
      loop_(sheet.own_nodes, element_blocks, matrix),
      field_(sources, registry),
      magnetization_(registry.values.add(sheet.owner, "remanent_magnetization", "A/m", sheet.n_faces(), 3,
                                         &sheet.faces)),
      thickness_(registry.values.add(sheet.owner, "thickness", "m", sheet.n_faces(), 1, &sheet.faces)),
      elements_(loop_.groups()) {}

Mat3 MagneticSixTerm::rest_frame(Index face, int point) const {
    const std::array<double, 3>& at = six_nodes::inside[point].at;
    const std::array<double, 6> first = six_nodes::derivative(2, at), second = six_nodes::derivative(1, at);
    Vec3 a1 = Vec3::Zero(), a2 = Vec3::Zero();
    for (int k = 0; k < 6; ++k) {
        a1 += first[k] * sheet_.rest[face][k];
        a2 -= second[k] * sheet_.rest[face][k];
    }
    Mat3 frame;
    frame << a1, a2, a1.cross(a2).normalized();
    return frame;
}

bool MagneticSixTerm::set_values(const Values& values) {
    if (!values.changed(magnetization_, thickness_)) return false;
    normal_magnetization_ = false;
    thicknesses_.assign(values[thickness_], values[thickness_] + thickness_.size());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.element(group, lane);
            const Vec3 m = values.vector(magnetization_, f);
            for (int p = 0; p < points; ++p) {
                const Mat3 frame = rest_frame(f, p);
                Vec3 coordinates = frame.inverse() * m;
                // A tangential magnetization keeps a normal coordinate of round-off size after the inverse: it
                // is set to zero.
                if (std::abs(coordinates[2]) <= 1e-14 * m.norm()) coordinates[2] = 0.0;
                if (coordinates[2] != 0.0) normal_magnetization_ = true;
                MagneticSix::Element& e = elements_[group].at[p];
                e.volume.set(lane, 0.5 * six_nodes::inside[p].weight *
                                       frame.col(0).cross(frame.col(1)).norm() * thicknesses_[f]);
                e.alpha.set(lane, coordinates[0]);
                e.beta.set(lane, coordinates[1]);
                e.gamma.set(lane, coordinates[2]);
            }
        }
    return true;
}

void MagneticSixTerm::find_points(const double* q, std::vector<Vec3>& places,
                                  std::vector<Vec3>& magnetizations) const {
    places.resize(static_cast<std::size_t>(sheet_.n_faces()) * points);
    magnetizations.resize(places.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[6];
        loop_.gather(group, q, x);
        for (int p = 0; p < points; ++p) {
            const SimdVec3 at = MagneticSix::position(x, p),
                           m = MagneticSix(x, p).frame().magnetization(elements_[group].at[p]);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Index n = loop_.element(group, lane) * points + p;
                places[n] = lane_of(at, lane);
                magnetizations[n] = lane_of(m, lane);
            }
        }
    });
}

std::vector<MagneticSixTerm::Fields> MagneticSixTerm::sample(const double* q,
                                                             const LoadParameters& load_parameters,
                                                             int order) const {
    if (!field_.varies(load_parameters)) return {};
    std::vector<Vec3> places, moments;
    find_points(q, places, moments);
    return in_groups<points>(loop_, field_.sample(places, moments, order, load_parameters), order,
                             field_.uniform(load_parameters));
}

double MagneticSixTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    const std::vector<Fields> fields = sample(q, load_parameters, 0);
    const SimdVec3 everywhere = broadcast(field_.uniform(load_parameters));
    return loop_.sum([&](Index group) {
        SimdVec3 x[6];
        loop_.gather(group, q, x);
        SimdDouble total(0.0);
        for (int p = 0; p < points; ++p)
            total += MagneticSix(x, p).frame().energy(elements_[group].at[p],
                                                      fields.empty() ? everywhere : fields[group].at[p].flux);
        return total;
    });
}

void MagneticSixTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const std::vector<Fields> fields = sample(q, load_parameters, 1);
    const SimdVec3 everywhere = broadcast(field_.uniform(load_parameters)), none = broadcast(Vec3::Zero());
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[6], g[6];
        loop_.gather(group, q, x);
        std::fill_n(g, 6, none);
        for (int p = 0; p < points; ++p) {
            const MagneticSix at(x, p);
            const MagneticSix::Element& e = elements_[group].at[p];
            at.add_gradient(e, fields.empty() ? everywhere : fields[group].at[p].flux, g);
            if (!fields.empty()) at.add_gradient_by_position(e, fields[group].at[p], g);
        }
        loop_.scatter(group, g, out);
    });
}

void MagneticSixTerm::prepare_assembly(const double* q, const LoadParameters& load_parameters) {
    fields_ = sample(q, load_parameters, 2);
}

void MagneticSixTerm::assemble(const ElementBlock& element_block, const double* q,
                               const LoadParameters& load_parameters, bool, SystemMatrix& out) const {
    const bool varies = !fields_.empty();
    const Vec3 uniform = field_.uniform(load_parameters);
    if (!varies && (!normal_magnetization_ || uniform.isZero(0.0))) return;
    const SimdVec3 everywhere = broadcast(uniform);
    ElementLoop<6>::over_groups(element_block, [&](Index group) {
        SimdVec3 x[6];
        SimdMat3 h[21] = {};
        loop_.gather(group, q, x);
        for (int p = 0; p < points; ++p) {
            const MagneticSix at(x, p);
            const MagneticSix::Element& e = elements_[group].at[p];
            at.add_hessian(e, varies ? fields_[group].at[p].flux : everywhere, h);
            if (varies) at.add_hessian_by_position(e, fields_[group].at[p], h);
        }
        loop_.scatter(group, h, out);
    });
}

// The rate of the energy along lambda at each point. As for linear triangles (magnetic_term.cpp), with M' and v
// the rates of F_0 M~_r and of x_p, and G = dB/dx,
//
//   D = - V_p (M' . B + M . G v),   M' = alpha a_1' + beta a_2' + gamma n'.
void MagneticSixTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                          Gradient& out) {
    const double factor = field_.factor(load_parameters);
    const Vec3 everywhere = field_.uniform(load_parameters);
    std::vector<Vec3> places, magnetizations;
    find_points(q, places, magnetizations);
    const FieldSamples samples = field_.at_factor_one(places, magnetizations);

    FieldProbe probe;  // - V_p (M', M, v)
    probe.flux.resize(places.size()), probe.moment.resize(places.size()),
        probe.direction.resize(places.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[6], along[6];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, along);
        for (int p = 0; p < points; ++p) {
            const MagneticSix at(x, p);
            SimdVec3 rate[3];
            at.rates(along, rate);
            const SimdVec3 speed = MagneticSix::position(along, p);
            const MagneticSix::Element& e = elements_[group].at[p];
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Index f = loop_.element(group, lane), n = f * points + p;
                const Vec3 coordinates(e.alpha[lane], e.beta[lane], e.gamma[lane]), v = lane_of(speed, lane);
                Mat3 frame, frame_rate;
                frame << lane_of(at.frame().a1, lane), lane_of(at.frame().a2, lane),
                    lane_of(at.frame().normal, lane);
                frame_rate << lane_of(rate[0], lane), lane_of(rate[1], lane), lane_of(rate[2], lane);
                const Vec3 flux = everywhere + factor * samples.flux[n];
                const Vec3 flux_rate = factor * (samples.gradient[n] * v);
                const double volume = e.volume[lane];
                const Vec3 by_coordinates =
                    -volume * (frame_rate.transpose() * flux + frame.transpose() * flux_rate);
                out.values.segment<3>(magnetization_.at(f)) +=
                    rest_frame(f, p).transpose().inverse() * by_coordinates;
                out.values[thickness_.at(f)] += by_coordinates.dot(coordinates) / thicknesses_[f];
                probe.flux[n] = -volume * (frame_rate * coordinates);
                probe.moment[n] = -volume * magnetizations[n];
                probe.direction[n] = v;
            }
        }
    });
    field_.add_vjp(places, probe, samples, load_parameters, out);
}

std::size_t MagneticSixTerm::bytes() const {
    return loop_.bytes() + bytes_of(elements_) + bytes_of(thicknesses_) + bytes_of(fields_);
}

}  // namespace magshell
