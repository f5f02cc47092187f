#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "io/hdf5/hdf5_handle.h"

namespace batchenc::hdf5 {

/// The largest chunk HDF5 can store; also the bound on what one chunk may make the program allocate.
constexpr std::int64_t kMaxChunkBytes = (1LL << 32) - 1;

/// How the chunks of a dataset are packed, where this program can unpack them itself: deflate, alone or after
/// shuffle, of little-endian values, on a little-endian machine.
struct ChunkPacking {
    int shuffle_index = -1;  ///< place in the filter pipeline (a bit of a chunk's filter mask), -1: none
    int deflate_index = -1;
};

/// A dataset of a file that someone else wrote, after every check that needs no data.
struct SourceDataset {
    Handle handle;
    std::string name;                 ///< absolute path in the file
    std::string where;                ///< "file:/dataset", for errors
    std::vector<std::int64_t> shape;  ///< as wanted: the rank is checked
    std::size_t value_bytes = 0;      ///< 4 or 8
    std::int64_t size_bytes = 0;      ///< of all values, checked against overflow
    std::vector<std::int64_t> chunk;  ///< chunk shape; empty for other layouts
    std::optional<ChunkPacking> packing;
};

enum class ValueKind { kFloat, kInteger };

/// Opens the dataset `name` of `input`, walking from the root over hard links only; nothing is returned where
/// no such object exists.
///
/// Refused: soft, external and user-defined links anywhere on the path, external and virtual storage, filters
/// that the library does not have, chunks that were never written (kUnsupported or kFormat); another rank
/// than `rank`, other types than 4- or 8-byte floats or signed integers of either byte order (kFormat); sizes
/// that overflow (kLimit), and more values than the bytes in the file can hold (kCorrupt).
Expected<std::optional<SourceDataset>> open_source_dataset(const InputFile& input,
                                                           const std::string& file_name,
                                                           const std::string& name, ValueKind kind,
                                                           std::size_t rank);

/// Opens the same dataset again with a chunk cache that holds one row of chunks (all chunks of a run of
/// frames), so that HDF5 unpacks no chunk twice when frames are read in order. Only for chunked datasets that
/// HDF5 itself reads. Error: kIo.
Expected<void> reopen_with_chunk_cache(SourceDataset& dataset);

}  // namespace batchenc::hdf5
