#include "magshell/terms/shell/membrane_term.h"

#include "magshell/energy/rest_corners.h"

namespace magshell {

MembraneTerm::MembraneTerm(const Surface& surface, Index body, const MembraneFaces& faces,
                           const FaceLoop& loop, const GrowthForm& growth, const Nodes& nodes,
                           Registry& registry)
    : StrainScaffold(surface.n_faces()),
      surface_(surface),
      body_(body),
      faces_(faces),
      loop_(loop),
      nodes_(nodes.n_nodes()),
      materials_(surface, registry),
      growth_(surface.owner, surface.faces, growth, registry),
      elements_(loop.groups()) {
    for (Index group = 0; group < loop.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const std::array<Vec3, 3> x = faces.rest_corners(loop.face(group, lane));
            for (int i = 0; i < 3; ++i)
                elements_[group].rest_squared_length[i].set(lane,
                                                            (x[(i + 2) % 3] - x[(i + 1) % 3]).squaredNorm());
        }
}

// Returns the mean growth of the faces that a triangle consists of.
Mat3 MembraneTerm::mean_growth(Index face) const {
    Mat3 growth = Mat3::Zero();
    for (const MembraneFaces::FacePart& share : faces_.parts(face))
        growth += share.part * growth_.growth(share.face);
    return growth;
}

GrownFace MembraneTerm::grown(Index face) const {
    return {faces_.rest_corners(face), mean_growth(face), Mat3::Zero()};
}

// Returns the triangle in its natural configuration, which is the reference configuration if nothing grows.
RestFace MembraneTerm::rest_face(Index face) const {
    if (growth_.any()) return grown(face).face();
    const std::array<Vec3, 3> corners = faces_.rest_corners(face);
    return RestFace(corners.data());
}

bool MembraneTerm::set_values(const Values& values) {
    const bool material_changed = materials_.set_values(values), grew = growth_.set_values(values);
    if (!material_changed && !grew) return false;
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.face(group, lane);
            const RestFace rest = rest_face(f);
            Mat3 stiffness = Mat3::Zero();
            for (const MembraneFaces::FacePart& share : faces_.parts(f))
                if (share.part > 0.0)
                    stiffness += share.part * rest.membrane_stiffness(materials_[share.face]);
            set_lane(elements_[group].stiffness, lane, stiffness);
            if (!grew) continue;
            for (int i = 0; i < 3; ++i)
                elements_[group].rest_squared_length[i].set(lane, rest.edge_length[i] * rest.edge_length[i]);
        }
    return true;
}

// Adds the blocks A h w g_k . g_l of the constant matrix of Projective Dynamics: A is the area, h the thickness, w = E/(1 - nu^2) the
// plane-stress modulus of uniaxial strain, and g_k the gradient of the shape function of node k. With e_k the edge opposite node k,
// g_k . g_l = e_k . e_l / (4 A^2).
bool MembraneTerm::add_projective_stiffness(NodeMatrix& out) const {
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        double modulus = 0.0;
        for (const MembraneFaces::FacePart& share : faces_.parts(f)) {
            const ShellMaterial& material = materials_[share.face];
            modulus += share.part * material.thickness * material.young_modulus /
                       (1.0 - material.poisson_ratio * material.poisson_ratio);
        }
        const std::array<Vec3, 3> x = faces_.rest_corners(f);
        const std::array<Vec3, 3> edge{x[2] - x[1], x[0] - x[2], x[1] - x[0]};
        const double factor = modulus / (2.0 * edge[0].cross(edge[1]).norm());
        const std::array<Index, 3>& nodes = faces_.corners()[f];
        for (int k = 0; k < 3; ++k) {
            out.add_diagonal(nodes[k], factor * edge[k].squaredNorm());
            for (int l = 0; l < k; ++l) out.add_pair(nodes[k], nodes[l], factor * edge[k].dot(edge[l]));
        }
    }
    return true;
}

double MembraneTerm::energy(const double* q, const LoadParameters&) const {
    return loop_.sum([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        SimdDouble strain[3], stress[3];
        Membrane(x).strain(elements_[group], strain);
        elements_[group].stiffness.times(strain, stress);
        return SimdDouble(0.5) * (strain[0] * stress[0] + strain[1] * stress[1] + strain[2] * stress[2]);
    });
}

void MembraneTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    state_.assign(q, q + 3 * nodes_);
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[3], g[3];
        loop_.gather(group, q, x);
        const Membrane membrane(x);
        SimdDouble strain[3];
        membrane.strain(elements_[group], strain);
        store_stress(group, strain);
        membrane.gradient(stress_.at(group), g);
        loop_.scatter(group, g, out);
    });
}

void MembraneTerm::assemble(const ElementBlock& element_block, const double* q, const LoadParameters&,
                            bool extrapolated_stress, SystemMatrix& out) const {
    const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
    FaceLoop::over_groups(element_block, [&](Index group) {
        SimdVec3 x[3];
        SimdMat3 h[6];
        loop_.gather(group, q, x);
        Membrane(x).hessian(history_.scaled(elements_[group].stiffness), stress.at(group), h);
        loop_.scatter(group, h, out);
    });
}

void MembraneTerm::strain(Index group, const double* q, SimdDouble d[3]) const {
    SimdVec3 x[3];
    loop_.gather(group, q, x);
    Membrane(x).strain(elements_[group], d);
}

void MembraneTerm::rate(Index group, const double* p, SimdDouble d[3]) const {
    SimdVec3 x[3], along[3];
    loop_.gather(group, state_.data(), x);
    loop_.gather(group, p, along);
    Membrane(x).strain_rate(along, d);
}

void MembraneTerm::vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) {
    // For both parts of each triangle: lambda . g, and its derivative with respect to the Poisson ratio. They are stored first and added
    // below, outside the parallel loop, because a part may belong to a face that another thread processes.
    using OfShares = std::array<Eigen::Vector2d, 2>;
    std::vector<OfShares> by_shares(surface_.n_faces(),
                                    OfShares{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
    loop_.each_group([&](Index group) {
        SimdDouble strains[3], rates[3];
        strain(group, q, strains);
        history_.apply(group, strains);
        rate(group, lambda, rates);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const Vec3 d = lane_of(strains, lane), along = lane_of(rates, lane);
            const RestFace rest = rest_face(f);
            for (int k = 0; k < 2; ++k) {
                const MembraneFaces::FacePart share = faces_.parts(f)[k];
                if (share.part == 0.0) continue;
                const ShellMaterial& m = materials_[share.face];
                by_shares[f][k] =
                    share.part * Eigen::Vector2d(along.dot(rest.membrane_stiffness(m) * d),
                                                 along.dot(rest.membrane_by_poisson_ratio(m) * d));
            }
        }
    });
    for (Index f = 0; f < surface_.n_faces(); ++f)
        for (int k = 0; k < 2; ++k)
            materials_.add_vjp(faces_.parts(f)[k].face, 1, by_shares[f][k][0], by_shares[f][k][1], out);
    if (!growth_.any()) return;
    add_growth_vjp(by_shape(q, lambda), out);
}

// The reference lengths change in the strains, and the stiffness.
std::vector<MembraneTerm::ByFace> MembraneTerm::by_shape(const double* q, const double* lambda) const {
    std::vector<ByFace> by_faces(surface_.n_faces());
    each_group([&](Index group) {
        SimdDouble strains[3], rates[3], stresses[3];
        strain(group, q, strains);
        history_.apply(group, strains);
        rate(group, lambda, rates);
        elements_[group].stiffness.times(rates, stresses);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const GrownFace own = grown(f);
            const Vec3 d = lane_of(strains, lane), along = lane_of(rates, lane),
                       by_lengths = -history_.factor() * lane_of(stresses, lane);
            const auto by_growth_of = [&](const GrownTriangle& triangle) -> Mat2 {
                Mat2 by = triangle.lengths_by_growth(by_lengths);
                for (const MembraneFaces::FacePart& share : faces_.parts(f))
                    if (share.part > 0.0)
                        by += share.part * triangle.membrane_by_growth(materials_[share.face], along, d);
                return by;
            };
            by_faces[f] = by_face(own, by_growth_of);
        }
    });
    return by_faces;
}

std::vector<MembraneTerm::ByFace> MembraneTerm::strains_by_shape(const Strains& stresses) const {
    std::vector<ByFace> by_faces(surface_.n_faces());
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const Vec3 by(-stresses.number(f, 0), -stresses.number(f, 1), -stresses.number(f, 2));
        by_faces[f] =
            by_face(grown(f), [&](const GrownTriangle& triangle) { return triangle.lengths_by_growth(by); });
    }
    return by_faces;
}

// Without growth both derivatives are the same.
template <class ByGrowth>
MembraneTerm::ByFace MembraneTerm::by_face(const GrownFace& own, const ByGrowth& by_growth_of) const {
    const GrownTriangle& triangle = own.triangle();
    const Mat3 by_growth = own.in_world(by_growth_of(triangle));
    if (!growth_.any()) return {by_growth, by_growth};
    return {own.in_world(triangle.from_natural(by_growth_of(triangle.natural()))), by_growth};
}

void MembraneTerm::strains_vjp(const Strains& stresses, Gradient& out) const {
    if (growth_.any()) add_growth_vjp(strains_by_shape(stresses), out);
}

void MembraneTerm::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) {
    std::vector<double> by_first(surface_.n_faces(), 0.0);
    if (!faces_.is_unchanged()) by_first = by_first_part(q, lambda);
    add_by_shape(by_shape(q, lambda), std::move(by_first), out);
}

void MembraneTerm::add_rest_strains_vjp(const Strains& stresses, VectorXd& out) const {
    add_by_shape(strains_by_shape(stresses), std::vector<double>(surface_.n_faces(), 0.0), out);
}

// by_first: the derivative with respect to the first part of each triangle, but for that through the mean growth.
void MembraneTerm::add_by_shape(const std::vector<ByFace>& by_faces, std::vector<double> by_first,
                                VectorXd& out) const {
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const RestShape shape(faces_.rest_corners(f));
        add_by_rest_corners(shape, by_faces[f].deformation, faces_.corners()[f], out);
        if (!growth_.any()) continue;
        add_by_rest_plane(shape, by_faces[f].growth, mean_growth(f), faces_.corners()[f], out);
        const std::array<MembraneFaces::FacePart, 2> parts = faces_.parts(f);
        if (parts[1].part > 0.0)
            by_first[f] +=
                by_faces[f]
                    .growth.cwiseProduct(growth_.growth(parts[0].face) - growth_.growth(parts[1].face))
                    .sum();
    }
    if (!faces_.is_unchanged()) add_parts_vjp(by_first, out);
}

std::vector<double> MembraneTerm::by_first_part(const double* q, const double* lambda) const {
    std::vector<double> by_first(surface_.n_faces(), 0.0);
    each_group([&](Index group) {
        SimdDouble strains[3], rates[3];
        strain(group, q, strains);
        history_.apply(group, strains);
        rate(group, lambda, rates);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const std::array<MembraneFaces::FacePart, 2> parts = faces_.parts(f);
            if (parts[1].part == 0.0) continue;
            const Mat3 difference = rest_face(f).membrane_stiffness(materials_[parts[0].face]) -
                                    rest_face(f).membrane_stiffness(materials_[parts[1].face]);
            by_first[f] = lane_of(rates, lane).dot(difference * lane_of(strains, lane));
        }
    });
    return by_first;
}

// The first part of a triangle is A_1 / (A_1 + A_2), with the areas at rest of the two faces of the shell.
void MembraneTerm::add_parts_vjp(const std::vector<double>& by_first, VectorXd& out) const {
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const std::array<MembraneFaces::FacePart, 2> parts = faces_.parts(f);
        if (parts[1].part == 0.0) continue;
        const RestShape shapes[2] = {RestShape(surface_.rest_corners(parts[0].face)),
                                     RestShape(surface_.rest_corners(parts[1].face))};
        const double by_area = by_first[f] / (shapes[0].area + shapes[1].area);
        for (int side = 0; side < 2; ++side) {
            const double by = side == 0 ? by_area * parts[1].part : -by_area * parts[0].part;
            for (int k = 0; k < 3; ++k)
                out.segment<3>(3 * surface_.corners[parts[side].face][k]) +=
                    by * shapes[side].area_by_corner(k);
        }
    }
}

void MembraneTerm::add_growth_vjp(const std::vector<ByFace>& by_faces, Gradient& out) const {
    for (Index f = 0; f < surface_.n_faces(); ++f)
        for (const MembraneFaces::FacePart& share : faces_.parts(f))
            if (share.part > 0.0)
                growth_.add_vjp(share.face, share.part * by_faces[f].growth, Mat3::Zero(), out);
}

void MembraneTerm::add_forces(const Strains& stresses, Residual& out) {
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[3], g[3];
        loop_.gather(group, state_.data(), x);
        Membrane(x).gradient(stresses.at(group), g);
        loop_.scatter(group, g, out);
    });
}

// Adds a bound of the forces that cancel in the strains |a|^2 - |a~|^2. |a|^2 has two round-off errors: that of the square, proportional to
// |a|^2, and that of the positions whose difference is a, proportional to |a| times their coordinates. The second one is larger
// far from the origin and in slender faces.
void MembraneTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const Membrane::Element& element = elements_[f / SimdDouble::width];
        const int lane = f % SimdDouble::width;
        const double coordinate = surface_.largest_coordinate(f) + beyond;
        for (int i = 0; i < 3; ++i) {
            double stress = 0.0;
            for (int j = 0; j < 3; ++j) {
                const double squared_length = element.rest_squared_length[j][lane];
                stress += std::abs(element.stiffness(i, j)[lane]) *
                          (squared_length + 0.25 * std::sqrt(squared_length) * coordinate);
            }
            const double force = 2.0 * stress * std::sqrt(element.rest_squared_length[i][lane]);
            for (const int k : {(i + 1) % 3, (i + 2) % 3})
                out.segment<3>(3 * faces_.corners()[f][k]).array() += force;
        }
    }
}

std::size_t MembraneTerm::bytes() const {
    return materials_.bytes() + growth_.bytes() + bytes_of(elements_) + bytes_of_stresses() +
           bytes_of(state_);
}

}  // namespace magshell
