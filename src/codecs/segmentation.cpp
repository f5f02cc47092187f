#include "codecs/segmentation.h"

#include <algorithm>

#include "kernels/deviation.h"
#include "kernels/seeds.h"

namespace batchenc {
namespace {

LocalFrameTrack track_of(PositionsView positions, const Triangle& triangle) {
    LocalFrameTrack track(positions.frame_count());
    LocalFrame lcf;
    for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
        const auto point = [&](std::size_t k) {
            const float* p = positions.at(f, triangle[k]);
            return std::array<double, 3>{p[0], p[1], p[2]};
        };
        lcf = local_frame(point(0), point(1), point(2), lcf);
        track.set(f, lcf);
    }
    return track;
}

double squared_distance(PositionsView positions, std::int64_t a, std::int64_t b) {
    double sum = 0.0;
    for (int c = 0; c < 3; ++c) {
        const double d = static_cast<double>(positions.at(0, a)[c]) - positions.at(0, b)[c];
        sum += d * d;
    }
    return sum;
}

}  // namespace

Expected<Segmentation> segment_clip(PositionsView positions, std::span<const Triangle> triangles,
                                    const SegmentationParameters& parameters, const Executor& executor) {
    if (auto valid = check_parameters(parameters); !valid) return tl::unexpected(valid.error());
    const std::int64_t vertex_count = positions.vertex_count();
    const std::vector<std::int32_t> seeds = farthest_point_seeds(positions.frames(0, 1), parameters.clusters);
    const std::vector<SeedTriangle> chosen = choose_seed_triangles(positions, triangles, seeds, executor);

    Segmentation segmentation;
    segmentation.labels.resize(static_cast<std::size_t>(vertex_count));
    segmentation.deviations.resize(static_cast<std::size_t>(vertex_count));
    if (static_cast<std::int32_t>(seeds.size()) < parameters.clusters) {
        segmentation.notes.push_back("only " + std::to_string(seeds.size()) +
                                     " clusters: the first frame has no more distinct points");
    }
    std::vector<LocalFrameTrack> tracks;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
        segmentation.seed_triangles.push_back(chosen[i].vertices);
        tracks.push_back(track_of(positions, chosen[i].vertices));
        if (chosen[i].degenerate) {
            segmentation.notes.push_back(
                "cluster " + std::to_string(i) +
                " has no triangle that keeps an area; its axes stand still while there is none");
        } else if (chosen[i].replaced) {
            segmentation.notes.push_back("cluster " + std::to_string(i) +
                                         " takes its seed triangle from elsewhere: those at vertex " +
                                         std::to_string(seeds[i]) + " collapse");
        }
    }

    // A task per block of vertices. Equal deviations (a single frame, a clip that does not move) go to the
    // nearest seed.
    const std::int64_t blocks = (vertex_count + kDeviationBlock - 1) / kDeviationBlock;
    executor.for_each(blocks, [&](std::int64_t block) {
        thread_local std::vector<float> theta, scratch;
        theta.resize(static_cast<std::size_t>(kDeviationBlock) * tracks.size());
        scratch.resize(static_cast<std::size_t>(deviation_scratch_size()));
        const std::int64_t first = block * kDeviationBlock;
        deviation_block(positions, first, tracks, theta, scratch);
        for (std::int64_t v = first; v < std::min(first + kDeviationBlock, vertex_count); ++v) {
            const auto theta_of = [&](std::size_t i) {
                return theta[i * kDeviationBlock + static_cast<std::size_t>(v - first)];
            };
            std::size_t best = 0;
            for (std::size_t i = 1; i < tracks.size(); ++i) {
                if (theta_of(i) < theta_of(best) ||
                    (theta_of(i) == theta_of(best) && squared_distance(positions, v, seeds[i]) <
                                                          squared_distance(positions, v, seeds[best]))) {
                    best = i;
                }
            }
            segmentation.labels[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(best);
            segmentation.deviations[static_cast<std::size_t>(v)] = theta_of(best);
        }
    });
    // A seed triangle starts its own cluster (4.5.1); of two that share a vertex the first has it.
    for (std::size_t i = chosen.size(); i-- > 0;) {
        for (const std::int32_t v : chosen[i].vertices)
            segmentation.labels[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(i);
    }
    return segmentation;
}

}  // namespace batchenc
