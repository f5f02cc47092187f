#include "io/hdf5/chunk_reader.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <new>
#include <utility>

namespace batchenc {

namespace {

constexpr std::int64_t kMaxBatchBytes = 64LL << 20;  ///< packed, of chunks fetched before they are unpacked
constexpr std::int64_t kMaxKeptBytes = 256LL << 20;

std::int64_t divide_up(std::int64_t a, std::int64_t b) { return a / b + (a % b != 0); }

}  // namespace

ChunkReader::ChunkReader(const hdf5::SourceDataset& dataset) : dataset_(dataset) {
    std::copy_n(dataset.shape.begin(), 3, extent_.begin());
    std::copy_n(dataset.chunk.begin(), 3, chunk_.begin());
    chunk_values_ = chunk_[0] * chunk_[1] * chunk_[2];
    chunk_bytes_ = chunk_values_ * static_cast<std::int64_t>(dataset.value_bytes);
    const std::int64_t row_chunks = divide_up(extent_[1], chunk_[1]) * divide_up(extent_[2], chunk_[2]);
    keeps_chunks_ = row_chunks <= kMaxKeptBytes / chunk_bytes_;
}

Expected<void> ChunkReader::read(std::int64_t begin, MutablePositionsView out, const Executor& executor) {
    try {
        return read_checked(begin, out, executor);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory to unpack chunks", dataset_.where);
    } catch (const std::exception& exception) {
        return fail(ErrorCode::kInternal, exception.what(), dataset_.where);
    }
}

Expected<void> ChunkReader::read_checked(std::int64_t begin, MutablePositionsView out,
                                         const Executor& executor) {
    const std::int64_t end = begin + out.frame_count();
    std::vector<Task> tasks = list_tasks(begin, end);
    for (Task& task : tasks) {
        const auto kept = kept_.find(task.number);
        if (kept == kept_.end()) continue;
        task.unpacked = std::move(kept->second.unpacked);
        task.filter_mask = kept->second.filter_mask;
    }
    kept_.clear();

    for (std::size_t batch_begin = 0, batch_end = 0; batch_begin < tasks.size(); batch_begin = batch_end) {
        packed_.clear();
        for (; batch_end < tasks.size(); ++batch_end) {
            if (batch_end > batch_begin && static_cast<std::int64_t>(packed_.size()) >= kMaxBatchBytes) break;
            if (tasks[batch_end].unpacked) continue;
            if (auto fetched = fetch(tasks[batch_end]); !fetched) return fetched;
        }
        executor.for_each(static_cast<std::int64_t>(batch_end - batch_begin), [&](std::int64_t i) {
            Task& task = tasks[batch_begin + static_cast<std::size_t>(i)];
            auto workspace = take_workspace();
            task.good = task.unpacked || unpack(task, *workspace);
            if (task.good) {
                const std::uint8_t* unpacked = task.unpacked ? task.unpacked.get() : workspace->chunk.get();
                place(task, unpacked, begin, out, workspace->row);
            }
            if (!task.keep) task.unpacked.reset();
            give_back(std::move(workspace));
        });
        for (std::size_t i = batch_begin; i < batch_end; ++i) {
            Task& task = tasks[i];
            if (!task.good)
                return fail(ErrorCode::kCorrupt,
                            "the chunk at frame " + std::to_string(task.corner[0]) + ", vertex " +
                                std::to_string(task.corner[1]) + " does not unpack",
                            dataset_.where);
            if (task.keep) kept_[task.number] = {std::move(task.unpacked), task.filter_mask};
        }
    }
    return {};
}

std::vector<ChunkReader::Task> ChunkReader::list_tasks(std::int64_t begin, std::int64_t end) const {
    const std::int64_t across_v = divide_up(extent_[1], chunk_[1]);
    const std::int64_t across_k = divide_up(extent_[2], chunk_[2]);
    std::vector<Task> tasks;
    for (std::int64_t f = begin / chunk_[0]; f * chunk_[0] < end; ++f) {
        const std::int64_t frames_end = std::min((f + 1) * chunk_[0], extent_[0]);
        for (std::int64_t v = 0; v < across_v; ++v) {
            for (std::int64_t k = 0; k < across_k; ++k) {
                Task& task = tasks.emplace_back();
                task.corner = {f * chunk_[0], v * chunk_[1], k * chunk_[2]};
                task.number = (f * across_v + v) * across_k + k;
                task.keep = keeps_chunks_ && frames_end > end;
            }
        }
    }
    return tasks;
}

Expected<void> ChunkReader::fetch(Task& task) {
    const auto failure = [&](ErrorCode code, std::string message) {
        return fail(code, std::move(message), dataset_.where);
    };
    const hsize_t corner[3] = {static_cast<hsize_t>(task.corner[0]), static_cast<hsize_t>(task.corner[1]),
                               static_cast<hsize_t>(task.corner[2])};
    hsize_t size = 0;
    if (H5Dget_chunk_storage_size(dataset_.handle.get(), corner, &size) < 0)
        return failure(ErrorCode::kIo, hdf5::last_error("looking up a chunk"));
    // An encoder may store a chunk that does not shrink in slightly more bytes than it has. What is larger
    // than that, or missing, is no work of HDF5.
    const hsize_t most = static_cast<hsize_t>(chunk_bytes_ + chunk_bytes_ / 8 + 1024);
    if (size == 0 || size > most)
        return failure(ErrorCode::kCorrupt, "the chunk at frame " + std::to_string(task.corner[0]) + " has " +
                                                std::to_string(size) + " bytes");
    task.packed_offset = static_cast<std::int64_t>(packed_.size());
    task.packed_size = static_cast<std::int64_t>(size);
    packed_.resize(packed_.size() + size);
    if (H5Dread_chunk(dataset_.handle.get(), H5P_DEFAULT, corner, &task.filter_mask,
                      packed_.data() + task.packed_offset) < 0)
        return failure(ErrorCode::kIo, hdf5::last_error("reading a chunk"));
    return {};
}

bool ChunkReader::unpack(Task& task, Workspace& workspace) const {
    const auto chunk_size = static_cast<std::size_t>(chunk_bytes_);
    // A filter that gave up when writing (noise does not shrink) is marked as left out for that chunk.
    const bool deflated = ((task.filter_mask >> dataset_.packing->deflate_index) & 1U) == 0;
    const std::span<const std::uint8_t> packed(packed_.data() + task.packed_offset,
                                               static_cast<std::size_t>(task.packed_size));
    // No allocation on the word of a chunk that is too short to hold so much (RFC 1951: 1032 for 1).
    if (deflated ? chunk_size / 1032 > packed.size() : chunk_size != packed.size()) return false;

    Bytes& bytes = task.keep ? task.unpacked : workspace.chunk;
    if (!bytes) bytes = std::make_unique_for_overwrite<std::uint8_t[]>(chunk_size);
    const std::span<std::uint8_t> unpacked(bytes.get(), chunk_size);
    if (deflated) return workspace.inflater.inflate(packed, unpacked);
    std::memcpy(unpacked.data(), packed.data(), chunk_size);
    return true;
}

void ChunkReader::place(const Task& task, const std::uint8_t* unpacked, std::int64_t begin,
                        MutablePositionsView out, std::vector<std::uint8_t>& row) const {
    const auto value_bytes = static_cast<std::int64_t>(dataset_.value_bytes);
    const int shuffle_index = dataset_.packing->shuffle_index;
    const bool shuffled = shuffle_index >= 0 && ((task.filter_mask >> shuffle_index) & 1U) == 0;
    const auto copy_values = [&](std::int64_t first, std::int64_t count, std::uint8_t* values) {
        if (shuffled)
            unshuffle(unpacked, chunk_values_, dataset_.value_bytes, first, count, values);
        else
            std::memcpy(values, unpacked + first * value_bytes,
                        static_cast<std::size_t>(count * value_bytes));
    };
    const std::int64_t frames_begin = std::max(begin, task.corner[0]);
    const std::int64_t frames_end =
        std::min({begin + out.frame_count(), task.corner[0] + chunk_[0], extent_[0]});
    const std::int64_t chunk_frame_values = chunk_[1] * chunk_[2];
    const std::int64_t first = (frames_begin - task.corner[0]) * chunk_frame_values;

    if (value_bytes == 4 && chunk_[1] == extent_[1] && chunk_[2] == 3) {  // whole frames: already in place
        copy_values(first, (frames_end - frames_begin) * chunk_frame_values,
                    reinterpret_cast<std::uint8_t*>(out.at(frames_begin - begin, 0)));
        return;
    }
    const std::int64_t vertices = std::min(chunk_[1], extent_[1] - task.corner[1]);
    const std::int64_t coordinates = std::min(chunk_[2], extent_[2] - task.corner[2]);
    row.resize(static_cast<std::size_t>(vertices * chunk_[2] * value_bytes));
    for (std::int64_t f = frames_begin; f < frames_end; ++f) {
        copy_values((f - task.corner[0]) * chunk_frame_values, vertices * chunk_[2], row.data());
        float* to = out.at(f - begin, task.corner[1]) + task.corner[2];
        for (std::int64_t v = 0; v < vertices; ++v) {
            for (std::int64_t k = 0; k < coordinates; ++k) {
                const std::uint8_t* value = row.data() + (v * chunk_[2] + k) * value_bytes;
                if (value_bytes == 4) {
                    std::memcpy(to + v * 3 + k, value, sizeof(float));
                } else {
                    double wide = 0.0;
                    std::memcpy(&wide, value, sizeof(wide));
                    to[v * 3 + k] = static_cast<float>(wide);
                }
            }
        }
    }
}

std::unique_ptr<ChunkReader::Workspace> ChunkReader::take_workspace() {
    const std::lock_guard lock(mutex_);
    if (workspaces_.empty()) return std::make_unique<Workspace>();
    auto workspace = std::move(workspaces_.back());
    workspaces_.pop_back();
    return workspace;
}

void ChunkReader::give_back(std::unique_ptr<Workspace> workspace) {
    const std::lock_guard lock(mutex_);
    workspaces_.push_back(std::move(workspace));
}

}  // namespace batchenc
