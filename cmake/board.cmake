# An image for a board of the table: `make firmware` sets all of these variables.
set(TAUPERP_NUMERIC float CACHE STRING "float or fixed")
set(TAUPERP_CHANNELS 2 CACHE STRING "2 channels, of which the first is float, or 1")
set(TAUPERP_BLOCK "" CACHE FILEPATH "The configuration block, as `tauperp config -o` writes it")
set(TAUPERP_CRC 0 CACHE STRING "The block's CRC")
set(TAUPERP_IMAGE "${CMAKE_BINARY_DIR}/firmware.elf" CACHE FILEPATH "The image")
option(TAUPERP_EMULATOR "For the emulator, not for a robot" OFF)
option(TAUPERP_LOCKSTEP "For tests in lockstep with a simulation, not for a robot" OFF)

enable_language(ASM)
include(cmake/image.cmake)
set(common "${TAUPERP_FIRMWARE}/boards/common")
set(board "${TAUPERP_FIRMWARE}/boards/${TAUPERP_BOARD}")
file(GLOB board_sources CONFIGURE_DEPENDS "${board}/*.c")
file(GLOB start_sources CONFIGURE_DEPENDS "${board}/*.S")
set(IMAGE_DEFINITIONS TAUPERP_CHANNELS=${TAUPERP_CHANNELS})
foreach(variant TAUPERP_LOCKSTEP TAUPERP_EMULATOR)
    if(${variant})
        list(APPEND IMAGE_DEFINITIONS ${variant})
    endif()
endforeach()

tauperp_settings(settings-${TAUPERP_NUMERIC} ${definition_${TAUPERP_NUMERIC}})
tauperp_image_objects(firmware ${TAUPERP_NUMERIC} ${TAUPERP_JOINTS} ${TAUPERP_SOURCES} ${pair_source} "${common}/loop.c"
    "${common}/restarts.c" "${common}/log.c" "${common}/halt.c" "${common}/memory.c" ${board_sources} ${start_sources})

set(second_objects "")
if(TAUPERP_CHANNELS EQUAL 2)
    tauperp_image_objects(second second ${TAUPERP_JOINTS} ${second_sources})
    set(second_objects $<TARGET_OBJECTS:second>)
endif()

# Parts that differ between images of the same objects: the block and the identity.
add_library(identity OBJECT EXCLUDE_FROM_ALL "${common}/config.S" "${common}/identity.c")
target_link_libraries(identity PRIVATE settings-${TAUPERP_NUMERIC})
target_include_directories(identity PRIVATE "${common}")
target_compile_options(identity PRIVATE -g "$<$<COMPILE_LANGUAGE:C>:${IMAGE_OPTIONS};${STRICT};-O2>")
target_compile_definitions(identity PRIVATE ${IMAGE_DEFINITIONS} CONFIG_BLOCK="${TAUPERP_BLOCK}"
    TAUPERP_BOARD="${TAUPERP_BOARD}" TAUPERP_CONFIG_CRC=${TAUPERP_CRC}u)
set_source_files_properties("${common}/config.S" PROPERTIES OBJECT_DEPENDS "${TAUPERP_BLOCK}")
tauperp_identified("${common}/identity.c")
add_dependencies(identity tauperp_build_id)

tauperp_image(image "${board}/${TAUPERP_BOARD}.ld" $<TARGET_OBJECTS:identity> $<TARGET_OBJECTS:firmware>
    ${second_objects})
get_filename_component(name "${TAUPERP_IMAGE}" NAME)
get_filename_component(folder "${TAUPERP_IMAGE}" DIRECTORY)
set_target_properties(image PROPERTIES OUTPUT_NAME "${name}" RUNTIME_OUTPUT_DIRECTORY "${folder}")
