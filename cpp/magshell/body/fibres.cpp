#include "magshell/body/fibres.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "magshell/core/errors.h"

namespace magshell {

Fibres::Fibres(const Solid& solid_, const std::vector<Index>& given) : solid(solid_) {
    std::vector<Index> order(given.size());
    std::iota(order.begin(), order.end(), 0);
    for (const Index user : given)
        if (user < 0 || user >= solid.n_elements())
            throw InvalidInput(solid.owner + " has no element " + std::to_string(user));
    const auto number = [&](Index k) { return solid.elements.core[given[k]]; };
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return number(a) < number(b); });
    for (const Index k : order) {
        if (!of_solid.empty() && of_solid.back() == number(k))
            throw InvalidInput("element " + std::to_string(given[k]) + " of " + solid.owner +
                               " is given to one muscle twice");
        of_solid.push_back(number(k));
        if (solid.quadratic())
            quadratic_nodes.push_back(solid.quadratic_nodes[number(k)]);
        else
            linear_nodes.push_back(solid.linear_nodes[number(k)]);
    }
    elements = Renumbering::from_user_order(std::move(order));
}

}  // namespace magshell
