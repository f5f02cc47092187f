#include "codecs/split_gates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "codecs/exact_vertex.h"
#include "codecs/integer_contexts.h"
#include "codecs/lattice.h"
#include "kernels/byte_stream.h"
#include "kernels/crc32c.h"
#include "kernels/split_prediction.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

/// step: of residuals, in 64ths of the bound.
Lattice lattice_of(const SplitHeader& header, std::uint8_t step) {
    return {header.center, header.bound * (step / 64.0) / kSplitParts};
}

/// Contexts of a clip: by which residual it is, and how large those of the neighbours, of the vertex in the
/// frames before, and before it of the same vertex are.
class SplitContexts {
 public:
    IntegerModel& of(const SplitTarget& target, std::size_t axis, const std::int32_t* residuals) {
        std::int64_t size = (expected(target, 0) + expected(target, 1)) / 2;
        const std::int64_t first = size_of(residuals[0]);
        if (axis == 1) size = (13 * size + 3 * first) / 16;
        if (axis == 2) size = (12 * expected(target, 2) + 2 * (first + size_of(residuals[1]))) / 16;
        const auto kind = static_cast<std::size_t>(target.axes);
        return scales_[kind][axis == 2].of(ScaleContexts::class_of_sixteenths(size));
    }
    IntegerModel& exact() { return exact_; }

 private:
    static constexpr std::int64_t kSizeUnit = 16;
    static std::int64_t size_of(std::int64_t residual) {
        return std::min<std::int64_t>(std::abs(residual) * kSizeUnit, 1 << 23);
    }
    /// What neighbours and frames before say together.
    static std::int64_t expected(const SplitTarget& target, std::size_t axis) {
        if (!target.has_neighbours) return target.past[axis];
        return (7 * std::int64_t{target.nearby[axis]} + 9 * std::int64_t{target.past[axis]}) / 16;
    }

    std::array<std::array<ScaleContexts, 2>, 3> scales_;  // by axes; tangential and normal
    IntegerModel exact_;
};

/// Checksum over the lattice points of the frames decoded so far: a machine that predicted otherwise finds
/// out.
std::uint32_t checksum_with(std::uint32_t before, std::span<const LatticePoint> points) {
    return crc32c({reinterpret_cast<const std::uint8_t*>(points.data()), points.size_bytes()}, before);
}

SplitPrediction make_prediction(const MeshTopology& mesh, const SplitHeader& header) {
    return {mesh.traversal(), mesh.surface_if(needs_surface(header.predictor, header.normal)),
            header.predictor, header.normal};
}

void start(SplitPrediction& state, const Lattice& lattice, const MeshTraversal& traversal,
           PositionsView decoded) {
    std::vector<LatticePoint> points(traversal.order.size());
    for (std::size_t k = 0; k < points.size(); ++k)
        points[k] = lattice.nearest_point(decoded.at(0, traversal.order[k]));
    state.start(points);
}

/// The two parts by themselves, with contexts as in the common stream.
class PartMeter {
 public:
    void add(const SplitTarget& target, std::size_t axis, const std::int32_t* residuals, std::int32_t value) {
        encoders_[axis == 2].encode(contexts_.of(target, axis, residuals), value);
    }
    void add_exact(std::int32_t value) { encoders_[0].encode(contexts_.exact(), value); }
    SplitBits finish() {
        return {8.0 * static_cast<double>(encoders_[0].finish().size()),
                8.0 * static_cast<double>(encoders_[1].finish().size())};
    }

 private:
    SplitContexts contexts_;
    std::array<RangeEncoder, 2> encoders_;
};

// Steps to choose from, in 64ths of the bound. At the largest one, 2 / sqrt(3) rounded, half the diagonal
// of a cell is the bound; below it more residuals keep the bound, among them more often zeros, which pays
// where most are zero.
constexpr std::array<std::uint8_t, 3> kSteps = {74, 62, 50};
constexpr std::uint8_t kLeastStep = 16, kLargestStep = 128;  // that a decoder takes
constexpr std::int64_t kRunsTried = 3, kFramesOfRun = 4;

/// A closed loop over the frames of a clip.
class GateEncoder {
 public:
    GateEncoder(const MeshTopology& mesh, const SplitHeader& header, std::uint8_t step)
        : traversal_(mesh.traversal()),
          step_(step),
          lattice_(lattice_of(header, step)),
          squared_bound_(header.bound * header.bound),
          squared_steps_((64.0 / step) * (64.0 / step)),
          state_(make_prediction(mesh, header)) {}

    std::vector<std::uint8_t> run(PositionsView positions, MutablePositionsView decoded, PartMeter* meter) {
        start(state_, lattice_, traversal_, decoded);
        std::uint32_t checksum = 0;
        for (std::int64_t f = 1; f < positions.frame_count(); ++f) {
            for (std::size_t k = 0; k < traversal_.order.size(); ++k) {
                const std::int32_t v = traversal_.order[k];
                encode_vertex(k, positions.at(f, v), decoded.at(f, v), meter);
            }
            checksum = checksum_with(checksum, state_.points());
            state_.next_frame();
        }
        ByteWriter out;
        out.put(step_);
        out.put(checksum);
        out.put_bytes(encoder_.finish());
        return out.take();
    }

 private:
    void encode_vertex(std::size_t k, const float* source, float* decoded, PartMeter* meter) {
        const SplitTarget target = state_.predict(k);
        const std::array<double, 3> place = lattice_.place_of(source);
        std::array<std::int32_t, 3> residuals{};
        LatticePoint point{};
        bool fits = false;
        // Distances in steps do not know of rounding, nor quite of arcs: then the nearest, then any.
        for (const double squared_steps : {squared_steps_, 0.0}) {
            residuals = state_.residuals_of(target, place, squared_steps);
            point = state_.reconstruct(target, residuals);
            lattice_.to_world(point, decoded);
            fits = squared_distance(decoded, source) <= squared_bound_;
            if (fits) break;
        }
        fits = fits || find_near(target, source, residuals, point, decoded);
        if (fits) {
            for (std::size_t a = 0; a < 3; ++a) {
                encoder_.encode(contexts_.of(target, a, residuals.data()), residuals[a]);
                if (meter) meter->add(target, a, residuals.data(), residuals[a]);
            }
        } else {
            encoder_.encode(contexts_.of(target, 0, residuals.data()), kExact);
            if (meter) meter->add(target, 0, residuals.data(), kExact);
            for (int c = 0; c < 3; ++c) {
                encoder_.encode(contexts_.exact(), bits_of(source[c]));
                if (meter) meter->add_exact(bits_of(source[c]));
            }
            std::copy_n(source, 3, decoded);
            residuals = {};
            point = lattice_.nearest_point(source);
        }
        state_.record(k, residuals, point);
    }

    /// Looks among the residuals around for some that keep the bound: where a cell's farthest point was
    /// rounded outwards, the cells beside it are as near.
    bool find_near(const SplitTarget& target, const float* source, std::array<std::int32_t, 3>& residuals,
                   LatticePoint& point, float* decoded) const {
        const std::array<std::int32_t, 3> middle = residuals;
        double least = std::numeric_limits<double>::infinity();
        for (std::int32_t n = 0; n < 27; ++n) {
            const std::array<std::int32_t, 3> trial = {middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1,
                                                       middle[2] + n / 9 - 1};
            const LatticePoint there = state_.reconstruct(target, trial);
            std::array<float, 3> world;
            lattice_.to_world(there, world.data());
            const double distance = squared_distance(world.data(), source);
            if (!(distance < least)) continue;
            least = distance;
            residuals = trial;
            point = there;
            std::copy(world.begin(), world.end(), decoded);
        }
        return least <= squared_bound_;
    }

    const MeshTraversal& traversal_;
    std::uint8_t step_;
    Lattice lattice_;
    double squared_bound_, squared_steps_;  // in world units; in steps
    SplitPrediction state_;
    SplitContexts contexts_;
    RangeEncoder encoder_;
};

/// The step that codes a few runs of frames in the fewest bytes. Runs after the first start from a frame of
/// the source. Overwrites frames of `decoded` after the first.
std::uint8_t choose_step(PositionsView positions, const MeshTopology& mesh, const SplitHeader& header,
                         MutablePositionsView decoded) {
    const std::int64_t frames = positions.frame_count();
    const std::int64_t runs = frames - 1 <= kRunsTried * kFramesOfRun ? 1 : kRunsTried;
    const std::int64_t length = runs == 1 ? frames : kFramesOfRun + 1;
    std::uint8_t best = kSteps[0];
    std::size_t least = std::numeric_limits<std::size_t>::max();
    for (const std::uint8_t step : kSteps) {
        std::size_t size = 0;
        for (std::int64_t r = 0; r < runs; ++r) {
            const std::int64_t begin = r * (frames - length) / std::max<std::int64_t>(runs - 1, 1);
            if (r > 0)
                std::copy_n(positions.at(begin, 0), 3 * positions.vertex_count(), decoded.at(begin, 0));
            size += GateEncoder(mesh, header, step)
                        .run(positions.frames(begin, begin + length),
                             {decoded.at(begin, 0), length, decoded.vertex_count()}, nullptr)
                        .size();
        }
        if (size >= least) continue;
        least = size;
        best = step;
    }
    return best;
}

}  // namespace

std::vector<std::uint8_t> encode_gates(PositionsView positions, const MeshTopology& mesh,
                                       const SplitHeader& header, MutablePositionsView decoded,
                                       SplitBits* bits) {
    const std::uint8_t best = choose_step(positions, mesh, header, decoded);
    PartMeter meter;
    std::vector<std::uint8_t> bytes =
        GateEncoder(mesh, header, best).run(positions, decoded, bits ? &meter : nullptr);
    if (bits) {
        const SplitBits parts = meter.finish();
        bits->tangential += parts.tangential;
        bits->normal += parts.normal;
    }
    return bytes;
}

Expected<void> decode_gates(std::span<const std::uint8_t> bytes, const MeshTopology& mesh,
                            const SplitHeader& header, MutablePositionsView decoded) {
    ByteReader reader(bytes);
    const auto step = reader.get<std::uint8_t>();
    const auto wanted_checksum = reader.get<std::uint32_t>();
    if (!wanted_checksum) return tl::unexpected(wanted_checksum.error());
    if (*step < kLeastStep || *step > kLargestStep) return corrupt("the step is outside its range");
    const auto payload = reader.get_bytes(reader.remaining());
    const auto samples = static_cast<std::uint64_t>(decoded.vertex_count()) *
                         static_cast<std::uint64_t>(decoded.frame_count() - 1);
    if (samples > max_symbol_count(payload->size())) return corrupt("more vertices than the bytes can hold");
    auto decoder = RangeDecoder::open(*payload);
    if (!decoder) return tl::unexpected(decoder.error());

    const MeshTraversal& traversal = mesh.traversal();
    const Lattice lattice = lattice_of(header, *step);
    SplitPrediction state = make_prediction(mesh, header);
    SplitContexts contexts;
    start(state, lattice, traversal, decoded);
    std::uint32_t checksum = 0;
    for (std::int64_t f = 1; f < decoded.frame_count(); ++f) {
        for (std::size_t k = 0; k < traversal.order.size(); ++k) {
            const SplitTarget target = state.predict(k);
            float* world = decoded.at(f, traversal.order[k]);
            std::array<std::int32_t, 3> residuals{};
            LatticePoint point;
            for (std::size_t a = 0; a < 3; ++a) {
                residuals[a] = decoder->decode(contexts.of(target, a, residuals.data()));
                if (residuals[0] == kExact) break;
            }
            if (residuals[0] == kExact) [[unlikely]] {
                for (int c = 0; c < 3; ++c) world[c] = float_of(decoder->decode(contexts.exact()));
                if (!std::isfinite(world[0]) || !std::isfinite(world[1]) || !std::isfinite(world[2]))
                    return corrupt("a vertex is not finite");
                residuals = {};
                point = lattice.nearest_point(world);
            } else {
                point = state.reconstruct(target, residuals);
                lattice.to_world(point, world);
            }
            state.record(k, residuals, point);
        }
        checksum = checksum_with(checksum, state.points());
        state.next_frame();
    }
    if (auto end = decoder->finish(); !end) return end;
    if (checksum != *wanted_checksum)
        return corrupt("the decoded positions do not have the checksum that the encoder saw");
    return {};
}

}  // namespace batchenc
