// A fast multipole method: sources go to the expansions of leaves and up the tree, from expansion to distant expansion, and down the tree
// to the points. Near boxes are summed point by point. Lanes are points, or boxes that are treated alike.
#include <algorithm>
#include <array>

#include "magshell/core/parallel.h"
#include "magshell/energy/solid_harmonics.h"
#include "magshell/energy/source_tree.h"

namespace magshell {
namespace {

constexpr int width = SimdDouble::width;
using Complex = ComplexLanes<SimdDouble>;
using Harmonics = std::vector<Complex>;  // for 0 <= m <= l

// The numbers of an expansion for 0 <= m <= l, of all boxes, in components: of the charge or its potential, then three of the current or
// its vector potential. For Dual, each component has two channels: value and rate.
template <class T>
class Expansions {
  public:
    static constexpr int per = std::is_same_v<T, Dual> ? 2 : 1;

    Expansions(const SourceTree& tree, bool has_currents)
        : degree_(tree.degree()),
          count_(2 * static_cast<std::size_t>(harmonic_count(degree_))),
          components_(has_currents ? 4 : 1) {
        for (int c = 0; c < channels(); ++c) numbers_[c].assign(count_ * tree.boxes().size(), 0.0);
    }

    int degree() const { return degree_; }
    int components() const { return components_; }
    int channels() const { return per * components_; }
    /// Returns the real and imaginary parts by turns.
    double* numbers(int channel, Index box) {
        return numbers_[channel].data() + count_ * static_cast<std::size_t>(box);
    }
    const double* numbers(int channel, Index box) const {
        return numbers_[channel].data() + count_ * static_cast<std::size_t>(box);
    }

    /// Loads the expansions of `count` boxes, one in each lane; the other lanes are zero.
    void load(int channel, const Index* boxes, int count, Harmonics& half, FullHarmonics& full) const {
        const double* from[width];
        for (int lane = 0; lane < count; ++lane) from[lane] = numbers(channel, boxes[lane]);
        for (std::size_t k = 0; k < half.size(); ++k) {
            half[k] = {SimdDouble(0.0), SimdDouble(0.0)};
            for (int lane = 0; lane < count; ++lane) {
                half[k].re.set(lane, from[lane][2 * k]);
                half[k].im.set(lane, from[lane][2 * k + 1]);
            }
        }
        full.set(half.data());
    }
    /// Adds a lane to the expansion of each box.
    void add(int channel, const Index* boxes, int count, const Harmonics& half) {
        for (int lane = 0; lane < count; ++lane) {
            double* const to = numbers(channel, boxes[lane]);
            for (std::size_t k = 0; k < half.size(); ++k) {
                to[2 * k] += half[k].re[lane];
                to[2 * k + 1] += half[k].im[lane];
            }
        }
    }

  private:
    int degree_;
    std::size_t count_;
    int components_;
    std::array<std::vector<double>, 8> numbers_;
};

// Runs body(boxes, count) over the boxes in lanes, on all threads.
template <class Body>
void each_lanes(const std::vector<Index>& boxes, const Body& body) {
    const int count = static_cast<int>(boxes.size());
    parallel_for((count + width - 1) / width,
                 [&](int part) { body(boxes.data() + part * width, std::min(width, count - part * width)); });
}

// Returns the vectors from the centers of the parents to those of the boxes.
Triple<SimdDouble> from_parents(const SourceTree& tree, const Index* boxes, int count) {
    Triple<SimdDouble> out{SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
    for (int lane = 0; lane < count; ++lane) {
        const SourceTree::Box& box = tree.boxes()[boxes[lane]];
        const Vec3 way = box.center - tree.boxes()[box.parent].center;
        out.x.set(lane, way.x());
        out.y.set(lane, way.y());
        out.z.set(lane, way.z());
    }
    return out;
}

void add_product(const Complex& a, const Complex& b, Complex& out) {
    out.re += a.re * b.re;
    out.re -= a.im * b.im;
    out.im += a.re * b.im;
    out.im += a.im * b.re;
}

// M_l^m = sum conj R_k^n M'_(l-k)^(m-n), about the center of the parent
void shift_sources(int degree, const FullHarmonics& regular, const FullHarmonics& from, Harmonics& to) {
    for (int l = 0; l <= degree; ++l)
        for (int m = 0; m <= l; ++m) {
            Complex sum{SimdDouble(0.0), SimdDouble(0.0)};
            for (int k = 0; k <= l; ++k)
                for (int n = std::max(-k, m - l + k); n <= std::min(k, m + l - k); ++n)
                    add_product(regular(k, n), from(l - k, m - n), sum);
            to[half_index(l, m)] = sum;
        }
}

// L_l^m = sum L'_k^n conj R_(k-l)^(n-m), about the center of the child
void shift_potentials(int degree, const FullHarmonics& regular, const FullHarmonics& from, Harmonics& to) {
    for (int l = 0; l <= degree; ++l)
        for (int m = 0; m <= l; ++m) {
            Complex sum{SimdDouble(0.0), SimdDouble(0.0)};
            for (int k = l; k <= degree; ++k)
                for (int n = m - k + l; n <= m + k - l; ++n)
                    add_product(from(k, n), regular(k - l, n - m), sum);
            to[half_index(l, m)] = sum;
        }
}

// L_l^m += (-1)^l sum M_k^n I_(l+k)^(m+n) for l + k <= p, so that two boxes act on each other alike. Two successive m share the loads of M,
// and their sums do not wait for each other; the second one is not used where m = l.
void add_potentials(int degree, const FullHarmonics& irregular, const FullHarmonics& from, Harmonics& to) {
    const SimdDouble zero(0.0);
    for (int l = 0; l <= degree; ++l)
        for (int m = 0; m <= l; m += 2) {
            SimdDouble sums[8] = {zero, zero, zero, zero, zero, zero, zero, zero};
            for (int k = 0; k <= degree - l; ++k) {
                const Complex* const source = from.data() + full_index(k, -k);
                const Complex* const kernel = irregular.data() + full_index(l + k, m - k);
                for (int n = 0; n <= 2 * k; ++n) {
                    const Complex &a = source[n], &b = kernel[n], &c = kernel[n + 1];
                    sums[0] += a.re * b.re;
                    sums[1] += a.im * b.im;
                    sums[2] += a.re * b.im;
                    sums[3] += a.im * b.re;
                    sums[4] += a.re * c.re;
                    sums[5] += a.im * c.im;
                    sums[6] += a.re * c.im;
                    sums[7] += a.im * c.re;
                }
            }
            for (int i = 0; i < 2 && m + i <= l; ++i) {
                Complex& out = to[half_index(l, m + i)];
                const SimdDouble re = sums[4 * i] - sums[4 * i + 1], im = sums[4 * i + 2] + sums[4 * i + 3];
                if (l % 2 == 0) {
                    out.re += re;
                    out.im += im;
                } else {
                    out.re -= re;
                    out.im -= im;
                }
            }
        }
}

template <class T>
using LanesType = typename LanesOf<T>::Type;

// Points in lanes: relative to the center of their box, with their charge and current. Lanes behind the last one are at the center, and
// have no strength.
template <class T>
struct PointLanes {
    Triple<LanesType<T>> at;
    LanesType<T> strengths[4];

    PointLanes(const std::vector<SourcePoint<T>>& points, Index first, int count, const Vec3& center) {
        using Lanes = LanesOf<T>;
        at = {Lanes::zero(), Lanes::zero(), Lanes::zero()};
        for (LanesType<T>& each : strengths) each = Lanes::zero();
        for (int lane = 0; lane < count; ++lane) {
            const SourcePoint<T>& point = points[first + lane];
            Lanes::set(at.x, lane, point.at.x - T(center.x()));
            Lanes::set(at.y, lane, point.at.y - T(center.y()));
            Lanes::set(at.z, lane, point.at.z - T(center.z()));
            Lanes::set(strengths[0], lane, point.charge);
            Lanes::set(strengths[1], lane, point.current.x);
            Lanes::set(strengths[2], lane, point.current.y);
            Lanes::set(strengths[3], lane, point.current.z);
        }
    }
};

// Calls body(first, lanes, count) for the points of a box, in lanes.
template <class T, class Body>
void each_point_lanes(const SourceTree& tree, const SourceTree::Box& box,
                      const std::vector<SourcePoint<T>>& points, const Body& body) {
    const Index last = box.last * tree.group_size();
    for (Index first = box.first * tree.group_size(); first < last; first += width) {
        const int count = std::min<int>(width, last - first);
        body(first, PointLanes<T>(points, first, count, box.center), count);
    }
}

// Returns the expansions of the sources in each box: first of leaves, then carried to parents.
template <class T>
Expansions<T> sources_of(const SourceTree& tree, const std::vector<SourcePoint<T>>& from, bool has_currents) {
    using Lanes = LanesType<T>;
    Expansions<T> sources(tree, has_currents);
    const int degree = tree.degree();
    const std::size_t count = static_cast<std::size_t>(harmonic_count(degree));
    parallel_for(static_cast<int>(tree.boxes().size()), [&](int number) {
        const SourceTree::Box& box = tree.boxes()[number];
        if (!box.is_leaf()) return;
        std::vector<ComplexLanes<Lanes>> regular(count), sums(count * sources.components());
        for (ComplexLanes<Lanes>& each : sums) each = {LanesOf<T>::zero(), LanesOf<T>::zero()};
        each_point_lanes<T>(tree, box, from, [&](Index, const PointLanes<T>& points, int) {
            set_regular_harmonics(degree, points.at, LanesOf<T>::one(), LanesOf<T>::zero(), regular.data());
            for (int c = 0; c < sources.components(); ++c)
                for (std::size_t k = 0; k < count; ++k) {
                    sums[c * count + k].re += points.strengths[c] * regular[k].re;
                    sums[c * count + k].im -= points.strengths[c] * regular[k].im;
                }
        });
        for (int c = 0; c < sources.components(); ++c)
            for (std::size_t k = 0; k < count; ++k) {
                const T re = LanesOf<T>::sum(sums[c * count + k].re),
                        im = LanesOf<T>::sum(sums[c * count + k].im);
                constexpr int per = Expansions<T>::per;
                sources.numbers(per * c, number)[2 * k] = value_of(re);
                sources.numbers(per * c, number)[2 * k + 1] = value_of(im);
                if (per == 1) continue;
                sources.numbers(per * c + 1, number)[2 * k] = rate_of(re);
                sources.numbers(per * c + 1, number)[2 * k + 1] = rate_of(im);
            }
    });
    for (std::size_t level = tree.levels().size(); level-- > 0;) {
        std::vector<Index> parents;
        for (const Index b : tree.levels()[level])
            if (!tree.boxes()[b].is_leaf()) parents.push_back(b);
        each_lanes(parents, [&](const Index* boxes, int boxes_count) {
            Harmonics half(count);
            FullHarmonics regular(degree), child_sources(degree);
            for (int side = 0; side < 2; ++side) {
                Index children[width];
                for (int lane = 0; lane < boxes_count; ++lane)
                    children[lane] = tree.boxes()[boxes[lane]].children[side];
                regular.set_conjugate_regular(from_parents(tree, children, boxes_count), half);
                for (int c = 0; c < sources.channels(); ++c) {
                    sources.load(c, children, boxes_count, half, child_sources);
                    shift_sources(degree, regular, child_sources, half);
                    sources.add(c, boxes, boxes_count, half);
                }
            }
        });
    }
    return sources;
}

// Returns the expansions of the potentials about the centers of target boxes: of distant boxes, then those carried from parents.
template <class T>
Expansions<T> potentials_of(const SourceTree& targets, const SourceTree& sources, const BoxPairs& pairs,
                            const Expansions<T>& from, bool has_currents) {
    Expansions<T> potentials(targets, has_currents);
    const int degree = targets.degree();
    const std::size_t count = static_cast<std::size_t>(harmonic_count(degree));
    parallel_for(static_cast<int>(targets.boxes().size()), [&](int number) {
        const std::vector<Index>& distant = pairs.distant[number];
        if (distant.empty()) return;
        const Vec3& center = targets.boxes()[number].center;
        Harmonics half(count);
        FullHarmonics irregular(degree), of_sources(degree);
        std::vector<Harmonics> by_channel(from.channels(),
                                          Harmonics(count, {SimdDouble(0.0), SimdDouble(0.0)}));
        for (std::size_t first = 0; first < distant.size(); first += width) {
            const int boxes_count = static_cast<int>(std::min<std::size_t>(width, distant.size() - first));
            Triple<SimdDouble> way;  // spare lanes repeat the last box, without sources
            for (int lane = 0; lane < width; ++lane) {
                const Index b = distant[first + std::min(lane, boxes_count - 1)];
                const Vec3 apart = center - sources.boxes()[b].center;
                way.x.set(lane, apart.x());
                way.y.set(lane, apart.y());
                way.z.set(lane, apart.z());
            }
            irregular.set_irregular(way);
            for (int c = 0; c < from.channels(); ++c) {
                from.load(c, &distant[first], boxes_count, half, of_sources);
                add_potentials(degree, irregular, of_sources, by_channel[c]);
            }
        }
        for (int c = 0; c < from.channels(); ++c)
            for (std::size_t k = 0; k < count; ++k) {
                potentials.numbers(c, number)[2 * k] = sum_of_lanes(by_channel[c][k].re);
                potentials.numbers(c, number)[2 * k + 1] = sum_of_lanes(by_channel[c][k].im);
            }
    });
    for (std::size_t level = 1; level < targets.levels().size(); ++level)
        each_lanes(targets.levels()[level], [&](const Index* boxes, int boxes_count) {
            Harmonics half(count);
            FullHarmonics regular(degree), of_parents(degree);
            Index parents[width];
            for (int lane = 0; lane < boxes_count; ++lane)
                parents[lane] = targets.boxes()[boxes[lane]].parent;
            regular.set_conjugate_regular(from_parents(targets, boxes, boxes_count), half);
            for (int c = 0; c < potentials.channels(); ++c) {
                potentials.load(c, parents, boxes_count, half, of_parents);
                shift_potentials(degree, regular, of_parents, half);
                potentials.add(c, boxes, boxes_count, half);
            }
        });
    return potentials;
}

// The real factors of R_l^m in a potential and its gradient: each is a sum of re Re R + im Im R over 0 <= m <= l, where terms with m > 0
// count twice, as those for -m are their conjugates.
//
//   phi = sum L_l^m conj R_l^m,   d phi/dz = sum L_(l+1)^m conj R_l^m,   d phi/dx + i d phi/dy = sum L_(l+1)^(m+1) conj R_l^m
template <class T>
class PotentialAtPoints {
  public:
    explicit PotentialAtPoints(int degree) : degree_(degree) {
        for (int part = 0; part < 4; ++part)
            for (int c = 0; c < 2 * Expansions<T>::per; ++c)
                factors_[part][c].resize(static_cast<std::size_t>(harmonic_count(degree)));
    }

    /// Takes the expansion of a component.
    void set(const Expansions<T>& potentials, int component, Index box) {
        for (int rate = 0; rate < Expansions<T>::per; ++rate) {
            const double* const numbers = potentials.numbers(Expansions<T>::per * component + rate, box);
            const auto re = [&](int l, int m) { return numbers[2 * half_index(l, m)]; };
            const auto im = [&](int l, int m) { return numbers[2 * half_index(l, m) + 1]; };
            for (int l = 0; l <= degree_; ++l)
                for (int m = 0; m <= l; ++m) {
                    const double both = m == 0 ? 1.0 : 2.0;
                    const std::size_t k = static_cast<std::size_t>(half_index(l, m));
                    const auto put = [&](int part, double of_re, double of_im) {
                        factors_[part][2 * rate][k] = of_re;
                        factors_[part][2 * rate + 1][k] = of_im;
                    };
                    put(0, both * re(l, m), both * im(l, m));
                    if (l == degree_) continue;
                    put(3, both * re(l + 1, m), both * im(l + 1, m));
                    if (m == 0) {
                        put(1, re(l + 1, 1), 0.0);
                        put(2, im(l + 1, 1), 0.0);
                    } else {
                        put(1, re(l + 1, m + 1) - re(l + 1, m - 1), im(l + 1, m + 1) - im(l + 1, m - 1));
                        put(2, im(l + 1, m + 1) + im(l + 1, m - 1), -re(l + 1, m + 1) - re(l + 1, m - 1));
                    }
                }
        }
    }

    /// Returns the potential and its gradient where the harmonics are R.
    std::array<LanesType<T>, 4> operator()(const std::vector<ComplexLanes<LanesType<T>>>& regular) const {
        std::array<LanesType<T>, 4> sums;
        sums.fill(LanesOf<T>::zero());
        const int count = harmonic_count(degree_), inner = harmonic_count(degree_ - 1);
        for (int k = 0; k < inner; ++k)
            for (int part = 0; part < 4; ++part) add(part, k, regular[k], sums[part]);
        for (int k = inner; k < count; ++k) add(0, k, regular[k], sums[0]);
        return sums;
    }

  private:
    void add(int part, int k, const ComplexLanes<LanesType<T>>& r, LanesType<T>& sum) const {
        const auto& of = factors_[part];
        constexpr int last = 2 * (Expansions<T>::per - 1);
        sum += LanesOf<T>::broadcast(&of[0][k], &of[last][k]) * r.re;
        sum += LanesOf<T>::broadcast(&of[1][k], &of[last + 1][k]) * r.im;
    }

    int degree_;
    std::array<std::array<std::vector<double>, 2 * Expansions<T>::per>, 4> factors_;
};

// Adds the sums over distant sources at the points of a leaf. The pull is -grad (q V - c . A) with the potentials V and A.
template <class T>
void add_distant(const SourceTree& tree, Index number, const std::vector<SourcePoint<T>>& at,
                 const Expansions<T>& potentials, std::vector<SourceSums<T>>& out) {
    const SourceTree::Box& box = tree.boxes()[number];
    std::vector<PotentialAtPoints<T>> parts(potentials.components(), PotentialAtPoints<T>(tree.degree()));
    for (int c = 0; c < potentials.components(); ++c) parts[c].set(potentials, c, number);
    std::vector<ComplexLanes<LanesType<T>>> regular(static_cast<std::size_t>(harmonic_count(tree.degree())));
    each_point_lanes<T>(tree, box, at, [&](Index first, const PointLanes<T>& points, int count) {
        set_regular_harmonics(tree.degree(), points.at, LanesOf<T>::one(), LanesOf<T>::zero(),
                              regular.data());
        for (int c = 0; c < potentials.components(); ++c) {
            const auto [value, x, y, z] = parts[c](regular);
            const LanesType<T> strength = c == 0 ? -points.strengths[0] : points.strengths[c];
            const LanesType<T> pull[3] = {strength * x, strength * y, strength * z};
            for (int lane = 0; lane < count; ++lane) {
                SourceSums<T>& sums = out[first + lane];
                T* const values[4] = {&sums.charges, &sums.currents.x, &sums.currents.y, &sums.currents.z};
                *values[c] += LanesOf<T>::lane(value, lane);
                sums.pull += Triple<T>{LanesOf<T>::lane(pull[0], lane), LanesOf<T>::lane(pull[1], lane),
                                       LanesOf<T>::lane(pull[2], lane)};
            }
        }
    });
}

}  // namespace

template <class T>
std::vector<SourceSums<T>> tree_sums(const SourceTree& targets, const std::vector<SourcePoint<T>>& at,
                                     const SourceTree& sources, const std::vector<SourcePoint<T>>& from,
                                     const BoxPairs& pairs, bool has_currents, bool same) {
    const Expansions<T> of_sources = sources_of(sources, from, has_currents);
    const Expansions<T> potentials = potentials_of(targets, sources, pairs, of_sources, has_currents);
    SourceArrays points;
    points.resize(from.size(), has_currents, std::is_same_v<T, Dual>);
    for (std::size_t k = 0; k < from.size(); ++k) points.set(k, from[k]);
    std::vector<SourceSums<T>> sums(at.size());
    const std::size_t group_size = static_cast<std::size_t>(sources.group_size());
    parallel_for(static_cast<int>(targets.boxes().size()), [&](int number) {
        const SourceTree::Box& box = targets.boxes()[number];
        if (!box.is_leaf()) return;
        add_distant(targets, number, at, potentials, sums);
        std::vector<std::array<std::size_t, 2>> ranges;
        std::size_t own = 0, count = 0;  // where the leaf itself begins, and points so far
        for (const Index b : pairs.near[number]) {
            const SourceTree::Box& source = sources.boxes()[b];
            if (same && b == number) own = count;
            ranges.push_back({source.first * group_size, source.last * group_size});
            count += ranges.back()[1] - ranges.back()[0];
        }
        SourceArrays near;
        near.gather(points, ranges);
        for (Index group = box.first; group < box.last; ++group) {
            // Points of the same group are left out; among those gathered they begin at `own` and a multiple of the group's size.
            const std::size_t skip = same ? own + (group - box.first) * group_size : 0;
            for (Index p = group * targets.group_size(); p < (group + 1) * targets.group_size(); ++p)
                near.add_sums(at[p], 0, near.size(), skip, same ? skip + group_size : 0, sums[p]);
        }
    });
    return sums;
}

template std::vector<SourceSums<double>> tree_sums(const SourceTree&, const std::vector<SourcePoint<double>>&,
                                                   const SourceTree&, const std::vector<SourcePoint<double>>&,
                                                   const BoxPairs&, bool, bool);
template std::vector<SourceSums<Dual>> tree_sums(const SourceTree&, const std::vector<SourcePoint<Dual>>&,
                                                 const SourceTree&, const std::vector<SourcePoint<Dual>>&,
                                                 const BoxPairs&, bool, bool);

}  // namespace magshell
