// A fast multipole method that interpolates 1/r on Chebyshev grids: sources go to the grids of leaves and up the tree, from grid to
// distant grid, and down the tree to the points. Near boxes are summed point by point.
#include <array>
#include <cstring>

#include "magshell/core/parallel.h"
#include "magshell/energy/source_tree.h"

namespace magshell {
namespace {

constexpr int most = SourceTree::most_counts;

// The values and slopes at one place u of the Lagrange polynomials of n Chebyshev points.
template <class T>
struct Lagrange {
    std::array<T, most> values, slopes;

    Lagrange(int n, const T& u) {
        // Products of u - p_j over the points j > i, and their slopes
        std::array<T, most + 1> after, after_slopes;
        after[n - 1] = T(1.0), after_slopes[n - 1] = T(0.0);
        for (int i = n - 1; i > 0; --i) {
            const T off = u - T(chebyshev().points[n][i]);
            after[i - 1] = after[i] * off;
            after_slopes[i - 1] = after_slopes[i] * off + after[i];
        }
        T before(1.0), before_slope(0.0);
        for (int i = 0; i < n; ++i) {
            const T weight(chebyshev().weights[n][i]), off = u - T(chebyshev().points[n][i]);
            values[i] = weight * before * after[i];
            slopes[i] = weight * (before_slope * after[i] + before * after_slopes[i]);
            before_slope = before_slope * off + before;
            before = before * off;
        }
    }

  private:
    struct Table {
        double points[most + 1][most], weights[most + 1][most];
        Table() {
            for (int n = 1; n <= most; ++n)
                for (int i = 0; i < n; ++i) {
                    points[n][i] = chebyshev_point(n, i);
                    weights[n][i] = 1.0;
                    for (int j = 0; j < n; ++j)
                        if (j != i) weights[n][i] /= chebyshev_point(n, i) - chebyshev_point(n, j);
                }
        }
    };
    static const Table& chebyshev() {
        static const Table table;
        return table;
    }
};

// The Lagrange polynomials of the grid of a box at one place: one set along each axis of the box.
template <class T>
struct BoxBasis {
    const SourceTree::Box& box;
    Lagrange<T> x, y, z;

    BoxBasis(const SourceTree::Box& b, const Triple<T>& place)
        : box(b),
          x(b.counts[0], local(b, place, 0)),
          y(b.counts[1], local(b, place, 1)),
          z(b.counts[2], local(b, place, 2)) {}

    static T local(const SourceTree::Box& box, const Triple<T>& place, int axis) {
        const Vec3 along = box.axes.col(axis) / box.half[axis];
        return T(along.x()) * place.x + T(along.y()) * place.y + T(along.z()) * place.z -
               T(along.dot(box.center));
    }

    // Calls body(number, value) for each point of the grid, with the value of its polynomial at the place.
    template <class Body>
    void each(const Body& body) const {
        std::size_t number = box.grid;
        for (int i = 0; i < box.counts[0]; ++i)
            for (int j = 0; j < box.counts[1]; ++j) {
                const T both = x.values[i] * y.values[j];
                for (int k = 0; k < box.counts[2]; ++k) body(number++, both * z.values[k]);
            }
    }

    // Adds the interpolated value of a function that `at(number)` returns at the points of the grid, and its gradient.
    template <class At>
    void interpolate(const At& at, T& value, Triple<T>& gradient) const {
        T by[3]{};
        std::size_t number = box.grid;
        for (int i = 0; i < box.counts[0]; ++i) {
            T row{}, row_y{}, row_z{};
            for (int j = 0; j < box.counts[1]; ++j) {
                T line{}, line_z{};
                for (int k = 0; k < box.counts[2]; ++k) {
                    const T here = at(number++);
                    line += here * z.values[k];
                    line_z += here * z.slopes[k];
                }
                row += line * y.values[j];
                row_y += line * y.slopes[j];
                row_z += line_z * y.values[j];
            }
            value += row * x.values[i];
            by[0] += row * x.slopes[i];
            by[1] += row_y * x.values[i];
            by[2] += row_z * x.values[i];
        }
        for (int d = 0; d < 3; ++d) {
            const Vec3 along = box.axes.col(d) / box.half[d];
            gradient += by[d] * Triple<T>{T(along.x()), T(along.y()), T(along.z())};
        }
    }
};

// Numbers at the points of all grids, in components: the charge or its potential, then three of the current or its vector potential.
// For Dual, each component has two channels: value and rate.
template <class T>
class GridNumbers {
  public:
    static constexpr int per = std::is_same_v<T, Dual> ? 2 : 1;

    GridNumbers(const SourceTree& tree, bool has_currents)
        : components_(has_currents ? 4 : 1), channels_(per * components_) {
        for (int c = 0; c < channels_; ++c) numbers_[c].assign(tree.grids()[0].size(), 0.0);
    }

    int components() const { return components_; }
    int channels() const { return channels_; }
    double* channel(int c) { return numbers_[c].data(); }
    const double* channel(int c) const { return numbers_[c].data(); }
    T at(int component, std::size_t number) const {
        if constexpr (per == 2)
            return {numbers_[2 * component][number], numbers_[2 * component + 1][number]};
        else
            return numbers_[component][number];
    }
    void add(int component, std::size_t number, const T& more) {
        numbers_[per * component][number] += value_of(more);
        if constexpr (per == 2) numbers_[2 * component + 1][number] += rate_of(more);
    }

  private:
    int components_, channels_;
    std::array<std::vector<double>, 8> numbers_;
};

// Returns the sources at the grid points that replace those of the points: first on leaves, then carried to parents.
template <class T>
GridNumbers<T> weights_of(const SourceTree& tree, const std::vector<SourcePoint<T>>& from,
                          bool has_currents) {
    GridNumbers<T> weights(tree, has_currents);
    for (std::size_t level = tree.levels().size(); level-- > 0;) {
        const std::vector<Index>& boxes = tree.levels()[level];
        parallel_for(static_cast<int>(boxes.size()), [&](int number) {
            const SourceTree::Box& box = tree.boxes()[boxes[number]];
            if (box.is_leaf()) {
                for (Index p = box.first * tree.group_size(); p < box.last * tree.group_size(); ++p) {
                    const SourcePoint<T>& point = from[p];
                    BoxBasis<T>(box, point.at).each([&](std::size_t k, const T& value) {
                        weights.add(0, k, value * point.charge);
                        if (!has_currents) return;
                        weights.add(1, k, value * point.current.x);
                        weights.add(2, k, value * point.current.y);
                        weights.add(3, k, value * point.current.z);
                    });
                }
                return;
            }
            for (const Index child_number : box.children) {
                const SourceTree::Box& child = tree.boxes()[child_number];
                for (std::size_t l = child.grid; l < child.grid + child.n_grid(); ++l) {
                    const Triple<double> place{tree.grids()[0][l], tree.grids()[1][l], tree.grids()[2][l]};
                    const BoxBasis<double> basis(box, place);
                    basis.each([&](std::size_t k, double value) {
                        for (int c = 0; c < weights.channels(); ++c)
                            weights.channel(c)[k] += value * weights.channel(c)[l];
                    });
                }
            }
        });
    }
    return weights;
}

// Adds the potentials of the grids of distant boxes at the points of a grid, for `channels` channels at once.
template <int channels>
void add_potentials(const SourceTree& targets, const SourceTree::Box& target, const SourceTree& sources,
                    const std::vector<Index>& boxes, const double* const* weights, double* const* out) {
    constexpr std::size_t width = SimdDouble::width;
    const auto load = [](const double* from) {
        SimdDouble pack;
        std::memcpy(&pack.lanes, from, sizeof pack.lanes);
        return pack;
    };
    for (std::size_t k = target.grid; k < target.grid + target.n_grid(); ++k) {
        const SimdDouble x(targets.grids()[0][k]), y(targets.grids()[1][k]), z(targets.grids()[2][k]);
        SimdDouble sums[channels];
        for (SimdDouble& each : sums) each = SimdDouble(0.0);
        for (const Index b : boxes) {
            const SourceTree::Box& source = sources.boxes()[b];
            for (std::size_t l = source.grid; l < source.grid + source.n_grid(); l += width) {
                const SimdDouble dx = x - load(&sources.grids()[0][l]), dy = y - load(&sources.grids()[1][l]),
                                 dz = z - load(&sources.grids()[2][l]);
                const SimdDouble inverse = inverse_root(dx * dx + dy * dy + dz * dz);
                for (int c = 0; c < channels; ++c) sums[c] += load(weights[c] + l) * inverse;
            }
        }
        for (int c = 0; c < channels; ++c)
            for (std::size_t lane = 0; lane < width; ++lane) out[c][k] += sums[c][static_cast<int>(lane)];
    }
}

template <class T>
GridNumbers<T> potentials_of(const SourceTree& targets, const SourceTree& sources, const BoxPairs& pairs,
                             const GridNumbers<T>& weights, bool has_currents) {
    GridNumbers<T> potentials(targets, has_currents);
    const double* from[8];
    double* to[8];
    for (int c = 0; c < weights.channels(); ++c) from[c] = weights.channel(c), to[c] = potentials.channel(c);
    parallel_for(static_cast<int>(targets.boxes().size()), [&](int number) {
        const SourceTree::Box& box = targets.boxes()[number];
        if (pairs.distant[number].empty()) return;
        constexpr int per = GridNumbers<T>::per;
        if (has_currents)
            add_potentials<4 * per>(targets, box, sources, pairs.distant[number], from, to);
        else
            add_potentials<per>(targets, box, sources, pairs.distant[number], from, to);
    });
    // Carries potentials from the grids of boxes to those of their children.
    for (std::size_t level = 1; level < targets.levels().size(); ++level) {
        const std::vector<Index>& boxes = targets.levels()[level];
        parallel_for(static_cast<int>(boxes.size()), [&](int number) {
            const SourceTree::Box& child = targets.boxes()[boxes[number]];
            const SourceTree::Box& box = targets.boxes()[child.parent];
            for (std::size_t l = child.grid; l < child.grid + child.n_grid(); ++l) {
                const Triple<double> place{targets.grids()[0][l], targets.grids()[1][l],
                                           targets.grids()[2][l]};
                const BoxBasis<double> basis(box, place);
                basis.each([&](std::size_t k, double value) {
                    for (int c = 0; c < potentials.channels(); ++c)
                        potentials.channel(c)[l] += value * potentials.channel(c)[k];
                });
            }
        });
    }
    return potentials;
}

}  // namespace

template <class T>
std::vector<SourceSums<T>> tree_sums(const SourceTree& targets, const std::vector<SourcePoint<T>>& at,
                                     const SourceTree& sources, const std::vector<SourcePoint<T>>& from,
                                     const BoxPairs& pairs, bool has_currents, bool same) {
    const GridNumbers<T> weights = weights_of(sources, from, has_currents);
    const GridNumbers<T> potentials = potentials_of(targets, sources, pairs, weights, has_currents);
    SourceArrays points;
    points.resize(from.size(), has_currents, std::is_same_v<T, Dual>);
    for (std::size_t k = 0; k < from.size(); ++k) points.set(k, from[k]);
    std::vector<SourceSums<T>> sums(at.size());
    parallel_for(static_cast<int>(targets.boxes().size()), [&](int number) {
        const SourceTree::Box& box = targets.boxes()[number];
        if (!box.is_leaf()) return;
        for (Index group = box.first; group < box.last; ++group)
            for (Index p = group * targets.group_size(); p < (group + 1) * targets.group_size(); ++p) {
                const SourcePoint<T>& point = at[p];
                SourceSums<T>& sum = sums[p];
                const BoxBasis<T> basis(box, point.at);
                // The pull is -grad (q V - c . A) with the potentials V and A of the other points.
                Triple<T> gradient;
                basis.interpolate([&](std::size_t k) { return potentials.at(0, k); }, sum.charges, gradient);
                sum.pull -= point.charge * gradient;
                if (has_currents) {
                    T* const currents[3] = {&sum.currents.x, &sum.currents.y, &sum.currents.z};
                    const T own[3] = {point.current.x, point.current.y, point.current.z};
                    for (int c = 0; c < 3; ++c) {
                        Triple<T> slope;
                        basis.interpolate([&](std::size_t k) { return potentials.at(c + 1, k); },
                                          *currents[c], slope);
                        sum.pull += own[c] * slope;
                    }
                }
                const std::size_t per_group = sources.group_size();
                const std::size_t skip = same ? group * per_group : 0;
                for (const Index b : pairs.near[number]) {
                    const SourceTree::Box& near = sources.boxes()[b];
                    points.add_sums(point, near.first * per_group, near.last * per_group, skip,
                                    same ? skip + per_group : 0, sum);
                }
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
