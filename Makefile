# One command each: `make demo` and `make test` install what is missing, build, and run. `make help` lists the rest.
#
# Everything lives in .venv; the stamps in it make a second call quick. PYTHON=python3.12 chooses the interpreter of a
# new .venv. Tests run in as many processes as there are processors: PROCESSES=0 runs them one after another.
# COMPILE_TOGETHER=OFF compiles each C++ file alone, so that a change to one takes less time (CONTRIBUTING.md).
PYTHON ?= python3
PROCESSES ?= auto
COMPILE_TOGETHER ?= ON
VENV := .venv
PIP := $(VENV)/bin/python -m pip --disable-pip-version-check

# What the installed package is made from; a newer one means another build, an incremental one.
sources := CMakeLists.txt pyproject.toml README.md LICENSE \
    $(shell find cpp cmake python/magshell -type f ! -name '*.so' ! -name '*.pyc' 2>/dev/null)
# A file's tests stay together, as they share what is dear to make; what takes longest comes first (tests/support/parallel.py).
# Byte code is kept, in folders that git ignores: compiling the tests anew takes as long as collecting them.
PYTEST = env -u PYTHONDONTWRITEBYTECODE $(VENV)/bin/python -m pytest -n $(PROCESSES) --dist loadfile --no-loadscope-reorder
pythons := $(wildcard python benchmarks tests examples docs scripts)
cpps = $(shell find cpp -name '*.h' -o -name '*.cpp')

.DEFAULT_GOAL := help
.PHONY: help demo test room nightly change seconds compile-seconds docs gallery wheel sanitize processors lint format stubs clean
.DELETE_ON_ERROR:
.SECONDARY:

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-15s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/.with-plot  ## the bistable magnetic beam: critical field and pictures, in out/
	$(VENV)/bin/python examples/bistable_beam.py
	@echo "The pictures are in $(CURDIR)/out:" && ls out

test: $(VENV)/.with-test  ## the tests of a change, of every room: six minutes on two processors
	$(PYTEST) -m "not nightly"

room: $(VENV)/.with-test  ## the tests of a room and those that use it, as in make room ROOM=contact: a minute
	files=$$($(VENV)/bin/python scripts/tests_of.py room $(ROOM)) && $(PYTEST) -m "not nightly" $$files

# Hypothesis searches at random here; SEED=... repeats a search.
nightly: $(VENV)/.with-test  ## all other tests, and a search at random: a quarter of an hour
	scripts/nightly_tools.sh
	seed=$${SEED:-$$(od -An -N4 -tu4 /dev/urandom | tr -d ' ')} && echo "make nightly SEED=$$seed repeats the search." && \
	    MAGSHELL_SEARCH=1 $(PYTEST) -m "nightly or hypothesis" --hypothesis-seed=$$seed
	PYTHON=$(CURDIR)/$(VENV)/bin/python scripts/cholmod.sh

change: $(VENV)/.with-test  ## the nightly tests of the rooms that changed since BASE, and of those above them: four minutes
	files=$$($(VENV)/bin/python scripts/tests_of.py change $(BASE)) && { [ -z "$$files" ] || $(PYTEST) -m nightly $$files; }

seconds: $(VENV)/.with-test  ## measure again which tests take long, and so are nightly: every test
	$(PYTEST) --junitxml=build/tests.xml
	$(VENV)/bin/python scripts/test_seconds.py build/tests.xml tests/seconds.txt

compile-seconds: $(VENV)/.wheel  ## what compiling took by room, and what grew since it was recorded
	$(VENV)/bin/python scripts/compile_seconds.py show build/compile_seconds.txt

docs: $(VENV)/.with-docs  ## the manual, in docs/_build/html; warnings are errors
	$(VENV)/bin/python -m sphinx -W --keep-going -q -j auto -b html docs docs/_build/html
	@echo "The manual is $(CURDIR)/docs/_build/html/index.html"

gallery: $(VENV)/.with-docs  ## the pictures of the README and the examples, in docs/pictures, computed anew
	$(VENV)/bin/python docs/_tools/front_page.py

wheel: $(VENV)/.created  ## a wheel for other machines and the sdist, in dist/, tried in a bare environment
	PYTHON=$(CURDIR)/$(VENV)/bin/python scripts/wheel.sh

sanitize: $(VENV)/.with-test  ## tests against an extension that watches its memory, arithmetic and threads
	PYTHON=$(CURDIR)/$(VENV)/bin/python scripts/sanitize.sh address,undefined
	PYTHON=$(CURDIR)/$(VENV)/bin/python scripts/sanitize.sh thread

processors: $(VENV)/.with-test  ## `make test` as other processors see it: an hour or two
	PYTHON=$(CURDIR)/$(VENV)/bin/python PROCESSES=$(PROCESSES) scripts/other_processors.sh

lint: $(VENV)/.lint  ## ruff, clang-format and plain words, changing nothing
	$(VENV)/bin/ruff check $(pythons)
	$(VENV)/bin/ruff format --check $(pythons)
	$(VENV)/bin/clang-format --dry-run -Werror $(cpps)
	$(VENV)/bin/python scripts/plain_words.py

format: $(VENV)/.lint  ## put the sources into the form that lint wants
	$(VENV)/bin/ruff check --fix $(pythons)
	$(VENV)/bin/ruff format $(pythons)
	$(VENV)/bin/clang-format -i $(cpps)

stubs: $(VENV)/.with-dev  ## write python/magshell/_core.pyi again, from the built extension
	$(VENV)/bin/pybind11-stubgen magshell._core --output-dir python --exit-code
	$(VENV)/bin/python scripts/complete_stub.py python/magshell/_core.pyi
	$(VENV)/bin/ruff check --quiet --fix python/magshell/_core.pyi
	$(VENV)/bin/ruff format --quiet python/magshell/_core.pyi

clean:  ## remove the environment, the build and what the demo wrote
	rm -rf $(VENV) build dist out docs/_build docs/_gallery

# The build tools are in the environment itself, so that a rebuild finds them where the last one did.
$(VENV)/.created: scripts/setup.sh
	scripts/setup.sh $(PYTHON)
	$(PYTHON) -m venv $(VENV)
	$(PIP) install --quiet 'scikit-build-core>=0.10' 'pybind11>=2.13' cmake ninja
	touch $@

# A wheel of the package, with the kernels that tests and benchmarks call, and that one installed. build/make is kept for the
# next time; a plain `pip install .` keeps a folder of its own (scripts/build_backend.py), as its bindings are others.
# Without MAKEFLAGS, as Ninja would take the number of jobs from it, which is that of recipes.
$(VENV)/.wheel: $(sources) $(VENV)/.created
	rm -rf build/wheels
	@echo "Building magshell (all that is said goes into build/make.log):"
	@env -u MAKEFLAGS $(VENV)/bin/python scripts/build_progress.py build/make.log \
	    $(PIP) wheel --verbose --no-deps --no-build-isolation --check-build-dependencies \
	    --config-settings=build-dir=build/make --config-settings=cmake.define.MAGSHELL_TESTING=ON \
	    --config-settings=cmake.define.MAGSHELL_COMPILE_TOGETHER=$(COMPILE_TOGETHER) \
	    --config-settings=cmake.define.MAGSHELL_COMPILE_SECONDS=$(CURDIR)/build/compile_seconds.txt --wheel-dir build/wheels .
	$(PIP) install --quiet --no-deps --force-reinstall build/wheels/*.whl
	touch $@

# Linters need no built package; their versions are those of the extra 'dev'.
$(VENV)/.lint: pyproject.toml $(VENV)/.created
	$(PIP) install --quiet $$(grep -oE '(ruff|clang-format)==[0-9.]+' pyproject.toml)
	touch $@

# What one of pyproject.toml's extras brings beside it. `make -j` downloads and unpacks it while the package is compiled.
$(VENV)/.needs-%: pyproject.toml scripts/requirements.py $(VENV)/.created
	@echo "Installing what the extra '$*' brings beside it:"
	@mkdir -p build
	$(VENV)/bin/python scripts/requirements.py $* >build/requirements-$*.txt
	$(PIP) install --quiet -r build/requirements-$*.txt
	touch $@

# The package with one of its extras: by now pip only compares.
$(VENV)/.with-%: $(VENV)/.wheel $(VENV)/.needs-%
	$(PIP) install --quiet "$$(echo build/wheels/*.whl)[$*]"
	touch $@
