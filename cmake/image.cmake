# How an image for a controller is compiled and linked.
#
# -fno-math-errno: a square root is one instruction where the processor has it. Sections: unused code is not linked.
set(IMAGE_OPTIONS -g -ffreestanding -fno-math-errno -ffunction-sections -fdata-sections -fno-common)
set(IMAGE_LINK -nostartfiles -static -Wl,--gc-sections -Wl,--fatal-warnings -Wl,--build-id=sha1 --specs=nano.specs)
set(IMAGE_DEFINITIONS TAUPERP_EMULATOR)
set(IMAGE_LIBRARIES -Wl,--start-group -lc -lm -lgcc -Wl,--end-group)

# Shipped code is optimised for size, except in float what has loops along a column or over the joints: unrolling gains
# much time. On the M3 it gains nothing, because each product is a call there. Code for tests and counts only has other options.
set(fast soft explained detector index acceleration)
list(TRANSFORM fast REPLACE "(.+)" "${TAUPERP_FIRMWARE}/core/\\1.c")
set_source_files_properties(${fast} PROPERTIES
    COMPILE_OPTIONS "$<$<BOOL:$<TARGET_PROPERTY:FAST_PROJECTION>>:-O3>")
set_source_files_properties("${TAUPERP_FIRMWARE}/core/bidiagonal.c" PROPERTIES
    COMPILE_OPTIONS "$<$<BOOL:$<TARGET_PROPERTY:FAST_PROJECTION>>:-O2>")
set_source_files_properties("${TAUPERP_FIRMWARE}/core/bank.c" PROPERTIES
    COMPILE_OPTIONS "$<$<NOT:$<BOOL:$<TARGET_PROPERTY:FAST_PROJECTION>>>:-O2>") # slower in float
# The rotations take most of the second channel's tick.
set_source_files_properties("${TAUPERP_FIRMWARE}/core/jacobi.c" PROPERTIES COMPILE_OPTIONS -O3)
file(GLOB only_counts CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/target/*.c"
    "${PROJECT_SOURCE_DIR}/tests/target/support/*.c" "${PROJECT_SOURCE_DIR}/tools/bench/*.c")
list(FILTER only_counts EXCLUDE REGEX "/bench/(peer_.*|agree)\\.c$")
set_source_files_properties(${only_counts} PROPERTIES COMPILE_OPTIONS -O2)

# tauperp_image_objects(NAME NUMERIC JOINTS SOURCE...): for a robot with at most JOINTS joints. The longest arm has 8.
function(tauperp_image_objects name numeric joints)
    tauperp_object_library(${name} settings-${numeric} ${ARGN})
    target_compile_definitions(${name} PRIVATE ROBOT_JOINTS=${joints}u ${IMAGE_DEFINITIONS})
    target_include_directories(${name} PRIVATE "${TAUPERP_FIRMWARE}/boards/common")
    set(options ${IMAGE_OPTIONS} ${STRICT} -fstack-usage -fcallgraph-info=su -Os)
    target_compile_options(${name} PRIVATE -g "$<$<COMPILE_LANGUAGE:C>:${options}>")
    if(numeric STREQUAL "float" AND NOT TAUPERP_TARGET STREQUAL "m3")
        set_target_properties(${name} PROPERTIES FAST_PROJECTION ON)
    endif()
endfunction()

# tauperp_image(NAME SCRIPT SOURCE...)
function(tauperp_image name script)
    add_executable(${name} EXCLUDE_FROM_ALL ${ARGN})
    target_link_options(${name} PRIVATE ${IMAGE_LINK} -T "${script}")
    target_link_libraries(${name} PRIVATE ${IMAGE_LIBRARIES})
    set_target_properties(${name} PROPERTIES LINKER_LANGUAGE C LINK_DEPENDS "${script}")
endfunction()
