# Instruction counts: one program a target, numeric type and purpose, run in QEMU, on the host under Valgrind.
BENCH_ROBOT := ku_dex
BENCH_JOINTS := 7
BENCH_ALL := $(TARGETS) $(if $(filter x86_64,$(shell uname -m)),host)
BENCH_TARGETS ?= $(BENCH_ALL)
BENCH_NUMERICS ?= float fixed
BENCH_PROGRAMS := stages guard image
BENCH_SOURCES := tools/bench/states.c tools/bench/report.c firmware/boards/common/memory.c
BENCH_FIRMWARE_stages = $(wildcard firmware/core/*.c)
BENCH_FIRMWARE_guard = $(FIRMWARE_SOURCES) tools/bench/cycle.c
BENCH_FIRMWARE_image = $(FIRMWARE_SOURCES)
BENCH_SOURCES_cortex_m := $(addprefix $(SUPPORT)/,cortex_m_startup.c cortex_m_counter.c semihosting.c)
BENCH_SOURCES_versal_r5 := $(HOME_SOURCES_versal_r5) firmware/boards/versal_r5/pmu.c $(addprefix $(SUPPORT)/,versal_r5_counter.c semihosting.c)
BENCH_SOURCES_host := tools/bench/host.c

# The host, compiled as the controllers are: no red zone, so that a frame is as large as gcc says, and nothing that one
# distribution adds and another does not.
HOME_host := host
BENCH_CC_host = $(CC)
BENCH_OBJCOPY_host := objcopy
CFLAGS_HOST = $(CFLAGS_TARGET) -D_DEFAULT_SOURCE -fno-pie -fno-stack-protector -fcf-protection=none -fno-asynchronous-unwind-tables -mno-red-zone
# Without symbols Callgrind is twice as fast.
BENCH_LINK_host := -no-pie -Wl,--gc-sections,-z,noexecstack,-s
$(foreach target,$(TARGETS),\
    $(eval BENCH_CC_$(target) = $(CROSS)gcc $(CPU_$(target)))\
    $(eval BENCH_OBJCOPY_$(target) = $(CROSS)objcopy)\
    $(eval BENCH_LINK_$(target) = $(LDFLAGS_TARGET) -T $(call script_of,$(target)))\
    $(eval BENCH_LIBRARIES_$(target) := $(LIBRARIES)))

define BENCH_HOST_RULES
$(BUILD)/object/host-$(1)$(OPT)-$(BENCH_JOINTS)/%.o: %.c tools/make/boards.mk tools/make/firmware.mk tools/bench/bench.mk | $(BUILD)/build_id.h
	@mkdir -p $$(@D)
	@echo 'cc $$< (host, $(1))'
	@$$(CC) $$(CFLAGS_HOST) $$(FLAGS_STACK) $(FLAGS_$(1)) -DROBOT_JOINTS=$(BENCH_JOINTS)u $$(call optimisation_of,$$<,$(1)) $(STRICT) -c -o $$@ $$<
endef
$(foreach numeric,float fixed,$(eval $(call BENCH_HOST_RULES,$(numeric))))

# $(call bench_objects,TARGET,NUMERIC,PROGRAM), $(call bench_link,TARGET,NUMERIC): everything but the objects of a link
bench_object = $(addprefix $(BUILD)/object/$(1)-$(2)$(OPT)-$(BENCH_JOINTS)/,$(addsuffix .o,$(basename $(3))))
bench_objects = $(call bench_object,$(1),$(2),$(BENCH_FIRMWARE_$(3)) $(BENCH_SOURCES) $(BENCH_SOURCES_$(HOME_$(1))) tools/bench/$(3).c)
bench_block = $(BUILD)/block/$(1)/$(BENCH_ROBOT).bin
bench_parts = firmware/boards/common/config.S $(call bench_block,$(2)) $(call script_of,$(1))
bench_link = $(BENCH_CC_$(1)) $(BENCH_LINK_$(1)) -DCONFIG_BLOCK='"$(call bench_block,$(2))"' firmware/boards/common/config.S
bench_image = $(BUILD)/bench/$(1)-$(2)$(OPT)-$(3).elf

define BENCH_RULES
$(call bench_image,$(1),$(2),$(3)): $(call bench_objects,$(1),$(2),$(3)) $(call bench_parts,$(1),$(2))
	@mkdir -p $$(@D)
	@echo 'ld $$@'
	@$(call bench_link,$(1),$(2)) $(BENCH_LINK_$(1)_$(3)) -o $$@ $(call bench_objects,$(1),$(2),$(3)) $(BENCH_LIBRARIES_$(1))

-include $(patsubst %.o,%.d,$(call bench_objects,$(1),$(2),$(3)))
endef
# For its size: nothing of the host's own is linked.
BENCH_LINK_host_image := -static -nostdlib -Wl,-e,main
$(foreach target,$(BENCH_ALL),$(foreach numeric,float fixed,$(foreach program,$(BENCH_PROGRAMS),\
    $(eval $(call BENCH_RULES,$(target),$(numeric),$(program))))))

include tools/bench/peers.mk

BASELINE := tools/bench/baseline.json
BENCH_RUNS = $(foreach numeric,$(BENCH_NUMERICS),$(BENCH_TARGETS:%=%:$(numeric)))
BENCH_TOOLS = $(if $(filter $(TARGETS),$(BENCH_TARGETS)),qemu arm) $(if $(filter host,$(BENCH_TARGETS)),valgrind)
# A selection of targets is counted without the peers, which take minutes to compile, unless PEERS=1. They have no fixed.
PEERS := $(if $(filter file,$(origin BENCH_TARGETS)),1)
BENCH_PEERS = $(and $(PEERS),$(filter float,$(BENCH_NUMERICS)))
BENCH_ARGUMENTS := --json out/bench.json --baseline $(BASELINE)

.PHONY: bench bench-images bench-baseline bench-check
bench-images: $(foreach numeric,$(BENCH_NUMERICS),$(foreach target,$(BENCH_TARGETS),$(foreach program,$(BENCH_PROGRAMS),\
    $(call bench_image,$(target),$(numeric),$(program))))) $(if $(BENCH_PEERS),$(call peer_images,$(BENCH_TARGETS)))

bench: ## count instructions, flash, RAM and stack, ours and what one would take instead; out/bench.json
	@tools/toolbox $(BENCH_TOOLS) $(if $(BENCH_PEERS),eigen)
	@$(MAKE) -j $(JOBS) bench-images > /dev/null
	@CC='$(CC)' CROSS='$(CROSS)' $(PYTHON) tools/bench/bench.py --opt=$(OPT) --joints=$(BENCH_JOINTS) --jobs $(JOBS) $(BENCH_ARGUMENTS) $(BENCH_RUNS) \
	    $(if $(BENCH_PEERS),--peers $(call peer_runs,$(BENCH_TARGETS)))

bench-baseline: ## count ours alone, and keep the numbers as what later ones are measured against
	@$(MAKE) bench PEERS= BENCH_ARGUMENTS='--baseline $(BASELINE) --write-baseline'

bench-check: venv ## count ours alone, and compare with what was kept
	@$(PYTEST) tests/target/test_instruction_counts.py
