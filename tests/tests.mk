# Tests: their programs, and the targets that run them. tests/README.md says what each one is.
.PHONY: test-cluster-kills test-postgresql screens tsan tsan-requests test-watched-folder test-slurm deps-test build-tests asan asan-physics fuzz fuzz-smoke fuzz-programs coverage
# one test program per file tests/{unit,physics}/test_*.c
TESTS_C := $(shell find tests/unit tests/physics -name 'test_*.c' 2>/dev/null | sort)
TEST_BINS := $(patsubst %.c,$(BUILD)/%,$(TESTS_C))
PHYSICS_RENDERER := $(filter-out %reconstruct_phantom %reconstruct_real %fit_density %fit_groups,$(filter $(BUILD)/tests/physics/%,$(TEST_BINS)))
TEST_SUPPORT := $(call objs,$(shell find tests/support -name '*.c' 2>/dev/null))
# gold (of binutils) links these 200 programs in half the time; another linker of LDFLAGS comes later and is taken
TEST_LINKER := $(if $(shell command -v ld.gold),-fuse-ld=gold)
# an archive, so that a test contains only the support that it uses
$(L)support.a: $(TEST_SUPPORT)
	@mkdir -p $(@D)
	@rm -f $@
	@ar rcs $@ $^
$(BUILD)/tests/%: $(BUILD)/obj/tests/%.c.o $(L)support.a $(L)server.a $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
	@mkdir -p $(@D)
	@echo "  LINK $@"
	@$(CC) $(TEST_LINKER) $(LDFLAGS) -o $@ $(filter %.o,$^) $(filter %.a,$^) -lcmocka $(LINK_TEST) $(LINK_SERVER) $(LINK_OPTIMIZER)
$(BUILD)/tests/physics/wave/%: LINK_TEST := $(LINK_WAVE)
.SECONDARY:

##@ Tests
deps-test:         ## install what the tests need as well
	@./config/install-dependencies test

build-tests: $(TEST_BINS) $(EXACT_BINS) $(PRINT_OPTIONS)

check: | deps-test ## quick inner loop: checks of the sources, unit tests, quick API tests (3 minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all build-tests
	@/usr/bin/python3 tests/run_tests.py --quick --build $(BUILD)

# The programs are compiled while packages that only tests need are installed; what needs one of these comes after.
test: | deps       ## everything that continuous integration runs; ends with "N passed, N failed"
	@$(MAKE) --no-print-directory -j$$(nproc) all & ./config/install-dependencies test; installed=$$?; \
		wait $$! && [ $$installed -eq 0 ]
	@$(MAKE) --no-print-directory -j$$(nproc) all build-tests zoo
	@$(MAKE) --no-print-directory $(EXPORTS_PYTHON)/bin/packages-are-there || \
		echo "no package index: exported scenes are not opened by Mitsuba, USD and MaterialX"
	@$(MAKE) --no-print-directory $(EXPORTS_NODE)/packages-are-there || \
		echo "no npm or no package index: exported glTF files are not opened by three.js and Khronos' validator"
	@/usr/bin/python3 tests/run_tests.py --build $(BUILD)

# PAGES: some of the browser tests only, such as PAGES=test_pairs.py
screens: | deps-test ## the browser tests, which then keep screenshots of the dashboard's pages in build/screens (ten minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@SELVEDGE_SCREENSHOTS="$(CURDIR)/$(BUILD)/screens" /usr/bin/python3 -m pytest -q $(addprefix tests/browser/,$(PAGES))$(if $(PAGES),,tests/browser)

# What takes too long for every commit. One part that fails does not keep the next from running.
NIGHTLY := asan tsan clang-tests fuzz-smoke coverage test-crash test-cluster-kills test-postgresql test-slurm test-long mutants
nightly:           ## asan, tsan, clang-tests, fuzz-smoke, coverage, test-crash, test-cluster-kills, test-postgresql, test-slurm, test-long and mutants: too long for every commit
	@failed=""; for part in $(NIGHTLY); do \
		echo "== $$part"; $(MAKE) --no-print-directory $$part || failed="$$failed $$part"; done; \
	[ -z "$$failed" ] || { echo "nightly: failed:$$failed"; exit 1; }

# tests ask for more memory than there is, and for how much a daemon takes, which the sanitizers change
asan: | deps-test  ## unit and quick API tests under the address and undefined-behaviour sanitizers
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/asan SANITIZE=address,undefined OPTIMIZE=-O1 all build-tests
	@ASAN_OPTIONS=allocator_may_return_null=1 SELVEDGE_SANITIZED=1 \
		/usr/bin/python3 tests/run_tests.py --quick --programs --build build/asan

# the requests of these tests come from many threads; a report ends the daemon with a code that no test accepts. The
# worker and the client, other processes, are those of the normal build
THREADED_TESTS ?= api/service api/access api/test_jobs_api api/test_uploads_api api/test_results_api api/test_supervision api/test_durable_replies
tsan: | deps-test  ## tests of the daemon under the thread sanitizer (three minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/tsan SANITIZE=thread OPTIMIZE=-O1 build/tsan/bin/selvedged
	@ln -sf $(foreach p,selvedge selvedge-worker selvedge-phantom,"$(CURDIR)/$(BUILD)/bin/$p") build/tsan/bin/
	@for t in $(THREADED_TESTS); do TSAN_OPTIONS="suppressions=$(CURDIR)/config/tsan.txt" SELVEDGE_SANITIZED=1 \
		/usr/bin/python3 tests/run_tests.py --quick --programs --only $$t --build build/tsan || exit 1; done

tsan-requests:     ## those where many requests meet: a part of `make test`
	@$(MAKE) --no-print-directory tsan THREADED_TESTS="api/service/test_list api/service/test_long_poll api/service/test_backup \
		api/service/test_service_cost api/service/test_webhook api/test_jobs_api api/test_uploads_api"

test-slurm: | deps-test ## jobs on a real Slurm of two virtual nodes: faults, restarts, time limits (five minutes, mostly of waiting)
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@SELVEDGE_BUILD=$(BUILD) /usr/bin/python3 -m pytest -q tests/slurm

# SAMPLES, KILLS: fewer for a quick look
test-watched-folder: | deps-test ## 100 samples dropped into a watched folder, real jobs, while the daemon is killed 20 times: each ends once (some minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@/usr/bin/python3 tests/crash/watched_folder_kills.py --build $(BUILD) $(if $(SAMPLES),--samples $(SAMPLES)) $(if $(KILLS),--kills $(KILLS))

# KILLS, SEED
test-cluster-kills: | deps-test ## two daemons on one PostgreSQL, killed 200 times: nothing acknowledged is lost, no job has two results (ten minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@SELVEDGE_BUILD=$(BUILD) /usr/bin/python3 tests/crash/cluster_kills.py $(if $(KILLS),--kills $(KILLS)) $(if $(SEED),--seed $(SEED))

# tests that open the file of SQLite, or ask for what only such a file has, are left out
STORE_TESTS := tests/api/test_jobs_api.py tests/api/test_uploads_api.py tests/api/test_results_api.py tests/api/test_supervision.py \
	tests/api/test_durable_replies.py tests/api/service/test_list.py tests/api/service/test_retention.py tests/api/access tests/api/batches
test-postgresql: | deps-test ## tests of the API with PostgreSQL in place of SQLite (five minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@SELVEDGE_BUILD=$(BUILD) SELVEDGE_TEST_STORE=postgresql /usr/bin/python3 -m pytest -q $(STORE_TESTS)

asan-physics: | deps-test ## the renderer's physics tests under the same sanitizers (an hour or more when the machine is busy)
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/asan SANITIZE=address,undefined OPTIMIZE=-O2 \
		$(patsubst $(BUILD)/%,build/asan/%,$(PHYSICS_RENDERER))
	@for t in $(patsubst $(BUILD)/%,build/asan/%,$(PHYSICS_RENDERER)); do \
		echo "$$t"; UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 $$t || exit 1; done

# one libFuzzer program per file fuzz_*.c of tests/fuzz and its folders (fuzz_input.c is what they share)
FUZZ_SECONDS ?= 600
FUZZ ?=
FUZZ_C := $(filter-out tests/fuzz/fuzz_input.c,$(wildcard tests/fuzz/fuzz_*.c tests/fuzz/*/fuzz_*.c))
FUZZ_BINS := $(patsubst %.c,$(BUILD)/%,$(FUZZ_C))
FUZZ_LIBS := $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
$(FUZZ_BINS): $(BUILD)/%: $(BUILD)/obj/%.c.o $(BUILD)/obj/tests/fuzz/fuzz_input.c.o $(FUZZ_LIBS)
	@mkdir -p $(@D)
	@echo "  LINK $@"
	@$(CC) $(LDFLAGS) -fsanitize=fuzzer -o $@ $^ $(LINK_OPTIMIZER)
$(BUILD)/tests/fuzz/make_fuzz_seeds: $(BUILD)/obj/tests/fuzz/make_fuzz_seeds.c.o $(BUILD)/obj/tests/support/camera_files.c.o $(FUZZ_LIBS)
	@mkdir -p $(@D)
	@$(CC) $(LDFLAGS) -o $@ $^ $(LINK_OPTIMIZER)
fuzz-programs: $(FUZZ_BINS) $(BUILD)/tests/fuzz/make_fuzz_seeds

fuzz: | deps       ## every parser under libFuzzer for FUZZ_SECONDS (600) each
	@./config/install-dependencies fuzz
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/fuzz CC=clang CXX=clang++ WERROR=-w OPTIMIZE=-O1 \
		SANITIZE=fuzzer-no-link,address,undefined,float-cast-overflow CFLAGS=-fno-sanitize-recover=all fuzz-programs
	@tests/fuzz/run_fuzz.sh build/fuzz $(FUZZ_SECONDS) $(FUZZ)

fuzz-smoke:        ## the same for 5 seconds each
	@$(MAKE) --no-print-directory fuzz FUZZ_SECONDS=5

# atomic counters: threads count together; no -Werror: with counters gcc no longer sees that a value is set
coverage: | deps-test ## lines that the unit and quick API tests reach: one JSON line, and a table of folders
	@./config/install-dependencies coverage
	@find build/coverage -name '*.gcda' -delete 2>/dev/null || true
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=build/coverage OPTIMIZE=-O2 WERROR= LDFLAGS=--coverage \
		CFLAGS='--coverage -fprofile-update=atomic -DSELVEDGE_NO_SANDBOX' all build-tests
	@/usr/bin/python3 tests/run_tests.py --quick --programs --build build/coverage
	@/usr/bin/python3 tests/coverage_report.py build/coverage
