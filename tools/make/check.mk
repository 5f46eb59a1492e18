# What must hold of the checkout.
FORMATTED_C = $(filter-out firmware/wire/generated/% firmware/api/names.h firmware/robots/%,\
    $(wildcard host/kernel/*.[ch] firmware/*/*.[ch] firmware/boards/*/*.[ch] firmware/hosts/*/*.[ch] firmware/examples/*/*.[ch] tests/*/*.[ch] tests/*/*/*.[ch] tools/*/*.[ch] tools/*/*.cpp))
PYTHON_SOURCES = host $(wildcard tests tools/*/*.py) $(shell grep -lsE '^\#!.*python' tools/*)
CLANG ?= clang

.PHONY: test quick unit host-test bus-test test-target lint lint-gcc lint-clang lint-format lint-python lint-types format generate generate-check

# pytest is the one runner. ARGS adds options of its own: make test ARGS="-k bank"
PYTEST = $(VENV)/bin/python -m pytest -q -n $(JOBS) $(ARGS)
# As root, install first what the tests use (once); as a user, each test that lacks a tool says so in one line.
TEST_TOOLS := can clang clang19 osmesa arm qemu valgrind
# Everything that tests run, built side by side. What does not build fails the tests of it, which say why.
PREPARED = library library-fixed $(NUMERICS:%=unit-programs-%) guard guard-sanitized $(BUILD)/bus-peer $(BUILD)/bus-soak $(BUILD)/controller
PREPARED_TARGET = unit-images counting-images bench-images PEERS=
prepare = $(MAKE) -k -j $(JOBS) $(1) >$(BUILD)/prepare.log 2>&1 || true

test: venv library library-fixed kernel ## every check this machine can run; the closing line is pytest's
	@if [ "$$(id -u)" = 0 ]; then for tool in $(TEST_TOOLS); do tools/toolbox $$tool || true; done; fi
	@$(call prepare,$(PREPARED) $$(tools/toolbox arm 2>/dev/null && echo $(PREPARED_TARGET)))
	@$(PYTEST) --junitxml=$(BUILD)/results/test.xml

quick: venv library library-fixed kernel ## the tests that need no privileges, no network and less than a minute
	@$(PYTEST) -m quick

host-test: venv library library-fixed kernel ## tests of the host package, and of the firmware through it
	@$(PYTEST) tests/host

unit: venv ## unit tests of the firmware (Unity, under sanitizers)
	@$(PYTEST) tests/unit

bus-test: venv library library-fixed ## tests on a real vcan0 (this kernel's or User-Mode Linux's)
	@$(PYTEST) -m bus

test-target: venv library library-fixed ## tests of the firmware on emulated controllers (QEMU)
	@$(PYTEST) -m target

lint: venv ## strict builds by gcc and clang, formatting, ruff, mypy
	@$(PYTEST) tests/gates -k lint

# Every C file that a host compiler can build, with every warning an error. Every build for the host by gcc is strict.
STRICT_SOURCES = $(LIBRARY_SOURCES) $(wildcard firmware/hosts/linux/*.c firmware/examples/*/*.c) $(KERNEL_SOURCES)
define STRICT_RULES
STRICT_OBJECTS_$(1) = $$(foreach numeric,$(NUMERICS),$$(STRICT_SOURCES:%.c=$(BUILD)/object/lint-$(1)-$$(numeric)/%.o))
-include $$(STRICT_OBJECTS_$(1):.o=.d)
endef
define STRICT_OBJECT_RULES
$(BUILD)/object/lint-$(1)-$(3)/%.o: %.c tools/make/firmware.mk tools/make/check.mk | $(VENV_STAMP) $(BUILD)/build_id.h
	@mkdir -p $$(@D)
	@$(2) $$(INCLUDE_FIRST) $$(CFLAGS_ALL) $(FLAGS_$(3)) -O2 $(LIBRARY_INCLUDES) -Ihost/kernel -isystem $$(MUJOCO_INCLUDE) $(STRICT) -c -o $$@ $$<
endef
$(eval $(call STRICT_RULES,clang))
$(foreach numeric,float fixed,$(eval $(call STRICT_OBJECT_RULES,clang,$(CLANG),$(numeric))))

# The smallest example sees the public header, which has the name of the host library's.
$(BUILD)/object/lint-clang-%/firmware/examples/minimal/minimal.o: INCLUDE_FIRST := -Ifirmware/api

.PHONY: strict-clang
strict-clang: $(STRICT_OBJECTS_clang)

lint-gcc: venv
	@$(MAKE) -k -j $(JOBS) CC=gcc library library-fixed kernel guard guard-fixed $(BUILD)/controller

lint-clang: venv
	@tools/toolbox clang
	@$(MAKE) -k -j $(JOBS) strict-clang

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

generate-check: $(GENERATORS:tools/%=current-%) ## are the committed generated files current?

$(GENERATORS:tools/%=current-%): current-%: venv
	@$(VENV)/bin/python tools/$* --check
