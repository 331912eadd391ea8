# Checks of the sources. `make test` and `make check` count each of them as a test.
.PHONY: every-source layers format format-check columns clang clang-tests lint lint-c lint-javascript lint-python lint-shell lint-words
# clang-format 14, that of Debian 12: other versions break lines elsewhere
FORMATTED = $(shell find base geometry renderer optimizer server clients tests -name '*.[ch]' -o -name '*.cpp')
SHELL_SCRIPTS = $(shell git ls-files '*.sh') config/install-dependencies .ci/run

##@ Checks of the sources
format:            ## format the C sources with clang-format 14
	@clang-format-14 -i $(FORMATTED)

format-check:      ## fails when a C source is not formatted as `make format` would
	@clang-format-14 --dry-run -Werror $(FORMATTED) && echo "format ok"

layers:            ## includes and calls go one way, in each part from folder to folder, the daemon holds no symbol of the computing parts, headers say their purpose, functions and files are short
	@/usr/bin/python3 tests/check_layers.py --build $(BUILD)
	@/usr/bin/python3 tests/check_folders.py
	@/usr/bin/python3 tests/check_calls.py --build $(BUILD)
	@/usr/bin/python3 tests/check_code.py

columns:           ## no line of a C source is longer than 120 columns, comments included
	@/usr/bin/python3 tests/check_columns.py $(FORMATTED)

# what gcc compiles in `make test` is compiled with clang as well, but for tests/unit and tests/physics, which only
# `make clang-tests` compiles; benchmarks and fuzzers, which no other target of continuous integration compiles, are part
# of it. Nothing but errors and warnings is made
CLANG_TOO ?=
SOURCES = $(shell find $(foreach p,$(PARTS),$(folder_$p)) clients/cli tests -name '*.c' -o -name '*.cpp')
# shared objects, which have rules of their own, and what needs a library that may be missing
APART = tests/crash/fault_shim.c tests/bench/clock/cpu_clock.c %_plugin.c $(if $(OPENMPI),,optimizer/worker/selvedge_mpi_main.c) \
	$(if $(CLANG_TOO),,tests/unit/% tests/physics/%)
$(BUILD)/syntax/%.c.ok: %.c | $(GENERATED)
	@mkdir -p $(@D)
	@$(CC) $(CFLAGS_ALL) -fsyntax-only -MMD -MP -MF $(@:.ok=.d) -MT $@ $< && touch $@
$(BUILD)/syntax/%.cpp.ok: %.cpp
	@mkdir -p $(@D)
	@$(CXX) $(CXXFLAGS_ALL) -fsyntax-only -MMD -MP -MF $(@:.ok=.d) -MT $@ $< && touch $@
every-source: $(patsubst %,$(BUILD)/syntax/%.ok,$(filter-out $(APART),$(SOURCES))) $(PLUGINS)
-include $(shell find $(BUILD)/syntax -name '*.d' 2>/dev/null)

clang:             ## clang reads every source but C tests, benchmarks and fuzzers as well, without a warning (gcc does in every build)
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/clang CC=clang CXX=clang++ OPTIMIZE=-O0 CLANG_TOO=$(CLANG_TOO) every-source
	@echo "clang ok"
clang-tests:       ## the same with the C tests
	@$(MAKE) --no-print-directory clang CLANG_TOO=1

lint: lint-c lint-javascript lint-python lint-shell lint-words ## all of the next five

# without tests: cppcheck does not know that cmocka's assertions end a test
lint-c: $(GENERATED) ## cppcheck, of files that have changed; which checks: config/cppcheck.txt
	@mkdir -p $(BUILD)/cppcheck
	@cppcheck --quiet -j$$(nproc) --cppcheck-build-dir=$(BUILD)/cppcheck -I$(BUILD) $$(grep -v '^#' config/cppcheck.txt) \
		base geometry renderer optimizer server clients/cli && echo "cppcheck ok"

lint-javascript:   ## the TypeScript compiler as a checker of the dashboard: config/javascript.json
	@tsc --project config/javascript.json && echo "javascript ok"

lint-python:       ## flake8: .flake8
	@/usr/bin/python3 -m flake8 && echo "python ok"

lint-shell:        ## shellcheck
	@shellcheck $(SHELL_SCRIPTS) && echo "shell ok"

lint-words:        ## pronouns in place of nouns in the comments of C sources stay below a bar (tests/check_words.py)
	@/usr/bin/python3 tests/check_words.py
