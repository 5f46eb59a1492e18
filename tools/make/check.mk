# The gates: what must hold of the checkout. tools/gates runs them to the end and counts.
FORMATTED_C = $(filter-out firmware/wire/generated/% firmware/api/names.h firmware/robots/%,\
    $(wildcard host/kernel/*.[ch] firmware/*/*.[ch] firmware/boards/*/*.[ch] firmware/hosts/*/*.[ch] firmware/examples/*/*.[ch] tests/*/*.[ch] tests/*/*/*.[ch] tools/*/*.[ch] tools/*/*.cpp))
PYTHON_SOURCES = host $(wildcard tests tools/*/*.py) $(shell grep -lsE '^\#!.*python' tools/*)
CLANG ?= clang

.PHONY: test host-test bus-test test-target lint lint-gcc lint-clang lint-format lint-python lint-types format generate generate-check

# As root, install first what the tests use (once); as a user, each gate says what it could not run.
TEST_TOOLS := can clang osmesa arm qemu valgrind

test: ## every check this machine can run; ends with "N passed, N failed"
	@if [ "$$(id -u)" = 0 ]; then for tool in $(TEST_TOOLS); do tools/toolbox $$tool || true; done; fi
	@tools/gates test lint generate-check $(NUMERICS:%=unit-%) host-test \
	    $(if $(wildcard tests/bus/test_*.py),bus-test) $(if $(wildcard tests/target/test_*.py),test-target) bench-check

# run_pytest GATE, FOLDER, the command to run it in
run_pytest = $(3) $(VENV)/bin/python -m pytest -q --junitxml=$(BUILD)/results/$(1).xml $(2)
skip = mkdir -p $(BUILD)/results && echo "skipped $(2)" >$(BUILD)/results/$(1)

host-test: library library-fixed kernel venv ## tests of the host package, and of the firmware through it (pytest)
	@if [ -z "$(wildcard tests/host/test_*.py)" ]; then $(call skip,$@,there are no tests in tests/host); \
	    else $(call run_pytest,$@,-n $(JOBS) tests/host); fi

# By the clock, on a machine that others use as well: what fails gets a second attempt, which is reported (RERUN).
AGAIN := --reruns 1 -rR

bus-test: library venv ## tests on a real vcan0 (this kernel's or User-Mode Linux's)
	@if ! tools/vcan true; then $(call skip,$@,the bus tests: no vcan0 to be had here); \
	    else $(call run_pytest,$@,$(AGAIN) tests/bus,tools/vcan); fi

test-target: ## tests of the firmware on emulated controllers (QEMU)
	@tools/gates test-target target-programs target-bus

# What needs no bus runs beside each other; the experiments run where vcan0 is.
TARGET_BUS_TESTS := tests/target/test_versal_lockstep.py

target-programs: library library-fixed venv
	@if ! tools/toolbox qemu arm; then $(call skip,$@,the target tests: no emulator or ARM compiler); \
	    else $(MAKE) -k -j $(JOBS) unit-images counting-images >/dev/null; $(call run_pytest,$@,-n $(JOBS) $(filter-out $(TARGET_BUS_TESTS),$(wildcard tests/target/test_*.py))); fi

target-bus: library library-fixed venv
	@if ! tools/toolbox qemu arm; then $(call skip,$@,the experiments on the target: no emulator or ARM compiler); \
	    elif ! tools/vcan true; then $(call skip,$@,the experiments on the target: no vcan0 to be had here); \
	    else $(call run_pytest,$@,$(TARGET_BUS_TESTS),tools/vcan); fi

lint: ## strict builds by gcc and clang, formatting, ruff, mypy
	@tools/gates lint lint-gcc lint-clang lint-format lint-python lint-types

# Every C file that a host compiler can build, with every warning an error.
STRICT_SOURCES = $(LIBRARY_SOURCES) $(wildcard firmware/hosts/linux/*.c firmware/examples/controller/*.c) $(KERNEL_SOURCES)
define STRICT_RULES
STRICT_OBJECTS_$(1) = $$(foreach numeric,$(NUMERICS),$$(STRICT_SOURCES:%.c=$(BUILD)/object/lint-$(1)-$$(numeric)/%.o))
-include $$(STRICT_OBJECTS_$(1):.o=.d)
endef
define STRICT_OBJECT_RULES
$(BUILD)/object/lint-$(1)-$(3)/%.o: %.c tools/make/firmware.mk tools/make/check.mk | $(VENV_STAMP)
	@mkdir -p $$(@D)
	@$(2) $$(CFLAGS_ALL) $(FLAGS_$(3)) -O2 $(LIBRARY_INCLUDES) -Ihost/kernel -isystem $$(MUJOCO_INCLUDE) $(STRICT) -c -o $$@ $$<
endef
$(foreach compiler,gcc clang,$(eval $(call STRICT_RULES,$(compiler))))
$(foreach numeric,float fixed,$(eval $(call STRICT_OBJECT_RULES,gcc,gcc,$(numeric)))\
                              $(eval $(call STRICT_OBJECT_RULES,clang,$(CLANG),$(numeric))))

.PHONY: strict-gcc strict-clang
strict-gcc: $(STRICT_OBJECTS_gcc)
strict-clang: $(STRICT_OBJECTS_clang)

lint-gcc: venv
	@$(MAKE) -k -j $(JOBS) strict-gcc

lint-clang: venv
	@if ! command -v $(CLANG) >/dev/null && ! tools/toolbox clang; then $(call skip,$@,the strict build by clang: no clang); \
	    else $(MAKE) -k -j $(JOBS) strict-clang; fi

lint-format: venv
	@$(VENV)/bin/clang-format --dry-run -Werror $(FORMATTED_C)
	@$(VENV)/bin/ruff format --quiet --diff $(PYTHON_SOURCES)

lint-python: venv
	@$(VENV)/bin/ruff check --quiet $(PYTHON_SOURCES)
	@$(VENV)/bin/python tools/prose

lint-types: venv
	@$(VENV)/bin/mypy --no-error-summary

format: venv ## format C and Python in place
	@$(VENV)/bin/clang-format -i $(FORMATTED_C)
	@$(VENV)/bin/ruff format --quiet $(PYTHON_SOURCES)
	@$(VENV)/bin/ruff check --quiet --fix --select I $(PYTHON_SOURCES)

# Generated C: written from the DBC and from the robots' descriptions, committed, never edited.
GENERATORS = $(wildcard tools/dbc2c tools/robot2c tools/names2c)

generate: venv ## write the generated C (DBC codec, robot tables, names)
	@for generator in $(GENERATORS); do $(VENV)/bin/python $$generator; done

generate-check: venv ## are the committed generated files current?
	@tools/gates generate-check $(GENERATORS:tools/%=current-%)

$(GENERATORS:tools/%=current-%): current-%: venv
	@$(VENV)/bin/python tools/$* --check
