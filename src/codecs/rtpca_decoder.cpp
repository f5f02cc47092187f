#include <algorithm>
#include <cmath>
#include <limits>

#include "codecs/coded_segmentation.h"
#include "codecs/corrections.h"
#include "codecs/rtpca.h"
#include "codecs/rtpca_layout.h"
#include "kernels/byte_stream.h"
#include "kernels/trajectory_sum.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

class RtpcaClip final : public DecodedClip {
 public:
    const ClipInfo& info() const override { return info_; }
    const std::vector<std::int32_t>& labels() const override { return labels_; }

    Expected<void> decode(const ClipBitstream& clip, const MeshTopology& mesh, std::int32_t components,
                          std::int64_t size_limit_bytes, const Executor& executor);
    Expected<void> reconstruct(std::int64_t begin, MutablePositionsView out,
                               const Executor& executor) const override;
    const std::vector<BodyTrack>& tracks() const { return tracks_; }

 private:
    struct Cluster {
        std::vector<std::int32_t> vertices;  // ascending
        std::vector<float> fields;           // see TrajectoryCluster
        std::vector<std::vector<float>>
            basis;  // of each component 3F floats, world units a coefficient's step
        std::int64_t size() const { return static_cast<std::int64_t>(vertices.size()); }
    };

    Expected<void> decode_bodies(std::span<const std::uint8_t> payload);
    /// The list of components that its section starts with; leaves the reader behind it.
    Expected<void> decode_list(ByteReader& reader, std::int64_t size_limit_bytes);
    /// Keeps the first so many components, or all, and makes room for them.
    Expected<void> make_room(std::int32_t components, std::int64_t size_limit_bytes);
    Expected<void> decode_shape(std::span<const std::uint8_t> stream, const MeshTopology& mesh,
                                std::vector<float>& shape);
    bool decode_basis(std::span<const std::uint8_t> bytes, const std::vector<std::int32_t>& stream,
                      const TrackTransform& transform);
    bool decode_fields(std::span<const std::uint8_t> bytes, const std::vector<std::int32_t>& stream,
                       const std::vector<FieldOrder>& orders);
    Expected<void> decode_components(const ClipBitstream& clip, const MeshTopology& mesh,
                                     std::int32_t components, std::int64_t size_limit_bytes,
                                     const Executor& executor);
    void set_field(std::size_t cluster, std::int32_t vertex, std::size_t field, float value) {
        Cluster& c = clusters_[cluster];
        c.fields[TrajectoryCluster::field_index(slots_[static_cast<std::size_t>(vertex)],
                                                static_cast<std::int64_t>(field),
                                                static_cast<std::int64_t>(c.basis.size()))] = value;
    }
    bool is_whole() const { return static_cast<std::int64_t>(components_.size()) == header_.component_count; }
    /// What each field of a cluster adds to x, y and z in a frame, and where they start; see
    /// sum_trajectories.
    void weigh(std::size_t cluster, std::size_t frame, std::vector<float>& weights,
               std::array<float, 3>& origin) const;

    ClipInfo info_;
    RtpcaHeader header_;
    std::vector<std::int32_t> labels_;
    std::vector<Cluster> clusters_;
    std::vector<std::int64_t> slots_;         // of each vertex among those of its cluster
    std::vector<BodyTrack> tracks_;           // N
    std::vector<RtpcaComponent> components_;  // those that are used
    Corrections corrections_;
};

Expected<void> RtpcaClip::decode(const ClipBitstream& clip, const MeshTopology& mesh, std::int32_t components,
                                 std::int64_t size_limit_bytes, const Executor& executor) {
    auto info = read_rtpca_info(clip);
    if (!info) return tl::unexpected(info.error());
    info_ = *info;
    auto header = RtpcaHeader::read(clip.payload(SectionId::kParameters), clip.vertex_count);
    if (!header) return fail_within(section_name(SectionId::kParameters), header.error());
    header_ = *header;
    // What a vertex and a frame of a cluster take, checked before anything of their number is made.
    const std::int64_t vertex_bytes = 128, motion_bytes = 256;
    if (clip.vertex_count > size_limit_bytes / vertex_bytes ||
        clip.frame_count > size_limit_bytes / motion_bytes / header_.cluster_count)
        return fail(ErrorCode::kLimit, "the clip needs more memory than allowed");
    auto segmentation = read_segmentation(clip.payload(SectionId::kSegmentation), clip.vertex_count,
                                          header_.cluster_count, 0, mesh.adjacency());
    if (!segmentation) return fail_within(section_name(SectionId::kSegmentation), segmentation.error());
    labels_ = std::move(segmentation->labels);
    clusters_.resize(static_cast<std::size_t>(header_.cluster_count));
    for (std::size_t v = 0; v < labels_.size(); ++v) {
        Cluster& cluster = clusters_[static_cast<std::size_t>(labels_[v])];
        slots_.push_back(cluster.size());
        cluster.vertices.push_back(static_cast<std::int32_t>(v));
    }
    if (auto done = decode_bodies(clip.payload(SectionId::kFrames)); !done)
        return fail_within(section_name(SectionId::kFrames), done.error());
    if (auto done = decode_components(clip, mesh, components, size_limit_bytes, executor); !done) return done;
    const std::span<const std::uint8_t> residuals = clip.payload(SectionId::kResiduals);
    if (residuals.empty() || !is_whole()) return {};
    auto corrections = decode_corrections(residuals, mesh.field_order(), info_.frame_count, size_limit_bytes);
    if (!corrections) return fail_within(section_name(SectionId::kResiduals), corrections.error());
    corrections_ = std::move(*corrections);
    return {};
}

Expected<void> RtpcaClip::decode_bodies(std::span<const std::uint8_t> payload) {
    std::vector<CodedBody> bodies(clusters_.size());
    std::vector<std::int32_t> parents;
    const auto values = static_cast<std::size_t>(3 * info_.frame_count);
    for (CodedBody& body : bodies) {
        body.rotation.values.resize(values);
        body.path.values.resize(values);
    }
    BitCoder coder(payload);
    if (!code_bodies(coder, bodies, info_.frame_count)) return corrupt("the motions do not decode");
    if (auto end = coder.check_end(); !end) return end;
    for (const CodedBody& body : bodies) parents.push_back(body.parent);
    const std::vector<std::int32_t> order = RigidTree::order_of(parents);
    if (order.empty()) return corrupt("the motions make no tree");
    const TrackTransform transform(info_.frame_count);
    tracks_.resize(bodies.size());
    for (const std::int32_t index : order) {
        const auto i = static_cast<std::size_t>(index);
        const BodyTrack* parent = parents[i] < 0 ? nullptr : &tracks_[static_cast<std::size_t>(parents[i])];
        tracks_[i] = bodies[i].track(parent, header_, clusters_[i].size(), transform);
    }
    return {};
}

Expected<void> RtpcaClip::decode_list(ByteReader& reader, std::int64_t size_limit_bytes) {
    if (header_.component_count > size_limit_bytes / static_cast<std::int64_t>(sizeof(RtpcaComponent)))
        return fail(ErrorCode::kLimit, "more components than memory allows");
    const auto size = reader.get_varint(reader.remaining());
    if (!size) return tl::unexpected(size.error());
    const auto bytes = reader.get_bytes(*size);
    if (!bytes) return tl::unexpected(bytes.error());
    components_.resize(static_cast<std::size_t>(header_.component_count));
    BitCoder coder(*bytes);
    if (!code_components(coder, components_, header_.cluster_count))
        return corrupt("the list of components does not decode");
    return coder.check_end();
}

Expected<void> RtpcaClip::make_room(std::int32_t components, std::int64_t size_limit_bytes) {
    if (components >= 0 && components < header_.component_count)
        components_.resize(static_cast<std::size_t>(components));
    std::vector<std::int64_t> counts(clusters_.size(), 0);
    std::int64_t values = 0;
    for (const RtpcaComponent& component : components_) {
        const auto i = static_cast<std::size_t>(component.cluster);
        if (++counts[i] > std::min<std::int64_t>(3 * info_.frame_count, clusters_[i].size()))
            return corrupt("a cluster has more components than its rank can be");
        values += 3 * info_.frame_count + clusters_[i].size();
    }
    if (values > size_limit_bytes / 12)  // floats, and the levels of as many streams at once
        return fail(ErrorCode::kLimit,
                    std::to_string(values) + " values of components need more memory than allowed");
    for (std::size_t i = 0; i < clusters_.size(); ++i) {
        const std::int64_t blocks = (clusters_[i].size() + kTrajectoryLanes - 1) / kTrajectoryLanes;
        clusters_[i].fields.assign(static_cast<std::size_t>(blocks * (3 + counts[i]) * kTrajectoryLanes),
                                   0.0f);
        clusters_[i].basis.resize(static_cast<std::size_t>(counts[i]));
    }
    return {};
}

Expected<void> RtpcaClip::decode_shape(std::span<const std::uint8_t> stream, const MeshTopology& mesh,
                                       std::vector<float>& shape) {
    const FieldOrder& order = mesh.field_order();
    const float step = header_.shape_step(info_.frame_count);
    BitCoder coder(stream);
    FieldCoder fields;
    FieldMemory memory(info_.vertex_count);
    std::vector<std::int32_t> field(labels_.size());
    shape.resize(3 * labels_.size());
    for (std::size_t axis = 0; axis < 3; ++axis) {
        fields.code(coder, order, memory, {}, field);
        if (coder.is_overrun()) return corrupt("the mean shape does not decode");
        for (std::size_t place = 0; place < field.size(); ++place) {
            const auto v = static_cast<std::size_t>(order.vertices[place]);
            shape[3 * v + axis] = static_cast<float>(field[place]) * step;
            set_field(static_cast<std::size_t>(labels_[v]), order.vertices[place], axis, shape[3 * v + axis]);
        }
    }
    return coder.check_end();
}

bool RtpcaClip::decode_basis(std::span<const std::uint8_t> bytes, const std::vector<std::int32_t>& stream,
                             const TrackTransform& transform) {
    BitCoder coder(bytes);
    TrackCoder tracks(info_.frame_count);
    std::vector<TrackLevels> levels;
    const auto decode = [&](const RtpcaComponent&, std::size_t, std::size_t l) {
        levels.emplace_back();
        levels.back().values.resize(static_cast<std::size_t>(3 * info_.frame_count));
        tracks.code(coder, levels.back(), l);
        return !coder.is_overrun();
    };
    if (!for_each_component(components_, stream, clusters_.size(), decode)) return false;
    if (is_whole() && !coder.check_end()) return false;
    std::vector<std::vector<float>> basis = transform.dequantize(levels, SerialExecutor());
    std::size_t next = 0;
    const auto store = [&](const RtpcaComponent& component, std::size_t i, std::size_t l) {
        const float unit = component.basis_step() * header_.step;
        for (float& value : basis[next]) value *= unit;
        clusters_[i].basis[l] = std::move(basis[next++]);
        return true;
    };
    return for_each_component(components_, stream, clusters_.size(), store);
}

bool RtpcaClip::decode_fields(std::span<const std::uint8_t> bytes, const std::vector<std::int32_t>& stream,
                              const std::vector<FieldOrder>& orders) {
    BitCoder coder(bytes);
    FieldCoder fields;
    std::vector<FieldMemory> memories = stream_memories(stream, orders);
    std::vector<std::int32_t> field;
    const auto decode = [&](const RtpcaComponent&, std::size_t i, std::size_t l) {
        field.assign(clusters_[i].vertices.size(), 0);
        fields.code(coder, orders[i], memories[i], {}, field);
        for (std::size_t place = 0; place < field.size(); ++place)
            set_field(i, orders[i].vertices[place], 3 + l, static_cast<float>(field[place]));
        return !coder.is_overrun();
    };
    if (!for_each_component(components_, stream, clusters_.size(), decode)) return false;
    return !is_whole() || coder.check_end().has_value();
}

Expected<void> RtpcaClip::decode_components(const ClipBitstream& clip, const MeshTopology& mesh,
                                            std::int32_t components, std::int64_t size_limit_bytes,
                                            const Executor& executor) {
    const auto within = [](SectionId id, const Error& error) { return fail_within(section_name(id), error); };
    ByteReader reader(clip.payload(SectionId::kBasis));
    if (auto done = decode_list(reader, size_limit_bytes); !done)
        return within(SectionId::kBasis, done.error());
    std::vector<std::int64_t> sizes;
    for (const Cluster& cluster : clusters_) sizes.push_back(cluster.size());
    const Streams streams =
        rtpca_streams(components_, sizes, info_.frame_count);  // of all, as they are coded
    if (auto done = make_room(components, size_limit_bytes); !done)
        return within(SectionId::kBasis, done.error());
    const auto basis =
        split_parts(clip.payload(SectionId::kBasis).subspan(reader.position()), streams.size());
    if (!basis) return within(SectionId::kBasis, basis.error());
    const auto fields = split_parts(clip.payload(SectionId::kCoefficients), streams.size() + 1);
    if (!fields) return within(SectionId::kCoefficients, fields.error());

    // The mean shape first: points have their order from it.
    std::vector<float> shape;
    if (auto done = decode_shape((*fields)[0], mesh, shape); !done)
        return within(SectionId::kCoefficients, done.error());
    const std::vector<FieldOrder> orders = cluster_orders(mesh, labels_, header_.cluster_count, shape);
    const TrackTransform transform(info_.frame_count);
    std::vector<std::uint8_t> good(2 * streams.size(), 0);
    executor.for_each(static_cast<std::int64_t>(good.size()), [&](std::int64_t index) {
        const auto task = static_cast<std::size_t>(index);
        const std::size_t s = task / 2;
        good[task] = task % 2 == 0 ? decode_basis((*basis)[s], streams[s], transform)
                                   : decode_fields((*fields)[s + 1], streams[s], orders);
    });
    for (std::size_t task = 0; task < good.size(); ++task) {
        if (good[task] == 0)
            return within(task % 2 == 0 ? SectionId::kBasis : SectionId::kCoefficients,
                          corrupt("a coded stream does not decode").value());
    }
    return {};
}

void RtpcaClip::weigh(std::size_t cluster, std::size_t frame, std::vector<float>& weights,
                      std::array<float, 3>& origin) const {
    const std::vector<std::vector<float>>& basis = clusters_[cluster].basis;
    const BodyMotion& motion = tracks_[cluster][frame];
    std::array<float, 9> turn;
    for (std::size_t k = 0; k < 9; ++k) turn[k] = static_cast<float>(motion.rotation[k]);
    weights.resize(3 * (3 + basis.size()));
    for (std::size_t axis = 0; axis < 3; ++axis) {
        origin[axis] =
            static_cast<float>(motion.translation[axis] + static_cast<double>(header_.center[axis]));
        for (std::size_t row = 0; row < 3; ++row) weights[3 * axis + row] = turn[3 * row + axis];
    }
    float* w = weights.data() + 9;
    for (std::size_t l = 0; l < basis.size(); ++l, w += 3) {
        const float* b = basis[l].data() + 3 * frame;
        for (std::size_t row = 0; row < 3; ++row)
            w[row] = turn[3 * row] * b[0] + turn[3 * row + 1] * b[1] + turn[3 * row + 2] * b[2];
    }
}

Expected<void> RtpcaClip::reconstruct(std::int64_t begin, MutablePositionsView out,
                                      const Executor& executor) const {
    if (auto good = check_frames(info_, begin, out); !good) return good;
    constexpr std::int64_t kFramesPerTask = 4;
    const std::int64_t tasks = (out.frame_count() + kFramesPerTask - 1) / kFramesPerTask;
    executor.for_each(tasks, [&](std::int64_t task) {
        std::vector<float> weights;
        std::array<float, 3> origin;
        const std::int64_t first = task * kFramesPerTask;
        const std::int64_t end = std::min(first + kFramesPerTask, out.frame_count());
        for (std::size_t i = 0; i < clusters_.size(); ++i) {
            const Cluster& cluster = clusters_[i];
            const TrajectoryCluster geometry = {cluster.vertices, cluster.fields.data(),
                                                static_cast<std::int64_t>(cluster.basis.size())};
            for (std::int64_t at = first; at < end; ++at) {
                weigh(i, static_cast<std::size_t>(begin + at), weights, origin);
                sum_trajectories(geometry, weights.data(), origin.data(), out.at(at, 0));
            }
        }
        corrections_.apply(begin + first, {out.at(first, 0), end - first, info_.vertex_count}, labels_,
                           tracks_);
    });
    return {};
}

}  // namespace

Expected<ClipInfo> read_rtpca_info(const ClipBitstream& clip) {
    const auto header = RtpcaHeader::read(clip.payload(SectionId::kParameters), clip.vertex_count);
    if (!header) return fail_within(section_name(SectionId::kParameters), header.error());
    ClipInfo info = basic_info(clip);
    info.cluster_count = header->cluster_count;
    info.component_count = static_cast<std::int32_t>(
        std::min<std::int64_t>(header->component_count, std::numeric_limits<std::int32_t>::max()));
    info.parameters.step =
        header->e_max > 0.0f ? static_cast<double>(header->step) / static_cast<double>(header->e_max) : 0.0;
    if (const auto residuals = clip.payload(SectionId::kResiduals); !residuals.empty()) {
        const auto bound = read_bound(residuals);
        if (!bound) return fail_within(section_name(SectionId::kResiduals), bound.error());
        info.parameters.max_error = *bound;
    }
    return info;
}

namespace {

Expected<std::vector<float>> all_frames(RtpcaClip& decoded, const ClipBitstream& clip,
                                        const MeshTopology& mesh, const Executor& executor) {
    constexpr std::int64_t kNoLimit = std::numeric_limits<std::int64_t>::max();
    if (auto done = decoded.decode(clip, mesh, -1, kNoLimit, executor); !done)
        return tl::unexpected(done.error());
    std::vector<float> places(static_cast<std::size_t>(3 * clip.frame_count * clip.vertex_count));
    const MutablePositionsView view(places.data(), clip.frame_count, clip.vertex_count);
    if (auto done = decoded.reconstruct(0, view, executor); !done) return tl::unexpected(done.error());
    return places;
}

}  // namespace

Expected<std::vector<float>> reconstruct_rtpca(std::span<const std::uint8_t> bitstream,
                                               const MeshTopology& mesh, const Executor& executor) {
    const auto clip = parse_clip_bitstream(bitstream);
    if (!clip) return tl::unexpected(clip.error());
    RtpcaClip decoded;
    return all_frames(decoded, *clip, mesh, executor);
}

Expected<std::vector<std::uint8_t>> encode_rtpca_residuals(const ClipBitstream& clip,
                                                           const MeshTopology& mesh, PositionsView source,
                                                           double bound, const Executor& executor) {
    RtpcaClip decoded;
    const auto places = all_frames(decoded, clip, mesh, executor);
    if (!places) return tl::unexpected(places.error());
    return encode_corrections(source, {places->data(), source.frame_count(), source.vertex_count()},
                              mesh.field_order(), decoded.labels(), decoded.tracks(), bound);
}

Expected<std::unique_ptr<DecodedClip>> decode_rtpca(const ClipBitstream& clip, const SharedMesh& mesh,
                                                    std::int32_t components, std::int64_t size_limit_bytes,
                                                    const Executor& executor) {
    auto decoded = std::make_unique<RtpcaClip>();
    if (auto done = decoded->decode(clip, *mesh, components, size_limit_bytes, executor); !done)
        return tl::unexpected(done.error());
    return decoded;
}

}  // namespace batchenc
