#include "kernels/edge_distortion.h"

#include <algorithm>
#include <cmath>

#include "kernels/bounding_box.h"

namespace batchenc {

namespace {

constexpr std::int64_t kBlockVertices = 2048;

double distance(const float* a, const float* b) { return std::sqrt(squared_distance(a, b)); }

}  // namespace

EdgeDistortionMeter::EdgeDistortionMeter(std::span<const Triangle> triangles, std::int64_t vertex_count)
    : vertex_count_(vertex_count), block_count_((vertex_count + kBlockVertices - 1) / kBlockVertices) {
    const auto vertices = static_cast<std::size_t>(vertex_count);
    // Both directions of every side of every triangle, in rows; then each row sorted, without repetitions.
    std::vector<std::int32_t> start(vertices + 1, 0);
    const auto each_side = [&](auto&& visit) {
        for (const Triangle& t : triangles) {
            for (std::size_t k = 0; k < 3; ++k) {
                const std::int32_t a = t[k], b = t[(k + 1) % 3];
                if (a == b) continue;
                visit(static_cast<std::size_t>(a), b);
                visit(static_cast<std::size_t>(b), a);
            }
        }
    };
    each_side([&](std::size_t a, std::int32_t) { ++start[a + 1]; });
    for (std::size_t v = 0; v < vertices; ++v) start[v + 1] += start[v];
    neighbours_.resize(static_cast<std::size_t>(start[vertices]));
    std::vector<std::int32_t> fill(start.begin(), start.end() - 1);
    each_side([&](std::size_t a, std::int32_t b) { neighbours_[static_cast<std::size_t>(fill[a]++)] = b; });

    first_.assign(vertices + 1, 0);
    auto kept = neighbours_.begin();
    for (std::size_t v = 0; v < vertices; ++v) {
        const auto begin = neighbours_.begin() + start[v], end = neighbours_.begin() + start[v + 1];
        std::sort(begin, end);
        const auto row = kept;
        for (auto from = begin; from != end; ++from) {  // kept never overtakes from
            if (kept == row || *(kept - 1) != *from) *kept++ = *from;
        }
        first_[v + 1] = static_cast<std::int32_t>(kept - neighbours_.begin());
        if (kept != row) ++vertices_with_edges_;
    }
    neighbours_.erase(kept, neighbours_.end());
    neighbours_.shrink_to_fit();
    steps_.resize(static_cast<std::size_t>(kWindow * vertex_count));
}

double EdgeDistortionMeter::local_deviation(const float* source, const float* decoded,
                                            std::int64_t vertex) const {
    // The weighted variance of one pass (D. H. D. West, "Updating mean and variance estimates", 1979).
    double weights = 0.0, mean = 0.0, squares = 0.0;
    const auto v = static_cast<std::size_t>(vertex);
    for (std::int32_t k = first_[v]; k < first_[v + 1]; ++k) {
        const std::int64_t w = neighbours_[static_cast<std::size_t>(k)];
        const double length = distance(source + 3 * vertex, source + 3 * w);
        if (!(length > 0.0)) continue;
        const double decoded_length = distance(decoded + 3 * vertex, decoded + 3 * w);
        const double difference = std::abs(decoded_length - length) / length;
        weights += length;
        const double off = difference - mean;
        mean += off * (length / weights);
        squares += length * off * (difference - mean);
    }
    return weights > 0.0 ? std::sqrt(std::max(0.0, squares / weights)) : 0.0;
}

double EdgeDistortionMeter::step_difference(const Run& run, std::int64_t frame, std::int64_t vertex) {
    const float* before_source =
        frame == 0 ? last_source_.data() + 3 * vertex : run.source.at(frame - 1, vertex);
    const float* before_decoded =
        frame == 0 ? last_decoded_.data() + 3 * vertex : run.decoded.at(frame - 1, vertex);
    const double rest = rest_step_ * rest_step_;
    const double step = std::sqrt(squared_distance(run.source.at(frame, vertex), before_source) + rest);
    const double decoded_step =
        std::sqrt(squared_distance(run.decoded.at(frame, vertex), before_decoded) + rest);
    const std::int64_t number = run.first_frame + frame - 1;  // of the step in the sequence
    const auto slot = [&](std::int64_t i) -> float& {
        return steps_[static_cast<std::size_t>(i * vertex_count_ + vertex)];
    };
    slot(number % kWindow) = static_cast<float>(step);
    const std::int64_t known = std::min(kWindow, number + 1);
    double speed = 0.0;
    for (std::int64_t i = 0; i < known; ++i) speed += static_cast<double>(slot(i));
    if (!(speed > 0.0)) return 0.0;
    return std::abs(decoded_step - step) * static_cast<double>(known) / speed;
}

void EdgeDistortionMeter::measure_block(const Run& run, std::int64_t block) {
    const std::int64_t first = block * kBlockVertices;
    const std::int64_t end = std::min(first + kBlockVertices, vertex_count_);
    for (std::int64_t f = 0; f < run.source.frame_count(); ++f) {
        Partial partial;
        for (std::int64_t v = first; v < end; ++v)
            partial.deviation += local_deviation(run.source.at(f, 0), run.decoded.at(f, 0), v);
        if (run.first_frame + f > 0) {
            for (std::int64_t v = first; v < end; ++v) partial.step += step_difference(run, f, v);
        }
        partials_[static_cast<std::size_t>(f * block_count_ + block)] = partial;
    }
}

void EdgeDistortionMeter::add(PositionsView source, PositionsView decoded, const Executor& executor) {
    const std::int64_t frame_count = source.frame_count();
    if (frame_count == 0 || vertex_count_ == 0) return;
    if (frame_count_ == 0) rest_step_ = kTimeStep * bounding_box(source.frames(0, 1)).diagonal();
    partials_.resize(static_cast<std::size_t>(frame_count * block_count_));
    const Run run{source, decoded, frame_count_};
    executor.for_each(block_count_, [&](std::int64_t block) { measure_block(run, block); });
    for (std::int64_t f = 0; f < frame_count; ++f) {
        Partial whole;  // frame by frame, so that the runs do not change the order
        for (std::int64_t b = 0; b < block_count_; ++b) {
            const Partial& part = partials_[static_cast<std::size_t>(f * block_count_ + b)];
            whole.deviation += part.deviation;
            whole.step += part.step;
        }
        sum_.deviation += whole.deviation;
        sum_.step += whole.step;
    }
    frame_count_ += frame_count;
    const auto keep = [&](PositionsView frames, std::vector<float>& last) {
        last.assign(frames.at(frame_count - 1, 0), frames.at(frame_count - 1, 0) + 3 * vertex_count_);
    };
    keep(source, last_source_);
    keep(decoded, last_decoded_);
}

EdgeDistortion EdgeDistortionMeter::finish() const {
    EdgeDistortion distortion;
    if (frame_count_ > 0 && vertices_with_edges_ > 0)
        distortion.space =
            sum_.deviation / (static_cast<double>(vertices_with_edges_) * static_cast<double>(frame_count_));
    if (frame_count_ > 1 && vertex_count_ > 0)
        distortion.time =
            sum_.step / (static_cast<double>(vertex_count_) * static_cast<double>(frame_count_ - 1));
    const double weighted = kTimeWeight * distortion.time;
    distortion.total = std::sqrt(distortion.space * distortion.space + weighted * weighted);
    return distortion;
}

}  // namespace batchenc
