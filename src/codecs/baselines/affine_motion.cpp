#include "codecs/baselines/affine_motion.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "codecs/baselines/baseline_header.h"
#include "codecs/baselines/baselines.h"
#include "codecs/baselines/lane_groups.h"
#include "codecs/baselines/level_grid.h"
#include "codecs/baselines/mesh_levels.h"
#include "codecs/baselines/skinning.h"
#include "codecs/coded_segmentation.h"
#include "codecs/first_frame.h"
#include "codecs/kept_frames.h"

namespace batchenc {
namespace {

/// The error of the first frame, in steps: it comes back in every block of residuals.
constexpr double kFirstPart = 0.125;
/// The step of motions, in steps of residuals.
constexpr double kMotionPart = 0.125;
/// What a weight of one must save, as part of a step squared a frame.
constexpr double kRidge = 1.0;
/// Signals of a cluster's motion: how its centre moves, and three points beside it relative to that.
constexpr std::int64_t kPoints = 4, kSignals = 3 * kPoints;
/// Frames that are transformed together.
constexpr std::int64_t kBlock = 64;

/// Where the clusters are in the decoded first frame, and where their motions take its vertices.
class ClusterPlaces {
 public:
    ClusterPlaces(std::span<const float> first, std::span<const std::int32_t> labels, std::int32_t count)
        : first_(first), labels_(labels), places_(static_cast<std::size_t>(count)) {
        for (std::size_t v = 0; v < labels.size(); ++v) {
            Place& place = places_[own(v)];
            place.size += 1.0;
            for (std::size_t c = 0; c < 3; ++c) place.center[c] += static_cast<double>(first[3 * v + c]);
        }
        for (Place& place : places_)
            for (double& value : place.center) value = place.size > 0.0 ? value / place.size : 0.0;
        for (std::size_t v = 0; v < labels.size(); ++v)
            for (const double d : offset(v, own(v))) places_[own(v)].radius += d * d;
        for (Place& place : places_)
            place.radius = place.size > 0.0 ? std::sqrt(place.radius / place.size) : 0.0;
    }

    std::size_t own(std::size_t v) const { return static_cast<std::size_t>(labels_[v]); }
    /// Root mean square distance of a cluster's vertices from its centre, world units.
    double radius(std::size_t cluster) const { return places_[cluster].radius; }
    /// Of a vertex from the centre of a cluster, world units.
    std::array<double, 3> offset(std::size_t v, std::size_t cluster) const {
        std::array<double, 3> d;
        for (std::size_t c = 0; c < 3; ++c)
            d[c] = static_cast<double>(first_[3 * v + c]) - places_[cluster].center[c];
        return d;
    }
    /// Where a cluster's motion takes a vertex. motions: of all clusters in a frame.
    std::array<double, 3> moved(std::size_t v, std::size_t cluster, const float* motions) const {
        const float* motion = motions + cluster * kSignals;
        const std::array<double, 3> d = offset(v, cluster);
        const double radius = this->radius(cluster);
        std::array<double, 3> point;
        for (std::size_t c = 0; c < 3; ++c) {
            point[c] = static_cast<double>(first_[3 * v + c]) + static_cast<double>(motion[c]);
            for (std::size_t j = 0; j < 3 && radius > 0.0; ++j)
                point[c] += d[j] / radius * static_cast<double>(motion[3 + 3 * j + c]);
        }
        return point;
    }
    /// Where the motions of its clusters take a vertex. The same operations in the same order on both sides.
    std::array<float, 3> blended(std::size_t v, const Skinning& skinning, const float* motions) const {
        const std::vector<std::int32_t>& neighbours = skinning.neighbours[own(v)];
        const std::array<double, 3> base = moved(v, own(v), motions);
        std::array<double, 3> point = base;
        for (std::size_t k = 0; k < neighbours.size(); ++k) {
            if (skinning.weights[v][k] == 0) continue;
            const double weight = static_cast<double>(skinning.weights[v][k]) / Skinning::kUnits;
            const auto other = moved(v, static_cast<std::size_t>(neighbours[k]), motions);
            for (std::size_t c = 0; c < 3; ++c) point[c] += weight * (other[c] - base[c]);
        }
        return {static_cast<float>(point[0]), static_cast<float>(point[1]), static_cast<float>(point[2])};
    }

 private:
    struct Place {
        std::array<double, 3> center{};
        double radius = 0.0;
        double size = 0.0;
    };
    std::span<const float> first_;
    std::span<const std::int32_t> labels_;
    std::vector<Place> places_;
};

/// The motion of each cluster in each frame but the first, F - 1 rows of N motions: least squares, with a
/// ridge towards the identity that is of the first frame's error, so that flat clusters do not follow noise.
std::vector<float> fit_motions(PositionsView positions, std::span<const float> first,
                               std::span<const std::int32_t> labels, std::int32_t cluster_count,
                               const ClusterPlaces& places, double error, const Executor& executor) {
    std::vector<std::vector<std::int32_t>> members(static_cast<std::size_t>(cluster_count));
    for (std::size_t v = 0; v < labels.size(); ++v)
        members[static_cast<std::size_t>(labels[v])].push_back(static_cast<std::int32_t>(v));
    std::vector<float> motions(
        static_cast<std::size_t>((positions.frame_count() - 1) * cluster_count * kSignals));
    executor.for_each(cluster_count, [&](std::int64_t k) {
        const auto& own = members[static_cast<std::size_t>(k)];
        const auto size = static_cast<double>(own.size());
        const double radius = places.radius(static_cast<std::size_t>(k));
        Eigen::Matrix3d spread =
            Eigen::Matrix3d::Identity() * (size * (error * error + 1e-9 * radius * radius));
        for (const std::int32_t v : own) {
            const auto d = places.offset(static_cast<std::size_t>(v), static_cast<std::size_t>(k));
            const Eigen::Vector3d offset(d[0], d[1], d[2]);
            spread += offset * offset.transpose();
        }
        // A radius of zero, or one whose square float64 cannot hold, leaves the centre's motion.
        const Eigen::Matrix3d inverse = spread.inverse();
        const bool is_linear = radius > 0.0 && inverse.allFinite();
        for (std::int64_t f = 1; f < positions.frame_count() && !own.empty(); ++f) {
            Eigen::Vector3d mean = Eigen::Vector3d::Zero();
            Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
            for (const std::int32_t v : own) {
                const float *to = positions.at(f, v), *from = first.data() + 3 * v;
                Eigen::Vector3d change;
                for (int c = 0; c < 3; ++c)
                    change[c] = static_cast<double>(to[c]) - static_cast<double>(from[c]);
                const auto d = places.offset(static_cast<std::size_t>(v), static_cast<std::size_t>(k));
                mean += change;
                moments += change * Eigen::RowVector3d(d[0], d[1], d[2]);
            }
            // The offsets sum to zero: the mean need not be taken off before the moments.
            mean /= size;
            float* motion = motions.data() + ((f - 1) * cluster_count + k) * kSignals;
            const Eigen::Matrix3d linear = moments * inverse * radius;
            for (int c = 0; c < 3; ++c) {
                motion[c] = static_cast<float>(mean[c]);
                for (int j = 0; j < 3 && is_linear; ++j)
                    motion[3 + 3 * j + c] = static_cast<float>(linear(c, j));
            }
        }
    });
    return motions;
}

/// Fits the weights of every vertex to its trajectory: least squares with a ridge, so that what neighbours
/// do not tell apart stays small. motions: decoded.
void fit_weights(Skinning& skinning, PositionsView positions, const ClusterPlaces& places,
                 const std::vector<float>& motions, double step, const Executor& executor) {
    const std::size_t stride = skinning.neighbours.size() * kSignals;
    executor.for_each(positions.vertex_count(), [&](std::int64_t vertex) {
        const auto v = static_cast<std::size_t>(vertex);
        const std::vector<std::int32_t>& neighbours = skinning.neighbours[places.own(v)];
        const auto count = static_cast<Eigen::Index>(neighbours.size());
        if (count == 0) return;
        Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(count, count) *
                                 (kRidge * step * step * static_cast<double>(positions.frame_count()));
        Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
        Eigen::Matrix3Xd others(3, count);
        for (std::int64_t f = 1; f < positions.frame_count(); ++f) {
            const float* frame = motions.data() + static_cast<std::size_t>(f - 1) * stride;
            const auto base = places.moved(v, places.own(v), frame);
            const float* p = positions.at(f, vertex);
            const Eigen::Vector3d missed(static_cast<double>(p[0]) - base[0],
                                         static_cast<double>(p[1]) - base[1],
                                         static_cast<double>(p[2]) - base[2]);
            for (Eigen::Index k = 0; k < count; ++k) {
                const auto neighbour = static_cast<std::size_t>(neighbours[static_cast<std::size_t>(k)]);
                const auto moved = places.moved(v, neighbour, frame);
                for (int c = 0; c < 3; ++c)
                    others(c, k) = moved[static_cast<std::size_t>(c)] - base[static_cast<std::size_t>(c)];
            }
            normal.noalias() += others.transpose() * others;
            right.noalias() += others.transpose() * missed;
        }
        const Eigen::VectorXd solved = normal.ldlt().solve(right);
        for (Eigen::Index k = 0; k < count; ++k) {
            // What does not fit, and NaN where there is no motion, is no weight.
            const double units = std::floor(solved[k] * Skinning::kUnits + 0.5);
            skinning.weights[v][static_cast<std::size_t>(k)] =
                std::abs(units) < 32768.0 ? static_cast<std::int32_t>(units) : 0;
        }
    });
}

/// Cosine transforms along time, block by block; the last block may be shorter. Levels stand in rows by
/// frequency, of each frequency block by block.
class BlockTransform {
 public:
    explicit BlockTransform(std::int64_t rows)
        : rows_(rows),
          whole_(std::min(rows, kBlock)),
          rest_(rows % whole_.length() + (rows % whole_.length() == 0 ? 1 : 0)) {
        const std::int64_t block = whole_.length();
        entries_.resize(static_cast<std::size_t>(rows));
        std::int64_t entry = 0;
        for (std::int64_t k = 0; k < block; ++k)
            for (std::int64_t row = k; row < rows; row += block)
                entries_[static_cast<std::size_t>(row)] = entry++;
    }

    /// load(row, signal) gives what is transformed. Gives rows x signals levels.
    template <typename Load>
    std::vector<std::int32_t> forward(std::int64_t signals, double step, const Executor& executor,
                                      Load load) const {
        std::vector<std::int32_t> levels(static_cast<std::size_t>(rows_ * signals));
        transform_signals(
            rows_, signals, executor, load,
            [&](float* values) {
                each_block(values, [](const Dct& dct, float* of_block, float* workspace) {
                    dct.forward(of_block, workspace);
                });
            },
            [&](std::int64_t row, std::int64_t signal, float value) {
                levels[at(row, signal, signals)] = nearest_level(value, step);
            });
        return levels;
    }

    /// The way back: store(row, signal, value) takes the values away.
    template <typename Store>
    void inverse(std::int64_t signals, double step, const Executor& executor,
                 const std::vector<std::int32_t>& levels, Store store) const {
        transform_signals(
            rows_, signals, executor,
            [&](std::int64_t row, std::int64_t signal) {
                return static_cast<float>(static_cast<double>(levels[at(row, signal, signals)]) * step);
            },
            [&](float* values) {
                each_block(values, [](const Dct& dct, float* of_block, float* workspace) {
                    dct.inverse(of_block, workspace);
                });
            },
            store);
    }

 private:
    std::size_t at(std::int64_t row, std::int64_t signal, std::int64_t signals) const {
        return static_cast<std::size_t>(entries_[static_cast<std::size_t>(row)] * signals + signal);
    }
    template <typename Transform>
    void each_block(float* values, Transform transform) const {
        const std::int64_t block = whole_.length();
        std::vector<float> workspace(
            static_cast<std::size_t>(std::max(whole_.workspace_size(), rest_.workspace_size())));
        for (std::int64_t first = 0; first < rows_; first += block)
            transform(rows_ - first >= block ? whole_ : rest_, values + first * kDctLanes, workspace.data());
    }

    std::int64_t rows_;
    Dct whole_, rest_;
    std::vector<std::int64_t> entries_;  // place of each row's coefficient
};

std::vector<float> decoded_motions(const BlockTransform& transform, std::int32_t cluster_count, double step,
                                   const Executor& executor, const std::vector<std::int32_t>& levels) {
    const std::int64_t signals = cluster_count * kSignals;
    std::vector<float> motions(levels.size());
    transform.inverse(signals, step * kMotionPart, executor, levels,
                      [&](std::int64_t row, std::int64_t signal, float value) {
                          motions[static_cast<std::size_t>(row * signals + signal)] = value;
                      });
    return motions;
}

}  // namespace

Expected<EncodedClip> encode_affine_motion(PositionsView positions, const MeshTopology& mesh,
                                           const Segmentation& segmentation, BaselineHeader header,
                                           const Executor& executor) {
    const std::int32_t clusters = segmentation.cluster_count();
    header.cluster_count = clusters;
    const double step = header.step();
    const std::int64_t rows = positions.frame_count() - 1;
    const std::vector<std::int32_t>& labels = segmentation.labels;
    auto first = encode_first_frame(positions, mesh, step * kFirstPart, executor);
    if (!first) return tl::unexpected(first.error());

    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kSegmentation,
                          write_segmentation(labels, {}, clusters, mesh.adjacency()));
    sections.emplace_back(SectionId::kFrames, std::move(first->bitstream));
    if (rows > 0) {
        const BlockTransform transform(rows);
        const ClusterPlaces places(first->positions, labels, clusters);
        std::vector<float> motions =
            fit_motions(positions, first->positions, labels, clusters, places, step * kFirstPart, executor);
        const std::int64_t motion_signals = clusters * kSignals;
        const std::vector<std::int32_t> motion_levels = transform.forward(
            motion_signals, step * kMotionPart, executor, [&](std::int64_t row, std::int64_t signal) {
                return motions[static_cast<std::size_t>(row * motion_signals + signal)];
            });
        motions = decoded_motions(transform, clusters, step, executor, motion_levels);
        Skinning skinning(labels, clusters, mesh.adjacency());
        fit_weights(skinning, positions, places, motions, step, executor);
        sections.emplace_back(SectionId::kBasis, skinning.write(labels, mesh.traversal()));
        const std::vector<std::int32_t>& order = mesh.traversal().order;
        std::vector<std::int32_t> levels = transform.forward(
            3 * positions.vertex_count(), step, executor, [&](std::int64_t row, std::int64_t signal) {
                const auto v = static_cast<std::size_t>(order[static_cast<std::size_t>(signal / 3)]);
                const auto moved = places.blended(v, skinning, motions.data() + row * motion_signals);
                const auto c = static_cast<std::size_t>(signal % 3);
                return positions.at(row + 1, static_cast<std::int64_t>(v))[c] - moved[c];
            });
        if (!is_codable(motion_levels) || !is_codable(levels))
            return fail(ErrorCode::kLimit, "the motion is larger than the coder can hold");
        sections.emplace_back(SectionId::kCoefficients, encode_level_grid(motion_levels, clusters * kPoints));
        sections.emplace_back(SectionId::kResiduals,
                              write_predicted_grid(mesh.traversal(), LevelPrediction::kMean, levels));
    }
    EncodedClip clip;
    clip.bitstream = write_clip_bitstream(CodecMethod::kBaselineAffine, positions.vertex_count(),
                                          positions.frame_count(), sections);
    return clip;
}

Expected<std::unique_ptr<DecodedClip>> decode_affine_motion(const ClipBitstream& clip, const SharedMesh& mesh,
                                                            std::int64_t size_limit_bytes,
                                                            const Executor& executor) {
    const auto info = read_baseline_info(clip);
    if (!info) return tl::unexpected(info.error());
    const BaselineHeader header = *BaselineHeader::read(clip.payload(SectionId::kParameters));
    const std::int32_t clusters = header.cluster_count;
    if (clusters < 1 || clusters > clip.vertex_count)
        return fail(ErrorCode::kCorrupt, "the number of clusters is out of range");
    // A vertex in a frame has its position and three levels; a cluster has as much for each of its signals.
    // A group of signals under transformation has a row of lanes for each frame.
    constexpr std::int64_t kBytesPerVertex = 640, kBytesPerSample = 24, kBytesPerFrame = 256;
    const std::int64_t per_sample =
        kBytesPerSample + 2 * kBytesPerSample * kPoints * clusters / clip.vertex_count + 1;
    if (auto good = check_size(clip, size_limit_bytes, kBytesPerVertex, per_sample); !good)
        return tl::unexpected(good.error());
    const std::int64_t rows = clip.frame_count - 1;
    if (rows > size_limit_bytes / kBytesPerFrame)
        return fail(ErrorCode::kLimit, "the clip has too many frames for the memory allowed");
    auto segmentation = read_segmentation(clip.payload(SectionId::kSegmentation), clip.vertex_count, clusters,
                                          0, mesh->adjacency());
    if (!segmentation) return fail_within(section_name(SectionId::kSegmentation), segmentation.error());
    const std::vector<std::int32_t> labels = segmentation->labels;
    auto decoded = std::make_unique<KeptFrames>(*info, std::move(segmentation->labels));
    const MutablePositionsView frames = decoded->frames();
    if (auto done = decode_first_frame(clip.payload(SectionId::kFrames), *mesh, size_limit_bytes,
                                       {frames.data(), 1, clip.vertex_count}, executor);
        !done)
        return fail_within(section_name(SectionId::kFrames), done.error());
    const auto weight_bytes = clip.payload(SectionId::kBasis);
    const auto motion_bytes = clip.payload(SectionId::kCoefficients);
    const auto residual_bytes = clip.payload(SectionId::kResiduals);
    if (rows == 0) {
        if (!weight_bytes.empty() || !motion_bytes.empty() || !residual_bytes.empty())
            return fail(ErrorCode::kCorrupt, "one frame has no motion");
        return decoded;
    }
    Skinning skinning(labels, clusters, mesh->adjacency());
    if (auto done = skinning.read(weight_bytes, labels, mesh->traversal()); !done)
        return fail_within(section_name(SectionId::kBasis), done.error());
    const auto motion_levels = decode_level_grid(motion_bytes, rows, clusters * kPoints);
    if (!motion_levels) return fail_within(section_name(SectionId::kCoefficients), motion_levels.error());
    const auto levels = read_predicted_grid(residual_bytes, mesh->traversal(), LevelPrediction::kMean, rows);
    if (!levels) return fail_within(section_name(SectionId::kResiduals), levels.error());

    const BlockTransform transform(rows);
    const double step = header.step();
    const ClusterPlaces places({frames.data(), static_cast<std::size_t>(3 * clip.vertex_count)}, labels,
                               clusters);
    const std::vector<float> motions = decoded_motions(transform, clusters, step, executor, *motion_levels);
    const std::vector<std::int32_t>& order = mesh->traversal().order;
    transform.inverse(3 * clip.vertex_count, step, executor, *levels,
                      [&](std::int64_t row, std::int64_t signal, float value) {
                          const std::int32_t v = order[static_cast<std::size_t>(signal / 3)];
                          frames.at(row + 1, v)[signal % 3] = value;
                      });
    executor.for_each(rows, [&](std::int64_t row) {
        for (std::int64_t v = 0; v < clip.vertex_count; ++v) {
            const auto at = static_cast<std::size_t>(v);
            const auto moved = places.blended(at, skinning, motions.data() + row * clusters * kSignals);
            for (std::size_t c = 0; c < 3; ++c) frames.at(row + 1, v)[c] += moved[c];
        }
    });
    return decoded;
}

}  // namespace batchenc
