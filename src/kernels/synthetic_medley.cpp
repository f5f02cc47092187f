#include <algorithm>
#include <array>
#include <vector>

#include "kernels/synthetic_kinds.h"

// Three bodies side by side, one of which performs. An act has a seed of its own, from which the body's way
// of moving is drawn; a body goes over from its last act's end to the new act within two seconds, in straight
// lines.

namespace batchenc {
namespace {

constexpr double kFps = 30.0;
constexpr std::int64_t kActFrames = 600, kActJitter = 150;  // of each act, of its beginning
constexpr std::int64_t kPassage = 45;                       // frames from the pose of rest into the act
constexpr double kRest = 0.0;
constexpr std::array<float, 3> kPlaces = {0.0f, 2.5f, -2.5f};  // along y, metres

class Medley final : public SyntheticClip {
 public:
    Medley(std::int64_t vertex_count, std::uint64_t seed) : seed_(scramble(seed ^ 0x3ED1E7)) {
        // What one body has more or less than its third, the ones after it make up for.
        bodies_[0] = make_walker(vertex_count / 3, seed);
        bodies_[1] = make_flag((vertex_count - bodies_[0]->vertex_count()) / 2, seed);
        bodies_[2] = make_jelly(vertex_count - bodies_[0]->vertex_count() - bodies_[1]->vertex_count(), seed);
        for (const auto& body : bodies_) {
            const auto first = static_cast<std::int32_t>(vertex_count_);
            for (const Triangle& t : body->triangles())
                triangles_.push_back({t[0] + first, t[1] + first, t[2] + first});
            vertex_count_ += body->vertex_count();
        }
    }

    std::int64_t vertex_count() const override { return vertex_count_; }
    const std::vector<Triangle>& triangles() const override { return triangles_; }
    double fps() const override { return kFps; }

    void write_frame(std::int64_t frame, std::span<float> positions) const override {
        std::int64_t act = frame / kActFrames + 1;
        while (beginning(act) > frame) --act;
        std::size_t first = 0;
        for (std::int64_t b = 0; b < static_cast<std::int64_t>(bodies_.size()); ++b) {
            const auto body = static_cast<std::size_t>(b);
            const std::size_t count = 3 * static_cast<std::size_t>(bodies_[body]->vertex_count());
            const auto out = positions.subspan(first, count);
            write_body(body, act - (act - b + 3) % 3, frame, out);
            for (std::size_t i = 1; i < count; i += 3) out[i] += kPlaces[body];
            first += count;
        }
    }

 private:
    // First frame of an act. The first one begins at frame 0; those before it are what the bodies rest from.
    std::int64_t beginning(std::int64_t act) const {
        if (act == 0) return 0;
        Dice dice(seed_ ^ static_cast<std::uint64_t>(act));
        return act * kActFrames + static_cast<std::int64_t>(dice.between(-kActJitter, kActJitter));
    }

    // Body `body` at `frame`, whose last own act, over or not, was `act`.
    void write_body(std::size_t body, std::int64_t act, std::int64_t frame, std::span<float> out) const {
        write_act(body, act, frame, out);
        const std::int64_t since = frame - beginning(act);
        if (since >= kPassage) return;
        std::vector<float> before(out.size());
        write_act(body, act - 3, frame, before);
        const float x = static_cast<float>(since) / static_cast<float>(kPassage);
        const float part = x * x * (3.0f - 2.0f * x);
        for (std::size_t i = 0; i < out.size(); ++i) out[i] = before[i] + part * (out[i] - before[i]);
    }

    // As the act alone has it: at full speed to its end, and nearly resting after.
    void write_act(std::size_t body, std::int64_t act, std::int64_t frame, std::span<float> out) const {
        const auto since = static_cast<double>(frame - beginning(act));
        const auto length = static_cast<double>(beginning(act + 1) - beginning(act));
        const double time = std::min(since, length) + kRest * std::max(0.0, since - length);
        bodies_[body]->write_act(scramble(seed_ + static_cast<std::uint64_t>(act)), time / kFps, out);
    }

    std::uint64_t seed_;
    std::array<std::unique_ptr<Performer>, 3> bodies_;
    std::int64_t vertex_count_ = 0;
    std::vector<Triangle> triangles_;
};

}  // namespace

std::unique_ptr<SyntheticClip> make_medley(std::int64_t vertex_count, std::uint64_t seed) {
    return std::make_unique<Medley>(vertex_count, seed);
}

}  // namespace batchenc
