#include "magshell/terms/magnetic/moment_term.h"

namespace magshell {

MomentTerm::MomentTerm(const std::vector<Magnet>& magnets, const Nodes& nodes, const FieldSources& sources,
                       const SystemMatrix& matrix, Registry& registry)
    : field_(sources, registry) {
    for (const Magnet& magnet : magnets) {
        Chunk& chunk = chunks_.emplace_back();
        chunk.corners = magnet.corners;
        chunk.moment = registry.values.add(magnet.owner, "magnetic_moment", "A m2", 1, 3);
        chunk.center = registry.values.add(magnet.owner, "center", "m", 1, 3);
        chunk.middle = Vec3::Zero();
        for (const Index node : chunk.corners) chunk.middle += 0.25 * nodes.rest[node];
        for (int k = 0; k < 4; ++k) {
            const Vec3 rho = nodes.rest[chunk.corners[k]] - chunk.middle;
            chunk.offsets[k] = rho * (3.0 / (4.0 * rho.squaredNorm()));  // |rho|^2 = 3 l^2
        }
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < i; ++j)
                chunk.slots[i][j] = matrix.node_slot(chunk.corners[i], chunk.corners[j]);
    }
}

bool MomentTerm::set_values(const Values& values) {
    bool changed = false;
    for (Chunk& chunk : chunks_) {
        changed |= values.changed(chunk.moment, chunk.center);
        const Vec3 moment = values.vector(chunk.moment), center = values.vector(chunk.center) - chunk.middle;
        for (int k = 0; k < 4; ++k) {
            chunk.alpha[k] = chunk.offsets[k].dot(moment);
            chunk.b[k] = 0.25 + chunk.offsets[k].dot(center);
        }
    }
    return changed;
}

MomentTerm::Each MomentTerm::at_corners(const Chunk& chunk, const double* from) {
    Each at;
    for (int k = 0; k < 4; ++k) at[k] = Eigen::Map<const Vec3>(from + 3 * chunk.corners[k]);
    return at;
}

Vec3 MomentTerm::sum(const std::array<double, 4>& weights, const Each& of) {
    return weights[0] * of[0] + weights[1] * of[1] + weights[2] * of[2] + weights[3] * of[3];
}

FieldSamples MomentTerm::sample(const double* q, const Controls& controls, int order,
                                std::vector<Vec3>& points, std::vector<Vec3>& moments) const {
    for (const Chunk& chunk : chunks_) {
        const Each x = at_corners(chunk, q);
        points.push_back(sum(chunk.b, x));
        moments.push_back(sum(chunk.alpha, x));
    }
    FieldSamples samples = field_.sample(points, moments, order, controls);
    for (Vec3& flux : samples.flux) flux += field_.uniform(controls);
    return samples;
}

double MomentTerm::energy(const double* q, const Controls& controls) const {
    std::vector<Vec3> points, moments;
    const FieldSamples field = sample(q, controls, 0, points, moments);
    double total = 0.0;
    for (std::size_t n = 0; n < chunks_.size(); ++n) total -= moments[n].dot(field.flux[n]);
    return total;
}

void MomentTerm::evaluate(const double* q, const Controls& controls, Residual& out) {
    std::vector<Vec3> points, moments;
    const FieldSamples field = sample(q, controls, 1, points, moments);
    for (std::size_t n = 0; n < chunks_.size(); ++n)
        for (int k = 0; k < 4; ++k) {
            const Vec3 g = -chunks_[n].alpha[k] * field.flux[n] -
                           chunks_[n].b[k] * (field.gradient[n].transpose() * moments[n]);
            for (int c = 0; c < 3; ++c) out.add(3 * chunks_[n].corners[k] + c, g[c]);
        }
}

void MomentTerm::finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const {
    if (!field_.varies(controls)) return;
    std::vector<Vec3> points, moments;
    const FieldSamples field = sample(q, controls, 2, points, moments);
    for (std::size_t n = 0; n < chunks_.size(); ++n) {
        const Chunk& chunk = chunks_[n];
        const Mat3 &along = field.gradient[n], &twice = field.curvature[n];
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j <= i; ++j) {
                const Mat3 block = -chunk.alpha[i] * chunk.b[j] * along -
                                   chunk.b[i] * chunk.alpha[j] * along.transpose() -
                                   chunk.b[i] * chunk.b[j] * twice;
                Pack33 entries;
                for (int r = 0; r < 3; ++r)
                    for (int c = 0; c < 3; ++c) entries.at[3 * r + c] = Pack(block(r, c));
                const Index a = chunk.corners[i], b = chunk.corners[j];
                if (i == j)
                    out.add_diagonal_block(a, entries, 0);
                else
                    out.add_block(chunk.slots[i][j], out.column_length(std::min(a, b)), entries, 0);
            }
    }
}

// The rate of the energy along lambda, with mu' = sum alpha_k lambda_k, v = sum b_k lambda_k and G = dB/dx,
//
//   D = - (mu' . B + mu . G v)
void MomentTerm::vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) {
    std::vector<Vec3> points, moments;
    const FieldSamples field = sample(q, controls, 2, points, moments);
    FieldProbe probe;  // - (mu', mu, v)
    for (std::size_t n = 0; n < chunks_.size(); ++n) {
        const Chunk& chunk = chunks_[n];
        const Each x = at_corners(chunk, q), rate = at_corners(chunk, lambda);
        const Vec3 turn = sum(chunk.alpha, rate), v = sum(chunk.b, rate), along = field.gradient[n] * v;
        Vec3 by_moment = Vec3::Zero(), by_center = Vec3::Zero();
        for (int k = 0; k < 4; ++k) {
            by_moment -= chunk.offsets[k] * (rate[k].dot(field.flux[n]) + x[k].dot(along));
            by_center -= chunk.offsets[k] *
                         (turn.dot(field.gradient[n] * x[k]) + moments[n].dot(field.gradient[n] * rate[k]) +
                          x[k].dot(field.curvature[n] * v));
        }
        out.values.segment<3>(chunk.moment.first) += by_moment;
        out.values.segment<3>(chunk.center.first) += by_center;
        probe.flux.push_back(-turn);
        probe.moment.push_back(-moments[n]);
        probe.direction.push_back(v);
    }
    field_.add_vjp(points, probe, field_.at_factor_one(points, moments), controls, out);
}

}  // namespace magshell
