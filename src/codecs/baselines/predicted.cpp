#include "codecs/baselines/predicted.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/baselines/baselines.h"
#include "codecs/baselines/level_grid.h"
#include "codecs/kept_frames.h"
#include "codecs/lattice.h"
#include "kernels/gate_prediction.h"

namespace batchenc {
namespace {

using Vector = std::array<double, 3>;

/// How the vertices of a frame are predicted.
enum class Rule { kSpace, kBefore, kLine, kLorenzo, kReplica, kAngle };

Rule rule_of(CodecMethod method, const BaselineHeader& header, std::int64_t frame) {
    if (frame == 0 || method == CodecMethod::kBaselineStatic) return Rule::kSpace;
    if (method == CodecMethod::kBaselineLpc)
        return frame == 1 || header.lpc_order == 1 ? Rule::kBefore : Rule::kLine;
    if (method == CodecMethod::kBaselineAngle) return Rule::kAngle;
    return header.predictor == GeometryPredictor::kReplica ? Rule::kReplica : Rule::kLorenzo;
}

/// How many frames a rule looks at.
std::int64_t frames_of(Rule rule) { return rule == Rule::kSpace ? 1 : rule == Rule::kLine ? 3 : 2; }

/// A frame's lattice points and those of the two before it, by place; as far as there are such.
struct History {
    std::vector<Vector> now, before, earlier;

    /// frames: 1 … 3 that are looked at.
    History(std::size_t vertex_count, std::int64_t frames)
        : now(vertex_count), before(frames > 1 ? vertex_count : 0), earlier(frames > 2 ? vertex_count : 0) {}
    GateFrames gate_frames() const { return {now, before}; }
    /// now is free again.
    void next_frame() {
        earlier.swap(before);
        before.swap(now);
    }
};

Vector in_space(const MeshTraversal& traversal, std::size_t place, GatePoints now) {
    const std::span<const Gate> gates = traversal.gates_of(place);
    if (gates.empty()) {
        const std::int32_t anchor = traversal.anchor[place];
        return anchor >= 0 ? now[static_cast<std::size_t>(anchor)] : Vector{};
    }
    if (gates[0].opposite >= 0) return parallelogram(gates[0], now);
    return times(0.5, plus(now[static_cast<std::size_t>(gates[0].left)],
                           now[static_cast<std::size_t>(gates[0].right)]));
}

/// The mean over the gates of where the vertex was before, seen from each.
Vector by_angle(std::span<const Gate> gates, std::size_t place, const GateFrames& frames) {
    constexpr double kLeastHeight = 1.0 / 64;  // of a reference triangle, steps
    Vector sum{};
    int count = 0;
    for (const Gate& gate : gates) {
        GateFrame then, now;
        if (!set_gate_frame(gate, frames.before, kLeastHeight, then) ||
            !set_gate_frame(gate, frames.now, kLeastHeight, now))
            continue;
        sum = plus(sum, out_of_frame(now, into_frame(then, frames.before[place])));
        ++count;
    }
    return count == 0 ? lorenzo(gates, place, frames) : times(1.0 / count, sum);
}

Vector from_frames(Rule rule, std::span<const Gate> gates, std::size_t place, const GateFrames& frames) {
    if (gates.empty()) return frames.before[place];
    if (gates[0].opposite < 0) return moved_with_edge(gates[0], place, frames);
    if (rule == Rule::kAngle) return by_angle(gates, place, frames);
    Vector predicted;
    if (rule == Rule::kReplica && replica(gates[0], place, frames, predicted)) return predicted;
    return lorenzo(gates.first(1), place, frames);
}

/// The vertex at a place, from those before it in now and all of the other frames.
LatticePoint predict(Rule rule, const MeshTraversal& traversal, std::size_t place, const History& history) {
    switch (rule) {
        case Rule::kSpace:
            return nearest_point(in_space(traversal, place, history.now));
        case Rule::kBefore:
            return nearest_point(history.before[place]);
        case Rule::kLine:
            return nearest_point(minus(times(2.0, history.before[place]), history.earlier[place]));
        default:
            return nearest_point(from_frames(rule, traversal.gates_of(place), place, history.gate_frames()));
    }
}

/// Integers by frame and place, three each; of points before prediction, of residuals after it.
class Grid {
 public:
    Grid(std::int64_t frame_count, std::int64_t vertex_count)
        : vertex_count_(static_cast<std::size_t>(vertex_count)),
          values_(static_cast<std::size_t>(frame_count) * 3 * vertex_count_) {}
    Grid(std::vector<std::int32_t> values, std::int64_t vertex_count)
        : vertex_count_(static_cast<std::size_t>(vertex_count)), values_(std::move(values)) {}

    std::int32_t* at(std::int64_t frame, std::size_t place) {
        return values_.data() + 3 * (static_cast<std::size_t>(frame) * vertex_count_ + place);
    }
    const std::int32_t* at(std::int64_t frame, std::size_t place) const {
        return values_.data() + 3 * (static_cast<std::size_t>(frame) * vertex_count_ + place);
    }
    std::size_t vertex_count() const { return vertex_count_; }
    std::span<const std::int32_t> values() const { return values_; }
    void copy_frame(std::int64_t frame, std::vector<Vector>& points) const {
        for (std::size_t k = 0; k < vertex_count_; ++k) {
            const std::int32_t* point = at(frame, k);
            for (std::size_t c = 0; c < 3; ++c) points[k][c] = point[c];
        }
    }

 private:
    std::size_t vertex_count_;
    std::vector<std::int32_t> values_;
};

/// What the prediction of every frame misses. Points are within Lattice::kFurthest, and so are predictions.
Grid residuals_of(const Grid& points, std::int64_t frame_count, const MeshTraversal& traversal,
                  const BaselineHeader& header, CodecMethod method, const Executor& executor) {
    Grid residuals(frame_count, static_cast<std::int64_t>(points.vertex_count()));
    executor.for_each(frame_count, [&](std::int64_t f) {
        const Rule rule = rule_of(method, header, f);
        const std::int64_t frames = frames_of(rule);
        History history(points.vertex_count(), frames);
        points.copy_frame(f, history.now);
        if (frames > 1) points.copy_frame(f - 1, history.before);
        if (frames > 2) points.copy_frame(f - 2, history.earlier);
        for (std::size_t k = 0; k < points.vertex_count(); ++k) {
            const LatticePoint predicted = predict(rule, traversal, k, history);
            for (std::size_t c = 0; c < 3; ++c) residuals.at(f, k)[c] = points.at(f, k)[c] - predicted[c];
        }
    });
    return residuals;
}

/// Residuals of a frame become its points, and history.now. Any residuals: what they lead beyond the lattice
/// stops at its end.
void restore_frame(Rule rule, std::int64_t frame, const MeshTraversal& traversal, History& history,
                   Grid& grid) {
    constexpr std::int64_t kFurthest = Lattice::kFurthest;
    for (std::size_t k = 0; k < grid.vertex_count(); ++k) {
        const LatticePoint predicted = predict(rule, traversal, k, history);
        std::int32_t* point = grid.at(frame, k);
        for (std::size_t c = 0; c < 3; ++c) {
            point[c] = static_cast<std::int32_t>(
                std::clamp(std::int64_t{predicted[c]} + point[c], -kFurthest, kFurthest));
            history.now[k][c] = point[c];
        }
    }
}

}  // namespace

Expected<EncodedClip> encode_predicted(PositionsView positions, const MeshTopology& mesh,
                                       BaselineHeader header, CodecMethod method, const Executor& executor) {
    const MeshTraversal& traversal = mesh.traversal();
    const Lattice lattice(header.center, header.step());
    Grid points(positions.frame_count(), positions.vertex_count());
    executor.for_each(positions.frame_count(), [&](std::int64_t f) {
        for (std::size_t k = 0; k < points.vertex_count(); ++k) {
            const LatticePoint point = lattice.nearest_point(positions.at(f, traversal.order[k]));
            std::copy(point.begin(), point.end(), points.at(f, k));
        }
    });

    std::vector<GeometryPredictor> tried = {header.predictor};
    if (method == CodecMethod::kBaselineDynapack && header.predictor == GeometryPredictor::kAuto)
        tried = {GeometryPredictor::kLorenzo, GeometryPredictor::kReplica};
    std::vector<std::uint8_t> best;
    for (const GeometryPredictor predictor : tried) {
        BaselineHeader trial = header;
        trial.predictor = predictor;
        const Grid residuals =
            residuals_of(points, positions.frame_count(), traversal, trial, method, executor);
        std::vector<std::uint8_t> bytes = encode_level_grid(residuals.values(), positions.vertex_count());
        if (predictor != tried.front() && bytes.size() >= best.size()) continue;
        best = std::move(bytes);
        header.predictor = predictor;
    }
    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kResiduals, std::move(best));
    EncodedClip clip;
    clip.bitstream =
        write_clip_bitstream(method, positions.vertex_count(), positions.frame_count(), sections);
    return clip;
}

Expected<std::unique_ptr<DecodedClip>> decode_predicted(const ClipBitstream& clip, const SharedMesh& mesh,
                                                        std::int64_t size_limit_bytes,
                                                        const Executor& executor) {
    const auto info = read_baseline_info(clip);
    if (!info) return tl::unexpected(info.error());
    const BaselineHeader header = *BaselineHeader::read(clip.payload(SectionId::kParameters));
    const bool is_chosen =
        header.predictor == GeometryPredictor::kLorenzo || header.predictor == GeometryPredictor::kReplica;
    if (clip.method == CodecMethod::kBaselineDynapack ? !is_chosen
                                                      : header.predictor != GeometryPredictor::kAuto)
        return fail(ErrorCode::kCorrupt, "the predictor is none of this coder's");
    // Of a sample its residual, which becomes its point, and its position.
    constexpr std::int64_t kBytesPerVertex = 512, kBytesPerSample = 24;
    if (auto good = check_size(clip, size_limit_bytes, kBytesPerVertex, kBytesPerSample); !good)
        return tl::unexpected(good.error());
    auto levels = decode_level_grid(clip.payload(SectionId::kResiduals), clip.frame_count, clip.vertex_count);
    if (!levels) return fail_within(section_name(SectionId::kResiduals), levels.error());
    Grid grid(std::move(*levels), clip.vertex_count);

    const MeshTraversal& traversal = mesh->traversal();
    if (clip.method == CodecMethod::kBaselineStatic) {
        executor.for_each(clip.frame_count, [&](std::int64_t f) {
            History history(grid.vertex_count(), 1);
            restore_frame(Rule::kSpace, f, traversal, history, grid);
        });
    } else {
        History history(grid.vertex_count(), 3);
        for (std::int64_t f = 0; f < clip.frame_count; ++f) {
            restore_frame(rule_of(clip.method, header, f), f, traversal, history, grid);
            history.next_frame();
        }
    }
    auto decoded = std::make_unique<KeptFrames>(*info);
    const MutablePositionsView frames = decoded->frames();
    const Lattice lattice(header.center, header.step());
    executor.for_each(clip.frame_count, [&](std::int64_t f) {
        for (std::size_t k = 0; k < grid.vertex_count(); ++k) {
            const std::int32_t* point = grid.at(f, k);
            lattice.to_world({point[0], point[1], point[2]}, frames.at(f, traversal.order[k]));
        }
    });
    return decoded;
}

}  // namespace batchenc
