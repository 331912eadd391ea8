# Selvedge. `make help` lists the targets.
SHELL := /bin/bash
BUILD ?= build
CC ?= cc
CXX ?= c++
SANITIZE ?=
OPTIMIZE ?= -O3
ifeq ($(origin CC),default)
CC := gcc
endif

ARCH := $(shell uname -m)
ifeq ($(ARCH),x86_64)
MACHINE ?= -march=x86-64-v3
endif

PKGS := OpenEXR libmicrohttpd jansson sqlite3 libsodium inih libtiff-4 uuid nlopt zlib libzstd libarchive libpng libcurl
PKG_CFLAGS := $(shell pkg-config --cflags $(PKGS) 2>/dev/null | tr ' ' '\n' | sed 's/^-I/-isystem /' | tr '\n' ' ') -isystem /usr/include/opencv4
# fields left out of an initialiser are zero, and zero is made to mean the usual thing
WARN := -Wall -Wextra -Wpedantic -Wshadow -Wno-format-truncation -Wno-missing-field-initializers
WARN_C := $(WARN) -Wconversion -Wstrict-prototypes
WERROR ?= -Werror
COMMON := -g $(OPTIMIZE) $(MACHINE) -fno-math-errno -fno-trapping-math -I. $(PKG_CFLAGS) $(WERROR)
ifneq ($(SANITIZE),)
COMMON += -fsanitize=$(SANITIZE) -fno-omit-frame-pointer
LDFLAGS += -fsanitize=$(SANITIZE)
endif
CFLAGS_ALL := -std=c17 -D_GNU_SOURCE -pthread $(COMMON) $(WARN_C) $(CFLAGS)
CXXFLAGS_ALL := -std=c++17 -pthread $(COMMON) $(WARN) $(CXXFLAGS)

# every *_main.c is a program; everything else in its part goes into the part's library
MAINS := $(shell find base geometry renderer optimizer server clients -name '*_main.c' 2>/dev/null)
srcs = $(filter-out %_main.c,$(shell find $(1) -name '*.c' -o -name '*.cpp' 2>/dev/null | sort))
objs = $(patsubst %,$(BUILD)/obj/%.o,$(1))
PARTS := base geometry renderer job optimizer server
folder_base := base
folder_geometry := geometry
folder_renderer := renderer
folder_job := optimizer/job
folder_optimizer := optimizer/fit optimizer/worker optimizer/phantom
folder_server := server
LIBS := $(foreach p,$(PARTS),$(BUILD)/lib/lib$(p).a)

PROGRAMS := $(BUILD)/bin/selvedge $(BUILD)/bin/selvedged $(BUILD)/bin/selvedge-worker $(BUILD)/bin/selvedge-phantom
LINK_BASE := -lz -lm -pthread
LINK_GEOMETRY := $(shell pkg-config --libs libtiff-4 libzstd 2>/dev/null) -lopencv_imgproc -lopencv_core -lstdc++ $(LINK_BASE)
LINK_RENDERER := -lembree3 -lOpenEXRCore -lpng $(LINK_GEOMETRY)
LINK_OPTIMIZER := -lnlopt -ljansson -lsodium -larchive $(LINK_RENDERER)
LINK_SERVER := -lmicrohttpd -ljansson -lsqlite3 -lsodium -linih -luuid -larchive $(LINK_BASE)

.PHONY: all generate deps deps-test build-tests test check bench demo clean help layers format format-check asan asan-physics bench-geometry bench-transport bench-fit bench-published docs-fit-curve docs-grazing docs-pictures fuzz fuzz-programs
all: $(PROGRAMS)   ## build the programs into build/bin

help:              ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*##/\t/' | expand -t 20

define part_rule
$(BUILD)/lib/lib$(1).a: $$(call objs,$$(call srcs,$$(folder_$(1))))
	@mkdir -p $$(@D)
	@rm -f $$@
	@ar rcs $$@ $$^
endef
$(foreach p,$(PARTS),$(eval $(call part_rule,$(p))))

$(BUILD)/obj/%.c.o: %.c
	@mkdir -p $(@D)
	@echo "  CC   $<"
	@$(CC) $(CFLAGS_ALL) -MMD -MP -c $< -o $@
$(BUILD)/obj/%.cpp.o: %.cpp
	@mkdir -p $(@D)
	@echo "  C++  $<"
	@$(CXX) $(CXXFLAGS_ALL) -MMD -MP -c $< -o $@

L = $(BUILD)/lib/lib
$(BUILD)/bin/selvedge-worker: $(BUILD)/obj/optimizer/worker/worker_main.c.o $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ $(LINK_OPTIMIZER)
$(BUILD)/bin/selvedge-phantom: $(BUILD)/obj/optimizer/phantom/phantom_main.c.o $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ $(LINK_OPTIMIZER)
$(BUILD)/bin/selvedged: $(BUILD)/obj/server/daemon_main.c.o $(L)server.a $(L)job.a $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ $(LINK_SERVER)
$(BUILD)/bin/selvedge: $(call objs,$(shell find clients/cli -name '*.c' 2>/dev/null)) $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ -lcurl -ljansson -lsodium $(LINK_BASE)

# the option table as JSON: of this the description of the API, the guide's table and the form of the dashboard are made
PRINT_OPTIONS := $(BUILD)/tools/print-options
$(PRINT_OPTIONS): $(BUILD)/obj/optimizer/job/options/print_options_main.c.o $(L)job.a $(L)base.a
	@mkdir -p $(@D)
	@$(CC) $(LDFLAGS) -o $@ $^ $(LINK_SERVER)
generate: $(PRINT_OPTIONS) $(BUILD)/bin/selvedge-worker ## write what follows from the tables of options and models: config/openapi.json, tables in docs/
	@/usr/bin/python3 config/generate_options.py $(PRINT_OPTIONS)
	@/usr/bin/python3 config/generate_model_tables.py $(BUILD)/bin/selvedge-worker

# one test program per file tests/{unit,physics}/test_*.c
TESTS_C := $(shell find tests/unit tests/physics -name 'test_*.c' 2>/dev/null | sort)
TEST_BINS := $(patsubst %.c,$(BUILD)/%,$(TESTS_C))
PHYSICS_RENDERER := $(filter-out %reconstruct_phantom %reconstruct_real %fit_density,$(filter $(BUILD)/tests/physics/%,$(TEST_BINS)))
BENCH_BINS := $(patsubst %.c,$(BUILD)/%,$(shell find tests/bench -name 'bench_*.c' 2>/dev/null))
TEST_SUPPORT := $(call objs,$(shell find tests/support -name '*.c' 2>/dev/null))
$(BUILD)/tests/%: $(BUILD)/obj/tests/%.c.o $(TEST_SUPPORT) $(L)server.a $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
	@mkdir -p $(@D)
	@echo "  LINK $@"
	@$(CC) $(LDFLAGS) -o $@ $(filter %.o,$^) $(filter %.a,$^) -lcmocka $(LINK_SERVER) $(LINK_OPTIMIZER)
# bench_fit is more than one file
$(BUILD)/tests/bench/bench_fit: $(patsubst %,$(BUILD)/obj/tests/bench/%.c.o,fit_bench fit_tables fit_grazing)
.SECONDARY:

deps:              ## install what is missing (Debian packages, as root or through sudo)
	@./config/install-dependencies build

deps-test:
	@./config/install-dependencies test

build-tests: $(TEST_BINS) $(PRINT_OPTIONS)

check: | deps-test ## quick inner loop: unit tests, quick API tests and layer rules (< 2 minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all build-tests
	@/usr/bin/python3 tests/run_tests.py --quick --build $(BUILD)

test: | deps-test  ## everything; ends with "N passed, N failed"
	@$(MAKE) --no-print-directory -j$$(nproc) all build-tests
	@/usr/bin/python3 tests/run_tests.py --build $(BUILD)

demo: | deps       ## the main job, end to end, against a daemon started here
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@./clients/demo.sh

bench: | deps-test ## every figure, one JSON object a line
	@$(MAKE) --no-print-directory -j$$(nproc) all $(BENCH_BINS) >&2
	@/usr/bin/python3 tests/bench/run_bench.py --build $(BUILD)

bench-transport: | deps-test ## the renderer's figures (paths a second, time to a given standard error, memory)
	@$(MAKE) --no-print-directory -j$$(nproc) all $(filter %transport,$(BENCH_BINS)) >&2
	@for b in $(filter %transport,$(BENCH_BINS)); do $$b || exit 1; done

bench-geometry: | deps-test ## accuracy of reconstructed fibers on phantoms and real scans; time and memory
	@$(MAKE) --no-print-directory -j$$(nproc) all $(filter %/bench_geometry %/bench_geometry_size,$(BENCH_BINS)) >&2
	@for b in $(filter %/bench_geometry %/bench_geometry_size,$(BENCH_BINS)); do $$b || exit 1; done

# FIT: some of the figures only, such as FIT="gabardine seeds"
bench-fit: | deps-test ## recovery of known parameters, errors, seeds, grazing highlights, real tables (1 h 45 min on 2 quiet cores; photographs are kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_fit >&2
	@$(BUILD)/tests/bench/bench_fit --folder $(BUILD)/bench-fit $(FIT)

# FABRIC: one of tests/support/cloth/fit_fabrics.c
bench-published: FABRIC ?= microflake
bench-published: | deps-test ## the published method with its own budget, 3.3e9 paths, on FABRIC (microflake: 80 minutes on 2 cores; gabardine: 8 hours; continues when stopped)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_fit >&2
	@nice -n 19 $(BUILD)/tests/bench/bench_fit --folder $(BUILD)/bench-fit --fabric $(FABRIC) --journal $(BUILD)/bench-fit/published-$(FABRIC).journal published

docs-fit-curve: | deps-test ## draw docs/images/fit-curve.svg anew: error against paths of both methods, analytic cloth (seconds)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_fit >&2
	@mkdir -p $(BUILD)/bench-fit docs/images
	@$(BUILD)/tests/bench/bench_fit analytic > $(BUILD)/bench-fit/analytic.json
	@/usr/bin/python3 tests/bench/plot_fit_curve.py $(BUILD)/bench-fit/analytic.json docs/images/fit-curve.svg

docs-grazing: | deps-test ## draw docs/images/microflake-grazing.svg anew: what each model makes of grazing highlights (minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_fit >&2
	@mkdir -p $(BUILD)/bench-fit docs/images
	@$(BUILD)/tests/bench/bench_fit --folder $(BUILD)/bench-fit grazing > $(BUILD)/bench-fit/grazing.json
	@/usr/bin/python3 tests/bench/plot_grazing.py $(BUILD)/bench-fit/grazing.json docs/images/microflake-grazing.svg

docs-pictures: | deps-test ## render docs/images/{twill,derivatives}.png anew (minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/documentation_pictures
	@mkdir -p docs/images
	@$(BUILD)/tests/bench/documentation_pictures twill docs/images/twill.png
	@$(BUILD)/tests/bench/documentation_pictures derivatives docs/images/derivatives.png

layers:            ## includes and calls go one way, the daemon holds no symbol of the computing parts, headers say their purpose, functions and files are short
	@/usr/bin/python3 tests/check_layers.py --build $(BUILD)
	@/usr/bin/python3 tests/check_calls.py --build $(BUILD)
	@/usr/bin/python3 tests/check_code.py

asan: | deps-test ## unit and quick API tests under the address and undefined-behaviour sanitizers
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/asan SANITIZE=address,undefined OPTIMIZE=-O1 all build-tests
	@/usr/bin/python3 tests/run_tests.py --quick --build build/asan

asan-physics: | deps-test ## the renderer's physics tests under the same sanitizers (an hour or more when the machine is busy)
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/asan SANITIZE=address,undefined OPTIMIZE=-O2 \
		$(patsubst $(BUILD)/%,build/asan/%,$(PHYSICS_RENDERER))
	@for t in $(patsubst $(BUILD)/%,build/asan/%,$(PHYSICS_RENDERER)); do \
		echo "$$t"; UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 $$t || exit 1; done

# one libFuzzer program per file tests/fuzz/fuzz_*.c (fuzz_input.c is what they share)
FUZZ_SECONDS ?= 600
FUZZ ?=
FUZZ_C := $(filter-out tests/fuzz/fuzz_input.c,$(wildcard tests/fuzz/fuzz_*.c))
FUZZ_BINS := $(patsubst %.c,$(BUILD)/%,$(FUZZ_C))
FUZZ_LIBS := $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
$(FUZZ_BINS): $(BUILD)/%: $(BUILD)/obj/%.c.o $(BUILD)/obj/tests/fuzz/fuzz_input.c.o $(FUZZ_LIBS)
	@mkdir -p $(@D)
	@echo "  LINK $@"
	@$(CC) $(LDFLAGS) -fsanitize=fuzzer -o $@ $^ $(LINK_OPTIMIZER)
$(BUILD)/tests/fuzz/make_fuzz_seeds: $(BUILD)/obj/tests/fuzz/make_fuzz_seeds.c.o $(FUZZ_LIBS)
	@mkdir -p $(@D)
	@$(CC) $(LDFLAGS) -o $@ $^ $(LINK_OPTIMIZER)
fuzz-programs: $(FUZZ_BINS) $(BUILD)/tests/fuzz/make_fuzz_seeds

fuzz: | deps       ## every parser under libFuzzer for FUZZ_SECONDS (600) each
	@./config/install-dependencies fuzz
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/fuzz CC=clang CXX=clang++ WERROR=-w OPTIMIZE=-O1 \
		SANITIZE=fuzzer-no-link,address,undefined,float-cast-overflow CFLAGS=-fno-sanitize-recover=all fuzz-programs
	@tests/fuzz/run_fuzz.sh build/fuzz $(FUZZ_SECONDS) $(FUZZ)

# clang-format 14, that of Debian 12: other versions break lines elsewhere
FORMATTED = $(shell find base geometry renderer optimizer server clients tests -name '*.[ch]' -o -name '*.cpp')
format:            ## format the C sources with clang-format 14
	@clang-format-14 -i $(FORMATTED)

format-check:      ## fails when a C source is not formatted as `make format` would
	@clang-format-14 --dry-run -Werror $(FORMATTED) && echo "format ok"

include tests/mutants/mutants.mk

clean:             ## remove build/
	rm -rf build

-include $(shell find $(BUILD)/obj -name '*.d' 2>/dev/null)
