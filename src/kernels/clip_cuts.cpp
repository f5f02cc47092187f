#include "kernels/clip_cuts.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/bounding_box.h"
#include "kernels/rigid_motion.h"
#include "kernels/seeds.h"

namespace batchenc {
namespace {

constexpr std::int64_t kGrid = 16;                   // frames from a place to the next
constexpr std::int64_t kCandidates = 4096;           // vertices that samples are chosen from, at most
constexpr std::size_t kGroupMembers = 12;            // samples a group, at most
constexpr std::size_t kNearRuns = 64, kFarRuns = 8;  // beginnings farther back are tried in steps
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kUnknown = 1e100;  // bits of a clip whose distances float32 does not hold

}  // namespace

ClipCutter::ClipCutter(std::int64_t vertex_count, const ClipCutModel& model)
    : vertex_count_(vertex_count), model_(model), places_{{0.0, 0}} {
    model_.longest = std::max(model_.longest, 2 * kGrid);  // cuts are possible every kGrid frames
    model_.shortest = std::min(model_.shortest, 2 * kGrid);
    ring_ = static_cast<std::size_t>((model_.longest + kGrid - 1) / kGrid);
}

void ClipCutter::choose_samples(PositionsView first_frame) {
    // Candidates at even distances in the order of the file, as a frame of their own.
    const std::int64_t count = std::min(vertex_count_, kCandidates);
    std::vector<std::int32_t> candidates;
    std::vector<float> places;
    for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t v = i * vertex_count_ / count;
        candidates.push_back(static_cast<std::int32_t>(v));
        places.insert(places.end(), first_frame.at(0, v), first_frame.at(0, v) + 3);
    }
    const PositionsView frame(places.data(), 1, count);
    const auto seeds = farthest_point_seeds(frame, model_.groups);
    std::vector<std::vector<std::int32_t>> cells(seeds.size());
    for (std::int64_t i = 0; i < count; ++i) {
        std::size_t nearest = 0;
        double least = kInfinity;
        for (std::size_t s = 0; s < seeds.size(); ++s) {
            const double distance = squared_distance(frame.at(0, i), frame.at(0, seeds[s]));
            if (distance < least) {
                least = distance;
                nearest = s;
            }
        }
        cells[nearest].push_back(static_cast<std::int32_t>(i));
    }
    for (const auto& cell : cells) {
        Group& group = groups_.emplace_back();
        group.vertex_count = static_cast<double>(cell.size()) * static_cast<double>(vertex_count_) /
                             static_cast<double>(count);
        const std::size_t members = std::min(cell.size(), kGroupMembers);
        for (std::size_t m = 0; m < members; ++m) {
            const std::int32_t candidate = cell[m * cell.size() / members];
            group.members.push_back(static_cast<std::int32_t>(samples_.size()));
            samples_.push_back(candidates[static_cast<std::size_t>(candidate)]);
            const float* p = frame.at(0, candidate);
            rest_.insert(rest_.end(), p, p + 3);
        }
        const auto rows = static_cast<Eigen::Index>(3 * members);
        group.moments.assign(ring_, ColMajorMatrixXd::Zero(rows, rows));
    }
    error_ = model_.accuracy * bounding_box(frame).largest_side();
}

void ClipCutter::add(PositionsView frames, const Executor& executor) {
    for (std::int64_t f = 0; f < frames.frame_count(); ++f) {
        if (samples_.empty()) choose_samples(frames.frames(f, f + 1));
        for (const std::int32_t v : samples_) run_.insert(run_.end(), frames.at(f, v), frames.at(f, v) + 3);
        ++frame_count_;
        if (frame_count_ % kGrid != 0) continue;
        end_run(executor);
        choose_cut(executor, false);
    }
}

void ClipCutter::end_run(const Executor& executor) {
    const auto sample_count = static_cast<std::int64_t>(samples_.size());
    const PositionsView run(run_.data(), static_cast<std::int64_t>(run_.size()) / (3 * sample_count),
                            sample_count);
    executor.for_each(static_cast<std::int64_t>(groups_.size()),
                      [&](std::int64_t g) { measure_run(groups_[static_cast<std::size_t>(g)], run); });
    run_.clear();
    places_.push_back({kInfinity, 0});
}

void ClipCutter::measure_run(Group& group, PositionsView run) const {
    const auto n = static_cast<Eigen::Index>(group.members.size());
    ColMajorMatrixXd places(3 * n, run.frame_count());
    LocalFrameTrack motion(run.frame_count());
    if (model_.local) motion = rigid_motion(run, group.members, rest_);
    for (std::int64_t f = 0; f < run.frame_count(); ++f) {
        for (Eigen::Index i = 0; i < n; ++i) {
            const auto sample = static_cast<std::size_t>(group.members[static_cast<std::size_t>(i)]);
            const float* p = run.at(f, static_cast<std::int64_t>(sample));
            const Eigen::Vector3d world(p[0], p[1], p[2]);
            if (!model_.local) {
                const float* r = rest_.data() + 3 * sample;
                places.block<3, 1>(3 * i, f) = world - Eigen::Vector3d(r[0], r[1], r[2]);
                continue;
            }
            Eigen::Matrix3d rotation;
            for (int k = 0; k < 9; ++k) rotation(k / 3, k % 3) = static_cast<double>(motion.row(k)[f]);
            const Eigen::Vector3d origin(motion.row(9)[f], motion.row(10)[f], motion.row(11)[f]);
            places.block<3, 1>(3 * i, f) = rotation * (world - origin);
        }
    }
    // Of the run that ends at the newest place.
    group.moments[(places_.size() - 1) % ring_].noalias() = places * places.transpose();
}

/// Bits of the clips that end at the newest place and begin 1, 2, … runs before it, as far as the longest.
std::vector<double> ClipCutter::bits_of_clips(const Group& group, bool is_last) const {
    const std::size_t end = places_.size() - 1;
    const auto rows = static_cast<Eigen::Index>(3 * group.members.size());
    // A hundredth of float32's digits of the error keeps a group of one place defined.
    const double noise = static_cast<double>(rows) * error_ * error_ + 1e-30;
    std::vector<double> bits;
    ColMajorMatrixXd sum = ColMajorMatrixXd::Zero(rows, rows);
    Eigen::LLT<ColMajorMatrixXd> cholesky(rows);
    for (std::size_t runs = 1; runs <= std::min(ring_, end); ++runs) {
        sum += group.moments[(end - runs) % ring_];
        const auto frames = static_cast<double>(frame_count_ - static_cast<std::int64_t>(end - runs) * kGrid);
        if (frames > static_cast<double>(model_.longest)) break;
        const bool is_tried = runs <= kNearRuns || (end - runs) % kFarRuns == 0;
        if (!is_tried || (!is_last && frames < static_cast<double>(model_.shortest))) {
            bits.push_back(kInfinity);  // no such clip
            continue;
        }
        ColMajorMatrixXd spread = sum / (frames * noise);
        spread.diagonal().array() += 1.0;
        cholesky.compute(spread);
        const double per_value = cholesky.matrixLLT().diagonal().array().log2().sum();
        const double sum_of_values = per_value * (3.0 * group.vertex_count + frames);
        bits.push_back(std::isfinite(sum_of_values) ? sum_of_values : kUnknown);
    }
    return bits;
}

void ClipCutter::choose_cut(const Executor& executor, bool is_last) {
    std::vector<std::vector<double>> bits(groups_.size());
    executor.for_each(static_cast<std::int64_t>(groups_.size()), [&](std::int64_t g) {
        bits[static_cast<std::size_t>(g)] = bits_of_clips(groups_[static_cast<std::size_t>(g)], is_last);
    });
    const std::size_t end = places_.size() - 1;
    Place& here = places_.back();
    for (std::size_t runs = 1; runs <= bits.front().size(); ++runs) {
        const std::int64_t frames = frame_count_ - static_cast<std::int64_t>(end - runs) * kGrid;
        double sum = places_[end - runs].bits + model_.vertex_bits * static_cast<double>(vertex_count_);
        for (const auto& of_group : bits) sum += of_group[runs - 1];
        if (sum < here.bits) here = {sum, static_cast<std::int32_t>(frames)};
    }
}

std::vector<std::int64_t> ClipCutter::finish(const Executor& executor) {
    if (frame_count_ == 0) return {};
    // The end is a place wherever it lies, and what is left before it a clip of any length.
    if (!run_.empty())
        end_run(executor);
    else
        places_.back() = {kInfinity, 0};
    choose_cut(executor, true);
    std::vector<std::int64_t> clips;
    for (std::int64_t end = frame_count_; end > 0; end -= clips.back())
        clips.push_back(places_[static_cast<std::size_t>((end + kGrid - 1) / kGrid)].clip_frames);
    std::reverse(clips.begin(), clips.end());
    return clips;
}

}  // namespace batchenc
