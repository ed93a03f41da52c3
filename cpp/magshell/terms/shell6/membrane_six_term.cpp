#include "magshell/terms/shell6/membrane_six_term.h"

#include <Eigen/LU>
#include <cmath>

#include "magshell/strain/six_nodes.h"

namespace magshell {

MembraneSixTerm::MembraneSixTerm(const SixNodeShell& shell, Index body, const ColoredLoop& element_blocks,
                                 const Nodes& nodes, const GrowthForm& growth, const SystemMatrix& matrix,
                                 Registry& registry)
    : StrainScaffold(shell.n_faces()),
      shell_(shell),
      body_(body),
      nodes_(nodes.n_nodes()),
      loop_(shell.own_nodes, element_blocks, matrix),
      materials_(shell.owner, shell.faces, registry),
      growth_(shell.owner, shell.faces, growth, registry),
      rest_(shell.rest.begin(), shell.rest.end()),
      rest_measures_(loop_.groups()),
      stiffness_(loop_.groups()) {
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6];
        for (int lane = 0; lane < SimdDouble::width; ++lane)
            for (int k = 0; k < 6; ++k) set_lane(x[k], lane, shell.rest[loop_.element(group, lane)][k]);
        MembraneSix(x).measures(rest_measures_[group].data());
    }
}

bool MembraneSixTerm::set_values(const Values& values) {
    const bool material_changed = materials_.set_values(values), grew = growth_.set_values(values);
    if (!material_changed && !grew) return false;
    if (grew) grow();
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.element(group, lane);
            set_lane(stiffness_[group], lane, rest_[f].membrane_stiffness(materials_[f]));
        }
    return true;
}

GrownSix MembraneSixTerm::grown(Index face) const {
    return {shell_.rest[face], growth_.growth(face), Mat3::Zero()};
}

void MembraneSixTerm::grow() {
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.element(group, lane);
            const GrownSix face = grown(f);
            rest_[f] = face.face();
            const Vec9 lengths = face.squared_lengths();
            for (int r = 0; r < 9; ++r) rest_measures_[group][r].set(lane, lengths[r]);
        }
}

double MembraneSixTerm::energy(const double* q, const LoadParameters&) const {
    return loop_.sum([&](Index group) {
        SimdDouble d[9], stress[9];
        strain(group, q, d);
        stiffness_[group].times(d, stress);
        SimdDouble sum = d[0] * stress[0];
        for (int r = 1; r < 9; ++r) sum += d[r] * stress[r];
        return SimdDouble(0.5) * sum;
    });
}

void MembraneSixTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    state_.assign(q, q + 3 * nodes_);
    loop_.each_group([&](Index group) {
        SimdDouble d[9];
        strain(group, q, d);
        store_stress(group, d);
    });
    add_forces(stress_, out);
}

void MembraneSixTerm::assemble(const ElementBlock& element_block, const double* q, const LoadParameters&,
                               bool extrapolated_stress, SystemMatrix& out) const {
    const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
    ElementLoop<6>::over_groups(element_block, [&](Index group) {
        SimdVec3 x[6];
        SimdMat3 h[21];
        SixNodeRows rows;
        loop_.gather(group, q, x);
        MembraneSix(x).rows(rows);
        rows.blocks(rows.times(history_.scaled(stiffness_[group])), h);
        MembraneSix::add_curvature(stress.at(group), h);
        loop_.scatter(group, h, out);
    });
}

Strains MembraneSixTerm::strains_at(const double* q) const {
    Strains out(shell_.n_faces(), 9);
    loop_.each_group([&](Index group) { strain(group, q, out.at(group)); });
    return out;
}

void MembraneSixTerm::strain(Index group, const double* q, SimdDouble d[9]) const {
    SimdVec3 x[6];
    loop_.gather(group, q, x);
    MembraneSix(x).measures(d);
    for (int r = 0; r < 9; ++r) d[r] -= rest_measures_[group][r];
}

void MembraneSixTerm::rate(Index group, const double* p, SimdDouble d[9]) const {
    SimdVec3 x[6], along[6];
    SixNodeRows rows;
    loop_.gather(group, state_.data(), x);
    loop_.gather(group, p, along);
    MembraneSix(x).rows(rows);
    rows.along(along, d);
}

void MembraneSixTerm::vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) {
    std::vector<Eigen::Vector2d> of_faces(shell_.n_faces());
    loop_.each_group([&](Index group) {
        SimdDouble d[9], along[9];
        strain(group, q, d);
        history_.apply<9>(group, d);
        rate(group, lambda, along);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            of_faces[f] = {
                lane_of<9>(along, lane).dot(rest_[f].membrane_stiffness(materials_[f]) * lane_of<9>(d, lane)),
                lane_of<9>(along, lane)
                    .dot(rest_[f].membrane_by_poisson_ratio(materials_[f]) * lane_of<9>(d, lane))};
        }
    });
    for (Index f = 0; f < shell_.n_faces(); ++f)
        materials_.add_vjp(f, 1, of_faces[f][0], of_faces[f][1], out);
    if (!growth_.any()) return;
    std::vector<Mat3> by_growth(shell_.n_faces());
    each_group([&](Index group) {
        SimdDouble d[9], along[9], stresses[9];
        strain(group, q, d);
        history_.apply<9>(group, d);
        rate(group, lambda, along);
        stiffness_[group].times(along, stresses);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            const GrownSix face = grown(f);
            by_growth[f] = face.in_world(
                face.membrane_by_growth(materials_[f], lane_of<9>(along, lane), lane_of<9>(d, lane)) -
                history_.factor() * face.lengths_by_growth(lane_of<9>(stresses, lane)));
        }
    });
    for (Index f = 0; f < shell_.n_faces(); ++f) growth_.add_vjp(f, by_growth[f], Mat3::Zero(), out);
}

void MembraneSixTerm::strains_vjp(const Strains& stresses, Gradient& out) const {
    if (!growth_.any()) return;
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const GrownSix face = grown(f);
        Vec9 by;
        for (int r = 0; r < 9; ++r) by[r] = -stresses.number(f, r);
        growth_.add_vjp(f, face.in_world(face.lengths_by_growth(by)), Mat3::Zero(), out);
    }
}

void MembraneSixTerm::add_forces(const Strains& stresses, Residual& out) {
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[6], g[6];
        SixNodeRows rows;
        loop_.gather(group, state_.data(), x);
        MembraneSix(x).rows(rows);
        rows.forces(stresses.at(group), g);
        loop_.scatter(group, g, out);
    });
}

// Bounds round-off as MembraneTerm does: squared derivatives carry their own round-off, and that of the
// positions.
void MembraneSixTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const Index group = f / SimdDouble::width;
        const int lane = f % SimdDouble::width;
        const double coordinate = shell_.largest_coordinate(f) + beyond;
        for (int r = 0; r < 9; ++r) {
            double stress = 0.0;
            for (int s = 0; s < 9; ++s) {
                const double squared = rest_measures_[group][s][lane];
                stress += std::abs(stiffness_[group](r, s)[lane]) *
                          (squared + 0.25 * std::sqrt(squared) * coordinate);
            }
            const double force = 2.0 * stress * std::sqrt(rest_measures_[group][r][lane]);
            for (const Index node : shell_.own_nodes[f]) out.segment<3>(3 * node).array() += force;
        }
    }
}

std::size_t MembraneSixTerm::bytes() const {
    return materials_.bytes() + growth_.bytes() + bytes_of(stiffness_) + bytes_of(rest_measures_) +
           bytes_of(rest_) + bytes_of_stresses() + bytes_of(state_) + loop_.bytes();
}

// Adds h w grad N_k . grad N_l over the integration points, with the plane-stress wave modulus w = E/(1 -
// nu^2).
bool MembraneSixTerm::add_projective_stiffness(NodeMatrix& out) const {
    constexpr auto first = six_nodes::inside_towards(2, 1.0), second = six_nodes::inside_towards(1, -1.0);
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        const ShellMaterial& m = materials_[f];
        const double modulus = m.thickness * m.young_modulus / (1.0 - m.poisson_ratio * m.poisson_ratio);
        const std::array<Index, 6>& nodes = shell_.own_nodes[f];
        for (std::size_t p = 0; p < six_nodes::inside.size(); ++p) {
            Eigen::Matrix<double, 3, 2> tangents = Eigen::Matrix<double, 3, 2>::Zero();
            Eigen::Matrix<double, 2, 6> by_place;
            for (int k = 0; k < 6; ++k) {
                by_place.col(k) << first[p][k], second[p][k];
                tangents += shell_.rest[f][k] * by_place.col(k).transpose();
            }
            const Eigen::Matrix2d metric = tangents.transpose() * tangents;
            const double factor =
                0.5 * six_nodes::inside[p].weight * std::sqrt(metric.determinant()) * modulus;
            const Eigen::Matrix<double, 6, 6> h = factor * by_place.transpose() * metric.inverse() * by_place;
            for (int k = 0; k < 6; ++k) {
                out.add_diagonal(nodes[k], h(k, k));
                for (int l = 0; l < k; ++l) out.add_pair(nodes[k], nodes[l], h(k, l));
            }
        }
    }
    return true;
}

}  // namespace magshell
