# Two commands on a fresh machine with git, make and Python >= 3.11:
#     make demo    fly the quadrotor through models/narrow_passage
#     make test    lint, types, import contract and all tests
# Choose the interpreter with `make PYTHON=/path/to/python3 ...`.

VENV := .venv
BIN := $(VENV)/bin
PYTHON := python3.13 python3.12 python3.11 python3
PIP := $(BIN)/python -m pip --disable-pip-version-check install

.PHONY: help demo test check format bench clean
.DELETE_ON_ERROR:

help:
	@echo "make demo    install and fly the quadrotor through models/narrow_passage"
	@echo "make test    install the development tools, then make check and all tests"
	@echo "make check   the static part: format, lint, types, import contract"
	@echo "make format  reformat the code and apply the safe fixes"
	@echo "make bench   run the benchmarks that the README quotes"
	@echo "make clean   remove runs, caches and builds (the environment $(VENV) stays)"

demo: $(VENV)/installed
	$(BIN)/hzmp-sim run models/narrow_passage/scene.xml --body quadrotor --out runs/demo

test: check
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile

check: $(VENV)/installed-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/pyright
	$(BIN)/lint-imports

format: $(VENV)/installed-dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(VENV)/installed-dev
	$(BIN)/python benchmarks/planner.py
	$(BIN)/python -m benchmarks.trajectories
	$(BIN)/python benchmarks/flights.py
	$(BIN)/python -m benchmarks.sets
	$(BIN)/python benchmarks/bevels.py
	$(BIN)/hzmp-sim bench scale
	$(BIN)/hzmp-sim bench peers
	$(BIN)/hzmp-sim bench paper

clean:
	rm -rf runs build dist .coverage MUJOCO_LOG.TXT
	rm -rf .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -path ./$(VENV) -prune -o -name __pycache__ -type d -exec rm -rf {} +

# The install is editable: only a new pyproject.toml asks for another one.
$(VENV)/installed: pyproject.toml | $(BIN)/pip
	$(PIP) --editable .
	@touch $@

$(VENV)/installed-dev: pyproject.toml | $(BIN)/pip
	$(PIP) --editable '.[dev]'
	@touch $@ $(VENV)/installed

# pip and not python is the target: where ensurepip is missing, venv leaves a python without it.
$(BIN)/pip:
	@for python in $(PYTHON); do \
		command -v "$$python" >/dev/null || continue; \
		"$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || continue; \
		found="$$python"; \
		"$$python" -c 'import ensurepip, venv' 2>/dev/null || continue; \
		echo "$$python -m venv $(VENV)"; \
		exec "$$python" -m venv $(VENV); \
	done; \
	if [ -n "$$found" ]; then \
		echo "$$found cannot make virtual environments: apt install python3-venv" >&2; \
	else \
		echo "hzmp-sim needs Python >= 3.11: none of $(PYTHON) is one" >&2; \
	fi; \
	exit 1
