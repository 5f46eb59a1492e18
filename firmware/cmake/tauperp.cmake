# How the firmware is compiled, for every target of this project and of others that add it.
#   TAUPERP_FIRMWARE, TAUPERP_SOURCES, TAUPERP_HEADERS, TAUPERP_INCLUDES
#   tauperp_settings(NAME DEFINITION...)  how to compile
#   tauperp_objects(NAME DEFINITION...)   NAME_settings, and NAME_objects, the objects of all portable rooms
get_filename_component(TAUPERP_FIRMWARE "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)
set(TAUPERP_INCLUDES core wire wire/generated guard schedule)
list(TRANSFORM TAUPERP_INCLUDES PREPEND "${TAUPERP_FIRMWARE}/")
set(TAUPERP_JOINTS 8 CACHE STRING "Joints of the longest arm, 1 to 8: it decides the size of the guard's state")

set(TAUPERP_SOURCES "")
set(TAUPERP_HEADERS "")
foreach(room core wire wire/generated guard schedule)
    file(GLOB sources CONFIGURE_DEPENDS "${TAUPERP_FIRMWARE}/${room}/*.c")
    file(GLOB headers CONFIGURE_DEPENDS "${TAUPERP_FIRMWARE}/${room}/*.h")
    list(APPEND TAUPERP_SOURCES ${sources})
    list(APPEND TAUPERP_HEADERS ${headers})
endforeach()

# Which sources a build is of: the firmware's build id. The file changes only with its content.
set(TAUPERP_BUILD_ID "${CMAKE_BINARY_DIR}/tauperp_build_id.h")
if(NOT TARGET tauperp_build_id)
    add_custom_target(tauperp_build_id
        COMMAND ${CMAKE_COMMAND} -DFIRMWARE=${TAUPERP_FIRMWARE} -DOUTPUT=${TAUPERP_BUILD_ID}
                -P ${TAUPERP_FIRMWARE}/cmake/build_id.cmake
        BYPRODUCTS ${TAUPERP_BUILD_ID} VERBATIM)
endif()

# No contraction: every target computes the same bits.
function(tauperp_settings name)
    add_library(${name} INTERFACE)
    target_compile_options(${name} INTERFACE $<$<COMPILE_LANGUAGE:C>:-std=c11> -ffp-contract=off -fno-math-errno)
    target_compile_definitions(${name} INTERFACE ${ARGN})
    target_include_directories(${name} INTERFACE ${TAUPERP_INCLUDES})
endfunction()

# The two files that state the build id: tauperp_identified(FILE...), once in a folder
function(tauperp_identified)
    set_source_files_properties(${ARGN} PROPERTIES
        COMPILE_OPTIONS "-include;${TAUPERP_BUILD_ID}" OBJECT_DEPENDS "${TAUPERP_BUILD_ID}")
endfunction()

function(tauperp_objects name)
    tauperp_settings(${name}_settings ROBOT_JOINTS=${TAUPERP_JOINTS}u ${ARGN})
    add_library(${name}_objects OBJECT ${TAUPERP_SOURCES})
    target_link_libraries(${name}_objects PRIVATE ${name}_settings)
    target_compile_options(${name}_objects PRIVATE -Wall -Wextra)
    set_target_properties(${name}_objects PROPERTIES POSITION_INDEPENDENT_CODE ON)
    add_dependencies(${name}_objects tauperp_build_id)
    tauperp_identified("${TAUPERP_FIRMWARE}/guard/guard_report.c")
endfunction()
