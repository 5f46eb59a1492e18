# For this machine: the shared libraries and their declarations for cffi, the kernel of `tauperp campaign`, the SocketCAN
# process and its test drivers, and the unit tests. Each preset has its compiler and builds the requested targets.
set(TAUPERP_OUTPUT "${CMAKE_BINARY_DIR}/python" CACHE PATH "Folder of libraries and programs")
set(TAUPERP_UNIT_OUTPUT "${TAUPERP_OUTPUT}/unit" CACHE PATH "Folder of unit tests")
option(TAUPERP_STRICT "Every warning is an error" OFF)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_C_FLAGS)
    set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_C_FLAGS_RELEASE "-O2") # NDEBUG is not needed: the firmware has static asserts only

set(hosts "${TAUPERP_FIRMWARE}/hosts")
set(library_includes "${hosts}/library" "${TAUPERP_FIRMWARE}/robot_side")
file(GLOB robot_side_sources CONFIGURE_DEPENDS "${TAUPERP_FIRMWARE}/robot_side/*.c")
file(GLOB library_sources CONFIGURE_DEPENDS "${hosts}/library/*.c")
list(PREPEND library_sources ${robot_side_sources})
file(GLOB linux_sources CONFIGURE_DEPENDS "${hosts}/linux/*.c")
file(GLOB example_sources CONFIGURE_DEPENDS "${TAUPERP_FIRMWARE}/examples/*/*.c")
file(GLOB kernel_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/host/kernel/*.c")
# MuJoCo's headers come with the wheel in .venv; its symbols are resolved when the host loads the kernel, after MuJoCo.
file(GLOB mujoco LIST_DIRECTORIES true CONFIGURE_DEPENDS
    "${PROJECT_SOURCE_DIR}/.venv/lib/python3*/site-packages/mujoco/include")
set(folder_float "")
set(folder_fixed /fixed)
set(suffix_float "")
set(suffix_fixed -fixed)

# Declarations for cffi: no preprocessor lines, and standard headers expand to nothing.
set(empty "${CMAKE_BINARY_DIR}/empty")
foreach(header assert limits stdalign stdbool stddef stdint string)
    if(NOT EXISTS "${empty}/${header}.h")
        file(WRITE "${empty}/${header}.h" "")
    endif()
endforeach()
list(TRANSFORM TAUPERP_INCLUDES PREPEND "-I" OUTPUT_VARIABLE room_flags)
list(TRANSFORM library_includes PREPEND "-I" OUTPUT_VARIABLE library_flags)

# tauperp_program(NAME FOLDER FILE SOURCE...)
function(tauperp_program name folder file)
    add_executable(${name} ${ARGN})
    set_target_properties(${name} PROPERTIES OUTPUT_NAME ${file} RUNTIME_OUTPUT_DIRECTORY "${TAUPERP_OUTPUT}${folder}")
endfunction()

# The shared library of one numeric type, its declarations, and the kernel.
function(tauperp_library numeric)
    set(folder "${TAUPERP_OUTPUT}${folder_${numeric}}")
    tauperp_object_library(library-objects-${numeric} host-${numeric} ${TAUPERP_SOURCES} ${library_sources}
        ${pair_source})
    set_target_properties(library-objects-${numeric} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_include_directories(library-objects-${numeric} PRIVATE ${library_includes})

    add_library(tauperp-${numeric} SHARED $<TARGET_OBJECTS:library-objects-${numeric}> ${second_${numeric}})
    target_link_options(tauperp-${numeric} PRIVATE -Wl,-z,defs)
    set_target_properties(tauperp-${numeric} PROPERTIES
        OUTPUT_NAME tauperp NO_SONAME ON LINKER_LANGUAGE C LIBRARY_OUTPUT_DIRECTORY "${folder}")
    set(declarations "${folder}/tauperp.cdef.h")
    set(definition ${definition_${numeric}})
    list(TRANSFORM definition PREPEND "-D")
    add_custom_command(
        OUTPUT "${declarations}"
        COMMAND ${CMAKE_COMMAND} -E make_directory "${folder}"
        COMMAND ${CMAKE_C_COMPILER} -E -P -nostdinc -std=c11 ${definition} -DTAUPERP_CDEF "-I${empty}" ${room_flags}
                ${library_flags} -MMD -MP -MF "${CMAKE_BINARY_DIR}/${numeric}.d" -MT "${declarations}"
                -o "${declarations}.new" "${hosts}/library/tauperp.h"
        COMMAND ${CMAKE_COMMAND} -E rename "${declarations}.new" "${declarations}"
        DEPENDS "${hosts}/library/tauperp.h" DEPFILE "${CMAKE_BINARY_DIR}/${numeric}.d" VERBATIM)
    add_custom_target(declarations-${numeric} DEPENDS "${declarations}")
    add_custom_target(library${suffix_${numeric}})
    add_dependencies(library${suffix_${numeric}} tauperp-${numeric} declarations-${numeric})
    install(TARGETS tauperp-${numeric} LIBRARY DESTINATION tauperp/native${folder_${numeric}} COMPONENT python)
    install(FILES "${declarations}" DESTINATION tauperp/native${folder_${numeric}} COMPONENT python)

    if(NOT mujoco)
        return()
    endif()
    tauperp_object_library(kernel-objects-${numeric} host-${numeric} ${kernel_sources})
    set_target_properties(kernel-objects-${numeric} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_include_directories(kernel-objects-${numeric} PRIVATE ${library_includes} "${PROJECT_SOURCE_DIR}/host/kernel")
    target_include_directories(kernel-objects-${numeric} SYSTEM PRIVATE ${mujoco})
    add_library(kernel-${numeric} SHARED EXCLUDE_FROM_ALL
        $<TARGET_OBJECTS:kernel-objects-${numeric}> $<TARGET_OBJECTS:library-objects-${numeric}> ${second_${numeric}})
    target_link_options(kernel-${numeric} PRIVATE -Wl,-Bsymbolic)
    target_link_libraries(kernel-${numeric} PRIVATE m)
    set_target_properties(kernel-${numeric} PROPERTIES
        OUTPUT_NAME tauperp_kernel NO_SONAME ON LINKER_LANGUAGE C LIBRARY_OUTPUT_DIRECTORY "${folder}")

    # Every C file that a host compiler can build.
    tauperp_object_library(strict-${numeric} host-${numeric} ${TAUPERP_SOURCES} ${robot_sources} ${library_sources}
        ${linux_sources} ${kernel_sources} ${example_sources} ${pair_source})
    target_include_directories(strict-${numeric} PRIVATE ${library_includes} "${PROJECT_SOURCE_DIR}/host/kernel")
    target_include_directories(strict-${numeric} SYSTEM PRIVATE ${mujoco})
endfunction()

# Each tests/unit/test_*.c is one Unity program, linked with the whole firmware. A unit test includes the board code that it
# tests.
function(tauperp_unit_programs numeric)
    tauperp_object_library(unit-objects-${numeric} host-${numeric} ${robot_sources} ${library_sources} ${pair_source})
    target_include_directories(unit-objects-${numeric} PRIVATE ${library_includes})
    add_library(unity-${numeric} OBJECT EXCLUDE_FROM_ALL "${unity}/unity.c")
    target_compile_options(unity-${numeric} PRIVATE -std=c11 -w)
    add_dependencies(unity-${numeric} unity)
    add_custom_target(unit-programs-${numeric})
    foreach(test IN LISTS unit_tests)
        get_filename_component(name "${test}" NAME_WE)
        add_executable(${name}-${numeric} EXCLUDE_FROM_ALL ${test} $<TARGET_OBJECTS:rooms-${numeric}>
            $<TARGET_OBJECTS:unit-objects-${numeric}> $<TARGET_OBJECTS:unity-${numeric}> ${second_${numeric}})
        target_link_libraries(${name}-${numeric} PRIVATE settings-${numeric} m)
        target_include_directories(${name}-${numeric} PRIVATE ${library_includes} "${PROJECT_SOURCE_DIR}/tests/unit")
        target_include_directories(${name}-${numeric} SYSTEM PRIVATE "${unity}")
        target_compile_options(${name}-${numeric} PRIVATE -Wall -Wextra -Wshadow -Werror)
        set_target_properties(${name}-${numeric} PROPERTIES
            OUTPUT_NAME ${name} RUNTIME_OUTPUT_DIRECTORY "${TAUPERP_UNIT_OUTPUT}/${numeric}")
        add_dependencies(unit-programs-${numeric} ${name}-${numeric})
    endforeach()
    if(second_${numeric} AND TARGET test_board_pair-${numeric}) # its block, compiled as the second channel is
        tauperp_object_library(unit-second-block settings-second "${PROJECT_SOURCE_DIR}/tests/unit/second_block.c")
        target_include_directories(unit-second-block SYSTEM PRIVATE "${unity}")
        add_dependencies(unit-second-block unity)
        target_sources(test_board_pair-${numeric} PRIVATE $<TARGET_OBJECTS:unit-second-block>)
    endif()
endfunction()

function(tauperp_host_settings numeric)
    add_library(host-${numeric} INTERFACE)
    target_link_libraries(host-${numeric} INTERFACE settings-${numeric})
    target_compile_options(host-${numeric} INTERFACE "$<IF:$<BOOL:${TAUPERP_STRICT}>,${STRICT},-Wall;-Wextra>")
endfunction()

# Call graphs with the frame of each function, beside its object, for the bound on the stack of tauperp-guard.
function(tauperp_call_graphs name)
    if(CMAKE_C_COMPILER_ID STREQUAL "GNU" AND CMAKE_C_COMPILER_VERSION VERSION_GREATER_EQUAL 10)
        target_compile_options(${name} PRIVATE -fstack-usage -fcallgraph-info=su)
    endif()
endfunction()

# A build with two channels has the first one in float32.
tauperp_host_settings(second)
tauperp_object_library(second-objects host-second ${second_sources})
set_target_properties(second-objects PROPERTIES POSITION_INDEPENDENT_CODE ON)
tauperp_call_graphs(second-objects)
set(second_float $<TARGET_OBJECTS:second-objects>)
set(second_fixed "")

foreach(numeric IN LISTS NUMERICS)
    tauperp_settings(settings-${numeric} ${definition_${numeric}})
    tauperp_host_settings(${numeric})
    tauperp_library(${numeric})
    if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
        tauperp_object_library(rooms-${numeric} host-${numeric} ${TAUPERP_SOURCES})
        tauperp_object_library(linux-${numeric} host-${numeric} ${linux_sources} ${pair_source})
        tauperp_call_graphs(rooms-${numeric})
        tauperp_call_graphs(linux-${numeric})
        tauperp_program(guard${suffix_${numeric}} "${folder_${numeric}}" tauperp-guard
            $<TARGET_OBJECTS:rooms-${numeric}> $<TARGET_OBJECTS:linux-${numeric}> ${second_${numeric}})
        set_target_properties(guard${suffix_${numeric}} PROPERTIES LINKER_LANGUAGE C)
    endif()
    tauperp_unit_programs(${numeric})
endforeach()
if(TARGET strict-float) # only with MuJoCo's headers
    tauperp_object_library(strict-second host-second ${second_sources})
    add_dependencies(strict-float strict-second)
endif()

# The smallest example includes the public header, which has the same name as the header of the host library.
set_source_files_properties("${TAUPERP_FIRMWARE}/examples/minimal/minimal.c" PROPERTIES
    INCLUDE_DIRECTORIES "${TAUPERP_FIRMWARE}/api")

add_custom_target(python)
add_dependencies(python library library-fixed)
if(TARGET guard)
    add_dependencies(python guard)
    install(TARGETS guard RUNTIME DESTINATION tauperp/native COMPONENT python)
endif()
install(FILES dbc/tauperp.dbc DESTINATION tauperp/native COMPONENT python)

# Parts that only a checkout has, not a source distribution.
if(EXISTS "${PROJECT_SOURCE_DIR}/tests" AND TARGET guard)
    include(cmake/drivers.cmake)
    file(MAKE_DIRECTORY "${TAUPERP_OUTPUT}")
    file(CREATE_LINK "${CMAKE_BINARY_DIR}/compile_commands.json" "${TAUPERP_OUTPUT}/compile_commands.json" SYMBOLIC)
endif()
