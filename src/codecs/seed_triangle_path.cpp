#include "codecs/seed_triangle_path.h"

#include <cmath>

#include "codecs/coded_streams.h"
#include "codecs/integer_contexts.h"

namespace batchenc {
namespace {

/// Levels of a coordinate of one vertex over time.
std::vector<std::int32_t> lattice_series(PositionsView positions, std::int32_t vertex, std::size_t coordinate,
                                         const FrameLattice& lattice) {
    std::vector<std::int32_t> series(static_cast<std::size_t>(positions.frame_count()));
    const double step = lattice.step();
    for (std::int64_t f = 0; f < positions.frame_count() && step > 0.0; ++f) {
        const double offset = static_cast<double>(positions.at(f, vertex)[coordinate]) -
                              static_cast<double>(lattice.center[coordinate]);
        series[static_cast<std::size_t>(f)] = static_cast<std::int32_t>(std::floor(offset / step + 0.5));
    }
    return series;
}

}  // namespace

SeedTrianglePath SeedTrianglePath::of(PositionsView positions, const Triangle& triangle,
                                      const FrameLattice& lattice) {
    SeedTrianglePath path;
    for (std::size_t c = 0; c < 3; ++c) {
        path.series[c] = lattice_series(positions, triangle[0], c, lattice);
        for (std::size_t corner = 1; corner < 3; ++corner) {
            auto& edge = path.series[3 * corner + c] =
                lattice_series(positions, triangle[corner], c, lattice);
            for (std::size_t f = 0; f < edge.size(); ++f) edge[f] -= path.series[c][f];
        }
    }
    return path;
}

std::array<double, 3> SeedTrianglePath::corner(std::size_t corner, std::int64_t frame,
                                               const FrameLattice& lattice) const {
    const auto f = static_cast<std::size_t>(frame);
    const double step = lattice.step();
    std::array<double, 3> point;
    for (std::size_t c = 0; c < 3; ++c) {
        const double level = static_cast<double>(series[c][f]) +
                             (corner == 0 ? 0.0 : static_cast<double>(series[3 * corner + c][f]));
        point[c] = static_cast<double>(lattice.center[c]) + level * step;
    }
    return point;
}

LocalFrameTrack SeedTrianglePath::track(const FrameLattice& lattice) const {
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
        const auto p1 = corner(0, f, lattice);
        const auto p2 = corner(1, f, lattice);
        lcf.origin = {0.5 * (p1[0] + p2[0]), 0.5 * (p1[1] + p2[1]), 0.5 * (p1[2] + p2[2])};
        track.set(f, lcf);
    }
    return track;
}

void write_corners(const std::vector<SeedTrianglePath>& paths, std::span<const Triangle> seed_triangles,
                   const FrameLattice& lattice, std::int64_t begin, MutablePositionsView out) {
    for (std::size_t i = paths.size(); i-- > 0;) {
        for (std::size_t corner = 0; corner < 3; ++corner) {
            for (std::int64_t f = 0; f < out.frame_count(); ++f) {
                const auto point = paths[i].corner(corner, begin + f, lattice);
                float* p = out.at(f, seed_triangles[i][corner]);
                for (std::size_t c = 0; c < 3; ++c) p[c] = static_cast<float>(point[c]);
            }
        }
    }
}

std::vector<std::uint8_t> write_paths(const std::vector<SeedTrianglePath>& paths, std::int64_t frame_count,
                                      const Executor& executor) {
    ByteWriter out;
    const std::vector<std::int64_t> values(paths.size(), 9 * frame_count);
    append_streams(out, deal_streams(values), executor, [&](const auto& clusters) {
        RangeEncoder encoder;
        SeriesContexts contexts;
        for (const std::int32_t i : clusters) {
            for (const auto& series : paths[static_cast<std::size_t>(i)].series)
                encode_series(encoder, contexts, series);
        }
        return encoder.finish();
    });
    return out.take();
}

Expected<std::vector<SeedTrianglePath>> read_paths(std::span<const std::uint8_t> payload,
                                                   std::size_t path_count, std::int64_t frame_count,
                                                   std::int32_t frame_bits, const Executor& executor) {
    ByteReader reader(payload);
    const std::vector<std::int64_t> values(path_count, 9 * frame_count);
    const Streams streams = deal_streams(values);
    const auto parts = split_streams(reader, streams, values);
    if (!parts) return tl::unexpected(parts.error());
    std::vector<SeedTrianglePath> paths(path_count);
    const std::int64_t limit = std::int64_t{4}
                               << frame_bits;  // edges reach twice across the box; both keep int32 safe
    auto decoded =
        decode_streams(*parts, streams, true, executor, [&](RangeDecoder& decoder, const auto& clusters) {
            SeriesContexts contexts;
            for (const std::int32_t i : clusters) {
                for (auto& series : paths[static_cast<std::size_t>(i)].series) {
                    series.resize(static_cast<std::size_t>(frame_count));
                    if (!decode_series(decoder, contexts, series)) return false;
                    for (const std::int32_t level : series) {
                        if (level > limit || level < -limit) return false;
                    }
                }
            }
            return true;
        });
    if (!decoded) return tl::unexpected(decoded.error());
    return paths;
}

}  // namespace batchenc
