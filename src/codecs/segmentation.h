#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "core/parameters.h"

namespace batchenc {

/// A division of the vertices of a clip into clusters, each with the seed triangle that carries its LCF.
struct Segmentation {
    std::vector<std::int32_t> labels;      ///< V values, cluster of each vertex, 0 … N-1
    std::vector<Triangle> seed_triangles;  ///< N triples of vertex indices; with region growing and
                                           ///< clusterings of a mesh, triangles of it
    std::vector<float>
        deviations;  ///< V values: theta of each vertex in its own cluster (4.1), world units squared
    std::vector<double> cluster_deviations;  ///< N values: average deviation of each cluster (4.7), world
                                             ///< units squared a frame; see average_deviation()
    std::vector<std::string>
        notes;  ///< what a user should know, such as a seed triangle that had to be replaced

    std::int32_t cluster_count() const { return static_cast<std::int32_t>(seed_triangles.size()); }

    /// The average deviation over all clusters (4.7), world units squared a frame: the mean of
    /// cluster_deviations, of which each is sum of theta / (F n) over the n vertices of the cluster that are
    /// no corners of a seed triangle, 0 where there are none.
    double average_deviation() const;
};

/// Segments a clip (chapter 4). positions: F x V, F and V at least 1, finite. triangles: may be empty
/// (points). The result does not depend on the executor. Errors: kInvalidArgument (see check_parameters).
Expected<Segmentation> segment_clip(PositionsView positions, std::span<const Triangle> triangles,
                                    const SegmentationParameters& parameters, const Executor& executor);

}  // namespace batchenc
