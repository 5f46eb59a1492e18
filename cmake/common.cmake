# Common parts of the builds for the host and for controllers.
add_compile_options("-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=") # __FILE__ is the path in the checkout
set(NUMERICS float fixed)
set(definition_float "")
set(definition_fixed TAUPERP_FIXED=1 TAUPERP_CHANNELS=1) # a build in Q9.22 has no second channel
set(STRICT -Wall -Wextra -Wconversion -Wdouble-promotion -Wshadow -Werror)
list(APPEND TAUPERP_INCLUDES "${TAUPERP_FIRMWARE}/pair")
list(APPEND TAUPERP_INCLUDES "${PROJECT_SOURCE_DIR}/tests/robots") # tables that tests read
file(GLOB robot_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/robots/*.c")
file(GLOB unit_tests CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/unit/test_*.c")
tauperp_identified("${TAUPERP_FIRMWARE}/guard/guard_report.c")

# Unity, from the toolbox.
set(unity "${CMAKE_BINARY_DIR}/unity")
add_custom_command(
    OUTPUT "${unity}/unity.c" "${unity}/unity.h"
    COMMAND sh -c "folder=$(tools/toolbox unity) && mkdir -p '${unity}' && cp \"$folder\"/unity*.[ch] '${unity}'"
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}" VERBATIM)
add_custom_target(unity DEPENDS "${unity}/unity.c" "${unity}/unity.h")

# tauperp_object_library(NAME SETTINGS SOURCE...): objects that are built only where a target needs them.
function(tauperp_object_library name settings)
    add_library(${name} OBJECT EXCLUDE_FROM_ALL ${ARGN})
    target_link_libraries(${name} PRIVATE ${settings})
    add_dependencies(${name} tauperp_build_id)
endfunction()

# The second channel: the same sources again, with another numeric type, projection and prefix (firmware/pair/second.h).
set(pair_source "${TAUPERP_FIRMWARE}/pair/pair.c")
set(second_sources ${TAUPERP_SOURCES} "${TAUPERP_FIRMWARE}/pair/second.c")
list(FILTER second_sources EXCLUDE REGEX "/firmware/schedule/")
tauperp_settings(settings-second TAUPERP_FIXED=1 TAUPERP_SECOND=1)
target_compile_options(settings-second INTERFACE
    "$<$<COMPILE_LANGUAGE:C>:SHELL:-include ${TAUPERP_FIRMWARE}/api/names.h>")
if(TAUPERP_COVERAGE) # lines of the second channel count where its numeric type is the first one
    target_compile_options(settings-second INTERFACE -fno-profile-instr-generate -fno-coverage-mapping -fno-coverage-mcdc)
    set_source_files_properties("${TAUPERP_FIRMWARE}/pair/second.c" PROPERTIES # compiled for it alone
        COMPILE_OPTIONS "-fprofile-instr-generate;-fcoverage-mapping;-fcoverage-mcdc")
endif()
