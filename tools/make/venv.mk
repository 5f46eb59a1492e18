# The Python environment of the checkout: .venv with the host package (editable), its pinned dependencies and the tools that check it.
# The stamp's name holds where the checkout lies, because a venv does not survive being moved.
VENV_STAMP := $(VENV)/installed-$(shell pwd -P | cksum | cut -d ' ' -f 1)

.PHONY: venv

venv: $(VENV_STAMP) ## install the host package and its tools into .venv, once

$(VENV_STAMP): pyproject.toml requirements.lock firmware/guard/version.h
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	    || { echo "$(PYTHON) is missing or older than 3.11: install Python 3.11 or newer, or name one: make PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	    || { echo "$(PYTHON) has no venv module: apt-get install python3-venv" >&2; exit 1; }
	@echo "installing the host package into $(VENV) (once; about a minute)"
	@[ -e $@ ] && $(VENV)/bin/python -c '' 2>/dev/null || $(PYTHON) -m venv --clear $(VENV)
	@$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --constraint requirements.lock --editable '.[dev]'
	@touch $@
