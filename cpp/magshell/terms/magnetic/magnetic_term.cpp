#include "magshell/terms/magnetic/magnetic_term.h"

#include <Eigen/LU>
#include <limits>
#include <optional>

#include "magshell/energy/magnetic.h"
#include "magshell/energy/magnetic_face_fine.h"
#include "magshell/energy/magnetic_rotating.h"
#include "magshell/energy/rotating_rest.h"
#include "magshell/mesh/half_edges.h"
#include "magshell/terms/element_energies.h"
#include "magshell/terms/magnetic/applied_field_term.h"
#include "magshell/terms/magnetic/face_sampling.h"
#include "magshell/terms/magnetic/field_groups.h"
#include "magshell/terms/magnetic/total_applied_field.h"
#include "magshell/terms/rest_shape_term.h"

namespace magshell {
namespace {

// The magnetic energy of the faces of a surface. A uniform field is not sampled. If the magnetization is linear in the positions as well,
// the force does not depend on the deformation, and the Hessian is zero.
template <class Law>
class MagneticTerm final : public AppliedFieldTerm, public ElementEnergies, public RestShapeTerm {
  public:
    MagneticTerm(const Surface& surface, Index body, const FaceLoop& loop, const FieldSources& sources,
                 Registry& registry);

    std::string_view name() const override { return Magnetic::name; }
    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override;
    Index body() const override { return body_; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override {
        return loop_.sum(energy_of_group(q, load_parameters));
    }
    std::vector<double> element_energies(const double* q,
                                         const LoadParameters& load_parameters) const override {
        return of_elements(loop_, surface_.faces.user, energy_of_group(q, load_parameters));
    }
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void prepare_assembly(const double* q, const LoadParameters& load_parameters) override;
    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters& load_parameters,
                  bool, SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    double field_sampling_error(const double* q, const LoadParameters& load_parameters,
                                double extent) override;
    void add_moments(const double* q, const LoadParameters& load_parameters, std::vector<Vec3>& points,
                     std::vector<Vec3>& moments) const override;
    std::size_t bytes() const override;

  private:
    // Finds the face across each edge of every face, if it is not known yet.
    void find_neighbours();
    // The applied field on every face in SIMD vectors.
    struct Fields {
        std::vector<FieldAtPoint>
            at_barycenter;  // empty in a uniform field; not set where a face samples finely
        std::vector<FieldOverFace> over_face;  // FaceSampling::moments

        bool vary() const { return !at_barycenter.empty(); }
    };
    // Computes the points [m] at which the faces sample the field, and the magnetizations [A/m] there.
    void find_points(const double* q, std::vector<Vec3>& points, std::vector<Vec3>& magnetizations) const;
    // Returns the applied field on all faces. Order as in AppliedField::add_samples.
    Fields sample(const double* q, const LoadParameters& load_parameters, int order) const;
    // Returns a function of a SIMD vector that computes the energies [J] of its faces.
    auto energy_of_group(const double* q, const LoadParameters& load_parameters) const {
        return [this, q, fields = sample(q, load_parameters, 0),
                everywhere = broadcast(field_.uniform(load_parameters))](Index group) {
            SimdVec3 x[3];
            loop_.gather(group, q, x);
            const SimdVec3& flux = !fields.vary()                 ? everywhere
                                   : sampling_.any_fine_in(group) ? fields.over_face[sampling_.at(group)].flux
                                                                  : fields.at_barycenter[group].flux;
            return Law(x, elements_[group]).energy(elements_[group], flux);
        };
    }
    Mat3 rest_frame(Index face) const {
        const std::array<Vec3, 3>& x = surface_.rest_corners(face);
        return Law::rest_frame(x[1] - x[0], x[2] - x[0]);
    }

    const Surface& surface_;
    const Index body_;
    const FaceLoop& loop_;
    const TotalAppliedField field_;
    ParameterSlice magnetization_, thickness_;  // values
    std::optional<ParameterSlice>
        finely_;  // value: 1 for a face that samples the field finely; only if the field can vary in space
    std::vector<double> thicknesses_;
    FaceSampling sampling_;
    LargeVector<typename Law::Element> elements_;
    // The gradient with respect to the magnetization of each face, and the applied field there, from the last vjp().
    std::vector<Vec3> by_magnetization_;
    std::vector<FluxAndRate> applied_;
    Fields fields_;  // sampled for the current assembly
    std::vector<std::array<Index, 3>>
        neighbours_;      // across the edge opposite each corner, -1 for none; see find_neighbours
    bool linear_ = true;  // every magnetization is linear in the positions
};

template <class Law>
MagneticTerm<Law>::MagneticTerm(const Surface& surface, Index body, const FaceLoop& loop,
                                const FieldSources& sources, Registry& registry)
    : surface_(surface),
      body_(body),
      loop_(loop),
      field_(sources, registry),
      magnetization_(registry.values.add(surface.owner, "remanent_magnetization", "A/m", surface.n_faces(), 3,
                                         &surface.faces)),
      thickness_(registry.values.add(surface.owner, "thickness", "m", surface.n_faces(), 1, &surface.faces)),
      sampling_(loop),
      elements_(loop.groups()) {
    if (!sources.empty())
        finely_ =
            registry.values.add(surface.owner, "field_sampling", "1", surface.n_faces(), 1, &surface.faces);
    sampling_.set(nullptr, surface.n_faces());
}

template <class Law>
bool MagneticTerm<Law>::set_values(const Values& values) {
    const bool resampled = finely_ && values.changed(*finely_);
    if (resampled) sampling_.set(values[*finely_], surface_.n_faces());
    if (!values.changed(magnetization_, thickness_)) return resampled;
    linear_ = true;
    thicknesses_.assign(values[thickness_], values[thickness_] + thickness_.size());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.face(group, lane);
            const std::array<Vec3, 3>& x = surface_.rest_corners(f);
            const Vec3 a1 = x[1] - x[0], a2 = x[2] - x[0];
            const Mat3 frame = Law::rest_frame(a1, a2);
            const Vec3 across = a1.cross(a2), m = values.vector(magnetization_, f);
            Vec3 coordinates = frame.inverse() * m;
            // A tangential magnetization keeps a normal coordinate of round-off size after the inverse: it is
            // set to zero.
            if (std::abs(coordinates[2]) <= 1e-14 * m.norm()) coordinates[2] = 0.0;
            linear_ &= Law::is_linear(coordinates);
            elements_[group].volume.set(lane, 0.5 * across.norm() * thicknesses_[f]);
            elements_[group].alpha.set(lane, coordinates[0]);
            elements_[group].beta.set(lane, coordinates[1]);
            elements_[group].gamma.set(lane, coordinates[2]);
            Law::set_rest(a1, a2, elements_[group], lane);
        }
    return true;
}

template <class Law>
void MagneticTerm<Law>::find_points(const double* q, std::vector<Vec3>& points,
                                    std::vector<Vec3>& magnetizations) const {
    points.resize(sampling_.n_points());
    magnetizations.resize(points.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        const SimdVec3 center = SimdDouble(1.0 / 3.0) * (x[0] + x[1] + x[2]);
        const Law face(x, elements_[group]);
        const SimdVec3 m = face.magnetization(elements_[group]);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            Index n = sampling_.first(f);
            if (!sampling_.is_fine(f)) {
                points[n] = lane_of(center, lane);
                magnetizations[n] = lane_of(m, lane);
                continue;
            }
            const Vec3 corners[3] = {lane_of(x[0], lane), lane_of(x[1], lane), lane_of(x[2], lane)},
                       across = thicknesses_[f] * lane_of(face.normal, lane);
            for (const FacePoint& point : sampling_.points(f)) {
                points[n] = position_of(point, corners, across);
                magnetizations[n++] = lane_of(m, lane);
            }
        }
    });
}

template <class Law>
auto MagneticTerm<Law>::sample(const double* q, const LoadParameters& load_parameters, int order) const
    -> Fields {
    if (!field_.varies(load_parameters)) return {};
    std::vector<Vec3> points, moments;
    find_points(q, points, moments);
    const FieldSamples samples = field_.sample(points, moments, order, load_parameters);
    const Vec3 everywhere = field_.uniform(load_parameters);
    Fields fields;
    fields.at_barycenter.resize(loop_.groups());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width && !sampling_.any_fine_in(group); ++lane)
            set_field(fields.at_barycenter[group], lane, samples, sampling_.first(loop_.face(group, lane)),
                      order, everywhere);
    if (sampling_.any_fine()) fields.over_face = sampling_.moments(samples, order, everywhere, thicknesses_);
    return fields;
}

template <class Law>
void MagneticTerm<Law>::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const Fields fields = sample(q, load_parameters, 1);
    const bool varies = fields.vary();
    const SimdVec3 everywhere = broadcast(field_.uniform(load_parameters));
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[3], g[3];
        loop_.gather(group, q, x);
        const Law face(x, elements_[group]);
        if (varies && sampling_.any_fine_in(group)) {
            magnetic_face_fine::gradient(face, elements_[group], fields.over_face[sampling_.at(group)], g);
        } else {
            face.gradient(elements_[group], varies ? fields.at_barycenter[group].flux : everywhere, g);
            if (varies) {
                const SimdVec3 pull =
                    face.gradient_by_position(elements_[group], fields.at_barycenter[group]);
                for (SimdVec3& at_node : g) at_node += pull;
            }
        }
        loop_.scatter(group, g, out);
    });
}

template <class Law>
void MagneticTerm<Law>::prepare_assembly(const double* q, const LoadParameters& load_parameters) {
    fields_ = sample(q, load_parameters, 2);
}

template <class Law>
void MagneticTerm<Law>::assemble(const ElementBlock& element_block, const double* q,
                                 const LoadParameters& load_parameters, bool, SystemMatrix& out) const {
    const bool varies = fields_.vary();
    const Vec3 uniform = field_.uniform(load_parameters);
    if (!varies && (linear_ || uniform.isZero(0.0))) return;
    const SimdVec3 everywhere = broadcast(uniform);
    FaceLoop::over_groups(element_block, [&](Index group) {
        SimdVec3 x[3];
        SimdMat3 h[6];
        loop_.gather(group, q, x);
        const Law face(x, elements_[group]);
        if (varies && sampling_.any_fine_in(group)) {
            magnetic_face_fine::hessian(face, elements_[group], fields_.over_face[sampling_.at(group)], h);
        } else {
            face.hessian(elements_[group], varies ? fields_.at_barycenter[group].flux : everywhere, h);
            if (varies) face.add_hessian_by_position(elements_[group], fields_.at_barycenter[group], h);
        }
        loop_.scatter(group, h, out);
    });
}

// The rate of the energy along lambda, with M' and v_p the rates of M and of the points x_p and G_p = dB/dx there,
//
//   D = - A~ h sum_p w_p (M' . B_p + M . G_p v_p),   M' = alpha f_1' + beta f_2' + gamma n',
//
// is linear in (alpha, beta, gamma) and in the field. Its derivative with respect to the thickness h, on which the points x_p = ... + z_p h
// n depend, is with C_p = d2(M . B_p)/dx2
//
//   dD/dh = D/h - A~ h sum_p w_p z_p (M' . G_p n + n . C_p v_p + M . G_p n').
template <class Law>
void MagneticTerm<Law>::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                            Gradient& out) {
    const double factor = field_.factor(load_parameters);
    const Vec3 everywhere = field_.uniform(load_parameters);
    std::vector<Vec3> points, magnetizations;
    find_points(q, points, magnetizations);
    const FieldSamples samples = field_.at_factor_one(points, magnetizations, sampling_.any_fine() ? 2 : 1);

    FieldProbe probe;  // - A~ h w_p (M', M, v_p)
    probe.flux.resize(points.size()), probe.moment.resize(points.size()),
        probe.direction.resize(points.size());
    by_magnetization_.resize(surface_.n_faces());
    applied_.resize(surface_.n_faces());
    loop_.each_group([&](Index group) {
        SimdVec3 x[3], rate[3];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, rate);
        const Law face(x, elements_[group]);
        SimdVec3 columns[3], column_rates[3];
        face.frame(columns);
        face.frame_rate(rate, column_rates);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const typename Law::Element& e = elements_[group];
            const Vec3 coordinates(e.alpha[lane], e.beta[lane], e.gamma[lane]),
                at[3] = {lane_of(rate[0], lane), lane_of(rate[1], lane), lane_of(rate[2], lane)};
            Mat3 frame, frame_rate;
            frame << lane_of(columns[0], lane), lane_of(columns[1], lane), lane_of(columns[2], lane);
            frame_rate << lane_of(column_rates[0], lane), lane_of(column_rates[1], lane),
                lane_of(column_rates[2], lane);
            const Vec3 m_rate = frame_rate * coordinates;
            const double volume = e.volume[lane], h = thicknesses_[f];
            Vec3 flux = everywhere, flux_rate = Vec3::Zero();
            Index n = sampling_.first(f);
            for (const FacePoint& point : sampling_.points(f)) {
                const Vec3 v = sampling_.is_fine(f)
                                   ? Vec3(point.at[0] * at[0] + point.at[1] * at[1] + point.at[2] * at[2] +
                                          (point.height * h) * frame_rate.col(2))
                                   : Vec3((at[0] + at[1] + at[2]) / 3.0);
                flux += (factor * point.weight) * samples.flux[n];
                flux_rate += (factor * point.weight) * (samples.gradient[n] * v);
                if (point.height != 0.0)
                    out.values[thickness_.at(f)] -=
                        volume * factor * point.weight * point.height *
                        (m_rate.dot(samples.gradient[n] * frame.col(2)) +
                         frame.col(2).dot(samples.curvature[n] * v) +
                         magnetizations[n].dot(samples.gradient[n] * frame_rate.col(2)));
                probe.flux[n] = (-volume * point.weight) * (frame_rate * coordinates);
                probe.moment[n] = -volume * point.weight * magnetizations[n];
                probe.direction[n++] = v;
            }
            const Vec3 by_coordinates =
                -volume * (frame_rate.transpose() * flux + frame.transpose() * flux_rate);
            applied_[f] = {flux, flux_rate};
            by_magnetization_[f] = rest_frame(f).transpose().inverse() * by_coordinates;
            out.values.segment<3>(magnetization_.at(f)) += by_magnetization_[f];
            out.values[thickness_.at(f)] += by_coordinates.dot(coordinates) / h;
        }
    });
    field_.add_vjp(points, probe, samples, load_parameters, out);
}

template <class Law>
void MagneticTerm<Law>::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda,
                                     VectorXd& out) {
    std::vector<std::array<Vec3, 2>> by_edges(surface_.n_faces());
    loop_.each_group([&](Index group) {
        SimdVec3 x[3], rate[3], columns[3];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, rate);
        const typename Law::Element& e = elements_[group];
        Law(x, e).frame(columns);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const RestShape rest(surface_.rest_corners(f));
            const Vec3 coordinates(e.alpha[lane], e.beta[lane], e.gamma[lane]);
            if constexpr (std::is_same_v<Law, Magnetic>) {
                by_edges[f] = magnetic_by_rest_edges(rest, coordinates, by_magnetization_[f]);
            } else {
                Mat3 frame;
                frame << lane_of(columns[0], lane), lane_of(columns[1], lane), lane_of(columns[2], lane);
                const Mat3 at_rest = rest_frame(f);
                const MovingFace face = {{lane_of(x[1] - x[0], lane), lane_of(x[2] - x[0], lane)},
                                         {lane_of(rate[1] - rate[0], lane), lane_of(rate[2] - rate[0], lane)},
                                         frame * at_rest.transpose()};
                by_edges[f] =
                    rotating_by_rest_edges(rest, face, at_rest * coordinates, e.volume[lane], applied_[f]);
            }
        }
    });
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const std::array<Index, 3>& nodes = surface_.corners[f];
        for (int k = 0; k < 2; ++k) {
            out.segment<3>(3 * nodes[k + 1]) += by_edges[f][k];
            out.segment<3>(3 * nodes[0]) -= by_edges[f][k];
        }
    }
}

template <class Law>
void MagneticTerm<Law>::find_neighbours() {
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
// Across an edge of the border it is taken as the mean of the others. Through the thickness h the force changes too: div F'' = 0 in
// free space, so its second derivative along the normal is minus the sum of those in the plane. With S = s I that sum is F'' : S / s;
// together
//
//   1/2 F'' : S (1 - h^2 / 12 s),   s = tr S / 2.
//
// The error of faces that sample the field finely cannot be estimated from their samples.
template <class Law>
double MagneticTerm<Law>::field_sampling_error(const double* q, const LoadParameters& load_parameters,
                                               double extent) {
    constexpr double cancelling = 0.1;  // [-] of the sum of the forces, as in field_sampling.py
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    if (!field_.varies(load_parameters)) return 0.0;
    if (sampling_.any_fine()) return unknown;
    if (!fields_.vary()) return unknown;
    find_neighbours();
    const Index n = surface_.n_faces();
    struct Sample {
        Vec3 point, moment, force;
        Mat3 gradient;
        double couple;  // [N m] its size
    };
    std::vector<Sample> samples(n);  // several threads fill them: sums are formed below
    std::vector<Mat3> rates(n);      // F' [N/m]
    loop_.each_group([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        const SimdVec3 center = SimdDouble(1.0 / 3.0) * (x[0] + x[1] + x[2]);
        const typename Law::Element& e = elements_[group];
        const SimdVec3 moment = e.volume * Law(x, e).magnetization(e);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            Sample& here = samples[f];
            here.point = lane_of(center, lane);
            here.moment = lane_of(moment, lane);
            for (int k = 0; k < 9; ++k) {
                here.gradient(k / 3, k % 3) = fields_.at_barycenter[group].gradient.at[k][lane];
                rates[f](k / 3, k % 3) = e.volume[lane] * fields_.at_barycenter[group].curvature.at[k][lane];
            }
            here.force = here.gradient.transpose() * here.moment;
            here.couple = here.moment.cross(lane_of(fields_.at_barycenter[group].flux, lane)).norm();
        }
    });
    Vec3 force = Vec3::Zero(), error = Vec3::Zero();
    double forces = 0.0, couples = 0.0;
    for (Index f = 0; f < n; ++f) {
        const Sample& here = samples[f];
        force += here.force;
        forces += here.force.norm();
        couples += here.couple;
        if (here.moment.isZero(0.0)) continue;
        Vec3 sum = Vec3::Zero();
        double spread = 0.0;  // s [m2]
        int count = 0;
        for (int i = 0; i < 3; ++i) {
            const Vec3 corner = Eigen::Map<const Vec3>(q + 3 * surface_.corners[f][i]) - here.point;
            spread += corner.squaredNorm() / 24.0;
            if (neighbours_[f][i] < 0) continue;
            const Sample& there = samples[neighbours_[f][i]];
            const Vec3 step = there.point - here.point;
            const Vec3 beyond = (there.gradient - here.gradient).transpose() * here.moment - rates[f] * step;
            sum += (corner.squaredNorm() / step.squaredNorm()) * beyond;
            ++count;
        }
        if (count == 0) return unknown;
        error += sum * (3.0 / (12.0 * count) * (1.0 - thicknesses_[f] * thicknesses_[f] / (12.0 * spread)));
    }
    const double total = std::max({(force + error).norm(), cancelling * forces, couples / extent});
    if (!(total > 0.0)) return total == 0.0 ? 0.0 : unknown;
    return error.norm() / total;
}

template <class Law>
void MagneticTerm<Law>::add_moments(const double* q, const LoadParameters&, std::vector<Vec3>& points,
                                    std::vector<Vec3>& moments) const {
    std::vector<Vec3> at, magnetizations;
    find_points(q, at, magnetizations);
    points.insert(points.end(), at.begin(), at.end());
    std::vector<double> volumes(surface_.n_faces());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
            volumes[loop_.face(group, lane)] = elements_[group].volume[lane];
    sampling_.add_moments(volumes, magnetizations, moments);
}

template <class Law>
std::size_t MagneticTerm<Law>::bytes() const {
    return bytes_of(elements_) + bytes_of(thicknesses_) + bytes_of(fields_.at_barycenter) +
           bytes_of(fields_.over_face) + bytes_of(neighbours_) + sampling_.bytes();
}

}  // namespace

std::unique_ptr<Term> make_magnetic_term(MagnetizationLaw law, const Surface& surface, Index body,
                                         const FaceLoop& loop, const FieldSources& sources,
                                         Registry& registry) {
    if (law == MagnetizationLaw::rotates)
        return std::make_unique<MagneticTerm<RotatingMagnetic>>(surface, body, loop, sources, registry);
    return std::make_unique<MagneticTerm<Magnetic>>(surface, body, loop, sources, registry);
}

}  // namespace magshell
