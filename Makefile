# Every command of the project (`make help`). CMake builds, by tools/build; scripts read BOARD, ROBOT and so on from the environment.
MAKEFLAGS += --no-builtin-rules --no-print-directory
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
export JOBS ?= 2
VENV ?= .venv
PYTEST = env -u PYTHONDONTWRITEBYTECODE $(VENV)/bin/python -m pytest -q -n $${WORKERS:-$(JOBS)} $(ARGS)
BUILT := library library-fixed kernel guard guard-fixed guard-sanitized strict-clang unit-programs
IMAGES := unit-images counting-images bench-images
# All programs for the tests. A program that does not build fails its own tests with the reason.
PREPARED := $(BUILT) build/bus-peer build/bus-soak build/controller
LINTS := lint-gcc lint-clang lint-format lint-python lint-types lint-misra lint-tidy $(patsubst tools/%,current-%,$(wildcard tools/*2c))
.PHONY: help venv demo arms figures campaign-figures $(BUILT) $(IMAGES) firmware flash bench bench-baseline bench-check bench-can \
    docs test quick host-test unit bus-test test-target lint $(LINTS) format generate generate-check coverage misra tidy fuzz prove mutants faults evidence clean FORCE
library: ## build the firmware for the host: build/libtauperp.so
help: ## list the commands
	@sed -nE 's/^([a-z][a-z-]*):.*## (.*)/  make \1\t\2/p' Makefile | expand -t 24
venv: ## install the host package and its tools into .venv, once
	@tools/venv
demo: library venv ## simulate both experiments of the paper against the firmware; results in out/demo
	@$(VENV)/bin/tauperp demo
	@echo 'To have `tauperp` on the PATH: source $(VENV)/bin/activate'
arms: library venv ## run both experiments on ten published arms (one line each, two minutes; `make test` runs a part)
	@TAUPERP_ARMS=all $(VENV)/bin/python -m pytest -q -k fitted tests/host/test_public_arms.py
figures: demo ## renew README's figures of the demo, and with the recordings those of the score
campaign-figures: kernel ## renew README's figures of the campaign and the sensitivity (a few minutes)
figures campaign-figures: venv
	@tools/figures $@
library-fixed: ## build the library in fixed point: build/fixed/libtauperp.so
kernel: venv ## build the kernel of `tauperp campaign`
guard: ## build the guard as a SocketCAN process: build/tauperp-guard
strict-clang bench-images: venv
$(BUILT) $(IMAGES):
	@tools/build $@
build/% unit-programs-% unit-images-% counting-images-% bench-images-% firmware-objects-%: FORCE
	@tools/build $@
firmware: venv ## build an image: make firmware BOARD=versal_r5|stm32g4 ROBOT=ku_dex [CONFIG=file.toml] [NUMERIC=fixed]
	@$(VENV)/bin/python tools/firmware
flash: venv ## write an image to a connected board: make flash BOARD=stm32g4 (openocd or st-flash)
	@$(VENV)/bin/python tools/firmware --flash
bench: ## count instructions, flash, RAM and stack of our code and of alternatives; out/bench.json
bench-baseline: ## count our code alone, and keep the numbers as the baseline
bench bench-baseline: venv; @tools/bench/run $@
bench-check: venv ## count our code alone, and compare with the baseline
	@$(PYTEST) tests/target/test_instruction_counts.py
bench-can: guard build/bus-peer build/bus-soak library venv ## measure the load that the guard's process sustains on vcan; out/bus/bench.json
	@tools/vcan $(VENV)/bin/python tools/bench-can $(ARGUMENTS)
docs: library; @tools/docs/build ## build the documentation: build/docs/site/index.html
test: venv library library-fixed kernel ## run every test that this machine can run
	@if [ "$$(id -u)" = 0 ]; then for tool in can cbmc clang clang19 osmesa arm qemu valgrind; do tools/toolbox $$tool || true; done; fi
	@tools/build -k $(PREPARED) $$(tools/toolbox arm 2>/dev/null && echo $(IMAGES)) >build/prepare.log 2>&1 || true
	@WORKERS=$$(($(JOBS) + 2)); $(PYTEST) --junitxml=build/results/test.xml
quick: SELECT = -m quick ## run the tests that need no privileges and no network, in less than a minute
host-test: SELECT = tests/host ## run the tests of the host package, and of the firmware through it
unit: SELECT = tests/unit ## run the unit tests of the firmware (Unity, under sanitizers)
bus-test: SELECT = -m bus ## run the tests on a real vcan0 (of this kernel or of User-Mode Linux)
test-target: SELECT = -m target ## run the tests of the firmware on emulated controllers (QEMU)
lint: SELECT = tests/gates -k lint ## check strict builds by gcc and clang, formatting, ruff, mypy
quick host-test unit bus-test test-target lint: venv library library-fixed kernel
	@$(PYTEST) $(SELECT)
format: ## format C and Python in place
generate: ## write the generated C (DBC codec, robot tables, names)
generate-check: ## check that the committed generated files are current
$(LINTS) format generate generate-check: venv
	@tools/lint $@
coverage: ## measure which lines, branches and conditions (MC/DC) of the firmware its unit tests reach; out/coverage/report.md
misra: ## check MISRA C:2012 with Cppcheck; docs/safety/misra.md explains each deviation
tidy: ## check the firmware with clang-tidy; .clang-tidy explains each check that is off
fuzz: venv ## feed random streams of frames to the guard, with libFuzzer: make fuzz [FRAMES=1e8] [TARGET=guard|block|e2e]
	@tools/toolbox clang19 && $(VENV)/bin/python tools/fuzz run $(or $(TARGET),guard) --frames $(or $(FRAMES),1e8)
prove: venv ## prove properties of the fixed-point firmware with CBMC, every harness (docs/safety/proofs.md)
	@$(VENV)/bin/python tools/prove --jobs $(JOBS) $(ARGUMENTS)
mutants: venv ## check that a unit test fails for each changed operator, constant and condition [FILES="wire guard/snapshot"]
	@$(VENV)/bin/python tools/mutate/mutate.py $(FILES)
faults: build/faults library ## inject a million seeded faults into the guard and the stm32g4 image: out/faults/report.json (ARGUMENTS="--channels 1")
evidence: ## run every check and write its numbers onto one page: out/evidence/index.md (under an hour)
coverage misra tidy faults evidence: venv
	@$(VENV)/bin/python tools/$@/$@.py $(ARGUMENTS)
clean:; @rm -rf build out ## remove build and out; .venv and .toolbox stay
