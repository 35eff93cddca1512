# make demo   set up, then the whole loop on the simulated drive
# make test   set up with everything the tests want, then all tests
# make test-random   the properties with other examples; make mutants   do the tests notice?
# make faults   every fault in every phase of a session; make attack   the service under attack, real processes
# make docs   the reference of modules, classes and functions, from their docstrings
# All need python3, git and make, and nothing else done before.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK = 1

.PHONY: demo test test-random mutants lint docs setup setup-test lock blind sensitivity faults attack benchmark clean

demo: setup
	$(BIN)/coulomb demo

test: setup-test
	@if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then tests/install-system-packages; else tests/install-system-packages --say; fi
	BIN=$(BIN) tests/in-two-lanes

# Properties with examples drawn anew, RUNS times; stops at the first that fails and says how to repeat it.
RUNS ?= 1
test-random: setup-test
	for run in $$(seq $(RUNS)); do \
		$(BIN)/python -m pytest -x -q -m "hypothesis and not browser" --hypothesis-profile=random || exit 1; done

# Do the tests notice small changes to the code? Hours for the whole sample; SAMPLE, SEED and MODULE choose less; RECORD=FILE
# carries on what was stopped.
SAMPLE ?= 200
SEED ?= 2026
mutants: setup-test
	$(BIN)/python -m tests.mutants --sample $(SAMPLE) --seed $(SEED) $(foreach module,$(MODULE),--module $(module)) $(RECORD:%=--record %)

lint: setup-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/python .ci/counts

docs: setup-test
	$(BIN)/python docs/make_reference.py build/reference
	@echo "open build/reference/index.html"

setup: $(VENV)/installed
setup-test: $(VENV)/installed-test

# The environment is made by .ci/make-environment, which says in one line what is missing where it cannot.
$(VENV)/installed: requirements.lock pyproject.toml hatch_build.py api/pages/package-lock.json
	.ci/make-environment $(PYTHON) $(VENV)
	$(BIN)/pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/installed-test: requirements-test.lock $(VENV)/installed
	$(BIN)/pip install --quiet --require-hashes -r requirements-test.lock
	touch $@

# Needs uv. The lock files hold every dependency with the hashes of its files, for all platforms.
lock:
	uv pip compile --quiet --universal pyproject.toml --group build --generate-hashes --no-emit-index-url \
		--no-emit-find-links --custom-compile-command "make lock" -o requirements.lock
	uv pip compile --quiet --universal pyproject.toml --group dev --all-extras --constraint requirements.lock \
		--generate-hashes --no-emit-index-url --no-emit-find-links --custom-compile-command "make lock" \
		-o requirements-test.lock

# Every fault (bus, process, file, time) in every phase of a session, and the service's states; a quarter of an hour.
faults: setup-test
	$(BIN)/python -m tests.faults --write docs/faults.md

# The service attacked from outside while it moves a simulated rig in real time; wants a computer that does nothing else.
attack: setup-test
	$(BIN)/python -m pytest -q --run-attacks tests/attack tests/api/test_acceptor.py tests/api/test_stop_requests.py \
		tests/api/test_upload_bombs.py tests/api/test_confined_reader.py tests/api/test_sign_in_throttle.py \
		tests/api/test_connections.py tests/api/test_turnstile.py tests/api/test_request_head.py \
		tests/api/test_access.py tests/api/test_credentials.py tests/api/test_turned_away.py \
		tests/api/test_any_request.py tests/api/test_any_body.py tests/api/test_audit.py tests/api/test_bounded_log.py

# 680 cases; hours. Broken off, it goes on where it was; PART=1/3 and so on on several machines, docs/bench.md says how to merge.
PART ?= 1/1
blind: setup-test
	$(BIN)/python -m tests.blind --record build/blind-$(subst /,-of-,$(PART)).jsonl --part $(PART) --write docs/blind.md

# What other scripts import or start in a process of their own, and what wants another checkout or interpreter:
COMPANIONS := benchmarks/process_cost.py benchmarks/same_figures.py benchmarks/figaroh_on_a_record.py benchmarks/refit_per_candidate.py benchmarks/pysindy_on_a_record.py \
	benchmarks/mujoco_on_a_record.py benchmarks/peers_on_the_bench.py

# Every constant of the diagnosis halved and doubled on a reduced bench; half an hour.
sensitivity: setup-test
	$(BIN)/python -m tests.sensitivity --write docs/diagnosis.md

benchmark: setup-test
	for script in $(filter-out $(COMPANIONS),$(wildcard benchmarks/*.py)); do \
		echo "== $$script"; $(BIN)/python $$script || exit 1; done

clean:
	rm -rf $(VENV) build dist api/pages/static/vendor artifacts
