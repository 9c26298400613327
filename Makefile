# Everything a person types here. A fresh machine needs Python 3.11 or newer, git, make and a way to a package index.

PYTHON ?= $(or $(shell command -v python3.11),python3)
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
ARGS ?=

.DEFAULT_GOAL := help
.PHONY: help setup run demo campaign test test-clients format paper control-report fuzz soak bench lock clean

help: ## list these commands
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-14s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(INSTALLED) ## create .venv, install the pinned packages and ourselves, compile the numeric core
	@$(BIN)/python -m sitl.warm

$(INSTALLED): pyproject.toml requirements.lock $(wildcard setup.py)
	@$(PYTHON) -c 'import sys; v = sys.version_info; v >= (3, 11) or sys.exit("make: $(PYTHON) is Python %d.%d; 3.11 or newer is needed: make PYTHON=python3.11" % v[:2])'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

run: setup ## start the vehicle; ARGS="..." are its options, ARGS=--help lists them
	$(BIN)/tiltwing-sitl --rerun web $(ARGS)

demo: setup ## fly a whole mission by itself; leaves recording and report in build/demo; ARGS="--rerun web" shows it
	$(BIN)/python -m sitl.demo $(ARGS)

campaign: setup ## fly 300 missions in random winds with aircraft that differ; page and JSON in build/campaign
	$(BIN)/python -m sitl.campaign $(ARGS)

test: setup ## all checks: ruff, pyright, import layers, pytest
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright --warnings
	$(BIN)/lint-imports --no-cache
	$(BIN)/pytest -n 2 --dist worksteal

test-clients: setup ## the clients that bring much along (MAVProxy, DroneKit, mavsdk-grpc, node-mavlink), each installed by itself; needs npm
	@for client in mavproxy dronekit grpc; do \
		test -d build/clients/$$client || $(PYTHON) -m venv build/clients/$$client; \
		build/clients/$$client/bin/python -m pip install --quiet --requirement tests/clients/installed/requirements-$$client.txt || exit 1; \
	done
	@mkdir -p build/clients/node && cp tests/clients/installed/package.json build/clients/node
	npm install --silent --no-audit --no-fund --prefix build/clients/node
	$(BIN)/pytest -m installed_clients tests/clients/installed

format: setup ## let ruff format the code and mend what it safely can
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

paper: setup ## redraw the paper's figures and tables into docs/paper
	$(BIN)/python -m vehicle_model paper --out docs/paper

control-report: setup ## margins, gains and maps of the control laws into docs/control
	$(BIN)/python -m sitl.control report --out docs/control $(ARGS)

fuzz: setup ## ten million random bytes and a million arbitrary messages at a vehicle in flight; two minutes
	$(BIN)/python -m tests.sitl.mavlink.fuzzing $(ARGS)

soak: setup ## a simulated day with stations that come and go: memory must stay flat; some minutes
	$(BIN)/python benchmarks/soak.py $(ARGS)

bench: setup ## how fast it is, beside peers measured in the same run; ARGS="--json FILE" keeps the figures
	$(BIN)/python benchmarks/run.py $(ARGS)

lock: $(INSTALLED) ## resolve the newest allowed packages into requirements.lock; then run setup
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --extra dev --extra bench --upgrade \
		--no-emit-index-url --no-emit-find-links --custom-compile-command 'make lock' \
		--output-file requirements.lock pyproject.toml

clean: ## remove the environment and everything generated
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
