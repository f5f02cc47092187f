#include "codecs/coded_segmentation.h"

#include <array>

#include "kernels/range_coder.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

/// Labels of neighbours that precede a vertex: the first, and the first that differs from it; -1 where there
/// is none. The vertex before stands in where the mesh knows no neighbour.
struct LabelGuess {
    std::int32_t first = -1;
    std::int32_t second = -1;
};

LabelGuess guess_label(const MeshAdjacency& adjacency, std::span<const std::int32_t> labels,
                       std::int64_t vertex) {
    LabelGuess guess;
    const auto v = static_cast<std::size_t>(vertex);
    for (std::int32_t k = adjacency.first[v]; k < adjacency.first[v + 1]; ++k) {
        const std::int32_t w = adjacency.neighbours[static_cast<std::size_t>(k)];
        if (w >= vertex) continue;
        const std::int32_t label = labels[static_cast<std::size_t>(w)];
        if (guess.first < 0) {
            guess.first = label;
        } else if (label != guess.first) {
            guess.second = label;
            break;
        }
    }
    if (guess.first < 0) guess.first = vertex > 0 ? labels[v - 1] : 0;
    return guess;
}

/// Contexts of label coding; symbols are 0 for the first guess, 1 for the second, 2 + label for any other.
struct LabelContexts {
    IntegerModel agreed{0.1};
    IntegerModel disputed{0.5};
    IntegerModel& of(const LabelGuess& guess) { return guess.second < 0 ? agreed : disputed; }
};

}  // namespace

std::vector<std::uint8_t> write_segmentation(std::span<const std::int32_t> labels,
                                             std::span<const Triangle> seed_triangles,
                                             std::int32_t cluster_count, const MeshAdjacency& adjacency) {
    RangeEncoder encoder;
    LabelContexts contexts;
    for (std::size_t v = 0; v < labels.size(); ++v) {
        const LabelGuess guess = guess_label(adjacency, labels, static_cast<std::int64_t>(v));
        encoder.encode(contexts.of(guess), labels[v] == guess.first    ? 0
                                           : labels[v] == guess.second ? 1
                                                                       : 2 + labels[v]);
    }
    // A seed triangle belongs to its cluster's number in order; its vertices are near each other in most
    // files.
    IntegerModel first(static_cast<double>(labels.size()) / (cluster_count + 1)), other(64.0);
    std::int32_t last = 0;
    for (const Triangle& t : seed_triangles) {
        encoder.encode(first, t[0] - last);
        encoder.encode(other, t[1] - t[0]);
        encoder.encode(other, t[2] - t[0]);
        last = t[0];
    }
    return encoder.finish();
}

Expected<CodedSegmentation> read_segmentation(std::span<const std::uint8_t> payload,
                                              std::int64_t vertex_count, std::int32_t cluster_count,
                                              std::int32_t seed_triangle_count,
                                              const MeshAdjacency& adjacency) {
    if (static_cast<std::uint64_t>(vertex_count) > max_symbol_count(payload.size()))
        return corrupt("more vertices than the bytes can hold");
    auto decoder = RangeDecoder::open(payload);
    if (!decoder) return tl::unexpected(decoder.error());
    CodedSegmentation segmentation;
    segmentation.labels.resize(static_cast<std::size_t>(vertex_count));
    LabelContexts contexts;
    for (std::int64_t v = 0; v < vertex_count; ++v) {
        const LabelGuess guess = guess_label(adjacency, segmentation.labels, v);
        const std::int32_t symbol = decoder->decode(contexts.of(guess));
        const std::int32_t label = symbol == 0   ? guess.first
                                   : symbol == 1 ? guess.second
                                   : symbol >= 2 ? symbol - 2
                                                 : -1;
        if (label < 0 || label >= cluster_count) return corrupt("a label names no cluster");
        segmentation.labels[static_cast<std::size_t>(v)] = label;
    }
    IntegerModel first(static_cast<double>(vertex_count) / (cluster_count + 1)), other(64.0);
    std::int64_t last = 0;
    for (std::int32_t i = 0; i < seed_triangle_count; ++i) {
        std::array<std::int64_t, 3> t;
        t[0] = last + decoder->decode(first);
        t[1] = t[0] + decoder->decode(other);
        t[2] = t[0] + decoder->decode(other);
        for (const std::int64_t v : t) {
            if (v < 0 || v >= vertex_count) return corrupt("a seed triangle names no vertex");
        }
        segmentation.seed_triangles.push_back({static_cast<std::int32_t>(t[0]),
                                               static_cast<std::int32_t>(t[1]),
                                               static_cast<std::int32_t>(t[2])});
        last = t[0];
    }
    if (auto end = decoder->finish(); !end) return tl::unexpected(end.error());
    return segmentation;
}

ClusterMembers::ClusterMembers(std::span<const std::int32_t> labels, std::span<const Triangle> seed_triangles,
                               std::int32_t cluster_count)
    : owner(labels.begin(), labels.end()), members(static_cast<std::size_t>(cluster_count)) {
    for (const Triangle& t : seed_triangles) {
        for (const std::int32_t v : t) owner[static_cast<std::size_t>(v)] = -1;
    }
    for (std::size_t v = 0; v < owner.size(); ++v) {
        if (owner[v] >= 0)
            members[static_cast<std::size_t>(owner[v])].push_back(static_cast<std::int32_t>(v));
    }
}

}  // namespace batchenc
