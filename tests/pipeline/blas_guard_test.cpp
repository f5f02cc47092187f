#include "pipeline/blas_guard.h"

#include <cblas.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

namespace batchenc {
namespace {

TEST(BlasGuard, RefusesBuildsThatCannotBeTrusted) {
    const auto serial = check_blas_build("OpenBLAS 0.3.21 NO_LAPACKE DYNAMIC_ARCH Zen SINGLE_THREADED", 0);
    ASSERT_FALSE(serial);
    EXPECT_EQ(serial.error().code, ErrorCode::kUnsupported);
    const auto openmp = check_blas_build("OpenBLAS 0.3.21 USE_OPENMP DYNAMIC_ARCH Zen MAX_THREADS=64", 2);
    ASSERT_FALSE(openmp);
    EXPECT_EQ(openmp.error().code, ErrorCode::kUnsupported);
    EXPECT_TRUE(check_blas_build("OpenBLAS 0.3.21 NO_LAPACKE DYNAMIC_ARCH Zen MAX_THREADS=64", 1));
}

TEST(BlasGuard, AcceptsTheBuildThatIsLinked) {
    EXPECT_TRUE(check_blas_build(openblas_get_config(), openblas_get_parallel()));
}

TEST(BlasGuard, FindsBetterKernelsOnlyWhereThereAreSome) {
    const CpuFeatures old, avx2{true, false}, avx512{true, true};
    EXPECT_EQ(better_blas_core("Prescott", avx2), "Haswell");
    EXPECT_EQ(better_blas_core("Prescott", avx512), "SkylakeX");
    EXPECT_EQ(better_blas_core("Sandybridge", avx2), "Haswell");
    EXPECT_EQ(better_blas_core("Prescott", old), std::nullopt);
    for (const char* good : {"Haswell", "Zen", "ZEN", "SkylakeX", "Cooperlake"})
        EXPECT_EQ(better_blas_core(good, avx512), std::nullopt) << good;
}

/// Exit code of a child process that runs `body`; body ends it.
template <typename Body>
int exit_code_of_child(Body body) {
    const pid_t child = fork();
    if (child == 0) {
        body();
        _exit(99);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// Not a test of its own: the program that the next test starts in place of its child.
TEST(BlasGuard, DISABLED_RunsWithTheCoreThatWasAskedFor) {
    EXPECT_STREQ(openblas_get_corename(), "Nehalem");
    EXPECT_STREQ(std::getenv("OPENBLAS_CORETYPE"), "Nehalem");
    char program[] = "never-started-again";
    char* argv[] = {program, nullptr};
    const auto line =
        guard_blas(argv);  // Nehalem has no AVX2: without the mark this would start again for ever
    ASSERT_TRUE(line);
    EXPECT_NE(line->find("Nehalem"), std::string::npos) << *line;
    EXPECT_EQ(openblas_get_num_threads(), 1);
}

TEST(BlasGuard, StartsTheProgramAgainOnceWithOtherKernels) {
    const int code = exit_code_of_child([] {
        char program[] = "pipeline_test";
        char filter[] = "--gtest_filter=BlasGuard.DISABLED_RunsWithTheCoreThatWasAskedFor";
        char also[] = "--gtest_also_run_disabled_tests";
        char* argv[] = {program, filter, also, nullptr};
        unsetenv("OPENBLAS_CORETYPE");
        (void)restart_with_blas_core("Nehalem", argv);
    });
    EXPECT_EQ(code, 0);
}

TEST(BlasGuard, LeavesOneThreadACall) {
    setenv("OPENBLAS_CORETYPE", openblas_get_corename(), 0);  // whatever runs here, do not start again
    char program[] = "pipeline_test";
    char* argv[] = {program, nullptr};
    ASSERT_TRUE(guard_blas(argv));
    EXPECT_EQ(openblas_get_num_threads(), 1);
}

}  // namespace
}  // namespace batchenc
