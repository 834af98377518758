VENV := .venv
PYTHON ?= python3
BIN := $(VENV)/bin

.PHONY: demo test lint types bench clean

$(BIN)/polyins: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(BIN)/pytest: $(BIN)/polyins
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	touch $@

demo: $(BIN)/polyins
	$(BIN)/polyins demo

test: $(BIN)/pytest
	$(BIN)/pytest --numprocesses 2 --dist worksteal

lint: $(BIN)/pytest
	$(BIN)/ruff check src tests
	$(BIN)/ruff format --check src tests

types: $(BIN)/pytest
	$(BIN)/mypy

bench: $(BIN)/polyins
	$(BIN)/polyins bench

clean:
	rm -rf $(VENV) build dist .mypy_cache .pytest_cache .ruff_cache
