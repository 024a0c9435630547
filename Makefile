# Everything happens in .venv, which the first target you run creates.

# The first of these that is new enough; or say which: make PYTHON=/path/to/python3
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
STAMP := .venv/installed
PYTEST := $(BIN)/python -m pytest -m "not slow" -q -n 2 --dist loadfile

.PHONY: help run renders test check clean

help:
	@echo "make run     open the window; without a display, render the demo scenes into renders/"
	@echo "make renders render the demo scenes in any case"
	@echo "make test    run the tests (a few minutes)"
	@echo "make check   ruff and mypy"
	@echo "make clean   delete .venv, renders and caches"

$(STAMP): pyproject.toml .ci/setup.py
	@test -n "$(PYTHON)" || { echo "ltc-viewer needs Python 3.11 or newer, and there is none on" \
	    "PATH; install one, or name it with: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) .ci/setup.py
	@touch $@

run: $(STAMP)
	@if [ "$$(uname)" = Darwin ] || [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ]; then \
	    $(BIN)/ltc-viewer; \
	else \
	    echo "There is no display here (DISPLAY and WAYLAND_DISPLAY are empty), so the demo scenes"; \
	    echo "are rendered to files. For the window run this on a desktop, or log in with ssh -X."; \
	    $(MAKE) --no-print-directory renders; \
	fi

renders: $(STAMP)
	@mkdir -p renders
	@set -e; for scene in assets/scenes/*.json; do \
	    $(BIN)/ltc-viewer shot "$$scene" --samples 8 \
	        -o "renders/$$(basename "$$scene" .json).png"; \
	done
	@echo "The pictures are in $(CURDIR)/renders"

test: $(STAMP)
	@$(PYTEST) tests

check: $(STAMP)
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

clean:
	rm -rf .venv renders dist build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find app ltc tests -name __pycache__ -prune -exec rm -rf {} +
