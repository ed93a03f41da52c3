#include "magshell/assembly/membrane_term.h"

namespace magshell {

MembraneTerm::MembraneTerm(const Sheet& sheet, const MembraneFaces& faces, const FaceLoop& loop)
    : sheet_(sheet),
      faces_(faces),
      loop_(loop),
      elements_(loop.packs()),
      stress_(3 * loop.packs()),
      extrapolated_(3 * loop.packs()) {
    for (Index pack = 0; pack < loop.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const std::array<Index, 3>& c = faces.corners()[loop.face(pack, lane)];
            for (int i = 0; i < 3; ++i)
                elements_[pack].rest_squared_length[i].set(
                    lane, (sheet.rest[c[(i + 2) % 3]] - sheet.rest[c[(i + 1) % 3]]).squaredNorm());
        }
}

void MembraneTerm::set_material(const std::vector<SheetMaterial>& materials) {
    materials_ = materials;
    for (Index pack = 0; pack < loop_.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const Index f = loop_.face(pack, lane);
            const std::array<Vec3, 3> corners = faces_.rest_corners(f);
            Mat3 stiffness = Mat3::Zero();
            for (const MembraneFaces::Share& share : faces_.shares(f))
                if (share.part > 0.0)
                    stiffness +=
                        share.part * RestFace(corners.data()).membrane_stiffness(materials[share.face]);
            set_lane(elements_[pack].stiffness, lane, stiffness);
        }
}

double MembraneTerm::energy(const double* q, const Controls&) const {
    return loop_.sum([&](Index pack) {
        Pack3 x[3];
        loop_.gather(pack, q, x);
        Pack strain[3], stress[3];
        Membrane(x).strain(elements_[pack], strain);
        elements_[pack].stiffness.times(strain, stress);
        return Pack(0.5) * (strain[0] * stress[0] + strain[1] * stress[1] + strain[2] * stress[2]);
    });
}

void MembraneTerm::evaluate(const double* q, const Controls&, Residual& out) {
    state_.assign(q, q + 3 * sheet_.n_nodes());
    loop_.scatter_packs([&](Index pack) {
        Pack3 x[3], g[3];
        loop_.gather(pack, q, x);
        const Membrane membrane(x);
        Pack strain[3];
        membrane.strain(elements_[pack], strain);
        history_.apply(pack, strain);
        elements_[pack].stiffness.times(strain, &stress_[3 * pack]);
        membrane.gradient(&stress_[3 * pack], g);
        loop_.scatter(pack, g, out);
    });
}

void MembraneTerm::assemble(const Part& part, const double* q, const Controls&, bool extrapolated_stress,
                            SystemMatrix& out) const {
    const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
    FaceLoop::over_packs(part, [&](Index pack) {
        Pack3 x[3];
        Pack33 h[6];
        loop_.gather(pack, q, x);
        Membrane(x).hessian(history_.scaled(elements_[pack].stiffness), &stress[3 * pack], h);
        loop_.scatter(pack, h, out);
    });
}

void MembraneTerm::extrapolate(const double* p) {
    loop_.each_pack([&](Index pack) {
        Pack3 x[3], step[3];
        loop_.gather(pack, state_.data(), x);
        loop_.gather(pack, p, step);
        Pack rate[3], change[3];
        Membrane(x).strain_rate(step, rate);
        history_.scaled(elements_[pack].stiffness).times(rate, change);
        for (int i = 0; i < 3; ++i) extrapolated_[3 * pack + i] = stress_[3 * pack + i] + change[i];
    });
}

void MembraneTerm::vjp(const double* q, const Controls&, const double* lambda, SceneGradient& out) {
    // Of each share: work, and work by the Poisson ratio. A share may be of a face in another part.
    using OfShares = std::array<Eigen::Vector2d, 2>;
    std::vector<OfShares> by_shares(sheet_.n_faces(),
                                    OfShares{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
    loop_.each_pack([&](Index pack) {
        Pack3 x[3], along[3];
        Pack strain[3], rate[3];
        loop_.gather(pack, q, x);
        loop_.gather(pack, lambda, along);
        const Membrane membrane(x);
        membrane.strain(elements_[pack], strain);
        history_.apply(pack, strain);
        membrane.strain_rate(along, rate);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            const Index f = loop_.face(pack, lane);
            const Vec3 d = lane_of(strain, lane), along = lane_of(rate, lane);
            const std::array<Vec3, 3> corners = faces_.rest_corners(f);
            for (int k = 0; k < 2; ++k) {
                const MembraneFaces::Share share = faces_.shares(f)[k];
                if (share.part == 0.0) continue;
                const RestFace rest(corners.data());
                const SheetMaterial& m = materials_[share.face];
                by_shares[f][k] =
                    share.part * Eigen::Vector2d(along.dot(rest.membrane_stiffness(m) * d),
                                                 along.dot(rest.membrane_by_poisson_ratio(m) * d));
            }
        }
    });
    for (Index f = 0; f < sheet_.n_faces(); ++f)
        for (int k = 0; k < 2; ++k) {
            const Index face = faces_.shares(f)[k].face, user = sheet_.faces.user[face];
            out.young_modulus[user] += by_shares[f][k][0] / materials_[face].young_modulus;
            out.thickness[user] += by_shares[f][k][0] / materials_[face].thickness;
            out.poisson_ratio[user] += by_shares[f][k][1];
        }
}

void MembraneTerm::strains(const double* q, Strains& out) {
    out.resize(3 * loop_.packs());
    loop_.each_pack([&](Index pack) {
        Pack3 x[3];
        loop_.gather(pack, q, x);
        Membrane(x).strain(elements_[pack], &out[3 * pack]);
    });
}

void MembraneTerm::strain_rates(const double* p, Strains& out) {
    out.resize(3 * loop_.packs());
    loop_.each_pack([&](Index pack) {
        Pack3 x[3], along[3];
        loop_.gather(pack, state_.data(), x);
        loop_.gather(pack, p, along);
        Membrane(x).strain_rate(along, &out[3 * pack]);
    });
}

void MembraneTerm::stresses(const Strains& strains, Strains& out) const {
    out.resize(strains.size());
    loop_.each_pack([&](Index pack) { elements_[pack].stiffness.times(&strains[3 * pack], &out[3 * pack]); });
}

void MembraneTerm::add_forces(const Strains& stresses, Residual& out) {
    loop_.scatter_packs([&](Index pack) {
        Pack3 x[3], g[3];
        loop_.gather(pack, state_.data(), x);
        Membrane(x).gradient(&stresses[3 * pack], g);
        loop_.scatter(pack, g, out);
    });
}

// |a|^2 carries its own round-off, and that of the positions whose difference a is: far from the origin, or
// beside long radii, the larger one.
void MembraneTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (Index f = 0; f < sheet_.n_faces(); ++f) {
        const Membrane::Element& element = elements_[f / Pack::width];
        const int lane = f % Pack::width;
        const double coordinate = sheet_.largest_coordinate(f) + beyond;
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
    return bytes_of(materials_) + bytes_of(elements_) + bytes_of(stress_) + bytes_of(extrapolated_) +
           bytes_of(state_);
}

}  // namespace magshell
