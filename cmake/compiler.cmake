# One interface target carries the warnings and the architecture of every target of the project. Left out: psabi (no 64-byte
# vector crosses a library's boundary) and restrict (GCC 12 sees overlaps in std::string that are not there, bug 105329).
add_library(touchstone_options INTERFACE)
target_compile_options(touchstone_options INTERFACE
  -march=${TOUCHSTONE_ARCH} -fno-math-errno
  -Wall -Wextra -Wpedantic -Werror -Wshadow -Wconversion -Wno-sign-conversion -Wno-psabi -Wno-restrict)
if(TOUCHSTONE_SANITIZE)   # under them GCC 12 sees uninitialised values in its own intrinsics
  set(sanitize -fsanitize=${TOUCHSTONE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1 -Wno-maybe-uninitialized)
  target_compile_options(touchstone_options INTERFACE ${sanitize})
  target_link_options(touchstone_options INTERFACE ${sanitize})
endif()

find_program(CCACHE ccache)
if(CCACHE)   # what it has to overlook so that it serves precompiled headers
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
endif()

# Half of a compilation was reading these headers. Every file still includes what it uses: the sanitizers' builds do without.
# Left out: what GCC 12 sees in std::string (bug 105329) once its header no longer looks like the system's.
function(touchstone_precompile target)
  if(NOT TOUCHSTONE_SANITIZE)
    target_compile_options(${target} PRIVATE -fpch-preprocess -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
    target_precompile_headers(${target} PRIVATE
      <algorithm> <filesystem> <functional> <map> <memory> <optional> <random> <string> <vector> ${ARGN})
  endif()
endfunction()
