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

PKGS := OpenEXR libmicrohttpd jansson sqlite3 libsodium inih libtiff-4 uuid nlopt zlib libzstd libarchive libpng libjpeg libraw_r lcms2 hdf5-serial libcurl libseccomp
PKG_CFLAGS := $(shell pkg-config --cflags $(PKGS) 2>/dev/null | tr ' ' '\n' | sed 's/^-I/-isystem /' | tr '\n' ' ') -isystem /usr/include/opencv4
# fields left out of an initialiser are zero, and zero is made to mean the usual thing
WARN := -Wall -Wextra -Wpedantic -Wshadow -Wno-missing-field-initializers
ifeq ($(findstring clang,$(CC)),)
WARN += -Wno-format-truncation
endif
WARN_C := $(WARN) -Wconversion -Wstrict-prototypes
WERROR ?= -Werror
COMMON := -g1 $(OPTIMIZE) $(MACHINE) -fno-math-errno -fno-trapping-math -I. -I$(BUILD) $(PKG_CFLAGS) $(WERROR)
ifneq ($(SANITIZE),)
# the sanitizers need more than the sandbox of a worker permits
COMMON += -fsanitize=$(SANITIZE) -fno-omit-frame-pointer -DSELVEDGE_NO_SANDBOX
LDFLAGS += -fsanitize=$(SANITIZE)
# gcc 12 reports overflows of arrays [2][2] that are none once the sanitizer's checks are part of the code
ifeq ($(findstring clang,$(CC)),)
COMMON += -Wno-stringop-overflow
endif
endif
CFLAGS_ALL := -std=c17 -D_GNU_SOURCE -pthread $(COMMON) $(WARN_C) $(CFLAGS)
CXXFLAGS_ALL := -std=c++17 -pthread $(COMMON) $(WARN) $(CXXFLAGS)

# code that waits for files, clients and other programs is compiled in less time
ifeq ($(OPTIMIZE),-O3)
WAITING := server clients optimizer/job optimizer/report optimizer/stages optimizer/tools optimizer/worker tests/unit/server \
           tests/unit/clients tests/unit/optimizer
$(foreach d,$(WAITING),$(eval $(BUILD)/obj/$(d)/%.c.o: CFLAGS_ALL += -O1))
endif

# every *_main.c is a program; everything else in its part goes into the part's library
MAINS := $(shell find base geometry renderer optimizer server clients -name '*_main.c' 2>/dev/null)
# every *_plugin.c is a shared object, which is built where its library is
srcs = $(filter-out %_main.c %_plugin.c,$(shell find $(1) -name '*.c' -o -name '*.cpp' 2>/dev/null | sort))
objs = $(patsubst %,$(BUILD)/obj/%.o,$(1))
PARTS := base geometry renderer job optimizer server
folder_base := base
folder_geometry := geometry
folder_renderer := renderer
folder_job := optimizer/job
folder_optimizer := $(addprefix optimizer/,photographs fit stages report worker tools)
folder_server := server
LIBS := $(foreach p,$(PARTS),$(BUILD)/lib/lib$(p).a)

PROGRAMS := $(BUILD)/bin/selvedge $(BUILD)/bin/selvedged $(BUILD)/bin/selvedge-worker $(BUILD)/bin/selvedge-phantom $(BUILD)/bin/selvedge-camera
PLUGINS := $(if $(shell pkg-config --exists libpq 2>/dev/null && echo yes),$(BUILD)/lib/selvedge-postgresql.so)
# ranks of a job: built where Open MPI is installed, without which everything else works
OPENMPI := $(shell pkg-config --exists ompi-c 2>/dev/null && echo yes)
ifneq ($(OPENMPI),)
PROGRAMS += $(BUILD)/bin/selvedge-mpi
endif
LINK_BASE := -lz -lm -pthread -Wl,--undefined=processor_required
LINK_GEOMETRY := $(shell pkg-config --libs libtiff-4 libzstd hdf5-serial 2>/dev/null) -Wl,--as-needed -lopencv_mcc -lopencv_aruco -Wl,--no-as-needed -lopencv_imgproc -lopencv_core -lstdc++ $(LINK_BASE)
LINK_RENDERER := -lembree3 -lOpenEXRCore -lpng -llcms2 $(LINK_GEOMETRY)
LINK_OPTIMIZER := -lseccomp -lraw_r -ljpeg -lnlopt -ljansson -lsodium -larchive $(LINK_RENDERER)
LINK_WAVE := -llapacke # the solver of waves, which no installed program contains
LINK_SERVER := -lmicrohttpd -lgnutls -ljansson -lsqlite3 -lsodium -linih -luuid -larchive -lcurl $(LINK_BASE)

.PHONY: all generate medulla-tables wave-tables speckle-tables deps help check test nightly demo demo-camera night examples cluster-demo clean
##@ Build and run
all: $(PROGRAMS) $(PLUGINS) ## build the programs into build/bin

deps:              ## install the Debian packages that are missing (as root or through sudo)
	@./config/install-dependencies build

demo: | deps       ## the main job, end to end, against a daemon started here
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@./clients/demo.sh

demo-camera: | deps ## the same from raw files of a simulated camera: noise, three exposures, markers, color chart
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@./clients/demo.sh --camera

night: | deps      ## a night's run: ten synthetic samples in a watched folder (a few minutes; docs/automation.md)
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@./clients/night.sh

examples: | deps   ## the files of three small jobs in examples/: a scan with photographs, a scan with a table, a described cloth
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@python3 clients/make_examples.py --bin $(BUILD)/bin examples

cluster-demo:      ## a batch of six samples on a Slurm of two virtual nodes started here, a worker killed, results compared (docs/cluster.md)
	@./config/install-dependencies cluster
	@$(MAKE) --no-print-directory -j$$(nproc) all
	@SELVEDGE_BUILD=$(BUILD) /usr/bin/python3 tests/slurm/cluster_demo.py

clean:             ## remove build/
	rm -rf build

help:              ## list the targets
	@awk -F ':[^#]*## ' '/^##@ /{printf "\n%s\n", substr($$0, 5)} /^[a-z0-9-]+:.*## /{printf "  %-18s %s\n", $$1, $$2}' \
		$(MAKEFILE_LIST)

# tables whose rows stand beside the code that they are about: the file, the macro of a row, the sources. A row ends at a blank
# line
define gathered
$$(BUILD)/generated/$(1): $(3)
	@mkdir -p $$(@D)
	@awk '/^$(2)\(/ {row = 1} /^$$$$/ {row = 0} row {print}' $$^ > $$@.new
	@cmp -s $$@.new $$@ && rm $$@.new || mv $$@.new $$@
GENERATED += $$(BUILD)/generated/$(1)
endef
# (the commonest format is named first in messages)
FORMATS := $(sort $(wildcard geometry/volume/format/*.c))
$(eval $(call gathered,volume_formats.def,VOLUME_FORMAT,geometry/volume/format/tiff_source.c $(filter-out %/tiff_source.c,$(FORMATS))))
$(eval $(call gathered,exports.def,EXPORT,$(sort $(wildcard optimizer/report/*/export_*.c))))
$(eval $(call gathered,cli_commands.def,CLI_COMMAND,$(sort $(shell find clients/cli -name '*.c'))))

# files that programs write as they are: their bytes as an initialiser
$(BUILD)/generated/selvedge_fiber.bytes: optimizer/report/export/selvedge_fiber.py
	@mkdir -p $(@D)
	@od -An -v -tu1 $< | sed 's/\([0-9][0-9]*\)/\1,/g' > $@
GENERATED += $(BUILD)/generated/selvedge_fiber.bytes

define part_rule
$(BUILD)/lib/lib$(1).a: $$(call objs,$$(call srcs,$$(folder_$(1))))
	@mkdir -p $$(@D)
	@rm -f $$@
	@ar rcs $$@ $$^
endef
$(foreach p,$(PARTS),$(eval $(call part_rule,$(p))))

$(BUILD)/obj/%.c.o: %.c | $(GENERATED)
	@mkdir -p $(@D)
	@echo "  CC   $<"
	@$(CC) $(CFLAGS_ALL) -MMD -MP -c $< -o $@
$(BUILD)/obj/%.cpp.o: %.cpp
	@mkdir -p $(@D)
	@echo "  C++  $<"
	@$(CXX) $(CXXFLAGS_ALL) -MMD -MP -c $< -o $@

# inner loops of the geometry that round a product and a sum once, in one instruction; clang does so without being told
FUSED := fibers/lines/segment_bricks fibers/lines/segment_distances fibers/axes/axis_brick \
         fibers/axes/model/nearest_segment fibers/axes/axis_compare fibers/slices/blob_response filter/line_filter
$(FUSED:%=$(BUILD)/obj/geometry/%.c.o): CFLAGS_ALL += -ffp-contract=fast
$(BUILD)/obj/renderer/scene/scene_grid_walk.c.o: CFLAGS_ALL += -ffp-contract=fast

# a program says what its processor lacks; the compiler may use that everywhere but here
ifeq ($(ARCH),x86_64)
$(BUILD)/obj/base/processor.c.o: CFLAGS_ALL += -march=x86-64
endif

L = $(BUILD)/lib/lib
$(BUILD)/bin/selvedge-worker: $(BUILD)/obj/optimizer/worker/worker_main.c.o $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ $(LINK_OPTIMIZER)
# (MPI's headers include casts that our warnings refuse)
$(BUILD)/obj/optimizer/worker/selvedge_mpi_main.c.o $(BUILD)/syntax/optimizer/worker/selvedge_mpi_main.c.ok: CFLAGS_ALL += $(patsubst -I%,-isystem %,$(shell pkg-config --cflags-only-I ompi-c 2>/dev/null))
$(BUILD)/bin/selvedge-mpi: $(BUILD)/obj/optimizer/worker/selvedge_mpi_main.c.o
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ $(shell pkg-config --libs ompi-c)
$(BUILD)/bin/selvedge-phantom: $(BUILD)/obj/optimizer/tools/phantom/phantom_main.c.o $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ $(LINK_OPTIMIZER)
$(BUILD)/bin/selvedge-camera: $(BUILD)/obj/optimizer/tools/camera/camera_main.c.o $(L)optimizer.a $(L)job.a $(L)renderer.a $(L)geometry.a $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ $(LINK_OPTIMIZER)
$(BUILD)/bin/selvedged: $(BUILD)/obj/server/main/daemon_main.c.o $(L)server.a $(L)job.a $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ $(LINK_SERVER)
# nothing but the daemon, when its settings ask for it, loads libpq
$(BUILD)/lib/selvedge-postgresql.so: $(addprefix $(BUILD)/obj/shared/,server/store/drivers/postgres_plugin.c.o base/utf8.c.o)
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -shared -Wl,--exclude-libs,ALL -o $@ $^ -lpq
$(BUILD)/obj/shared/%.c.o: %.c
	@mkdir -p $(@D)
	@echo "  CC   $<"
	@$(CC) $(CFLAGS_ALL) -fPIC $(shell pkg-config --cflags libpq 2>/dev/null | sed 's/-I/-isystem /g') -MMD -MP -c $< -o $@
$(BUILD)/bin/selvedge: $(call objs,$(shell find clients/cli -name '*.c' ! -name print_commands_main.c 2>/dev/null)) $(L)base.a
	@mkdir -p $(@D)
	$(CC) $(LDFLAGS) -o $@ $^ -lcurl -ljansson -lsodium -lwebpmux -lwebp -lpng $(LINK_BASE)

# the commands of selvedge as JSON: of this the manual page and the completion of shells are made
PRINT_COMMANDS := $(BUILD)/tools/print-commands
$(PRINT_COMMANDS): $(call objs,$(wildcard clients/cli/arguments/*.c clients/cli/text/cli_text.c)) $(L)base.a
	@mkdir -p $(@D)
	@$(CC) $(LDFLAGS) -o $@ $^ -ljansson $(LINK_BASE)

# the option table as JSON: of this the description of the API, the guide's table and the form of the dashboard are made
PRINT_OPTIONS := $(BUILD)/tools/print-options
$(PRINT_OPTIONS): $(BUILD)/obj/optimizer/job/options/print_options_main.c.o $(L)job.a $(L)base.a
	@mkdir -p $(@D)
	@$(CC) $(LDFLAGS) -o $@ $^ $(LINK_SERVER)
generate: $(PRINT_OPTIONS) $(BUILD)/bin/selvedge-worker ## write what follows from the tables of options, models and endpoints: config/openapi.json, tables in docs/ and of the daemon
	@/usr/bin/python3 config/generate_options.py $(PRINT_OPTIONS)
	@/usr/bin/python3 config/generate_model_tables.py $(BUILD)/bin/selvedge-worker
	@/usr/bin/python3 config/generate_endpoints.py

# tables of light that is scattered in the medulla of a hair, checked in as source; made again after a change of their grid
MEDULLA := renderer/scattering/models/fur
$(BUILD)/tools/medulla-tables: $(BUILD)/obj/$(MEDULLA)/medulla_tables_main.c.o $(L)renderer.a $(L)base.a
	@mkdir -p $(@D)
	@$(CC) $(LDFLAGS) -o $@ $^ $(LINK_BASE)
medulla-tables: $(BUILD)/tools/medulla-tables ## make the tables of the medulla of fur.v1 again (a minute on two cores)
	@$(BUILD)/tools/medulla-tables $(MEDULLA)

# tables of waves that fibers scatter, checked in as source; made again after a change of a section or of the mean over sizes
WAVE := renderer/scattering/models/wave
$(BUILD)/tools/wave-tables: $(BUILD)/obj/$(WAVE)/wave_tables_main.c.o $(BUILD)/obj/$(WAVE)/wave_sections.c.o \
		$(patsubst %,$(BUILD)/obj/%.o,$(wildcard renderer/scattering/models/wave/solver/*.c)) $(L)base.a
	@mkdir -p $(@D)
	@$(CC) $(LDFLAGS) -o $@ $^ $(LINK_WAVE) $(LINK_BASE)
wave-tables: $(BUILD)/tools/wave-tables ## make the tables of wave_silk.v2 and its like again (twenty minutes of a core; half of it with libopenblas0-serial)
	@$(BUILD)/tools/wave-tables $(WAVE)

# tables of speckle, checked in as source; made again after a change of a section, of the roughness or of the bands
$(BUILD)/tools/speckle-tables: $(addprefix $(BUILD)/obj/$(WAVE)/,speckle_tables_main.c.o speckle_instances.c.o) $(BUILD)/obj/renderer/scattering/speckle.c.o \
		$(BUILD)/obj/$(WAVE)/wave_sections.c.o $(patsubst %,$(BUILD)/obj/%.o,$(wildcard renderer/scattering/models/wave/solver/*.c)) $(L)base.a
	@mkdir -p $(@D)
	@$(CC) $(LDFLAGS) -o $@ $^ $(LINK_WAVE) $(LINK_BASE)
speckle-tables: $(BUILD)/tools/speckle-tables ## make the tables of speckle of wave_silk.v2 and its like again (three minutes of a core)
	@$(BUILD)/tools/speckle-tables $(WAVE)/wave_speckle.c

include config/install.mk
include tests/exact/exact.mk
include tests/tests.mk
include tests/zoo/zoo.mk
include tests/mutants/mutants.mk
include tests/bench/bench.mk
include tests/checks.mk

-include $(shell find $(BUILD)/obj -name '*.d' 2>/dev/null)
