#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Clusters of vertices whose trajectories lie near one subspace each (M. Sattler, R. Sarlette and R. Klein,
/// "Simple and efficient compression of animation sequences", 2005; N. Kambhatla and T. Leen, "Dimension
/// reduction by local principal component analysis", 1997): Lloyd's iterations, in which every cluster is
/// described by the leading components of its vertices' coordinates along time, each about its mean, and
/// every vertex goes to the cluster that describes it best, of equal ones to the first. Ends when no vertex
/// moves or after ten rounds.
struct TrajectoryClusters {
    std::vector<std::int32_t> labels;  ///< V values, none of them left out
    std::int32_t count = 0;            ///< of clusters; those that became empty are gone

    /// positions: F × V. labels: V values, the clusters to start from. components: of a cluster at most. The
    /// result does not depend on the executor. Errors: kNotFinite, kNumerical.
    static Expected<TrajectoryClusters> of(PositionsView positions, std::span<const std::int32_t> labels,
                                           std::int32_t cluster_count, std::int64_t components,
                                           const Executor& executor);
};

}  // namespace batchenc
