#include "magshell/obstacle/spline_grid.h"

#include <algorithm>
#include <utility>

namespace magshell {

std::vector<double> grid_coefficients(std::span<const double> values, std::span<const Index> samples) {
    std::vector<double> from(values.begin(), values.end());
    std::ptrdiff_t stride = 1;  // of the axis in `from`; the axes after it have n + 2 entries already
    for (std::size_t axis = samples.size(); axis-- > 0;) {
        const Index n = samples[axis];
        const std::ptrdiff_t lines = static_cast<std::ptrdiff_t>(from.size()) / n;
        std::vector<double> to(lines * (n + 2));
        std::vector<Vec4> line(n, Vec4(Vec4::Zero()));
        for (std::ptrdiff_t first = 0; first < lines;
             first += 4) {  // four lines at once go through the splines
            const int together = static_cast<int>(std::min<std::ptrdiff_t>(4, lines - first));
            const auto place = [&](int l, Index length, Index i) {
                const std::ptrdiff_t slab = (first + l) / stride, offset = (first + l) % stride;
                return (slab * length + i) * stride + offset;
            };
            for (Index i = 0; i < n; ++i)
                for (int l = 0; l < together; ++l) line[i][l] = from[place(l, n, i)];
            const std::vector<Vec4> mapped = spline_coefficients(line);
            for (Index i = 0; i < n + 2; ++i)
                for (int l = 0; l < together; ++l) to[place(l, n + 2, i)] = mapped[i][l];
        }
        from = std::move(to);
        stride *= n + 2;
    }
    return from;
}

}  // namespace magshell
