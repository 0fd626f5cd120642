# One interface target carries the warnings and the architecture of every target of the project. Left out: psabi (no 64-byte
# vector crosses a library's boundary) and restrict (GCC 12 sees overlaps in std::string that are not there, bug 105329).
add_library(touchstone_options INTERFACE)
target_compile_options(touchstone_options INTERFACE
  -march=${TOUCHSTONE_ARCH} -fno-math-errno
  -Wall -Wextra -Wpedantic -Werror -Wshadow -Wconversion -Wno-sign-conversion -Wno-psabi -Wno-restrict)
if(TOUCHSTONE_SANITIZE)
  set(sanitize -fsanitize=${TOUCHSTONE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
  target_compile_options(touchstone_options INTERFACE ${sanitize})
  target_link_options(touchstone_options INTERFACE ${sanitize})
endif()

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()
