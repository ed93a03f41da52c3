#include "magshell/terms/magnetic/field_sources.h"

#include <algorithm>
#include <string>

namespace magshell {

FieldSources::FieldSources(const std::vector<std::shared_ptr<const AppliedField>>& sources,
                           Registry& registry) {
    for (const std::shared_ptr<const AppliedField>& given : sources) {
        const std::string owner = "field " + std::to_string(sources_.size());
        Source& source = sources_.emplace_back();
        for (const FieldParameter& p : given->parameters())
            source.slices.push_back(
                registry.values.add(owner, std::string(p.name), std::string(p.unit), p.rows, p.width));
        if (!source.slices.empty()) source.own = given->clone();
        source.field = source.own ? source.own : given;
    }
}

void FieldSources::set_values(const Values& values) {
    for (Source& source : sources_) {
        const bool changed = std::any_of(source.slices.begin(), source.slices.end(),
                                         [&](const ParameterSlice& slice) { return values.changed(slice); });
        if (changed)
            source.own->set_values({values[source.slices.front()], static_cast<std::size_t>(source.count())});
    }
}

void FieldSources::add_samples(std::span<const Vec3> points, std::span<const Vec3> moments, int order,
                               double scale, FieldSamples& out) const {
    for (const Source& source : sources_) source.field->add_samples(points, moments, order, scale, out);
}

void FieldSources::add_vjp(std::span<const Vec3> points, const FieldProbe& probe, double scale,
                           Gradient& out) const {
    for (const Source& source : sources_)
        if (source.own)
            source.own->add_vjp(
                points, probe, scale,
                {out.values.data() + source.slices.front().first, static_cast<std::size_t>(source.count())});
}

}  // namespace magshell
