# The peers of the bench (tools/bench/peer.h): our counting programs, in which a peer's function replaces motion_step
# or index_step. The other object files are the same.
enable_language(CXX)
# -O3 is faster for them everywhere. On the M4F, the target of most published figures, -O2 is built too.
set(levels -O3)
if(bench_target STREQUAL "m4f")
    list(PREPEND levels -O2)
endif()
# MOTION_PROJECTION; for Pinocchio only the cheaper projection, because the projections are the same.
set(peers casadi_svd casadi_qr)
set(motions casadi)
if(bench_target STREQUAL "host")
    list(APPEND peers pinocchio_qr)
    list(APPEND motions pinocchio)
endif()

set(generated "${CMAKE_BINARY_DIR}/peers.d")
file(MAKE_DIRECTORY "${generated}")
foreach(model casadi=casadi_terms.c pinocchio=pinocchio_model.h)
    string(REPLACE "=" ";" model "${model}")
    list(GET model 0 kind)
    list(GET model 1 file)
    add_custom_command(
        OUTPUT "${generated}/${file}"
        COMMAND .venv/bin/python tools/bench/peer_terms.py ${kind} ${BENCH_ROBOT} "${generated}/${file}"
        DEPENDS "${bench}/peer_terms.py" WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}" VERBATIM)
endforeach()
set_source_files_properties("${bench}/peer_casadi.c" PROPERTIES OBJECT_DEPENDS "${generated}/casadi_terms.c")
set_source_files_properties("${bench}/peer_pinocchio.cpp" PROPERTIES OBJECT_DEPENDS "${generated}/pinocchio_model.h")

# A peer may contract products and sums: only our own code needs -ffp-contract=off. Eigen is used without exceptions.
add_library(peer-settings INTERFACE)
target_include_directories(peer-settings INTERFACE "${bench}" "${generated}" "${support}" ${TAUPERP_INCLUDES})
target_include_directories(peer-settings SYSTEM INTERFACE /usr/include/eigen3)
target_compile_definitions(peer-settings INTERFACE
    NDEBUG ROBOT_JOINTS=${BENCH_JOINTS}u $<$<STREQUAL:${bench_target},host>:PEER_PINOCCHIO>)
target_compile_options(peer-settings INTERFACE -fno-math-errno -ffunction-sections -fdata-sections -Wall
    -Wno-unused-parameter -Wdouble-promotion -Werror $<IF:$<COMPILE_LANGUAGE:C>,-std=c11,-std=c++17>)
if(bench_target STREQUAL "host")
    target_compile_options(peer-settings INTERFACE -fno-pie)
else()
    target_compile_options(peer-settings INTERFACE
        "$<$<COMPILE_LANGUAGE:CXX>:-fno-exceptions;-fno-rtti;-fno-threadsafe-statics>")
endif()
set(boost BOOST_MPL_LIMIT_LIST_SIZE=30 BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS)
file(GLOB pinocchio LIST_DIRECTORIES true "${PROJECT_SOURCE_DIR}/.venv/lib/python3*/site-packages/cmeel.prefix/include")
set_source_files_properties("${bench}/peer_pinocchio.cpp" PROPERTIES
    COMPILE_DEFINITIONS "${boost}" COMPILE_OPTIONS "-isystem;${pinocchio}")

# tauperp_peer_image(NAME FILE OBJECTS...): the host's memcpy is the C library's, which is faster than our loop. Names
# are bound there before main, so that the first state does not include it. A remaining double would be a call of a helper
# on a core without double precision.
function(tauperp_peer_image name file)
    tauperp_bench_image(${name} ${file} $<TARGET_OBJECTS:bench-block-float> ${ARGN})
    if(bench_target STREQUAL "host")
        target_link_options(${name} PRIVATE -Wl,-z,now)
        target_link_libraries(${name} PRIVATE stdc++ m)
    else()
        add_custom_command(TARGET ${name} POST_BUILD
            COMMAND sh -c "! ${CMAKE_NM} '$<TARGET_FILE:${name}>' | grep __aeabi_d[a-z]" VERBATIM)
    endif()
    add_dependencies(bench-peers-${bench_target} ${name})
endfunction()

add_custom_target(bench-peers-${bench_target})
set(names "")
foreach(level IN LISTS levels)
    foreach(motion IN LISTS motions)
        file(GLOB source "${bench}/peer_${motion}.c*")
        add_library(peer-${motion}${level} OBJECT EXCLUDE_FROM_ALL "${source}")
    endforeach()
    add_library(peer-projections${level} OBJECT EXCLUDE_FROM_ALL "${bench}/peer_eigen.cpp" "${bench}/peer_index.c")
    add_library(peer-agree${level} OBJECT EXCLUDE_FROM_ALL "${bench}/agree.c")
    list(TRANSFORM motions REPLACE "(.+)" "peer-\\1${level}" OUTPUT_VARIABLE motion_objects)
    foreach(library IN LISTS motion_objects ITEMS peer-projections${level} peer-agree${level})
        target_link_libraries(${library} PRIVATE peer-settings)
        target_compile_options(${library} PRIVATE ${level})
    endforeach()

    foreach(peer IN LISTS peers)
        string(REPLACE "_" ";" parts ${peer})
        list(GET parts 0 motion)
        list(GET parts 1 projection)
        string(APPEND names "${peer}${level}\n")
        foreach(program stages guard)
            set(ours $<TARGET_OBJECTS:bench-other-float> $<TARGET_OBJECTS:bench-states-float>
                $<TARGET_OBJECTS:bench-board-float> $<TARGET_OBJECTS:bench-${program}-float>)
            if(TAUPERP_TARGET)
                list(APPEND ours $<TARGET_OBJECTS:bench-memory-float>)
            endif()
            # All of our code except the core; it calls the peer's functions.
            set(callers "${generated}/${peer}${level}-${program}.o")
            add_custom_command(
                OUTPUT "${callers}"
                COMMAND ${CMAKE_LINKER} -r -o "${callers}" ${ours}
                COMMAND ${CMAKE_OBJCOPY} --redefine-sym motion_step=peer_${motion}_motion_step
                        --redefine-sym index_step=peer_${projection}_index_step "${callers}"
                DEPENDS ${ours} COMMAND_EXPAND_LISTS VERBATIM)
            set_source_files_properties("${callers}" PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
            tauperp_peer_image(${peer}${level}-${program} ${bench_target}-${peer}${level}-${program}.elf "${callers}"
                $<TARGET_OBJECTS:bench-core-float> $<TARGET_OBJECTS:peer-${motion}${level}>
                $<TARGET_OBJECTS:peer-projections${level}>)
        endforeach()
    endforeach()

    # Ours and all peers of a level in one program.
    list(TRANSFORM motion_objects REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>")
    tauperp_peer_image(agree${level} ${bench_target}-peers${level}-agree.elf $<TARGET_OBJECTS:bench-core-float>
        $<TARGET_OBJECTS:bench-states-float> $<TARGET_OBJECTS:bench-board-float> ${motion_objects}
        $<TARGET_OBJECTS:peer-projections${level}> $<TARGET_OBJECTS:peer-agree${level}>)
endforeach()
file(WRITE "${CMAKE_BINARY_DIR}/peers" "${names}")
