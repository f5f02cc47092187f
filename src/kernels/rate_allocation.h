#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace batchenc {

// Sharing a rate out between sources that are coded on their own (Amjoun, section 6.5; Y. Shoham and A.
// Gersho, "Efficient bit allocation for an arbitrary set of quantizers", 1988): only points on the lower
// convex hull of a source's rates and distortions are worth taking, and of all sources' next points the one
// that takes most distortion away for its rate is taken first. Distortions have to add up, so they are
// squared errors.

/// One way to code a source.
struct RatePoint {
    double rate = 0.0;        ///< any unit, the same for all sources
    double distortion = 0.0;  ///< squared error
};

/// Indices of the points on the lower convex hull, from the first point to the one of least distortion;
/// rates rise and distortions fall from each to the next, ever less for their rate. points: at least one, in
/// any order but that the first one's rate is the least, and below that of all others.
std::vector<std::size_t> lower_hull(std::span<const RatePoint> points);

/// One source goes from a point of its hull to the next.
struct AllocationStep {
    std::int32_t source = 0;
    std::int32_t point = 0;   ///< index of the point that it then has
    double rate = 0.0;        ///< what it costs, above 0
    double distortion = 0.0;  ///< what it takes away, above 0
    double steepness() const { return distortion / rate; }
};

/// The steps of all sources from their first points on, the steepest first; each source's own in their order,
/// and equal ones by source. Taking the first k of them is the least distortion for the rate that they cost.
/// sources: the points of each, at least one, as lower_hull wants them.
std::vector<AllocationStep> steepest_first(const std::vector<std::vector<RatePoint>>& sources);

}  // namespace batchenc
