#include "pipeline/vertex_order.h"

#include <algorithm>
#include <vector>

namespace batchenc {

void reorder_vertices(MutablePositionsView frames, std::span<const std::int32_t> sources,
                      const Executor& executor) {
    if (sources.empty()) return;
    executor.for_each(frames.frame_count(), [&](std::int64_t f) {
        const std::vector<float> source(frames.at(f, 0), frames.at(f, frames.vertex_count()));
        for (std::size_t v = 0; v < sources.size(); ++v)
            std::copy_n(source.data() + 3 * static_cast<std::size_t>(sources[v]), 3,
                        frames.at(f, static_cast<std::int64_t>(v)));
    });
}

}  // namespace batchenc
