#pragma once

#include <cstdint>
#include <span>

#include "core/executor.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Puts the vertices of every frame into another order: vertex v becomes what sources[v] was. sources: V
/// indices, each once; none leaves the frames as they are.
void reorder_vertices(MutablePositionsView frames, std::span<const std::int32_t> sources,
                      const Executor& executor);

}  // namespace batchenc
