#include "pipeline/blas_guard.h"

#include <cblas.h>
#include <strings.h>
#include <unistd.h>

#include <Eigen/Core>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace batchenc {

namespace {

constexpr const char* kCoreVariable = "OPENBLAS_CORETYPE";
constexpr const char* kRestartedVariable = "BATCHENC_BLAS_RESTARTED";

}  // namespace

CpuFeatures detect_cpu_features() {
    // These look at what the operating system saves as well as at what the CPU has.
    CpuFeatures cpu;
    cpu.avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    cpu.avx512 = cpu.avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                 __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
    return cpu;
}

Expected<void> check_blas_build(const std::string& config, int parallel) {
    constexpr int kOpenMp = 2;
    if (config.find("SINGLE_THREADED") != std::string::npos)
        return fail(
            ErrorCode::kUnsupported,
            "this OpenBLAS is the single-threaded build, which gives wrong numbers when several threads "
            "call it; install libopenblas0-pthread",
            config);
    if (parallel == kOpenMp)
        return fail(ErrorCode::kUnsupported,
                    "this OpenBLAS is the OpenMP build, which cannot be kept to one thread a call; install "
                    "libopenblas0-pthread",
                    config);
    return {};
}

std::optional<std::string> better_blas_core(const std::string& core, CpuFeatures cpu) {
    constexpr const char* kAvx2Cores[] = {"Haswell", "Zen", "SkylakeX", "Cooperlake", "SapphireRapids"};
    const bool is_good = std::any_of(std::begin(kAvx2Cores), std::end(kAvx2Cores),
                                     [&](const char* good) { return strcasecmp(good, core.c_str()) == 0; });
    if (is_good || !cpu.avx2) return std::nullopt;
    return cpu.avx512 ? "SkylakeX" : "Haswell";
}

Expected<void> restart_with_blas_core(const std::string& core, char* const* argv) {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    if (error) return fail(ErrorCode::kIo, error.message(), "/proc/self/exe");
    setenv(kCoreVariable, core.c_str(), 1);
    setenv("OPENBLAS_NUM_THREADS", "1", 1);  // its threads would spin for a while after loading
    setenv(kRestartedVariable, "1", 1);
    execv(self.c_str(), argv);
    return fail(ErrorCode::kIo, std::string("cannot be started again: ") + std::strerror(errno),
                self.string());
}

Expected<std::string> guard_blas(char* const* argv) {
    const std::string config = openblas_get_config();
    const std::string core = openblas_get_corename();
    if (auto build = check_blas_build(config, openblas_get_parallel()); !build)
        return tl::unexpected(build.error());

    const bool settled = std::getenv(kCoreVariable) != nullptr || std::getenv(kRestartedVariable) != nullptr;
    const auto better = better_blas_core(core, detect_cpu_features());
    if (better && !settled)
        if (auto restarted = restart_with_blas_core(*better, argv); !restarted)
            return tl::unexpected(restarted.error());

    openblas_set_num_threads(1);
    Eigen::setCpuCacheSizes(32 << 10, 512 << 10, 4 << 20);
    std::string line =
        config.substr(0, config.find(' ', config.find(' ') + 1)) + ", " + core + " kernels, 1 thread a call";
    if (better) line += "; " + *better + " kernels would be faster on this CPU";
    return line;
}

}  // namespace batchenc
