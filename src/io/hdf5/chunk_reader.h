#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "io/hdf5/chunk_unpacker.h"
#include "io/hdf5/source_dataset.h"

namespace batchenc {

/// Reads frames of a chunked positions dataset by fetching the packed chunks through HDF5 and unpacking them
/// here: about twice as fast as H5Dread, and the unpacking runs on all threads of an Executor.
///
/// Holds besides: packed chunks of up to 64 MiB, two chunks per thread while reading, and between two calls
/// the unpacked chunks that reach beyond the frames read last (at most 256 MiB), so that reading in order
/// unpacks every chunk once.
class ChunkReader {
 public:
    /// dataset: positions [F][V][3] with `packing`; must outlive this object.
    explicit ChunkReader(const hdf5::SourceDataset& dataset);

    /// Frames [begin, begin + out.frame_count()), which the dataset must have, into out, not checked for NaN.
    /// Errors: kIo, kCorrupt (a chunk that does not unpack to exactly its size), kOutOfMemory.
    Expected<void> read(std::int64_t begin, MutablePositionsView out, const Executor& executor);

 private:
    using Bytes = std::unique_ptr<std::uint8_t[]>;

    /// One chunk on its way from the file into the frames.
    struct Task {
        std::array<std::int64_t, 3> corner{};  ///< first frame, vertex, coordinate
        std::int64_t number = 0;               ///< in row-major order over all chunks
        std::int64_t packed_offset = 0;        ///< into the packed bytes of the batch
        std::int64_t packed_size = 0;
        std::uint32_t filter_mask = 0;
        Bytes unpacked;  ///< from the call before, or to be kept for the next
        bool keep = false;
        bool good = true;
    };

    /// An unpacked chunk between two calls.
    struct Kept {
        Bytes unpacked;
        std::uint32_t filter_mask = 0;
    };

    /// What a thread needs to unpack one chunk; handed on, because fresh memory costs more than the
    /// unpacking.
    struct Workspace {
        Inflater inflater;
        Bytes chunk;
        std::vector<std::uint8_t> row;
    };

    std::vector<Task> list_tasks(std::int64_t begin, std::int64_t end) const;
    Expected<void> fetch(Task& task);
    bool unpack(Task& task, Workspace& workspace) const;
    void place(const Task& task, const std::uint8_t* unpacked, std::int64_t begin, MutablePositionsView out,
               std::vector<std::uint8_t>& row) const;
    std::unique_ptr<Workspace> take_workspace();
    void give_back(std::unique_ptr<Workspace> workspace);
    Expected<void> read_checked(std::int64_t begin, MutablePositionsView out, const Executor& executor);

    const hdf5::SourceDataset& dataset_;
    std::array<std::int64_t, 3> extent_{};
    std::array<std::int64_t, 3> chunk_{};
    std::int64_t chunk_values_ = 0;
    std::int64_t chunk_bytes_ = 0;
    bool keeps_chunks_ = false;
    std::vector<std::uint8_t> packed_;   ///< the packed chunks of one batch
    std::map<std::int64_t, Kept> kept_;  ///< by number
    std::mutex mutex_;                   ///< guards workspaces_
    std::vector<std::unique_ptr<Workspace>> workspaces_;
};

}  // namespace batchenc
