# The zoo: files as other programs write them, read by the readers under sanitizers (tests/zoo/README.md).
.PHONY: zoo zoo-reader bench-files
ZOO_PYTHON := $(BUILD)/zoo-python
ZOO_READER := $(BUILD)/zoo/tests/zoo/read_files
ZOO_C := tests/zoo/read_files.c $(shell find base geometry/volume renderer/image optimizer/photographs/reader -name '*.c')
$(BUILD)/tests/zoo/read_files: $(call objs,$(ZOO_C))
	@mkdir -p $(@D)
	@echo "  LINK $@"
	@$(CC) $(LDFLAGS) -o $@ $^ $(LINK_OPTIMIZER)
zoo-reader:
	@$(MAKE) --no-print-directory -j$$(nproc) BUILD=$(BUILD)/zoo SANITIZE=address,undefined OPTIMIZE=-O1 CFLAGS=-fno-sanitize-recover=all \
		$(BUILD)/zoo/tests/zoo/read_files

# the programs that say what is right; where they cannot be installed, the test is skipped with the reason
$(ZOO_PYTHON)/installed: tests/zoo/requirements.txt
	@/usr/bin/python3 -m venv $(ZOO_PYTHON) && $(ZOO_PYTHON)/bin/pip install -q --disable-pip-version-check -r $< && cp $< $@
zoo: zoo-reader
	@$(MAKE) --no-print-directory $(ZOO_PYTHON)/installed >$(BUILD)/zoo-python.log 2>&1 || \
		echo "the zoo is left out, its packages cannot be installed: $$(tail -n 1 $(BUILD)/zoo-python.log)"

# FILES: parts of names of files, such as FILES="nrrd metaimage"
bench-files: | deps-test ## files of other programs that are read right, refused, or read wrong without a word (a minute; installs packages from PyPI into build)
	@$(MAKE) --no-print-directory zoo >&2
	@$(ZOO_PYTHON)/bin/python tests/zoo/zoo.py --reader $(ZOO_READER) $(FILES)
