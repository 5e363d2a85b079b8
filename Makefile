# Everything lives in .venv; the two commands a stranger needs are `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Containers set it, and then each of thousands of processes compiles the sources anew: half of what its start costs.
unexport PYTHONDONTWRITEBYTECODE
# What `benchbot[full]` brings, and what is installed besides where it is needed: ROS 2 alone is 250 MB.
PLUGINS := scenes assets_household sim_taichi task_semslam task_navigation eval_omq eval_trajectory eval_exploration \
	envs_bear
MORE_PLUGINS := robot_ros2 record_mcap replay record_video record_rerun executor_slurm executor_ray \
	sim_mujoco task_manipulation view baselines envs_thousand
EDITABLE := -e . $(foreach plugin,$(PLUGINS),-e plugins/$(plugin))
EDITABLE_MORE := $(foreach plugin,$(MORE_PLUGINS),-e plugins/$(plugin))
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
FOR_TESTS := $(addprefix $(VENV)/.,interfaces browser slurm engines tmux opengl sdformat postgresql)
SOURCES := benchbot benchbot_addons benchbot_api benchbot_eval tests benchmarks plugins release docs/tools tools conftest.py
# The kernel without robots, servers and solutions; new tests in these folders belong to it by themselves.
QUICK := tests/api tests/cli/kit tests/core tests/evaluation tests/wire $(wildcard tests/plugins/test_*.py) \
	tests/docs/test_blocks.py tests/docs/test_reference.py

.PHONY: help install install-test demo test test-quick coverage lint format bench docs reference release-check clean

help:  ## Say what each target does
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 16

install: $(VENV)/.installed  ## Install BenchBot and its plug-ins into .venv

# At once: Python's packages, and those of the system.
install-test:  ## Install what the tests, linters and benchmarks need, too
	@$(MAKE) --no-print-directory --jobs=2 $(FOR_TESTS)

$(VENV)/.installed: pyproject.toml constraints.txt $(wildcard plugins/*/pyproject.toml)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	# With what builds them installed, no environment is made for each of them; the pip of a new environment is half as
	# fast as the newest.
	$(PIP) pip hatchling editables
	$(PIP) --no-build-isolation $(EDITABLE)
	touch $@

$(VENV)/.installed-test: $(VENV)/.installed requirements-dev.txt
	# Of all these modules the tests import a fraction: each is compiled when it is first imported.
	$(PIP) --no-compile $(EDITABLE_MORE) -r requirements-dev.txt
	touch $@

# Two ROS 2 interface packages that are not on PyPI, built from their definitions; a compiler may have to be installed.
$(VENV)/.interfaces: $(VENV)/.installed-test $(VENV)/.tmux $(shell find plugins/robot_ros2/tests/interfaces -type f)
	$(BIN)/python plugins/robot_ros2/tests/interfaces/build.py -c constraints.txt
	touch $@

# Packages of the system: one after the other, since only one may install.
$(VENV)/.browser: tests/plugins/report/install_chromium.sh
	mkdir -p $(VENV)
	tests/plugins/report/install_chromium.sh
	touch $@

$(VENV)/.slurm: $(VENV)/.browser plugins/executor_slurm/tests/install_slurm.sh
	plugins/executor_slurm/tests/install_slurm.sh
	touch $@

$(VENV)/.engines: $(VENV)/.slurm tests/submission/install_engines.sh
	tests/submission/install_engines.sh
	touch $@

$(VENV)/.tmux: $(VENV)/.engines tests/plugins/tui/install_tmux.sh
	tests/plugins/tui/install_tmux.sh
	touch $@

$(VENV)/.opengl: $(VENV)/.tmux plugins/sim_mujoco/tests/install_opengl.sh
	plugins/sim_mujoco/tests/install_opengl.sh
	touch $@

$(VENV)/.sdformat: $(VENV)/.opengl plugins/scenes/tests/exporting/install_sdf_schema.sh
	plugins/scenes/tests/exporting/install_sdf_schema.sh
	touch $@

$(VENV)/.postgresql: $(VENV)/.sdformat tests/plugins/challenge/install_postgresql.sh
	tests/plugins/challenge/install_postgresql.sh
	touch $@

demo: install  ## Drive a robot through a ray-traced room, map it, score the map
	$(BIN)/benchbot submit --task semantic_slam:passive:ground_truth:segmentation --robot carter --env miniroom:1 \
		--example segmentation_mapper --record frames=demo/frames --results-location demo/result.json --evaluate-with omq
	$(BIN)/benchbot picture demo/result.json --frames demo/frames --output-location demo/picture.png

test: install-test  ## Run every test
	$(BIN)/python -m pytest

test-quick: $(VENV)/.installed-test  ## Run what a small change needs, in a minute
	$(BIN)/python -m pytest -m "not slow" $(QUICK)

coverage: install-test  ## Measure what the tests (or TESTS=...) run of the kernel, line by line and branch by branch
	$(BIN)/coverage erase
	$(BIN)/coverage run -m pytest $(TESTS)
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report

lint: install-test  ## Check style, types, and which room imports which
	$(BIN)/ruff check $(SOURCES)
	$(BIN)/ruff format --check $(SOURCES)
	$(BIN)/lint-imports --no-cache --no-logo
	$(BIN)/mypy

format: install-test  ## Rewrite the sources in the project's style
	$(BIN)/ruff check --fix $(SOURCES)
	$(BIN)/ruff format $(SOURCES)

bench: install-test  ## Measure; prints ratios, asserts nothing
	$(BIN)/python -m benchmarks

docs: $(VENV)/.installed-test  ## Build the documentation's site; broken links are errors
	$(BIN)/python -m docs.tools.site build/docs

reference: $(VENV)/.installed-test  ## Write the pages of docs/reference anew, from the code
	$(BIN)/python -m docs.tools.reference

release-check: install-test  ## Build all distributions into dist; look at them, install and try them on every Python
	$(BIN)/python -m release

clean:  ## Remove what the targets above made
	rm -rf $(VENV) demo build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage .coverage.*
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
