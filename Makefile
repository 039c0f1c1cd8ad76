# make demo: the whole way, from the Duffing oscillator to an FMU with a measured error, in about a
# minute after the set-up; make release NAME=duffing builds the released one.
# make test: the essential tests, in some minutes; make test-extended: all others;
# make test-all: all of them; make mutation: which planted faults the tests find.
# Each of them sets up .venv first. Folders may have spaces in their names.
PYTHON ?= python3
# While .venv is activated, python3 is the one in it, which has no pip: then the one behind it is used.
WITH_PIP = "$(shell $(PYTHON) -c 'import sys; from importlib.util import find_spec; \
	print(sys.executable if find_spec("pip") else sys._base_executable)')"
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready

.PHONY: setup demo test test-extended test-all mutation release lint types contract lock clean
.DEFAULT_GOAL := demo

setup: $(READY)

PIP = $(WITH_PIP) -m pip --disable-pip-version-check --python $(BIN)/python
LOCKED = $(PIP) install --quiet --require-hashes --no-deps -r
TORCH = $(shell sed -n 's/^\(torch==[^ ]*\).*/\1/p' requirements.lock)

# A build of torch for the CPU alone is taken where pip finds one; the lock file has the hashes of
# both. What torch needs for CUDA, some gigabytes, is installed only where torch came with CUDA. The
# runtime takes as long to compile as the packages to install, so its compiler comes first.
$(READY): requirements.lock .ci/requirements-cuda.lock pyproject.toml
	@$(WITH_PIP) -m pip --version >/dev/null 2>&1 || \
		{ echo "PYTHON=$(PYTHON) has no pip, or is none; install pip for it, or set PYTHON" >&2; exit 1; }
	$(WITH_PIP) -m venv --without-pip $(VENV)
	awk '/^[a-z]/ {kept = /^(fmpy|ziglang)==/} kept' requirements.lock >$(VENV)/compiler.lock
	if $(PIP) install --quiet --dry-run --no-deps $(TORCH)+cpu 2>/dev/null; then build=+cpu; fi; \
		sed "s/^$(TORCH)/&$$build/" requirements.lock >$(VENV)/packages.lock
	$(LOCKED) $(VENV)/compiler.lock
	$(BIN)/python slide_fmu/fmu/libraries/build.py >$(VENV)/compiled & \
		if $(LOCKED) $(VENV)/packages.lock; then wait $$!; else kill $$!; exit 1; fi
	if $(PIP) check | grep -q "^torch "; then $(LOCKED) .ci/requirements-cuda.lock; fi
	$(PIP) install --quiet --no-deps --no-build-isolation -e .
	$(PIP) check
	touch $(READY)

demo: setup
	$(BIN)/slide-fmu run training/duffing_demo.toml

# make release NAME=duffing: build a released FMU again, with its card, which shows mechanism.png:
# drawn anew where the model draws itself, else that of the released folder if there is one.
release: setup
	mkdir -p runs/$(NAME) fmus/$(NAME)
	test ! -e fmus/$(NAME)/mechanism.png || cp fmus/$(NAME)/mechanism.png runs/$(NAME)/
	$(BIN)/slide-fmu run training/$(NAME).toml
	cp runs/$(NAME)/$(NAME).fmu runs/$(NAME)/error_against_step.png runs/$(NAME)/times.json fmus/$(NAME)/
	test ! -e runs/$(NAME)/mechanism.png || cp runs/$(NAME)/mechanism.png fmus/$(NAME)/
	cp runs/$(NAME)/card.md fmus/$(NAME)/README.md

# A worker takes whole files, since tests of a file share what they build. Files keep their order,
# the longest first (tests/time_log.py): pytest-xdist would sort them by their numbers of tests.
WORKERS ?= 2
# What is compiled is kept, since tests start many programs, each of which would compile it again.
PYTEST := PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder

test: setup
	$(PYTEST) -m "not extended"

test-extended: setup
	$(PYTEST) -m extended

test-all: setup
	$(PYTEST) --hypothesis-profile thorough

mutation: setup
	$(BIN)/python -m tests.mutation.run

lint: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: setup
	$(BIN)/mypy

contract: setup
	$(BIN)/lint-imports

# The versions that are locked stay, as long as pyproject.toml admits them.
lock:
	$(PYTHON) -m venv build/lock
	build/lock/bin/python -m pip install --quiet uv
	build/lock/bin/python .ci/lock.py

clean:
	rm -rf $(VENV) build runs docs/tutorials/pages

.PHONY: docs gallery fmus

# The site, from docs/ into build/site, without network. The picture of the rooms is drawn first.
# Pages of tutorials are written anew, so that none stays of a tutorial that is gone.
docs: setup
	rm -rf docs/tutorials/pages
	$(BIN)/python docs/rooms.py
	$(BIN)/python docs/recipe_page.py
	NO_MKDOCS_2_WARNING=1 TQDM_DISABLE=1 $(BIN)/python -m mkdocs build --strict --quiet

# make gallery NAME=arm_from_urdf: run a tutorial, and keep what it prints and draws for the site;
# without NAME all of them.
gallery: setup
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python docs/gallery_results.py $(NAME)

# Every released FMU again, without training: same surrogate, report and figures, this runtime.
fmus: setup
	$(BIN)/python fmus/rebuild.py fmus/*/*.fmu
