#include "magshell/energy/face_pressure.h"

#include <cmath>

namespace magshell {
namespace {

using Vec2 = Eigen::Vector2d;

/// Shape functions of a triangle with corners (0, 0), (1, 0), (0, 1), and their derivatives with respect to s and t.
template <int N>
struct Shapes {
    double value[N];
    Vec2 slope[N];

    explicit Shapes(const Vec2& at) {
        const double corner[3] = {1.0 - at.x() - at.y(), at.x(), at.y()};
        const Vec2 along[3] = {{-1.0, -1.0}, {1.0, 0.0}, {0.0, 1.0}};
        for (int k = 0; k < 3; ++k) {
            value[k] = N == 3 ? corner[k] : corner[k] * (2.0 * corner[k] - 1.0);
            slope[k] = N == 3 ? along[k] : Vec2((4.0 * corner[k] - 1.0) * along[k]);
        }
        for (int k = 3; k < N; ++k) {
            const int i = k - 3, j = (i + 1) % 3;
            value[k] = 4.0 * corner[i] * corner[j];
            slope[k] = 4.0 * (corner[i] * along[j] + corner[j] * along[i]);
        }
    }
};

/// Adds the integral over the triangle a, b, c of the parameter plane, by a 3 x 3 Gauss rule in the unit square
/// mapped onto the triangle. It is exact to fourth degree, which is the degree of the integrand of six nodes.
template <int N>
void integrate(const Vec2& a, const Vec2& b, const Vec2& c,
               typename FacePressure<N>::Coefficients& coefficients) {
    const double off = 0.5 * std::sqrt(0.6), points[3] = {0.5 - off, 0.5, 0.5 + off};
    const double weights[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    const Vec2 ab = b - a, ac = c - a;
    const double area2 = ab.x() * ac.y() - ab.y() * ac.x();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const double u = points[i], v = (1.0 - u) * points[j];
            const Shapes<N> shapes(a + u * ab + v * ac);
            const double weight = weights[i] * weights[j] * (1.0 - u) * area2;
            for (int k = 0; k < N; ++k)
                for (int l = 0, pair = 0; l < N; ++l)
                    for (int m = l + 1; m < N; ++m, ++pair) {
                        const Vec2 &of_l = shapes.slope[l], &of_m = shapes.slope[m];
                        coefficients[k][pair] +=
                            weight * shapes.value[k] * (of_l.x() * of_m.y() - of_m.x() * of_l.y());
                    }
        }
}

template <int N>
std::array<typename FacePressure<N>::Coefficients, FacePressure<N>::parts> integrated() {
    std::array<typename FacePressure<N>::Coefficients, FacePressure<N>::parts> parts{};
    const Vec2 nodes[6] = {{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {0.5, 0.0}, {0.5, 0.5}, {0.0, 0.5}};
    // The four flat triangles that a curved face is shown as, in the same order as for faces of ten-node
    // tetrahedra.
    const int flat[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
    if constexpr (N == 3)
        integrate<N>(nodes[0], nodes[1], nodes[2], parts[0]);
    else
        for (int part = 0; part < 4; ++part)
            integrate<N>(nodes[flat[part][0]], nodes[flat[part][1]], nodes[flat[part][2]], parts[part]);
    return parts;
}

}  // namespace

template <int N>
const std::array<typename FacePressure<N>::Coefficients, FacePressure<N>::parts>&
FacePressure<N>::of_parts() {
    static const std::array<Coefficients, parts> known = integrated<N>();
    return known;
}

template struct FacePressure<3>;
template struct FacePressure<6>;

}  // namespace magshell
