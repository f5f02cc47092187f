#include "codecs/baselines/octree_motion.h"

#include <Eigen/Dense>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "codecs/baselines/baseline_header.h"
#include "codecs/baselines/baselines.h"
#include "codecs/first_frame.h"
#include "codecs/kept_frames.h"
#include "codecs/lattice.h"
#include "kernels/range_coder.h"
#include "kernels/temporal_series.h"

namespace batchenc {
namespace {

/// Decoded vertices live on a lattice of whole units, this many a step.
constexpr double kUnits = 256.0;
/// Motion vectors are of so many units.
constexpr std::int64_t kVectorUnits = 128;
/// Coordinates stay within this many units of the clip's centre, whatever a stream says.
constexpr std::int64_t kFarthest = std::int64_t{1} << 30;
/// Cells that are not divided any more.
constexpr int kMostDepth = 12;
/// Vertices of a cell at most whose vectors are coded one by one, rather than dividing it.
constexpr std::size_t kFew = 12;

using Vector = std::array<std::int32_t, 3>;
using Weights = std::array<double, 8>;

/// How the motion of a cell's vertices is coded. The numbers stand in bitstreams.
enum class CellMode : std::int32_t {
    kDivided = 0,    ///< its children's
    kMean = 1,       ///< one vector for all
    kTrilinear = 2,  ///< interpolated between vectors at the eight corners (2.6)
    kDirect = 3,     ///< a vector for each
};

struct Cell {
    std::array<std::int64_t, 3> low{};  ///< beyond 32 bits in cubes around what a corrupt stream spreads out
    std::int64_t side = 1;              ///< units; a multiple of 2^(kMostDepth - depth)
    int depth = 0;
    std::span<std::int32_t> members;  ///< vertices
};

/// What encoder and decoder know alike: the frame before, the frame as far as it is decoded, contexts.
class OctreeMotion {
 public:
    /// first: V points in units.
    OctreeMotion(std::vector<Vector> first, const std::vector<std::int32_t>& order)
        : before_(std::move(first)),
          now_(before_),
          members_(order),
          sorted_(order.size()),
          modes_(kMostDepth + 1),
          vectors_(3) {
        for (auto& of_depth : modes_)
            for (IntegerModel& model : of_depth) model = IntegerModel(1.0);
        for (std::size_t mode = 0; mode < vectors_.size(); ++mode)
            for (std::size_t c = 0; c < kSizes; ++c)
                vectors_[mode][c] = IntegerModel(std::ldexp(0.3, static_cast<int>(c)));
    }

    const Vector& before(std::int32_t v) const { return before_[static_cast<std::size_t>(v)]; }
    const Vector& now(std::int32_t v) const { return now_[static_cast<std::size_t>(v)]; }

    /// The cube around the frame before.
    Cell root() {
        Cell cell;
        cell.members = members_;
        Vector low = before_.front(), high = low;
        for (const Vector& point : before_) {
            for (std::size_t c = 0; c < 3; ++c) {
                low[c] = std::min(low[c], point[c]);
                high[c] = std::max(high[c], point[c]);
            }
        }
        for (std::size_t c = 0; c < 3; ++c) {
            cell.low[c] = low[c];
            cell.side = std::max(cell.side, std::int64_t{high[c]} - low[c] + 1);
        }
        constexpr std::int64_t kMultiple = std::int64_t{1} << kMostDepth;
        cell.side = (cell.side + kMultiple - 1) / kMultiple * kMultiple;
        return cell;
    }

    /// The eight children, some without members, which are sorted into them.
    std::array<Cell, 8> children(const Cell& cell) {
        std::array<Cell, 8> children;
        std::array<std::size_t, 9> first{};
        const std::int64_t half = cell.side / 2;
        const auto child_of = [&](std::int32_t v) {
            std::size_t child = 0;
            for (std::size_t c = 0; c < 3; ++c) child |= std::size_t{before(v)[c] - cell.low[c] >= half} << c;
            return child;
        };
        for (const std::int32_t v : cell.members) ++first[child_of(v) + 1];
        std::partial_sum(first.begin(), first.end(), first.begin());
        std::array<std::size_t, 9> next = first;
        for (const std::int32_t v : cell.members) sorted_[next[child_of(v)]++] = v;
        std::copy_n(sorted_.begin(), cell.members.size(), cell.members.begin());
        for (std::size_t child = 0; child < 8; ++child) {
            for (std::size_t c = 0; c < 3; ++c)
                children[child].low[c] = cell.low[c] + ((child >> c & 1) != 0 ? half : 0);
            children[child].side = half;
            children[child].depth = cell.depth + 1;
            children[child].members = cell.members.subspan(first[child], first[child + 1] - first[child]);
        }
        return children;
    }

    /// What each corner of a cell counts for a vertex; corner c is at the far side of the axes in c.
    Weights weights(const Cell& cell, std::int32_t v) const {
        Weights weights;
        weights.fill(1.0);
        for (std::size_t c = 0; c < 3; ++c) {
            const double far =
                static_cast<double>(before(v)[c] - cell.low[c]) / static_cast<double>(cell.side);
            for (std::size_t corner = 0; corner < 8; ++corner)
                weights[corner] *= (corner >> c & 1) != 0 ? far : 1.0 - far;
        }
        return weights;
    }

    static std::size_t vector_count(const Cell& cell, CellMode mode) {
        return mode == CellMode::kDirect ? cell.members.size() : mode == CellMode::kTrilinear ? 8 : 1;
    }

    /// Moves a cell's vertices.
    void apply(const Cell& cell, CellMode mode, std::span<const Vector> vectors) {
        for (std::size_t k = 0; k < cell.members.size(); ++k) {
            const std::int32_t v = cell.members[k];
            Vector& point = now_[static_cast<std::size_t>(v)];
            if (mode == CellMode::kTrilinear) {
                const Weights w = weights(cell, v);
                for (std::size_t c = 0; c < 3; ++c) {
                    double sum = 0.0;
                    for (std::size_t corner = 0; corner < 8; ++corner)
                        sum += w[corner] * static_cast<double>(vectors[corner][c]);
                    const double units = std::floor(sum * static_cast<double>(kVectorUnits) + 0.5);
                    point[c] = moved(before(v)[c], static_cast<std::int64_t>(units));
                }
            } else {
                const Vector& vector = vectors[mode == CellMode::kDirect ? k : 0];
                for (std::size_t c = 0; c < 3; ++c) point[c] = moved(before(v)[c], vector[c] * kVectorUnits);
            }
        }
    }

    void end_frame() { before_ = now_; }

    /// Codes a number or gives what was coded: code(model, value).
    template <typename Code>
    std::int32_t code_mode(const Cell& cell, std::int32_t mode, Code code) {
        const std::size_t size = cell.members.size();
        const std::size_t count = size == 1 ? 0 : size <= kFew ? 1 : 2;
        return code(modes_[static_cast<std::size_t>(cell.depth)][count], mode);
    }

    /// Codes a cell's vectors, or sets them to what was coded: each against one before it, a corner against
    /// the one along an edge, in a context by the size of the last difference.
    template <typename Code>
    void code_vectors(CellMode mode, std::span<Vector> vectors, Code code) {
        auto& models = vectors_[static_cast<std::size_t>(mode) - 1];
        for (std::size_t k = 0; k < vectors.size(); ++k) {
            const bool is_beside = mode == CellMode::kTrilinear && k > 0;
            const Vector predicted = is_beside ? vectors[k & (k - 1)] : last_;
            IntegerModel& model = models[last_size_];
            std::uint32_t size = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const auto difference = static_cast<std::int32_t>(static_cast<std::uint32_t>(vectors[k][c]) -
                                                                  static_cast<std::uint32_t>(predicted[c]));
                const std::int32_t coded = code(model, difference);
                vectors[k][c] = wrapping_sum(predicted[c], coded);
                const auto bits = static_cast<std::uint32_t>(coded);
                size += std::min(coded < 0 ? 0u - bits : bits, 1u << kSizes);
            }
            last_size_ = std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(size)), kSizes - 1);
            last_ = vectors[k];
        }
        if (mode != CellMode::kTrilinear) return;
        for (std::size_t c = 0; c < 3; ++c) {
            std::int64_t sum = 0;
            for (const Vector& vector : vectors) sum += vector[c];
            last_[c] = static_cast<std::int32_t>(sum / 8);
        }
    }

 private:
    static constexpr std::size_t kSizes = 12;

    static std::int32_t moved(std::int32_t from, std::int64_t by) {
        return static_cast<std::int32_t>(std::clamp(from + by, -kFarthest, kFarthest));
    }

    std::vector<Vector> before_, now_;
    std::vector<std::int32_t> members_, sorted_;
    std::vector<std::array<IntegerModel, 3>> modes_;         // of each depth
    std::vector<std::array<IntegerModel, kSizes>> vectors_;  // of each mode with vectors
    Vector last_{};
    std::size_t last_size_ = 0;
};

/// Of decoded vertices: whole units about the centre of the clip's box.
Lattice unit_lattice(const BaselineHeader& header) { return {header.center, header.step() / kUnits}; }

std::vector<Vector> nearest_points(const Lattice& lattice, std::span<const float> positions) {
    std::vector<Vector> points(positions.size() / 3);
    for (std::size_t v = 0; v < points.size(); ++v) points[v] = lattice.nearest_point(&positions[3 * v]);
    return points;
}

class OctreeEncoder {
 public:
    OctreeEncoder(const Lattice& lattice, OctreeMotion& motion) : lattice_(lattice), motion_(motion) {}

    void encode_frame(PositionsView frame) {
        frame_ = frame;
        encode(motion_.root());
        motion_.end_frame();
    }
    std::vector<std::uint8_t> finish() { return encoder_.finish(); }

 private:
    using Target = std::array<double, 3>;

    void encode(const Cell& cell) {
        std::vector<Vector> vectors;
        const CellMode mode = choose(cell, vectors);
        const auto code = [&](IntegerModel& model, std::int32_t value) {
            encoder_.encode(model, value);
            return value;
        };
        motion_.code_mode(cell, static_cast<std::int32_t>(mode), code);
        if (mode != CellMode::kDivided) return motion_.code_vectors(mode, vectors, code);
        for (const Cell& child : motion_.children(cell))
            if (!child.members.empty()) encode(child);
    }

    /// The way with the fewest vectors that leaves every vertex within a step of its source; moves them.
    CellMode choose(const Cell& cell, std::vector<Vector>& vectors) {
        const std::size_t size = cell.members.size();
        Target mean{};
        for (const std::int32_t v : cell.members) {
            const Target change = change_of(v);
            for (std::size_t c = 0; c < 3; ++c) mean[c] += change[c] / static_cast<double>(size);
        }
        vectors = {rounded(mean)};
        if (is_good(cell, CellMode::kMean, vectors)) return CellMode::kMean;
        if (size > kFew) {
            vectors = corner_vectors(cell, mean);
            if (is_good(cell, CellMode::kTrilinear, vectors)) return CellMode::kTrilinear;
            if (cell.depth < kMostDepth) return CellMode::kDivided;
        }
        vectors.clear();
        for (const std::int32_t v : cell.members) vectors.push_back(rounded(change_of(v)));
        motion_.apply(cell, CellMode::kDirect, vectors);
        return CellMode::kDirect;
    }

    /// From the decoded frame before to the source, in quanta of motion vectors.
    Target change_of(std::int32_t v) const {
        Target change;
        for (std::size_t c = 0; c < 3; ++c)
            change[c] = (lattice_.place_of(frame_.at(0, v)[c], c) - motion_.before(v)[c]) / kVectorUnits;
        return change;
    }
    static Vector rounded(const Target& vector) {
        constexpr double kEnd = 1 << 29;
        Vector whole;
        for (std::size_t c = 0; c < 3; ++c)
            whole[c] = static_cast<std::int32_t>(std::clamp(std::floor(vector[c] + 0.5), -kEnd, kEnd));
        return whole;
    }

    /// Moves the vertices and looks whether all of them are within a step of their sources.
    bool is_good(const Cell& cell, CellMode mode, std::span<const Vector> vectors) {
        motion_.apply(cell, mode, vectors);
        return std::all_of(cell.members.begin(), cell.members.end(), [&](std::int32_t v) {
            double sum = 0.0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double d = lattice_.place_of(frame_.at(0, v)[c], c) - motion_.now(v)[c];
                sum += d * d;
            }
            return sum <= kUnits * kUnits;
        });
    }

    /// The least squares of the vertices' motion, with a ridge towards their mean for corners that no vertex
    /// is near.
    std::vector<Vector> corner_vectors(const Cell& cell, const Target& mean) const {
        Eigen::Matrix<double, 8, 8> normal =
            Eigen::Matrix<double, 8, 8>::Identity() * (1e-4 * static_cast<double>(cell.members.size()));
        Eigen::Matrix<double, 8, 3> right = Eigen::Matrix<double, 8, 3>::Zero();
        for (const std::int32_t v : cell.members) {
            const Weights weights = motion_.weights(cell, v);
            const Target change = change_of(v);
            const Eigen::Map<const Eigen::Matrix<double, 8, 1>> w(weights.data());
            normal.noalias() += w * w.transpose();
            right.noalias() +=
                w * Eigen::RowVector3d(change[0] - mean[0], change[1] - mean[1], change[2] - mean[2]);
        }
        const Eigen::Matrix<double, 8, 3> corners = normal.ldlt().solve(right);
        std::vector<Vector> vectors;
        for (int corner = 0; corner < 8; ++corner)
            vectors.push_back(rounded(
                {mean[0] + corners(corner, 0), mean[1] + corners(corner, 1), mean[2] + corners(corner, 2)}));
        return vectors;
    }

    const Lattice& lattice_;
    OctreeMotion& motion_;
    PositionsView frame_;
    RangeEncoder encoder_;
};

/// Decodes a cell and those in it; false when the stream is seen to be corrupt.
bool decode_cell(RangeDecoder& decoder, OctreeMotion& motion, const Cell& cell,
                 std::vector<Vector>& vectors) {
    const auto code = [&](IntegerModel& model, std::int32_t) { return decoder.decode(model); };
    const std::int32_t number = motion.code_mode(cell, 0, code);
    if (number < 0 || number > static_cast<std::int32_t>(CellMode::kDirect)) return false;
    const auto mode = static_cast<CellMode>(number);
    if (mode == CellMode::kDivided) {
        if (cell.depth == kMostDepth) return false;
        for (const Cell& child : motion.children(cell))
            if (!child.members.empty() && !decode_cell(decoder, motion, child, vectors)) return false;
        return true;
    }
    vectors.assign(OctreeMotion::vector_count(cell, mode), {});
    motion.code_vectors(mode, vectors, code);
    motion.apply(cell, mode, vectors);
    return true;
}

}  // namespace

Expected<EncodedClip> encode_octree_motion(PositionsView positions, const MeshTopology& mesh,
                                           const BaselineHeader& header, const Executor& executor) {
    auto first = encode_first_frame(positions, mesh, 0.5 * header.step(), executor);
    if (!first) return tl::unexpected(first.error());
    const Lattice lattice = unit_lattice(header);
    OctreeMotion motion(nearest_points(lattice, first->positions), mesh.traversal().order);
    OctreeEncoder encoder(lattice, motion);
    for (std::int64_t f = 1; f < positions.frame_count(); ++f)
        encoder.encode_frame(positions.frames(f, f + 1));
    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kFrames, std::move(first->bitstream));
    sections.emplace_back(SectionId::kResiduals, encoder.finish());
    EncodedClip clip;
    clip.bitstream = write_clip_bitstream(CodecMethod::kBaselineOctree, positions.vertex_count(),
                                          positions.frame_count(), sections);
    return clip;
}

Expected<std::unique_ptr<DecodedClip>> decode_octree_motion(const ClipBitstream& clip, const SharedMesh& mesh,
                                                            std::int64_t size_limit_bytes,
                                                            const Executor& executor) {
    const auto info = read_baseline_info(clip);
    if (!info) return tl::unexpected(info.error());
    const BaselineHeader header = *BaselineHeader::read(clip.payload(SectionId::kParameters));
    constexpr std::int64_t kBytesPerVertex = 1024, kBytesPerSample = 12;
    if (auto good = check_size(clip, size_limit_bytes, kBytesPerVertex, kBytesPerSample); !good)
        return tl::unexpected(good.error());
    const auto bytes = clip.payload(SectionId::kResiduals);
    // Every frame but the first has a cell with a vector.
    if (static_cast<std::uint64_t>(clip.frame_count - 1) > max_symbol_count(bytes.size()))
        return fail(ErrorCode::kCorrupt, "more frames than the bytes can hold");
    auto decoded = std::make_unique<KeptFrames>(*info);
    const MutablePositionsView frames = decoded->frames();
    if (auto done = decode_first_frame(clip.payload(SectionId::kFrames), *mesh, size_limit_bytes,
                                       {frames.data(), 1, clip.vertex_count}, executor);
        !done)
        return fail_within(section_name(SectionId::kFrames), done.error());
    if (clip.frame_count == 1) {
        if (!bytes.empty()) return fail(ErrorCode::kCorrupt, "one frame has no motion");
        return decoded;
    }
    const Lattice lattice = unit_lattice(header);
    OctreeMotion motion(
        nearest_points(lattice, {frames.data(), static_cast<std::size_t>(3 * clip.vertex_count)}),
        mesh->traversal().order);
    auto decoder = RangeDecoder::open(bytes);
    if (!decoder) return fail_within(section_name(SectionId::kResiduals), decoder.error());
    std::vector<Vector> vectors;
    for (std::int64_t f = 1; f < clip.frame_count; ++f) {
        if (!decode_cell(*decoder, motion, motion.root(), vectors))
            return fail(ErrorCode::kCorrupt, "an octree does not decode",
                        section_name(SectionId::kResiduals));
        motion.end_frame();
        for (std::int32_t v = 0; v < clip.vertex_count; ++v) lattice.to_world(motion.now(v), frames.at(f, v));
    }
    if (auto whole = decoder->finish(); !whole)
        return fail_within(section_name(SectionId::kResiduals), whole.error());
    return decoded;
}

}  // namespace batchenc
