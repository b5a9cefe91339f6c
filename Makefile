# Every task of the project; `make help` lists them. Paths here are relative, so that `make -C` works from anywhere.
#
#   PYTHON=python3.13         another interpreter; .venv is made anew when it changes
#   ARGS="-k levant"          more options for pytest (test, soak, fuzz, matrix), or for uv (lock)
#   ONLY=hit/mhz              the beginning of the names of the cases to record anew (digests), or of what is checked
#                             (prove, faults, gate, coverage, mutate); the reports to make (results)
#   LIST=1                    only say which reports are stale (results)
#   AGAIN=1                   find anew what is kept in tests/signoff/findings/ (the same five)
#   SEEDS="1 2" SAMPLES=10000 ENDURANCE=1000000
#                             the seeds, the samples for every seed, and the samples of endurance (soak)
#   PYTHONS="python3.12"      the interpreters to install for (matrix); those that are not there are left out
#   CALLS=1000 KILLS=16       the hostile calls, and the runs that are ended (fuzz)

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
MAKEFLAGS += --no-builtin-rules --no-builtin-variables --no-print-directory
# Verilator calls make itself, and that make must not take itself for a part of this run.
unexport MAKEFLAGS MFLAGS MAKELEVEL
# Containers like to set it; the tests start a thousand Pythons, and each would compile what it imports.
unexport PYTHONDONTWRITEBYTECODE
.DELETE_ON_ERROR:
.DEFAULT_GOAL := all

PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin/python -m
IN_TESTS := PYTHONPATH=tests $(RUN)
HARDWALL := $(VENV)/bin/hardwall
SOURCES := $(wildcard $(addsuffix .py,cli/* hdl/* hdl/*/* model/* model/*/* sim/* sim/*/*) sim/rtl/library.* sim/scene/builtin/*.toml sim/scene/hands.toml)

# The main job: the paper's device with the generated hardware in the loop, and for comparison the same axis at 1 MHz on
# the bit-accurate model, which gives the hardware's words in a hundredth of the time.
SCENE := seed-2011
ESTIMATORS := levant fdm
REPORTS := $(ESTIMATORS:%=build/hit-%.json) $(ESTIMATORS:%=build/mhz-%.json)
PICTURES := $(REPORTS:%.json=%.png)
# One more wall, at two rates, in one picture.
TWO_RATES := build/hit-two-rates.png

# What `make synth` compares, one part of each kind, and the boards that `make boards` builds for.
DEVICES := ecp5-25k ice40-up5k gw1nr-9
BOARDS := ulx3s-25f icebreaker tangnano9k

comma := ,
# Every estimator on one map, which none leaves.
ALL_ON_THE_MAP := --estimators all --set controller.damping_max_n_s_per_m=1000 $(addprefix --set zwidth., \
  stiffness_to_n_per_m=150e3 stiffness_step_n_per_m=2e3 damping_step_n_s_per_m=24.0 damping_to_n_s_per_m=486)
MAPPED := seed-2011 fit-2011 drive-2011
STUDIES := cutoff gains drop trade
# Above them a hit takes long: the whole study takes hours.
RATES := 1e3,2.5e3,1e4,2.5e4,1e5

SEEDS ?= $(shell shuf -i 1-999999999 -n 3)
SAMPLES ?= 1000000
ENDURANCE ?= 1000000000
CALLS ?= 20000
KILLS ?= 200
PYTHONS ?= python3.11 python3.12 python3.13 python3.14 python3.15
# Up to 8 cores, one process more than there are, because some tests wait.
CORES = $(shell getconf _NPROCESSORS_ONLN)
PYTEST = $(RUN) pytest -n $(if $(filter 1 2 3 4 5 6 7,$(CORES)),$$(($(CORES) + 1)),8) --dist worksteal

# ---- the tasks ------------------------------------------------------------------------------------------------------

.PHONY: all test prove faults gate coverage mutate lint bench synth boards constraints choose figures panel browser screenshots verilog docs diagrams results digests soak fuzz matrix release lock clean distclean help tools FORCE

all: $(REPORTS) $(PICTURES) $(TWO_RATES) ## hit the wall with the generated hardware in the loop: a table, and pictures in build/
	@$(HARDWALL) table $(REPORTS)
	@printf '%s\n' $(PICTURES) $(TWO_RATES)
	@printf '%s\n' '' 'Next:  source .venv/bin/activate' \
	  '       make panel                        push a handle into the wall, in the browser' \
	  '       hardwall hit mhz --plot hit.png   your own hits; docs/guide/start.md goes on from here'

# The longer campaigns, of a pytest of one's own and of what draws mutants or counts coverage, are its default.
test: export HARDWALL_SAMPLES ?= 12500
test: $(VENV)/.test | tools ## every regression: the model against exact arithmetic, the RTL against the model
	@$(PYTEST) $(if $(CI),--junitxml build/junit.xml) $(ARGS)

prove faults gate coverage mutate: export HARDWALL_AGAIN := $(AGAIN)

prove: $(VENV)/.test | tools ## proofs of every promise about safety and of every width; each proof fails with a bug
	@$(IN_TESTS) signoff.prove $(ONLY)

faults: $(VENV)/.test | tools ## faults injected into the board and its plant: what trips, how soon, and the force
	@$(IN_TESTS) signoff.faults $(ONLY)

gate: $(VENV)/.test | tools ## netlists of three families of FPGAs beside the RTL, from power-up on: all outputs, every clock
	@$(IN_TESTS) signoff.gate $(ONLY)

coverage: $(VENV)/.test | tools ## lines, branches and toggles of every block that its tests reach (half an hour)
	@$(IN_TESTS) signoff.cover $(ONLY)

mutate: $(VENV)/.test | tools ## mutants of every block's netlist, which its own tests must kill (an hour and a half)
	@$(IN_TESTS) signoff.mutate $(ONLY)

lint: $(VENV)/.test | tools ## style and common mistakes
	@failed=0; $(RUN) ruff check . || failed=1; $(RUN) ruff format --check . || failed=1; exit $$failed

bench: $(VENV)/.test | tools ## how fast the loop runs, beside cocotb
	@$(HARDWALL) bench

synth: $(VENV)/.synth $(VENV)/.test | tools ## size and fmax on three devices, median of several place-and-route seeds
	@for device in $(DEVICES); do $(HARDWALL) synth --device $$device --seeds 3; done
	@HARDWALL_LOOPS=all $(RUN) pytest -q -n 0 tests/rtl/test_synthesis.py tests/rtl/test_bitstream.py

boards: $(VENV)/.synth | tools ## bitstreams for three boards, with their wiring, in build/boards/ (some minutes)
	@for board in $(BOARDS); do $(HARDWALL) board $$board -o build/boards/$$board; done

constraints: $(VENV)/.test | tools ## write the files of constraints/ anew from the descriptions of the boards
	@$(IN_TESTS) support.own_flow

choose: $(VENV)/.synth | tools ## the table to choose an estimator by: accuracy, and cost on three devices (hours)
	@$(HARDWALL) costs
	@$(HARDWALL) choose

figures: $(VENV)/.synth | tools ## the founding paper's figures and every study, as pictures in build/ (an hour and more)
	@for number in 1 2; do $(HARDWALL) accuracy --figure $$number --plot build/figure-$$number.png; done
	@$(HARDWALL) lipschitz --plot build/figure-4.png
	@for scene in $(MAPPED); do $(HARDWALL) zwidth $$scene --resume --plot build/$$scene.png; done
	@$(HARDWALL) zwidth --resume --plot build/estimators.png $(ALL_ON_THE_MAP)
	@for study in $(STUDIES); do $(HARDWALL) $$study --resume --plot build/$$study.png; done
	@$(HARDWALL) rates --rates $(RATES) --resume --plot build/rates.png
	@$(HARDWALL) bits --plot build/bits.png
	@$(HARDWALL) rendered --plot build/rendered.png

panel: $(VENV)/.panel | tools ## feel a wall: a board in simulation, behind a page in the browser
	@$(HARDWALL) panel virtual

browser: $(VENV)/.test docs | tools ## the panel's page and these pages in a real browser (some minutes, alone on the machine)
	@HARDWALL_BROWSER=1 $(RUN) pytest -n 0 tests/host/panel/test_page*.py tests/test_site.py $(ARGS)

screenshots: $(VENV)/.test | tools ## the pictures of the panel's page, anew, by a browser
	@$(IN_TESTS) support.screenshots

verilog: $(VENV)/.sim | tools ## the axis of the scene as Verilog, in build/verilog/
	@$(HARDWALL) verilog $(SCENE) --output-folder build/verilog

docs: $(VENV)/.docs | tools ## the pages as a site in build/docs, every link inside checked; any warning is a failure
	@$(RUN) sphinx --quiet --fail-on-warning --keep-going --doctree-dir build/doctrees docs build/docs
	@echo build/docs/index.html

diagrams: $(VENV)/.docs | tools ## draw the diagrams of the pages anew, from the code that they show
	@$(RUN) docs.diagrams.draw

results: $(VENV)/.docs | tools ## the reports of pages and README whose sources have changed, or ONLY="NAMES" (two hours)
	@PYTHONPATH=tests $(VENV)/bin/python docs/reports.py $(if $(LIST),--list) $(ONLY)
	@PYTHONPATH=tests $(VENV)/bin/python docs/for_readme.py

digests: $(VENV)/.test | tools ## record anew what the program computes, and show what changed (after a change on purpose)
	@$(IN_TESTS) support.digests $(ONLY)

soak fuzz: PYTEST += -o faulthandler_timeout=0

soak: $(VENV)/.test | tools ## the long campaigns, with new seeds: 10^9 samples of every estimator, every loop whole
	@echo "HARDWALL_ENDURANCE=$(ENDURANCE)"
	@HARDWALL_ENDURANCE=$(ENDURANCE) $(PYTEST) tests/test_endurance.py
	@HARDWALL_DIGESTS=all HARDWALL_LOOPS=all $(PYTEST)
	@for seed in $(SEEDS); do \
	  echo "HARDWALL_SEED=$$seed HARDWALL_SAMPLES=$(SAMPLES); again: make soak SEEDS=$$seed SAMPLES=$(SAMPLES)"; \
	  HARDWALL_SEED=$$seed HARDWALL_SAMPLES=$(SAMPLES) $(PYTEST) -m rtl $(ARGS); \
	done

fuzz: $(VENV)/.test | tools ## 20 000 hostile calls of the command line, and 200 killed runs (hours)
	@HARDWALL_FUZZ=$(CALLS) HARDWALL_KILLS=$(KILLS) $(PYTEST) tests/test_fuzz.py tests/test_killed.py $(ARGS)

matrix: $(VENV)/.test | tools ## the wheel with each extra, installed elsewhere: oldest and newest packages, every Python (half an hour)
	@HARDWALL_MATRIX="$(PYTHONS)" $(RUN) pytest -n 0 -o faulthandler_timeout=0 tests/test_installed.py $(ARGS)

release: $(VENV)/.test $(VENV)/.synth $(VENV)/.docs | tools ## wheel, sdist, bitstreams, Verilog of every scene, pages, licences and sums, in build/release/ (half an hour)
	@$(IN_TESTS) support.release $(BOARDS)

# Names, versions and hashes; no address of an index, which is for each machine to say. What is in it stays, unless
# pyproject.toml no longer allows it or ARGS="--upgrade" asks for newer ones.
lock: $(VENV)/.made | tools ## write requirements.lock anew: the exact versions that make installs, of pyproject.toml's ranges
	@$(UV) pip compile --quiet --universal --python-version 3.11 --all-extras --generate-hashes --no-annotate \
	  --custom-compile-command 'make lock' $(ARGS) --output-file $(LOCK) pyproject.toml

clean: ## remove what was built and cached
	rm -rf build .hypothesis .pytest_cache .ruff_cache
	find cli hdl host model sim tests -name __pycache__ -prune -exec rm -rf {} +

distclean: clean ## remove the tools in .venv too
	rm -rf $(VENV) hardwall.egg-info

help: ## this list
	@sed -n 's/^\([a-z]*\):.* ## \(.*\)/\1:\2/p' Makefile | while IFS=: read -r task what; do \
	  printf '  make %-11s %s\n' "$$task" "$$what"; done

# ---- the main job: a report and a picture for every estimator -------------------------------------------------------

# The two targets of a pattern are made together. The report comes last and whole, so an interrupted run starts again.
define hit
@mkdir -p build
@rm -f $(basename $@).json
@echo "Hitting the wall of $(1) with $*, $(3) in the loop ..."
@$(HARDWALL) hit $(1) --estimator $* --backend $(2) --plot $(basename $@).png --json >$(basename $@).partial
@mv $(basename $@).partial $(basename $@).json
endef

$(TWO_RATES): $(SOURCES) $(VENV)/.sim | tools
	@mkdir -p build
	@echo "Hitting another wall at two rates, side by side ..."
	@$(HARDWALL) hit seed-2011 --beside mhz --stiffness 50e3 --damping 20 --plot $@ >/dev/null

build/hit-%.json build/hit-%.png: $(SOURCES) $(VENV)/.sim | tools
	$(call hit,$(SCENE),rtl,the generated hardware)

build/mhz-%.json build/mhz-%.png: $(SOURCES) $(VENV)/.sim | tools
	$(call hit,mhz,fixed,its bit-accurate model)

# ---- the tools: .sim for the loop, .test for the regressions, .synth for place and route, .docs for the pages

# .venv is made anew for another PYTHON, when its interpreter is gone, and in a tree that was moved or copied.
MADE_IN := $(file <$(VENV)/.made)
MADE_BY := $(file <$(VENV)/.python)
ifneq ($(MADE_IN),$(CURDIR))
  STALE := moved
else ifneq ($(origin PYTHON) $(PYTHON),$(origin PYTHON) $(if $(filter file,$(origin PYTHON)),$(PYTHON),$(MADE_BY)))
  STALE := other
else ifneq ($(shell { $(VENV)/bin/python -c 'print("runs")'; } 2>/dev/null || true),runs)
  STALE := broken
endif
INTERPRETER := $(if $(STALE),$(PYTHON),$(VENV)/bin/python)

$(VENV)/.made: $(if $(STALE),FORCE) | tools
	@"$(PYTHON)" -m venv $(if $(MADE_IN),--clear) $(VENV)
	@$(PIP) install --quiet --require-hashes --requirement <(sed -n '/^uv==/,/[^\]$$/p' $(LOCK)) 2>$(VENV)/uv.log || \
	  if grep -q 'DO NOT MATCH THE HASHES' $(VENV)/uv.log; then cat $(VENV)/uv.log >&2; exit 1; fi
	@printf '%s\n' "$(PYTHON)" >$(VENV)/.python
	@printf '%s\n' "$(CURDIR)" >$@

# Every version is that of $(LOCK), whose hashes uv checks. Where uv is not to be had, or finds no package, pip takes its
# place: it checks no hash, for it cannot where a tree is installed in place. Any other failure of uv ends the task: a
# file with another hash must not come in by pip. Only one installer runs at a time, even in a parallel make; of its
# output, only the large packages and the end are shown. Yosys and the placers compile themselves when they run first,
# into a file of the user's which all runs read: two first runs at a time would break each other, so they have theirs here.
LOCK := requirements.lock
UNHASHED := sed '/--hash/d; s/ *\\$$//' $(LOCK) >$(VENV)/constraints.txt
PIP := $(RUN) pip --disable-pip-version-check
UV := $(VENV)/bin/uv
# How uv begins when an index cannot be reached, or has no such package.
FOUND_NONE := ^error: (No solution found|Failed to fetch:)
SAYS := s/^Downloading \(.*\)/  \1/p; s/^Collecting \([^ ]*\).*/  \1/p; s/^Installed/  installed/p; \
  s/^Installing collected packages.*/  unpacking all of these/p
define install
@echo "Installing into $(VENV), once: $(2) ..."; began=$$SECONDS; exec {lock}<$(VENV)/.made; flock $$lock; \
  by_uv() { [ -x $(UV) ] && $(UV) pip install --python $(VENV)/bin/python --constraint $(LOCK) \
    --build-constraint $(LOCK) --editable '.[$(1)]' 2>&1 | tee $(VENV)/uv.log | sed -un '$(SAYS)'; }; \
  by_pip() { $(UNHASHED); PIP_CONSTRAINT=$(VENV)/constraints.txt $(PIP) install --progress-bar off \
    --editable '.[$(1)]' | sed -un '$(SAYS)'; }; \
  if by_uv; then rm $(VENV)/uv.log; \
  elif [ ! -x $(UV) ] || grep -Eq '$(FOUND_NONE)' $(VENV)/uv.log; then \
    tail -n 1 $(VENV)/uv.log 2>/dev/null || true; echo "  by pip, without uv:"; by_pip; \
  else cat $(VENV)/uv.log >&2; \
    echo "hardwall: uv failed (see above), and pip does not take its place, for it checks no hash" >&2; exit 1; fi; \
  $(foreach tool,$(3),$(VENV)/bin/yowasp-$(tool) --version >/dev/null 2>&1;) \
  echo "  done in $$((SECONDS - began)) s"
@touch $@
endef

$(VENV)/.sim: pyproject.toml $(LOCK) $(VENV)/.made | tools
	$(call install,sim,the model and the loop)

$(VENV)/.test: pyproject.toml $(LOCK) $(VENV)/.sim | tools
	$(call install,sim$(comma)host$(comma)panel$(comma)test,the tests' tools,yosys)

$(VENV)/.panel: pyproject.toml $(LOCK) $(VENV)/.sim | tools
	$(call install,sim$(comma)host$(comma)panel,the page)

$(VENV)/.synth: pyproject.toml $(LOCK) $(VENV)/.sim | tools
	$(call install,sim$(comma)synth,place and route,yosys nextpnr-ecp5 nextpnr-ice40 nextpnr-himbaechel-gowin)

$(VENV)/.docs: pyproject.toml $(LOCK) $(VENV)/.sim | tools
	$(call install,sim$(comma)host$(comma)panel$(comma)docs,the tools of the pages)

# ---- system packages, checked before anything starts ----------------------------------------------------------------

# These tasks embed Python in the simulator, by cocotb.
EMBEDDED := $(filter test faults gate coverage mutate bench soak matrix,$(MAKECMDGOALS))

define CHECK_PYTHON
import sys
if sys.version_info < (3, 11):
    sys.exit("Python 3.11 or newer, and $(INTERPRETER) is " + sys.version.split()[0] + "|python3")
try:
    import ensurepip, venv
except ImportError:
    sys.exit("Python's venv and ensurepip|python3-venv")
if "$(EMBEDDED)":
    import ctypes, os, sysconfig
    name = "libpython" + sysconfig.get_config_var("LDVERSION") + ".so"
    folders = "", sysconfig.get_config_var("LIBDIR")
    for each in [os.path.join(folder, name + end) for folder in folders for end in ("", ".1.0")]:
        try:
            ctypes.CDLL(each)
            break
        except OSError:
            pass
    else:
        sys.exit("Python as a shared library, " + name + "|libpython3-dev")
endef

tools: export CHECK = $(CHECK_PYTHON)
tools:
	@missing=0; \
	needs() { echo "hardwall needs $$1: install the Debian or Ubuntu package $$2" >&2; missing=1; }; \
	if [[ $$PWD == *[[:space:]\$$:#%]* ]]; then \
	  echo 'hardwall needs a path without spaces and without $$ : # %, for Verilator and make' >&2; missing=1; fi; \
	if ! command -v "$(INTERPRETER)" >/dev/null; then needs "Python 3.11 or newer, and there is no $(INTERPRETER)" python3; \
	elif ! fault=$$("$(INTERPRETER)" -c "$$CHECK" 2>&1); then needs "$${fault%|*}" "$${fault##*|}"; fi; \
	command -v c++ >/dev/null || needs "a C++ compiler, c++" g++; \
	perl -MFindBin -MPod::Usage -e 1 2>/dev/null || needs "perl and its modules" perl; \
	exit $$missing
