# make landscape   set everything up, and simulate all 6561 designs, into OUT=landscape
# make test        set everything up, and run the tests
# make test-lowest the same for the quick tests, with the lowest versions that pyproject.toml allows
# make figures     set everything up, and draw every figure, into figures
PYTHON ?= python3
VENV ?= .venv
OUT ?= landscape
BIN := $(VENV)/bin
SOURCES := $(wildcard csrc/*.* csrc/*/*.*)
C_FILES := $(filter %.c %.h,$(SOURCES))
WARNINGS := -std=c11 -Wall -Wextra -Wshadow -Wstrict-prototypes -Werror -O1 \
	-ffp-contract=off -fno-math-errno -Icsrc -Icsrc/include -c -o /dev/null

.PHONY: landscape test test-lowest verify lint sanitize fuzz benchmark pictures figures wasm table noise mechanisms realities step-error sdist clean

landscape: $(VENV)/installed
	$(BIN)/softvox landscape --out $(OUT)

# Two processes, each a file of tests at a time: tests that share what is costly to make are in one.
test: $(VENV)/installed
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile

# Every bound "name>=version" of pyproject.toml taken at its word, in an environment of its own.
# Old libraries' own warnings are not ours. iohinspector, which only tests need, asks for more.
LOWEST_TESTS ?= tests/test_simulate.py tests/test_evaluation.py tests/envs/test_env.py \
	tests/landscapes/test_table.py tests/search/test_adapters.py \
	tests/search/test_evolution.py tests/search/test_registry.py tests/search/test_run.py \
	tests/search/test_results.py tests/search/test_report_tables.py \
	tests/search/test_transfer.py tests/view/test_figures_cli.py \
	tests/view/test_replay_command.py tests/view/test_explore_physics.py
test-lowest:
	$(PYTHON) -m venv --clear $(VENV)-lowest
	grep -oE '"[a-z-]+>=[0-9.]+' pyproject.toml | sed 's/"//; s/>=/==/' | sort -u \
		> $(VENV)-lowest/constraints.txt
	$(VENV)-lowest/bin/python -m pip install --quiet --constraint $(VENV)-lowest/constraints.txt \
		--editable '.[search,adapters,view,browser-test]' moviepy pytest setuptools
	$(VENV)-lowest/bin/python -m pytest -o filterwarnings=default $(LOWEST_TESTS)

verify: $(VENV)/installed
	$(BIN)/softvox verify

$(VENV)/installed: pyproject.toml setup.py setup.cfg $(SOURCES)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "softvox-gym needs Python 3.11 or later: make PYTHON=python3.11 ..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	@touch $@

$(VENV)/linters: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --editable '.[lint]'
	@touch $@

lint: $(VENV)/linters
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run -Werror $(C_FILES) benchmarks/*.c
	for compiler in $${COMPILERS:-gcc}; do \
		for file in $(filter %.c,$(C_FILES)); do $$compiler $(WARNINGS) $$file || exit 1; done; done

# The engine's tests under AddressSanitizer and UndefinedBehaviorSanitizer, in an environment of
# its own, built from the source distribution. The whole landscape is simulated once. Without -g,
# which doubles the minutes that this takes to compile; say SANITIZE_MORE=-g for lines in reports.
SANITIZERS := -fsanitize=address,undefined -fno-sanitize-recover=all
SANITIZED := LD_PRELOAD="$$(gcc -print-file-name=libasan.so) $$(gcc -print-file-name=libubsan.so)" \
	ASAN_OPTIONS=detect_leaks=0 $(VENV)-sanitize/bin/python
sanitize: sdist
	$(PYTHON) -m venv --clear $(VENV)-sanitize
	CFLAGS="$(SANITIZERS) -g0 $(SANITIZE_MORE)" $(VENV)-sanitize/bin/python -m pip install --quiet \
		--no-cache-dir dist/softvox_gym-*.tar.gz pytest
	$(SANITIZED) -m pytest -k 'not every_instruction_set and not order_of_the_batch' \
		tests/test_bits.py tests/test_laws.py tests/test_oracle.py tests/test_simulate.py
	$(SANITIZED) tools/fuzz.py --count 100 --seed 280

figures: $(VENV)/installed
	$(BIN)/softvox figures --force --out figures \
		--results baselines/noise_free --results baselines/noise --results baselines/transfer

# The engine for browsers, which ships too; anew after any change in csrc.
wasm: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --editable '.[wasm]'
	$(BIN)/python tools/wasm.py

# The tables that ship with the package; anew after a change of the engine, of the noise or
# of a reality. Realities take 40 minutes; one alone: python tools/realities.py NAME
table: $(VENV)/installed
	$(BIN)/python tools/table.py

noise: $(VENV)/installed
	$(BIN)/python tools/noise.py

mechanisms: $(VENV)/installed
	$(BIN)/python tools/mechanisms.py

realities: $(VENV)/installed
	$(BIN)/python tools/realities.py

step-error: $(VENV)/installed
	$(BIN)/python tools/step_error.py

# Random batches: the same bits from every seating, instruction set and pause. Ten minutes.
FUZZ ?= 20000
fuzz: $(VENV)/installed
	$(BIN)/python tools/fuzz.py --count $(FUZZ)

sdist: $(VENV)/installed
	rm -rf dist
	$(BIN)/python -m pip install --quiet build
	$(BIN)/python -m build --sdist --outdir dist . > /dev/null

# In under ten minutes; APPEND=--append adds the rows to the tables in benchmarks.
benchmark: $(VENV)/installed
	$(BIN)/python benchmarks/engine.py --repeat 3 $(APPEND)
	$(BIN)/python benchmarks/bodies.py $(APPEND)

# The committed pictures; anew after a change of how they look.
pictures: $(VENV)/installed
	$(BIN)/python docs/picture.py
	$(BIN)/python tools/architecture.py
	$(BIN)/python tools/pictures.py
	$(BIN)/python benchmarks/bodies.py --draw
	$(BIN)/softvox figures gap_map gap_tracks --format png --force --out docs
	$(BIN)/softvox replay 6453 --fps 14 --speed 1 --force --out docs/6453.gif
	SOFTVOX_PICTURES=docs $(BIN)/python -m pytest tests/view/test_explore_browser.py -k readme

clean:
	rm -rf $(VENV) $(VENV)-* build dist src/*.egg-info *.egg-info src/softvox_gym/_engine.*
