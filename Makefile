# Two commands do all the set-up: `make demo` and `make test`.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
FACADE := $(BIN)/facade
OUT    ?= build/demo
DATA   ?=

.PHONY: demo demo-real test check lint types golden docs lock bench pictures samples judges clean

# --- environment: pinned by requirements.lock, with hashes ---------------------------------------
$(VENV)/.ready: requirements.lock pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --only-binary :all: -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

# --- the main job ---------------------------------------------------------------------------------
demo: $(VENV)/.ready
	$(MAKE) --no-print-directory -j2 -f examples/demo/Makefile FACADE=$(FACADE) OUT=$(OUT)

demo-real: $(VENV)/.ready
	$(MAKE) --no-print-directory -f examples/demo/Makefile FACADE=$(FACADE) OUT=build/demo-real \
	  HOUSES=$(DATA) real

# --- proof ----------------------------------------------------------------------------------------
test: $(VENV)/.ready
	$(BIN)/python -m pytest -n 2 -q

lint: $(VENV)/.ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.ready
	$(BIN)/mypy

check: lint types test

golden: $(VENV)/.ready
	$(BIN)/python -m pytest -q tests/test_golden.py tests/test_retarget.py -k bytes --update-golden

docs: $(VENV)/.ready
	$(BIN)/python docs/make_reference.py

# Those that need no data of others; the docstrings of the rest say what they want.
BENCHES = attributes export facadegen foundation import layer_solve learn mass_ablation massgen \
  parse_image recovery sample skeleton two_sample
bench: $(VENV)/.ready
	for b in $(BENCHES); do $(BIN)/python benchmarks/bench_$$b.py || exit 1; done

pictures: $(VENV)/.ready
	$(MAKE) --no-print-directory -f docs/pictures/Makefile FACADE=$(FACADE) PYTHON=$(BIN)/python

samples: $(VENV)/.ready
	$(BIN)/python sample_data/make_samples.py
	$(BIN)/python sample_data/make_textured.py

# The Khronos glTF validator, which the tests ask where it is installed (needs node).
judges: build/node_modules/gltf-validator
build/node_modules/gltf-validator:
	npm install --silent --no-save --prefix build gltf-validator@2.0.0-dev.3.10

# --- upkeep ---------------------------------------------------------------------------------------
lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --extra dev --extra cluster \
	  --no-header --no-annotate --no-emit-index-url --quiet pyproject.toml build-requirements.in \
	  -o requirements.lock

clean:
	rm -rf build dist *.egg-info .venv
	rm -rf facade_tools/__pycache__/kernels-*
