#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "app/progress.h"
#include "io/source_clip.h"
#include "kernels/synthetic_clip.h"
#include "pipeline/guarded.h"
#include "pipeline/threads.h"

namespace batchenc {

namespace {

/// Frames that are made together: enough for every thread, in bounded memory however long the clip is.
constexpr std::int64_t kBlockBytes = 16 << 20;

Expected<void> write_frames(const SyntheticClip& clip, std::int64_t frame_count, ClipWriter& writer,
                            const Executor& executor, Progress& progress) {
    const std::int64_t vertex_count = clip.vertex_count();
    const auto frame_values = static_cast<std::size_t>(3 * vertex_count);
    const std::int64_t block_frames = std::max<std::int64_t>(1, kBlockBytes / (12 * vertex_count));
    std::vector<float> block;
    for (std::int64_t first = 0; first < frame_count; first += block_frames) {
        const std::int64_t count = std::min(block_frames, frame_count - first);
        block.resize(static_cast<std::size_t>(count) * frame_values);
        executor.for_each(count, [&](std::int64_t i) {
            clip.write_frame(first + i, std::span(block).subspan(static_cast<std::size_t>(i) * frame_values,
                                                                 frame_values));
        });
        if (auto done = writer.write_frames(first, {block.data(), count, vertex_count}); !done) return done;
        progress.update(static_cast<double>(first + count) / static_cast<double>(frame_count));
    }
    return {};
}

Expected<void> synthesize(const SynthOptions& options, const SyntheticClip& clip, const Executor& executor,
                          Progress& progress) {
    auto writer = ClipWriter::create(options.output, options.frames, clip.vertex_count(), clip.triangles(),
                                     clip.fps(), options.kind, options.overwrite);
    if (!writer) return tl::unexpected(writer.error());
    if (auto done = write_frames(clip, options.frames, **writer, executor, progress); !done) return done;
    return (*writer)->finish();
}

}  // namespace

int run_command(const SynthOptions& options, const CommonOptions& common, const std::atomic<bool>& stop) {
    const auto clip = make_synthetic_clip(options.kind, options.vertices, options.seed);
    if (!clip) {
        log_error(clip.error());
        return kExitUsage;  // kind and size come from the command line
    }
    Expected<void> done;
    run_with_threads(common.threads, [&] {
        Progress progress(common.progress, common.log_json);
        const TbbExecutor executor(stop);
        done = guarded(stop, [&] { return synthesize(options, **clip, executor, progress); });
    });
    if (!done) {
        log_error(done.error());
        return exit_code_of(done.error());
    }
    fmt::print("{}: {} frames of {} vertices and {} triangles\n", options.output.string(), options.frames,
               (*clip)->vertex_count(), (*clip)->triangles().size());
    return kExitDone;
}

}  // namespace batchenc
