# Instruction counts: build/bench/TARGET-NUMERIC-O2-PROGRAM.elf, run in QEMU, on the host under Valgrind.
#
# Everything is compiled for the number of joints of the linked block's robot. The preset host makes the block,
# build/block/NUMERIC/ku_dex.bin.
set(bench "${PROJECT_SOURCE_DIR}/tools/bench")
set(BENCH_ROBOT ku_dex)
set(BENCH_JOINTS 7)
set(core_sources ${TAUPERP_SOURCES})
list(FILTER core_sources INCLUDE REGEX "/firmware/core/")
set(other_sources ${TAUPERP_SOURCES} ${robot_sources} "${bench}/cycle.c")
list(REMOVE_ITEM other_sources ${core_sources})
if(TAUPERP_TARGET)
    set(bench_target ${TAUPERP_TARGET})
    set(bench_board ${start_sources} ${counter_sources} "${support}/semihosting.c")
else()
    # The host is compiled like the controllers: without a red zone, so that gcc reports the true size of a frame, and
    # without the additional options of some distributions. Without symbols Callgrind is twice as fast.
    enable_language(ASM)
    include(cmake/image.cmake)
    set(bench_target host)
    set(IMAGE_DEFINITIONS _DEFAULT_SOURCE)
    set(support "${PROJECT_SOURCE_DIR}/tests/target/support")
    set(bench_board "${bench}/host.c")
    set(host_options -fno-pie -fno-stack-protector -fcf-protection=none -fno-asynchronous-unwind-tables -mno-red-zone)
    set(host_link -no-pie -Wl,--gc-sections,-z,noexecstack,-s)
endif()

# tauperp_bench_objects(NAME NUMERIC SOURCE...)
function(tauperp_bench_objects name numeric)
    tauperp_image_objects(${name} ${numeric} ${BENCH_JOINTS} ${ARGN})
    target_include_directories(${name} PRIVATE "${support}" "${TAUPERP_FIRMWARE}/boards/versal_r5")
    if(host_options)
        target_compile_options(${name} PRIVATE ${host_options})
    endif()
endfunction()

# tauperp_bench_image(NAME FILE OBJECTS...)
function(tauperp_bench_image name file)
    if(bench_target STREQUAL "host")
        add_executable(${name} EXCLUDE_FROM_ALL ${ARGN})
        target_link_options(${name} PRIVATE ${host_link})
        set_target_properties(${name} PROPERTIES LINKER_LANGUAGE C)
    else()
        tauperp_image(${name} "${linker_script}" ${ARGN})
    endif()
    set_target_properties(${name} PROPERTIES
        OUTPUT_NAME ${file} RUNTIME_OUTPUT_DIRECTORY "${PROJECT_SOURCE_DIR}/build/bench")
endfunction()

# The second of two channels, alone and so without its prefix.
tauperp_settings(settings-second_channel TAUPERP_FIXED=1 TAUPERP_SECOND=1 TAUPERP_CHANNELS=1)
set(block_numeric_float float)
set(block_numeric_fixed fixed)
set(block_numeric_second_channel fixed)

foreach(numeric IN LISTS NUMERICS ITEMS second_channel)
    tauperp_bench_objects(bench-core-${numeric} ${numeric} ${core_sources})
    tauperp_bench_objects(bench-other-${numeric} ${numeric} ${other_sources})
    tauperp_bench_objects(bench-states-${numeric} ${numeric} "${bench}/states.c" "${bench}/report.c")
    tauperp_bench_objects(bench-memory-${numeric} ${numeric} "${TAUPERP_FIRMWARE}/boards/common/memory.c")
    tauperp_bench_objects(bench-board-${numeric} ${numeric} ${bench_board})
    set(block "${PROJECT_SOURCE_DIR}/build/block/${block_numeric_${numeric}}/${BENCH_ROBOT}.bin")
    add_library(bench-block-${numeric} OBJECT EXCLUDE_FROM_ALL "${TAUPERP_FIRMWARE}/boards/common/config.S")
    target_compile_definitions(bench-block-${numeric} PRIVATE CONFIG_BLOCK="${block}")
    list(APPEND blocks "${block}")

    add_custom_target(bench-images-${bench_target}-${numeric})
    foreach(program stages guard image)
        tauperp_bench_objects(bench-${program}-${numeric} ${numeric} "${bench}/${program}.c")
        tauperp_bench_image(bench-${program}-image-${numeric} ${bench_target}-${numeric}-O2-${program}.elf
            $<TARGET_OBJECTS:bench-block-${numeric}> $<TARGET_OBJECTS:bench-core-${numeric}>
            $<TARGET_OBJECTS:bench-other-${numeric}> $<TARGET_OBJECTS:bench-states-${numeric}>
            $<TARGET_OBJECTS:bench-memory-${numeric}> $<TARGET_OBJECTS:bench-board-${numeric}>
            $<TARGET_OBJECTS:bench-${program}-${numeric}>)
        add_dependencies(bench-images-${bench_target}-${numeric} bench-${program}-image-${numeric})
        # Only the size matters: nothing of the host is linked.
        if(program STREQUAL "image" AND bench_target STREQUAL "host")
            target_link_options(bench-image-image-${numeric} PRIVATE -static -nostdlib -Wl,-e,main)
        endif()
    endforeach()
endforeach()
set_source_files_properties("${TAUPERP_FIRMWARE}/boards/common/config.S" PROPERTIES OBJECT_DEPENDS "${blocks}")

option(TAUPERP_PEERS "Also build the peers, which takes minutes" OFF)
if(TAUPERP_PEERS)
    include(tools/bench/peers.cmake)
endif()
