# Debian packages, one for each install component; tools/package builds them. See docs/packages.md.
set(maintainer "Touchstone developers <touchstone@example.org>")
set(packages touchstone libtouchstone-dev)   # of the components program, dev and, where they are built, python and step
set(components program dev)
if(TARGET touchstone_python)
  list(APPEND packages python3-touchstone)
  list(APPEND components python)
endif()
if(TARGET touchstone-step)
  list(APPEND packages touchstone-step)
  list(APPEND components step)
endif()

# What each package says about itself: changes of a package in Debian's own form, and terms of use.
set(about ${PROJECT_BINARY_DIR}/about)
execute_process(COMMAND git log -1 --format=%ct WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE seconds ERROR_QUIET)
if(NOT seconds MATCHES "^[0-9]+")   # not a clone: the date of the sources
  file(TIMESTAMP ${PROJECT_SOURCE_DIR}/CHANGELOG.md seconds %s UTC)
endif()
string(STRIP "${seconds}" seconds)
execute_process(COMMAND date -u -R -d @${seconds} OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
file(WRITE ${about}/changelog "touchstone (${PROJECT_VERSION}) unstable; urgency=medium\n\n"
  "  * Version ${PROJECT_VERSION}; CHANGELOG.md of the source lists its changes.\n\n -- ${maintainer}  ${date}\n")
execute_process(COMMAND gzip -9nf ${about}/changelog COMMAND_ERROR_IS_FATAL ANY)
file(READ ${PROJECT_SOURCE_DIR}/LICENSE license)
string(REGEX REPLACE "^[^\n]*\n\n[^\n]*\n\n" "" license "${license}")   # its title and the owner, who is named above it
string(REPLACE "\n\n" "\n.\n" license "${license}")
string(STRIP "${license}" license)
string(REPLACE "\n" "\n " license "${license}")
configure_file(${PROJECT_SOURCE_DIR}/cmake/copyright.in ${about}/copyright @ONLY)
foreach(package component IN ZIP_LISTS packages components)
  install(FILES ${about}/copyright ${about}/changelog.gz DESTINATION share/doc/${package} COMPONENT ${component})
endforeach()

# The manual page comes from the program's own help.
set(manual ${PROJECT_BINARY_DIR}/touchstone.1.gz)
add_custom_command(OUTPUT ${manual}
  COMMAND ${PROJECT_SOURCE_DIR}/tools/man_page $<TARGET_FILE:touchstone> ${manual}
  DEPENDS touchstone ${PROJECT_SOURCE_DIR}/tools/man_page COMMENT "Writing the manual page" VERBATIM)
add_custom_target(manual ALL DEPENDS ${manual})
install(FILES ${manual} DESTINATION share/man/man1 COMPONENT program)
file(GLOB pages ${PROJECT_SOURCE_DIR}/docs/*.md)
install(FILES ${pages} DESTINATION share/doc/touchstone COMPONENT program)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_OUTPUT_FILE_PREFIX ${PROJECT_BINARY_DIR})
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL ${components})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER ${maintainer})
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")   # else it is the first line of every description
set(method "Touchstone finds a thousand times a second where two meshes would meet,
solves a quadratic program for the nearest pose that touches without overlap,
and returns force and torque.")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME touchstone)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
# OpenGL is loaded at run time, so no library that the program is linked to names these.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "libegl1, libgl1, python3")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "fonts-dejavu-core, libgl1-mesa-dri")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "python3-matplotlib, python3-numpy, spacenavd, touchstone-step")
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "sandbox for haptic rendering of rigid contact
${method}

This package holds the program, which runs scenes in a window or without one
and measures how fast and how exact the rendering is, and its scenes.
It needs a processor with AVX2 and FMA (x86-64-v3).")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libtouchstone-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)   # it holds no program
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libc6-dev, libeigen3-dev (>= 3.4), libstdc++-12-dev | libstdc++-dev")
set(CPACK_DEBIAN_DEV_DESCRIPTION "haptic rendering of rigid contact, as a C++ library
${method}

This package holds the static library, its header, and files for CMake and
pkg-config. It is compiled for processors with AVX2 and FMA (x86-64-v3).")

set(CPACK_DEBIAN_STEP_PACKAGE_NAME touchstone-step)
set(CPACK_DEBIAN_STEP_PACKAGE_SECTION science)
set(CPACK_DEBIAN_STEP_PACKAGE_DEPENDS "touchstone (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_STEP_DESCRIPTION "STEP files for touchstone
${method}

This package holds the program by which touchstone reads parts and assemblies
from STEP files (AP203, AP214, AP242), with Open Cascade.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-touchstone)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.11), python3 (<< 3.12), python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS touchstone)   # its scenes
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "haptic rendering of rigid contact, as a Python module
${method}

This package holds the Python package: scenes, worlds and batches of them,
recordings, solvers, and a task for learning, with NumPy.
It needs a processor with AVX2 and FMA (x86-64-v3).")
# Python's caches come and go with the package.
file(WRITE ${about}/postinst "#!/bin/sh\nset -e\nif command -v py3compile >/dev/null; then py3compile -p python3-touchstone; fi\n")
file(WRITE ${about}/prerm "#!/bin/sh\nset -e\nif command -v py3clean >/dev/null; then py3clean -p python3-touchstone; fi\n")
file(CHMOD ${about}/postinst ${about}/prerm PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${about}/postinst ${about}/prerm)
include(CPack)
