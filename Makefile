# Nothing but Python 3.11 or later is needed: a virtual environment is made in .venv and reused.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.PHONY: demo test check docs clean

VENV := .venv
BIN := $(VENV)/bin
STAMPS := $(VENV)/stamps
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3.14 python3 python; do \
	"$$p" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && echo "$$p" && break; done)

demo: $(STAMPS)/spem
	$(BIN)/spem demo demo

# Two processes, each with one thread.
test: export OMP_NUM_THREADS = 1
test: export NUMBA_NUM_THREADS = 1
test: $(STAMPS)/test
	$(BIN)/python -m pytest -n 2 --dist worksteal

check: $(STAMPS)/check
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python tools/check_version.py
	$(BIN)/python tools/check_wheel.py

# The site in build/docs; every script of the examples is run, in two processes of one thread.
docs: export OMP_NUM_THREADS = 1
docs: export NUMBA_NUM_THREADS = 1
docs: $(STAMPS)/docs
	$(BIN)/python -m sphinx -n -W --keep-going -q -d build/doctrees docs build/docs
	@echo "build/docs/index.html"

clean:
	rm -rf $(VENV) build dist demo

$(STAMPS)/venv:
	@test -n "$(PYTHON)" || { echo "make: no Python 3.11 or later with venv found; install one, or give PYTHON=/path/to/python3" >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	mkdir -p $(STAMPS)
	touch $@

$(STAMPS)/spem: pyproject.toml $(STAMPS)/venv
	$(BIN)/python -m pip install --quiet -e '.[server]'
	touch $@

$(STAMPS)/test: $(STAMPS)/spem
	$(BIN)/python -m pip install --quiet --group test -e '.[rivals,cluster,server]'
	touch $@

$(STAMPS)/docs: $(STAMPS)/spem
	$(BIN)/python -m pip install --quiet --group docs -e '.[rivals,cluster,server]'
	touch $@

$(STAMPS)/check: $(STAMPS)/spem
	$(BIN)/python -m pip install --quiet --group check -e '.[rivals,cluster,server]'
	touch $@ $(STAMPS)/test $(STAMPS)/docs
