VENV := .venv
PYTHON ?= python3
BIN := $(VENV)/bin
PICTURES := a3-sources a5=a5-length,a5-book,a5-roughness,a5-thickness afig3=afig3-std,afig3-imus,afig3-common afig6-tracks \
	afig7=afig7-gyro,afig7-accelerometer afig8-errors bfig7-9=bfig7,bfig8,bfig9 bfig10 split-imus

.PHONY: demo test test-long test-oldest lint types bench live-flood reproduce pictures clean

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

# What simulates for minutes.
test-long: $(BIN)/pytest
	$(BIN)/pytest --numprocesses 2 --dist worksteal -m long

# The kernels and the reference filters with the oldest Numba that pyproject.toml allows.
test-oldest: build/oldest/bin/pytest
	build/oldest/bin/polyins warmup
	build/oldest/bin/pytest tests/kernels tests/navigate/test_engine.py tests/navigate/test_reference_filter.py \
		tests/navigate/test_reference_wheels.py tests/navigate/test_sensors_reference.py

build/oldest/bin/pytest: pyproject.toml
	$(PYTHON) -m venv build/oldest
	build/oldest/bin/python -m pip install --quiet --editable '.[test]' "numba==$$(sed -n 's/.*"numba>=\(.*\)".*/\1/p' pyproject.toml)"
	touch $@

lint: $(BIN)/pytest
	$(BIN)/ruff check src tests
	$(BIN)/ruff format --check src tests

types: $(BIN)/pytest
	$(BIN)/mypy

reproduce: $(BIN)/polyins
	$(BIN)/polyins reproduce all --quick --out build/reproduced >/dev/null
	tools/complete build/reproduced/all.json

# The documentation's pictures, from the full runs of the targets that draw; needs chromium.
pictures: $(BIN)/polyins
	$(BIN)/polyins reproduce figures --out build/figures >/dev/null
	tools/photograph build/figures docs/pictures $(PICTURES)

bench: $(BIN)/polyins
	$(BIN)/polyins bench

live-flood: $(BIN)/polyins
	$(BIN)/python benchmarks/live_flood.py

clean:
	rm -rf $(VENV) build dist .mypy_cache .pytest_cache .ruff_cache
