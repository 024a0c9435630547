# Everything happens in .venv, which the first target you run creates.

PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/installed
PYTEST := $(BIN)/python -m pytest -m "not slow" -q -n 2 --dist loadfile

.PHONY: help run renders test check clean

help:
	@echo "make run     open the window; without a display, render the demo scenes into renders/"
	@echo "make test    run the tests (a few minutes)"
	@echo "make check   ruff and mypy"
	@echo "make clean   delete .venv, renders and caches"

$(STAMP): pyproject.toml .ci/setup.py
	@$(PYTHON) .ci/setup.py
	@touch $@

run: $(STAMP)
	@if [ "$$(uname)" = Darwin ] || [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ]; \
	then $(BIN)/ltc-viewer; \
	else $(MAKE) --no-print-directory renders; fi

renders: $(STAMP)
	@mkdir -p renders
	@set -e; for scene in assets/scenes/*.json; do \
	    picture=renders/$$(basename "$$scene" .json).png; \
	    echo "$$picture"; \
	    $(BIN)/ltc-viewer shot "$$scene" -o "$$picture" --samples 8 >/dev/null; \
	done
	@echo "The demo scenes are in $(CURDIR)/renders. There is no display here (DISPLAY and"
	@echo "WAYLAND_DISPLAY are empty); for the window type 'make run' on a desktop, or log in"
	@echo "with 'ssh -X'."

test: $(STAMP)
	@$(PYTEST) tests

check: $(STAMP)
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

clean:
	rm -rf .venv renders dist build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find app ltc tests -name __pycache__ -prune -exec rm -rf {} +
