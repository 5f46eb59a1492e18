# The documentation as a site: build/docs/site/index.html, to be read without a network.
DOCS_STAMP = $(VENV_STAMP)-docs

$(DOCS_STAMP): $(VENV_STAMP)
	@$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --constraint requirements.lock --editable '.[docs]'
	@touch $@

.PHONY: docs
docs: $(DOCS_STAMP) library ## build the documentation: build/docs/site/index.html
	@$(VENV)/bin/python tools/docs/build.py $(BUILD)/docs/source
	@NO_MKDOCS_2_WARNING=1 $(VENV)/bin/mkdocs build --quiet
	@echo "build/docs/site/index.html; for the search: python3 -m http.server -d build/docs/site"
