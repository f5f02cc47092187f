#pragma once

#include <optional>
#include <string>

#include "core/error.h"

namespace batchenc {

// OpenBLAS inside a parallel program: which builds can be trusted, which kernels it should use.

/// What the CPU and its operating system offer.
struct CpuFeatures {
    bool avx2 = false;    ///< AVX2 and FMA
    bool avx512 = false;  ///< AVX-512 F, DQ, BW and VL
};
CpuFeatures detect_cpu_features();

/// Refuses builds that give wrong or unsteady numbers when several threads call them (kUnsupported): single-
/// threaded ones, which are not safe for concurrent calls at all, and OpenMP ones, which start threads of
/// their own whatever they are told. config: of openblas_get_config(); parallel: of openblas_get_parallel().
Expected<void> check_blas_build(const std::string& config, int parallel);

/// The kernels to ask for by OPENBLAS_CORETYPE when OpenBLAS chose some that leave the CPU's vector units
/// unused, as it does on CPUs younger than itself; nothing where its choice is good. core: of
/// openblas_get_corename().
std::optional<std::string> better_blas_core(const std::string& core, CpuFeatures cpu);

/// Starts this program again in place of itself, with the same arguments, OPENBLAS_CORETYPE=core, and a mark
/// in the environment by which guard_blas() knows not to do it twice. Returns only on failure (kIo).
Expected<void> restart_with_blas_core(const std::string& core, char* const* argv);

/// To be called first thing in main. Checks the build, restarts the program once where better kernels are to
/// be had (unless OPENBLAS_CORETYPE is set already), makes OpenBLAS use the calling thread alone, and pins
/// the block sizes of Eigen's products, which otherwise follow the CPU's caches and change the last bits.
/// Returns a line for the log: version, kernels, threads.
Expected<std::string> guard_blas(char* const* argv);

}  // namespace batchenc
