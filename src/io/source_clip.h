#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Bounds on what a file may make the program allocate or walk through.
struct SourceLimits {
    std::int64_t max_vertices = 1LL << 28;
    std::int64_t max_frames = 1LL << 24;
    std::int64_t max_triangles = 1LL << 29;
};

/// Where in a file the arrays of a clip stand.
struct SourceNames {
    std::string positions = "/positions";
    std::string triangles = "/triangles";
};

/// A clip in an HDF5 file, opened for reading frames in any order (layout: docs/RESULTS.md, "Source clips").
///
/// Opening checks everything that can be checked without reading the frames: refused are external storage,
/// external and soft links, virtual datasets, filters that are not in the library, wrong ranks and types, and
/// sizes beyond the limits. One object may be used by one thread at a time.
class SourceClip {
 public:
    /// Errors: kIo (cannot open), kFormat (not HDF5, wrong layout, no frames or vertices, chunks that were
    /// never written), kCorrupt (damaged HDF5), kUnsupported (filter, link, storage), kLimit; `where` is
    /// "file" or "file:/dataset". Triangles may be absent only under their default name.
    static Expected<std::unique_ptr<SourceClip>> open(const std::filesystem::path& path,
                                                      const SourceNames& names = {},
                                                      const SourceLimits& limits = {});
    virtual ~SourceClip() = default;

    virtual std::int64_t frame_count() const = 0;
    virtual std::int64_t vertex_count() const = 0;
    virtual std::int64_t triangle_count() const = 0;  ///< 0 for points
    virtual double fps() const = 0;                   ///< 0 where the file does not say
    virtual const std::string& name() const = 0;      ///< empty where the file does not say

    /// All triangles; none for points. Error: kIo, kOutOfRange (triangle, index and vertex count named).
    virtual Expected<std::vector<Triangle>> read_triangles() = 0;

    /// Frames [begin, begin + out.frame_count()) as float32 into out; float64 is rounded to nearest. The
    /// executor gets the unpacking of compressed chunks; HDF5 is called by the calling thread alone.
    /// Error: kIo, kCorrupt (a chunk that does not unpack), kInvalidArgument (out has another vertex count),
    /// kOutOfRange (frames the clip does not have), kNotFinite (frame and vertex named, also for a float64
    /// that float32 cannot hold).
    virtual Expected<void> read_frames(std::int64_t begin, MutablePositionsView out,
                                       const Executor& executor = SerialExecutor()) = 0;
};

/// Writes a source clip a run of frames at a time; the file appears under its name only when finish()
/// succeeds.
class ClipWriter {
 public:
    /// Errors: kExists (overwrite not given), kIo.
    static Expected<std::unique_ptr<ClipWriter>> create(const std::filesystem::path& path,
                                                        std::int64_t frame_count, std::int64_t vertex_count,
                                                        std::span<const Triangle> triangles, double fps,
                                                        const std::string& name, bool overwrite);
    /// Without a successful finish() before it, removes what was written.
    virtual ~ClipWriter() = default;

    /// Writes frames [begin, begin + frames.frame_count()).
    virtual Expected<void> write_frames(std::int64_t begin, PositionsView frames) = 0;
    /// Closes, syncs and renames into place. Error: kIo; nothing is left then.
    virtual Expected<void> finish() = 0;
};

/// Reads a whole clip into memory; the errors of SourceClip.
Expected<MeshSequence> read_mesh_sequence(const std::filesystem::path& path);

}  // namespace batchenc
