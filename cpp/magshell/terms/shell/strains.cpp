#include "magshell/terms/shell/strains.h"

namespace magshell {

void StrainSet::add(double factor, const StrainSet& other) {
    if (of_terms.empty())
        for (const Strains& part : other.of_terms) of_terms.emplace_back(part.elements, part.width);
    for (std::size_t t = 0; t < other.of_terms.size(); ++t)
        for (std::size_t k = 0; k < of_terms[t].groups.size(); ++k)
            of_terms[t].groups[k] += SimdDouble(factor) * other.of_terms[t].groups[k];
}

StrainSet StrainSet::times(double factor) const {
    StrainSet product;
    product.add(factor, *this);
    return product;
}

double StrainSet::dot(const StrainSet& other) const {
    double sum = 0.0;
    for (std::size_t t = 0; t < of_terms.size(); ++t)
        for (Index element = 0; element < of_terms[t].elements; ++element)
            for (int i = 0; i < of_terms[t].width; ++i)
                sum += of_terms[t].number(element, i) * other.of_terms[t].number(element, i);
    return sum;
}

std::size_t StrainSet::bytes() const {
    std::size_t total = 0;
    for (const Strains& part : of_terms) total += bytes_of(part.groups);
    return total;
}

}  // namespace magshell
