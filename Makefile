# Every command a person runs here. `make help` lists them; the recipes that only other recipes call have no "##" line.
MAKEFLAGS += --no-builtin-rules --no-print-directory
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
# Objects stay, or every change would compile all of a program again.
.SECONDARY:
.DEFAULT_GOAL := library

JOBS ?= 2
PYTHON ?= python3
BUILD := build
VENV := .venv

include tools/make/venv.mk
include tools/make/firmware.mk
include tools/make/kernel.mk
include tools/make/unit.mk
include tools/make/linux.mk
include tools/make/check.mk
include tools/make/boards.mk
include tools/make/docs.mk

.PHONY: help demo arms figures campaign-figures fuzz clean

help: ## list the commands
	@sed -nE 's/^([a-z][a-z-]*):.*## (.*)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 24

demo: library venv ## simulate both experiments of the paper against the firmware; results in out/demo
	@$(VENV)/bin/tauperp demo
	@echo 'To have `tauperp` on the PATH: source $(VENV)/bin/activate'

arms: library venv ## both experiments on ten published arms (half an hour; a part of it is in `make test`)
	@TAUPERP_ARMS=all $(VENV)/bin/python -m pytest -q tests/host/test_public_arms.py

# Recordings of a real arm: beside the checkout, or where this variable says.
TAUPERP_PANDA_TOUCHES ?= ../shared/data/panda_touches

figures: demo ## renew README's figures: the demo's, and with the recordings the score's
	@cp out/demo/payload.png docs/figures/payload.png
	@cp out/demo/contact.png docs/figures/contact.png
	@if [ -d "$(TAUPERP_PANDA_TOUCHES)" ]; then \
	    $(VENV)/bin/tauperp score $(TAUPERP_PANDA_TOUCHES)/*.csv.gz --robot panda \
	        && cp out/score/d3.png docs/figures/replay.png; \
	    else echo "docs/figures/replay.png stays: no recordings in $(TAUPERP_PANDA_TOUCHES)"; fi

# Recordings of a real arm in free motion, for the campaign that pushes it.
PANDA_FREE := ../shared/data/panda_free

campaign-figures: kernel venv ## renew README's figures of the campaign and the sensitivity (a few minutes)
	@$(VENV)/bin/tauperp campaign docs/plans/simulated.toml --out out/figures/simulated && cp out/figures/simulated/report.png docs/figures/campaign.png
	@$(VENV)/bin/tauperp sensitivity --config docs/plans/bank.toml --out out/figures/sensitivity && cp out/figures/sensitivity/sensitivity.png docs/figures/sensitivity.png
	@if [ -d "$(PANDA_FREE)" ]; then \
	    $(VENV)/bin/tauperp campaign docs/plans/panda.toml --out out/figures/panda && cp out/figures/panda/report.png docs/figures/campaign_panda.png; \
	    else echo "docs/figures/campaign_panda.png stays: no recordings in $(PANDA_FREE)"; fi

# FRAMES and TARGET choose how long and at what: tools/fuzz --help.
fuzz: venv ## random streams of frames against the guard, by libFuzzer: make fuzz [FRAMES=1e8] [TARGET=guard|block|e2e]
	@tools/toolbox clang19
	@$(VENV)/bin/python tools/fuzz run $(or $(TARGET),guard) --frames $(or $(FRAMES),1e8)

clean: ## remove what was built (build, out); .venv and .toolbox stay
	@rm -rf $(BUILD) out
