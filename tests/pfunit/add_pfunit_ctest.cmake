# Build and register `.pf` tests without pFUnit: the same function, with the arguments of pFUnit
# 4.14 that this project uses.
#
#   add_pfunit_ctest(name
#     TEST_SOURCES a.pf b.pf        # relative to the current folder; a.pf holds module a
#     [OTHER_SOURCES x.f90 ...]
#     [LINK_LIBRARIES lib ...]
#     [WORKING_DIRECTORY dir]       # where the test runs; default: the current build folder
#     [LABELS label ...])
#
# It makes the executable `name` and the test `name`. `name -f TEXT` runs the tests whose
# `<module>_suite.<test>` holds TEXT.

find_package(Python3 REQUIRED COMPONENTS Interpreter)

set(FUNIT_STAND_IN_DIR "${CMAKE_CURRENT_LIST_DIR}" CACHE INTERNAL "")

if(NOT TARGET funit_stand_in)
  add_library(funit_stand_in STATIC EXCLUDE_FROM_ALL
    "${FUNIT_STAND_IN_DIR}/funit_names.f90"
    "${FUNIT_STAND_IN_DIR}/funit_values.f90"
    "${FUNIT_STAND_IN_DIR}/funit.f90")
  set_target_properties(funit_stand_in PROPERTIES
    Fortran_MODULE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/mod/funit_stand_in")
  target_include_directories(funit_stand_in PUBLIC
    "${CMAKE_CURRENT_BINARY_DIR}/mod/funit_stand_in")
endif()

function(add_pfunit_ctest name)
  cmake_parse_arguments(PARSE_ARGV 1 arg ""
    "WORKING_DIRECTORY" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES;LABELS")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "add_pfunit_ctest(${name}): unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_TEST_SOURCES)
    message(FATAL_ERROR "add_pfunit_ctest(${name}): no TEST_SOURCES")
  endif()

  set(generated)
  set(uses "")
  set(calls "")
  foreach(pf IN LISTS arg_TEST_SOURCES)
    # pFUnit would write the generated file next to a source given by an absolute path.
    if(IS_ABSOLUTE "${pf}" OR pf MATCHES "\\.\\.")
      message(FATAL_ERROR "add_pfunit_ctest(${name}): ${pf} must be relative, without '..'")
    endif()
    get_filename_component(module "${pf}" NAME_WE)
    get_filename_component(folder "${pf}" DIRECTORY)
    set(source "${CMAKE_CURRENT_SOURCE_DIR}/${pf}")
    set(target "${CMAKE_CURRENT_BINARY_DIR}/${folder}/${module}.F90")
    file(MAKE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/${folder}")
    add_custom_command(OUTPUT "${target}"
      COMMAND "${Python3_EXECUTABLE}" "${FUNIT_STAND_IN_DIR}/funit_preprocess.py"
        "${source}" "${target}"
      DEPENDS "${source}" "${FUNIT_STAND_IN_DIR}/funit_preprocess.py"
      COMMENT "Preprocessing ${pf}"
      VERBATIM)
    list(APPEND generated "${target}")
    string(APPEND uses "  use Wrap${module}, only: ${module}_suite\n")
    string(APPEND calls "  call ${module}_suite(suite)\n")
  endforeach()

  set(driver "${CMAKE_CURRENT_BINARY_DIR}/${name}_driver.F90")
  string(CONCAT text
    "program main\n  use funit, only: testsuite\n${uses}  implicit none\n"
    "  type(testsuite) :: suite\n\n  call suite%start()\n${calls}  call suite%finish()\n"
    "end program main\n")
  file(CONFIGURE OUTPUT "${driver}" CONTENT "${text}" @ONLY)

  add_executable(${name} ${generated} ${arg_OTHER_SOURCES} "${driver}")
  set(mod_dir "${CMAKE_CURRENT_BINARY_DIR}/mod/${name}")
  set_target_properties(${name} PROPERTIES Fortran_MODULE_DIRECTORY "${mod_dir}")
  target_include_directories(${name} PRIVATE "${mod_dir}" "${CMAKE_CURRENT_SOURCE_DIR}")
  # An assertion becomes one long line.
  set_source_files_properties(${generated} PROPERTIES
    COMPILE_OPTIONS "-ffree-line-length-none")
  # No PRIVATE here, as in pFUnit: CMake refuses both forms on one target.
  target_link_libraries(${name} ${arg_LINK_LIBRARIES} funit_stand_in)

  if(NOT arg_WORKING_DIRECTORY)
    set(arg_WORKING_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}")
  endif()
  add_test(NAME ${name} COMMAND ${name} --verbose WORKING_DIRECTORY "${arg_WORKING_DIRECTORY}")
  if(arg_LABELS)
    set_property(TEST ${name} PROPERTY LABELS ${arg_LABELS})
  endif()
endfunction()
