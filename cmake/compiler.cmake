# Only the source decides the last bits of a result, so that every build for x86-64-v3 or higher gives the same (tests/builds
# compares two). No compiler fuses a product and a sum: haptics/math/simd.hpp does, where it pays. GCC 12 does all the same where it
# vectorizes neighboring statements that add and subtract in turn, so it may not. Eigen computes number by number,
# since the width of its vectors depends on the processor, and the order of its sums on their width; its types have one layout.
# Mathematical functions are called: compilers round those of constants themselves, and join sin and cos in a call of their own.
set(TOUCHSTONE_FP_FLAGS -ffp-contract=off -fno-tree-slp-vectorize -DEIGEN_DONT_VECTORIZE -DEIGEN_MAX_STATIC_ALIGN_BYTES=16)
set(functions sin cos tan asin acos atan atan2 exp exp2 log log2 log10 pow hypot)
list(TRANSFORM functions PREPEND -fno-builtin-)

# touchstone_options carries the warnings and the architecture of every target of the project. Left out: psabi (no 64-byte
# vector crosses a library's boundary), and restrict, array-bounds and stringop (GCC 12 sees overlaps and overflows in
# std::string that are not there, bug 105329).
add_library(touchstone_options INTERFACE)
target_compile_options(touchstone_options INTERFACE
  -march=${TOUCHSTONE_ARCH} -fno-math-errno ${TOUCHSTONE_FP_FLAGS} ${functions}
  -Wall -Wextra -Wpedantic -Werror -Wshadow -Wconversion -Wno-sign-conversion -Wno-psabi -Wno-restrict
  -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
if(TOUCHSTONE_SANITIZE)   # under them GCC 12 sees uninitialized values in its own intrinsics
  set(sanitize -fsanitize=${TOUCHSTONE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1 -Wno-maybe-uninitialized)
  target_compile_options(touchstone_options INTERFACE ${sanitize})
  target_link_options(touchstone_options INTERFACE ${sanitize})
endif()

# What a thousand ticks a second run through. The rest is compiled with CMAKE_CXX_FLAGS alone, -O1 in the presets: optimizing it
# further costs a third of its compile time.
separate_arguments(numeric UNIX_COMMAND "${TOUCHSTONE_NUMERIC_FLAGS}")
add_library(touchstone_numeric INTERFACE)
target_compile_options(touchstone_numeric INTERFACE ${numeric})

# touchstone_unity(target [ROOM…]): most of a compilation is reading headers, so the sources of a room are compiled as one, or
# sixteen at a time where a target is one folder. With rooms named, the sources of others stay alone: those of the tick are
# optimized one by one. Every file still includes what it uses: the sanitizers' builds compile each by itself.
function(touchstone_unity target)
  if(NOT TOUCHSTONE_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 16)
  target_compile_options(${target} PRIVATE -Wno-subobject-linkage)   # GCC takes the second file of a unit for a header
  get_target_property(sources ${target} SOURCES)
  set(rooms ${ARGN})
  foreach(source ${sources})
    cmake_path(GET source PARENT_PATH folder)
    cmake_path(GET folder FILENAME room)
    if(NOT ARGN OR room IN_LIST ARGN OR TOUCHSTONE_UNITY STREQUAL ALL)
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${room}")
      list(APPEND rooms ${room})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES rooms)
  list(LENGTH rooms count)
  if(count GREATER 1)
    set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
  endif()
endfunction()

# touchstone_precompile(target HEADER…) or touchstone_precompile(target REUSE_FROM other). Every file still includes what it
# uses: the sanitizers' builds do without.
function(touchstone_precompile target)
  if(NOT TOUCHSTONE_SANITIZE)
    target_compile_options(${target} PRIVATE -fpch-preprocess)   # as ccache needs it
    if(ARGV1 STREQUAL REUSE_FROM)
      target_precompile_headers(${target} ${ARGN})
      target_compile_options(${target} PRIVATE -fPIC)   # as the other, even if the target is a program
    else()
      target_precompile_headers(${target} PRIVATE ${ARGN})
    endif()
  endif()
endfunction()

# A second clone or worktree takes from the cache what the first one compiled: paths count from the source folder.
find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE})
endif()
