# The one task runner. Every target makes what it needs; `make help` lists them.

PYTHON ?= python3
VENV := .venv
# Where an environment keeps its programs.
PROGRAMS := $(if $(filter Windows_NT,$(OS)),Scripts,bin)
BIN := $(VENV)/$(PROGRAMS)
RUST := $(shell find rust -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock
READY := $(VENV)/.ready
BUILT := $(VENV)/.built
# The demo needs few packages, which are fetched in a quarter of the time.
DEMO := .venv-demo
DEMO_BUILT := $(DEMO)/.built
BENCH := .venv-bench
BENCH_BUILT := $(BENCH)/.built
ACCURACY := .venv-accuracy
WHEELS := .venv-wheels
export CARGO_TERM_COLOR ?= auto
# Tests start the program hundreds of times: its modules are compiled once, also where the environment forbids to keep them.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help
help:  ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

.PHONY: demo
demo: $(DEMO_BUILT)  ## identify a simulated recording, print what was found against the truth, write the pictures
	$(DEMO)/$(PROGRAMS)/tvident demo

.PHONY: test
test:  ## every test but the slow and the longest; the last line says which tests had no recordings
	# Packages are fetched while Rust compiles, and tests inside the core run while it is compiled as it is shipped.
	$(MAKE) --no-print-directory --jobs=3 test-units test-crate $(READY)
	$(MAKE) --no-print-directory test-python

.PHONY: test-rust
test-rust: test-units test-crate  ## tests of the core

# Tests inside the core have it compiled for themselves: not optimised, that takes a fifth of the time, and they are short. All other
# tests share one core, as optimised as what is shipped, which is compiled while those run: as a program of their own, since cargo waits for
# its folder while it compiles something else. Cargo has a job server of its own.
TEST_UNITS := MAKEFLAGS= cargo test --package tvident --lib --profile checked --quiet --config profile.checked.package.tvident.opt-level=0
UNITS := target/units.json

.PHONY: build-units
build-units:
	mkdir -p target
	$(TEST_UNITS) --no-run --message-format=json-render-diagnostics > $(UNITS)

.PHONY: test-units
test-units: build-units
	cd rust/core && "$$(sed -n 's/.*"executable":"\([^"]*\)".*/\1/p' ../../$(UNITS) | tail -n 1)" --quiet

.PHONY: test-crate
test-crate: build-units
	MAKEFLAGS= cargo test --workspace --test '*' --profile checked --quiet
	MAKEFLAGS= cargo test --workspace --doc --profile checked --quiet

TIMED := tests/house/test_parallel.py tests/house/test_times.py
.PHONY: test-python
test-python: $(BUILT)  ## tests of the Python package
	# What promises a time is alone on the machine.
	$(BIN)/python -m pytest --quiet $(TIMED)
	# Three processes on neighbouring tests: what tests of one file share is made once, and two processors have work while one of them
	# waits for a cluster, a browser or a stream. Whoever is done first takes over from the others.
	$(BIN)/python -m pytest --quiet --numprocesses=3 --dist=worksteal $(addprefix --ignore=,$(TIMED))

.PHONY: test-slow
test-slow: $(BUILT)  ## tests of the Python package that take about a second or more each
	TVIDENT_TESTS=slow $(BIN)/python -m pytest --quiet --numprocesses=3 --dist=worksteal

.PHONY: test-long
test-long: $(BUILT)  ## the longest tests: more seeds and cases of what other tests do by some
	TVIDENT_TESTS=long $(BIN)/python -m pytest --quiet --numprocesses=2 --dist=worksteal

.PHONY: test-all
test-all: lint test  ## every lint and every test there is but soaks and attacks
	$(MAKE) --no-print-directory test-slow
	$(MAKE) --no-print-directory test-long

.PHONY: lint
lint: lint-rust lint-python lint-core  ## formatters, linters, type checkers

.PHONY: lint-rust
lint-rust:  ## of Rust's sources
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --profile checked -- --deny warnings
	RUSTDOCFLAGS="--deny warnings" cargo doc --workspace --no-deps --profile checked --quiet

.PHONY: lint-python
lint-python: $(READY)  ## of Python's sources
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy

.PHONY: lint-core
lint-core: $(BUILT)  ## of what Python is told of the core against what the core has
	$(BIN)/python .ci/stubs.py

.PHONY: soak
soak: CASES ?= 20000
soak: $(BUILT)  ## the properties of both languages with many more cases, drawn anew: an hour or more
	PROPTEST_CASES=$(CASES) cargo test --workspace --profile checked
	TVIDENT_HYPOTHESIS=soak $(BIN)/python -m pytest --hypothesis-show-statistics

.PHONY: soak-stream
soak-stream: SAMPLES ?= 10000000
soak-stream: $(BUILT)  ## ten million samples through a stream in random pieces: memory flat, no drift; SAMPLES=…
	TVIDENT_STREAM=$(SAMPLES) $(BIN)/python -m pytest --quiet tests/stream/test_soak.py

.PHONY: test-live
test-live: SECONDS ?= 60
test-live: $(BUILT)  ## a minute of the Lab Streaming Layer at 1 kHz, through tvident live and back; SECONDS=…
	TVIDENT_LIVE=$(SECONDS) $(BIN)/python -m pytest --quiet tests/live

.PHONY: attack
attack: SECONDS ?= 3600
attack: $(BUILT)  ## random and hostile calls, files and signals, drawn anew, for an hour or SECONDS=
	TVIDENT_ATTACK=$(SECONDS) $(BIN)/python -m pytest tests/hostile

.PHONY: sanitize
sanitize: TARGET = $(shell rustc --version --verbose | sed -n 's/^host: //p')
sanitize:  ## unit tests of the core under AddressSanitizer (needs Rust's nightly toolchain)
	ASAN_OPTIONS=allocator_may_return_null=1 RUSTFLAGS=-Zsanitizer=address cargo +nightly test --package tvident --lib --target $(TARGET) --target-dir target/sanitize

.PHONY: site
site: $(BUILT)  ## build the site in docs/site from the pages, the docstrings and the gallery, and follow its links; a warning is an error
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --builder html docs docs/site
	$(BIN)/python docs/links.py docs/site

.PHONY: docs
docs: $(BUILT) rooms  ## make anew what documents show of the program (pictures, help of the commands, rooms), then the site
	$(BIN)/tvident demo
	cp tvident-demo/parameters.png docs/identified.png
	$(BIN)/python docs/comparison.py README.md docs/compared.md docs/comparison.png
	$(BIN)/python docs/command_line_reference.py docs/command-line.md
	$(MAKE) --no-print-directory site

.PHONY: rooms
rooms: $(BUILT)  ## make anew what DESIGN.md shows of the rooms: their tables, who uses whom
	PYTHONPATH=tests $(BIN)/python docs/rooms.py docs/rooms.svg

.PHONY: format
format: $(READY)  ## format all sources
	cargo fmt --all
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

.PHONY: accuracy
accuracy: $(ACCURACY)/.built  ## measure accuracy against truth, bound and other libraries, into benches/accuracy.md; hours: ARGUMENTS=--help
	PYTHONPATH=benches $(ACCURACY)/$(PROGRAMS)/python -m accuracy $(ARGUMENTS)

.PHONY: wheel
wheel: $(READY)  ## build the wheel that users install, in dist/
	$(BIN)/maturin build --release --locked --out dist

.PHONY: wheels
wheels: $(WHEELS)/.ready  ## what is published, in dist/: sources, and from them a wheel for each system; audited, installed, tried
	$(WHEELS)/$(PROGRAMS)/python .ci/wheels.py $(ARGUMENTS)

.PHONY: bench
bench: $(BENCH_BUILT)  ## how fast it is beside its peers: BENCH_OPTIONS="--quick", "--only identify", "--store", "--help"
	PYTHONPATH=benches:tests $(BENCH)/$(PROGRAMS)/python -m speed $(BENCH_OPTIONS)

.PHONY: bench-samples
bench-samples:  ## one sample at a time through streams of the core: fails where one takes more than 3 µs on average
	cargo run --release --quiet --package tvident-instructions -- one-at-a-time

.PHONY: record-instructions
record-instructions: $(READY)  ## write down the instructions that a window costs, for the tests to compare with (needs valgrind)
	$(BIN)/python benches/instruction_counts.py

.PHONY: clean
clean:  ## remove everything that was made
	rm -rf $(VENV) $(DEMO) $(BENCH) $(ACCURACY) $(WHEELS) target dist tvident-demo docs/site docs/built docs/shown

$(READY): requirements-development.txt
	$(PYTHON) -m venv $(VENV)
	# Modules are compiled when they are imported: that is one of three, and half of the time that this takes.
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --requirement requirements-development.txt
	@touch $@

$(BUILT): $(READY) $(RUST) pyproject.toml
	@echo "Building the extension: two to three minutes the first time, half of one after a change."
	$(BIN)/maturin develop --profile checked --locked
	@touch $@

$(DEMO)/.ready: requirements-development.txt
	$(PYTHON) -m venv $(DEMO)
	grep -E '^(click|matplotlib|maturin|numpy|tqdm)==' $< > $(DEMO)/requirements.txt
	$(DEMO)/$(PROGRAMS)/python -m pip install --quiet --disable-pip-version-check --requirement $(DEMO)/requirements.txt
	@touch $@

# The build of the tests, which compile nothing of it again.
$(DEMO_BUILT): $(DEMO)/.ready $(RUST) pyproject.toml
	@echo "Building the extension: two to three minutes the first time, half of one after a change."
	VIRTUAL_ENV=$(abspath $(DEMO)) $(DEMO)/$(PROGRAMS)/maturin develop --profile checked --locked
	@touch $@

$(BENCH)/.ready: requirements-bench.txt
	$(PYTHON) -m venv $(BENCH)
	$(BENCH)/$(PROGRAMS)/python -m pip install --quiet --disable-pip-version-check --requirement requirements-bench.txt
	@touch $@

# A wheel as users install it, in an environment of its own: the checked build of the tests stays where it is.
$(BENCH_BUILT): $(BENCH)/.ready $(RUST) pyproject.toml $(shell find python/tvident -name "*.py")
	rm -rf target/bench-wheel
	$(BENCH)/$(PROGRAMS)/maturin build --release --locked --quiet --out target/bench-wheel
	$(BENCH)/$(PROGRAMS)/python -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall target/bench-wheel/*.whl
	@touch $@

$(WHEELS)/.ready: requirements-wheels.txt
	$(PYTHON) -m venv $(WHEELS)
	$(WHEELS)/$(PROGRAMS)/python -m pip install --quiet --disable-pip-version-check --requirement requirements-wheels.txt
	@touch $@

$(ACCURACY)/.ready: requirements-accuracy.txt
	$(PYTHON) -m venv $(ACCURACY)
	$(ACCURACY)/$(PROGRAMS)/python -m pip install --quiet --disable-pip-version-check --requirement requirements-accuracy.txt
	@touch $@

$(ACCURACY)/.built: $(ACCURACY)/.ready $(RUST) pyproject.toml
	VIRTUAL_ENV=$(abspath $(ACCURACY)) $(ACCURACY)/$(PROGRAMS)/maturin develop --profile checked --locked --quiet
	@touch $@
