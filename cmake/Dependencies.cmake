# Every library comes from Debian's packages (scripts/install_dependencies.sh lists them).
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(tl-expected REQUIRED)
find_package(hwy REQUIRED)
find_package(TBB 2021 REQUIRED)
find_package(spdlog REQUIRED)
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)
pkg_check_modules(LIBDEFLATE REQUIRED IMPORTED_TARGET libdeflate)

set(HDF5_PREFER_PARALLEL OFF)
find_package(HDF5 1.10 REQUIRED COMPONENTS C)

# The pthread build by name: the generic libopenblas.so may point at the serial build, which returns wrong
# numbers when several threads call it.
find_library(BATCHENC_OPENBLAS openblas REQUIRED
  PATHS /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/openblas-pthread NO_DEFAULT_PATH)
find_path(BATCHENC_OPENBLAS_INCLUDE cblas.h REQUIRED
  PATHS /usr/include/${CMAKE_LIBRARY_ARCHITECTURE}/openblas-pthread NO_DEFAULT_PATH)
find_library(BATCHENC_LAPACKE lapacke REQUIRED)
find_path(BATCHENC_LAPACKE_INCLUDE lapacke.h REQUIRED)
add_library(batchenc_blas INTERFACE)
target_include_directories(batchenc_blas SYSTEM INTERFACE ${BATCHENC_OPENBLAS_INCLUDE} ${BATCHENC_LAPACKE_INCLUDE})
target_link_libraries(batchenc_blas INTERFACE ${BATCHENC_LAPACKE} ${BATCHENC_OPENBLAS})

if(BATCHENC_BUILD_TESTS)
  find_package(GTest REQUIRED)
endif()
if(BATCHENC_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
