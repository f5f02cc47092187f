// Each kernel on one thread, in MB/s of what it reads or makes and, where it computes, in GFlop/s, beside a
// memcpy and a matrix product of the same size in the same run: only the ratios carry over to another
// machine.

#include <benchmark/benchmark.h>
#include <cblas.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>

#include "codecs/rlpca_layout.h"
#include "codecs/segmentation.h"
#include "core/matrix.h"
#include "kernels/bit_coder.h"
#include "kernels/bounding_box.h"
#include "kernels/crc32c.h"
#include "kernels/deviation.h"
#include "kernels/error_metrics.h"
#include "kernels/order_coder.h"
#include "kernels/range_coder.h"
#include "kernels/reconstruction.h"
#include "kernels/surface.h"
#include "kernels/surface_coder.h"
#include "kernels/svd.h"
#include "kernels/synthetic_clip.h"
#include "pipeline/blas_guard.h"

namespace batchenc {
namespace {

const SerialExecutor kSerial;

/// A walker of about 7,000 vertices and 200 frames, the size of the classic dance sequence.
const MeshSequence& sample() {
    static const MeshSequence clip = [] {
        const auto synthetic = make_synthetic_clip("walker", 7000, 1).value();
        MeshSequence made;
        made.vertex_count = synthetic->vertex_count();
        made.frame_count = 200;
        made.triangles = synthetic->triangles();
        made.positions.resize(static_cast<std::size_t>(3 * made.frame_count * made.vertex_count));
        for (std::int64_t f = 0; f < made.frame_count; ++f) {
            synthetic->write_frame(f, std::span(made.positions)
                                          .subspan(static_cast<std::size_t>(3 * f * made.vertex_count),
                                                   static_cast<std::size_t>(3 * made.vertex_count)));
        }
        return made;
    }();
    return clip;
}

void report(benchmark::State& state, double bytes, double flop = 0.0) {
    const auto runs = static_cast<double>(state.iterations());
    state.counters["MB/s"] = benchmark::Counter(bytes * runs / 1e6, benchmark::Counter::kIsRate);
    if (flop > 0.0)
        state.counters["GFlop/s"] = benchmark::Counter(flop * runs / 1e9, benchmark::Counter::kIsRate);
}

void BM_memcpy(benchmark::State& state) {
    const auto& clip = sample();
    std::vector<float> copy(clip.positions.size());
    for (auto _ : state) {
        std::memcpy(copy.data(), clip.positions.data(), copy.size() * sizeof(float));
        benchmark::ClobberMemory();
    }
    report(state, static_cast<double>(clip.view().size_bytes()));
}
BENCHMARK(BM_memcpy);

/// Matrix products of the size of a cluster's: (3n × F) by (F × 32).
template <typename T>
void BM_gemm(benchmark::State& state) {
    const int m = 1050, n = 32, k = 200;
    const std::vector<T> a(static_cast<std::size_t>(m * k), T(0.5)),
        b(static_cast<std::size_t>(k * n), T(0.25));
    std::vector<T> c(static_cast<std::size_t>(m * n));
    for (auto _ : state) {
        if constexpr (sizeof(T) == 4) {
            cblas_sgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, m, n, k, 1.0f, a.data(), m, b.data(), k,
                        0.0f, c.data(), m);
        } else {
            cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, m, n, k, 1.0, a.data(), m, b.data(), k,
                        0.0, c.data(), m);
        }
        benchmark::ClobberMemory();
    }
    report(state, static_cast<double>(sizeof(T)) * (m * k + k * n + m * n), 2.0 * m * n * k);
}
BENCHMARK(BM_gemm<float>)->Name("BM_sgemm");
BENCHMARK(BM_gemm<double>)->Name("BM_dgemm");

void BM_bounding_box(benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(bounding_box(sample().view()));
    report(state, static_cast<double>(sample().view().size_bytes()));
}
BENCHMARK(BM_bounding_box);

/// theta of all vertices against range(0) clusters.
void BM_deviation(benchmark::State& state) {
    const auto& clip = sample();
    const auto clusters = state.range(0);
    std::vector<LocalFrameTrack> tracks(static_cast<std::size_t>(clusters),
                                        LocalFrameTrack(clip.frame_count));
    for (auto& track : tracks) {
        for (std::int64_t f = 0; f < clip.frame_count; ++f) track.set(f, LocalFrame{});
    }
    std::vector<float> theta(static_cast<std::size_t>(clusters * kVertexBlock));
    AlignedFloats block(vertex_block_size(clip.frame_count));
    for (auto _ : state) {
        for (std::int64_t v = 0; v < clip.vertex_count; v += kVertexBlock) {
            load_vertex_block(clip.view(), v, block.data());
            deviation_block(block.data(), clip.frame_count, tracks, theta);
        }
        benchmark::ClobberMemory();
    }
    report(state, static_cast<double>(clip.view().size_bytes()),
           deviation_flop(clip.frame_count, clip.vertex_count, clusters));
}
BENCHMARK(BM_deviation)->Arg(5)->Arg(20)->Arg(40);

/// Every method of segmentation with range(1) clusters.
void BM_segmentation(benchmark::State& state) {
    const auto& clip = sample();
    const SegmentationParameters parameters{.method = static_cast<SegmentationMethod>(state.range(0)),
                                            .clusters = static_cast<std::int32_t>(state.range(1))};
    for (auto _ : state)
        benchmark::DoNotOptimize(segment_clip(clip.view(), clip.triangles, parameters, kSerial));
    report(state, static_cast<double>(clip.view().size_bytes()));
    state.SetLabel(std::string(to_name(parameters.method)));
}
BENCHMARK(BM_segmentation)->ArgsProduct({{1, 2, 3, 4}, {10, 40}})->Unit(benchmark::kMillisecond);

#if defined(__x86_64__)
/// Ten chains of fused products, which hide each other's latency, in registers alone: 160 operations a round.
__attribute__((target("avx2,fma"))) float multiply_add(std::int64_t rounds) {
    const __m256 factor = _mm256_set1_ps(0.999f), term = _mm256_set1_ps(0.001f);
    __m256 chains[10];
    for (auto& chain : chains) chain = factor;
    for (std::int64_t k = 0; k < rounds; ++k)
        for (auto& chain : chains) chain = _mm256_fmadd_ps(chain, factor, term);
    __m256 sum = chains[0];
    for (const auto& chain : chains) sum = _mm256_add_ps(sum, chain);
    return _mm256_cvtss_f32(sum);
}

/// What one core can do at most with AVX2 in float32: the GFlop/s of kernels are parts of it.
void BM_peak(benchmark::State& state) {
    std::int64_t rounds = 1 << 16;
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
        state.SkipWithError("this CPU has no AVX2");
        return;
    }
    for (auto _ : state) {
        benchmark::DoNotOptimize(rounds);  // or the compiler calls it once for all
        benchmark::DoNotOptimize(multiply_add(rounds));
    }
    report(state, 0.0, 160.0 * static_cast<double>(rounds));
}
BENCHMARK(BM_peak);
#endif

/// Rows × columns × rank; the method is the last argument (0 direct, 1 Gram, 2 randomised).
void BM_svd(benchmark::State& state) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal;
    const ColMajorMatrixXf left =
        ColMajorMatrixXf::NullaryExpr(state.range(0), 30, [&] { return normal(random); });
    const ColMajorMatrixXf right =
        ColMajorMatrixXf::NullaryExpr(30, state.range(1), [&] { return normal(random); });
    const Eigen::VectorXf fall = Eigen::VectorXf::NullaryExpr(
        30, [](Eigen::Index l) { return std::pow(0.7f, static_cast<float>(l)); });
    const ColMajorMatrixXf matrix = left * fall.asDiagonal() * right;
    const auto method = static_cast<SvdMethod>(state.range(3));
    for (auto _ : state) benchmark::DoNotOptimize(truncated_svd(matrix, state.range(2), method));
    report(state, 4.0 * static_cast<double>(matrix.size()));
    state.SetLabel(choose_svd_method(state.range(0), state.range(1), state.range(2)) == method ? "chosen"
                                                                                               : "");
}
BENCHMARK(BM_svd)
    ->ArgsProduct({{1050}, {200}, {10, 20, 40}, {0, 1, 2}})
    ->ArgsProduct({{450}, {400}, {20}, {0, 1, 2}})
    ->ArgsProduct({{6300}, {48}, {20}, {0, 1, 2}})
    ->ArgsProduct({{60}, {200}, {20}, {0, 1, 2}});

std::vector<std::int32_t> gaussian_integers(double scale) {
    std::mt19937 random(2);
    std::normal_distribution<double> normal(0.0, scale);
    std::vector<std::int32_t> values(1 << 18);
    for (auto& v : values) v = static_cast<std::int32_t>(std::lround(normal(random)));
    return values;
}

void BM_range_encode(benchmark::State& state) {
    const auto values = gaussian_integers(static_cast<double>(state.range(0)));
    std::size_t size = 0;
    for (auto _ : state) {
        RangeEncoder encoder;
        IntegerModel model;
        for (const auto v : values) encoder.encode(model, v);
        size = encoder.finish().size();
    }
    state.counters["bits"] = 8.0 * static_cast<double>(size) / static_cast<double>(values.size());
    state.counters["Msymbols/s"] =
        benchmark::Counter(static_cast<double>(values.size()) * static_cast<double>(state.iterations()) / 1e6,
                           benchmark::Counter::kIsRate);
}
BENCHMARK(BM_range_encode)->Arg(1)->Arg(30)->Arg(1000);

void BM_range_decode(benchmark::State& state) {
    const auto values = gaussian_integers(static_cast<double>(state.range(0)));
    RangeEncoder encoder;
    IntegerModel model;
    for (const auto v : values) encoder.encode(model, v);
    const auto bytes = encoder.finish();
    std::int64_t sum = 0;
    for (auto _ : state) {
        RangeDecoder decoder = RangeDecoder::open(bytes).value();
        IntegerModel own;
        for (std::size_t i = 0; i < values.size(); ++i) sum += decoder.decode(own);
    }
    benchmark::DoNotOptimize(sum);
    state.counters["Msymbols/s"] =
        benchmark::Counter(static_cast<double>(values.size()) * static_cast<double>(state.iterations()) / 1e6,
                           benchmark::Counter::kIsRate);
}
BENCHMARK(BM_range_decode)->Arg(1)->Arg(30)->Arg(1000);

/// One cluster of 350 vertices with range(0) components; the sgemm beside it is BM_sgemm.
void BM_reconstruction(benchmark::State& state) {
    constexpr std::int64_t kVertices = 350, kFrames = 200, kStride = 208;
    const auto components = state.range(0);
    std::vector<std::int32_t> vertices;
    for (std::int32_t v = 0; v < kVertices; ++v) vertices.push_back(v);
    PackedBasis basis(kVertices, components);
    std::fill(basis.values.begin(), basis.values.end(), 0.5f);
    const std::vector<float> coefficients(static_cast<std::size_t>(components * kStride), 0.25f);
    LocalFrameTrack track(kFrames);
    for (std::int64_t f = 0; f < kFrames; ++f) track.set(f, LocalFrame{});
    const ClusterGeometry cluster = {vertices, &basis, coefficients.data(), track.values.data(), kStride};
    std::vector<float> out(static_cast<std::size_t>(3 * kVertices * kFrames));
    for (auto _ : state) {
        for (std::int64_t f = 0; f < kFrames; f += kFrameLanes)
            reconstruct_cluster(cluster, f, kFrameLanes, out.data() + 3 * kVertices * f, 3 * kVertices);
        benchmark::ClobberMemory();
    }
    report(state, static_cast<double>(4 * out.size()),
           static_cast<double>(kVertices * kFrames) * (6.0 * static_cast<double>(components) + 18.0));
}
BENCHMARK(BM_reconstruction)->Arg(5)->Arg(20)->Arg(40);

void BM_connectivity_encode(benchmark::State& state) {
    std::size_t size = 0;
    for (auto _ : state) {
        BitCoder surface_coder, order_coder;
        const CodedSurface coded = encode_surface(surface_coder, Surface::of(sample().triangles));
        encode_order(order_coder, coded, sample().triangles, sample().vertex_count);
        size = surface_coder.finish().size() + order_coder.finish().size();
    }
    report(state, 12.0 * static_cast<double>(sample().triangles.size()));
    state.counters["bits/triangle"] =
        8.0 * static_cast<double>(size) / static_cast<double>(sample().triangles.size());
}
BENCHMARK(BM_connectivity_encode);

void BM_connectivity_decode(benchmark::State& state) {
    BitCoder surface_encoder, order_encoder;
    const CodedSurface coded = encode_surface(surface_encoder, Surface::of(sample().triangles));
    encode_order(order_encoder, coded, sample().triangles, sample().vertex_count);
    const auto surface_bytes = surface_encoder.finish(), order_bytes = order_encoder.finish();
    for (auto _ : state) {
        BitCoder surface_coder(surface_bytes), order_coder(order_bytes);
        const auto surface = decode_surface(
            surface_coder, static_cast<std::int64_t>(sample().triangles.size()), sample().vertex_count);
        benchmark::DoNotOptimize(decode_order(order_coder, *surface, sample().vertex_count));
    }
    report(state, 12.0 * static_cast<double>(sample().triangles.size()));
}
BENCHMARK(BM_connectivity_decode);

void BM_crc32c(benchmark::State& state) {
    const std::vector<std::uint8_t> bytes(1 << 20, 0x5a);
    for (auto _ : state)
        benchmark::DoNotOptimize(state.range(0) != 0 ? crc32c(bytes) : crc32c_portable(bytes));
    report(state, static_cast<double>(bytes.size()));
}
BENCHMARK(BM_crc32c)->Arg(0)->Arg(1);

void BM_error_meter(benchmark::State& state) {
    for (auto _ : state) {
        ErrorMeter meter(sample().vertex_count);
        meter.add(sample().view(), sample().view(), kSerial);
        benchmark::DoNotOptimize(meter.finish());
    }
    report(state, 2.0 * static_cast<double>(sample().view().size_bytes()));
}
BENCHMARK(BM_error_meter);

}  // namespace
}  // namespace batchenc

int main(int argc, char** argv) {
    const auto blas = batchenc::guard_blas(argv);
    if (!blas) {
        std::fprintf(stderr, "%s\n", blas.error().to_string().c_str());
        return 1;
    }
    std::fprintf(stderr, "%s\n", blas->c_str());
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
