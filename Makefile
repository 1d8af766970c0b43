PYTHON ?= python3.11
JOBS ?= 2

BIN := .venv/bin
STAMP := .venv/.installed
CORE := .venv/.core
CORE_SOURCES := rodmodel/core/CMakeLists.txt rodmodel/core/_build.py $(wildcard rodmodel/core/src/*.[ch])
PEERS := .venv/.peers

.PHONY: run examples examples-full setup test test-slow lint docs format bench clean

run: setup
	$(BIN)/python examples/01_predict.py

# From what ships: the files with numbers above 00, which make the finite-element points of the figures.
EXAMPLES := $(filter-out examples/00_%,$(wildcard examples/[0-9]*.py))

# Side by side, each one's output in one piece: most of their time is compilation, on one core. The control loop
# may then miss deadlines that it meets alone.
examples: setup
	@$(MAKE) --no-print-directory --jobs $(JOBS) --output-sync=target $(EXAMPLES)

.PHONY: $(EXAMPLES)
$(EXAMPLES):
	@echo "== $@"; $(BIN)/python $@

# The points and frames anew, from the finite elements: an hour or more. They take the place of those that ship once all are
# there; a run that was stopped goes on.
examples-full: setup
	$(BIN)/python examples/00_cell_points.py build/cell_points.json
	$(BIN)/python examples/00_moment_points.py build/moment_points.json
	$(BIN)/python examples/00_actuator_frames.py build
	$(BIN)/python examples/00_twin_points.py build/twin_points.json
	mv build/cell_points.json build/moment_points.json build/twin_points.json build/frames-*.npz examples/data/
	$(MAKE) examples

# gmsh's wheel links against X and GL libraries of the system. Prediction needs none of them, so their absence is
# said and not fatal.
setup: $(STAMP) $(CORE)
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

test: setup
	@$(MAKE) --no-print-directory --jobs $(JOBS) --output-sync=target lint docs
	$(PYTEST)

test-slow: setup
	$(PYTEST) -m slow

lint: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

# A warning is an error.
docs: setup
	$(BIN)/mkdocs build --strict --config-file .ci/mkdocs.yml

format: setup
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# Other solvers to stand beside come with the first run.
bench: $(PEERS)
	@set -e; for script in tests/benchmark/bench_*.py; do \
	  module=$$(echo "$${script%.py}" | tr / .); echo "== $$module"; $(BIN)/python -m "$$module"; \
	done
	$(BIN)/python -m tests.benchmark.page

# Keeps .venv: it takes minutes to fetch and is rebuilt when its pins change. The extension stays with it.
clean:
	rm -rf build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find rodmodel fem_reference calibration tests examples -type d -name __pycache__ -prune -exec rm -rf {} +
