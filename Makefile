# Every command a person runs here. `make help` lists them; the recipes that only other recipes call have no "##" line.
MAKEFLAGS += --no-builtin-rules --no-print-directory
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
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

.PHONY: help demo figures clean

help: ## list the commands
	@sed -nE 's/^([a-z][a-z-]*):.*## (.*)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 24

demo: library venv ## simulate both experiments of the paper against the firmware; results in out/demo
	@$(VENV)/bin/tauperp demo

# Recordings of a real arm: beside the checkout, or where this variable says.
TAUPERP_PANDA_TOUCHES ?= ../shared/data/panda_touches

figures: demo ## renew README's figures: the demo's, and with the recordings the replay's
	@cp out/demo/payload.png docs/figures/payload.png
	@cp out/demo/contact.png docs/figures/contact.png
	@if [ -d "$(TAUPERP_PANDA_TOUCHES)" ]; then \
	    $(VENV)/bin/tauperp replay --csv $(TAUPERP_PANDA_TOUCHES)/*.csv.gz --robot panda \
	        && cp out/replay/d3.png docs/figures/replay.png; \
	    else echo "docs/figures/replay.png stays: no recordings in $(TAUPERP_PANDA_TOUCHES)"; fi

clean: ## remove what was built (build, out); .venv and .toolbox stay
	@rm -rf $(BUILD) out
