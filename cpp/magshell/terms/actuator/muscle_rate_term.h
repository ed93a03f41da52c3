// MuscleRateTerm: the part of a muscle's tension that depends on the rate of its length by Hill's
// force-velocity curve. The isometric tension has an energy and is in muscle_term.cpp.
//
//   f_k = - V_p alpha_k T n,   T = w a f_L(l) (f_V(l'/v) - 1),   l' = n . y',   y' = F' m
//
// At a stage of a time step, where velocities follow positions by 1/tau, and with P = I - n n^T and the
// derivatives T_l, T_r of T by l and l',
//
//   - df_k/dx_l = V_p alpha_k alpha_l ((T_l + T_r/tau) n n^T + T/l P + T_r/l n (P y')^T)
//
// The last part is not symmetric: n u^T = (n u^T + u n^T)/2 + [u x n]/2.
#pragma once

#include <memory>
#include <utility>

#include "magshell/assembly/element_blocks.h"
#include "magshell/terms/actuator/muscle_fibres.h"
#include "magshell/terms/force_term.h"

namespace magshell {

template <class Element>
class MuscleRateTerm final : public ForceTerm {
    using Shared = MuscleFibres<Element>;
    using Pieces = typename Shared::Pieces;
    static constexpr int N = Element::nodes, points = Element::points;

  public:
    MuscleRateTerm(std::shared_ptr<Shared> fibres, const ParameterSlice& shortening_rate)
        : fibres_(std::move(fibres)), loop_(fibres_->loop), shortening_rate_(shortening_rate) {}

    std::string_view name() const override { return "muscle"; }
    void set_values(const Values& values) override { largest_rate_ = values.number(shortening_rate_); }

    void evaluate(const Kinematics& at, const LoadParameters&, Residual& out) override {
        loop_.scatter_groups([&](Index group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N], v[N], g[N];
            loop_.gather(group, at.q.data(), x);
            loop_.gather(group, at.v.data(), v);
            for (int p = 0; p < points; ++p) {
                const Point point(*this, group, p, x, v);
                const SimdVec3 pull = (each.volume[p] * point.tension) * point.fibre.n;
                add_pulls<N>(each.m[p], pull, p == 0, g);
            }
            loop_.scatter(group, g, out);
        });
    }

    void assemble(const Kinematics& at, const LoadParameters&, bool positive_definite, SystemMatrix& out,
                  NonsymmetricTangent& rest) const override {
        std::vector<std::array<Vec3, N*(N + 1) / 2>> axes(fibres_->fibres.n_elements());
        const SimdDouble rate(at.rate), half(0.5);
        loop_.scatter_groups([&](Index group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N], v[N], angle_branches[N * (N + 1) / 2];
            loop_.gather(group, at.q.data(), x);
            loop_.gather(group, at.v.data(), v);
            SimdMat3 h[N * (N + 1) / 2];
            for (int p = 0; p < points; ++p) {
                const Point point(*this, group, p, x, v);
                const DeformedFibre& fibre = point.fibre;
                const SimdVec3 u = (point.by_rate * fibre.inverse) * fibre.across(point.moves);
                SimdDouble along = point.by_length + rate * point.by_rate,
                           across = point.tension * fibre.inverse;
                if (positive_definite) {
                    along = max(along, SimdDouble(0.0));
                    across = max(across, SimdDouble(0.0));
                }
                SimdMat3 stiffness = fibre.stiffness(along, across);
                if (!positive_definite) stiffness += half * symmetric_outer(fibre.n, u);
                add_blocks<N>(FibreTangent<N>{each.m[p], each.volume[p] * stiffness}, p == 0, h);
                const SimdVec3 axis = (half * each.volume[p]) * cross(u, fibre.n);
                for (int k = 0; k < N; ++k)
                    for (int l = 0; l <= k; ++l) {
                        const SimdVec3 share = (each.m[p].alpha[k] * each.m[p].alpha[l]) * axis;
                        SimdVec3& into = angle_branches[lower_index(k, l)];
                        into = p == 0 ? share : into + share;
                    }
            }
            complete_blocks<N>(h);
            loop_.scatter(group, h, out);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
                for (int pair = 0; pair < N * (N + 1) / 2; ++pair)
                    axes[loop_.element(group, lane)][pair] = lane_of(angle_branches[pair], lane);
        });
        if (positive_definite) return;
        for (Index t = 0; t < fibres_->fibres.n_elements(); ++t) {
            const std::span<const Index> nodes = fibres_->fibres.nodes_of(t);
            for (int k = 0; k < N; ++k)
                for (int l = 0; l <= k; ++l) {
                    const double twice = k != l && nodes[k] == nodes[l] ? 2.0 : 1.0;
                    const Vec3 axis = twice * axes[t][lower_index(k, l)];
                    if (!axis.isZero(0.0))
                        rest.add(NonsymmetricTangent::SkewBlock{{nodes[k], nodes[l]}, axis});
                }
        }
    }

    void vjp(const Kinematics& at, const LoadParameters&, const VectorXd& lambda, KinematicsGradient& by,
             Gradient& out) const override {
        typename Shared::Gatherer gathered(*fibres_);
        std::vector<double> by_rates(fibres_->fibres.n_elements(), 0.0);
        Residual by_velocity;
        by_velocity.reset(lambda.size());
        loop_.scatter_groups([&](Index group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N], v[N], adjoint[N], g[N];
            loop_.gather(group, at.q.data(), x);
            loop_.gather(group, at.v.data(), v);
            loop_.gather(group, lambda.data(), adjoint);
            typename Shared::Found found;
            for (int p = 0; p < points; ++p) {
                const Point point(*this, group, p, x, v);
                const Power power(point, each.volume[p], each.m[p].at(adjoint));
                found.strength += power.along * point.by_strength;
                found.activation += power.along * point.by_activation;
                found.add(p, x, power.by_stretched);
                found.add(p, v, power.by_moves);
                found.add(p, adjoint, power.by_motion);
                add_pulls<N>(each.m[p], -power.by_moves, p == 0, g);
                const SimdDouble by_rate = power.along * point.by_rate * point.rate;
                for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
                    by_rates[loop_.element(group, lane)] -= by_rate[lane] / largest_rate_;
            }
            gathered.take(group, found);
            loop_.scatter(group, g, by_velocity);
        });
        by.velocity += by_velocity.gradient;
        gathered.hand_over(out);
        for (const double each : by_rates) out.values[shortening_rate_.first] += each;
    }

    void add_rest_vjp(const Kinematics& at, const VectorXd& lambda, VectorXd& out) const override {
        for (Index group = 0; group < loop_.groups(); ++group) {
            const Pieces& each = fibres_->at(group);
            SimdVec3 x[N], v[N], adjoint[N];
            loop_.gather(group, at.q.data(), x);
            loop_.gather(group, at.v.data(), v);
            loop_.gather(group, lambda.data(), adjoint);
            for (int p = 0; p < points; ++p) {
                const Point point(*this, group, p, x, v);
                const Power power(point, each.volume[p], each.m[p].at(adjoint));
                SimdDouble pulled[N];
                for (int k = 0; k < N; ++k)
                    pulled[k] = dot(x[k], power.by_stretched) + dot(v[k], power.by_moves) +
                                dot(adjoint[k], power.by_motion);
                fibres_->add_rest(group, p, power.along * point.tension, pulled, out);
            }
        }
    }

    void add_cancelling_forces(const Kinematics& at, VectorXd& out) const override {
        for (Index t = 0; t < fibres_->fibres.n_elements(); ++t) {
            const Index group = t / SimdDouble::width;
            const int lane = t % SimdDouble::width;
            const Pieces& each = fibres_->at(group);
            const std::span<const Index> nodes = fibres_->fibres.nodes_of(t);
            SimdVec3 x[N], v[N];
            loop_.gather(group, at.q.data(), x);
            loop_.gather(group, at.v.data(), v);
            for (int p = 0; p < points; ++p) {
                const double by_rate = std::abs(Point(*this, group, p, x, v).by_rate[lane]);
                double reach = 0.0;
                for (int k = 0; k < N; ++k)
                    reach += std::abs(each.m[p].alpha[k][lane]) * lane_of(x[k], lane).norm();
                for (int k = 0; k < N; ++k)
                    out.segment<3>(3 * nodes[k]).array() +=
                        each.volume[p][lane] * std::abs(each.m[p].alpha[k][lane]) * by_rate * at.rate * reach;
            }
        }
    }

  private:
    /// The tension T and its derivatives with respect to l, l', w and a.
    struct Point {
        DeformedFibre fibre;
        SimdVec3 moves;   // y'
        SimdDouble rate;  // l'
        SimdDouble tension, by_length, by_rate, by_strength, by_activation;

        Point(const MuscleRateTerm& term, Index group, int p, const SimdVec3 x[N], const SimdVec3 v[N])
            : fibre(term.fibres_->at(group).m[p].at(x)), moves(term.fibres_->at(group).m[p].at(v)) {
            const Pieces& each = term.fibres_->at(group);
            const FibreLaw& law = term.fibres_->law;
            // The slope of the active part alone: the total at activation 1 minus the total at 0.
            const FibreLaw::Response with = law.at(fibre.length, SimdDouble(1.0)),
                                     without = law.at(fibre.length, SimdDouble(0.0));
            const SimdDouble active = with.by_activation, slope = with.slope - without.slope;
            rate = dot(fibre.n, moves);
            SimdDouble more, steep;
            for (int lane = 0; lane < SimdDouble::width; ++lane) {
                const FibreCurve::Sample at = law.excess_over_isometric(rate[lane] / term.largest_rate_);
                more.set(lane, at.value);
                steep.set(lane, at.slope / term.largest_rate_);
            }
            const SimdDouble pulls = each.strength * each.activation;
            tension = pulls * active * more;
            by_length = pulls * slope * more;
            by_rate = pulls * active * steep;
            by_strength = each.activation * active * more;
            by_activation = each.strength * active * more;
        }
    };

    /// The power V T n . L m of a point along a motion with the rate L m of its fibre, and its derivatives with respect to F m, F' m and L m.
    struct Power {
        SimdDouble along;  // V n . L m
        SimdVec3 by_stretched, by_moves, by_motion;

        Power(const Point& point, const SimdDouble& volume, const SimdVec3& motion) {
            const DeformedFibre& fibre = point.fibre;
            along = volume * dot(fibre.n, motion);
            by_moves = (along * point.by_rate) * fibre.n;
            by_motion = (volume * point.tension) * fibre.n;
            by_stretched = (along * point.by_length) * fibre.n +
                           (volume * point.tension * fibre.inverse) * fibre.across(motion) +
                           (along * point.by_rate * fibre.inverse) * fibre.across(point.moves);
        }
    };

    const std::shared_ptr<Shared> fibres_;
    const ElementLoop<N>& loop_;
    const ParameterSlice shortening_rate_;
    double largest_rate_ = 1.0;
};

}  // namespace magshell
