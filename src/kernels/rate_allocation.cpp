#include "kernels/rate_allocation.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace batchenc {
namespace {

AllocationStep step_between(std::span<const RatePoint> points, std::size_t from, std::size_t to) {
    return {.source = 0,
            .point = static_cast<std::int32_t>(to),
            .rate = points[to].rate - points[from].rate,
            .distortion = points[from].distortion - points[to].distortion};
}

}  // namespace

std::vector<std::size_t> lower_hull(std::span<const RatePoint> points) {
    std::vector<std::size_t> by_rate(points.size());
    std::iota(by_rate.begin(), by_rate.end(), std::size_t{0});
    std::stable_sort(by_rate.begin() + 1, by_rate.end(), [&](std::size_t a, std::size_t b) {
        return std::tie(points[a].rate, points[a].distortion) <
               std::tie(points[b].rate, points[b].distortion);
    });
    std::vector<std::size_t> hull;
    for (const std::size_t i : by_rate) {
        if (!hull.empty() && points[i].distortion >= points[hull.back()].distortion) continue;
        while (hull.size() > 1) {
            const std::size_t last = hull.back(), before = hull[hull.size() - 2];
            if (step_between(points, before, last).steepness() >= step_between(points, last, i).steepness())
                break;
            hull.pop_back();
        }
        hull.push_back(i);
    }
    return hull;
}

std::vector<AllocationStep> steepest_first(const std::vector<std::vector<RatePoint>>& sources) {
    std::vector<AllocationStep> steps;
    for (std::size_t s = 0; s < sources.size(); ++s) {
        const auto hull = lower_hull(sources[s]);
        for (std::size_t k = 1; k < hull.size(); ++k) {
            steps.push_back(step_between(sources[s], hull[k - 1], hull[k]));
            steps.back().source = static_cast<std::int32_t>(s);
        }
    }
    std::stable_sort(steps.begin(), steps.end(), [](const AllocationStep& a, const AllocationStep& b) {
        return a.steepness() > b.steepness();
    });
    return steps;
}

}  // namespace batchenc
