# Two commands on a fresh machine with Python 3.11: `make demo` and `make test`.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
# Branch coverage is a promise for the wire and the dispatcher; tracing everything costs a minute.
COVERED := --cov=shearline.protocol --cov=shearline.learner.dispatcher

.PHONY: help demo test lint types quick chaos fuzz bench clean

help:  ## say what can be made
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

# The stamp is younger than what decides the install, so that a second `make` costs nothing.
$(INSTALLED): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "Shearline needs Python 3.11 or newer, found $$($(PYTHON) --version): set PYTHON=python3.11" >&2; exit 2; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || { \
	  echo "python's venv module is missing: install it (Debian: python3-venv)" >&2; exit 2; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt pip
	PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --disable-pip-version-check \
	  --editable '.[all]' --group dev
	@PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --disable-pip-version-check \
	  --only-binary franky-control,panda-python franky-control panda-python || \
	  echo "the robots' client libraries have no wheel for this machine: their tests skip" >&2
	@touch $@

demo: $(INSTALLED)  ## install, learn the key-in-lock with two MuJoCo evaluators, say how to replay
	$(BIN)/shearline up --task keylock --evaluators 2 --episodes 10 --trials 20 --seed 0

test: $(INSTALLED) lint types  ## everything CI checks
	$(BIN)/python -m pytest -m "not slow and not chaos and not bench and not long" \
	  -n 2 --dist worksteal -q $(COVERED) --cov-report=term --cov-fail-under=95
	$(BIN)/python -m pytest -m "(slow or chaos or bench) and not long" -q

lint: $(INSTALLED)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(INSTALLED)
	$(BIN)/mypy

quick: $(INSTALLED)  ## the quick suite alone
	$(BIN)/python -m pytest -m "not slow and not chaos and not bench" -n 2 --dist worksteal -q

chaos: $(INSTALLED)  ## hurt real processes for minutes, and print what it cost (docs/chaos.md)
	$(BIN)/python -m pytest tests/chaos -m long -p no:randomly -s

fuzz: $(INSTALLED)  ## spoil a million messages; none may do harm (docs/dispatcher.md)
	PYTHONPATH=tests $(BIN)/python -m simulation.fuzz 1000000

bench: $(INSTALLED)  ## side by side with the physical limit
	$(BIN)/shearline bench sim
	$(BIN)/shearline bench learner
	$(BIN)/shearline bench transport

clean:  ## remove what was built; runs stay
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage* build dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
