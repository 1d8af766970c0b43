PYTHON ?= python3.11
JOBS ?= 2
# Further arguments of the command behind test-slow and mutants.
ARGS ?=

BIN := .venv/bin
STAMP := .venv/.installed
CORE := .venv/.core
CORE_SOURCES := rodmodel/core/CMakeLists.txt rodmodel/core/_build.py $(wildcard rodmodel/core/src/*.[ch] rodmodel/core/src/*/*.[ch])
PEERS := .venv/.peers

.PHONY: run help setup test test-slow lint docs format coverage mutants hard-cases bench examples examples-full clean

run: setup ## predict one bend, and draw it
	$(BIN)/python examples/01_predict.py

# One line for each target: the comment behind it.
help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-14s %s\n", $$1, $$2 }' Makefile

# From what ships. The finite-element points of the figures are made by `examples-full`.
EXAMPLES := $(wildcard examples/[0-9]*.py)

# Side by side, each one's output in one piece: most of their time is compilation, on one core. The control loop
# may then miss deadlines that it meets alone.
examples: setup ## figures of the paper, from what ships
	@$(MAKE) --no-print-directory --jobs $(JOBS) --output-sync=target $(EXAMPLES)

.PHONY: $(EXAMPLES)
$(EXAMPLES):
	@echo "== $@"; $(BIN)/python $@

# The points and frames anew, from the finite elements: an hour or more. They take the place of those that ship once all are
# there; a run that was stopped goes on.
examples-full: setup ## the same, finite-element points computed anew: an hour or more
	$(BIN)/python examples/points/cell_points.py build/cell_points.json
	$(BIN)/python examples/points/moment_points.py build/moment_points.json
	$(BIN)/python examples/points/actuator_frames.py build
	$(BIN)/python examples/points/twin_points.py build/twin_points.json
	mv build/cell_points.json build/moment_points.json build/twin_points.json build/frames-*.npz examples/data/
	$(MAKE) examples

# gmsh's wheel links against X and GL libraries of the system. Prediction needs none of them, so their absence is
# said and not fatal.
setup: $(STAMP) $(CORE) ## environment in .venv, and the C core
	@$(BIN)/python -c "import gmsh" 2>/dev/null || printf '%s\n' \
	  "gmsh does not load, so rodmodel-fem, rodmodel-calibrate and their tests will not run; rodmodel itself does." \
	  "On Debian or Ubuntu: apt-get install libglu1-mesa libgl1 libxrender1 libxcursor1 libxft2 libxinerama1" >&2

# A line a step; what pip prints is in .venv/setup.log.
$(STAMP): pyproject.toml constraints.txt
	@PYTHON=$(PYTHON) .ci/setup packages
	@touch $@

# Compiles only what has changed.
$(CORE): $(CORE_SOURCES) | $(STAMP)
	@.ci/setup core
	@touch $@

$(PEERS): $(STAMP) | $(CORE)
	@.ci/setup peers
	@touch $@

# A file's tests stay together: what one of them has compiled serves the next.
PYTEST := $(BIN)/python -m pytest -n $(JOBS) --dist loadfile --durations 20

test: setup ## format, lint, types, documentation, fast tests
	@$(MAKE) --no-print-directory --jobs $(JOBS) --output-sync=target lint docs
	$(PYTEST)

test-slow: setup ## the tests of half a minute and more
	$(PYTEST) -m slow $(ARGS)

lint: setup ## format, lint and types, as before each commit
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

docs: setup ## documentation in build/docs; a warning is an error
	$(BIN)/mkdocs build --strict --config-file .ci/mkdocs.yml

format: setup ## format, and lint that mends itself
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# The rod's own tests only: a line that a test of the finite elements happens to reach is not tested by it.
coverage: setup ## lines of rodmodel that its fast tests do not run
	$(PYTEST) --cov --cov-report term-missing:skip-covered --cov-report html tests/unit/rodmodel tests/verification/rodmodel

# All of them take hours; `make mutants ARGS="ridge-law --sample 40"` takes some of one module.
mutants: setup ## faults put into the equations, and which of them the tests find
	$(BIN)/python -m tests.mutation --jobs $(JOBS) $(ARGS)

hard-cases: setup ## iterations, seconds and outcome of the solver's hard cases
	$(BIN)/python -m tests.benchmark.hard_cases

# Other solvers to stand beside come with the first run.
bench: $(PEERS) ## speed against error, beside other solvers
	@set -e; for script in tests/benchmark/bench_*.py; do \
	  module=$$(echo "$${script%.py}" | tr / .); echo "== $$module"; $(BIN)/python -m "$$module"; \
	done
	$(BIN)/python -m tests.benchmark.page

# Keeps .venv: it takes minutes to fetch and is rebuilt when its pins change. The extension stays with it.
clean: ## all that was built, but not .venv
	rm -rf build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find rodmodel fem_reference calibration tests examples -type d -name __pycache__ -prune -exec rm -rf {} +
