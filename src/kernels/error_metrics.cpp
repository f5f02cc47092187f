#include "kernels/error_metrics.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "kernels/bounding_box.h"

namespace batchenc {
namespace {

// A block's running state (24 bytes of sums and 12 of origin a vertex) stays in the second-level cache while
// the block's vertices stream by frame after frame; long enough for the prefetcher to be worth its start.
constexpr std::int64_t kBlockVertices = 2048;

// Work goes by groups of four vertices: three vectors of four doubles, whatever the CPU has. GCC lowers them
// to what the target offers, so every target sums in the same order and gives the same bits.
constexpr std::int64_t kGroup = 4;
using Vector4d = double __attribute__((vector_size(32)));
using Vector4f = float __attribute__((vector_size(16)));

struct Block {
    const float* source;         // first vertex of the block in the first frame of the run
    const float* decoded;        // the same of the decoded sequence
    const float* before_source;  // both in the frame before the run; the run's first where there is none
    const float* before_decoded;
    std::int64_t frame_stride;  // floats from a frame to the next
    std::int64_t frame_count;
    std::int64_t vertex_count;
    const float* frame_origins;  // vertex 0 of the first frame of the run; frame_stride apart
    const float* origin;
    double* sum;
    ErrorMeter::Partial* partials;
    std::int64_t partial_stride;
    ErrorMeter::Bounds* bounds;
};

[[gnu::always_inline]] inline void load(const float* from, Vector4f& to) {
    std::memcpy(&to, from, sizeof(to));
}
[[gnu::always_inline]] inline void load(const double* from, Vector4d& to) {
    std::memcpy(&to, from, sizeof(to));
}
[[gnu::always_inline]] inline void store(const Vector4d& from, double* to) {
    std::memcpy(to, &from, sizeof(from));
}

[[gnu::always_inline]] inline double sum_lanes(const Vector4d& v) { return (v[0] + v[1]) + (v[2] + v[3]); }

// Kept over a frame's groups. Where there are three, index and lane say which coordinate: 4 i + lane,
// modulo 3.
struct Accumulators {
    Vector4d squared_error, squared_jump, max_squared_error, sum[3], sum_of_squares,
        sum_of_squares_about_past;
    Vector4f low[3], high[3];
};

[[gnu::always_inline]] inline void add_group(const float* source, const float* decoded,
                                             const float* before_source, const float* before_decoded,
                                             const float* past, double* sum,
                                             const Vector4d (&frame_origin)[3], Accumulators& a) {
    Vector4d squared[3], squared_jump[3], squared_about_frame[3], squared_about_past[3];
    for (int i = 0; i < 3; ++i) {
        Vector4f narrow, narrow_decoded, narrow_past, narrow_before, narrow_before_decoded;
        load(source + 4 * i, narrow);
        load(decoded + 4 * i, narrow_decoded);
        load(past + 4 * i, narrow_past);
        load(before_source + 4 * i, narrow_before);
        load(before_decoded + 4 * i, narrow_before_decoded);
        a.low[i] = narrow < a.low[i] ? narrow : a.low[i];
        a.high[i] = narrow > a.high[i] ? narrow : a.high[i];
        const Vector4d wide = __builtin_convertvector(narrow, Vector4d);
        const Vector4d error = wide - __builtin_convertvector(narrow_decoded, Vector4d);
        squared[i] = error * error;
        const Vector4d error_before = __builtin_convertvector(narrow_before, Vector4d) -
                                      __builtin_convertvector(narrow_before_decoded, Vector4d);
        const Vector4d jump = error - error_before;
        squared_jump[i] = jump * jump;
        const Vector4d about_frame = wide - frame_origin[i];
        a.sum[i] += about_frame;
        squared_about_frame[i] = about_frame * about_frame;
        const Vector4d about_past = wide - __builtin_convertvector(narrow_past, Vector4d);
        squared_about_past[i] = about_past * about_past;
        Vector4d running;
        load(sum + 4 * i, running);
        store(running + about_past, sum + 4 * i);
    }
    a.squared_jump += squared_jump[0] + squared_jump[1] + squared_jump[2];
    a.sum_of_squares += squared_about_frame[0] + squared_about_frame[1] + squared_about_frame[2];
    a.sum_of_squares_about_past += squared_about_past[0] + squared_about_past[1] + squared_about_past[2];
    // x0 y0 z0 x1 | y1 z1 x2 y2 | z2 x3 y3 z3: each coordinate gathered by blends, then turned into line
    const Vector4d x = __builtin_shufflevector(__builtin_shufflevector(squared[0], squared[1], 0, 1, 6, 3),
                                               squared[2], 0, 5, 2, 3);  // of vertices 0 3 2 1
    const Vector4d y = __builtin_shufflevector(__builtin_shufflevector(squared[0], squared[1], 4, 1, 2, 7),
                                               squared[2], 0, 1, 6, 3);  // of vertices 1 0 3 2
    const Vector4d z = __builtin_shufflevector(__builtin_shufflevector(squared[0], squared[1], 0, 5, 2, 3),
                                               squared[2], 4, 1, 2, 7);  // of vertices 2 1 0 3
    const Vector4d distance =
        x + __builtin_shufflevector(y, y, 1, 2, 3, 0) + __builtin_shufflevector(z, z, 2, 3, 0, 1);
    a.squared_error += distance;
    a.max_squared_error = distance > a.max_squared_error ? distance : a.max_squared_error;
}

[[gnu::always_inline]] inline void measure_block(const Block& block) {
    const std::int64_t whole = block.vertex_count / kGroup * kGroup;
    const std::int64_t rest = block.vertex_count - whole;
    Accumulators a;
    for (int i = 0; i < 3; ++i) {
        for (int lane = 0; lane < 4; ++lane) {
            const auto axis = static_cast<std::size_t>((4 * i + lane) % 3);
            a.low[i][lane] = block.bounds->low[axis];
            a.high[i][lane] = block.bounds->high[axis];
        }
    }
    for (std::int64_t f = 0; f < block.frame_count; ++f) {
        const float* source = block.source + f * block.frame_stride;
        const float* decoded = block.decoded + f * block.frame_stride;
        const float* before_source = f == 0 ? block.before_source : source - block.frame_stride;
        const float* before_decoded = f == 0 ? block.before_decoded : decoded - block.frame_stride;
        const float* o = block.frame_origins + f * block.frame_stride;
        const Vector4d frame_origin[3] = {
            {o[0], o[1], o[2], o[0]}, {o[1], o[2], o[0], o[1]}, {o[2], o[0], o[1], o[2]}};
        a.squared_error = a.squared_jump = a.max_squared_error = a.sum_of_squares =
            a.sum_of_squares_about_past = Vector4d{};
        a.sum[0] = a.sum[1] = a.sum[2] = Vector4d{};
        for (std::int64_t v = 0; v < whole; v += kGroup) {
            add_group(source + 3 * v, decoded + 3 * v, before_source + 3 * v, before_decoded + 3 * v,
                      block.origin + 3 * v, block.sum + 3 * v, frame_origin, a);
        }
        if (rest > 0) {
            // The last group is filled up with the frame's origin, without error and at rest: adds zeros.
            float padded[5][3 * kGroup];
            for (auto& row : padded) {
                for (std::int64_t i = 0; i < 3 * kGroup; ++i) row[i] = o[i % 3];
            }
            for (std::int64_t i = 0; i < 3 * rest; ++i) {
                padded[0][i] = source[3 * whole + i];
                padded[1][i] = decoded[3 * whole + i];
                padded[2][i] = before_source[3 * whole + i];
                padded[3][i] = before_decoded[3 * whole + i];
                padded[4][i] = block.origin[3 * whole + i];
            }
            add_group(padded[0], padded[1], padded[2], padded[3], padded[4], block.sum + 3 * whole,
                      frame_origin, a);
        }
        ErrorMeter::Partial& partial = block.partials[f * block.partial_stride];
        partial.squared_error = sum_lanes(a.squared_error);
        partial.squared_jump = sum_lanes(a.squared_jump);
        const Vector4d& m = a.max_squared_error;
        partial.max_squared_error = std::max(std::max(m[0], m[1]), std::max(m[2], m[3]));
        partial.sum = {};
        for (int i = 0; i < 12; ++i) partial.sum[static_cast<std::size_t>(i % 3)] += a.sum[i / 4][i % 4];
        partial.sum_of_squares = sum_lanes(a.sum_of_squares);
        partial.sum_of_squares_about_past = sum_lanes(a.sum_of_squares_about_past);
    }
    for (int i = 0; i < 12; ++i) {
        const auto axis = static_cast<std::size_t>(i % 3);
        block.bounds->low[axis] = std::min(block.bounds->low[axis], a.low[i / 4][i % 4]);
        block.bounds->high[axis] = std::max(block.bounds->high[axis], a.high[i / 4][i % 4]);
    }
}

void measure_block_baseline(const Block& block) { measure_block(block); }

#if defined(__x86_64__)
[[gnu::target("avx2")]] void measure_block_avx2(const Block& block) { measure_block(block); }
#endif

auto choose_measure_block() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) return &measure_block_avx2;
#endif
    return &measure_block_baseline;
}

double percent(double squared_error, double squared_spread) {
    if (squared_error == 0.0) return 0.0;
    if (!(squared_spread > 0.0)) return std::numeric_limits<double>::quiet_NaN();
    return 100.0 * std::sqrt(squared_error / squared_spread);
}

}  // namespace

ErrorMeter::ErrorMeter(std::int64_t vertex_count)
    : vertex_count_(vertex_count), block_count_((vertex_count + kBlockVertices - 1) / kBlockVertices) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    sum_.resize(static_cast<std::size_t>((vertex_count + kGroup - 1) / kGroup * kGroup * 3));
    bounds_.resize(static_cast<std::size_t>(block_count_),
                   Bounds{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}});
}

void ErrorMeter::add(PositionsView source, PositionsView decoded, const Executor& executor) {
    const std::int64_t frame_count = source.frame_count();
    if (frame_count == 0) return;
    if (origin_.empty()) origin_.assign(source.data(), source.data() + 3 * vertex_count_);
    if (frames_.empty()) keep_last(source.frames(0, 1), decoded.frames(0, 1));  // a first frame does not jump
    partials_.resize(static_cast<std::size_t>(frame_count * block_count_));

    const auto measure = choose_measure_block();
    executor.for_each(block_count_, [&](std::int64_t b) {
        const std::int64_t first = b * kBlockVertices;
        measure(Block{.source = source.at(0, first),
                      .decoded = decoded.at(0, first),
                      .before_source = last_source_.data() + 3 * first,
                      .before_decoded = last_decoded_.data() + 3 * first,
                      .frame_stride = 3 * vertex_count_,
                      .frame_count = frame_count,
                      .vertex_count = std::min(kBlockVertices, vertex_count_ - first),
                      .frame_origins = source.data(),
                      .origin = origin_.data() + 3 * first,
                      .sum = sum_.data() + 3 * first,
                      .partials = partials_.data() + b,
                      .partial_stride = block_count_,
                      .bounds = &bounds_[static_cast<std::size_t>(b)]});
    });

    for (std::int64_t f = 0; f < frame_count; ++f) {
        const auto* of_frame = partials_.data() + f * block_count_;
        Partial whole{};
        for (std::int64_t b = 0; b < block_count_; ++b) {
            const Partial& part = of_frame[b];
            whole.squared_error += part.squared_error;
            whole.squared_jump += part.squared_jump;
            whole.max_squared_error = std::max(whole.max_squared_error, part.max_squared_error);
            for (std::size_t axis = 0; axis < 3; ++axis) whole.sum[axis] += part.sum[axis];
            whole.sum_of_squares += part.sum_of_squares;
            whole.sum_of_squares_about_past += part.sum_of_squares_about_past;
        }
        frames_.push_back({whole.squared_error, whole.squared_jump, whole.max_squared_error});
        double squared_sum = 0.0;
        for (const double sum : whole.sum) squared_sum += sum * sum;
        if (vertex_count_ > 0) {
            squared_spread_ +=
                std::max(0.0, whole.sum_of_squares - squared_sum / static_cast<double>(vertex_count_));
        }
        sum_of_squares_ += whole.sum_of_squares_about_past;
    }
    keep_last(source.frames(frame_count - 1, frame_count), decoded.frames(frame_count - 1, frame_count));
}

void ErrorMeter::keep_last(PositionsView source, PositionsView decoded) {
    last_source_.assign(source.data(), source.data() + source.value_count());
    last_decoded_.assign(decoded.data(), decoded.data() + decoded.value_count());
}

ErrorMetrics ErrorMeter::finish() const {
    ErrorMetrics metrics;
    const auto frame_count = static_cast<double>(frames_.size());
    const auto vertex_count = static_cast<double>(vertex_count_);
    if (frames_.empty() || vertex_count_ == 0) {
        metrics.frame_rmse.resize(frames_.size());
        metrics.frame_max_error.resize(frames_.size());
        metrics.frame_jump.resize(frames_.size());
        return metrics;
    }
    double squared_error = 0.0, max_squared_error = 0.0;
    for (const Frame& frame : frames_) {
        squared_error += frame.squared_error;
        max_squared_error = std::max(max_squared_error, frame.max_squared_error);
        metrics.frame_rmse.push_back(std::sqrt(frame.squared_error / vertex_count));
        metrics.frame_max_error.push_back(std::sqrt(frame.max_squared_error));
        metrics.frame_jump.push_back(std::sqrt(frame.squared_jump / vertex_count));
    }
    metrics.rmse = std::sqrt(squared_error / (frame_count * vertex_count));
    metrics.max_error = std::sqrt(max_squared_error);

    double squared_sum = 0.0;
    for (const double sum : sum_) squared_sum += sum * sum;
    metrics.da_spread = std::max(0.0, sum_of_squares_ - squared_sum / frame_count);
    metrics.kg_spread = squared_spread_;
    metrics.da = percent(squared_error, metrics.da_spread);
    metrics.kg = percent(squared_error, metrics.kg_spread);

    Bounds box = bounds_.front();
    for (const Bounds& bounds : bounds_) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            box.low[axis] = std::min(box.low[axis], bounds.low[axis]);
            box.high[axis] = std::max(box.high[axis], bounds.high[axis]);
        }
    }
    metrics.diagonal = BoundingBox{box.low, box.high}.diagonal();
    if (metrics.max_error > 0.0) {
        metrics.max_error_relative = metrics.diagonal > 0.0 ? metrics.max_error / metrics.diagonal
                                                            : std::numeric_limits<double>::quiet_NaN();
    }
    return metrics;
}

}  // namespace batchenc
