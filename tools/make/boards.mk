# Firmware images for controllers and emulated ones. A target is a processor (m3 m4f m7 r5f), a board a circuit around one.
CROSS ?= arm-none-eabi-
TARGETS := m3 m4f m7 r5f
OPT ?= -O2

CPU_m3 := -mcpu=cortex-m3 -mthumb
CPU_m4f := -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16
CPU_m7 := -mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-sp-d16
CPU_r5f := -mcpu=cortex-r5 -marm -mfloat-abi=hard -mfpu=vfpv3-d16

# Which directory of firmware/boards starts a target when it runs in QEMU, and the linker script there.
HOME_m3 := cortex_m
HOME_m4f := cortex_m
HOME_m7 := cortex_m
HOME_r5f := versal_r5

# No errno: a square root is an instruction where there is one. Sections: what is not used is not linked.
CFLAGS_TARGET := $(CFLAGS_ALL) -g -ffreestanding -fno-math-errno -ffunction-sections -fdata-sections -fno-common \
    -fstack-usage -fcallgraph-info=su -Ifirmware/boards/common
LDFLAGS_TARGET := -nostartfiles -static -Wl,--gc-sections -Wl,--fatal-warnings -Wl,--build-id=sha1 --specs=nano.specs

# The configuration block of a robot, or of an installation's own file.
ROBOT ?= ku_dex
CONFIG ?= default
BLOCK_NUMERIC_float := float32
BLOCK_NUMERIC_fixed := q9.22
TAUPERP = $(VENV)/bin/tauperp

define BLOCK_RULES
$(BUILD)/block/$(1)/%.bin: $(VENV_STAMP) dbc/tauperp.dbc $(filter-out default paper,$(CONFIG))
	@mkdir -p $$(@D)
	@$(TAUPERP) config $(CONFIG) --robot $$* --numeric $(BLOCK_NUMERIC_$(1)) -o $$@ > /dev/null
endef
$(foreach numeric,float fixed,$(eval $(call BLOCK_RULES,$(numeric))))

# Objects of the firmware and of the images' own sources: build/object/TARGET-NUMERIC-OPT/path.o
define OBJECT_RULES
$(BUILD)/object/$(1)-$(2)$(OPT)/%.o: %.c tools/make/boards.mk tools/make/firmware.mk
	@mkdir -p $$(@D)
	@echo 'cc $$< ($(1), $(2))'
	@$(CROSS)gcc $(CPU_$(1)) $$(CFLAGS_TARGET) $(FLAGS_$(2)) $(OPT) $$(call warnings_for,$$<) $$(FLAGS_EXTRA) -c -o $$@ $$<

$(BUILD)/object/$(1)-$(2)$(OPT)/%.o: %.S tools/make/boards.mk
	@mkdir -p $$(@D)
	@$(CROSS)gcc $(CPU_$(1)) -g -MMD -MP -c -o $$@ $$<
endef
$(foreach target,$(TARGETS),$(foreach numeric,float fixed,$(eval $(call OBJECT_RULES,$(target),$(numeric)))))

include tools/bench/bench.mk
