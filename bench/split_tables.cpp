// Figures 8.7 and 8.8 of the thesis, and the splitcoder's predictors at gates beside each other, as CSV on
// standard output.
//
// batchenc_split_tables parts CLIP.h5…    bits of tangential and normal part, q = 8 … 15
// batchenc_split_tables totals CLIP.h5…   bits of everything but the triangles, at bounds of 1.73e-4 and
//                                         1.73e-3 of the bounding box' diagonal, and encoding's time
//
// Bits are a vertex and frame, over all frames; those of parts leave out the first frame.

#include <cstdio>
#include <string>
#include <vector>

#include "codecs/split_gates.h"
#include "codecs/static_coder.h"
#include "io/source_clip.h"
#include "kernels/bounding_box.h"
#include "kernels/error_metrics.h"
#include "kernels/split_prediction.h"
#include "pipeline/stopwatch.h"

namespace {

using namespace batchenc;
using enum GeometryPredictor;

constexpr GeometryPredictor kSplit[] = {kTime, kSpace, kSpaceMultiway, kSpaceTime, kSpaceTimeMultiway};
constexpr GeometryPredictor kPlace[] = {kLorenzo, kLorenzoMultiway, kReplica, kLocalMultiway};
constexpr NormalPredictor kNormals[] = {NormalPredictor::kTime, NormalPredictor::kSpace,
                                        NormalPredictor::kSpaceTime};

/// A clip, and its first frame as the splitcoder codes it.
struct Subject {
    const MeshSequence& clip;
    SharedMesh mesh;
    SplitHeader header;
    std::vector<float> decoded;
    std::size_t first_bytes = 0;

    Subject(const MeshSequence& source, SharedMesh topology, double bound)
        : clip(source), mesh(std::move(topology)), decoded(source.positions.size()) {
        header.center = bounding_box(clip.view()).center();
        header.bound = bound;
        CodecParameters parameters;
        parameters.method = CodecMethod::kStatic;
        parameters.predictor = kWeighted;
        parameters.max_error = bound;
        const SerialExecutor serial;
        const auto first = encode_static(clip.view().frames(0, 1), *mesh, parameters, serial);
        first_bytes = first->bitstream.size();
        const auto parsed = parse_clip_bitstream(first->bitstream);
        const auto decoder = decode_static(*parsed, mesh, std::int64_t{1} << 40, serial);
        (void)(*decoder)->reconstruct(0, {decoded.data(), 1, clip.vertex_count}, serial);
    }
    MutablePositionsView frames() { return {decoded.data(), clip.frame_count, clip.vertex_count}; }
    double samples() const {
        return static_cast<double>(clip.frame_count) * static_cast<double>(clip.vertex_count);
    }
    ErrorMetrics errors() {
        ErrorMeter meter(clip.vertex_count);
        meter.add(clip.view(), frames(), SerialExecutor());
        return meter.finish();
    }
};

void print_parts(const MeshSequence& clip, const SharedMesh& mesh) {
    const double side = bounding_box(clip.view()).largest_side();
    for (int q = 8; q <= 15; ++q) {
        Subject subject(clip, mesh, side / (1 << q));
        for (const GeometryPredictor predictor : kSplit) {
            for (const NormalPredictor normal : kNormals) {
                subject.header.predictor = predictor;
                subject.header.normal = normal;
                SplitBits bits;
                encode_gates(clip.view(), *mesh, subject.header, subject.frames(), &bits);
                const double samples = subject.samples() - static_cast<double>(clip.vertex_count);
                std::printf("%s,%d,%s,%s,%.3f,%.3f,%.5f\n", clip.name.c_str(), q,
                            std::string(to_name(predictor)).c_str(), std::string(to_name(normal)).c_str(),
                            bits.tangential / samples, bits.normal / samples, subject.errors().da);
                std::fflush(stdout);
            }
        }
    }
}

void print_total(Subject& subject, double relative, GeometryPredictor predictor, NormalPredictor normal) {
    subject.header.predictor = predictor;
    subject.header.normal = normal;
    const Stopwatch encoding;
    const auto bytes = encode_gates(subject.clip.view(), *subject.mesh, subject.header, subject.frames());
    const double encode_s = encoding.seconds();
    const ErrorMetrics errors = subject.errors();
    const Stopwatch decoding;
    const auto done = decode_gates(bytes, *subject.mesh, subject.header, subject.frames());
    const double decode_s = decoding.seconds();
    const double megabytes = static_cast<double>(subject.clip.view().size_bytes()) / 1e6;
    std::printf("%s,%.3g,%s,%s,%.4f,%.5f,%.5f,%.5g,%.1f,%.1f%s\n", subject.clip.name.c_str(), relative,
                std::string(to_name(predictor)).c_str(),
                splits(predictor) ? std::string(to_name(normal)).c_str() : "",
                8.0 * static_cast<double>(bytes.size() + subject.first_bytes) / subject.samples(), errors.da,
                errors.kg, errors.max_error_relative, megabytes / encode_s, megabytes / decode_s,
                done ? "" : ",refused");
    std::fflush(stdout);
}

void print_totals(const MeshSequence& clip, const SharedMesh& mesh) {
    const double diagonal = bounding_box(clip.view()).diagonal();
    for (const double relative : {1.73e-4, 1.73e-3}) {
        Subject subject(clip, mesh, relative * diagonal);
        for (const GeometryPredictor predictor : kSplit) {
            for (const NormalPredictor normal : kNormals) print_total(subject, relative, predictor, normal);
        }
        for (const GeometryPredictor predictor : kPlace)
            print_total(subject, relative, predictor, NormalPredictor::kTime);
    }
}

}  // namespace

int main(int count, char** arguments) {
    const std::string what = count > 2 ? arguments[1] : "";
    if (what != "parts" && what != "totals") {
        std::fprintf(stderr, "usage: batchenc_split_tables parts|totals CLIP.h5...\n");
        return 2;
    }
    std::puts(what == "parts" ? "clip,bits,predictor,normal,tangential_bits,normal_bits,da"
                              : "clip,bound_relative,predictor,normal,bpvf_geometry,da,kg,max_error_relative,"
                                "encode_mb_s,decode_mb_s");
    for (int i = 2; i < count; ++i) {
        const auto clip = read_mesh_sequence(arguments[i]);
        if (!clip) {
            std::fprintf(stderr, "%s\n", clip.error().to_string().c_str());
            return 1;
        }
        const auto mesh = std::make_shared<const MeshTopology>(clip->triangles, clip->vertex_count);
        what == "parts" ? print_parts(*clip, mesh) : print_totals(*clip, mesh);
    }
    return 0;
}
