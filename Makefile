# Every target sets up what it needs: a virtual environment in .venv with palanquin installed for
# development, rebuilt when the C++ or the packaging changed. Needs git, g++ and Python with venv.
PYTHON ?= python3
VENV := .venv
BUILD := build/release
BIN := $(VENV)/bin
CXX_SOURCES := $(shell find core solvers control sim python/bindings cmake CMakeLists.txt \
	-name '*.cpp' -o -name '*.hpp' -o -name '*.cmake' -o -name '*.in' -o -name CMakeLists.txt 2>/dev/null)
CXX_FILES := $(shell find core solvers control sim tests benchmarks python/bindings \
	-name '*.cpp' -o -name '*.hpp' 2>/dev/null)
FUZZ_RUNS ?= 2000
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(shell nproc)

.DEFAULT_GOAL := help
.PHONY: help build demo test test-cpp test-python bench format lint sanitize sanitize-threads fuzz clean

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-16s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

build: $(VENV)/.installed ## Build everything into .venv

demo: build ## Plan and show two robots that carry a beam: recording, picture and figures in out/
	$(BIN)/palanquin demo trot

test: test-cpp test-python ## Run all tests, C++ and Python

test-cpp: build
	tools/test-cpp $(BUILD) $(BIN)

test-python: build
	$(BIN)/python -m pytest $(PYTEST_ARGUMENTS)

bench: build ## Measure how the rate falls with the horizon, for each solver
	$(BIN)/palanquin bench horizon

format: build ## Rewrite Python and C++ in the house format
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix-only --quiet .
	@$(if $(CXX_FILES),$(BIN)/clang-format -i $(CXX_FILES))

lint: build ## Check format, style and types, and look for faults in C++
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	@$(if $(CXX_FILES),$(BIN)/clang-format --dry-run --Werror $(CXX_FILES))
	tools/check-types $(BIN)
	tools/check-cpp $(BUILD) $(BIN)

sanitize: build ## Run C++ tests and extensions under address and undefined-behaviour sanitizers
	tools/sanitize $(BIN) sanitizers $(SANITIZE_OPTIONS)

sanitize-threads: build ## Run what has threads under the thread sanitizer
	tools/sanitize $(BIN) thread-sanitizer

fuzz: build ## Feed the readers of files with mutations of good ones
	tools/fuzz $(BIN) $(FUZZ_RUNS)

clean: ## Remove the environment, the build and the outputs
	rm -rf $(VENV) build out

# The environment, in two steps so that an edited C++ file costs a rebuild and nothing else: first
# what the project is built with, then the project itself.
$(VENV)/.created: pyproject.toml tools/create-venv
	@echo 'Setting up $(VENV)'
	@tools/create-venv $(PYTHON) $(VENV)
	@touch $@

$(VENV)/.installed: $(VENV)/.created $(CXX_SOURCES)
	@echo 'Building palanquin into $(VENV): some minutes the first time'
	@PATH="$(abspath $(BIN)):$$PATH" $(BIN)/pip install --quiet --no-build-isolation \
		--editable '.[viz,dev]'
	@touch $@
