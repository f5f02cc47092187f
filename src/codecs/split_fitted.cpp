#include "codecs/split_fitted.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "codecs/exact_vertex.h"
#include "codecs/lattice.h"
#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "kernels/crc32c.h"
#include "kernels/motion_fit.h"
#include "kernels/range_coder.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

constexpr std::int32_t kFurthest = Lattice::kFurthest;

/// Whether a spacing and its inverse can be computed with; 0 means that all points are one.
bool is_step(double step) {
    return step == 0.0 || (step > 0.0 && std::isfinite(step) && std::isfinite(1.0 / step));
}

/// Runs of places, coded one behind the other: while one works on a frame, the one before it works on the
/// next.
std::vector<std::int64_t> stages_of(std::int64_t vertex_count, std::int64_t frame_count) {
    constexpr std::int64_t kSamplesAStage = 1 << 18, kMostStages = 4;
    const std::int64_t groups = (vertex_count + MotionFit::kGroup - 1) / MotionFit::kGroup;
    const std::int64_t count = std::clamp<std::int64_t>(vertex_count * frame_count / kSamplesAStage, 1,
                                                        std::min(kMostStages, groups));
    std::vector<std::int64_t> first;
    for (std::int64_t s = 0; s <= count; ++s)
        first.push_back(std::min(vertex_count, groups * s / count * MotionFit::kGroup));
    return first;
}

/// What both sides of a stage share.
struct Contexts {
    std::vector<IntegerModel> models;
    IntegerModel exact;

    Contexts() {
        for (std::size_t c = 0; c < MotionFit::kContexts; ++c)
            models.emplace_back(MotionFit::magnitude_of_class(c / MotionFit::kFractions));
    }
    /// A residual is turned over where the prediction lies below the lattice point that it is rounded to, so
    /// that one side is always the likelier.
    static std::int32_t turned(std::int32_t residual, float fraction) {
        return fraction < 0.0f ? static_cast<std::int32_t>(0u - static_cast<std::uint32_t>(residual))
                               : residual;
    }
};

/// The pipeline of both sides: calls code_batch(stage, frame, first, count, batch) for all places of all
/// frames 1 … in an order in which predictions are known; it fills the points of the batch.
class Pipeline {
 public:
    Pipeline(const MeshTopology& mesh, const Lattice& lattice, MutablePositionsView decoded,
             const Executor& executor)
        : decoded_(decoded),
          executor_(executor),
          stages_(stages_of(decoded.vertex_count(), decoded.frame_count())),
          neighbours_(MotionNeighbours::of(
              mesh, {decoded.data(), static_cast<std::size_t>(3 * decoded.vertex_count())}, executor)) {
        const auto vertex_count = static_cast<std::size_t>(decoded.vertex_count());
        std::vector<LatticePoint> whole(vertex_count);
        std::vector<float> rest(3 * vertex_count);
        for (std::size_t v = 0; v < vertex_count; ++v) {
            const float* world = decoded.at(0, static_cast<std::int64_t>(v));
            whole[v] = lattice.nearest_point(world);
            for (std::size_t c = 0; c < 3; ++c) {
                const double left = lattice.place_of(world[c], c) - static_cast<double>(whole[v][c]);
                rest[3 * v + c] = static_cast<float>(std::clamp(left, -0.5, 0.5));
            }
        }
        fit_ = std::make_unique<MotionFit>(neighbours_, whole, rest, stage_count() + 1);
    }

    std::int64_t stage_count() const { return static_cast<std::int64_t>(stages_.size()) - 1; }
    /// Vertices of a stage.
    std::int64_t size_of(std::int64_t stage) const {
        const auto s = static_cast<std::size_t>(stage);
        return stages_[s + 1] - stages_[s];
    }
    std::int32_t vertex_at(std::int64_t place) const {
        return neighbours_.order[static_cast<std::size_t>(place)];
    }

    template <typename CodeBatch>
    void run(CodeBatch code_batch) {
        const std::int64_t frame_count = decoded_.frame_count();
        for (std::int64_t time = 1; time < frame_count + stage_count() - 1; ++time) {
            executor_.for_each(stage_count(), [&](std::int64_t stage) {
                const std::int64_t frame = time - stage;
                if (frame >= 1 && frame < frame_count) run_stage(stage, frame, code_batch);
            });
        }
    }

 private:
    template <typename CodeBatch>
    void run_stage(std::int64_t stage, std::int64_t frame, CodeBatch& code_batch) {
        MotionFit::Batch batch;
        const std::int64_t begin = stages_[static_cast<std::size_t>(stage)];
        const std::int64_t end = stages_[static_cast<std::size_t>(stage) + 1];
        auto level_end = neighbours_.level_first.begin() + 1;
        for (std::int64_t first = begin; first < end;) {
            while (*level_end <= first) ++level_end;
            const bool is_coarse = level_end == neighbours_.level_first.begin() + 1;
            const std::int64_t most = is_coarse ? 1 : static_cast<std::int64_t>(MotionFit::kBatch);
            const std::int64_t count = std::min({most, std::int64_t{*level_end} - first, end - first});
            fit_->predict(frame, first, count, batch);
            code_batch(stage, frame, first, count, batch);
            fit_->record(frame, first, count, batch);
            first += count;
        }
        fit_->fit(frame, begin / MotionFit::kGroup, (end + MotionFit::kGroup - 1) / MotionFit::kGroup);
    }

    MutablePositionsView decoded_;
    const Executor& executor_;
    std::vector<std::int64_t> stages_;
    MotionNeighbours neighbours_;
    std::unique_ptr<MotionFit> fit_;
};

/// Adds lattice points to a checksum: a machine that predicted otherwise finds out.
void add_points(const MotionFit::Batch& batch, std::int64_t count, std::uint32_t& checksum) {
    checksum = crc32c({reinterpret_cast<const std::uint8_t*>(batch.point),
                       static_cast<std::size_t>(count) * sizeof(batch.point[0])},
                      checksum);
}

/// Chooses lattice points for sources.
class Chooser {
 public:
    Chooser(const SplitHeader& header, const Lattice& lattice, double slack)
        : lattice_(lattice), squared_bound_(header.bound * header.bound) {
        const double radius = std::max(0.0, header.bound - slack) * lattice.per_unit();
        squared_radius_ = static_cast<float>(radius * radius * (1.0 - 1e-6));
    }

    /// Of the corners of the cell around the source, the one nearest to the prediction that is within the
    /// bound; fills `point` and `world`. False where none is.
    bool choose(const float* source, const MotionFit::Batch& batch, std::int64_t k, std::int32_t* point,
                float* world) const {
        float away[2][3], cost[2][3];  // squared: of both ends of the cell from the source, the prediction
        std::int32_t low[3];
        for (std::size_t c = 0; c < 3; ++c) {
            const double place = lattice_.place_of(source[c], c);
            if (!(place > -kFurthest && place < kFurthest)) return false;
            low[c] = static_cast<std::int32_t>(place);
            if (static_cast<double>(low[c]) > place) --low[c];  // rounded down, without a call
            const auto inside = static_cast<float>(place - static_cast<double>(low[c]));
            away[0][c] = inside * inside;
            away[1][c] = (1.0f - inside) * (1.0f - inside);
            const float ahead = static_cast<float>(low[c] - batch.whole[k][c]) - batch.fraction[k][c];
            cost[0][c] = ahead * ahead;
            cost[1][c] = (ahead + 1.0f) * (ahead + 1.0f);
        }
        // Mostly the corner nearest to the prediction is within the bound.
        const auto is_within = [&](int corner) {
            return away[corner & 1][0] + away[corner >> 1 & 1][1] + away[corner >> 2][2] <= squared_radius_;
        };
        int best = nearer_corner(cost);
        if (!is_within(best)) {
            best = nearer_corner(away);  // where none is surely within the bound, this one may still be
            float least = std::numeric_limits<float>::infinity();
            for (int corner = 0; corner < 8; ++corner) {
                const float its_cost = cost[corner & 1][0] + cost[corner >> 1 & 1][1] + cost[corner >> 2][2];
                if (its_cost < least && is_within(corner)) {
                    least = its_cost;
                    best = corner;
                }
            }
        }
        for (std::size_t c = 0; c < 3; ++c) {
            point[c] = low[c] + (best >> c & 1);
            world[c] = lattice_.to_world(point[c], c);
        }
        return squared_distance(world, source) <= squared_bound_;
    }

 private:
    /// Bit c: whether the upper end along axis c is the nearer one.
    static int nearer_corner(const float (&squared)[2][3]) {
        int corner = 0;
        for (std::size_t c = 0; c < 3; ++c) corner |= squared[1][c] < squared[0][c] ? 1 << c : 0;
        return corner;
    }

    const Lattice& lattice_;
    double squared_bound_;
    float squared_radius_;
};

struct EncodingStage {
    RangeEncoder encoder;
    Contexts contexts;
    std::uint32_t checksum = 0;
};

struct DecodingStage {
    RangeDecoder decoder;
    Contexts contexts;
    std::uint32_t checksum = 0;
    std::uint32_t checksum_seen = 0;
    bool is_corrupt = false;
};

/// Distance that rounding to float32 can move a vertex.
double rounding_of(const PositionsView& positions) {
    const BoundingBox box = bounding_box(positions);
    float largest = 0.0f;
    for (std::size_t c = 0; c < 3; ++c)
        largest = std::max({largest, std::abs(box.low[c]), std::abs(box.high[c])});
    return 1.75 * static_cast<double>(largest) / (1 << 24);
}

}  // namespace

std::vector<std::uint8_t> encode_fitted(PositionsView positions, const MeshTopology& mesh,
                                        const SplitHeader& header, MutablePositionsView decoded,
                                        const Executor& executor) {
    // The half diagonal of a cell is the bound, less what float32 takes of it.
    const double slack = rounding_of(positions);
    const double radius = header.bound > 2.0 * slack ? header.bound - slack : header.bound;
    const double step = radius * (2.0 / std::sqrt(3.0)) * (1.0 - 1e-6);
    const Lattice lattice(header.center, is_step(step) ? step : 0.0);
    const Chooser chooser(header, lattice, slack);
    Pipeline pipeline(mesh, lattice, decoded, executor);
    std::vector<EncodingStage> stages(static_cast<std::size_t>(pipeline.stage_count()));
    for (std::size_t s = 0; s < stages.size(); ++s)
        stages[s].encoder.reserve(static_cast<std::size_t>(
            3 * pipeline.size_of(static_cast<std::int64_t>(s)) * (positions.frame_count() - 1)));
    pipeline.run([&](std::int64_t s, std::int64_t frame, std::int64_t first, std::int64_t count,
                     MotionFit::Batch& batch) {
        EncodingStage& stage = stages[static_cast<std::size_t>(s)];
        for (std::int64_t k = 0; k < count; ++k) {
            const std::int64_t v = pipeline.vertex_at(first + k);
            const float* source = positions.at(frame, v);
            float* world = decoded.at(frame, v);
            std::int32_t* point = batch.point[k];
            const auto model = [&](std::size_t c) -> IntegerModel& {
                return stage.contexts.models[static_cast<std::size_t>(batch.context[k][c])];
            };
            point[3] = 0;
            if (!chooser.choose(source, batch, k, point, world)) [[unlikely]] {
                stage.encoder.encode(model(0), kExact);
                for (std::size_t c = 0; c < 3; ++c) {
                    stage.encoder.encode(stage.contexts.exact, bits_of(source[c]));
                    world[c] = source[c];
                }
                std::copy_n(lattice.nearest_point(source).begin(), 3, point);
                continue;
            }
            for (std::size_t c = 0; c < 3; ++c)
                stage.encoder.encode(model(c),
                                     Contexts::turned(point[c] - batch.whole[k][c], batch.fraction[k][c]));
        }
        add_points(batch, count, stage.checksum);
    });

    std::vector<std::vector<std::uint8_t>> streams(stages.size());
    executor.for_each(pipeline.stage_count(), [&](std::int64_t s) {
        streams[static_cast<std::size_t>(s)] = stages[static_cast<std::size_t>(s)].encoder.finish();
    });
    ByteWriter out;
    out.put(lattice.spacing());
    for (std::size_t s = 0; s < stages.size(); ++s) {
        out.put(stages[s].checksum);
        out.put_varint(streams[s].size());
    }
    for (const auto& stream : streams) out.put_bytes(stream);
    return out.take();
}

Expected<void> decode_fitted(std::span<const std::uint8_t> bytes, const MeshTopology& mesh,
                             const SplitHeader& header, MutablePositionsView decoded,
                             const Executor& executor) {
    ByteReader reader(bytes);
    const auto step = reader.get<double>();
    if (!step) return tl::unexpected(step.error());
    if (!is_step(*step)) return corrupt("a parameter is outside its range");
    const auto stage_count = stages_of(decoded.vertex_count(), decoded.frame_count()).size() - 1;
    std::vector<std::uint32_t> checksums;
    std::vector<std::uint64_t> sizes;
    for (std::size_t s = 0; s < stage_count; ++s) {
        const auto checksum = reader.get<std::uint32_t>();
        if (!checksum) return tl::unexpected(checksum.error());
        const auto size = reader.get_varint(bytes.size());
        if (!size) return tl::unexpected(size.error());
        checksums.push_back(*checksum);
        sizes.push_back(*size);
    }
    std::vector<DecodingStage> stages;
    for (std::size_t s = 0; s < stage_count; ++s) {
        const auto stream = reader.get_bytes(sizes[s]);
        if (!stream) return tl::unexpected(stream.error());
        auto decoder = RangeDecoder::open(*stream);
        if (!decoder) return tl::unexpected(decoder.error());
        stages.push_back({*decoder, {}, checksums[s]});
    }
    if (reader.remaining() != 0) return corrupt("bytes left over");

    const Lattice lattice(header.center, *step);
    Pipeline pipeline(mesh, lattice, decoded, executor);
    pipeline.run([&](std::int64_t s, std::int64_t frame, std::int64_t first, std::int64_t count,
                     MotionFit::Batch& batch) {
        DecodingStage& stage = stages[static_cast<std::size_t>(s)];
        RangeDecoder decoder = stage.decoder;  // a local copy stays in registers
        for (std::int64_t k = 0; k < count; ++k) {
            float* world = decoded.at(frame, pipeline.vertex_at(first + k));
            std::int32_t* point = batch.point[k];
            point[3] = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const std::int32_t residual =
                    decoder.decode(stage.contexts.models[static_cast<std::size_t>(batch.context[k][c])]);
                if (c == 0 && residual == kExact) [[unlikely]] {
                    for (std::size_t a = 0; a < 3; ++a) {
                        world[a] = float_of(decoder.decode(stage.contexts.exact));
                        if (!std::isfinite(world[a])) {
                            stage.is_corrupt = true;
                            world[a] = 0.0f;
                        }
                    }
                    std::copy_n(lattice.nearest_point(world).begin(), 3, point);
                    break;
                }
                const auto sum = static_cast<std::int32_t>(
                    static_cast<std::uint32_t>(batch.whole[k][c]) +
                    static_cast<std::uint32_t>(Contexts::turned(residual, batch.fraction[k][c])));
                point[c] = std::clamp(sum, -kFurthest, kFurthest);
                world[c] = lattice.to_world(point[c], c);
            }
        }
        stage.decoder = decoder;
        add_points(batch, count, stage.checksum_seen);
    });
    for (const DecodingStage& stage : stages) {
        if (auto whole = stage.decoder.finish(); !whole) return whole;
        if (stage.is_corrupt) return corrupt("a vertex is not finite");
        if (stage.checksum != stage.checksum_seen)
            return corrupt("the decoded positions do not have the checksum that the encoder saw");
    }
    return {};
}

}  // namespace batchenc
