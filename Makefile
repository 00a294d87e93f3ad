# Two commands set everything up: `make demo` and `make test`. Both make their own virtual environment.
PYTHON ?= python3
VENV   ?= .venv
BIN     = $(VENV)/bin

# One more than there are cores: a fifth of the tests mostly wait, for a port, a broker, a timeout.
WORKERS ?= $(shell $(PYTHON) -c 'import os; print((os.cpu_count() or 1) + 1)')

# Many processes of ours begin in the tests: what one of them compiled, the next need not.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test lint docs bench faults pictures clean

demo: $(VENV)/.demo
	$(BIN)/sniff485 demo $(ARGS)

test: $(VENV)/.test
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal $(ARGS)

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The documentation, into build/site; read it there, no server and no network needed.
docs: $(VENV)/.docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet -f docs/mkdocs.yml

# Paired with tshark where that can do the same; FRAMES=1000000 for captures of a million frames instead of 100000.
# `make bench ARGS=tests/bench/test_bulk_commands.py` prints the table of whole commands alone.
bench: $(VENV)/.test
	$(BIN)/python -m pytest tests/bench -o norecursedirs=.venv -o testpaths=tests/bench --benchmark-only --benchmark-group-by=group $(ARGS)

# Every injected fault with three seeds, and an hour of every clean bus, on all cores; takes a while. ARGS: words of
# names of cases; --clean-minutes N; --jobs N; --seeds N; --tell.
faults: $(VENV)/.test
	$(BIN)/python -m tests.faults.matrix $(ARGS)

# Every screen of every protocol, dark and light, small and large, to be looked at. ARGS: words of their names.
pictures: $(VENV)/.test
	$(BIN)/python -m tests.sniff.tui.all_screens /tmp/sniff485-pictures $(ARGS)

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

$(VENV)/.demo: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	touch $@

$(VENV)/.docs: pyproject.toml $(VENV)/.test
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	touch $@

$(VENV)/.test: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	touch $@ $(VENV)/.demo
