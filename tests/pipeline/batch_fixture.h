#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/mesh_sequence.h"
#include "io/job_file.h"
#include "io/source_clip.h"
#include "pipeline/batch.h"
#include "tests/support/folder_test.h"

namespace batchenc {

/// A sheet of side × side vertices that waves: small, smooth, with a boundary.
inline MeshSequence waving_sheet(std::int64_t frame_count, std::int32_t side = 12) {
    MeshSequence clip;
    clip.frame_count = frame_count;
    clip.vertex_count = std::int64_t{side} * side;
    clip.fps = 25.0;
    clip.name = "sheet";
    for (std::int64_t f = 0; f < frame_count; ++f)
        for (std::int32_t y = 0; y < side; ++y)
            for (std::int32_t x = 0; x < side; ++x) {
                const float time = static_cast<float>(f) * 0.2F;
                const float height = std::sin(0.6F * static_cast<float>(x) + time) * 0.5F +
                                     std::cos(0.4F * static_cast<float>(y) - 0.7F * time) * 0.3F;
                clip.positions.insert(clip.positions.end(),
                                      {static_cast<float>(x), static_cast<float>(y) + 0.1F * time, height});
            }
    for (std::int32_t y = 0; y + 1 < side; ++y)
        for (std::int32_t x = 0; x + 1 < side; ++x) {
            const std::int32_t a = y * side + x;
            clip.triangles.push_back({a, a + 1, a + side});
            clip.triangles.push_back({a + 1, a + side + 1, a + side});
        }
    return clip;
}

/// The sheet, trembling in another way after every `act` frames.
inline MeshSequence changing_sheet(std::int64_t frame_count, std::int64_t act) {
    MeshSequence clip = waving_sheet(frame_count);
    for (std::int64_t f = 0; f < frame_count; ++f)
        for (std::int64_t v = 0; v < clip.vertex_count; ++v)
            for (std::int64_t wave = 0; wave < 8; ++wave) {
                const std::int64_t pattern = (v * v + 31 * v) * (wave + 3 + 8 * (f / act)) % 101;
                clip.positions[static_cast<std::size_t>((f * clip.vertex_count + v) * 3 + 2)] +=
                    0.006F * static_cast<float>(pattern - 50) *
                    std::sin((0.3F + 0.11F * static_cast<float>(wave)) * static_cast<float>(f));
            }
    return clip;
}

/// Hears a batch and keeps what it heard.
class RecordingListener final : public BatchListener {
 public:
    void note(const std::string&, const std::string&) override {}
    void job_ended(const JobReport& report) override { ended.push_back(report.name); }
    void progress(double fraction) override {
        EXPECT_GE(fraction, last_progress);
        EXPECT_LE(fraction, 1.0);
        last_progress = fraction;
        ++progress_calls;
        if (on_progress) on_progress();
    }

    std::vector<std::string> ended;
    double last_progress = 0.0;
    int progress_calls = 0;
    std::function<void()> on_progress;
};

class BatchTest : public test::FolderTest {
 protected:
    std::filesystem::path write_clip(const std::string& name, const MeshSequence& clip) const {
        const auto path = folder_ / name;
        auto writer = ClipWriter::create(path, clip.frame_count, clip.vertex_count, clip.triangles, clip.fps,
                                         clip.name, true);
        EXPECT_TRUE(writer) << writer.error().to_string();
        const auto written = (*writer)->write_frames(0, clip.view());
        EXPECT_TRUE(written) << written.error().to_string();
        const auto finished = (*writer)->finish();
        EXPECT_TRUE(finished) << finished.error().to_string();
        return path;
    }

    /// The job that encodes folder/input into folder/out/NAME.h5. more: further lines of YAML.
    Job make_job(const std::string& name, const std::string& input, const std::string& more = {}) const {
        const std::string yaml = "batchenc: 1\nname: " + name + "\ninput: {file: " + input +
                                 "}\noutput: out/" + name +
                                 ".h5\nsegmentation: {method: clustering, clusters: 3}\n"
                                 "codec: {method: rlpca, components: 4}\n" +
                                 more;
        auto jobs = parse_job(yaml, folder_ / (name + ".yaml"));
        EXPECT_TRUE(jobs) << jobs.error().to_string();
        return jobs->front();
    }

    std::filesystem::path output(const std::string& name) const { return folder_ / "out" / (name + ".h5"); }

    /// Names of the files in the output folder.
    std::vector<std::string> written_files() const {
        std::vector<std::string> names;
        if (!std::filesystem::exists(folder_ / "out")) return names;
        for (const auto& entry : std::filesystem::directory_iterator(folder_ / "out"))
            names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end());
        return names;
    }

    std::atomic<bool> stop_ = false;
    RecordingListener listener_;
};

}  // namespace batchenc
