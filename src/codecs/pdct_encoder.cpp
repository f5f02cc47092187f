#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "codecs/coded_streams.h"
#include "codecs/level_rows.h"
#include "codecs/pdct.h"
#include "codecs/pdct_layout.h"
#include "codecs/rate_model.h"
#include "codecs/static_coder.h"
#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "kernels/predecessor_prediction.h"
#include "kernels/signal_order.h"
#include "kernels/temporal_series.h"

namespace batchenc {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();  // the cost of what cannot be coded

/// Magnitude of what is quantised, in steps, at most: a level is the difference of two such.
constexpr float kLargestTarget = 1073741824.0f;  // 2^30

/// Levels of one cluster as they are coded: rows of 3n.
struct CodedCluster {
    bool over_mesh = false;  // rows hold residuals of prediction over the mesh, not transforms along it
    std::vector<std::int32_t> intra;
    std::unique_ptr<std::int32_t[]> levels;
    std::size_t row_size = 0;  // 3n
    float cost = 0.0f;         // squared error in steps and what the bits are worth; kNever: not coded

    std::span<std::int32_t> row(std::int64_t r) {
        return {levels.get() + static_cast<std::size_t>(r) * row_size, row_size};
    }
};

std::int32_t round_to_level(float value) {
    constexpr float kLimit = 2147483520.0f;                            // the last one before 2^31
    const float bounded = std::max(std::min(kLimit, value), -kLimit);  // of NaN too
    return static_cast<std::int32_t>(bounded + (bounded < 0.0f ? -0.5f : 0.5f));
}

/// Chooses the levels of one cluster.
class Quantizer {
 public:
    Quantizer(const ClusterTraversal& traversal, const ClusterTransform& transform,
              const CodecParameters& parameters, float step)
        : traversal_(traversal),
          transform_(transform),
          parameters_(parameters),
          per_step_(step > 0.0f ? 1.0f / step : 0.0f),
          size_(static_cast<std::size_t>(3 * transform.columns())) {}

    /// values: rows of transformed (or, over the mesh, local) coordinates, transform.stride() apart. The cost
    /// is kNever where they are too large, and the levels then nothing.
    CodedCluster quantize(const float* values, std::int64_t rows, bool over_mesh) {
        CodedCluster coded;
        coded.over_mesh = over_mesh;
        coded.row_size = size_;
        coded.levels = std::make_unique_for_overwrite<std::int32_t[]>(static_cast<std::size_t>(rows) * size_);
        RowMemory memory(transform_.columns(), std::clamp<std::int64_t>(rows, 1, transform_.block()));
        std::vector<std::int32_t> opening(size_, 0);  // first row of the block before, whole
        std::int64_t length_before = transform_.block();
        targets_.resize(size_);
        for (std::int64_t first = 0; first < rows; first += transform_.block()) {
            const std::int64_t length = std::min(transform_.block(), rows - first);
            for (std::int32_t& level : opening) level = predict_block(level, length_before, length);
            for (std::int64_t t = 0; t < length; ++t) {
                const float* row = values + (first + t) * transform_.stride();
                float* targets = targets_.data();
                std::int32_t beyond = 0;  // a number, so that the loop vectorises
                for (std::size_t j = 0; j < size_; ++j) {
                    const float target = row[j] * per_step_;
                    beyond |= std::abs(target) <= kLargestTarget ? 0 : 1;
                    targets[j] = target;
                }
                if (beyond != 0) {
                    coded.cost = kNever;
                    return coded;
                }
                if (t == 0)
                    for (std::size_t j = 0; j < size_; ++j) targets_[j] -= static_cast<float>(opening[j]);
                const std::span<std::int32_t> coded_row = coded.row(first + t);
                if (over_mesh)
                    coded.cost += choose_over_mesh(memory, static_cast<std::size_t>(t), coded_row);
                else if (parameters_.allocation == CoefficientAllocation::kRd)
                    coded.cost += choose_by_cost(memory, static_cast<std::size_t>(t), coded_row);
                else
                    choose_largest(coded_row);
                if (coded.cost == kNever) return coded;
                if (t > 0) continue;
                const std::int32_t* chosen = over_mesh ? deltas_.data() : coded_row.data();
                for (std::size_t j = 0; j < size_; ++j) opening[j] += chosen[j];
            }
            length_before = length;
        }
        return coded;
    }

 private:
    /// The share `keep` of a row that is largest.
    void choose_largest(std::span<std::int32_t> row) {
        const auto kept = static_cast<std::size_t>(std::ceil(parameters_.keep * static_cast<double>(size_)));
        std::size_t left = size_;
        for (std::size_t j = 0; j < size_; ++j) {
            row[j] = round_to_level(targets_[j]);
            left -= row[j] == 0 ? 1 : 0;
        }
        if (left <= kept) return;
        if (kept == 0) {
            std::fill(row.begin(), row.end(), 0);
            return;
        }
        sizes_.resize(size_);
        for (std::size_t j = 0; j < size_; ++j) sizes_[j] = std::abs(targets_[j]);
        const auto last = sizes_.begin() + static_cast<std::ptrdiff_t>(kept - 1);
        std::nth_element(sizes_.begin(), last, sizes_.end(), std::greater<>());
        const float least = *last;
        left = kept;
        for (std::size_t j = 0; j < size_; ++j) {
            if (std::abs(targets_[j]) < least || left == 0)
                row[j] = 0;
            else
                --left;
        }
    }

    /// The level among the nearest one, its neighbour towards zero and zero itself that costs least.
    std::int32_t cheapest(float target, std::uint32_t c, float& cost) const {
        const float size = std::abs(target);
        const std::int32_t nearest = round_to_level(size);
        std::int32_t best = nearest;
        float least = cost_of(size, nearest, c);
        const auto try_level = [&](std::int32_t level) {
            const float its_cost = cost_of(size, level, c);
            if (its_cost < least) {
                least = its_cost;
                best = level;
            }
        };
        if (nearest > 0) try_level(nearest - 1);
        if (nearest > 1) try_level(0);
        cost += least;
        return target < 0.0f ? -best : best;
    }
    float cost_of(float size, std::int32_t level, std::uint32_t c) const {
        const float miss = size - static_cast<float>(level);
        return miss * miss + kErrorPerBit * costs_(c, level);
    }

    float choose_by_cost(RowMemory& memory, std::size_t t, std::span<std::int32_t> row) const {
        float cost = 0.0f;
        memory.begin(t);
        for (std::size_t j = 0; j < size_; ++j) {
            row[j] = cheapest(targets_[j], RowContexts::class_of(memory.expectation(j)), cost);
            memory.set(j, row[j]);
        }
        memory.end(t, 0);
        return cost;
    }

    float choose_over_mesh(RowMemory& memory, std::size_t t, std::span<std::int32_t> row) {
        deltas_.assign(size_ + 4, 0);
        float cost = 0.0f;
        std::array<std::int32_t, 4> predicted{};
        memory.begin(t);
        for (std::size_t j = 0; j < size_; ++j) {
            if (j % 3 == 0) predict_from_predecessors(traversal_, deltas_.data(), j / 3, predicted.data());
            row[j] = cheapest(targets_[j] - static_cast<float>(predicted[j % 3]),
                              RowContexts::class_of(memory.expectation(j)), cost);
            memory.set(j, row[j]);
            deltas_[j] = wrapping_sum(predicted[j % 3], row[j]);
            if (deltas_[j] > kLargestPredictable || deltas_[j] < -kLargestPredictable)
                return kNever;  // no decoder takes it
        }
        memory.end(t, 0);
        return cost;
    }

    const ClusterTraversal& traversal_;
    const ClusterTransform& transform_;
    const CodecParameters& parameters_;
    const LevelCosts& costs_ = LevelCosts::get();
    float per_step_;
    std::size_t size_;
    std::vector<float> targets_, sizes_;
    std::vector<std::int32_t> deltas_;
};

/// What all clusters share while they are coded.
struct Clip {
    PositionsView positions;
    const CodecParameters& parameters;
    PdctHeader header;
    const ClusterMembers& in;
    const MeshAdjacency& adjacency;
    bool is_points = false;
    std::vector<float> first_frame;       // V x 3 as decoded; none for points
    std::span<std::int32_t> position;     // V values, for walk_cluster
    std::vector<LocalFrameTrack> tracks;  // N
    std::int64_t rows() const { return positions.frame_count() - 1; }
};

/// The first frame of a cluster of points, by transform of its local coordinates; `local` becomes what is
/// decoded of it. No levels where they would be too large.
std::vector<std::int32_t> code_points(const Clip& clip, const ClusterTransform& transform,
                                      std::vector<float>& local, std::vector<float>& workspace) {
    const float step = clip.header.intra_step();
    transform.forward_space(local.data(), 1, workspace.data());
    const std::size_t size = static_cast<std::size_t>(3 * transform.columns());
    std::vector<std::int32_t> levels;
    for (std::size_t j = 0; j < size; ++j) {
        const float target = step > 0.0f ? local[j] / step : 0.0f;
        if (!(std::abs(target) <= kLargestTarget)) return {};
        levels.push_back(round_to_level(target));
        local[j] = static_cast<float>(levels.back()) * step;
    }
    transform.inverse_space(local.data(), 1, workspace.data());
    return levels;
}

/// Transforms a cluster and chooses its levels; costs kNever where they would be too large.
CodedCluster code_cluster(const Clip& clip, std::size_t i) {
    const std::vector<std::int32_t>& members = clip.in.members[i];
    if (members.empty()) return {};
    const ClusterTransform transform(static_cast<std::int64_t>(members.size()), clip.header.block);
    const LocalFrameTrack& track = clip.tracks[i];
    const auto stride = static_cast<std::size_t>(transform.stride());
    std::vector<float> workspace(static_cast<std::size_t>(transform.workspace_size()));
    std::vector<float> base(stride, 0.0f);
    std::vector<std::int32_t> intra;
    ClusterTraversal traversal;
    if (clip.is_points) {
        to_local(clip.positions.at(0, 0), members, track, 0, base.data());
        intra = code_points(clip, transform, base, workspace);
        if (intra.empty()) {
            CodedCluster none;
            none.cost = kNever;
            return none;
        }
        traversal = order_points(members, std::span(base).first(3 * members.size()));
    } else {
        traversal =
            walk_cluster(clip.adjacency, members, clip.in.owner, static_cast<std::int32_t>(i), clip.position);
        to_local(clip.first_frame.data(), traversal.vertices, track, 0, base.data());
    }
    const auto values =
        std::make_unique_for_overwrite<float[]>(stride * static_cast<std::size_t>(clip.rows()));
    for (std::int64_t r = 0; r < clip.rows(); ++r) {
        float* row = values.get() + r * transform.stride();
        to_local(clip.positions.at(r + 1, 0), traversal.vertices, track, r + 1, row);
        for (std::size_t j = 0; j < 3 * members.size(); ++j) row[j] -= base[j];
        std::fill(row + 3 * members.size(), row + stride, 0.0f);
    }
    const std::int64_t block = clip.header.block;
    for (std::int64_t first = 0; first < clip.rows() && block > 1; first += block)
        transform.forward_time(values.get() + first * transform.stride(),
                               std::min(block, clip.rows() - first), workspace.data());

    Quantizer quantizer(traversal, transform, clip.parameters, clip.header.step());
    CodedCluster over_mesh;
    over_mesh.cost = kNever;
    if (clip.parameters.allocation == CoefficientAllocation::kRd)
        over_mesh = quantizer.quantize(values.get(), clip.rows(), true);
    transform.forward_space(values.get(), clip.rows(), workspace.data());
    CodedCluster coded = quantizer.quantize(values.get(), clip.rows(), false);
    if (over_mesh.cost < coded.cost) coded = std::move(over_mesh);
    coded.intra = std::move(intra);
    return coded;
}

/// One stream: the first frames of points, then block by block the rows of every cluster.
std::vector<std::uint8_t> code_stream(const Clip& clip, const std::vector<std::int32_t>& clusters,
                                      std::vector<CodedCluster>& coded) {
    RangeEncoder encoder;
    RowContexts contexts;
    std::vector<RowMemory> memories;
    for (const std::int32_t i : clusters) {
        const auto columns = static_cast<std::int64_t>(clip.in.members[static_cast<std::size_t>(i)].size());
        memories.emplace_back(columns, std::clamp<std::int64_t>(clip.rows(), 1, clip.header.block));
        const auto& intra = coded[static_cast<std::size_t>(i)].intra;
        if (intra.empty()) continue;
        RowMemory nothing(columns, 1);
        encode_row(encoder, contexts, nothing, 0, intra);
    }
    for (std::int64_t first = 0; first < clip.rows(); first += clip.header.block) {
        const std::int64_t length = std::min<std::int64_t>(clip.header.block, clip.rows() - first);
        for (std::size_t k = 0; k < clusters.size(); ++k) {
            CodedCluster& cluster = coded[static_cast<std::size_t>(clusters[k])];
            if (cluster.row_size == 0) continue;
            for (std::int64_t t = 0; t < length; ++t)
                encode_row(encoder, contexts, memories[k], static_cast<std::size_t>(t),
                           cluster.row(first + t));
        }
    }
    for (const std::int32_t i : clusters) coded[static_cast<std::size_t>(i)].levels.reset();
    return encoder.finish();
}

/// The section of levels: which clusters are coded over the mesh, then the streams. Error: kLimit.
Expected<std::vector<std::uint8_t>> coefficients_section(const Clip& clip, const Executor& executor) {
    const std::size_t cluster_count = clip.in.members.size();
    std::vector<std::int64_t> values;
    for (const auto& members : clip.in.members)
        values.push_back(3 * static_cast<std::int64_t>(members.size()) * clip.positions.frame_count());
    std::vector<CodedCluster> coded(cluster_count);
    ByteWriter streams;
    append_streams(streams, deal_streams(values, kLevelsPerStream), executor, [&](const auto& clusters) {
        executor.for_each(static_cast<std::int64_t>(clusters.size()), [&](std::int64_t k) {
            const auto i = static_cast<std::size_t>(clusters[static_cast<std::size_t>(k)]);
            coded[i] = code_cluster(clip, i);
        });
        const bool fits = std::all_of(clusters.begin(), clusters.end(), [&](std::int32_t i) {
            return coded[static_cast<std::size_t>(i)].cost < kNever;
        });
        return fits ? code_stream(clip, clusters, coded) : std::vector<std::uint8_t>();
    });
    for (const CodedCluster& cluster : coded) {
        if (!(cluster.cost < kNever))
            return fail(ErrorCode::kLimit,
                        "coefficients of more than 2^30 steps; give fewer bits or more clusters");
    }
    ByteWriter out;
    std::uint8_t flags = 0;
    for (std::size_t i = 0; i < cluster_count; ++i) {
        flags = static_cast<std::uint8_t>(flags | (coded[i].over_mesh ? 1u << i % 8 : 0u));
        if (i % 8 < 7 && i + 1 < cluster_count) continue;
        out.put(flags);
        flags = 0;
    }
    out.put_bytes(streams.take());
    return out.take();
}

}  // namespace

Expected<EncodedClip> encode_pdct(PositionsView positions, const MeshTopology& mesh,
                                  const Segmentation& segmentation, const CodecParameters& parameters,
                                  const Executor& executor) {
    const BoundingBox box = bounding_box(positions);
    const ClusterMembers in(segmentation.labels, segmentation.seed_triangles, segmentation.cluster_count());
    const MeshAdjacency& adjacency = mesh.adjacency();
    Clip clip{positions, parameters, {}, in, adjacency, mesh.is_points(), {}, {}, {}};
    PdctHeader& header = clip.header;
    header.bits = parameters.bits;
    header.intra_bits = parameters.intra_bits;
    header.block = parameters.transform == PdctTransform::kTemporal ? parameters.block : 1;
    header.cluster_count = segmentation.cluster_count();
    header.lattice = {box.center(), static_cast<float>(box.largest_side()), parameters.frame_bits};
    // Sums of squares over a signal stay in float32's range, and so does the step.
    constexpr float kLargestSide = 1e30f, kSmallestSide = 1e-30f;
    const float e_max = header.lattice.e_max;
    if (!(e_max <= kLargestSide) || (e_max > 0.0f && e_max < kSmallestSide))
        return fail(ErrorCode::kLimit,
                    "its coordinates are too large or too small for float32 to carry their transforms; scale "
                    "the clip");

    std::vector<SeedTrianglePath> paths(segmentation.seed_triangles.size());
    clip.tracks.resize(paths.size(), LocalFrameTrack(0));
    executor.for_each(header.cluster_count, [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        paths[i] = SeedTrianglePath::of(positions, segmentation.seed_triangles[i], header.lattice);
        clip.tracks[i] = paths[i].track(header.lattice);
    });

    std::vector<std::uint8_t> first_frame;
    if (!clip.is_points) {
        auto coded = encode_intra(positions.frames(0, 1), mesh, parameters, executor);
        if (!coded) return fail_within("the first frame", coded.error());
        first_frame = std::move(coded->bitstream);
        clip.first_frame.resize(static_cast<std::size_t>(3 * positions.vertex_count()));
        const auto decoded =
            decode_static_frame(first_frame, mesh, std::numeric_limits<std::int64_t>::max(),
                                {clip.first_frame.data(), 1, positions.vertex_count()}, executor);
        if (!decoded) return fail_within("the first frame", decoded.error());
    }
    std::vector<std::int32_t> position(static_cast<std::size_t>(positions.vertex_count()), -1);
    clip.position = position;

    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kSegmentation,
                          write_segmentation(segmentation.labels, segmentation.seed_triangles,
                                             header.cluster_count, adjacency));
    sections.emplace_back(SectionId::kFrames, write_paths(paths, positions.frame_count(), executor));
    auto coefficients = coefficients_section(clip, executor);
    if (!coefficients) return tl::unexpected(coefficients.error());
    sections.emplace_back(SectionId::kCoefficients, std::move(*coefficients));
    if (!clip.is_points) sections.emplace_back(SectionId::kResiduals, std::move(first_frame));
    EncodedClip encoded;
    encoded.bitstream =
        write_clip_bitstream(CodecMethod::kPdct, positions.vertex_count(), positions.frame_count(), sections);
    return encoded;
}

}  // namespace batchenc
