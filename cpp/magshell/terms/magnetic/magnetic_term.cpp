#include "magshell/terms/magnetic/magnetic_term.h"

#include <Eigen/LU>

#include "magshell/terms/magnetic/field_packs.h"

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
      elements_(loop.packs()) {}

bool MagneticTerm::set_values(const Values& values) {
    if (!values.changed(magnetization_, thickness_)) return false;
    normal_magnetization_ = false;
    thicknesses_.assign(values[thickness_], values[thickness_] + thickness_.size());
    for (Index pack = 0; pack < loop_.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const Index f = loop_.face(pack, lane);
            const Mat3 frame = rest_frame(surface_, f);
            const Vec3 across = frame.col(0).cross(frame.col(1)), m = values.vector(magnetization_, f);
            Vec3 coordinates = frame.inverse() * m;
            // A tangential magnetization keeps a normal coordinate of round-off size after the inverse: it is
            // set to zero.
            if (std::abs(coordinates[2]) <= 1e-14 * m.norm()) coordinates[2] = 0.0;
            if (coordinates[2] != 0.0) normal_magnetization_ = true;
            elements_[pack].volume.set(lane, 0.5 * across.norm() * thicknesses_[f]);
            elements_[pack].alpha.set(lane, coordinates[0]);
            elements_[pack].beta.set(lane, coordinates[1]);
            elements_[pack].gamma.set(lane, coordinates[2]);
        }
    return true;
}

void MagneticTerm::find_points(const double* q, std::vector<Vec3>& points,
                               std::vector<Vec3>& magnetizations) const {
    points.resize(surface_.n_faces());
    magnetizations.resize(surface_.n_faces());
    loop_.each_pack([&](Index pack) {
        Pack3 x[3];
        loop_.gather(pack, q, x);
        const Pack3 center = Pack(1.0 / 3.0) * (x[0] + x[1] + x[2]);
        const Pack3 m = Magnetic(x).magnetization(elements_[pack]);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            points[loop_.face(pack, lane)] = lane_of(center, lane);
            magnetizations[loop_.face(pack, lane)] = lane_of(m, lane);
        }
    });
}

std::vector<Magnetic::Field> MagneticTerm::sample(const double* q, const Controls& controls,
                                                  int order) const {
    if (!field_.varies(controls)) return {};
    std::vector<Vec3> points, moments;
    find_points(q, points, moments);
    const FieldSamples samples = field_.sample(points, moments, order, controls);
    const Vec3 everywhere = field_.uniform(controls);
    std::vector<Magnetic::Field> packs(loop_.packs());
    for (Index pack = 0; pack < loop_.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane)
            set_field(packs[pack], lane, samples, loop_.face(pack, lane), order, everywhere);
    return packs;
}

double MagneticTerm::energy(const double* q, const Controls& controls) const {
    const std::vector<Magnetic::Field> fields = sample(q, controls, 0);
    const Pack3 everywhere = broadcast(field_.uniform(controls));
    return loop_.sum([&](Index pack) {
        Pack3 x[3];
        loop_.gather(pack, q, x);
        return Magnetic(x).energy(elements_[pack], fields.empty() ? everywhere : fields[pack].flux);
    });
}

void MagneticTerm::evaluate(const double* q, const Controls& controls, Residual& out) {
    const std::vector<Magnetic::Field> fields = sample(q, controls, 1);
    const bool varies = !fields.empty();
    const Pack3 everywhere = broadcast(field_.uniform(controls));
    loop_.scatter_packs([&](Index pack) {
        Pack3 x[3], g[3];
        loop_.gather(pack, q, x);
        const Magnetic face(x);
        face.gradient(elements_[pack], varies ? fields[pack].flux : everywhere, g);
        if (varies) {
            const Pack3 pull = face.gradient_by_position(elements_[pack], fields[pack]);
            for (Pack3& at_node : g) at_node += pull;
        }
        loop_.scatter(pack, g, out);
    });
}

void MagneticTerm::prepare_assembly(const double* q, const Controls& controls) {
    fields_ = sample(q, controls, 2);
}

void MagneticTerm::assemble(const Chunk& chunk, const double* q, const Controls& controls, bool,
                            SystemMatrix& out) const {
    const bool varies = !fields_.empty();
    const Vec3 uniform = field_.uniform(controls);
    if (!varies && (!normal_magnetization_ || uniform.isZero(0.0))) return;
    const Pack3 everywhere = broadcast(uniform);
    FaceLoop::over_packs(chunk, [&](Index pack) {
        Pack3 x[3];
        Pack33 h[6];
        loop_.gather(pack, q, x);
        const Magnetic face(x);
        face.hessian(elements_[pack], varies ? fields_[pack].flux : everywhere, h);
        if (varies) face.add_hessian_by_position(elements_[pack], fields_[pack], h);
        loop_.scatter(pack, h, out);
    });
}

// The rate of the energy along lambda, with M' and v the rates of F_0 M~_r and of x_b and G = dB/dx,
//
//   D = - A~ h (M' . B + M . G v),   M' = alpha a_1' + beta a_2' + gamma n',
//
// is linear in (alpha, beta, gamma), in the thickness and in the field.
void MagneticTerm::vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) {
    const Index n = surface_.n_faces();
    const double factor = field_.factor(controls);
    const Vec3 everywhere = field_.uniform(controls);
    std::vector<Vec3> points, magnetizations;
    find_points(q, points, magnetizations);
    const FieldSamples samples = field_.at_factor_one(points, magnetizations);

    FieldProbe probe;  // - A~ h (M', M, v)
    probe.flux.resize(n), probe.moment.resize(n), probe.direction.resize(n);
    loop_.each_pack([&](Index pack) {
        Pack3 x[3], rate[3];
        loop_.gather(pack, q, x);
        loop_.gather(pack, lambda, rate);
        const Magnetic face(x);
        const Pack3 turn = face.normal_rate(rate);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            const Index f = loop_.face(pack, lane);
            const Magnetic::Element& e = elements_[pack];
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
    field_.add_vjp(points, probe, samples, controls, out);
}

std::size_t MagneticTerm::bytes() const {
    return bytes_of(elements_) + bytes_of(thicknesses_) + bytes_of(fields_);
}

}  // namespace magshell
