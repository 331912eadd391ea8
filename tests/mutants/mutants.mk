# Targets for the night: `make nightly` runs them; none is part of `make test`.
.PHONY: test-long test-crash mutants

# tests that know a long variant (tests/support/agreement.h)
TEST_LONG := physics/test_naive physics/volume/test_volume_naive physics/test_derivative_check physics/test_derivative \
	physics/test_chi_square physics/test_energy_bound physics/test_reconstruct_phantom physics/test_scan_trial unit/renderer/scattering/test_scattering
TEST_LONG_PYTHON := tests/physics/exact tests/real tests/api/driven tests/api/worker/test_correction_job.py tests/api/worker/test_several_models.py
test-long: | deps-test ## the renderer against the naive tracers with enough paths to see a difference of 0.5 %, its scene against the exact one, every model at every place, both real scans, all phantoms, the boundary cases of the description of the API (half an hour on 2 quiet cores for the first, the rest not timed)
	@$(MAKE) --no-print-directory -j$$(nproc) all $(EXACT_BINS) $(addprefix $(BUILD)/tests/,$(TEST_LONG))
	@for t in $(TEST_LONG); do echo "$$t"; SELVEDGE_TEST_LONG=1 $(BUILD)/tests/$$t || exit 1; done
	@SELVEDGE_TEST_LONG=1 SELVEDGE_BUILD=$(CURDIR)/$(BUILD) /usr/bin/python3 -m pytest -q -p no:cacheprovider $(TEST_LONG_PYTHON)

# every system call, every state of a disk and 2,000 kills, where make test takes a sample
KILLS ?= 2000
test-crash: | deps-test ## kills (KILLS: 2000), faults at every system call, every state after a power cut (an hour)
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@SELVEDGE_EVERY=1 SELVEDGE_KILLS=$(KILLS) SELVEDGE_BUILD=$(CURDIR)/$(BUILD) \
		/usr/bin/python3 -m pytest -q -s -p no:cacheprovider tests/crash

# COVERED: sources whose lines are counted (tests/mutants/line_coverage.py). The worker then runs without its sandbox, from
# which no counters could be written
ifneq ($(COVERED),)
$(COVERED:%=$(BUILD)/obj/%.o) $(COVERED:%=$(BUILD)/obj/shared/%.o): CFLAGS_ALL += --coverage -fprofile-update=atomic -O0
$(BUILD)/obj/optimizer/worker/sandbox/worker_confine.c.o: CFLAGS_ALL += -DSELVEDGE_NO_SANDBOX
endif

# PART: one of the parts of tests/mutants/parts.py, or only files whose path begins so. WHOLE=1: parts of the whole tree.
# AGAIN=1: those of the last run that were not caught. The copy of the tree and all results stay in build/mutants.
MUTANTS ?= 200
SEED ?= 1
MUTANT_SECONDS ?= 60
MUTANT_JUDGES ?= 2
mutants: | deps-test ## a gate: MUTANTS (200) small faults, one at a time, in a copy of the tree, of which the tests must catch 95 % (SEED, PART, WHOLE, AGAIN, MUTANT_SECONDS, MUTANT_JUDGES)
	@/usr/bin/python3 tests/mutants/run_mutants.py --mutants $(MUTANTS) --seed $(SEED) --limit-s $(MUTANT_SECONDS) --judges $(MUTANT_JUDGES) \
		$(if $(PART),--part $(PART)) $(if $(WHOLE),--whole) $(if $(AGAIN),--again)
