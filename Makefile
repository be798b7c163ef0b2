# Needs make and Python >= 3.11. Every target makes the virtual environment .venv and installs what
# it needs there, once: again only when pyproject.toml or constraints.txt has changed.
#
#   make train ARGS="--trials 1000"      hands arguments on to the script (or to pytest)
#   make train PYTHON=python3.12         chooses the interpreter (only when .venv is made)

PYTHON ?=
ARGS ?=

VENV = .venv
RUN = $(VENV)/bin/python
INSTALL = $(RUN) -m pip --disable-pip-version-check --no-input install -qq -c constraints.txt
RECENT = import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))
WHOLE = import sys, pip; sys.exit(sys.version_info < (3, 11) or sys.prefix == sys.base_prefix)
NEEDS = $(VENV)/.made pyproject.toml constraints.txt

.PHONY: help train train-rl evaluate show explore test test-slow test-exhaustive test-checked campaign \
	format benchmark reproduce report-check league docs docs-open clean distclean

help:  ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-14s%s\n", $$1, $$2 }' Makefile

train: $(VENV)/.for-train  ## train a neuron, score it, save it and draw it
	@$(RUN) scripts/train.py $(ARGS)

train-rl: $(VENV)/.for-league  ## train a Stable-Baselines3 agent, score it and save it
	@$(RUN) scripts/train_rl.py $(ARGS)

evaluate: $(VENV)/.for-train  ## score a saved neuron: make evaluate ARGS=CHECKPOINT
	@$(RUN) scripts/evaluate.py $(ARGS)

show: $(VENV)/.for-train  ## draw how a neuron works: hysteresis, response to each class
	@$(RUN) scripts/show.py $(ARGS)

explore: $(VENV)/.for-explore  ## move sliders in the browser, see a neuron learn anew
	@$(RUN) scripts/explore.py $(ARGS)

test: $(VENV)/.for-test  ## formatter, linter, type checker and all fast tests
	$(RUN) -m ruff format --check .
	$(RUN) -m ruff check .
	$(RUN) -m mypy
	$(RUN) -m pytest -m "not slow" $(ARGS)

test-slow: $(VENV)/.for-test  ## the long tests that make test leaves out: scores, kills, bad inputs
	$(RUN) -m pytest -m "slow and not exhaustive and not timed" $(ARGS)

test-exhaustive: $(VENV)/.for-test  ## every rule on every neuron (an hour of compiling), and speed
	$(RUN) -m pytest -m "exhaustive or timed" $(ARGS)

test-checked: $(VENV)/.for-test  ## random tasks, agents and environments, every array access checked
	$(RUN) tests/campaign/run.py --only environments --only configurations --count 100 --pairs 1 $(ARGS)

campaign: $(VENV)/.for-test  ## bad inputs, kills, changed bytes: make campaign ARGS="--size full"
	$(RUN) tests/campaign/run.py $(ARGS)

format: $(VENV)/.for-test  ## format the code and mend what the linter can mend
	$(RUN) -m ruff format .
	$(RUN) -m ruff check --fix .

benchmark: $(VENV)/.for-benchmark  ## measure speed beside what one would otherwise use
	@$(RUN) scripts/benchmark.py $(ARGS)

reproduce: $(VENV)/.for-reproduce  ## run the paper's experiments: results/report/index.html
	@$(RUN) scripts/reproduce.py $(ARGS)

report-check: $(VENV)/.for-reproduce  ## open the report in headless Chromium and look for errors
	@$(RUN) scripts/check_report.py $(ARGS)

league: $(VENV)/.for-league  ## neurons, network and RL agents in one table
	@$(RUN) scripts/league.py $(ARGS)

docs: $(VENV)/.for-docs  ## build the documentation: docs/_build/index.html; warnings are errors
	@$(RUN) -m sphinx -W --keep-going -q -b html docs docs/_build $(ARGS)
	@echo "docs/_build/index.html"

docs-open: docs  ## build the documentation and show it in the browser
	@$(RUN) -m webbrowser -t "file://$(CURDIR)/docs/_build/index.html"

clean:  ## remove caches, compiled functions too
	@find . \( -path ./$(VENV) -o -path ./.git \) -prune -o -type d -name __pycache__ -exec rm -rf {} +
	@rm -rf .pytest_cache .mypy_cache .ruff_cache build dist *.egg-info docs/_build \
		docs/tutorials/gallery docs/environments/gnm-* docs/reference/*.rst

distclean: clean  ## remove the virtual environment as well; results stay
	@rm -rf $(VENV)

# One stamp for each set of extras, written only after its installation went well. A set that holds
# another writes that one's stamp too.

$(VENV)/.for-train: $(NEEDS)
	@echo "Installing what training needs into $(VENV) ..."
	@$(INSTALL) -e ".[pictures]"
	@touch $@

$(VENV)/.for-explore: $(NEEDS)
	@echo "Installing what the explorer needs into $(VENV) ..."
	@$(INSTALL) -e ".[explore]"
	@touch $@

$(VENV)/.for-test: $(NEEDS)
	@echo "Installing what the tests need into $(VENV); with torch this takes minutes ..."
	@$(INSTALL) -e ".[pictures,rendering,rl,chemistry,reproduce,search,cluster,recordings,speech,docs,explore,video,dev]"
	@touch $(VENV)/.for-train $(VENV)/.for-explore $(VENV)/.for-reproduce $(VENV)/.for-league $(VENV)/.for-docs $@

$(VENV)/.for-benchmark: $(NEEDS)
	@echo "Installing what the benchmark needs into $(VENV); with torch this takes minutes ..."
	@$(INSTALL) -e ".[pictures,rl,bench]"
	@touch $(VENV)/.for-train $@

$(VENV)/.for-reproduce: $(NEEDS)
	@echo "Installing what the experiments and the report need into $(VENV) ..."
	@$(INSTALL) -e ".[pictures,chemistry,reproduce]"
	@touch $(VENV)/.for-train $@

$(VENV)/.for-league: $(NEEDS)
	@echo "Installing what the league needs into $(VENV); with torch this takes minutes ..."
	@$(INSTALL) -e ".[pictures,reproduce,rl]"
	@touch $(VENV)/.for-train $@

# The reference is made from the docstrings of every part, so that every part has to be importable.
$(VENV)/.for-docs: $(NEEDS)
	@echo "Installing what the documentation needs into $(VENV); with torch this takes minutes ..."
	@$(INSTALL) -e ".[pictures,rl,chemistry,reproduce,cluster,docs]"
	@touch $(VENV)/.for-train $(VENV)/.for-reproduce $(VENV)/.for-league $@

# An environment that works is kept. The interpreter is tried, not only looked for: a name on the
# path may be a version manager's stand-in for a version that is not active.
$(VENV)/.made:
	@if ! $(RUN) -c '$(WHOLE)' >/dev/null 2>&1; then \
		set -- python3 python3.13 python3.12 python3.11; \
		if [ -n "$(PYTHON)" ]; then set -- "$(PYTHON)"; fi; \
		found=; \
		for candidate; do \
			if "$$candidate" -c '$(RECENT)' >/dev/null 2>&1; then found=$$candidate; break; fi; \
		done; \
		if [ -z "$$found" ]; then \
			echo "No working Python >= 3.11 with venv and pip among: $$*." >&2; \
			echo "Install one (on Debian and Ubuntu also the package python3-venv)," \
				"or name yours: make PYTHON=/path/to/python3.12" >&2; \
			exit 1; \
		fi; \
		echo "Making $(VENV) with $$found ..."; \
		"$$found" -m venv --clear $(VENV); \
	fi
	@touch $@
