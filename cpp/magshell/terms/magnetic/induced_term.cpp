#include "magshell/terms/magnetic/induced_term.h"

#include <limits>
#include <optional>

#include "magshell/energy/induced_face.h"
#include "magshell/energy/rest_corners.h"
#include "magshell/field/dipoles.h"
#include "magshell/terms/magnetic/applied_field_term.h"
#include "magshell/terms/magnetic/face_sampling.h"
#include "magshell/terms/magnetic/field_groups.h"
#include "magshell/terms/magnetic/total_applied_field.h"
#include "magshell/terms/rest_shape_term.h"

namespace magshell {
namespace {

// The energy of faces that the applied field magnetizes, -1/2 M . B for each volume, with the magnetization of a thin
// plate, M = along B - across (n . B) n. The faces do not magnetize each other.
class InducedTerm final : public AppliedFieldTerm, public RestShapeTerm {
  public:
    InducedTerm(const Surface& surface, Index body, const FaceLoop& loop, const FieldSources& sources,
                Registry& registry);

    std::string_view name() const override { return InducedFace::name; }
    Index body() const override { return body_; }
    bool is_quadratic_in_loads() const override { return true; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void prepare_assembly(const double* q, const LoadParameters& load_parameters) override;
    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters& load_parameters,
                  bool, SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void add_rest_vjp(const double*, const LoadParameters&, const double*, VectorXd& out) override;
    // Returns NaN where the field varies, as the error of the samples is not estimated; a uniform field has none.
    double field_sampling_error(const double*, const LoadParameters& load_parameters, double) override {
        return field_.varies(load_parameters) ? std::numeric_limits<double>::quiet_NaN() : 0.0;
    }
    void add_moments(const double* q, const LoadParameters& load_parameters, std::vector<Vec3>& points,
                     std::vector<Vec3>& moments) const override;
    std::size_t bytes() const override;

  private:
    // The applied field: its uniform part, and samples at the sampling points of all faces where it varies in space.
    struct Field {
        bool varies = false;
        Vec3 uniform;
        FieldSamples samples;
    };

    std::vector<Vec3> points(const double* q) const;
    // Returns the magnetization [A/m] at each sampling point, in the field uniform + factor * samples.flux.
    std::vector<Vec3> magnetizations(const double* q, const Vec3& uniform, double factor,
                                     const FieldSamples& samples) const;
    // Samples the field and its derivatives up to the order, 0 to 2; the second one is multiplied by the magnetization.
    Field sample(const double* q, const LoadParameters& load_parameters, int order) const;
    // Calls body(point) for each sampling point of the faces of a group, all lanes at once. A lane whose face has fewer
    // points than another repeats its first one with weight zero.
    template <class Body>
    void each_point(Index group, const Field& field, int order, const Body& body) const;

    const Surface& surface_;
    const Index body_;
    const FaceLoop& loop_;
    const TotalAppliedField field_;
    ParameterSlice susceptibility_, thickness_;  // values
    std::optional<ParameterSlice>
        sampled_finely_;  // value: 1 for faces with several sampling points; absent if no source varies in space
    std::vector<double> susceptibilities_, thicknesses_;
    FaceSampling sampling_;
    LargeVector<InducedFace::Element> elements_;
    std::vector<double> powers_;  // lambda . g of each face, from the last vjp()
    Field field_at_assembly_;
};

InducedTerm::InducedTerm(const Surface& surface, Index body, const FaceLoop& loop,
                         const FieldSources& sources, Registry& registry)
    : surface_(surface),
      body_(body),
      loop_(loop),
      field_(sources, registry),
      susceptibility_(
          registry.values.add(surface.owner, "susceptibility", "1", surface.n_faces(), 1, &surface.faces)),
      thickness_(registry.values.add(surface.owner, "thickness", "m", surface.n_faces(), 1, &surface.faces)),
      sampling_(loop),
      elements_(loop.groups()) {
    if (!sources.empty())
        sampled_finely_ =
            registry.values.add(surface.owner, "field_sampling", "1", surface.n_faces(), 1, &surface.faces);
    sampling_.set(nullptr, surface.n_faces());
}

bool InducedTerm::set_values(const Values& values) {
    const bool resampled = sampled_finely_ && values.changed(*sampled_finely_);
    if (resampled) sampling_.set(values[*sampled_finely_], surface_.n_faces());
    if (!values.changed(susceptibility_, thickness_)) return resampled;
    susceptibilities_.assign(values[susceptibility_], values[susceptibility_] + susceptibility_.size());
    thicknesses_.assign(values[thickness_], values[thickness_] + thickness_.size());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.face(group, lane);
            const std::array<Vec3, 3>& x = surface_.rest_corners(f);
            const double area = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).norm(), chi = susceptibilities_[f];
            InducedFace::Element& e = elements_[group];
            e.volume.set(lane, area * thicknesses_[f]);
            e.along.set(lane, chi / vacuum_permeability);
            e.across.set(lane, chi * chi / ((1.0 + chi) * vacuum_permeability));
        }
    return true;
}

std::vector<Vec3> InducedTerm::points(const double* q) const {
    std::vector<Vec3> points(sampling_.n_points());
    loop_.each_group([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        const InducedFace face(x);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const Vec3 corners[3] = {lane_of(x[0], lane), lane_of(x[1], lane), lane_of(x[2], lane)};
            const Vec3 height = thicknesses_[f] * lane_of(face.normal, lane);
            Index n = sampling_.first(f);
            for (const FacePoint& point : sampling_.points(f))
                points[n++] = position_of(point, corners, height);
        }
    });
    return points;
}

std::vector<Vec3> InducedTerm::magnetizations(const double* q, const Vec3& uniform, double factor,
                                              const FieldSamples& samples) const {
    std::vector<Vec3> found(samples.flux.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        const InducedFace face(x);
        const InducedFace::Element& e = elements_[group];
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const Vec3 normal = lane_of(face.normal, lane);
            const Index first = sampling_.first(f);
            for (std::size_t k = 0; k < sampling_.points(f).size(); ++k) {
                const Vec3 b = uniform + factor * samples.flux[first + k];
                found[first + k] = e.along[lane] * b - (e.across[lane] * b.dot(normal)) * normal;
            }
        }
    });
    return found;
}

auto InducedTerm::sample(const double* q, const LoadParameters& load_parameters, int order) const -> Field {
    Field field{field_.varies(load_parameters), field_.uniform(load_parameters), {}};
    if (!field.varies) return field;
    const std::vector<Vec3> at = points(q);
    std::vector<Vec3> moments(at.size());
    if (order == 2)
        moments = magnetizations(q, field.uniform, 1.0, field_.sample(at, moments, 0, load_parameters));
    field.samples = field_.sample(at, moments, order, load_parameters);
    return field;
}

template <class Body>
void InducedTerm::each_point(Index group, const Field& field, int order, const Body& body) const {
    InducedFace::Point at{};
    if (!field.varies) {
        at.weight = SimdDouble(1.0);
        at.field.flux = broadcast(field.uniform);
        body(at);
        return;
    }
    const std::size_t count = sampling_.any_fine_in(group) ? face_points::fine.size() : 1;
    for (std::size_t k = 0; k < count; ++k) {
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.face(group, lane);
            const std::span<const FacePoint> points = sampling_.points(f);
            const std::size_t own = k < points.size() ? k : 0;
            const FacePoint& point = points[own];
            at.weight.set(lane, own == k ? point.weight : 0.0);
            for (int a = 0; a < 3; ++a) at.share[a].set(lane, point.at[a]);
            at.share[3].set(lane, point.height * thicknesses_[f]);
            set_field(at.field, lane, field.samples, sampling_.first(f) + static_cast<Index>(own), order,
                      field.uniform);
        }
        body(at);
    }
}

double InducedTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    const Field field = sample(q, load_parameters, 0);
    return loop_.sum([&](Index group) {
        SimdVec3 x[3];
        loop_.gather(group, q, x);
        const InducedFace face(x);
        SimdDouble total(0.0);
        each_point(group, field, 0, [&](const InducedFace::Point& at) {
            total += at.weight * face.energy(elements_[group], at.field.flux);
        });
        return total;
    });
}

void InducedTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const Field field = sample(q, load_parameters, 1);
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[3], g[3];
        loop_.gather(group, q, x);
        const InducedFace face(x);
        InducedFace::Gradient by{};
        each_point(group, field, 1,
                   [&](const InducedFace::Point& at) { face.add(elements_[group], at, field.varies, by); });
        face.by_nodes(by, g);
        loop_.scatter(group, g, out);
    });
}

void InducedTerm::prepare_assembly(const double* q, const LoadParameters& load_parameters) {
    field_at_assembly_ = sample(q, load_parameters, 2);
}

void InducedTerm::assemble(const ElementBlock& element_block, const double* q, const LoadParameters&, bool,
                           SystemMatrix& out) const {
    if (!field_at_assembly_.varies && field_at_assembly_.uniform.isZero(0.0)) return;
    FaceLoop::over_groups(element_block, [&](Index group) {
        SimdVec3 x[3];
        SimdMat3 h[6];
        loop_.gather(group, q, x);
        const InducedFace face(x);
        InducedFace::Hessian by{};
        each_point(group, field_at_assembly_, 2, [&](const InducedFace::Point& at) {
            face.add(elements_[group], at, field_at_assembly_.varies, by);
        });
        face.by_nodes(by, h);
        loop_.scatter(group, h, out);
    });
}

// lambda gives the sampling points the rates v_p and the normal the rate n'. The rate of the energy along lambda is
//
//   D = sum_p A~ h w_p d_p,    d_p = - M . G v_p + c (n . B) (n' . B),
//
// with the rest area A~, the thickness h, the weight w_p of a point, the gradient G of B, M = P B and c = across.
// With C the second gradient of M . B at constant M, the derivatives of D are A~ h w_p times
//
//   by B:     - P G v_p + c ((n' . B) n + (n . B) n')        by G: the outer product of - M and v_p
//   by chi:   - dM/dchi . G v_p + dc/dchi (n . B) (n' . B)
//   by h:     d_p / h + z_p (- P G n . G v_p - n . C v_p - M . G n' + c ((n . G n) (n' . B) + (n . B) (n' . G n)))
//
// where mu_0 dM/dchi = B - (1 - 1/(1 + chi)^2) (n . B) n, and z_p h is the height of the point above the middle surface.
void InducedTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                      Gradient& out) {
    const double factor = field_.factor(load_parameters);
    const Vec3 uniform = field_.uniform(load_parameters);
    const std::vector<Vec3> places = points(q);
    const std::vector<Vec3> nothing(places.size(), Vec3::Zero());
    const std::vector<Vec3> m = magnetizations(q, uniform, factor, field_.at_factor_one(places, nothing, 0));
    // Points off the middle surface move with the thickness, whose derivative needs the second gradient.
    const FieldSamples samples = field_.at_factor_one(places, m, sampling_.any_fine() ? 2 : 1);

    powers_.assign(surface_.n_faces(), 0.0);
    FieldProbe probe;
    probe.flux.resize(places.size()), probe.moment.resize(places.size()),
        probe.direction.resize(places.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[3], rate[3];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, rate);
        const InducedFace face(x);
        const SimdVec3 tilts = face.normal_rate(rate);
        const InducedFace::Element& e = elements_[group];
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.face(group, lane);
            const double along = e.along[lane], across = e.across[lane], h = thicknesses_[f],
                         permeability = 1.0 + susceptibilities_[f];
            const Vec3 normal = lane_of(face.normal, lane), tilt = lane_of(tilts, lane),
                       rates[3] = {lane_of(rate[0], lane), lane_of(rate[1], lane), lane_of(rate[2], lane)};
            Index n = sampling_.first(f);
            for (const FacePoint& point : sampling_.points(f)) {
                const double volume = point.weight * e.volume[lane];
                const Vec3 b = uniform + factor * samples.flux[n], v = position_of(point, rates, h * tilt);
                const Mat3 g = factor * samples.gradient[n];
                const Vec3 gv = g * v;
                const double flux_through = normal.dot(b), its_rate = tilt.dot(b);
                const Vec3 by_flux = across * (its_rate * normal + flux_through * tilt) -
                                     (along * gv - (across * normal.dot(gv)) * normal);
                const double slope = across * flux_through * its_rate - m[n].dot(gv);
                powers_[f] += volume * slope;
                out.values[thickness_.at(f)] += volume / h * slope;
                out.values[susceptibility_.at(f)] += volume / vacuum_permeability *
                                                     ((1.0 - 1.0 / (permeability * permeability)) *
                                                          flux_through * (its_rate + normal.dot(gv)) -
                                                      b.dot(gv));
                if (point.height != 0.0) {
                    const Vec3 by_height = g * normal;
                    out.values[thickness_.at(f)] +=
                        volume * point.height *
                        (by_flux.dot(by_height) - factor * normal.dot(samples.curvature[n] * v) -
                         m[n].dot(g * tilt));
                }
                probe.flux[n] = volume * by_flux;
                probe.moment[n] = -volume * m[n];
                probe.direction[n] = v;
                ++n;
            }
        }
    });
    field_.add_vjp(places, probe, samples, load_parameters, out);
}

// The power is proportional to the area at rest, and depends on the rest shape in no other way.
void InducedTerm::add_rest_vjp(const double*, const LoadParameters&, const double*, VectorXd& out) {
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const RestShape rest(surface_.rest_corners(f));
        for (int k = 0; k < 3; ++k)
            out.segment<3>(3 * surface_.corners[f][k]) += powers_[f] * rest.gradients[k];
    }
}

void InducedTerm::add_moments(const double* q, const LoadParameters& load_parameters,
                              std::vector<Vec3>& points, std::vector<Vec3>& moments) const {
    const std::vector<Vec3> at = this->points(q), nothing(at.size(), Vec3::Zero());
    const std::vector<Vec3> m = magnetizations(q, field_.uniform(load_parameters), 1.0,
                                               field_.sample(at, nothing, 0, load_parameters));
    points.insert(points.end(), at.begin(), at.end());
    std::vector<double> volumes(surface_.n_faces());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
            volumes[loop_.face(group, lane)] = elements_[group].volume[lane];
    sampling_.add_moments(volumes, m, moments);
}

std::size_t InducedTerm::bytes() const {
    const FieldSamples& samples = field_at_assembly_.samples;
    return bytes_of(elements_) + bytes_of(susceptibilities_) + bytes_of(thicknesses_) + sampling_.bytes() +
           bytes_of(samples.flux) + bytes_of(samples.gradient) + bytes_of(samples.curvature);
}

}  // namespace

std::unique_ptr<Term> make_induced_term(const Surface& surface, Index body, const FaceLoop& loop,
                                        const FieldSources& sources, Registry& registry) {
    return std::make_unique<InducedTerm>(surface, body, loop, sources, registry);
}

}  // namespace magshell
