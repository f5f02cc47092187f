#pragma once

#include <sys/resource.h>

#include <csignal>

namespace batchenc::testing {

/// While it lives, no file of this process can grow beyond so many bytes: what a full disk looks like to a
/// writer, without a disk and without root (EFBIG in place of ENOSPC).
class SmallDisk {
 public:
    explicit SmallDisk(rlim_t room_bytes) {
        previous_handler_ = std::signal(SIGXFSZ, SIG_IGN);
        ::getrlimit(RLIMIT_FSIZE, &previous_);
        const rlimit limit{room_bytes, previous_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~SmallDisk() {
        ::setrlimit(RLIMIT_FSIZE, &previous_);
        std::signal(SIGXFSZ, previous_handler_);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;

 private:
    rlimit previous_{};
    void (*previous_handler_)(int) = nullptr;
};

}  // namespace batchenc::testing
