# make landscape   set everything up, and simulate all 6561 designs, into OUT=landscape
# make test        set everything up, and run the tests
# make test-lowest the same for the quick tests, with the lowest versions that pyproject.toml allows
# make figures     set everything up, and draw every figure, into figures
# make docs        set everything up, and build the documentation, into site/html
# make wheels      set everything up, build the wheel, check it, and try it on each Python here
PYTHON ?= python3
VENV ?= .venv
OUT ?= landscape
BIN := $(VENV)/bin
SOURCES := $(wildcard csrc/*.* csrc/*/*.*)
C_FILES := $(filter %.c %.h,$(SOURCES))
WARNINGS := -std=c11 -Wall -Wextra -Wshadow -Wstrict-prototypes -Werror -O1 \
	-ffp-contract=off -fno-math-errno -Icsrc -Icsrc/include -c -o /dev/null

.PHONY: landscape test test-lowest verify lint sanitize fuzz benchmark pictures figures docs wheels wasm table noise mechanisms realities trials phased step-error sdist clean

landscape: $(VENV)/installed
	$(BIN)/softvox landscape --out $(OUT)

# Two processes, each a file of tests at a time: tests that share what is costly to make are in one.
test: $(VENV)/installed
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile

# One pip for all environments that come after sdist: to set it up takes longer than most installs.
PIP_FOR = $(VENV)-sdist/bin/python -m pip --python $(VENV)-$(1)/bin/python

# Every bound "name>=version" of pyproject.toml taken at its word, in an environment of its own, and
# the package as a stranger gets it: built from the source distribution, held to the published data.
# Old libraries' own warnings are not ours. iohinspector, which only tests need, asks for more.
# Left out is what takes long and needs no more of the libraries than its neighbours.
LOWEST_LEFT_OUT := another_process however_slow sixteen_designs still_produces_the_table
LOWEST_TESTS ?= tests/test_simulate.py tests/test_evaluation.py tests/envs/test_env.py \
	tests/landscapes/test_table.py tests/search/test_adapters.py \
	tests/search/test_evolution.py tests/search/test_registry.py tests/search/test_run.py \
	tests/search/test_results.py tests/search/test_report_tables.py \
	tests/search/test_transfer.py tests/view/test_figures_cli.py \
	tests/view/test_replay_command.py
test-lowest: sdist
	$(PYTHON) -m venv --clear --without-pip $(VENV)-lowest
	grep -oE '"[a-z-]+>=[0-9.]+' pyproject.toml | sed 's/"//; s/>=/==/' | sort -u \
		> $(VENV)-lowest/constraints.txt
	$(call PIP_FOR,lowest) install --quiet --no-cache-dir \
		--constraint $(VENV)-lowest/constraints.txt \
		"softvox-gym[search,adapters,view,browser-test] @ file://$$(echo $$PWD/dist/*.tar.gz)" \
		moviepy pytest setuptools
	cd / && $(abspath $(VENV)-lowest)/bin/softvox verify
	$(VENV)-lowest/bin/python -m pytest -o filterwarnings=default $(LOWEST_TESTS) \
		-k 'not ($(shell echo $(LOWEST_LEFT_OUT) | sed 's/ / or /g'))'

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
	$(BIN)/yamllint --strict .github .yamllint.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.github-issue-forms .github/ISSUE_TEMPLATE/[!c]*.yml
	$(BIN)/zizmor --offline --no-progress --quiet .github
	$(BIN)/clang-format --dry-run -Werror $(C_FILES) benchmarks/*.c
	for compiler in $${COMPILERS:-gcc}; do \
		for file in $(filter %.c,$(C_FILES)); do $$compiler $(WARNINGS) $$file || exit 1; done; done

# The engine's tests under AddressSanitizer and UndefinedBehaviorSanitizer, in an environment of
# its own, built from the source distribution. The whole landscape is simulated once; the plain writing
# of the physics takes long and is Python. Without -g, which doubles the minutes that this takes to
# compile; say SANITIZE_MORE=-g for lines in reports. With flags that must change neither the bits nor
# the arithmetic of the process.
SANITIZE_LEFT_OUT := every_instruction_set order_of_the_batch number_of_threads plain_writing_ends
FAST_MATH := -Ofast -ffast-math -funsafe-math-optimizations
SANITIZERS := -fsanitize=address,undefined -fno-sanitize-recover=all
SANITIZED := LD_PRELOAD="$$(gcc -print-file-name=libasan.so) $$(gcc -print-file-name=libubsan.so)" \
	ASAN_OPTIONS=detect_leaks=0 $(VENV)-sanitize/bin/python
sanitize: sdist
	$(PYTHON) -m venv --clear --without-pip $(VENV)-sanitize
	CFLAGS="$(FAST_MATH) $(SANITIZERS) -g0 $(SANITIZE_MORE)" \
		$(call PIP_FOR,sanitize) install --quiet --no-cache-dir \
		dist/softvox_gym-*.tar.gz pytest
	$(SANITIZED) -m pytest \
		-k 'not ($(shell echo $(SANITIZE_LEFT_OUT) | sed 's/ / or /g'))' \
		tests/test_bits.py tests/test_laws.py tests/test_oracle.py tests/test_simulate.py
	$(SANITIZED) tools/fuzz.py --count 100 --seed 280

figures: $(VENV)/installed
	$(BIN)/softvox figures --force --out figures \
		--results baselines/noise_free --results baselines/noise --results baselines/transfer

# What only an extra needs is in an environment of its own, which sees that of the package.
SITE := -c 'import sysconfig; print(sysconfig.get_path("purelib"))'
$(VENV)-%/installed: $(VENV)/installed
	$(BIN)/python -m venv --clear --without-pip $(VENV)-$*
	echo "import site; site.addsitedir('$$($(BIN)/python $(SITE))')" \
		> "$$($(VENV)-$*/bin/python $(SITE))/package.pth"
	$(BIN)/python -m pip --python $(VENV)-$*/bin/python install --quiet 'softvox-gym[$*]'
	@touch $@

# Every warning is an error. The notebooks run; the page that one can explore is one of the site's.
# Here are the libraries for learners, too: what needs them is tested first.
docs: $(VENV)-docs/installed
	$(VENV)-docs/bin/python -m pytest tests/envs/test_sb3.py tests/search/test_learners.py
	rm -rf site
	$(VENV)-docs/bin/sphinx-build --quiet --color -W --keep-going --nitpicky -c docs -d site/doctrees \
		. site/html
	mkdir -p site/html/app
	$(VENV)-docs/bin/python -m softvox_gym explore --out site/html/app/landscape.html
	$(VENV)-docs/bin/python tools/links.py site/html

# A wheel for any Linux not older than its tag says, into wheelhouse, what a registry asks of it, and
# a fresh environment with it on each Python here. It is abi3: one for all Pythons.
PYTHONS ?= python3.11 python3.12 python3.13 python3.14
wheels: $(VENV)-package/installed sdist
	rm -rf build wheelhouse
	$(VENV)-package/bin/python -m build --wheel --outdir dist . > /dev/null
	PATH="$(abspath $(VENV)-package/bin):$$PATH" $(VENV)-package/bin/auditwheel repair \
		--wheel-dir wheelhouse dist/*.whl
	$(VENV)-package/bin/twine check --strict dist/*.tar.gz wheelhouse/*.whl
	$(VENV)-package/bin/check-wheel-contents wheelhouse/*.whl
	$(VENV)-package/bin/pyroma --min 10 .
	for python in $(PYTHONS); do \
		$$python --version 2> /dev/null || { echo "$$python is not here"; continue; }; \
		$$python -m venv --clear $(VENV)-wheel && \
		$(VENV)-wheel/bin/python -m pip install --quiet --only-binary :all: wheelhouse/*.whl && \
		(cd / && "$(abspath $(VENV)-wheel)/bin/softvox" verify) || exit 1; done

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

trials: $(VENV)/installed
	$(BIN)/python tools/trials.py

phased: $(VENV)/installed
	$(BIN)/python tools/phased.py

step-error: $(VENV)/installed
	$(BIN)/python tools/step_error.py

# Random batches: the same bits from every seating, instruction set and pause. Ten minutes.
FUZZ ?= 20000
fuzz: $(VENV)/installed
	$(BIN)/python tools/fuzz.py --count $(FUZZ)

sdist:
	rm -rf dist
	$(PYTHON) -m venv $(VENV)-sdist
	$(VENV)-sdist/bin/python -m pip install --quiet build
	$(VENV)-sdist/bin/python -m build --sdist --outdir dist . > /dev/null

# In under ten minutes; APPEND=--append adds the rows to the tables in benchmarks.
benchmark: $(VENV)/installed
	$(BIN)/python benchmarks/engine.py --repeat 3 $(APPEND)
	$(BIN)/python benchmarks/bodies.py $(APPEND)

# The committed pictures; anew after a change of how they look.
pictures: $(VENV)/installed
	$(BIN)/python tools/architecture.py
	$(BIN)/python tools/pictures.py
	$(BIN)/python benchmarks/bodies.py --draw
	$(BIN)/softvox replay 6453 --fps 14 --speed 1 --force --out docs/6453.gif
	$(BIN)/softvox replay 1286931 --phases 4 --fps 10 --speed 1 --width 400 --force --out docs/environments/phased.gif
	SOFTVOX_PICTURES=docs $(BIN)/python -m pytest tests/view/test_explore_browser.py -k readme

clean:
	rm -rf $(VENV) $(VENV)-* build dist site wheelhouse src/*.egg-info *.egg-info src/softvox_gym/_engine.*
