#include "magshell/assembly/magnetic_term.h"

#include <Eigen/LU>

namespace magshell {
namespace {

Pack3 broadcast(const Vec3& v) { return {Pack(v.x()), Pack(v.y()), Pack(v.z())}; }

}  // namespace

MagneticTerm::MagneticTerm(const Sheet& sheet, const FaceLoop& loop,
                           std::vector<std::shared_ptr<const AppliedField>> sources)
    : sheet_(sheet), loop_(loop), sources_(std::move(sources)), elements_(loop.packs()) {}

void MagneticTerm::set_magnetization(const std::vector<Vec3>& remanent_magnetization,
                                     const std::vector<double>& thickness) {
    normal_magnetization_ = false;
    for (Index pack = 0; pack < loop_.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const Index f = loop_.face(pack, lane);
            const std::array<Index, 3>& c = sheet_.corners[f];
            const Vec3 a1 = sheet_.rest[c[1]] - sheet_.rest[c[0]], a2 = sheet_.rest[c[2]] - sheet_.rest[c[0]];
            const Vec3 across = a1.cross(a2);
            Mat3 frame;
            frame << a1, a2, across.normalized();
            const Vec3 m = remanent_magnetization[f];
            Vec3 coordinates = frame.inverse() * m;
            // What the inverse leaves of a tangential magnetization along the normal is round-off, not magnetization.
            if (std::abs(coordinates[2]) <= 1e-14 * m.norm()) coordinates[2] = 0.0;
            if (coordinates[2] != 0.0) normal_magnetization_ = true;
            elements_[pack].volume.set(lane, 0.5 * across.norm() * thickness[f]);
            elements_[pack].alpha.set(lane, coordinates[0]);
            elements_[pack].beta.set(lane, coordinates[1]);
            elements_[pack].gamma.set(lane, coordinates[2]);
        }
}

std::vector<Magnetic::Field> MagneticTerm::sample(const double* q, const Controls& controls, int order) const {
    const Index n = sheet_.n_faces();
    std::vector<Vec3> points(n), moments(n);
    loop_.each_pack([&](Index pack) {
        Pack3 x[3];
        loop_.gather(pack, q, x);
        const Pack3 centre = Pack(1.0 / 3.0) * (x[0] + x[1] + x[2]);
        const Pack3 m = Magnetic(x).magnetization(elements_[pack]);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            points[loop_.face(pack, lane)] = {centre.x[lane], centre.y[lane], centre.z[lane]};
            moments[loop_.face(pack, lane)] = {m.x[lane], m.y[lane], m.z[lane]};
        }
    });
    FieldSamples samples;
    samples.reset(n, order);
    for (const std::shared_ptr<const AppliedField>& source : sources_)
        source->add_samples(points, moments, order, controls.field, samples);

    std::vector<Magnetic::Field> packs(loop_.packs());
    for (Index pack = 0; pack < loop_.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const Index f = loop_.face(pack, lane);
            set_lane(packs[pack].flux, lane, samples.flux[f] + controls.flux_density);
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c) {
                    if (order >= 1) packs[pack].gradient.at[3 * r + c].set(lane, samples.gradient[f](r, c));
                    if (order >= 2) packs[pack].curvature.at[3 * r + c].set(lane, samples.curvature[f](r, c));
                }
        }
    return packs;
}

double MagneticTerm::energy(const double* q, const Controls& controls) const {
    const bool varies = sampled(controls);
    const std::vector<Magnetic::Field> fields = varies ? sample(q, controls, 0) : std::vector<Magnetic::Field>();
    const Pack3 uniform = broadcast(controls.flux_density);
    return loop_.sum([&](Index pack) {
        Pack3 x[3];
        loop_.gather(pack, q, x);
        return Magnetic(x).energy(elements_[pack], varies ? fields[pack].flux : uniform);
    });
}

void MagneticTerm::evaluate(const double* q, const Controls& controls, Residual& out) {
    const bool varies = sampled(controls);
    const std::vector<Magnetic::Field> fields = varies ? sample(q, controls, 1) : std::vector<Magnetic::Field>();
    const Pack3 uniform = broadcast(controls.flux_density);
    loop_.scatter_packs([&](Index pack) {
        Pack3 x[3], g[3];
        loop_.gather(pack, q, x);
        const Magnetic face(x);
        face.gradient(elements_[pack], varies ? fields[pack].flux : uniform, g);
        if (varies) {
            const Pack3 pull = face.gradient_by_place(elements_[pack], fields[pack]);
            for (Pack3& at_node : g) at_node += pull;
        }
        loop_.scatter(pack, g, out);
    });
}

void MagneticTerm::prepare_assembly(const double* q, const Controls& controls) {
    fields_.clear();
    if (sampled(controls)) fields_ = sample(q, controls, 2);
}

void MagneticTerm::assemble(const Part& part, const double* q, const Controls& controls, bool, SystemMatrix& out) const {
    const bool varies = !fields_.empty();
    if (!varies && (!normal_magnetization_ || controls.flux_density.isZero(0.0))) return;
    const Pack3 uniform = broadcast(controls.flux_density);
    FaceLoop::over_packs(part, [&](Index pack) {
        Pack3 x[3];
        Pack33 h[6];
        loop_.gather(pack, q, x);
        const Magnetic face(x);
        face.hessian(elements_[pack], varies ? fields_[pack].flux : uniform, h);
        if (varies) face.add_hessian_by_place(elements_[pack], fields_[pack], h);
        loop_.scatter(pack, h, out);
    });
}

std::size_t MagneticTerm::bytes() const { return bytes_of(elements_); }

}  // namespace magshell
