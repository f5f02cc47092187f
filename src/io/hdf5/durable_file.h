#pragma once

#include <filesystem>
#include <string>

#include "core/error.h"

namespace batchenc {

/// A file that appears under its name whole or not at all: written beside it under a name of its own, synced,
/// renamed, and the folder synced. Whenever the process ends, the place holds the old content or the new.
class DurableFile {
 public:
    /// Creates the empty temporary file "NAME.PID.N.tmp" in the folder of `path` (exclusively, so that two
    /// processes never share one). Errors: kExists (something stands at `path` and overwrite is not given),
    /// kIo (among others: no such folder, `path` is a folder).
    static Expected<DurableFile> create(const std::filesystem::path& path, bool overwrite);

    DurableFile(DurableFile&& other) noexcept;
    DurableFile& operator=(DurableFile&&) = delete;
    /// Without a successful commit() before it, removes the temporary file.
    ~DurableFile();

    /// Where to write; the file may be truncated and rewritten but not replaced.
    const std::filesystem::path& temporary_path() const { return temporary_path_; }
    const std::filesystem::path& path() const { return path_; }

    /// Asks the system to write out what has been written so far, and does not wait: commit() has less to
    /// sync.
    void begin_writing_out() const;

    /// Removes the temporary file now; nothing can be committed any more.
    void discard();

    /// Syncs the content, gives the file its name, syncs the folder. Without overwrite a file that appeared
    /// in the meantime stays (kExists). Error: kIo. To be called once.
    Expected<void> commit();

 private:
    DurableFile(std::filesystem::path path, std::filesystem::path temporary_path, int descriptor,
                bool overwrite);
    Expected<void> rename_into_place();
    tl::unexpected<Error> system_failure(const char* doing, int error_number) const;

    std::filesystem::path path_;
    std::filesystem::path temporary_path_;  ///< empty once renamed
    int descriptor_ = -1;  ///< open from the start, so that fsync reports every failed write-back since
    bool overwrite_ = false;
};

}  // namespace batchenc
