// The points of a triangle with a thickness at which a field that varies over it is sampled.
#pragma once

#include <array>

namespace magshell {

/// A point of a face: barycentric coordinates, height over the middle surface as a fraction of the thickness, and weight.
struct FacePoint {
    std::array<double, 3> at;
    double height, weight;
};

namespace face_points {

inline constexpr std::array<FacePoint, 1> barycenter = {{{{1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}, 0.0, 1.0}}};

/// Sixteen points that integrate polynomials of degree 8 over the triangle (Dunavant 1985), each on two levels, h/(2 sqrt 3) above and
/// below the middle surface, which integrate polynomials of degree 3 through the thickness (Gauss).
inline constexpr std::array<FacePoint, 32> fine = [] {
    constexpr double level = 0.28867513459481288;  // 1/(2 sqrt 3)
    std::array<FacePoint, 32> points{};
    int n = 0;
    const auto add = [&](double a, double b, double c, double weight) {
        for (const double height : {-level, level}) points[n++] = {{a, b, c}, height, 0.5 * weight};
    };
    add(1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.144315607677787);
    constexpr double two_equal[3][2] = {{0.459292588292723, 0.095091634267285},
                                        {0.170569307751760, 0.103217370534718},
                                        {0.050547228317031, 0.032458497623198}};
    for (const auto& [a, weight] : two_equal) {
        const double c = 1.0 - 2.0 * a;
        add(a, a, c, weight), add(a, c, a, weight), add(c, a, a, weight);
    }
    constexpr double a = 0.263112829634638, b = 0.008394777409958, c = 1.0 - a - b,
                     weight = 0.027230314174435;
    add(a, b, c, weight), add(b, c, a, weight), add(c, a, b, weight);
    add(b, a, c, weight), add(a, c, b, weight), add(c, b, a, weight);
    return points;
}();

}  // namespace face_points
}  // namespace magshell
