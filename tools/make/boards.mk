# Firmware images for controllers and emulated ones. A target is a processor (m3 m4f m7 r5f), a board a circuit around one.
CROSS ?= arm-none-eabi-
TARGETS := m3 m4f m7 r5f
# What ships is small, but for the projection in float: its loops along a column are worth the flash that unrolling takes.
OPT ?= -O2
OPT_float = $(if $(filter firmware/core/soft.c,$(1)),-O3,$(if $(filter firmware/core/bidiagonal.c,$(1)),-O2,$(OPT_fixed)))
OPT_fixed = $(if $(filter firmware/%,$(1)),-Os,$(OPT))
# $(call optimisation_of,FILE,NUMERIC,TARGET): the M3 has no floating point, so each product is a call there.
optimisation_of = $(call OPT_$(if $(filter m3,$(3)),fixed,$(2)),$(1))

CPU_m3 := -mcpu=cortex-m3 -mthumb
CPU_m4f := -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16
CPU_m7 := -mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-sp-d16
CPU_r5f := -mcpu=cortex-r5 -mthumb -mfloat-abi=hard -mfpu=vfpv3-d16

# What starts a target when it runs in QEMU, and by which linker script.
HOME_m3 := cortex_m
HOME_m4f := cortex_m
HOME_m7 := cortex_m
HOME_r5f := versal_r5
SUPPORT := tests/target/support
SCRIPT_cortex_m := $(SUPPORT)/cortex_m.ld
SCRIPT_versal_r5 := firmware/boards/versal_r5/versal_r5.ld
script_of = $(SCRIPT_$(HOME_$(1)))

# No errno: a square root is an instruction where there is one. Sections: what is not used is not linked.
CFLAGS_TARGET = $(CFLAGS_ALL) -g -ffreestanding -fno-math-errno -ffunction-sections -fdata-sections -fno-common \
    -Ifirmware/boards/common
FLAGS_STACK := -fstack-usage -fcallgraph-info=su
LDFLAGS_TARGET := -nostartfiles -static -Wl,--gc-sections -Wl,--fatal-warnings -Wl,--build-id=sha1 --specs=nano.specs

# The configuration block of a robot, or of an installation's own file.
ROBOT ?= ku_dex
CONFIG ?= default
BLOCK_NUMERIC_float := float32
BLOCK_NUMERIC_fixed := q9.22
TAUPERP = $(VENV)/bin/tauperp

# Whatever decides what a block says.
BLOCK_SOURCES = $(VENV_STAMP) dbc/tauperp.dbc $(wildcard host/tauperp/robot/*.py host/tauperp/robot/models/* \
    host/tauperp/config/*.py host/tauperp/presets/*) $(filter-out default paper,$(CONFIG))

define BLOCK_RULES
$(BUILD)/block/$(1)/%.bin: $(BLOCK_SOURCES) | library library-fixed
	@mkdir -p $$(@D)
	@$(TAUPERP) config $(CONFIG) --robot $$* --numeric $(BLOCK_NUMERIC_$(1)) -o $$@ > /dev/null
endef
$(foreach numeric,float fixed,$(eval $(call BLOCK_RULES,$(numeric))))

# Emulator start-up, semihosting and newlib stubs are for what tests and counts: no shipped image sees them.
$(BUILD)/object/%/tests/target/support/versal_r5_counter.o $(BUILD)/object/%/tests/target/support/versal_r5_board.o: CFLAGS_ALL += -Ifirmware/boards/versal_r5
$(BUILD)/object/%/tests/target/playback.o $(BUILD)/object/%/tests/target/worst.o: CFLAGS_ALL += -I$(SUPPORT)
$(addprefix $(BUILD)/object/%/tools/bench/,cycle.o guard.o host.o image.o report.o stages.o states.o): CFLAGS_ALL += -I$(SUPPORT)

# Objects of the firmware and of the images' own sources: build/object/TARGET-NUMERIC-OPT/path.o, and for a robot with so
# many joints at most (ROBOT_JOINTS) in .../TARGET-NUMERIC-OPT-JOINTS. The longest arm the wire has room for has 8.
# $(call OBJECT_RULES,TARGET,NUMERIC,SUFFIX,JOINTS)
define OBJECT_RULES
$(BUILD)/object/$(1)-$(2)$(OPT)$(3)/%.o: %.c tools/make/boards.mk tools/make/firmware.mk | $(BUILD)/build_id.h
	@mkdir -p $$(@D)
	@echo 'cc $$< ($(1), $(2))'
	@$(CROSS)gcc $(CPU_$(1)) $$(CFLAGS_TARGET) $$(FLAGS_STACK) $(FLAGS_$(2)) -DROBOT_JOINTS=$(4)u $$(call optimisation_of,$$<,$(2),$(1)) -DTAUPERP_EMULATOR $(STRICT) -c -o $$@ $$<

$(BUILD)/object/$(1)-$(2)$(OPT)$(3)/%.o: %.S tools/make/boards.mk
	@mkdir -p $$(@D)
	@$(CROSS)gcc $(CPU_$(1)) -g -MMD -MP -c -o $$@ $$<
endef
$(foreach target,$(TARGETS),$(foreach numeric,float fixed,$(eval $(call OBJECT_RULES,$(target),$(numeric),,8))\
    $(eval $(call OBJECT_RULES,$(target),$(numeric),-7,7))))

# make firmware BOARD=versal_r5 ROBOT=ku_dex [CONFIG=file.toml] [NUMERIC=fixed] [EMULATOR=1] [LOCKSTEP=1]
BOARD ?= versal_r5
NUMERIC ?= float
BOARDS := versal_r5 stm32g4
TARGET_versal_r5 := r5f
TARGET_stm32g4 := m4f
COMMON_SOURCES := $(addprefix firmware/boards/common/,loop.c restarts.c log.c halt.c memory.c)
LIBRARIES := -Wl,--start-group -lc -lm -lgcc -Wl,--end-group
FLAGS_BOARD := $(if $(LOCKSTEP),-DTAUPERP_LOCKSTEP) $(if $(EMULATOR),-DTAUPERP_EMULATOR)
# BLOCK=file: a block that was made already, instead of one of CONFIG and ROBOT.
IMAGE = $(BUILD)/firmware/$(BOARD)-$(if $(filter default paper,$(CONFIG)),$(ROBOT),$(basename $(notdir $(CONFIG))))$(if $(filter fixed,$(NUMERIC)),-fixed)$(if $(LOCKSTEP),-lockstep)$(if $(EMULATOR),-emulator).elf
# As many joints as the block's robot has, which `firmware` looks up.
JOINTS ?= 8
IMAGE_OBJECTS = $(BUILD)/object/$(BOARD)-$(JOINTS)-$(NUMERIC)$(if $(LOCKSTEP),-lockstep)$(if $(EMULATOR),-emulator)
IMAGE_SOURCES = $(filter-out firmware/robots/%,$(FIRMWARE_SOURCES)) $(COMMON_SOURCES) \
    $(wildcard firmware/boards/$(BOARD)/*.c firmware/boards/$(BOARD)/*.S)
# A user's configuration names its robot, unless ROBOT is given as well.
IMAGE_ROBOT = $(if $(filter default paper,$(CONFIG))$(filter command line environment,$(origin ROBOT)),--robot $(ROBOT))
IMAGE_BLOCK = $(IMAGE:.elf=.block)
CONFIG_COMMAND = $(TAUPERP) config $(CONFIG) $(IMAGE_ROBOT) --numeric $(BLOCK_NUMERIC_$(NUMERIC))

# $(call one_of,NAMES,WORD,WHAT): make ends with one line if the word is none of the names.
one_of = $(if $(filter 1,$(words $(2))),$(if $(filter $(1),$(2)),,$(error there is no $(3) $(2): $(1))),$(error $(3): one of $(1)))

# $(call field_of,BLOCK,NAME): a number of a configuration block
field_of = $(VENV)/bin/python tools/block-field $(1) $(2)

# Whatever is wrong with the configuration is said before anything is compiled.
.PHONY: firmware
firmware: $(VENV_STAMP) ## build an image: make firmware BOARD=versal_r5|stm32g4 ROBOT=ku_dex [CONFIG=file.toml] [NUMERIC=fixed]
	@$(call one_of,$(BOARDS),$(BOARD),board)$(call one_of,float fixed,$(NUMERIC),numeric type)
	@$(if $(BLOCK),[ -f $(BLOCK) ] || { echo "$(BLOCK): no such block" >&2; exit 2; },$(CONFIG_COMMAND) > /dev/null)
	@$(MAKE) $(IMAGE_BLOCK)
	@joints=$$($(call field_of,$(IMAGE_BLOCK),robot.joint_count)) && $(MAKE) -j $(JOBS) JOINTS=$$joints $(IMAGE)
	@$(CROSS)size $(IMAGE)

$(IMAGE_BLOCK): $(if $(BLOCK),$(BLOCK),$(VENV_STAMP) dbc/tauperp.dbc) FORCE
	@mkdir -p $(@D)
	@$(if $(BLOCK),cp $(BLOCK) $@.new,$(CONFIG_COMMAND) -o $@.new >/dev/null)
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi

$(IMAGE_OBJECTS)/%.o: %.c tools/make/boards.mk tools/make/firmware.mk | $(BUILD)/build_id.h
	@mkdir -p $(@D)
	@echo 'cc $< ($(BOARD), $(NUMERIC))'
	@$(CROSS)gcc $(CPU_$(TARGET_$(BOARD))) $(CFLAGS_TARGET) $(FLAGS_$(NUMERIC)) -DROBOT_JOINTS=$(JOINTS)u $(FLAGS_BOARD) $(call optimisation_of,$<,$(NUMERIC)) $(STRICT) -c -o $@ $<

$(IMAGE_OBJECTS)/%.o: %.S tools/make/boards.mk
	@mkdir -p $(@D)
	@$(CROSS)gcc $(CPU_$(TARGET_$(BOARD))) -g -MMD -MP -c -o $@ $<

IMAGE_LINKED = $(addprefix $(IMAGE_OBJECTS)/,$(addsuffix .o,$(basename $(IMAGE_SOURCES))))

$(IMAGE): $(IMAGE_LINKED) $(IMAGE_BLOCK) firmware/boards/common/config.S firmware/boards/common/identity.c firmware/boards/$(BOARD)/$(BOARD).ld $(BUILD)/build_id.h
	@mkdir -p $(@D)
	@echo 'ld $@'
	@crc=$$($(call field_of,$(IMAGE_BLOCK),crc)) && \
	$(CROSS)gcc $(CPU_$(TARGET_$(BOARD))) $(filter-out -MMD -MP,$(CFLAGS_TARGET)) $(FLAGS_$(NUMERIC)) $(OPT) $(STRICT) \
	    -include $(BUILD)/build_id.h $(FLAGS_BOARD) -DTAUPERP_BOARD='"$(BOARD)"' -DTAUPERP_CONFIG_CRC=$${crc}u \
	    -DCONFIG_BLOCK='"$(IMAGE_BLOCK)"' $(LDFLAGS_TARGET) -T firmware/boards/$(BOARD)/$(BOARD).ld -o $@ \
	    firmware/boards/common/config.S firmware/boards/common/identity.c $(IMAGE_LINKED) $(LIBRARIES)

-include $(IMAGE_LINKED:.o=.d)

# The unit tests as images for the emulated targets: build/unit/TARGET-NUMERIC/test_NAME
HOME_SOURCES_cortex_m := $(SUPPORT)/cortex_m_startup.c
HOME_SOURCES_versal_r5 := $(addprefix firmware/boards/versal_r5/,startup.S mpu.c exceptions.c) firmware/boards/common/log.c $(SUPPORT)/versal_r5_board.c
TARGET_TESTS = $(filter-out test_board_% test_fdcan test_linux_%,$(UNIT_TESTS:tests/unit/%.c=%))
unit_objects = $(addprefix $(BUILD)/object/$(1)-$(2)$(OPT)/,$(addsuffix .o,$(basename $(FIRMWARE_SOURCES) \
    $(SUPPORT)/semihosting.c $(SUPPORT)/newlib.c firmware/boards/common/memory.c $(HOME_SOURCES_$(HOME_$(1))))))

define TARGET_UNIT_RULES
$(BUILD)/unit/$(1)-$(2)/%: tests/unit/%.c $(call unit_objects,$(1),$(2)) $(BUILD)/unity/unity.h
	@mkdir -p $$(@D)
	@echo 'cc $$< ($(1), $(2))'
	@$(CROSS)gcc $(CPU_$(1)) $$(filter-out -ffreestanding,$$(CFLAGS_TARGET)) $(FLAGS_$(2)) $(OPT) -DSPARSER=100 -DUNITY_SUPPORT_64 -MF $$@.d -Itests/unit \
	    -isystem $(BUILD)/unity -w $(LDFLAGS_TARGET) -T $(call script_of,$(1)) -o $$@ \
	    $$< $(BUILD)/unity/unity.c $(call unit_objects,$(1),$(2)) $(LIBRARIES)

.PHONY: unit-images-$(1)-$(2)
unit-images-$(1)-$(2): $$(TARGET_TESTS:%=$(BUILD)/unit/$(1)-$(2)/%)
endef
$(foreach target,$(TARGETS),$(foreach numeric,float fixed,$(eval $(call TARGET_UNIT_RULES,$(target),$(numeric)))))

unit-images: $(foreach numeric,$(NUMERICS),$(TARGETS:%=unit-images-%-$(numeric)))
.PHONY: unit-images

# Images that count and compare: build/target/playback-TARGET-NUMERIC.elf, build/target/worst-TARGET-NUMERIC.elf
COUNTER_cortex_m := $(SUPPORT)/cortex_m_counter.c
COUNTER_versal_r5 := firmware/boards/versal_r5/pmu.c $(SUPPORT)/versal_r5_counter.c
# $(call counting_objects,TARGET,NUMERIC,PROGRAM)
counting_objects = $(call unit_objects,$(1),$(2)) $(addprefix $(BUILD)/object/$(1)-$(2)$(OPT)/,$(addsuffix .o,$(basename \
    tests/target/$(3).c $(COUNTER_$(HOME_$(1))))))
COUNTING := playback worst

define COUNTING_RULES
$(BUILD)/target/$(3)-$(1)-$(2).elf: $(call counting_objects,$(1),$(2),$(3)) $(call script_of,$(1))
	@mkdir -p $$(@D)
	@echo 'ld $$@'
	@$(CROSS)gcc $(CPU_$(1)) $(LDFLAGS_TARGET) -T $(call script_of,$(1)) -o $$@ \
	    $(call counting_objects,$(1),$(2),$(3)) $(LIBRARIES)

-include $$(wildcard $(patsubst %.o,%.d,$(call counting_objects,$(1),$(2),$(3))))
endef
$(foreach target,$(TARGETS),$(foreach numeric,float fixed,$(foreach program,$(COUNTING),\
    $(eval $(call COUNTING_RULES,$(target),$(numeric),$(program))))))
$(BUILD)/object/%/tests/target/worst.o: CFLAGS_ALL += -Itests/unit -isystem $(BUILD)/unity

counting-images: $(foreach program,$(COUNTING),$(foreach numeric,$(NUMERICS),$(TARGETS:%=$(BUILD)/target/$(program)-%-$(numeric).elf)))
.PHONY: counting-images
$(foreach target,$(TARGETS),$(foreach numeric,float fixed,$(BUILD)/object/$(target)-$(numeric)$(OPT)/tests/target/worst.o)): $(BUILD)/unity/unity.h

# Images of the Versal board that provoke one fault each.
FAULT_OBJECTS := $(addprefix $(BUILD)/object/r5f-float$(OPT)/firmware/boards/,common/log.o common/halt.o common/restarts.o \
    $(addprefix versal_r5/,startup.o mpu.o exceptions.o board.o outputs.o pmu.o reset_cause.o))
$(BUILD)/target/%.elf: tests/target/faults/provoke.c $(FAULT_OBJECTS) firmware/boards/versal_r5/versal_r5.ld
	@mkdir -p $(@D)
	@$(CROSS)gcc $(CPU_r5f) $(filter-out -MMD -MP,$(CFLAGS_TARGET)) $(OPT) -Wno-infinite-recursion -DPROVOKE=$* $(LDFLAGS_TARGET) \
	    -T firmware/boards/versal_r5/versal_r5.ld -o $@ $< $(FAULT_OBJECTS) $(LIBRARIES)

include tools/bench/bench.mk

.PHONY: flash
flash: ## write an image to a board on the desk: make flash BOARD=stm32g4 (openocd or st-flash)
	@$(call one_of,stm32g4,$(BOARD),board to flash)
	@$(MAKE) firmware BOARD=$(BOARD)
	@if command -v openocd >/dev/null; then \
	    openocd -f interface/stlink.cfg -f target/stm32g4x.cfg -c "program $(IMAGE) verify reset exit"; \
	elif command -v st-flash >/dev/null; then \
	    $(CROSS)objcopy -O binary $(IMAGE) $(IMAGE:.elf=.bin) && st-flash --connect-under-reset --reset write $(IMAGE:.elf=.bin) 0x08000000; \
	else echo "make flash: neither openocd nor st-flash is installed" >&2; exit 2; fi
