#include "io/hdf5/durable_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace batchenc {

namespace {

/// Tells apart the writers of one process; with the process id the name is unique on one machine, and
/// O_EXCL settles the rest (a leftover of an older process, another machine on a shared file system).
std::atomic<unsigned> next_number{0};

std::filesystem::path folder_of(const std::filesystem::path& path) {
    const auto folder = path.parent_path();
    return folder.empty() ? std::filesystem::path(".") : folder;
}

}  // namespace

DurableFile::DurableFile(std::filesystem::path path, std::filesystem::path temporary_path, int descriptor,
                         bool overwrite)
    : path_(std::move(path)),
      temporary_path_(std::move(temporary_path)),
      descriptor_(descriptor),
      overwrite_(overwrite) {}

DurableFile::DurableFile(DurableFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_path_(std::exchange(other.temporary_path_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)),
      overwrite_(other.overwrite_) {}

DurableFile::~DurableFile() { discard(); }

void DurableFile::discard() {
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
    if (!temporary_path_.empty()) ::unlink(std::exchange(temporary_path_, {}).c_str());
}

tl::unexpected<Error> DurableFile::system_failure(const char* doing, int error_number) const {
    return fail(ErrorCode::kIo, std::string(doing) + ": " + std::strerror(error_number), path_.string());
}

Expected<DurableFile> DurableFile::create(const std::filesystem::path& path, bool overwrite) {
    if (!path.has_filename()) return fail(ErrorCode::kIo, "not a file name", path.string());
    struct stat status {};
    if (::lstat(path.c_str(), &status) == 0) {
        if (S_ISDIR(status.st_mode)) return fail(ErrorCode::kIo, "is a folder", path.string());
        if (!overwrite) return fail(ErrorCode::kExists, "exists already", path.string());
    }
    constexpr int kAttempts = 1000;
    int error_number = EEXIST;
    for (int attempt = 0; attempt < kAttempts && error_number == EEXIST; ++attempt) {
        auto temporary = path;
        temporary += "." + std::to_string(::getpid()) + "." + std::to_string(next_number++) + ".tmp";
        const int descriptor = ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0) return DurableFile(path, std::move(temporary), descriptor, overwrite);
        error_number = errno;
    }
    return fail(ErrorCode::kIo, std::string("cannot create: ") + std::strerror(error_number), path.string());
}

Expected<void> DurableFile::rename_into_place() {
    const char* from = temporary_path_.c_str();
    const char* to = path_.c_str();
    if (overwrite_) {
        if (::rename(from, to) != 0) return system_failure("cannot rename into place", errno);
        return {};
    }
    if (::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return {};
    int error_number = errno;
    if (error_number == EINVAL || error_number == ENOSYS) {
        // Not every file system knows RENAME_NOREPLACE (NFS does not); a hard link refuses to replace, too.
        if (::link(from, to) == 0) {
            ::unlink(from);
            return {};
        }
        error_number = errno;
        // No hard links either (FAT, some network shares): all that is left is to look first.
        if (error_number == EPERM || error_number == EOPNOTSUPP || error_number == ENOSYS) {
            struct stat status {};
            if (::lstat(to, &status) == 0) {
                error_number = EEXIST;
            } else {
                if (::rename(from, to) == 0) return {};
                error_number = errno;
            }
        }
    }
    if (error_number == EEXIST)
        return fail(ErrorCode::kExists, "appeared while it was being written", path_.string());
    return system_failure("cannot rename into place", error_number);
}

void DurableFile::begin_writing_out() const {
    // Only a hint: what goes wrong with the disk is reported by fsync.
    [[maybe_unused]] const int ignored = ::sync_file_range(descriptor_, 0, 0, SYNC_FILE_RANGE_WRITE);
}

Expected<void> DurableFile::commit() {
    if (::fsync(descriptor_) != 0) return system_failure("cannot sync", errno);
    if (::close(std::exchange(descriptor_, -1)) != 0) return system_failure("cannot close", errno);
    if (auto renamed = rename_into_place(); !renamed) return renamed;
    temporary_path_.clear();

    const int folder = ::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return system_failure("in place, but cannot open its folder to sync it", errno);
    const int synced = ::fsync(folder);
    const int error_number = errno;
    ::close(folder);
    // EINVAL: a file system on which folders cannot be synced, and where nothing more can be done.
    if (synced != 0 && error_number != EINVAL)
        return system_failure("in place, but cannot sync its folder", error_number);
    return {};
}

}  // namespace batchenc
