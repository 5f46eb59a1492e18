# Instruction counts: one image a target, numeric type and program, run in QEMU.
BENCH_ROBOT := ku_dex
BENCH_PROGRAMS := stages guard image
BENCH_SOURCES := tools/bench/states.c tools/bench/report.c firmware/boards/common/semihosting.c firmware/boards/common/memory.c
BENCH_FIRMWARE_stages = $(wildcard firmware/core/*.c)
BENCH_FIRMWARE_guard = $(FIRMWARE_SOURCES) tools/bench/cycle.c
BENCH_FIRMWARE_image = $(FIRMWARE_SOURCES)
BENCH_NUMERICS ?= float fixed
BENCH_SOURCES_cortex_m := $(wildcard firmware/boards/cortex_m/*.c)
BENCH_SOURCES_versal_r5 := $(HOME_SOURCES_versal_r5) $(addprefix firmware/boards/versal_r5/,pmu.c counter.c)

# $(call bench_image,TARGET,NUMERIC,PROGRAM)
bench_image = $(BUILD)/bench/$(1)-$(2)$(OPT)-$(3).elf

define BENCH_RULES
BENCH_OBJECTS_$(1)_$(2)_$(3) := $$(addprefix $(BUILD)/object/$(1)-$(2)$(OPT)/,$$(addsuffix .o,$$(basename \
    $$(BENCH_FIRMWARE_$(3)) $$(BENCH_SOURCES) $$(BENCH_SOURCES_$(HOME_$(1))) tools/bench/$(3).c)))

$(call bench_image,$(1),$(2),$(3)): $$(BENCH_OBJECTS_$(1)_$(2)_$(3)) firmware/boards/common/config.S \
    $(BUILD)/block/$(2)/$(BENCH_ROBOT).bin $(wildcard firmware/boards/$(HOME_$(1))/*.ld)
	@mkdir -p $$(@D)
	@echo 'ld $$@'
	@$(CROSS)gcc $(CPU_$(1)) $(LDFLAGS_TARGET) -T firmware/boards/$(HOME_$(1))/$(HOME_$(1)).ld \
	    -DCONFIG_BLOCK='"$(BUILD)/block/$(2)/$(BENCH_ROBOT).bin"' -o $$@ \
	    $$(BENCH_OBJECTS_$(1)_$(2)_$(3)) firmware/boards/common/config.S -Wl,--start-group -lc -lm -lgcc -Wl,--end-group

-include $$(wildcard $$(BENCH_OBJECTS_$(1)_$(2)_$(3):.o=.d))
endef
$(foreach target,$(TARGETS),$(foreach numeric,float fixed,$(foreach program,$(BENCH_PROGRAMS),\
    $(eval $(call BENCH_RULES,$(target),$(numeric),$(program))))))

BENCH_TARGETS ?= $(TARGETS)
BASELINE ?= tools/bench/baseline.json
BENCH_RUNS = $(foreach numeric,$(BENCH_NUMERICS),$(BENCH_TARGETS:%=%:$(numeric)))

BASELINE ?= tools/bench/baseline.json
BENCH_WRITE :=

.PHONY: bench bench-images bench-baseline
bench-images: $(foreach numeric,$(BENCH_NUMERICS),$(foreach target,$(BENCH_TARGETS),$(foreach program,$(BENCH_PROGRAMS),\
    $(call bench_image,$(target),$(numeric),$(program)))))

bench: ## count instructions, flash, RAM and stack on emulated controllers; out/bench.json
	@$(MAKE) -j $(JOBS) bench-images > /dev/null
	@$(PYTHON) tools/bench/bench.py --opt=$(OPT) --json out/bench.json --baseline $(BASELINE) $(BENCH_WRITE) $(BENCH_RUNS)

bench-baseline: ## the same, and keep the numbers as what later ones are measured against
	@$(MAKE) bench BENCH_WRITE=--write-baseline
