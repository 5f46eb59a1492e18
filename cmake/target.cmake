# For a processor in QEMU: images of the unit tests, images that count and compare, images that provoke a fault, the bench's.
enable_language(ASM)
include(cmake/image.cmake)
set(support "${PROJECT_SOURCE_DIR}/tests/target/support")
set(boards "${TAUPERP_FIRMWARE}/boards")

# Start-up code, instruction counter and linker script of a processor in QEMU.
if(TAUPERP_START STREQUAL "cortex_m")
    set(linker_script "${support}/cortex_m.ld")
    set(start_sources "${support}/cortex_m_startup.c")
    set(counter_sources "${support}/cortex_m_counter.c")
else()
    set(linker_script "${boards}/versal_r5/versal_r5.ld")
    set(start_sources "${boards}/versal_r5/startup.S" "${boards}/versal_r5/mpu.c" "${boards}/versal_r5/exceptions.c"
        "${boards}/common/log.c" "${support}/versal_r5_board.c")
    set(counter_sources "${boards}/versal_r5/pmu.c" "${support}/versal_r5_counter.c")
endif()

# Tests of board models, of their registers and of the Linux process run only on the host.
set(target_tests ${unit_tests})
list(FILTER target_tests EXCLUDE REGEX "/test_(board_.*|fdcan|linux_.*|robot_side)\\.c$")

# tauperp_target_image(NAME FOLDER FILE OBJECTS...)
function(tauperp_target_image name folder file)
    tauperp_image(${name} "${linker_script}" ${ARGN})
    set_target_properties(${name} PROPERTIES
        OUTPUT_NAME ${file} RUNTIME_OUTPUT_DIRECTORY "${PROJECT_SOURCE_DIR}/build/${folder}")
endfunction()

function(tauperp_target_images numeric)
    set(kind ${TAUPERP_TARGET}-${numeric})
    tauperp_image_objects(firmware-${numeric} ${numeric} 8 ${TAUPERP_SOURCES} ${robot_sources})
    add_custom_target(firmware-objects-${kind})
    add_dependencies(firmware-objects-${kind} firmware-${numeric})
    tauperp_image_objects(support-${numeric} ${numeric} 8
        "${support}/semihosting.c" "${support}/newlib.c" "${boards}/common/memory.c" ${start_sources})
    target_include_directories(support-${numeric} PRIVATE "${boards}/versal_r5")
    set(linked $<TARGET_OBJECTS:firmware-${numeric}> $<TARGET_OBJECTS:support-${numeric}>)

    # The unit tests: build/unit/PROCESSOR-NUMERIC/test_NAME
    add_library(unity-${numeric} OBJECT EXCLUDE_FROM_ALL "${unity}/unity.c")
    add_dependencies(unity-${numeric} unity)
    add_custom_target(unit-images-${kind})
    foreach(test IN LISTS target_tests)
        get_filename_component(name "${test}" NAME_WE)
        tauperp_target_image(${name}-${numeric} unit/${kind} ${name} ${test} $<TARGET_OBJECTS:unity-${numeric}> ${linked})
        add_dependencies(unit-images-${kind} ${name}-${numeric})
    endforeach()
    list(TRANSFORM target_tests REPLACE ".*/(test_.*)\\.c$" "\\1-${numeric}" OUTPUT_VARIABLE programs)
    foreach(program IN LISTS programs ITEMS unity-${numeric})
        target_link_libraries(${program} PRIVATE settings-${numeric})
        target_include_directories(${program} PRIVATE "${boards}/common" "${PROJECT_SOURCE_DIR}/tests/unit")
        target_include_directories(${program} SYSTEM PRIVATE "${unity}")
        target_compile_definitions(${program} PRIVATE SPARSER=100 UNITY_SUPPORT_64)
        target_compile_options(${program} PRIVATE -g -ffunction-sections -fdata-sections -fno-common -O2 -w)
    endforeach()

    # Images that compare and count: build/target/playback-PROCESSOR-NUMERIC.elf, build/target/worst-PROCESSOR-NUMERIC.elf
    add_custom_target(counting-images-${kind})
    foreach(program playback worst)
        tauperp_image_objects(${program}-${numeric} ${numeric} 8
            "${PROJECT_SOURCE_DIR}/tests/target/${program}.c" ${counter_sources})
        target_include_directories(${program}-${numeric} PRIVATE "${support}" "${boards}/versal_r5")
        tauperp_target_image(${program}-image-${numeric} target ${program}-${kind}.elf
            ${linked} $<TARGET_OBJECTS:${program}-${numeric}>)
        add_dependencies(counting-images-${kind} ${program}-image-${numeric})
    endforeach()
    target_include_directories(worst-${numeric} PRIVATE "${PROJECT_SOURCE_DIR}/tests/unit")
    target_include_directories(worst-${numeric} SYSTEM PRIVATE "${unity}")
    add_dependencies(worst-${numeric} unity)
endfunction()

foreach(numeric IN LISTS NUMERICS)
    tauperp_settings(settings-${numeric} ${definition_${numeric}})
    tauperp_target_images(${numeric})
endforeach()

# Images of the Versal board that provoke one fault each: build/target/PROVOCATION.elf
if(TAUPERP_START STREQUAL "versal_r5")
    set(fault_sources "${boards}/common/log.c" "${boards}/common/halt.c" "${boards}/common/restarts.c")
    foreach(source startup.S mpu.c exceptions.c board.c outputs.c pmu.c reset_cause.c)
        list(APPEND fault_sources "${boards}/versal_r5/${source}")
    endforeach()
    tauperp_image_objects(fault-objects float 8 ${fault_sources})
    foreach(provocation write_code execute_data undefined_instruction supervisor_call no_memory stack_overflow
            restarted_by_exception)
        tauperp_target_image(${provocation} target ${provocation}.elf
            "${PROJECT_SOURCE_DIR}/tests/target/faults/provoke.c" $<TARGET_OBJECTS:fault-objects>)
        target_link_libraries(${provocation} PRIVATE settings-float)
        target_include_directories(${provocation} PRIVATE "${boards}/common")
        target_compile_options(${provocation} PRIVATE ${IMAGE_OPTIONS} -O2 -Wno-infinite-recursion)
        target_compile_definitions(${provocation} PRIVATE PROVOKE=${provocation})
    endforeach()
endif()
include(tools/bench/bench.cmake)
