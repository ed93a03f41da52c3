#include "magshell/terms/magnetic/moment_term.h"

namespace magshell {

MomentTerm::MomentTerm(const std::vector<Magnet>& magnets, const Nodes& nodes, const FieldSources& sources,
                       const SystemMatrix& matrix, Registry& registry)
    : field_(sources, registry) {
    for (const Magnet& magnet : magnets) {
        ElementBlock& element_block =
            element_blocks_.emplace_back(ElementBlock{.corners = magnet.corners,
                                                      .weights = CornerWeights(magnet.corners, nodes),
                                                      .moment = {},
                                                      .center = {},
                                                      .slots = {}});
        element_block.moment = registry.values.add(magnet.owner, "magnetic_moment", "A m2", 1, 3);
        element_block.center = registry.values.add(magnet.owner, "center", "m", 1, 3);
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < i; ++j)
                element_block.slots[i][j] =
                    matrix.node_slot(element_block.corners[i], element_block.corners[j]);
    }
}

bool MomentTerm::set_values(const Values& values) {
    bool changed = false;
    for (ElementBlock& element_block : element_blocks_) {
        changed |= values.changed(element_block.moment, element_block.center);
        element_block.alpha = element_block.weights.of_vector(values.vector(element_block.moment));
        element_block.b = element_block.weights.of_point(values.vector(element_block.center));
    }
    return changed;
}

MomentTerm::Each MomentTerm::at_corners(const ElementBlock& element_block, const double* from) {
    Each at;
    for (int k = 0; k < 4; ++k) at[k] = Eigen::Map<const Vec3>(from + 3 * element_block.corners[k]);
    return at;
}

Vec3 MomentTerm::sum(const std::array<double, 4>& weights, const Each& of) {
    return weights[0] * of[0] + weights[1] * of[1] + weights[2] * of[2] + weights[3] * of[3];
}

void MomentTerm::add_moments(const double* q, const LoadParameters&, std::vector<Vec3>& points,
                             std::vector<Vec3>& moments) const {
    for (const ElementBlock& element_block : element_blocks_) {
        const Each x = at_corners(element_block, q);
        points.push_back(sum(element_block.b, x));
        moments.push_back(sum(element_block.alpha, x));
    }
}

FieldSamples MomentTerm::sample(const double* q, const LoadParameters& load_parameters, int order,
                                std::vector<Vec3>& points, std::vector<Vec3>& moments) const {
    add_moments(q, load_parameters, points, moments);
    FieldSamples samples = field_.sample(points, moments, order, load_parameters);
    for (Vec3& flux : samples.flux) flux += field_.uniform(load_parameters);
    return samples;
}

double MomentTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    std::vector<Vec3> points, moments;
    const FieldSamples field = sample(q, load_parameters, 0, points, moments);
    double total = 0.0;
    for (std::size_t n = 0; n < element_blocks_.size(); ++n) total -= moments[n].dot(field.flux[n]);
    return total;
}

void MomentTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    std::vector<Vec3> points, moments;
    const FieldSamples field = sample(q, load_parameters, 1, points, moments);
    for (std::size_t n = 0; n < element_blocks_.size(); ++n)
        for (int k = 0; k < 4; ++k) {
            const Vec3 g = -element_blocks_[n].alpha[k] * field.flux[n] -
                           element_blocks_[n].b[k] * (field.gradient[n].transpose() * moments[n]);
            for (int c = 0; c < 3; ++c) out.add(3 * element_blocks_[n].corners[k] + c, g[c]);
        }
}

void MomentTerm::finish_assembly(const double* q, const LoadParameters& load_parameters,
                                 SystemMatrix& out) const {
    if (!field_.varies(load_parameters)) return;
    std::vector<Vec3> points, moments;
    const FieldSamples field = sample(q, load_parameters, 2, points, moments);
    for (std::size_t n = 0; n < element_blocks_.size(); ++n) {
        const ElementBlock& element_block = element_blocks_[n];
        const Mat3 &along = field.gradient[n], &twice = field.curvature[n];
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j <= i; ++j) {
                const Mat3 block = -element_block.alpha[i] * element_block.b[j] * along -
                                   element_block.b[i] * element_block.alpha[j] * along.transpose() -
                                   element_block.b[i] * element_block.b[j] * twice;
                SimdMat3 entries;
                for (int r = 0; r < 3; ++r)
                    for (int c = 0; c < 3; ++c) entries.at[3 * r + c] = SimdDouble(block(r, c));
                const Index a = element_block.corners[i], b = element_block.corners[j];
                if (i == j)
                    out.add_diagonal_block(a, entries, 0);
                else
                    out.add_block(element_block.slots[i][j], out.column_length(std::min(a, b)), entries, 0);
            }
    }
}

// The rate of the energy along lambda, with mu' = sum alpha_k lambda_k, v = sum b_k lambda_k and G = dB/dx,
//
//   D = - (mu' . B + mu . G v)
void MomentTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                     Gradient& out) {
    std::vector<Vec3> points, moments;
    const FieldSamples field = sample(q, load_parameters, 2, points, moments);
    FieldProbe probe;  // - (mu', mu, v)
    for (std::size_t n = 0; n < element_blocks_.size(); ++n) {
        const ElementBlock& element_block = element_blocks_[n];
        const Each x = at_corners(element_block, q), rate = at_corners(element_block, lambda);
        const Vec3 turn = sum(element_block.alpha, rate), v = sum(element_block.b, rate),
                   along = field.gradient[n] * v;
        CornerWeights::Each by_alpha, by_b;
        for (int k = 0; k < 4; ++k) {
            by_alpha[k] = -(rate[k].dot(field.flux[n]) + x[k].dot(along));
            by_b[k] = -(turn.dot(field.gradient[n] * x[k]) + moments[n].dot(field.gradient[n] * rate[k]) +
                        x[k].dot(field.curvature[n] * v));
        }
        out.values.segment<3>(element_block.moment.first) += element_block.weights.gradient(by_alpha);
        out.values.segment<3>(element_block.center.first) += element_block.weights.gradient(by_b);
        probe.flux.push_back(-turn);
        probe.moment.push_back(-moments[n]);
        probe.direction.push_back(v);
    }
    field_.add_vjp(points, probe, field_.at_factor_one(points, moments), load_parameters, out);
}

}  // namespace magshell
