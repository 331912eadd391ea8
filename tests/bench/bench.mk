# Benchmarks, and pictures of the documentation that come from them.
.PHONY: bench bench-thesis bench-house docs-benchmarks bench-service bench-scale bench-ranks docs-ranks bench-dashboard bench-cloth bench-scan-errors bench-progress bench-exact bench-exports exports-side-by-side bench-camera bench-geometry bench-geometry-bars bench-transport bench-models bench-chapter4 bench-glints bench-recovery bench-model-tables bench-fit bench-published docs-fit-curve docs-grazing docs-pairs docs-pictures docs-weave docs-columns docs-speckle docs-waves docs-lobes docs-fabrics gallery docs-ground docs-lame docs-seam docs-bowl bench-browser bench-comparison bench-looks bench-pictures bench-pile bench-sheared bench-tiles bench-weave bench-weave-rendered
BENCH_BINS := $(patsubst %.c,$(BUILD)/%,$(shell find tests/bench -name 'bench_*.c' 2>/dev/null))
$(BUILD)/tests/bench/models/bench_waves: LINK_TEST := $(LINK_WAVE)
# bench_fit is more than one file
$(BUILD)/tests/bench/bench_fit: $(patsubst %,$(BUILD)/obj/tests/bench/%.c.o,fit_bench fit_tables fit_grazing fit_analytic)
$(BUILD)/tests/bench/verdict/bench_verdict: $(BUILD)/obj/tests/bench/verdict/line_pulls.c.o
$(BUILD)/tests/bench/models/bench_recovery: $(BUILD)/obj/tests/bench/fit_bench.c.o
$(BUILD)/tests/bench/pictures/bench_pictures: $(patsubst %,$(BUILD)/obj/tests/bench/pictures/%.c.o,field_pair field_samples field_comparison)
$(BUILD)/tests/unit/renderer/test_field_comparison: $(BUILD)/obj/tests/bench/pictures/field_comparison.c.o

##@ Benchmarks and pictures
bench: | deps-test ## every figure, one JSON object a line (a night on 2 quiet cores)
	@$(MAKE) --no-print-directory -j$$(nproc) all $(BENCH_BINS) >&2
	@/usr/bin/python3 tests/bench/run_bench.py --build $(BUILD)

docs-benchmarks:   ## write docs/benchmarks.md from tests/bench/figures.jsonl and readings.txt (a second)
	@/usr/bin/python3 tests/bench/write_page.py

bench-transport: | deps-test ## the renderer's figures (paths a second, time to a given standard error, memory)
	@$(MAKE) --no-print-directory -j$$(nproc) all $(filter %transport,$(BENCH_BINS)) >&2
	@for b in $(filter %transport,$(BENCH_BINS)); do $$b || exit 1; done

# HOUSE=--times: also seconds of a clean build, of `make check` and of `make test`
bench-house:       ## figures of the source tree: circles, objects that a new option compiles anew, words
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/bench_house.py --build $(BUILD) $(HOUSE)

# EXACT: some of the cloths only, and options of the program, such as EXACT="velvet --paths 1048576"
bench-exact: | deps-test ## the renderer's scene against the cloth by definition: means, derivatives, tiles of any length, segments cut (five minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all $(EXACT_BINS) >&2
	@/usr/bin/python3 tests/exact/bench_exact.py --build $(BUILD) $(EXACT)

# MODELS: some of them only, such as MODELS="chiang.v1 elliptical.v1"
bench-models: | deps-test ## what every scattering model costs and what light it loses; fur fitted to profiles of single fibers; the solver of waves (four minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) $(addprefix $(BUILD)/tests/bench/models/,bench_models bench_profiles bench_waves) >&2
	@$(BUILD)/tests/bench/models/bench_models 4096 5 $(MODELS)
	@$(BUILD)/tests/bench/models/bench_profiles
	@$(BUILD)/tests/bench/models/bench_waves

# programs of tests/bench/glints, whose figures are glints.*
GLINT_BENCHES := $(filter $(BUILD)/tests/bench/glints/%,$(BENCH_BINS))
bench-glints: | deps-test ## glints of metal: accuracy and speed, by geometric and by wave optics (a minute)
	@$(MAKE) --no-print-directory -j$$(nproc) $(GLINT_BENCHES) >&2
	@for b in $(GLINT_BENCHES); do $$b || exit 1; done
# FIBERS: the first so many of the 14
bench-chapter4: | deps-test ## the ratio of the axes and the turn of simulated hair fibers, from R or TRT alone and from all modes (a quarter of an hour on 2 quiet cores)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/models/bench_chapter4 >&2
	@test $(BUILD)/bench-chapter4.kept -nt $(BUILD)/tests/bench/models/bench_chapter4 || rm -f $(BUILD)/bench-chapter4.kept
	@$(BUILD)/tests/bench/models/bench_chapter4 $(or $(FIBERS),14) $(BUILD)/bench-chapter4.kept
	@rm -f $(BUILD)/bench-chapter4.kept

# MODELS: as above
bench-recovery: | deps-test ## whether a fit of each surface model finds its own parameters again (an hour on 2 quiet cores; photographs are kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/models/bench_recovery >&2
	@$(BUILD)/tests/bench/models/bench_recovery $(BUILD)/bench-recovery $(MODELS)

# FABRICS: some of the tables only, such as FABRICS=merl-blue-fabric. TABLES: a folder of other tables
bench-model-tables: | deps-test ## all models fitted to the measured tables, on one cloth (40 minutes on 2 quiet cores; jobs are kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/models/bench_model_tables.py --build $(BUILD) $(if $(TABLES),--tables $(TABLES)) $(FABRICS)

# THESIS: beginnings of names of steps, such as THESIS="fit.silk cross.silk": only these are made. What is finished is kept in build/bench-thesis
bench-thesis: | deps-test ## chapters 5 and 6 of the fabric thesis: six fabrics by three models, cylinders, drapes, steps left out; writes docs/thesis.md (75 minutes on 2 shared cores; continues when stopped)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/thesis/bench_thesis.py --build $(BUILD) --page docs/thesis.md $(THESIS)

# PICTURES: some of the fabrics only, and options of the program, such as PICTURES="silk --px 256"
bench-pictures: | deps-test ## the fast renderer against path tracing on three fabrics (half an hour on 2 quiet cores)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/pictures/bench_pictures >&2
	@$(BUILD)/tests/bench/pictures/bench_pictures $(PICTURES)

# PILE: some of the cloths only, and options of the program, such as PILE="dark --paths 1024"
bench-pile: | deps-test ## previews of velvets by dual scattering and by diffusion against path tracing (a minute on 2 quiet cores)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/pictures/bench_pile >&2
	@$(BUILD)/tests/bench/pictures/bench_pile $(PILE)

bench-sheared: | deps-test ## previews by sheared filtering: rays and time for equal errors against own rays and other filters (two minutes of a core)
	@$(MAKE) --no-print-directory $(BUILD)/tests/bench/pictures/bench_sheared >&2
	@$(BUILD)/tests/bench/pictures/bench_sheared

bench-tiles: | deps-test ## large tiles of a scan: how far its period stands out of a picture (three minutes of a core; kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/bench_tiles.py --build $(BUILD)

# WEAVES, CONDITIONS: comma-separated, such as WEAVES=twill CONDITIONS=spread,hollow; then without time and memory
bench-geometry: | deps-test ## accuracy of reconstructed fibers on phantoms and real scans; time and memory
	@$(MAKE) --no-print-directory -j$$(nproc) all $(filter %/bench_geometry %/bench_geometry_size %/bench_verdict,$(BENCH_BINS)) >&2
	@$(BUILD)/tests/bench/bench_geometry $(if $(WEAVES),--weaves $(WEAVES)) $(if $(CONDITIONS),--conditions $(CONDITIONS))
	@$(if $(WEAVES)$(CONDITIONS),,$(BUILD)/tests/bench/bench_geometry_size)
	@$(if $(WEAVES)$(CONDITIONS),,/usr/bin/python3 tests/bench/verdict/judge_verdicts.py --build $(BUILD))

bench-geometry-bars: | deps-test ## the figures of flat and of thin fibers that must not fall, in three of the scans of bench-geometry
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_geometry >&2
	@$(BUILD)/tests/bench/bench_geometry --bars 1

# FIT: some of the figures only, such as FIT="gabardine seeds"
bench-fit: | deps-test ## recovery of known parameters, errors, seeds, grazing highlights, real tables (1 h 45 min on 2 quiet cores; photographs are kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_fit >&2
	@$(BUILD)/tests/bench/bench_fit --folder $(BUILD)/bench-fit $(FIT)

# TABLES: a folder of tables of measured reflectance, each judged by the same procedure. CLOTH: some of the tables, recoveries and photo
# pairs only, and of scanned cloths "demo" and "scan"
bench-cloth: | deps-test ## described cloths: fit of measured tables, recovery of known cloths, photo pairs (several hours on 2 quiet cores)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/bench_cloth.py --build $(BUILD) $(if $(TABLES),--tables $(TABLES)) $(CLOTH)
	@$(if $(TABLES),,/usr/bin/python3 tests/bench/bench_pairs.py --build $(BUILD) $(CLOTH))
	@$(if $(TABLES),,/usr/bin/python3 tests/bench/bench_scan_errors.py --build $(BUILD) $(CLOTH))

bench-scan-errors: | deps-test ## scanned cloths: whether the stated errors contain the truth (an hour and a half on 2 quiet cores)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/bench_scan_errors.py --build $(BUILD)

# PROGRESS: some of the jobs, such as PROGRESS="demo fiber_ct weave_ct": fleece alone takes a quarter of an hour
bench-progress: | deps-test ## predicted against actual remaining time of four jobs and of jobs of six kinds, and the largest jump of their progress (35 minutes on 2 quiet cores)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/bench_progress.py --build $(BUILD) $(PROGRESS)
	@$(if $(PROGRESS),,/usr/bin/python3 tests/bench/bench_forecast.py --build $(BUILD))

# DASHBOARD: some of the figures only: first_hour list job slices
bench-dashboard: | deps-test ## clicks and keys to a first job, and what the dashboard costs in a browser: opening a list of 10,000 jobs, bytes of a poll, scripts of a page with a long fit and log, slices of a scan of Fleece's size (three minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/bin/selvedged $(BUILD)/bin/selvedge-worker $(BUILD)/bin/selvedge-phantom $(BUILD)/tests/bench/service/bench_scan_slices >&2
	@/usr/bin/python3 tests/bench/service/bench_dashboard.py --build $(BUILD) $(DASHBOARD)

# SERVICE: some of the figures only: list answers uploads slow_disk declare readers watchers guard
bench-service: | deps-test ## what the daemon costs: the list of jobs, other answers, those beside uploads and a slow disk, declarations, slow readers, long polls, requests beside a large batch, held back bodies (three minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/bin/selvedged >&2
	@/usr/bin/python3 tests/bench/service/bench_service.py --build $(BUILD) $(SERVICE)

# SAMPLES: of the batch (1000)
bench-scale: | deps-test ## what a batch of 1,000 samples costs to submit and to dispatch, the list of 10,000 queued jobs, how far a plan is off, and the scaling over ranks (eight minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@SELVEDGE_BUILD=$(BUILD) /usr/bin/python3 tests/bench/service/bench_scale.py $(SAMPLES)
	@SELVEDGE_BUILD=$(BUILD) /usr/bin/python3 tests/bench/service/bench_plan.py
	@$(MAKE) --no-print-directory bench-ranks

bench-ranks: | deps-test ## strong scaling of one fit over ranks: 2 measured, 64 by a model; of the geometry of a scan over 2 (three minutes on 2 quiet cores; part of bench-scale)
	@$(MAKE) --no-print-directory -j$$(nproc) all $(BUILD)/tests/bench/ranks/rank_messages >&2
	@/usr/bin/python3 tests/bench/ranks/bench_ranks.py $(BUILD)
	@/usr/bin/python3 tests/bench/ranks/bench_rank_scan.py $(BUILD)

docs-ranks:        ## draw docs/images/ranks-scaling.svg anew from the tables of docs/ranks.md, whose rows bench-ranks prints (a second)
	@/usr/bin/python3 tests/bench/ranks/plot_scaling.py docs/ranks.md docs/images/ranks-scaling.svg

EXPORTS_PYTHON := $(BUILD)/exports-python
$(EXPORTS_PYTHON)/bin/packages-are-there:
	@/usr/bin/python3 -m venv $(EXPORTS_PYTHON) && $(EXPORTS_PYTHON)/bin/pip install -q mitsuba numpy usd-core MaterialX >&2 && touch $@
# three.js and Khronos' glTF validator
EXPORTS_NODE := $(BUILD)/exports-node
$(EXPORTS_NODE)/packages-are-there:
	@mkdir -p $(EXPORTS_NODE) && npm install --prefix $(EXPORTS_NODE) --no-audit --no-fund --no-save --ignore-scripts --loglevel=error \
		three@0.187.0 gltf-validator@2.0.0-dev.3.10 >&2 && touch $@
# EXPORTS: a part of it, such as EXPORTS="--only twill,scan --formats mitsuba,blender"; fits and comparisons that are finished are kept in build
bench-exports: $(EXPORTS_PYTHON)/bin/packages-are-there $(EXPORTS_NODE)/packages-are-there | deps-test ## exports of twelve fits rendered by Mitsuba 3 and Blender against the jobs' own renderings (50 minutes on 2 quiet cores; installs Mitsuba and USD from PyPI, three.js from npm into build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/bench_exports.py --build $(BUILD) --python $(EXPORTS_PYTHON)/bin/python $(EXPORTS)

# SIDE: options of the program, such as SIDE="--px 256 --samples 4"
exports-side-by-side: $(EXPORTS_PYTHON)/bin/packages-are-there $(EXPORTS_NODE)/packages-are-there | deps-test ## build/exports-side-by-side.png: one drape in the job, Mitsuba, Blender and three.js (five minutes; the job is kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/exports_side_by_side.py --build $(BUILD) --out $(BUILD)/exports-side-by-side.png $(SIDE)

bench-camera: | deps-test ## mean radiances from raw files of a simulated camera against the true ones (2 minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/camera/bench_camera.py --build $(BUILD)

# CYLINDER: options of the program, such as CYLINDER="--seeds 1 --keep build/bench-cylinder"
.PHONY: bench-cylinder
bench-cylinder: | deps-test ## parameters from two photographs of a cylinder beside those from 16 of flat cloth (40 minutes of a core; continues when stopped)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/camera/bench_cylinder.py --build $(BUILD) $(CYLINDER)

docs-pairs: | deps-test ## draw docs/images/photo-pairs.png anew: renderings of four photo pairs (10 minutes, seconds after bench-cloth)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/bench_pairs.py --build $(BUILD) --picture docs/images/photo-pairs.png >&2

# FABRIC: one of tests/support/cloth/fit_fabrics.c
bench-published: FABRIC ?= microflake
bench-published: | deps-test ## the published method with its own budget, 3.3e9 paths, on FABRIC (microflake: 80 minutes on 2 cores; gabardine: 8 hours; continues when stopped)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_fit >&2
	@nice -n 19 $(BUILD)/tests/bench/bench_fit --folder $(BUILD)/bench-fit --fabric $(FABRIC) --journal $(BUILD)/bench-fit/published-$(FABRIC).journal published

docs-fit-curve: | deps-test ## draw docs/images/fit-curve.svg anew: error against paths of both methods, analytic cloth (seconds)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_fit >&2
	@mkdir -p $(BUILD)/bench-fit docs/images
	@$(BUILD)/tests/bench/bench_fit analytic > $(BUILD)/bench-fit/analytic.json
	@/usr/bin/python3 tests/bench/pictures/plot_fit_curve.py $(BUILD)/bench-fit/analytic.json docs/images/fit-curve.svg

docs-grazing: | deps-test ## draw docs/images/microflake-grazing.svg anew: what each model makes of grazing highlights (minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_fit >&2
	@mkdir -p $(BUILD)/bench-fit docs/images
	@$(BUILD)/tests/bench/bench_fit --folder $(BUILD)/bench-fit grazing > $(BUILD)/bench-fit/grazing.json
	@/usr/bin/python3 tests/bench/pictures/plot_grazing.py $(BUILD)/bench-fit/grazing.json docs/images/microflake-grazing.svg

docs-pictures: | deps-test ## make docs/images/{twill,derivatives,cloth-weaves,cloth-numbers}.png anew (minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/pictures/documentation_pictures $(BUILD)/tests/bench/pictures/cloth_pictures
	@$(BUILD)/tests/bench/pictures/cloth_pictures weaves docs/images/cloth-weaves.png
	@$(BUILD)/tests/bench/pictures/cloth_pictures numbers docs/images/cloth-numbers.png
	@mkdir -p docs/images
	@$(BUILD)/tests/bench/pictures/documentation_pictures twill docs/images/twill.png
	@$(BUILD)/tests/bench/pictures/documentation_pictures derivatives docs/images/derivatives.png

docs-lobes:        ## draw NAME-lobes.svg in every folder of renderer/scattering/models anew, from what the models evaluate (seconds)
	@$(MAKE) --no-print-directory $(BUILD)/tests/bench/models/draw_lobes >&2
	@for rows in renderer/scattering/models/*/*.def; do \
		$(BUILD)/tests/bench/models/draw_lobes $$(sed -nE 's/^(SURFACE|VOLUME)_MODEL\(\w+, "([^"]+)".*/\2/p' $$rows) > $${rows%_rows.def}-lobes.svg || exit 1; done

docs-waves: | deps-test ## draw docs/images/wave-lame.jpg anew: a lame by geometric optics and by waves (ten seconds)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/pictures/wave_film_pictures
	@$(BUILD)/tests/bench/pictures/wave_film_pictures $(BUILD)/wave-lame.png
	@/usr/bin/python3 -c "from PIL import Image; i = Image.open('$(BUILD)/wave-lame.png'); i.resize((2 * i.width, 2 * i.height), 0).save('docs/images/wave-lame.jpg', quality=88)"

docs-speckle: | deps-test ## make docs/images/speckle.png anew: silk without and with speckle (half a minute of a core)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/pictures/speckle_pictures
	@$(BUILD)/tests/bench/pictures/speckle_pictures docs/images/speckle.png

# LOOKS: some of the fabrics only, and options of the program, such as LOOKS="silk --px 96 --reference 8192"
bench-pictures: bench-browser bench-comparison bench-looks
bench-looks: | deps-test ## FLIP of pictures of six fabrics against path-traced references, which are kept in build (2 hours on 2 quiet cores; part of bench-pictures)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/bench_looks.py --build $(BUILD) $(LOOKS)

bench-comparison: | deps-test ## noise of renderings beside that of their photographs (a minute; part of bench-pictures)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/bench_comparison.py --build $(BUILD)

bench-browser: | deps-test ## the twin in headless Chromium against the path-traced picture of the same view (2 minutes; part of bench-pictures)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/bench_twin.py --build $(BUILD)

docs-columns: | deps-test ## draw docs/images/cylinder-columns.svg anew: column means on a cylinder under five lamps (a minute; kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/cylinder_columns.py --build $(BUILD) --out docs/images/cylinder-columns.svg

docs-fabrics: | deps-test ## make docs/images/six-fabrics.png anew: the fabrics of Table 5.3 on a cylinder and draped (15 minutes on two cores; kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/six_fabrics.py --build $(BUILD) --out docs/images/six-fabrics.png

gallery: | deps-test ## make the pictures of docs/gallery.md anew: six fabrics in the studio, four views of 1,024 pixels each (an hour on two cores; kept in build; GALLERY="--px 400 --samples 6 twill": quicker)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/gallery.py --build $(BUILD) --out docs/images/gallery $(GALLERY)

docs-lame: | deps-test ## make docs/images/{lame.webp,sequins.jpg} anew: a drape of lame under a lamp that goes around, and sequins (ten minutes of a core; kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/lame_pictures.py --build $(BUILD) --out docs/images/lame.webp
	@/usr/bin/python3 tests/bench/pictures/sequin_picture.py --build $(BUILD) --out docs/images/sequins.jpg

docs-ground: | deps-test ## make docs/images/ground-shadow.png anew: cloths over a plane, as rendered and filtered (half a minute of a core; kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/ground_pictures.py --build $(BUILD) --out docs/images/ground-shadow.png

docs-seam: | deps-test ## draw docs/images/seam.png anew: the seam of a scanned twill as traced and joined (a minute; kept in build)
	@$(MAKE) --no-print-directory -j$$(nproc) all >&2
	@/usr/bin/python3 tests/bench/pictures/seam_pictures.py --build $(BUILD) --out docs/images/seam.png

docs-bowl: | deps-test ## make docs/images/fiber-bowl.png anew: a bowl below a fiber by rays, and the angles that are found in it (some seconds)
	@$(MAKE) --no-print-directory -j$$(nproc) all $(BUILD)/tests/bench/models/bench_bowl >&2
	@mkdir -p $(BUILD)/docs-bowl
	@$(BUILD)/tests/bench/models/bench_bowl $(BUILD)/docs-bowl
	@$(BUILD)/bin/selvedge bowl $(BUILD)/docs-bowl/job.json --out $(BUILD)/docs-bowl/hair.csv --picture docs/images/fiber-bowl.png

bench-weave: | deps-test ## share of drawn weaves whose yarns and draft are found (3 minutes)
	@$(MAKE) --no-print-directory -j$$(nproc) $(BUILD)/tests/bench/bench_weave >&2
	@$(BUILD)/tests/bench/bench_weave

# the photographs stay where they are, and so do pictures made of them: only our diagram of the drafts is part of docs
WEAVE_PAIRS := satin1 twill1 twill2 twill3
WEAVE_DATA = $(or $(SELVEDGE_DATA),../shared/data)/reflection-transmission-photos
bench-weave-rendered: $(BUILD)/bin/selvedge-phantom ## the same for renderings of described cloths (3 minutes); the table goes to stderr
	@/usr/bin/python3 tests/bench/bench_weave_rendered.py $(BUILD) $(BUILD)/bench-weave-rendered

docs-weave: $(BUILD)/bin/selvedge-phantom ## draw docs/images/weave-drafts.svg anew: drafts found in real photographs; build/docs-weave/*.png shows them over the photographs
	@mkdir -p $(BUILD)/docs-weave docs/images
	@for n in $(WEAVE_PAIRS); do for k in R T; do \
		$< detect --photograph $(WEAVE_DATA)/$${n}_$$k.png --overlay $(BUILD)/docs-weave/$${n}_$$k.png >/dev/null || exit 1; done; \
		$< detect --photograph $(WEAVE_DATA)/$${n}_R.png --photograph $(WEAVE_DATA)/$${n}_T.png \
			> $(BUILD)/docs-weave/$$n.json || exit 1; done
	@/usr/bin/python3 tests/bench/pictures/plot_weave.py docs/images/weave-drafts.svg \
		$(foreach n,$(WEAVE_PAIRS),$(n)=$(BUILD)/docs-weave/$(n).json)
