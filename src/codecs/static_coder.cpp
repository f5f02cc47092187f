#include "codecs/static_coder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "codecs/exact_vertex.h"
#include "codecs/integer_contexts.h"
#include "codecs/static_forms.h"
#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "kernels/crc32c.h"
#include "kernels/static_prediction.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

/// The content of the parameters section.
struct StaticHeader {
    std::int32_t bits = 0;
    std::array<float, 3> center{};  // of the bounding box over all frames, world units: the lattice's origin
    float e_max = 0.0f;             // largest side of that box

    /// Spacing of the lattice that decoded vertices live on, world units.
    double spacing() const {
        return static_cast<double>(e_max) / static_cast<double>(std::int64_t{1} << bits) / kLatticeParts;
    }
    /// Largest distance of a vertex from its source.
    double bound() const { return spacing() * kLatticeParts; }

    double to_lattice(float value, std::size_t axis) const {
        const double step = spacing();
        return step > 0.0 ? (static_cast<double>(value) - static_cast<double>(center[axis])) / step : 0.0;
    }
    std::array<float, 3> to_world(const LatticePoint& point) const {
        std::array<float, 3> world;
        for (std::size_t c = 0; c < 3; ++c)
            world[c] = static_cast<float>(static_cast<double>(center[c]) +
                                          static_cast<double>(point[c]) * spacing());
        return world;
    }
    /// The lattice point of a vertex that was coded exactly.
    LatticePoint nearest_point(const std::array<float, 3>& world) const {
        constexpr double kLimit = 1 << 29;
        LatticePoint point;
        for (std::size_t c = 0; c < 3; ++c) {
            const double value = std::floor(to_lattice(world[c], c) + 0.5);
            point[c] =
                static_cast<std::int32_t>(value > -kLimit ? (value < kLimit ? value : kLimit) : -kLimit);
        }
        return point;
    }

    std::vector<std::uint8_t> write() const {
        ByteWriter out;
        out.put(static_cast<std::uint8_t>(bits));
        for (const float value : center) out.put(value);
        out.put(e_max);
        return out.take();
    }

    static Expected<StaticHeader> read(std::span<const std::uint8_t> payload) {
        ByteReader reader(payload);
        const auto bits = reader.get<std::uint8_t>();
        if (!bits) return tl::unexpected(bits.error());
        StaticHeader header;
        header.bits = *bits;
        const auto center = reader.get_array<float, 3>();
        const auto e_max = reader.get<float>();
        if (!e_max) return tl::unexpected(e_max.error());
        header.center = *center;  // there, since what follows it is
        header.e_max = *e_max;
        if (reader.remaining() != 0) return corrupt("bytes left over");
        bool good =
            header.bits >= 4 && header.bits <= 24 && std::isfinite(header.e_max) && header.e_max >= 0.0f;
        for (const float value : header.center) good = good && std::isfinite(value);
        if (!good) return corrupt("a parameter is outside its range");
        return header;
    }
};

/// Contexts of one frame: by how many gates a vertex has, which residual it is, and how large residuals
/// nearby are.
class FrameContexts {
 public:
    IntegerModel& of(const VertexPrediction& prediction, std::size_t axis, const std::int32_t* residuals) {
        // Along and across the gate residuals are of one size; both tell something of the normal one.
        const std::int64_t tangential = (std::int64_t{prediction.sizes[0]} + prediction.sizes[1]) / 2;
        const std::int64_t first = size_of(residuals[0]);
        std::int64_t size = tangential;
        if (axis == 1) size = (7 * tangential + 3 * first) / 10;
        if (axis == 2) size = (8 * std::int64_t{prediction.sizes[2]} + first + size_of(residuals[1])) / 10;
        return scales_[static_cast<std::size_t>(prediction.gates > 1)][axis == 2].of(
            ScaleContexts::class_of_sixteenths(size));
    }
    IntegerModel& exact() { return exact_; }

 private:
    static std::int64_t size_of(std::int32_t residual) {
        return std::min<std::int64_t>(std::abs(std::int64_t{residual}) * kLatticeParts, 1 << 23);
    }

    std::array<std::array<ScaleContexts, 2>, 2> scales_;
    IntegerModel exact_;
};

/// Checksum over the lattice points of a decoded frame: a machine that predicted otherwise finds out.
std::uint32_t state_checksum(const std::vector<LatticePoint>& points) {
    return crc32c(
        {reinterpret_cast<const std::uint8_t*>(points.data()), points.size() * sizeof(LatticePoint)});
}

/// Codes a frame in one form.
std::vector<std::uint8_t> encode_frame(PositionsView frame, const MeshTraversal& traversal,
                                       const Surface& surface, StaticHeader header,
                                       const PredictionForm& form) {
    RangeEncoder encoder;
    FrameContexts contexts;
    StaticPrediction state(traversal, surface, form);
    const double squared_bound = header.bound() * header.bound();
    const double per_unit = header.spacing() > 0.0 ? 1.0 / header.spacing() : 0.0;
    const auto on_lattice = [&](float value, std::size_t c) {
        return (static_cast<double>(value) - static_cast<double>(header.center[c])) * per_unit;
    };
    for (std::size_t k = 0; k < traversal.order.size(); ++k) {
        const float* p = frame.at(0, traversal.order[k]);
        VertexPrediction prediction = state.predict(k);
        std::array<std::int32_t, 3> residuals =
            state.residuals_of(prediction, {on_lattice(p[0], 0), on_lattice(p[1], 1), on_lattice(p[2], 2)});
        LatticePoint decoded = state.reconstruct(prediction, residuals);
        if (!(squared_distance(header.to_world(decoded).data(), p) <= squared_bound)) {
            encoder.encode(contexts.of(prediction, 0, residuals.data()), kExact);
            for (int c = 0; c < 3; ++c) encoder.encode(contexts.exact(), bits_of(p[c]));
            residuals = {};
            decoded = header.nearest_point({p[0], p[1], p[2]});
        } else {
            for (std::size_t a = 0; a < 3; ++a)
                encoder.encode(contexts.of(prediction, a, residuals.data()), residuals[a]);
        }
        state.record(k, residuals, decoded);
    }
    ByteWriter out;
    out.put(static_cast<std::uint8_t>(form.predictor));
    out.put(bends(form.predictor) ? static_cast<std::uint8_t>(form.tangential) : form.curvature);
    if (is_fitted(form.predictor)) {
        out.put(static_cast<std::uint8_t>(form.fit.vertices));
        out.put(form.fit.exponent);
        out.put(form.fit.cosine);
    }
    out.put(state_checksum(state.points()));
    out.put_bytes(encoder.finish());
    return out.take();
}

/// The form at the beginning of a frame's stream.
Expected<PredictionForm> read_form(ByteReader& reader) {
    PredictionForm form;
    const auto predictor = reader.get<std::uint8_t>();
    const auto variant = reader.get<std::uint8_t>();
    if (!variant) return tl::unexpected(variant.error());
    form.predictor = static_cast<GeometryPredictor>(*predictor);
    if (form.predictor == GeometryPredictor::kAuto || to_name(form.predictor) == "unknown" ||
        !has_predictor(CodecMethod::kStatic, form.predictor) || *variant > (bends(form.predictor) ? 3 : 16))
        return corrupt("the predictor is unknown");
    if (!bends(form.predictor)) {
        form.curvature = *variant;
        return form;
    }
    form.tangential = static_cast<TangentialPredictor>(*variant);
    if (!is_fitted(form.predictor)) return form;
    const auto vertices = reader.get<std::uint8_t>();
    const auto exponent = reader.get<float>();
    const auto cosine = reader.get<float>();
    if (!cosine) return tl::unexpected(cosine.error());
    form.fit = {*vertices, *exponent, *cosine};
    if (!is_in_range(form.fit) || form.fit.vertices == 0 ||
        !(form.fit.exponent >= 0.0f && form.fit.cosine >= 0.0f))
        return corrupt("what a surface is fitted to is outside its range");
    return form;
}

Expected<void> decode_frame(std::span<const std::uint8_t> bytes, const MeshTraversal& traversal,
                            const Surface& surface, StaticHeader header, MutablePositionsView frame) {
    ByteReader reader(bytes);
    const auto form = read_form(reader);
    if (!form) return tl::unexpected(form.error());
    const auto checksum = reader.get<std::uint32_t>();
    if (!checksum) return tl::unexpected(checksum.error());
    const auto payload = reader.get_bytes(reader.remaining());
    if (traversal.order.size() > max_symbol_count(payload->size()))
        return corrupt("more vertices than the bytes can hold");
    auto decoder = RangeDecoder::open(*payload);
    if (!decoder) return tl::unexpected(decoder.error());
    FrameContexts contexts;
    StaticPrediction state(traversal, surface, *form);
    for (std::size_t k = 0; k < traversal.order.size(); ++k) {
        VertexPrediction prediction = state.predict(k);
        float* p = frame.at(0, traversal.order[k]);
        std::array<std::int32_t, 3> residuals{};
        LatticePoint decoded;
        for (std::size_t a = 0; a < 3; ++a) {
            residuals[a] = decoder->decode(contexts.of(prediction, a, residuals.data()));
            if (residuals[0] == kExact) break;
        }
        std::array<float, 3> world;
        if (residuals[0] == kExact) {
            for (float& value : world) value = float_of(decoder->decode(contexts.exact()));
            if (!std::isfinite(world[0]) || !std::isfinite(world[1]) || !std::isfinite(world[2]))
                return corrupt("a vertex is not finite");
            residuals = {};
            decoded = header.nearest_point(world);
        } else {
            decoded = state.reconstruct(prediction, residuals);
            world = header.to_world(decoded);
        }
        std::copy(world.begin(), world.end(), p);
        state.record(k, residuals, decoded);
    }
    if (auto end = decoder->finish(); !end) return end;
    if (state_checksum(state.points()) != *checksum)
        return corrupt("the decoded positions do not have the checksum that the encoder saw");
    return {};
}

/// Codes frames in the forms that make their streams smallest.
class FrameEncoder {
 public:
    using Stream = std::vector<std::uint8_t>;

    FrameEncoder(PositionsView positions, const MeshTopology& mesh, const StaticHeader& header,
                 const CodecParameters& parameters, const Executor& executor)
        : positions_(positions),
          header_(header),
          parameters_(parameters),
          executor_(executor),
          traversal_(mesh.traversal()),
          surface_(mesh.surface_if(parameters.predictor == GeometryPredictor::kAuto ||
                                   needs_surface(forms_of(parameters).front()))) {}

    /// A stream a frame. Forms of `auto` are tried on one frame in kFramesAGroup; those between take the best
    /// of a few.
    std::vector<Stream> run() {
        std::vector<Stream> streams(static_cast<std::size_t>(positions_.frame_count()));
        for (std::int64_t first = 0; first < positions_.frame_count(); first += kFramesAGroup) {
            const std::int64_t end = std::min(first + kFramesAGroup, positions_.frame_count());
            std::vector<Trial> trials = try_on(first);
            streams[static_cast<std::size_t>(first)] = std::move(trials.front().stream);
            if (parameters_.predictor == GeometryPredictor::kAuto)
                trials.resize(std::min(kKept, trials.size()));
            const auto count = static_cast<std::int64_t>(trials.size());
            std::vector<Stream> tried(static_cast<std::size_t>((end - first - 1) * count));
            executor_.for_each(static_cast<std::int64_t>(tried.size()), [&](std::int64_t task) {
                tried[static_cast<std::size_t>(task)] =
                    encode(first + 1 + task / count, trials[static_cast<std::size_t>(task % count)].form);
            });
            for (std::int64_t f = first + 1; f < end; ++f) {
                const auto begin = tried.begin() + (f - first - 1) * count;
                streams[static_cast<std::size_t>(f)] = std::move(*std::min_element(
                    begin, begin + count, [](const auto& a, const auto& b) { return a.size() < b.size(); }));
            }
        }
        return streams;
    }

 private:
    static constexpr std::int64_t kFramesAGroup = 32;
    static constexpr std::size_t kKept = 3;
    struct Trial {
        PredictionForm form;
        Stream stream;
    };

    Stream encode(std::int64_t frame, const PredictionForm& form) const {
        return encode_frame(positions_.frames(frame, frame + 1), traversal_, surface_, header_, form);
    }

    void add_trials(std::int64_t frame, const std::vector<PredictionForm>& forms,
                    std::vector<Trial>& trials) const {
        const std::size_t before = trials.size();
        for (const PredictionForm& form : forms) trials.push_back({form, {}});
        executor_.for_each(static_cast<std::int64_t>(forms.size()), [&](std::int64_t k) {
            Trial& trial = trials[before + static_cast<std::size_t>(k)];
            trial.stream = encode(frame, trial.form);
        });
    }

    /// All forms on a frame, the smallest first.
    std::vector<Trial> try_on(std::int64_t frame) const {
        std::vector<Trial> trials;
        add_trials(frame, forms_of(parameters_), trials);
        if (parameters_.predictor == GeometryPredictor::kAuto) {
            // How the tangential components are best predicted does not depend on how the angle is.
            const auto best =
                std::min_element(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) {
                    const bool a_bends = bends(a.form.predictor), b_bends = bends(b.form.predictor);
                    return a_bends != b_bends ? a_bends : a.stream.size() < b.stream.size();
                });
            add_trials(frame, surface_forms(parameters_, best->form.tangential), trials);
        }
        std::stable_sort(trials.begin(), trials.end(),
                         [](const Trial& a, const Trial& b) { return a.stream.size() < b.stream.size(); });
        return trials;
    }

    PositionsView positions_;
    StaticHeader header_;
    const CodecParameters& parameters_;
    const Executor& executor_;
    const MeshTraversal& traversal_;
    const Surface& surface_;  // empty where no form looks at it
};

class StaticClip final : public DecodedClip {
 public:
    StaticClip(const ClipInfo& info, const StaticHeader& header, SharedMesh mesh)
        : info_(info), header_(header), mesh_(std::move(mesh)) {}

    const ClipInfo& info() const override { return info_; }
    const std::vector<std::int32_t>& labels() const override { return labels_; }

    /// Sizes of the frames' streams, then the streams. Copies them: the clip outlives the bitstream.
    Expected<void> take_streams(std::span<const std::uint8_t> payload) {
        ByteReader reader(payload);
        std::vector<std::uint64_t> sizes;
        for (std::int64_t f = 0; f < info_.frame_count; ++f) {  // ends early where the bytes do
            const auto size = reader.get_varint(payload.size());
            if (!size) return tl::unexpected(size.error());
            sizes.push_back(*size);
        }
        for (const std::uint64_t size : sizes) {
            const auto stream = reader.get_bytes(size);
            if (!stream) return tl::unexpected(stream.error());
            streams_.emplace_back(stream->begin(), stream->end());
        }
        if (reader.remaining() != 0) return corrupt("bytes left over");
        const bool wants_surface = std::any_of(streams_.begin(), streams_.end(), [](const auto& stream) {
            ByteReader form_reader(stream);
            const auto form = read_form(form_reader);
            return form && needs_surface(*form);  // a form that cannot be read is that frame's error
        });
        surface_ = &mesh_->surface_if(wants_surface);
        return {};
    }

    Expected<void> reconstruct(std::int64_t begin, MutablePositionsView out,
                               const Executor& executor) const override {
        if (auto good = check_frames(info_, begin, out); !good) return good;
        std::vector<std::optional<Error>> errors(static_cast<std::size_t>(out.frame_count()));
        executor.for_each(out.frame_count(), [&](std::int64_t f) {
            const MutablePositionsView frame(out.at(f, 0), 1, out.vertex_count());
            auto done = decode_frame(streams_[static_cast<std::size_t>(begin + f)], mesh_->traversal(),
                                     *surface_, header_, frame);
            if (!done) errors[static_cast<std::size_t>(f)] = done.error();
        });
        for (std::size_t f = 0; f < errors.size(); ++f) {
            if (errors[f])
                return fail_within("frame " + std::to_string(begin + static_cast<std::int64_t>(f)),
                                   *errors[f]);
        }
        return {};
    }

 private:
    ClipInfo info_;
    StaticHeader header_;
    SharedMesh mesh_;
    const Surface* surface_ = nullptr;                // empty where no frame's predictor looks at it
    std::vector<std::vector<std::uint8_t>> streams_;  // a frame each
    std::vector<std::int32_t> labels_;                // none: there are no clusters
};

}  // namespace

Expected<EncodedClip> encode_static(PositionsView positions, const MeshTopology& mesh,
                                    const CodecParameters& parameters, const Executor& executor) {
    const BoundingBox box = bounding_box(positions);
    StaticHeader header;
    header.bits = parameters.bits;
    header.center = box.center();
    header.e_max = static_cast<float>(box.largest_side());
    if (parameters.max_error > 0.0 || parameters.max_error_relative > 0.0) {
        // The header says a bound by any e_max and bits that give it, or a little less.
        header.bits = 12;
        const double wanted = bound_of(parameters, box) * 4096.0;
        header.e_max = static_cast<float>(wanted);
        if (static_cast<double>(header.e_max) > wanted) header.e_max = std::nextafter(header.e_max, 0.0f);
    }
    if (!std::isfinite(header.e_max))
        return fail(ErrorCode::kLimit, "the bounding box is larger than float32 can say");
    const std::vector<FrameEncoder::Stream> streams =
        FrameEncoder(positions, mesh, header, parameters, executor).run();

    ByteWriter frames;
    for (const auto& stream : streams) frames.put_varint(stream.size());
    for (const auto& stream : streams) frames.put_bytes(stream);
    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kResiduals, frames.take());
    EncodedClip clip;
    clip.bitstream = write_clip_bitstream(CodecMethod::kStatic, positions.vertex_count(),
                                          positions.frame_count(), sections);
    return clip;
}

double bound_of(const CodecParameters& parameters, const BoundingBox& box) {
    if (parameters.max_error > 0.0) return parameters.max_error;
    if (parameters.max_error_relative > 0.0) return parameters.max_error_relative * box.diagonal();
    return box.largest_side() / static_cast<double>(std::int64_t{1} << parameters.bits);
}

Expected<ClipInfo> read_static_info(const ClipBitstream& clip) {
    const auto header = StaticHeader::read(clip.payload(SectionId::kParameters));
    if (!header) return tl::unexpected(header.error());
    ClipInfo info = basic_info(clip);
    info.parameters.bits = header->bits;
    return info;
}

Expected<std::unique_ptr<DecodedClip>> decode_static(const ClipBitstream& clip, const SharedMesh& mesh,
                                                     std::int64_t size_limit_bytes, const Executor&) {
    const auto header = StaticHeader::read(clip.payload(SectionId::kParameters));
    if (!header) return tl::unexpected(header.error());
    const auto info = read_static_info(clip);
    if (!info) return tl::unexpected(info.error());
    // Every vertex of every frame costs bytes, and a vertex needs less than 256 bytes while it is decoded.
    const std::span<const std::uint8_t> payload = clip.payload(SectionId::kResiduals);
    if (static_cast<std::uint64_t>(clip.vertex_count) > max_symbol_count(payload.size()))
        return corrupt("more vertices than the bytes can hold");
    if (clip.vertex_count > size_limit_bytes / 256)
        return fail(ErrorCode::kLimit, "its " + std::to_string(clip.vertex_count) +
                                           " vertices need more memory than is allowed");
    auto decoded = std::make_unique<StaticClip>(*info, *header, mesh);
    if (auto taken = decoded->take_streams(payload); !taken) return tl::unexpected(taken.error());
    return decoded;
}

Expected<void> decode_static_frame(std::span<const std::uint8_t> bitstream, const MeshTopology& mesh,
                                   std::int64_t size_limit_bytes, MutablePositionsView frame,
                                   const Executor& executor) {
    const auto clip = parse_clip_bitstream(bitstream);
    if (!clip) return tl::unexpected(clip.error());
    if (clip->method != CodecMethod::kStatic || clip->vertex_count != mesh.vertex_count() ||
        clip->frame_count != 1)
        return corrupt("the first frame is not one of this clip");
    // The decoder does not outlive this call, nor does it own the mesh.
    const SharedMesh shared(SharedMesh(), &mesh);
    const auto decoder = decode_static(*clip, shared, size_limit_bytes, executor);
    if (!decoder) return tl::unexpected(decoder.error());
    return (*decoder)->reconstruct(0, frame, executor);
}

}  // namespace batchenc
