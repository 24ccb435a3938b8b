# `make chart` and `make test` do their own set-up: they need Python 3.11 or newer, and make.

PYTHON ?= python3
VENV := .venv
# Of the order of the tests, which is random; that of `make verify` is another every time.
SEED ?= 2690478429
BIN := $(VENV)/bin
# Files begin in the order of the tests, the long ones first; xdist would keep those of few tests for the end.
PYTEST := $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

.PHONY: chart test verify lint clean

chart: $(VENV)/installed
	$(BIN)/elastica run catalogs/first-chart.toml -o first-chart.nc
	$(BIN)/elastica plot first-chart.nc -o first-chart.png

test: lint
	$(PYTEST) --randomly-seed=$(SEED)

verify: lint
	$(PYTEST) --full

lint: $(VENV)/test-installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy elastica studies

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/test-installed: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	touch $@

clean:
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis first-chart.nc first-chart.png
