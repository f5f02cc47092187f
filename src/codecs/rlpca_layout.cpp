#include "codecs/rlpca_layout.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <queue>

#include "kernels/byte_stream.h"

namespace batchenc {
namespace {

constexpr std::int64_t kValuesPerStream = 65536;

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

std::vector<std::uint8_t> RlpcaHeader::write() const {
    ByteWriter out;
    out.put(static_cast<std::uint8_t>(space));
    out.put(static_cast<std::uint8_t>(basis_bits));
    out.put(static_cast<std::uint8_t>(coefficient_bits));
    out.put(static_cast<std::uint8_t>(frame_bits));
    out.put_varint(static_cast<std::uint64_t>(components));
    out.put_varint(static_cast<std::uint64_t>(cluster_count));
    for (const float value : center) out.put(value);
    out.put(e_max);
    return out.take();
}

Expected<RlpcaHeader> RlpcaHeader::read(std::span<const std::uint8_t> payload, std::int64_t vertex_count) {
    ByteReader reader(payload);
    const auto space = reader.get<std::uint8_t>();
    const auto basis_bits = reader.get<std::uint8_t>();
    const auto coefficient_bits = reader.get<std::uint8_t>();
    const auto frame_bits = reader.get<std::uint8_t>();
    if (!frame_bits) return tl::unexpected(frame_bits.error());
    const auto components = reader.get_varint(4096);
    if (!components) return tl::unexpected(components.error());
    const auto clusters =
        reader.get_varint(std::min<std::uint64_t>(65535, static_cast<std::uint64_t>(vertex_count)));
    if (!clusters) return tl::unexpected(clusters.error());
    RlpcaHeader header;
    const auto center = reader.get_array<float, 3>();
    const auto e_max = reader.get<float>();
    if (!e_max) return tl::unexpected(e_max.error());
    header.center = *center;  // there, since what follows it is
    if (*space > 1) return corrupt("the coordinate space is unknown");
    header.space = static_cast<CoordinateSpace>(*space);
    header.basis_bits = *basis_bits;
    header.coefficient_bits = *coefficient_bits;
    header.frame_bits = *frame_bits;
    header.components = static_cast<std::int32_t>(*components);
    header.cluster_count = static_cast<std::int32_t>(*clusters);
    header.e_max = *e_max;
    const bool finite = std::isfinite(header.center[0]) && std::isfinite(header.center[1]) &&
                        std::isfinite(header.center[2]) && std::isfinite(header.e_max) &&
                        header.e_max >= 0.0f;
    CodecParameters parameters;
    parameters.components = header.components;
    parameters.basis_bits = header.basis_bits;
    parameters.coefficient_bits = header.coefficient_bits;
    parameters.frame_bits = header.frame_bits;
    if (!finite || header.cluster_count == 0 || !check_parameters(parameters))
        return corrupt("a parameter is outside its range");
    if (reader.remaining() != 0) return corrupt("bytes left over");
    return header;
}

LocalFrameTrack RlpcaHeader::world_track(std::int64_t frame_count) const {
    LocalFrame world;
    for (std::size_t c = 0; c < 3; ++c) world.origin[c] = static_cast<double>(center[c]);
    LocalFrameTrack track(frame_count);
    for (std::int64_t f = 0; f < frame_count; ++f) track.set(f, world);
    return track;
}

RlpcaLayout::RlpcaLayout(std::span<const std::int32_t> labels, std::span<const Triangle> seed_triangles,
                         std::int32_t cluster_count, const MeshAdjacency& adjacency, const Executor& executor)
    : owner(labels.begin(), labels.end()), clusters(static_cast<std::size_t>(cluster_count)) {
    for (const Triangle& t : seed_triangles) {
        for (const std::int32_t v : t) owner[static_cast<std::size_t>(v)] = -1;
    }
    std::vector<std::vector<std::int32_t>> members(clusters.size());
    for (std::size_t v = 0; v < owner.size(); ++v) {
        if (owner[v] >= 0)
            members[static_cast<std::size_t>(owner[v])].push_back(static_cast<std::int32_t>(v));
    }
    std::vector<std::int32_t> position(owner.size(), -1);
    executor.for_each(cluster_count, [&](std::int64_t i) {
        clusters[static_cast<std::size_t>(i)] = traverse_cluster(
            adjacency, members[static_cast<std::size_t>(i)], owner, static_cast<std::int32_t>(i), position);
    });
}

std::vector<std::vector<std::int32_t>> deal_streams(std::span<const std::int64_t> values_of_cluster) {
    const std::int64_t total =
        std::accumulate(values_of_cluster.begin(), values_of_cluster.end(), std::int64_t{0});
    const auto clusters = static_cast<std::int64_t>(values_of_cluster.size());
    const auto count = static_cast<std::size_t>(
        std::clamp((total + kValuesPerStream / 2) / kValuesPerStream, std::int64_t{1}, clusters));
    std::vector<std::int32_t> by_size(values_of_cluster.size());
    std::iota(by_size.begin(), by_size.end(), 0);
    std::stable_sort(by_size.begin(), by_size.end(), [&](std::int32_t a, std::int32_t b) {
        return values_of_cluster[static_cast<std::size_t>(a)] >
               values_of_cluster[static_cast<std::size_t>(b)];
    });
    std::vector<std::vector<std::int32_t>> streams(count);
    using Load = std::pair<std::int64_t, std::size_t>;  // values dealt so far, stream: the least loaded, then
                                                        // the first, on top
    std::priority_queue<Load, std::vector<Load>, std::greater<>> loads;
    for (std::size_t stream = 0; stream < count; ++stream) loads.emplace(0, stream);
    for (const std::int32_t i : by_size) {
        const auto [load, stream] = loads.top();
        loads.pop();
        streams[stream].push_back(i);
        loads.emplace(load + values_of_cluster[static_cast<std::size_t>(i)], stream);
    }
    return streams;
}

std::array<double, 3> SeedTrianglePath::corner(std::size_t corner, std::int64_t frame,
                                               const RlpcaHeader& header) const {
    const auto f = static_cast<std::size_t>(frame);
    const double step = header.lattice_step();
    std::array<double, 3> point;
    for (std::size_t c = 0; c < 3; ++c) {
        const double level = static_cast<double>(series[c][f]) +
                             (corner == 0 ? 0.0 : static_cast<double>(series[3 * corner + c][f]));
        point[c] = static_cast<double>(header.center[c]) + level * step;
    }
    return point;
}

LocalFrameTrack SeedTrianglePath::track(const RlpcaHeader& header) const {
    const auto frames = static_cast<std::int64_t>(series[0].size());
    LocalFrameTrack track(frames);
    LocalFrame lcf;
    for (std::int64_t f = 0; f < frames; ++f) {
        // The rotation from lattice differences, which doubles hold exactly; the origin from the corners in
        // the world.
        const auto edge = [&](std::size_t k) {
            return std::array<double, 3>{static_cast<double>(series[k][static_cast<std::size_t>(f)]),
                                         static_cast<double>(series[k + 1][static_cast<std::size_t>(f)]),
                                         static_cast<double>(series[k + 2][static_cast<std::size_t>(f)])};
        };
        lcf = local_frame({0.0, 0.0, 0.0}, edge(3), edge(6), lcf);
        const auto p1 = corner(0, f, header);
        const auto p2 = corner(1, f, header);
        lcf.origin = {0.5 * (p1[0] + p2[0]), 0.5 * (p1[1] + p2[1]), 0.5 * (p1[2] + p2[2])};
        track.set(f, lcf);
    }
    return track;
}

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

}  // namespace batchenc
