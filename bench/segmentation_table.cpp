// Segments clips by every method with 5, 10, 20, 30 and 40 clusters, and codes each segmentation by RLPCA,
// and prints a row of CSV for each: the time of segmentation (the shortest of three, interleaved over the
// methods), the average deviation (4.7), and rate and error. Behind docs/SEGMENTATION.md.
//
// Usage: batchenc_segmentation_table [--threads N] [--components L] [--clusters N,N…] CLIP.h5…

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "codecs/clip_codec.h"
#include "io/source_clip.h"
#include "kernels/error_metrics.h"
#include "pipeline/blas_guard.h"
#include "pipeline/stopwatch.h"
#include "pipeline/tbb_executor.h"
#include "pipeline/threads.h"

namespace batchenc {
namespace {

const std::atomic<bool> kNeverStop{false};
constexpr SegmentationMethod kMethods[] = {SegmentationMethod::kRegionGrowing,
                                           SegmentationMethod::kClustering, SegmentationMethod::kAdaptive,
                                           SegmentationMethod::kRigid};
constexpr int kRuns = 3;

struct Options {
    int threads = 2;
    std::int32_t components = 20;
    std::vector<std::int32_t> clusters = {5, 10, 20, 30, 40};
    std::vector<std::string> clips;
};

Options read_options(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--threads" && i + 1 < argc) {
            options.threads = std::atoi(argv[++i]);
        } else if (word == "--components" && i + 1 < argc) {
            options.components = std::atoi(argv[++i]);
        } else if (word == "--clusters" && i + 1 < argc) {
            options.clusters.clear();
            for (const char* p = argv[++i]; *p != '\0';) {
                char* end = nullptr;
                options.clusters.push_back(static_cast<std::int32_t>(std::strtol(p, &end, 10)));
                p = *end == ',' ? end + 1 : end;
            }
        } else {
            options.clips.push_back(word);
        }
    }
    return options;
}

struct Row {
    SegmentationMethod method = SegmentationMethod::kClustering;
    double time_s = std::numeric_limits<double>::infinity();
    Segmentation segmentation;
};

Expected<void> print_row(const MeshSequence& clip, const Row& row, std::int32_t clusters,
                         const Options& options, const Executor& executor) {
    CodecParameters codec;
    codec.components = options.components;
    const auto encoded = encode_clip(clip.view(), clip.triangles, row.segmentation, codec, executor);
    if (!encoded) return tl::unexpected(encoded.error());
    const auto decoder = decode_clip(encoded->bitstream, clip.triangles, -1,
                                     std::numeric_limits<std::int64_t>::max(), executor);
    if (!decoder) return tl::unexpected(decoder.error());
    std::vector<float> decoded(clip.positions.size());
    if (auto done =
            (*decoder)->reconstruct(0, {decoded.data(), clip.frame_count, clip.vertex_count}, executor);
        !done)
        return done;
    ErrorMeter meter(clip.vertex_count);
    meter.add(clip.view(), {decoded.data(), clip.frame_count, clip.vertex_count}, executor);
    const ErrorMetrics errors = meter.finish();
    const double values = static_cast<double>(clip.vertex_count) * static_cast<double>(clip.frame_count);
    std::printf("%s,%d,%s,%d,%.5f,%.6g,%d,%.5f,%.5f,%.5f\n", clip.name.c_str(), static_cast<int>(clusters),
                std::string(to_name(row.method)).c_str(), static_cast<int>(row.segmentation.cluster_count()),
                row.time_s, row.segmentation.average_deviation(), static_cast<int>(options.components),
                8.0 * static_cast<double>(encoded->bitstream.size()) / values, errors.da, errors.kg);
    std::fflush(stdout);
    return {};
}

Expected<void> measure(const MeshSequence& clip, std::int32_t clusters, const Options& options) {
    const TbbExecutor executor(kNeverStop);
    std::vector<Row> rows;
    for (const SegmentationMethod method : kMethods) rows.push_back({.method = method, .segmentation = {}});
    for (int run = 0; run < kRuns; ++run) {
        for (Row& row : rows) {
            const Stopwatch watch;
            auto segmentation = segment_clip(clip.view(), clip.triangles,
                                             {.method = row.method, .clusters = clusters}, executor);
            row.time_s = std::min(row.time_s, watch.seconds());
            if (!segmentation) return tl::unexpected(segmentation.error());
            row.segmentation = std::move(*segmentation);
        }
    }
    for (const Row& row : rows) {
        if (auto done = print_row(clip, row, clusters, options, executor); !done) return done;
    }
    return {};
}

Expected<void> run(const Options& options) {
    std::printf("clip,asked,method,clusters,time_s,average_deviation,components,bpvf_geometry,da,kg\n");
    for (const std::string& path : options.clips) {
        auto clip = read_mesh_sequence(path);
        if (!clip) return tl::unexpected(clip.error());
        for (const std::int32_t clusters : options.clusters) {
            if (auto done = measure(*clip, clusters, options); !done) return done;
        }
    }
    return {};
}

}  // namespace
}  // namespace batchenc

int main(int argc, char** argv) {
    using namespace batchenc;
    const auto blas = guard_blas(argv);
    if (!blas) {
        std::fprintf(stderr, "%s\n", blas.error().to_string().c_str());
        return 1;
    }
    const Options options = read_options(argc, argv);
    Expected<void> done;
    run_with_threads(options.threads, [&] { done = run(options); });
    if (done) return 0;
    std::fprintf(stderr, "%s\n", done.error().to_string().c_str());
    return 1;
}
