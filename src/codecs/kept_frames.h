#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "codecs/clip_codec.h"

namespace batchenc {

/// A clip of a coder whose frames depend on each other: all of them are decoded at once and kept.
class KeptFrames final : public DecodedClip {
 public:
    /// labels: V values, or none without clusters. The frames are undefined until they are written.
    explicit KeptFrames(const ClipInfo& info, std::vector<std::int32_t> labels = {})
        : info_(info),
          positions_(std::make_unique_for_overwrite<float[]>(
              static_cast<std::size_t>(3 * info.vertex_count * info.frame_count))),
          labels_(std::move(labels)) {}

    const ClipInfo& info() const override { return info_; }
    const std::vector<std::int32_t>& labels() const override { return labels_; }
    MutablePositionsView frames() { return {positions_.get(), info_.frame_count, info_.vertex_count}; }

    Expected<void> reconstruct(std::int64_t begin, MutablePositionsView out,
                               const Executor& executor) const override {
        if (auto good = check_frames(info_, begin, out); !good) return good;
        const std::int64_t values = 3 * info_.vertex_count;
        executor.for_each(out.frame_count(), [&](std::int64_t f) {
            std::copy_n(positions_.get() + (begin + f) * values, values, out.at(f, 0));
        });
        return {};
    }

 private:
    ClipInfo info_;
    std::unique_ptr<float[]> positions_;  // F x V x 3
    std::vector<std::int32_t> labels_;
};

}  // namespace batchenc
