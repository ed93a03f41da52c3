#include "magshell/terms/actuator/muscle_term.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "magshell/terms/actuator/muscle_rate_term.h"

namespace magshell {
namespace {

template <class Element>
class MuscleEnergy final : public MuscleTerm {
    using Shared = MuscleFibres<Element>;
    using Pieces = typename Shared::Pieces;
    static constexpr int N = Element::nodes, points = Element::points;

  public:
    MuscleEnergy(std::shared_ptr<Shared> fibres, Index body, const ParameterSlice& shortening_rate)
        : body_(body),
          fibres_(std::move(fibres)),
          loop_(fibres_->loop),
          shortening_rate_(shortening_rate),
          stiffness_(loop_.groups()) {}

    Index body() const override { return body_; }
    bool depends_on_loads() const override { return false; }
    bool varies() const override { return true; }
    Capabilities capabilities() const override { return {.has_psd_projection = true}; }
    void set_psd_projection(bool project_psd) override { psd_projection_ = project_psd; }

    bool set_values(const Values& values) override {
        if (shortening_rate_.size() > 0) largest_rate_ = values.number(shortening_rate_);
        return fibres_->set_values(values);
    }

    double energy(const double* q, const LoadParameters&) const override {
        return loop_.sum([&](Index group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N];
            loop_.gather(group, q, x);
            SimdDouble total(0.0);
            for (int p = 0; p < points; ++p)
                total += each.volume[p] *
                         fibres_->law.at(DeformedFibre(each.m[p].at(x)).length, each.activation).energy;
            return each.strength * total;
        });
    }

    /// Adds w m m^T with the stiffness of the fully activated reference configuration, so that the matrix does
    /// not depend on the activation.
    bool add_projective_stiffness(NodeMatrix& out) const override {
        const FibreLaw::Response law = fibres_->law.at(SimdDouble(1.0), SimdDouble(1.0));
        const SimdDouble stiffness = max(max(law.slope, law.tension), SimdDouble(0.0));
        for (Index group = 0; group < loop_.groups(); ++group) {
            const Pieces& each = fibres_->at(group);
            SimdDouble sum[N][N];
            for (int k = 0; k < N; ++k)
                for (int l = 0; l <= k; ++l) {
                    sum[k][l] = SimdDouble(0.0);
                    for (int p = 0; p < points; ++p)
                        sum[k][l] += (each.strength * stiffness * each.volume[p]) *
                                     (each.m[p].alpha[k] * each.m[p].alpha[l]);
                }
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const std::span<const Index> nodes = fibres_->fibres.nodes_of(loop_.element(group, lane));
                for (int k = 0; k < N; ++k) {
                    out.add_diagonal(nodes[k], sum[k][k][lane]);
                    for (int l = 0; l < k; ++l) out.add_pair(nodes[k], nodes[l], sum[k][l][lane]);
                }
            }
        }
        return true;
    }

    void evaluate(const double* q, const LoadParameters&, Residual& out) override {
        loop_.scatter_groups([&](Index group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N], g[N];
            loop_.gather(group, q, x);
            for (int p = 0; p < points; ++p) {
                const DeformedFibre at(each.m[p].at(x));
                const FibreLaw::Response law = fibres_->law.at(at.length, each.activation);
                stiffness_[group].along[p] = law.slope;
                stiffness_[group].across[p] = at.over_length(law);
                stiffness_[group].y[p] = at.y;
                SimdVec3 pull = (each.volume[p] * each.strength * law.tension) * at.n;
                if (frozen_) pull = (each.volume[p] * each.strength * (*frozen_)[group].at[p]) * at.y;
                add_pulls<N>(each.m[p], pull, p == 0, g);
            }
            loop_.scatter(group, g, out);
        });
    }

    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters&, bool,
                  SystemMatrix& out) const override {
        ElementLoop<N>::over_groups(element_block, [&](Index group) __attribute__((flatten)) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N];
            loop_.gather(group, q, x);
            Symmetric3 stiffness[points];
            for (int p = 0; p < points; ++p) {
                SimdDouble along = stiffness_[group].along[p], across = stiffness_[group].across[p];
                if (frozen_) along = across = (*frozen_)[group].at[p];
                if (psd_projection_) {
                    along = max(along, SimdDouble(0.0));
                    across = max(across, SimdDouble(0.0));
                }
                const SimdMat3 m = DeformedFibre(each.m[p].at(x)).stiffness(along, across);
                const SimdDouble scale = each.volume[p] * each.strength;
                for (int r = 0; r < 3; ++r)
                    for (int c = 0; c <= r; ++c) stiffness[p].at[lower_index(r, c)] = scale * m.at[3 * r + c];
            }
            SimdMat3 h[N * (N + 1) / 2];
            add_products(each, stiffness, h);
            loop_.scatter(group, h, out);
        });
    }

    void vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) override {
        typename Shared::Gatherer gathered(*fibres_);
        loop_.each_group([&](Index group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N], adjoint[N];
            loop_.gather(group, q, x);
            loop_.gather(group, lambda, adjoint);
            typename Shared::Found found;
            for (int p = 0; p < points; ++p) {
                const Pull pull(*this, each, p, x, adjoint);
                found.strength += each.volume[p] * pull.law.tension * pull.along;
                found.activation += pull.scale * pull.law.by_activation * pull.along;
                found.add(p, x, pull.by_stretched);
                found.add(p, adjoint, pull.by_rate);
            }
            gathered.take(group, found);
        });
        gathered.hand_over(out);
    }

    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override {
        for (Index group = 0; group < loop_.groups(); ++group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N], adjoint[N];
            loop_.gather(group, q, x);
            loop_.gather(group, lambda, adjoint);
            for (int p = 0; p < points; ++p) {
                const Pull pull(*this, each, p, x, adjoint);
                SimdDouble pulled[N];
                for (int k = 0; k < N; ++k)
                    pulled[k] = dot(x[k], pull.by_stretched) + dot(adjoint[k], pull.by_rate);
                fibres_->add_rest(group, p, pull.power, pulled, out);
            }
        }
    }

    // The stretch l loses digits to the cancellation of coordinates as F does.
    void add_cancelling_forces(double beyond, VectorXd& out) const override {
        for (Index t = 0; t < fibres_->fibres.n_elements(); ++t) {
            const Pieces& each = fibres_->at(t / SimdDouble::width);
            const int lane = t % SimdDouble::width;
            const FibreLaw::Response law = fibres_->law.at(SimdDouble(1.0), each.activation);
            const double stiffness =
                each.strength[lane] * (std::abs(law.slope[lane]) + std::abs(law.tension[lane]));
            double coordinate = beyond;
            for (int k = 0; k < N; ++k)
                coordinate = std::max(coordinate,
                                      beyond + fibres_->fibres.rest(t, k).template lpNorm<Eigen::Infinity>());
            for (int p = 0; p < points; ++p) {
                double steepest = 0.0;
                for (int k = 0; k < N; ++k) steepest = std::max(steepest, std::abs(each.m[p].alpha[k][lane]));
                const double stress = stiffness * (1.0 + 0.25 * coordinate * steepest) * each.volume[p][lane];
                for (int k = 0; k < N; ++k)
                    out.segment<3>(3 * fibres_->fibres.nodes_of(t)[k]).array() +=
                        stress * std::abs(each.m[p].alpha[k][lane]);
            }
        }
    }

    // The strain is l^2/2, whose stress is T/l. Its second derivative is the same at all states.
    void freeze_stress_rates(const double* p) override {
        std::vector<StressRates> rates(loop_.groups());
        loop_.each_group([&](Index group) {
            SimdVec3 moves[N];
            if (p) loop_.gather(group, p, moves);
            for (int k = 0; k < points; ++k) {
                SimdDouble& rate = rates[group].at[k];
                rate = SimdDouble(0.0);
                const Stiffness& now = stiffness_[group];
                const DeformedFibre at(now.y[k]);
                if (p)
                    rate = (now.along[k] - now.across[k]) * at.inverse * at.inverse *
                           dot(at.y, fibres_->at(group).m[k].at(moves));
            }
        });
        frozen_ = std::move(rates);
    }
    void release_stresses() override { frozen_.reset(); }
    // Returns true if T/l does not depend on the state, so that the rates are zero.
    bool has_stress_work_vjp() const override { return fibres_->law.form == FibreForm::active_stress; }

    FibreStates states(const double* q, const double* v) const override {
        const std::size_t count = static_cast<std::size_t>(fibres_->fibres.n_elements()) * points;
        FibreStates out{points, std::vector<double>(count), std::vector<double>(count),
                        std::vector<double>(count)};
        loop_.each_group([&](Index group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N], moves[N];
            loop_.gather(group, q, x);
            if (v) loop_.gather(group, v, moves);
            for (int p = 0; p < points; ++p) {
                const DeformedFibre at(each.m[p].at(x));
                const FibreLaw::Response law = fibres_->law.at(at.length, each.activation);
                for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                    const Index t = loop_.element(group, lane);
                    const std::size_t place =
                        static_cast<std::size_t>(fibres_->fibres.elements.user[t]) * points + p;
                    double tension = law.tension[lane];
                    if (v && largest_rate_ > 0.0) {
                        const double rate = dot(at.n, each.m[p].at(moves))[lane] / largest_rate_;
                        tension += each.activation[lane] * law.by_activation[lane] *
                                   fibres_->law.excess_over_isometric(rate).value;
                    }
                    out.stretches[place] = at.length[lane];
                    out.tensions[place] = each.strength[lane] * tension;
                    out.volumes[place] = each.volume[p][lane];
                }
            }
        });
        return out;
    }

    std::size_t bytes() const override { return fibres_->bytes() + bytes_of(stiffness_); }

  private:
    // At the last evaluated state: T', T/l and the vector F m of the fibre.
    struct Stiffness {
        SimdDouble along[points], across[points];
        SimdVec3 y[points];
    };
    // Rates of T/l.
    struct StressRates {
        SimdDouble at[points];
    };

    // The power of a point along a motion, with its derivatives with respect to F m and to the rate of F m.
    struct Pull {
        FibreLaw::Response law;
        SimdDouble along, scale, power;
        SimdVec3 by_stretched, by_rate;

        Pull(const MuscleEnergy& muscle, const Pieces& each, int p, const SimdVec3 x[N],
             const SimdVec3 motion[N]) {
            const DeformedFibre at(each.m[p].at(x));
            law = muscle.fibres_->law.at(at.length, each.activation);
            const SimdVec3 rate = each.m[p].at(motion);
            along = dot(at.n, rate);
            scale = each.volume[p] * each.strength;
            power = scale * law.tension * along;
            by_stretched =
                (scale * law.slope * along) * at.n + (scale * at.over_length(law)) * at.across(rate);
            by_rate = (scale * law.tension) * at.n;
        }
    };

    // Computes sum_p alpha_pk alpha_pl M_p for all pairs of nodes. The blocks are symmetric, so six numbers of
    // each are computed.
    static void add_products(const Pieces& each, const Symmetric3 m[points], SimdMat3 h[]) {
        for (int k = 0; k < N; ++k) {
            Symmetric3 of_node[points];
            for (int p = 0; p < points; ++p)
                for (int i = 0; i < 6; ++i) of_node[p].at[i] = each.m[p].alpha[k] * m[p].at[i];
            for (int l = 0; l <= k; ++l) {
                SimdDouble sum[6];
                for (int i = 0; i < 6; ++i) sum[i] = each.m[0].alpha[l] * of_node[0].at[i];
                for (int p = 1; p < points; ++p)
                    for (int i = 0; i < 6; ++i) sum[i] += each.m[p].alpha[l] * of_node[p].at[i];
                SimdMat3& block = h[lower_index(k, l)];
                for (int r = 0; r < 3; ++r)
                    for (int c = 0; c < 3; ++c)
                        block.at[3 * r + c] = sum[r >= c ? lower_index(r, c) : lower_index(c, r)];
            }
        }
    }

    const Index body_;
    const std::shared_ptr<Shared> fibres_;
    const ElementLoop<N>& loop_;
    const ParameterSlice shortening_rate_;
    double largest_rate_ = 0.0;
    bool psd_projection_ = false;
    std::vector<Stiffness> stiffness_;
    std::optional<std::vector<StressRates>> frozen_;
};

template <class Element>
Muscle make(const MuscleInput& input, const Fibres& fibres, Index body, const ColoredLoop& element_blocks,
            const SystemMatrix& matrix, Registry& registry) {
    std::shared_ptr<MuscleFibres<Element>> shared =
        std::make_shared<MuscleFibres<Element>>(input, fibres, element_blocks, matrix, registry);
    ParameterSlice rate;
    Muscle muscle;
    if (!input.law.force_velocity.empty()) {
        rate = registry.values.add(input.owner, "shortening_rate", "1/s", 1, 1);
        muscle.force = std::make_unique<MuscleRateTerm<Element>>(shared, rate);
    }
    muscle.term = std::make_unique<MuscleEnergy<Element>>(std::move(shared), body, rate);
    return muscle;
}

}  // namespace

Muscle make_muscle(const MuscleInput& input, const Fibres& fibres, Index body,
                   const ColoredLoop& element_blocks, const SystemMatrix& matrix, Registry& registry) {
    return fibres.solid.quadratic()
               ? make<QuadraticTetrahedron>(input, fibres, body, element_blocks, matrix, registry)
               : make<LinearTetrahedron>(input, fibres, body, element_blocks, matrix, registry);
}

}  // namespace magshell
