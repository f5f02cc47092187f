// The whole way from an HDF5 clip to a verified result and back, in MB/s of raw float32 positions, for some
// coders at 1 and 2 threads, with the peak memory of each run; coding alone, from memory to memory; and, to
// compare with, a grid of the same bound whose differences in time go through zstd. Clips named on the
// command line are used; without any, a walker of 20,000 vertices and 100 frames is made.

#include <benchmark/benchmark.h>
#include <unistd.h>
#include <zstd.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "bench/peers/quantised_deltas.h"
#include "codecs/clip_codec.h"
#include "io/source_clip.h"
#include "kernels/bounding_box.h"
#include "kernels/synthetic_clip.h"
#include "pipeline/batch.h"
#include "pipeline/blas_guard.h"
#include "pipeline/result_decoder.h"
#include "pipeline/tbb_executor.h"
#include "pipeline/threads.h"

namespace batchenc {
namespace {

constexpr std::int64_t kMemory = std::int64_t{4} << 30;
const std::atomic<bool> kNeverStop{false};

/// A folder for what the benchmark writes, gone at the end.
struct TemporaryFolder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("batchenc-bench-" + std::to_string(getpid()));
    TemporaryFolder() { std::filesystem::create_directories(path); }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

class Silent final : public BatchListener {
 public:
    void note(const std::string&, const std::string&) override {}
    void job_ended(const JobReport&) override {}
    void progress(double) override {}
};

/// Peak memory since the last reset, MB. Linux lets a process start its own high-water mark again.
void reset_peak_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }
double peak_memory_mb() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.rfind("VmHWM:", 0) == 0) return std::stod(line.substr(6)) / 1024.0;
    }
    return 0.0;
}

constexpr double kBound = 1.73e-4;  // of splitcoder and the reference, over the diagonal

/// A coder with the settings that it is measured with.
struct Coder {
    const char* name;
    CodecParameters parameters;
};

std::vector<Coder> coders() {
    std::vector<Coder> all(6);
    all[0].name = "rlpca";
    all[1] = {"pdct", {.method = CodecMethod::kPdct, .bits = 10}};
    all[2] = {"pdct-temporal-rd",
              {.method = CodecMethod::kPdct,
               .bits = 10,
               .transform = PdctTransform::kTemporal,
               .allocation = CoefficientAllocation::kRd}};
    all[3] = {"splitcoder", {.method = CodecMethod::kSplitcoder, .max_error_relative = kBound}};
    all[4] = {"static", {.method = CodecMethod::kStatic, .predictor = GeometryPredictor::kWeighted}};
    all[5] = {"rtpca", {.method = CodecMethod::kRtpca, .step = 1e-3}};
    return all;
}

Job make_job(const std::filesystem::path& input, const std::filesystem::path& output, const Coder& coder) {
    Job job;
    job.name = std::string(coder.name) + "/" + input.stem().string();
    job.codec = coder.parameters;
    if (coder.parameters.method == CodecMethod::kRtpca) job.segmentation.method = SegmentationMethod::kRigid;
    job.input = input;
    job.output = output;
    return job;
}

BatchReport encode(const Job& job, int threads) {
    const auto plans = plan_jobs({job}, ExistingOutput::kReplace, kNeverStop);
    Silent listener;
    return run_batch(plans, {kMemory, threads}, TbbExecutor(kNeverStop), kNeverStop, listener);
}

void run_encode(benchmark::State& state, const Job& job) {
    const auto threads = static_cast<int>(state.range(0));
    JobReport last;
    reset_peak_memory();
    for (auto _ : state) run_with_threads(threads, [&] { last = encode(job, threads).jobs.front(); });
    if (last.error) {
        state.SkipWithError(last.error->to_string().c_str());
        return;
    }
    const auto runs = static_cast<double>(state.iterations());
    state.counters["MB/s"] =
        benchmark::Counter(static_cast<double>(last.raw_bytes) * runs / 1e6, benchmark::Counter::kIsRate);
    state.counters["peak_MB"] = peak_memory_mb();
    state.counters["bpvf"] = last.metrics.values["bpvf"];
    state.counters["read_s"] = last.seconds.read;
    state.counters["segment_s"] = last.seconds.segment;
    state.counters["code_s"] = last.seconds.code;
    state.counters["verify_s"] = last.seconds.verify;
    state.counters["write_s"] = last.seconds.write;
}

/// All frames of a job's source.
MeshSequence read_clip(const Job& job) {
    const auto source = SourceClip::open(job.input).value();
    MeshSequence clip;
    clip.vertex_count = source->vertex_count();
    clip.frame_count = source->frame_count();
    if (source->triangle_count() > 0) clip.triangles = source->read_triangles().value();
    clip.positions.resize(static_cast<std::size_t>(3 * clip.frame_count * clip.vertex_count));
    (void)source->read_frames(0, {clip.positions.data(), clip.frame_count, clip.vertex_count},
                              SerialExecutor());
    return clip;
}

/// From positions in memory to coded bytes, as one clip; segmentation apart.
void run_code(benchmark::State& state, const Job& job) {
    const auto threads = static_cast<int>(state.range(0));
    const MeshSequence clip = read_clip(job);
    const MeshTopology mesh(clip.triangles, clip.vertex_count);
    const TbbExecutor executor(kNeverStop);
    Segmentation segmentation;
    if (uses_clusters(job.codec.method))
        segmentation = segment_clip(clip.view(), clip.triangles, job.segmentation, executor).value();
    for (auto _ : state)
        run_with_threads(threads, [&] {
            benchmark::DoNotOptimize(encode_clip(clip.view(), mesh, segmentation, job.codec, executor));
        });
    const double bytes = 4.0 * static_cast<double>(clip.positions.size());
    state.counters["MB/s"] = benchmark::Counter(bytes * static_cast<double>(state.iterations()) / 1e6,
                                                benchmark::Counter::kIsRate);
}

/// A grid of the splitcoder's bound, differences from the frame before, the bytes of a kind together, zstd.
void run_reference(benchmark::State& state, const Job& job) {
    const MeshSequence clip = read_clip(job);
    const double step = 2.0 / std::sqrt(3.0) * kBound * bounding_box(clip.view()).diagonal();
    const auto row = static_cast<std::size_t>(3 * clip.vertex_count), count = clip.positions.size();
    std::vector<std::int32_t> levels;
    std::vector<std::uint32_t> folded;
    std::vector<std::uint8_t> planes, coded(ZSTD_compressBound(4 * count));
    std::size_t size = 0;
    for (auto _ : state) {
        quantise(clip.view(), step > 0.0 ? 1.0 / step : 0.0, levels);
        take_deltas(levels, row, 1, folded);
        split_bytes(folded, planes);
        size = ZSTD_compress(coded.data(), coded.size(), planes.data(), planes.size(), 3);
    }
    state.counters["MB/s"] =
        benchmark::Counter(4.0 * static_cast<double>(count) * static_cast<double>(state.iterations()) / 1e6,
                           benchmark::Counter::kIsRate);
    state.counters["bpvf"] = 24.0 * static_cast<double>(size) / static_cast<double>(count);
}

/// From the coded bytes in memory to positions in memory: what a player does for every clip.
void run_decode(benchmark::State& state, const Job& job) {
    const auto threads = static_cast<int>(state.range(0));
    auto result = ResultDecoder::open(job.output, kMemory);
    if (!result) {
        state.SkipWithError(result.error().to_string().c_str());
        return;
    }
    const auto bitstream = result->reader().read_clip(0).value();
    const ResultHeader& header = result->reader().header();
    std::vector<float> positions(static_cast<std::size_t>(3 * header.vertex_count * header.frame_count));
    const TbbExecutor executor(kNeverStop);
    reset_peak_memory();
    for (auto _ : state) {
        run_with_threads(threads, [&] {
            const auto clip = decode_clip(bitstream, result->triangles(), -1, kMemory, executor).value();
            (void)clip->reconstruct(0, {positions.data(), header.frame_count, header.vertex_count}, executor);
        });
        benchmark::ClobberMemory();
    }
    const double bytes = 4.0 * static_cast<double>(positions.size());
    state.counters["MB/s"] = benchmark::Counter(bytes * static_cast<double>(state.iterations()) / 1e6,
                                                benchmark::Counter::kIsRate);
    state.counters["peak_MB"] = peak_memory_mb();
}

/// From a decoded clip to positions in memory: what a player does for every frame.
void run_show(benchmark::State& state, const Job& job) {
    const auto threads = static_cast<int>(state.range(0));
    auto result = ResultDecoder::open(job.output, kMemory);
    if (!result) {
        state.SkipWithError(result.error().to_string().c_str());
        return;
    }
    const ResultHeader& header = result->reader().header();
    std::vector<float> positions(static_cast<std::size_t>(3 * header.vertex_count * header.frame_count));
    const TbbExecutor executor(kNeverStop);
    const auto clip =
        decode_clip(result->reader().read_clip(0).value(), result->triangles(), -1, kMemory, executor)
            .value();
    for (auto _ : state) {
        run_with_threads(threads, [&] {
            (void)clip->reconstruct(0, {positions.data(), header.frame_count, header.vertex_count}, executor);
        });
        benchmark::ClobberMemory();
    }
    state.counters["MB/s"] = benchmark::Counter(
        4.0 * static_cast<double>(positions.size()) * static_cast<double>(state.iterations()) / 1e6,
        benchmark::Counter::kIsRate);
}

void run_memcpy(benchmark::State& state, const Job& job) {
    const auto bytes = SourceClip::open(job.input).value()->vertex_count() *
                       SourceClip::open(job.input).value()->frame_count() * 12;
    const std::vector<char> from(static_cast<std::size_t>(bytes), 1);
    std::vector<char> to(from.size());
    for (auto _ : state) {
        std::memcpy(to.data(), from.data(), to.size());
        benchmark::ClobberMemory();
    }
    state.counters["MB/s"] =
        benchmark::Counter(static_cast<double>(bytes) * static_cast<double>(state.iterations()) / 1e6,
                           benchmark::Counter::kIsRate);
}

Expected<void> write_sample(const std::filesystem::path& path) {
    auto synthetic = make_synthetic_clip("walker", 20000, 1);
    if (!synthetic) return tl::unexpected(synthetic.error());
    constexpr std::int64_t kFrames = 100;
    const std::int64_t vertices = (*synthetic)->vertex_count();
    auto writer = ClipWriter::create(path, kFrames, vertices, (*synthetic)->triangles(), (*synthetic)->fps(),
                                     "walker", true);
    if (!writer) return tl::unexpected(writer.error());
    std::vector<float> frame(static_cast<std::size_t>(3 * vertices));
    for (std::int64_t f = 0; f < kFrames; ++f) {
        (*synthetic)->write_frame(f, frame);
        if (auto done = (*writer)->write_frames(f, {frame.data(), 1, vertices}); !done) return done;
    }
    return (*writer)->finish();
}

int run(int argc, char** argv) {
    const auto blas = guard_blas(argv);
    if (!blas) {
        std::fprintf(stderr, "%s\n", blas.error().to_string().c_str());
        return 1;
    }
    std::fprintf(stderr, "%s\n", blas->c_str());
    benchmark::Initialize(&argc, argv);
    const TemporaryFolder folder;
    std::vector<Job> jobs;
    std::vector<std::filesystem::path> inputs(argv + 1, argv + argc);
    if (inputs.empty()) {
        const auto sample = folder.path / "walker.h5";
        if (auto done = write_sample(sample); !done) {
            std::fprintf(stderr, "%s\n", done.error().to_string().c_str());
            return 1;
        }
        inputs.push_back(sample);
    }
    for (const auto& input : inputs)
        for (const Coder& coder : coders())
            jobs.push_back(make_job(input, folder.path / (std::to_string(jobs.size()) + ".h5"), coder));
    for (const Job& job : jobs) {
        if (const BatchReport first = encode(job, 1); !first.all_done()) {
            std::fprintf(stderr, "%s\n", first.jobs.front().error->to_string().c_str());
            return 1;
        }
        const auto add = [&](const std::string& what, void (*measure)(benchmark::State&, const Job&)) {
            return benchmark::RegisterBenchmark(
                       (what + "/" + job.name).c_str(),
                       [&job, measure](benchmark::State& state) { measure(state, job); })
                ->UseRealTime()
                ->MeasureProcessCPUTime()
                ->Unit(benchmark::kMillisecond);
        };
        add("encode", run_encode)->Arg(1)->Arg(2);
        add("code", run_code)->Arg(1)->Arg(2);
        add("decode", run_decode)->Arg(1)->Arg(2);
        add("show", run_show)->Arg(1)->Arg(2);
        if (job.codec.method == CodecMethod::kSplitcoder) add("quantise-delta-zstd", run_reference);
        if (&job == &jobs.front()) add("memcpy", run_memcpy);
    }
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}

}  // namespace
}  // namespace batchenc

int main(int argc, char** argv) { return batchenc::run(argc, argv); }
