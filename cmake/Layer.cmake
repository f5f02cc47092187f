# batchenc_layer(NAME SOURCES... LAYERS... LIBRARIES...): one folder of src/ as one static library.
#
# LAYERS are the layers below that this one may use. Beside the library stands a shared library of the same
# objects that is linked against those layers alone with no undefined symbol allowed: the linker refuses a
# call that runs against the include law. tests/layers scans the includes themselves.
add_library(batchenc_flags INTERFACE)
target_compile_features(batchenc_flags INTERFACE cxx_std_20)
# -Wno-restrict: g++ 12 warns of impossible sizes in "text" + std::string (GCC bug 105651).
# -ffp-contract=off: what a closed loop computes must not depend on whether the compiler fused a product.
target_compile_options(batchenc_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
  -Wold-style-cast -Wcast-qual -Wconversion -Wno-sign-conversion
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict> -ffp-contract=off
  $<$<BOOL:${BATCHENC_WARNINGS_AS_ERRORS}>:-Werror>)

function(batchenc_layer name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LAYERS;LIBRARIES")
  add_library(batchenc_${name} STATIC ${arg_SOURCES})
  target_include_directories(batchenc_${name} PUBLIC ${PROJECT_SOURCE_DIR}/src)
  list(TRANSFORM arg_LAYERS PREPEND batchenc_)
  target_link_libraries(batchenc_${name} PUBLIC ${arg_LAYERS} ${arg_LIBRARIES} PRIVATE batchenc_flags)
  if(BATCHENC_BUILD_TESTS)
    add_library(batchenc_${name}_linkcheck SHARED ${PROJECT_SOURCE_DIR}/cmake/empty.cpp)
    target_link_libraries(batchenc_${name}_linkcheck PRIVATE
      -Wl,--whole-archive $<TARGET_FILE:batchenc_${name}> -Wl,--no-whole-archive ${arg_LAYERS} ${arg_LIBRARIES})
    target_link_options(batchenc_${name}_linkcheck PRIVATE -Wl,-z,defs)
    add_dependencies(batchenc_${name}_linkcheck batchenc_${name})
  endif()
endfunction()
