# Programs that drive the SocketCAN process in tests and measurements: tests/bus/peer.c on a bus, tests/bus/soak*.c without
# one. Also the example of a robot's controller.
set(bus "${PROJECT_SOURCE_DIR}/tests/bus")
file(GLOB soak_sources CONFIGURE_DEPENDS "${bus}/soak*.c")
set(wire_objects "$<FILTER:$<TARGET_OBJECTS:rooms-float>,INCLUDE,firmware/wire/>")

tauperp_program(bus-peer "" bus-peer "${bus}/peer.c" "${hosts}/linux/clock.c" "${hosts}/linux/histogram.c" ${wire_objects})
tauperp_program(bus-soak "" bus-soak ${soak_sources} $<TARGET_OBJECTS:rooms-float>)
tauperp_program(controller "" controller "${TAUPERP_FIRMWARE}/examples/controller/controller.c"
    "${TAUPERP_FIRMWARE}/robot_side/robot_side.c" ${wire_objects})
foreach(program bus-peer bus-soak controller)
    target_link_libraries(${program} PRIVATE host-float)
    target_include_directories(${program} PRIVATE "${hosts}/linux" "${TAUPERP_FIRMWARE}/robot_side")
    set_target_properties(${program} PROPERTIES EXCLUDE_FROM_ALL ON)
    add_dependencies(${program} tauperp_build_id)
endforeach()
add_dependencies(bus-peer rooms-float)

# Fault injection into the library's guard. parts.c has the offsets of each channel.
file(GLOB fault_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tools/faults/*.c")
tauperp_object_library(faults-second host-second "${PROJECT_SOURCE_DIR}/tools/faults/parts.c")
tauperp_program(faults "" faults ${fault_sources} $<TARGET_OBJECTS:library-objects-float> ${second_float}
    $<TARGET_OBJECTS:faults-second>)
target_link_libraries(faults PRIVATE host-float)
target_include_directories(faults PRIVATE "${PROJECT_SOURCE_DIR}/tools/faults" "${TAUPERP_FIRMWARE}/robot_side")
target_compile_definitions(faults PRIVATE _GNU_SOURCE)
set_target_properties(faults PROPERTIES EXCLUDE_FROM_ALL ON)
add_dependencies(faults tauperp_build_id)

# The blocks for the images of the bench.
file(GLOB block_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/host/tauperp/robot/*.py"
    "${PROJECT_SOURCE_DIR}/host/tauperp/robot/models/*" "${PROJECT_SOURCE_DIR}/host/tauperp/config/*.py"
    "${PROJECT_SOURCE_DIR}/host/tauperp/presets/*")
set(block_numeric_float float32)
set(block_numeric_fixed q9.22)
add_custom_target(blocks)
foreach(numeric IN LISTS NUMERICS)
    set(block "${PROJECT_SOURCE_DIR}/build/block/${numeric}/ku_dex.bin")
    add_custom_command(
        OUTPUT "${block}"
        COMMAND ${CMAKE_COMMAND} -E make_directory "${PROJECT_SOURCE_DIR}/build/block/${numeric}"
        COMMAND sh -c ".venv/bin/tauperp config default --robot ku_dex --numeric ${block_numeric_${numeric}} -o '${block}' >/dev/null"
        WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}" VERBATIM
        DEPENDS ${block_sources} dbc/tauperp.dbc tauperp-float tauperp-fixed "${TAUPERP_OUTPUT}/tauperp.cdef.h"
                "${TAUPERP_OUTPUT}/fixed/tauperp.cdef.h")
    add_custom_target(block-${numeric} DEPENDS "${block}")
    add_dependencies(blocks block-${numeric})
endforeach()
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
    include(tools/bench/bench.cmake)
endif()
