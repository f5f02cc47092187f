#include "codecs/segmentation.h"

#include <algorithm>
#include <numeric>

#include "codecs/segmentation_methods.h"
#include "kernels/bounding_box.h"
#include "kernels/deviation.h"
#include "kernels/region_growing.h"
#include "kernels/seeds.h"

namespace batchenc {
namespace {

/// Seeds and seed triangles of methods that choose them beforehand; notes what is wrong with them.
std::vector<std::int32_t> plant_seeds(const SegmentationInput& input, std::int32_t count,
                                      Segmentation& segmentation) {
    const std::vector<std::int32_t> seeds = farthest_point_seeds(input.positions.frames(0, 1), count);
    for (std::size_t i = 0; i < seeds.size(); ++i) {
        const SeedTriangle chosen = input.seed_triangles.choose(seeds[i], input.executor);
        segmentation.seed_triangles.push_back(chosen.vertices);
        std::string note = seed_triangle_note(static_cast<std::int32_t>(i), seeds[i], chosen);
        if (!note.empty()) segmentation.notes.push_back(std::move(note));
    }
    return seeds;
}

std::vector<LocalFrameTrack> tracks_of(const SegmentationInput& input, const Segmentation& segmentation) {
    std::vector<LocalFrameTrack> tracks(segmentation.seed_triangles.size(), LocalFrameTrack(0));
    input.executor.for_each(segmentation.cluster_count(), [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        tracks[at] = triangle_track(input.positions, segmentation.seed_triangles[at]);
    });
    return tracks;
}

/// A block of vertices in memory of the calling thread's own, until its next call.
const float* load_into_scratch(PositionsView positions, std::int64_t first_vertex) {
    thread_local AlignedFloats block;
    thread_local std::int64_t size = 0;
    const std::int64_t wanted = vertex_block_size(positions.frame_count());
    if (size < wanted) {
        block = AlignedFloats(wanted);
        size = wanted;
    }
    load_vertex_block(positions, first_vertex, block.data());
    return block.data();
}

/// Sets Segmentation::cluster_deviations (4.7).
void evaluate(Segmentation& segmentation, std::int64_t frame_count) {
    for (float& deviation : segmentation.deviations) deviation = bounded_deviation(deviation);
    const std::size_t clusters = segmentation.seed_triangles.size();
    std::vector<bool> counts(segmentation.labels.size(), true);
    for (const Triangle& t : segmentation.seed_triangles) {
        for (const std::int32_t v : t) counts[static_cast<std::size_t>(v)] = false;
    }
    std::vector<std::int64_t> sizes(clusters, 0);
    segmentation.cluster_deviations.assign(clusters, 0.0);
    for (std::size_t v = 0; v < counts.size(); ++v) {
        if (!counts[v]) continue;
        const auto i = static_cast<std::size_t>(segmentation.labels[v]);
        segmentation.cluster_deviations[i] += static_cast<double>(segmentation.deviations[v]);
        ++sizes[i];
    }
    for (std::size_t i = 0; i < clusters; ++i) {
        if (sizes[i] > 0) segmentation.cluster_deviations[i] /= static_cast<double>(frame_count * sizes[i]);
    }
}

Segmentation segment(const SegmentationInput& input, const SegmentationParameters& parameters) {
    const auto with_fixed_count = [&](std::int32_t count) {
        return parameters.method == SegmentationMethod::kRegionGrowing
                   ? segment_by_region_growing(input, count)
                   : segment_by_clustering(input, count);
    };
    const bool grows =
        parameters.method == SegmentationMethod::kAdaptive || parameters.method == SegmentationMethod::kRigid;
    if (!grows && parameters.clusters > 0 && parameters.threshold == 0.0)
        return with_fixed_count(parameters.clusters);

    const VertexBlocks blocks(input.positions, input.executor);
    GrowthLimits limits;
    limits.count = parameters.clusters;
    if (parameters.threshold > 0.0) {
        const double step = parameters.threshold * input.e_max;
        limits.average_deviation = step * step;
    }
    Segmentation adaptive = segment_adaptively(input, blocks, limits);
    if (parameters.method == SegmentationMethod::kRigid) return refine_rigidly(input, blocks, adaptive);
    return grows ? adaptive : with_fixed_count(adaptive.cluster_count());
}

}  // namespace

double Segmentation::average_deviation() const {
    if (cluster_deviations.empty()) return 0.0;
    return std::accumulate(cluster_deviations.begin(), cluster_deviations.end(), 0.0) /
           static_cast<double>(cluster_deviations.size());
}

std::string seed_triangle_note(std::int32_t cluster, std::int32_t seed, const SeedTriangle& triangle) {
    const std::string name = "cluster " + std::to_string(cluster);
    if (triangle.degenerate)
        return name + " has no triangle that keeps an area; its axes stand still while there is none";
    if (triangle.replaced)
        return name + " takes its seed triangle from elsewhere: those at vertex " + std::to_string(seed) +
               " collapse";
    return {};
}

std::vector<std::int32_t> spread_sample(const std::vector<std::int32_t>& vertices, std::size_t count) {
    if (vertices.size() <= count) return vertices;
    std::vector<std::int32_t> some;
    for (std::size_t k = 0; k < count; ++k) some.push_back(vertices[k * vertices.size() / count]);
    return some;
}

void claim_seed_vertices(Segmentation& segmentation) {
    for (std::size_t i = segmentation.seed_triangles.size(); i-- > 0;) {
        for (const std::int32_t v : segmentation.seed_triangles[i])
            segmentation.labels[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(i);
    }
}

void measure_deviations(const SegmentationInput& input, const VertexBlocks* blocks,
                        Segmentation& segmentation) {
    const std::vector<LocalFrameTrack> tracks = tracks_of(input, segmentation);
    const std::int64_t vertex_count = input.positions.vertex_count();
    segmentation.deviations.resize(static_cast<std::size_t>(vertex_count));
    input.executor.for_each(vertex_block_count(vertex_count), [&](std::int64_t index) {
        const std::int64_t first = index * kVertexBlock;
        const float* block = blocks ? blocks->block(index) : load_into_scratch(input.positions, first);
        // A block meets few clusters, because neighbours in the file are mostly neighbours on the mesh.
        const std::int64_t last = std::min(first + kVertexBlock, vertex_count);
        std::vector<std::int32_t> present(segmentation.labels.begin() + first,
                                          segmentation.labels.begin() + last);
        std::sort(present.begin(), present.end());
        present.erase(std::unique(present.begin(), present.end()), present.end());
        float theta[kVertexBlock];
        for (const std::int32_t i : present) {
            deviation_block(block, input.positions.frame_count(),
                            std::span(&tracks[static_cast<std::size_t>(i)], 1), theta);
            for (std::int64_t v = first; v < last; ++v) {
                if (segmentation.labels[static_cast<std::size_t>(v)] == i)
                    segmentation.deviations[static_cast<std::size_t>(v)] = theta[v - first];
            }
        }
    });
}

Segmentation segment_by_region_growing(const SegmentationInput& input, std::int32_t count) {
    Segmentation segmentation;
    const std::vector<std::int32_t> seeds = plant_seeds(input, count, segmentation);
    segmentation.labels = grow_regions(mean_positions(input.positions, input.executor), input.triangles,
                                       input.vertex_triangles, seeds, segmentation.seed_triangles);
    measure_deviations(input, nullptr, segmentation);
    return segmentation;
}

Segmentation segment_by_clustering(const SegmentationInput& input, std::int32_t count) {
    Segmentation segmentation;
    const std::vector<std::int32_t> seeds = plant_seeds(input, count, segmentation);
    const std::vector<LocalFrameTrack> tracks = tracks_of(input, segmentation);
    const PositionsView positions = input.positions;
    const std::int64_t vertex_count = positions.vertex_count();
    segmentation.labels.resize(static_cast<std::size_t>(vertex_count));
    segmentation.deviations.resize(static_cast<std::size_t>(vertex_count));

    // A task per block of vertices. Equal deviations (a single frame, a clip that does not move) go to the
    // nearest seed.
    input.executor.for_each(vertex_block_count(vertex_count), [&](std::int64_t index) {
        thread_local std::vector<float> theta;
        theta.resize(static_cast<std::size_t>(kVertexBlock) * tracks.size());
        const std::int64_t first = index * kVertexBlock;
        const float* block = load_into_scratch(positions, first);
        deviation_block(block, positions.frame_count(), tracks, theta);
        for (std::int64_t v = first; v < std::min(first + kVertexBlock, vertex_count); ++v) {
            const auto theta_of = [&](std::size_t i) {
                return theta[i * kVertexBlock + static_cast<std::size_t>(v - first)];
            };
            const auto distance_of = [&](std::size_t i) {
                return squared_distance(positions.at(0, v), positions.at(0, seeds[i]));
            };
            std::size_t best = 0;
            for (std::size_t i = 1; i < tracks.size(); ++i) {
                if (theta_of(i) < theta_of(best) ||
                    (theta_of(i) == theta_of(best) && distance_of(i) < distance_of(best)))
                    best = i;
            }
            segmentation.labels[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(best);
            segmentation.deviations[static_cast<std::size_t>(v)] = theta_of(best);
        }
    });
    claim_seed_vertices(segmentation);
    return segmentation;
}

Expected<Segmentation> segment_clip(PositionsView positions, std::span<const Triangle> triangles,
                                    const SegmentationParameters& parameters, const Executor& executor) {
    if (auto valid = check_parameters(parameters); !valid) return tl::unexpected(valid.error());
    const VertexTriangles vertex_triangles(triangles, positions.vertex_count());
    const double e_max = bounding_box(positions).largest_side();
    SeedTriangleChooser chooser(positions, triangles, vertex_triangles, e_max);
    Segmentation segmentation =
        segment({positions, triangles, vertex_triangles, e_max, chooser, executor}, parameters);
    if (segmentation.cluster_count() < parameters.clusters && parameters.threshold == 0.0) {
        segmentation.notes.insert(segmentation.notes.begin(),
                                  "only " + std::to_string(segmentation.cluster_count()) + " clusters of " +
                                      std::to_string(parameters.clusters) +
                                      ": further ones would hold too few vertices, or nothing of their own");
    }
    evaluate(segmentation, positions.frame_count());
    return segmentation;
}

}  // namespace batchenc
