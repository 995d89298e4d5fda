# The one task runner. Every target makes what it needs; `make help` lists them.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUST := $(shell find rust -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock
READY := $(VENV)/.ready
BUILT := $(VENV)/.built
export CARGO_TERM_COLOR ?= auto

.PHONY: help
help:  ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

.PHONY: demo
demo: $(BUILT)  ## identify a simulated recording, print what was found against the truth, write the pictures
	$(BIN)/tvident demo

.PHONY: test
test: test-rust test-python lint  ## every test and every lint

.PHONY: test-rust
test-rust:  ## tests of the core
	cargo test --workspace --profile checked --quiet

.PHONY: test-python
test-python: $(BUILT)  ## tests of the Python package
	$(BIN)/python -m pytest --quiet

.PHONY: lint
lint: $(BUILT)  ## formatters, linters, type checkers
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --profile checked -- --deny warnings
	RUSTDOCFLAGS="--deny warnings" cargo doc --workspace --no-deps --profile checked --quiet
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/stubtest tvident._core

.PHONY: format
format: $(READY)  ## format all sources
	cargo fmt --all
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

.PHONY: wheel
wheel: $(READY)  ## build the wheel that users install, in dist/
	$(BIN)/maturin build --release --locked --out dist

.PHONY: clean
clean:  ## remove everything that was made
	rm -rf $(VENV) target dist tvident-demo

$(READY): requirements-development.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --requirement requirements-development.txt
	@touch $@

$(BUILT): $(READY) $(RUST) pyproject.toml
	$(BIN)/maturin develop --profile checked --locked --quiet
	@touch $@
