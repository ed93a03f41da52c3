#include "magshell/terms/magnetic/magnetic_term.h"

#include <Eigen/LU>
#include <limits>

#include "magshell/mesh/half_edges.h"
#include "magshell/terms/magnetic/field_groups.h"

namespace magshell {
namespace {

// Returns the matrix (a~_1, a~_2, n~) of a face.
Mat3 rest_frame(const Surface& surface, Index face) {
    const std::array<Vec3, 3>& x = surface.rest_corners(face);
    const Vec3 a1 = x[1] - x[0], a2 = x[2] - x[0];
    Mat3 frame;
    frame << a1, a2, a1.cross(a2).normalized();
    return frame;
}

}  // namespace

MagneticTerm::MagneticTerm(const Surface& surface, Index body, const FaceLoop& loop,
                           const FieldSources& sources, Registry& registry)
    : surface_(surface),
      body_(body),
      loop_(loop),
      field_(sources, registry),
      magnetization_(registry.values.add(surface.owner, "remanent_magnetization", "A/m", surface.n_faces(), 3,
                                         &surface.faces)),
      thickness_(registry.values.add(surface.owner, "thickness", "m", surface.n_faces(), 1, &surface.faces)),
      elements_(loop.groups()) {}

bool MagneticTerm::set_values(const Values& values) {
    if (!values.changed(magnetization_, thickness_)) return false;
    normal_magnetization_ = false;
    thicknesses_.assign(values[thickness_], values[thickness_] + thickness_.size());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.face(group, lane);
            const Mat3 frame = rest_frame(surface_, f);
            const Vec3 across = frame.col(0).cross(frame.col(1)), m = values.vector(magnetization_, f);
            Vec3 coordinates = frame.inverse() * m;
            // A tangential magnetization keeps a normal coordinate of round-off size after the inverse: it is
            // set to zero.
            if (std::abs(coordinates[2]) <= 1e-14 * m.norm()) coordinates[2] = 0.0;
            if (coordinates[2] != 0.0) normal_magnetization_ = true;
            elements_[group].volume.set(lane, 0.5 * across.norm() * thicknesses_[f]);
            elements_[group].alpha.set(lane, coordinates[0]);
            elements_[group].beta.set(lane, coordinates[1]);
            elements_[group].gamma.set(lane, coordinates[2]);
        }
    return true;
}

void MagneticTerm::find_points(const double* q, std::vector<Vec3>& points,
                               std::vector<Vec3>& magnetizations) const {
    points.resize(surface_.n_faces());
    magnetizations.resize(surface_.n_faces());
    loop_.each_group([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        const SimdVec3 center = SimdDouble(1.0 / 3.0) * (x[0] + x[1] + x[2]);
        const SimdVec3 m = Magnetic(x).magnetization(elements_[group]);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            points[loop_.face(group, lane)] = lane_of(center, lane);
            magnetizations[loop_.face(group, lane)] = lane_of(m, lane);
        }
    });
}

std::vector<Magnetic::Field> MagneticTerm::sample(const double* q, const LoadParameters& load_parameters,
                                                  int order) const {
    if (!field_.varies(load_parameters)) return {};
    std::vector<Vec3> points, moments;
    find_points(q, points, moments);
    const FieldSamples samples = field_.sample(points, moments, order, load_parameters);
    const Vec3 everywhere = field_.uniform(load_parameters);
    std::vector<Magnetic::Field> groups(loop_.groups());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane)
            set_field(groups[group], lane, samples, loop_.face(group, lane), order, everywhere);
    return groups;
}

double MagneticTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    const std::vector<Magnetic::Field> fields = sample(q, load_parameters, 0);
    const SimdVec3 everywhere = broadcast(field_.uniform(load_parameters));
    return loop_.sum([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        return Magnetic(x).energy(elements_[group], fields.empty() ? everywhere : fields[group].flux);
    });
}

void MagneticTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const std::vector<Magnetic::Field> fields = sample(q, load_parameters, 1);
    const bool varies = !fields.empty();
    const SimdVec3 everywhere = broadcast(field_.uniform(load_parameters));
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[3], g[3];
        loop_.gather(group, q, x);
        const Magnetic face(x);
        face.gradient(elements_[group], varies ? fields[group].flux : everywhere, g);
        if (varies) {
            const SimdVec3 pull = face.gradient_by_position(elements_[group], fields[group]);
            for (SimdVec3& at_node : g) at_node += pull;
        }
        loop_.scatter(group, g, out);
    });
}

void MagneticTerm::prepare_assembly(const double* q, const LoadParameters& load_parameters) {
    fields_ = sample(q, load_parameters, 2);
}

void MagneticTerm::assemble(const ElementBlock& element_block, const double* q,
                            const LoadParameters& load_parameters, bool, SystemMatrix& out) const {
    const bool varies = !fields_.empty();
    const Vec3 uniform = field_.uniform(load_parameters);
    if (!varies && (!normal_magnetization_ || uniform.isZero(0.0))) return;
    const SimdVec3 everywhere = broadcast(uniform);
    FaceLoop::over_groups(element_block, [&](Index group) {
        SimdVec3 x[3];
        SimdMat3 h[6];
        loop_.gather(group, q, x);
        const Magnetic face(x);
        face.hessian(elements_[group], varies ? fields_[group].flux : everywhere, h);
        if (varies) face.add_hessian_by_position(elements_[group], fields_[group], h);
        loop_.scatter(group, h, out);
    });
}

// The rate of the energy along lambda, with M' and v the rates of F_0 M~_r and of x_b and G = dB/dx,
//
//   D = - A~ h (M' . B + M . G v),   M' = alpha a_1' + beta a_2' + gamma n',
//
// is linear in (alpha, beta, gamma), in the thickness and in the field.
void MagneticTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                       Gradient& out) {
    const Index n = surface_.n_faces();
    const double factor = field_.factor(load_parameters);
    const Vec3 everywhere = field_.uniform(load_parameters);
    std::vector<Vec3> points, magnetizations;
    find_points(q, points, magnetizations);
    const FieldSamples samples = field_.at_factor_one(points, magnetizations);

    FieldProbe probe;  // - A~ h (M', M, v)
    probe.flux.resize(n), probe.moment.resize(n), probe.direction.resize(n);
    loop_.each_group([&](Index group) {
        SimdVec3 x[3], rate[3];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, rate);
        const Magnetic face(x);
        const SimdVec3 turn = face.normal_rate(rate);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const Magnetic::Element& e = elements_[group];
            const Vec3 coordinates(e.alpha[lane], e.beta[lane], e.gamma[lane]),
                at[3] = {lane_of(rate[0], lane), lane_of(rate[1], lane), lane_of(rate[2], lane)};
            Mat3 frame, frame_rate;
            frame << lane_of(face.a1, lane), lane_of(face.a2, lane), lane_of(face.normal, lane);
            frame_rate << at[1] - at[0], at[2] - at[0], lane_of(turn, lane);
            const Vec3 v = (at[0] + at[1] + at[2]) / 3.0;
            const Vec3 flux = everywhere + factor * samples.flux[f];
            const Vec3 flux_rate = factor * (samples.gradient[f] * v);
            const double volume = e.volume[lane];
            const Vec3 by_coordinates =
                -volume * (frame_rate.transpose() * flux + frame.transpose() * flux_rate);
            out.values.segment<3>(magnetization_.at(f)) +=
                rest_frame(surface_, f).transpose().inverse() * by_coordinates;
            out.values[thickness_.at(f)] += by_coordinates.dot(coordinates) / thicknesses_[f];
            probe.flux[f] = -volume * (frame_rate * coordinates);
            probe.moment[f] = -volume * magnetizations[f];
            probe.direction[f] = v;
        }
    });
    field_.add_vjp(points, probe, samples, load_parameters, out);
}

void MagneticTerm::find_neighbours() {
    const Index n = surface_.n_faces();
    if (static_cast<Index>(neighbours_.size()) == n) return;
    Rows3i faces(n, 3);
    for (Index f = 0; f < n; ++f)
        for (int i = 0; i < 3; ++i) faces(f, i) = surface_.corners[f][i];
    neighbours_.assign(n, {-1, -1, -1});
    const std::vector<HalfEdge> sorted = sorted_half_edges(faces, faces.maxCoeff() + 1);
    for (std::size_t k = 0; k + 1 < sorted.size(); ++k) {
        const HalfEdge &a = sorted[k], &b = sorted[k + 1];
        if (a.low != b.low || a.high != b.high) continue;
        neighbours_[a.face][a.corner] = b.face;
        neighbours_[b.face][b.corner] = a.face;
    }
}

// A face with moment m = V M feels the force F(x_b) = G^T m, G = dB/dx. Its mean over the face is, to second order,
//
//   F + 1/2 F'' : S,   S = 1/12 sum_i d_i d_i^T,   d_i from the barycenter to corner i.
//
// The neighbour across the edge opposite corner i has its barycenter at e_i, along - d_i, so that 1/2 F''(d_i, d_i) is about
//
//   (|d_i| / |e_i|)^2 (G(x_b + e_i)^T m - F - F' e_i).
//
// Across an edge of the border it is taken as the mean of the others.
double MagneticTerm::field_sampling_error(const double* q, const LoadParameters& load_parameters,
                                          double extent) {
    constexpr double cancelling = 0.1;  // [-] of the sum of the forces, as in field_sampling.py
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    if (!field_.varies(load_parameters)) return 0.0;
    if (fields_.empty()) return unknown;
    find_neighbours();
    const Index n = surface_.n_faces();
    struct Sample {
        Vec3 point, moment;
        Mat3 gradient;
    };
    std::vector<Sample> samples(n);
    std::vector<Mat3> rates(n);  // F' [N/m]
    Vec3 force = Vec3::Zero(), error = Vec3::Zero();
    double forces = 0.0, couples = 0.0;
    loop_.each_group([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        const SimdVec3 center = SimdDouble(1.0 / 3.0) * (x[0] + x[1] + x[2]);
        const Magnetic::Element& e = elements_[group];
        const SimdVec3 moment = e.volume * Magnetic(x).magnetization(e);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            Sample& here = samples[f];
            here.point = lane_of(center, lane);
            here.moment = lane_of(moment, lane);
            for (int k = 0; k < 9; ++k) {
                here.gradient(k / 3, k % 3) = fields_[group].gradient.at[k][lane];
                rates[f](k / 3, k % 3) = e.volume[lane] * fields_[group].curvature.at[k][lane];
            }
            const Vec3 pull = here.gradient.transpose() * here.moment;
            force += pull;
            forces += pull.norm();
            couples += here.moment.cross(lane_of(fields_[group].flux, lane)).norm();
        }
    });
    for (Index f = 0; f < n; ++f) {
        const Sample& here = samples[f];
        if (here.moment.isZero(0.0)) continue;
        Vec3 sum = Vec3::Zero();
        int count = 0;
        for (int i = 0; i < 3; ++i) {
            if (neighbours_[f][i] < 0) continue;
            const Sample& there = samples[neighbours_[f][i]];
            const Vec3 step = there.point - here.point,
                       corner = Eigen::Map<const Vec3>(q + 3 * surface_.corners[f][i]) - here.point;
            const Vec3 beyond = (there.gradient - here.gradient).transpose() * here.moment - rates[f] * step;
            sum += (corner.squaredNorm() / step.squaredNorm()) * beyond;
            ++count;
        }
        if (count == 0) return unknown;
        error += sum * (3.0 / (12.0 * count));
    }
    const double total = std::max({(force + error).norm(), cancelling * forces, couples / extent});
    if (!(total > 0.0)) return total == 0.0 ? 0.0 : unknown;
    return error.norm() / total;
}

std::size_t MagneticTerm::bytes() const {
    return bytes_of(elements_) + bytes_of(thicknesses_) + bytes_of(fields_) + bytes_of(neighbours_);
}

}  // namespace magshell
