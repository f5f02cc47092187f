#include "codecs/baselines/coded_motion.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "codecs/integer_contexts.h"
#include "kernels/range_coder.h"
#include "kernels/rigid_motion.h"

namespace batchenc {
namespace {

constexpr int kMotionBits = 16;

std::int32_t rounded(double value) { return static_cast<std::int32_t>(std::lround(value)); }

/// The rotation of a quaternion of any length.
std::array<double, 9> rotation_of_quaternion(const std::array<double, 4>& q) {
    const double squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (squared == 0.0) return {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double s = 2.0 / squared;
    const auto of = [&](std::size_t a, std::size_t b) { return s * q[a] * q[b]; };
    return {1.0 - of(2, 2) - of(3, 3), of(1, 2) - of(0, 3),       of(1, 3) + of(0, 2),
            of(1, 2) + of(0, 3),       1.0 - of(1, 1) - of(3, 3), of(2, 3) - of(0, 1),
            of(1, 3) - of(0, 2),       of(2, 3) + of(0, 1),       1.0 - of(1, 1) - of(2, 2)};
}

}  // namespace

double CodedMotion::step() const { return std::ldexp(static_cast<double>(largest_side_), -kMotionBits); }

void CodedMotion::set_best(PositionsView positions) {
    std::vector<std::int32_t> all(static_cast<std::size_t>(positions.vertex_count()));
    std::iota(all.begin(), all.end(), 0);
    const LocalFrameTrack best =
        rigid_motion(positions, all, {positions.at(0, 0), static_cast<std::size_t>(3 * all.size())});
    Eigen::Quaterniond last = Eigen::Quaterniond::Identity();
    for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
        Eigen::Matrix3d rotation;
        for (int k = 0; k < 9; ++k) rotation(k / 3, k % 3) = static_cast<double>(best.row(k)[f]);
        Eigen::Quaterniond q(rotation);
        q.normalize();
        if (q.dot(last) < 0.0) q.coeffs() = -q.coeffs();  // of the two that mean the same the nearer one
        last = q;
        constexpr double kUnit = 1 << kMotionBits;
        const std::array<double, 4> values = {q.w(), q.x(), q.y(), q.z()};
        for (std::size_t k = 0; k < 4; ++k) series_[k].push_back(rounded(values[k] * kUnit));
        for (std::size_t c = 0; c < 3; ++c) {
            const double place =
                static_cast<double>(best.row(9 + static_cast<int>(c))[f]) - static_cast<double>(center_[c]);
            series_[4 + c].push_back(step() > 0.0 ? rounded(place / step()) : 0);
        }
    }
}

std::vector<std::uint8_t> CodedMotion::write() const {
    RangeEncoder encoder;
    SeriesContexts contexts;
    for (const auto& series : series_) encode_series(encoder, contexts, series);
    return encoder.finish();
}

Expected<void> CodedMotion::read(std::span<const std::uint8_t> payload, std::int64_t frame_count) {
    if (static_cast<std::uint64_t>(frame_count) > max_symbol_count(payload.size()))
        return fail(ErrorCode::kCorrupt, "more frames than the bytes can hold");
    auto decoder = RangeDecoder::open(payload);
    if (!decoder) return tl::unexpected(decoder.error());
    SeriesContexts contexts;
    for (auto& series : series_) {
        series.resize(static_cast<std::size_t>(frame_count));
        if (!decode_series(*decoder, contexts, series))
            return fail(ErrorCode::kCorrupt, "the motion does not decode");
    }
    return decoder->finish();
}

LocalFrameTrack CodedMotion::track() const {
    LocalFrameTrack track(static_cast<std::int64_t>(series_[0].size()));
    for (std::size_t f = 0; f < series_[0].size(); ++f) {
        LocalFrame frame;
        std::array<double, 4> q;
        for (std::size_t k = 0; k < 4; ++k) q[k] = static_cast<double>(series_[k][f]);
        frame.rotation = rotation_of_quaternion(q);
        for (std::size_t c = 0; c < 3; ++c)
            frame.origin[c] =
                static_cast<double>(center_[c]) + static_cast<double>(series_[4 + c][f]) * step();
        track.set(static_cast<std::int64_t>(f), frame);
    }
    return track;
}

}  // namespace batchenc
