# The table of processors and boards that CMake, `make firmware` and the tests read. One row per line.
#
# A new board is its folder in firmware/boards, with a linker script of the folder's name, and one row here.

# tauperp_processor(NAME START FLAG...): START selects its start-up code in QEMU (target.cmake).
tauperp_processor(m3 cortex_m -mcpu=cortex-m3 -mthumb)
tauperp_processor(m4f cortex_m -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16)
tauperp_processor(m7 cortex_m -mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-sp-d16)
tauperp_processor(r5f versal_r5 -mcpu=cortex-r5 -mthumb -mfloat-abi=hard -mfpu=vfpv3-d16)

# tauperp_board(NAME PROCESSOR CHANNELS [OPENOCD ADDRESS]): CHANNELS is 1 where two are too slow for a cycle of 1 ms
# (docs/decisions/channels.md). OPENOCD and ADDRESS are for `make flash`, where the board can be flashed.
tauperp_board(versal_r5 r5f 2)
tauperp_board(stm32g4 m4f 1 stm32g4x 0x08000000)
