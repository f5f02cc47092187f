#include "codecs/baselines/skinning.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "kernels/range_coder.h"

namespace batchenc {

Skinning::Skinning(std::span<const std::int32_t> labels, std::int32_t cluster_count,
                   const MeshAdjacency& adjacency)
    : neighbours(static_cast<std::size_t>(cluster_count)), weights(labels.size()) {
    std::vector<std::pair<std::int32_t, std::int32_t>> edges;
    for (std::size_t v = 0; v + 1 < adjacency.first.size(); ++v) {
        for (std::int32_t k = adjacency.first[v]; k < adjacency.first[v + 1]; ++k) {
            const std::int32_t u = adjacency.neighbours[static_cast<std::size_t>(k)];
            const std::int32_t a = labels[v], b = labels[static_cast<std::size_t>(u)];
            if (a == b) continue;
            edges.emplace_back(a, b);
            edges.emplace_back(b, a);
        }
    }
    std::sort(edges.begin(), edges.end());
    std::vector<std::tuple<std::int32_t, std::int64_t, std::int32_t>> joined;  // cluster, -edges, neighbour
    for (auto it = edges.begin(); it != edges.end();) {
        const auto end = std::upper_bound(it, edges.end(), *it);
        joined.emplace_back(it->first, -(end - it), it->second);
        it = end;
    }
    std::sort(joined.begin(), joined.end());
    for (const auto& [cluster, count, neighbour] : joined) {
        auto& list = neighbours[static_cast<std::size_t>(cluster)];
        if (list.size() < kMostNeighbours) list.push_back(neighbour);
    }
}

template <typename Code>
void Skinning::code(std::span<const std::int32_t> labels, const MeshTraversal& traversal, Code code) {
    constexpr std::size_t kSizes = 11;
    std::vector<IntegerModel> models;
    for (std::size_t k = 0; k < kMostNeighbours * kSizes; ++k)
        models.emplace_back(std::ldexp(0.3, static_cast<int>(k % kSizes)));
    std::vector<Weights> last(neighbours.size());
    for (const std::int32_t v : traversal.order) {
        const auto cluster = static_cast<std::size_t>(labels[static_cast<std::size_t>(v)]);
        Weights& own = weights[static_cast<std::size_t>(v)];
        for (std::size_t k = 0; k < neighbours[cluster].size(); ++k) {
            const auto bits = static_cast<std::uint32_t>(last[cluster][k]);
            const std::uint32_t magnitude = last[cluster][k] < 0 ? 0u - bits : bits;
            const auto size =
                std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(magnitude)), kSizes - 1);
            own[k] = code(models[k * kSizes + size], own[k]);
        }
        last[cluster] = own;
    }
}

std::vector<std::uint8_t> Skinning::write(std::span<const std::int32_t> labels,
                                          const MeshTraversal& traversal) const {
    RangeEncoder encoder;
    Skinning copy = *this;
    copy.code(labels, traversal, [&](IntegerModel& model, std::int32_t value) {
        encoder.encode(model, value);
        return value;
    });
    return encoder.finish();
}

Expected<void> Skinning::read(std::span<const std::uint8_t> bytes, std::span<const std::int32_t> labels,
                              const MeshTraversal& traversal) {
    const bool is_empty =
        std::all_of(neighbours.begin(), neighbours.end(), [](const auto& list) { return list.empty(); });
    if (is_empty) {
        if (bytes.empty()) return {};
        return fail(ErrorCode::kCorrupt, "weights where no clusters are joined");
    }
    auto decoder = RangeDecoder::open(bytes);
    if (!decoder) return tl::unexpected(decoder.error());
    code(labels, traversal, [&](IntegerModel& model, std::int32_t) { return decoder->decode(model); });
    return decoder->finish();
}

}  // namespace batchenc
